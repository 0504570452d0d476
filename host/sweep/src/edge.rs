//! The edges at which the grasp begins to fail, for sweeps of one number; and the bisection that finds them more closely.

use super::axis::{Axis, Scale, Value};
use super::plan::Plan;
use super::run::{Row, run_some};
use blindgrasp_record::table::Kind;
use serde::Serialize;
use std::collections::BTreeMap;

/// An edge at zero has no relative width: it is bisected down to this share of the whole range.
const FINEST: f64 = 1e-6;

/// Two neighbouring values, at one of which the grasp is held and at the other lost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Edge {
    /// Held here, with every seed.
    pub held: f64,
    /// Lost here, with one seed at least.
    pub lost: f64,
}

/// Neighbouring values at all of which the same becomes of the grasp.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stretch {
    /// The smallest of them.
    pub from: f64,
    /// The largest.
    pub to: f64,
    /// `true` if the grasp is held, with every seed.
    pub held: bool,
}

/// A sweep that came to its end, or to the one that somebody wanted.
#[derive(Clone, Debug)]
pub struct Swept {
    /// The results of the runs, in the order of their numbers.
    pub rows: Vec<Row>,
    /// `true` if they are all there.
    pub is_whole: bool,
}

/// Returns the edges at which the grasp begins to fail, in the order of the values; nothing if several keys are varied,
/// or words. Values that the scene refuses count as if they were not there.
pub fn edges(plan: &Plan, rows: &[Row]) -> Vec<Edge> {
    let stretches = stretches(plan, rows);
    let edge = |pair: &[Stretch]| {
        let (below, above) = (pair[0].to, pair[1].from);
        if pair[0].held { Edge { held: below, lost: above } } else { Edge { held: above, lost: below } }
    };
    stretches.windows(2).map(edge).collect()
}

/// Returns the stretches in which the grasp is held and in which it is lost, in the order of the values; between them
/// are the [`edges`].
pub fn stretches(plan: &Plan, rows: &[Row]) -> Vec<Stretch> {
    let verdicts = verdicts(plan, rows);
    let same = verdicts.chunk_by(|(_, held), (_, next)| held == next);
    same.map(|same| Stretch { from: same[0].0, to: same[same.len() - 1].0, held: same[0].1 }).collect()
}

/// Runs a plan on all cores, all but the rows that are `known`; then, if `refine` is given, adds values to it where the grasp
/// begins to fail, until the edges are no wider than that, relative to the larger of their values.
///
/// `each` and `goes_on` are as in [`run_some`].
///
/// # Errors
/// That of `each`.
pub fn run_refined<E: Send>(
    plan: &mut Plan,
    known: Vec<Row>,
    refine: Option<f64>,
    each: impl Fn(&Row) -> Result<(), E> + Sync,
    goes_on: impl Fn() -> bool + Sync,
) -> Result<Swept, E> {
    let mut known: BTreeMap<usize, Row> = known.into_iter().map(|row| (row.run, row)).collect();
    loop {
        let missing: Vec<usize> = (0..plan.runs()).filter(|run| !known.contains_key(run)).collect();
        let new = run_some(plan, &missing, &each, &goes_on)?;
        let is_whole = new.len() == missing.len();
        known.extend(new.into_iter().map(|row| (row.run, row)));
        let rows: Vec<Row> = known.range(..plan.runs()).map(|(_, row)| row.clone()).collect();
        let more = refine.filter(|_| is_whole).map_or(Vec::new(), |width| between(plan, &rows, width));
        if more.is_empty() {
            return Ok(Swept { rows, is_whole });
        }
        plan.add(more);
    }
}

/// Values of the only axis, in their order, and whether the grasp is held at them with every seed.
fn verdicts(plan: &Plan, rows: &[Row]) -> Vec<(f64, bool)> {
    let [Axis { values, .. }] = plan.axes() else { return Vec::new() };
    let mut held = vec![None; values.len()];
    for row in rows {
        if let Some(summary) = row.summary() {
            let held = &mut held[plan.place(row.run)[0]];
            *held = Some(held.unwrap_or(true) && summary.grasp_held);
        }
    }
    let pairs = values.iter().zip(held);
    let mut verdicts: Vec<(f64, bool)> =
        pairs.filter_map(|(value, held)| Some((value.number?, held?))).collect();
    verdicts.sort_by(|a, b| a.0.total_cmp(&b.0));
    verdicts
}

/// Values that halve the edges that are too wide.
pub(super) fn between(plan: &Plan, rows: &[Row], width: f64) -> Vec<Value> {
    let [axis] = plan.axes() else { return Vec::new() };
    let numbers = || axis.values.iter().filter_map(|value| value.number);
    let span = numbers().fold(f64::NEG_INFINITY, f64::max) - numbers().fold(f64::INFINITY, f64::min);
    let is_wide = |Edge { held, lost }: &Edge| {
        let finest = if held * lost > 0.0 { width * held.abs().max(lost.abs()) } else { FINEST * span };
        (held - lost).abs() > finest
    };
    let whole = plan.kind(0) == Kind::Whole;
    edges(plan, rows)
        .into_iter()
        .filter(is_wide)
        .filter_map(|Edge { held, lost }| roundest(held.min(lost), held.max(lost), axis.scale, whole))
        // One that was refused is asked for again.
        .filter(|middle| numbers().all(|number| number != *middle))
        .map(Value::number)
        .collect()
}

/// The decimal with the fewest digits in the middle third between two numbers: one that people would choose, and that is a
/// whole number of microseconds where one is asked for.
fn roundest(low: f64, high: f64, scale: Scale, whole: bool) -> Option<f64> {
    let is_logarithmic = scale == Scale::Logarithmic && low > 0.0;
    let to = |v: f64| if is_logarithmic { v.ln() } else { v };
    let middle = 0.5 * (to(low) + to(high));
    let reach = (to(high) - to(low)) / 6.0;
    let around = if is_logarithmic { middle.exp() } else { middle };
    let largest = (high - low).log10().floor() as i32;
    (0..16).map(|k| largest - k).take_while(|power| !whole || *power >= 0).find_map(|power| {
        let near = format!("{:.0}e{power}", around / 10_f64.powi(power)).parse::<f64>().ok()?;
        ((to(near) - middle).abs() <= reach * (1.0 + 1e-9) && low < near && near < high).then_some(near)
    })
}
