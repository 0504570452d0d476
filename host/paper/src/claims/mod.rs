//! The claims of the paper, a file for each group.

mod arbitrary;
mod balance;
mod bound;
mod earlier;
mod energy;
mod forces;
mod moved;
mod normal_only;
mod reach;
mod rest;
mod start;
#[cfg(test)]
mod tests;
mod wrench;

use super::claim::{Claim, Row, Verdict};
use super::earlier::Comparison;
use super::evidence::{Done, Evidence, EvidenceError};
use super::polyhedra::Polyhedra;
use super::sensitivity::Sweep;
use blindgrasp_body::dynamics::JointVector;
use blindgrasp_body::{Hand, Posture};
use blindgrasp_shared::hand::Wrench;
use blindgrasp_sim::sample::Sample;

/// Every claim, in the order of the paper's equations.
///
/// # Errors
/// A run that a claim needs is not in the evidence.
pub fn all(
    evidence: &Evidence,
    sweeps: &[Sweep],
    comparison: &Comparison,
    polyhedra: &Polyhedra,
) -> Result<Vec<Claim>, EvidenceError> {
    Ok(vec![
        start::table_iii(evidence)?,
        start::latch(evidence)?,
        rest::contact(evidence)?,
        energy::balance(evidence)?,
        energy::order(evidence)?,
        energy::falls(evidence)?,
        bound::bound(evidence)?,
        energy::square_integrable(evidence)?,
        reach::reach(evidence)?,
        forces::residuals(evidence)?,
        forces::tangential(evidence)?,
        forces::nothing_normal(evidence)?,
        forces::normal(evidence)?,
        rest::rest(evidence)?,
        rest::transient(evidence)?,
        normal_only::normal_only(evidence)?,
        normal_only::region(sweeps),
        wrench::balanced(evidence)?,
        start::weight(evidence)?,
        arbitrary::arbitrary(polyhedra),
        earlier::effective(comparison, polyhedra),
        earlier::expanded(polyhedra),
        earlier::force(comparison),
        earlier::pose(comparison),
        earlier::disturbs(comparison),
        moved::converges(comparison),
        moved::arm(comparison),
    ])
}

/// The runs of some names.
fn runs<'a>(evidence: &'a Evidence, names: &[&str]) -> Result<Vec<&'a Done>, EvidenceError> {
    names.iter().map(|name| evidence.run(name)).collect()
}

/// The instant at which the forces of a run are looked at: its end; or, of a grasp that was lost, when it was calmest after
/// its first second.
fn calm(done: &Done) -> Option<&Sample> {
    let samples = &done.run.samples;
    if done.summary().grasp_held {
        return samples.last();
    }
    let late = samples.iter().filter(|sample| sample.t_s >= 1.0);
    late.min_by(|a, b| a.energies.kinetic_j.total_cmp(&b.energies.kinetic_j)).or(samples.last())
}

/// Largest of some values; NaN if one is.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| if value > most || value.is_nan() { value } else { most })
}

/// Returns the time and the reason of a loss, in words.
fn lost(done: &Done) -> Option<String> {
    let summary = done.summary();
    summary.lost_at_s.map(|t_s| {
        format!("LOST at {t_s:.2} s: {}", summary.lost_reason.as_deref().unwrap_or("of an unknown reason"))
    })
}

/// Joint torques of a force and a moment on a fingertip, `J^T f + J_Omega^T m`, N m.
fn joint_torques(hand: &Hand, posture: &Posture, finger: usize, wrench: &Wrench<f64>) -> JointVector {
    let (linear, angular) = hand.jacobians(posture, finger);
    let torques = linear.tr_mul(&wrench.force_n) + angular.tr_mul(&wrench.moment_nm);
    std::array::from_fn(|k| torques[k])
}

/// A row.
fn row(done: &Done, measured: String, verdict: Verdict) -> Row {
    Row { run: done.name.clone(), measured, figures: Vec::new(), verdict, remark: String::new() }
}
