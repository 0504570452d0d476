//! The results of a sweep in a few numbers.

use super::edge::{Edge, edges};
use super::plan::Plan;
use super::run::{Outcome, Row};
use serde::Serialize;

/// The results of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Overview {
    /// Name of the scene.
    pub scene: String,
    /// The keys that were varied.
    pub varied: Vec<Varied>,
    /// The number of seeds that each combination was run with.
    pub seeds: u32,
    /// The number of runs.
    pub runs: usize,
    /// The number of them that bisection added.
    pub added: usize,
    /// In how many the grasp held.
    pub held: usize,
    /// In how many of these everything came to rest.
    pub settled: usize,
    /// In how many the grasp was lost.
    pub lost: usize,
    /// The number of them that the scene refused.
    pub refused: usize,
    /// The reason for which it refused the first of them.
    pub refused_reason: Option<String>,
    /// The edges at which the grasp begins to fail, if one key was varied that takes numbers.
    pub edges: Vec<Edge>,
}

/// A key that was varied.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Varied {
    /// The key.
    pub key: String,
    /// Its unit; empty where there is none.
    pub unit: &'static str,
    /// Its values, as `--set` takes them.
    pub values: Vec<String>,
}

impl Overview {
    /// Of the rows of a plan.
    pub fn of(plan: &Plan, rows: &[Row]) -> Self {
        let ran = || rows.iter().filter_map(Row::summary);
        let held = ran().filter(|summary| summary.grasp_held).count();
        let reason = |row: &Row| match &row.outcome {
            Outcome::Refused(reason) => Some(reason.clone()),
            Outcome::Ran(_) => None,
        };
        let varied = plan.axes().iter().map(|axis| Varied {
            key: axis.key.clone(),
            unit: axis.unit(),
            values: axis.values.iter().map(|value| value.text.clone()).collect(),
        });
        Self {
            scene: plan.name().to_owned(),
            varied: varied.collect(),
            seeds: plan.seeds(),
            runs: rows.len(),
            added: plan.added(),
            held,
            settled: ran().filter(|summary| summary.settled).count(),
            lost: ran().count() - held,
            refused: rows.len() - ran().count(),
            refused_reason: rows.iter().find_map(reason),
            edges: edges(plan, rows),
        }
    }
}
