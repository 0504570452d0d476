//! The runs of a sweep, on all cores.

use super::plan::Plan;
use blindgrasp_sim::Simulation;
use blindgrasp_sim::summary::Summary;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::convert::Infallible;

/// A run, and what came of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Number of the run in its plan, from 0.
    pub run: usize,
    /// The outcome.
    pub outcome: Outcome,
}

/// The outcome of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// The scene refuses the values, for this reason.
    Refused(String),
    /// It ran. All of its verdict but the computing time is the same whenever and wherever it is run.
    Ran(Box<Summary>),
}

impl Row {
    /// The verdict, if it ran.
    pub fn summary(&self) -> Option<&Summary> {
        match &self.outcome {
            Outcome::Refused(_) => None,
            Outcome::Ran(summary) => Some(summary),
        }
    }
}

/// Runs a whole plan on all cores. Rows are in the order of the plan, and independent of the number of cores.
pub fn run(plan: &Plan) -> Vec<Row> {
    let runs: Vec<usize> = (0..plan.runs()).collect();
    let Ok(rows) = run_some(plan, &runs, |_| Ok::<(), Infallible>(()), || true);
    rows
}

/// Runs some of a plan on all cores. `each` gets every row as soon as it is there, in any order; its first error ends it all.
/// `goes_on` is asked often; once it says no, nothing more is begun, and what is under way is left without a row.
///
/// # Errors
/// That of `each`.
pub fn run_some<E: Send>(
    plan: &Plan,
    runs: &[usize],
    each: impl Fn(&Row) -> Result<(), E> + Sync,
    goes_on: impl Fn() -> bool + Sync,
) -> Result<Vec<Row>, E> {
    let one = |&run: &usize| -> Result<Option<Row>, E> {
        match goes_on().then(|| outcome(plan, run, &goes_on)).flatten() {
            Some(outcome) => {
                let row = Row { run, outcome };
                each(&row)?;
                Ok(Some(row))
            }
            None => Ok(None),
        }
    };
    // One at a time, since their lengths differ: so no core waits long for the last.
    let rows: Vec<Option<Row>> = runs.par_iter().with_max_len(1).map(one).collect::<Result<_, _>>()?;
    Ok(rows.into_iter().flatten().collect())
}

/// Returns the outcome of a run; nothing if it was stopped.
fn outcome(plan: &Plan, run: usize, goes_on: impl Fn() -> bool) -> Option<Outcome> {
    let scene = match plan.scene(run) {
        Ok(scene) => scene,
        Err(error) => return Some(Outcome::Refused(error.to_string())),
    };
    let mut simulation = match Simulation::new(&scene) {
        Ok(simulation) => simulation,
        Err(error) => return Some(Outcome::Refused(format!("scene {}: {error}", scene.name))),
    };
    for tick in 0_u64.. {
        match simulation.step() {
            Ok(None) => break,
            Ok(Some(_)) if tick.is_multiple_of(100) && !goes_on() => return None,
            Ok(Some(_)) => {}
        }
    }
    Some(Outcome::Ran(Box::new(simulation.summary())))
}
