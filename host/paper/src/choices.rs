//! Choices where the paper is silent or contradicts itself: what was chosen, and how much the answer hangs on it.

use super::claim::{number, percent};
use super::evidence::{Done, Evidence, EvidenceError};
use super::sensitivity::{Sweep, outcome};
use blindgrasp_sim::sample::Sample;
use serde::Serialize;

/// A choice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// The place in the paper.
    pub place: &'static str,
    /// The words that are printed there, or not.
    pub printed: &'static str,
    /// The choice.
    pub chosen: &'static str,
    /// The weight of the choice, with what was measured.
    pub depends: String,
}

const NOT_VARIED: &str = "not varied here";

/// All choices.
///
/// # Errors
/// A run that is needed is not in the evidence.
pub fn all(evidence: &Evidence, sweeps: &[Sweep]) -> Result<Vec<Choice>, EvidenceError> {
    let arm = evidence.run("hand-arm")?;
    let cube = evidence.run("cube")?;
    let ideal = evidence.run("cube-continuous")?;
    let choice = |place, printed, chosen, depends: String| Choice { place, printed, chosen, depends };
    Ok(vec![
        choice(
            "Eq. 14",
            "f = k dr^2 + xi dr",
            "the second term is a damper, xi d(dr)/dt",
            "as printed it would be a second spring, and nothing would damp the normal motion".to_owned(),
        ),
        choice("Eq. 21", "I d2w/dt2", "I dw/dt + w x I w", "the print's units do not agree".to_owned()),
        choice(
            "Eq. 28",
            "multipliers from accelerations",
            "multipliers that hold the rolling constraint at velocity level",
            "the print's constraint drifts; here it holds to rounding".to_owned(),
        ),
        choice(
            "Eq. 32",
            "an attitude error of 2 sin a, which falls where fingertips are turned by more than 90 degrees",
            "as printed; attitude_error = \"half-angle\" has 4 sin(a/2), which is the same at small turns",
            format!("{}; {}", ends(arm), ends(evidence.run("hand-arm-half-angle")?)),
        ),
        choice(
            "Eqs. 39 and 50",
            "T_i + xi dr^2",
            "2 T_i + xi (d(dr)/dt)^2",
            format!(
                "with T_i instead of 2 T_i, the balance of the run hand-arm would miss {} of what was dissipated in all",
                percent(torsion_share(arm))
            ),
        ),
        choice(
            "Eq. 46",
            "elastic energy about the indentation at which f_i = f_d",
            "the elastic energy of Eq. 18",
            format!(
                "what Eq. 46 takes away is f_d times the indentation, which changes as the fingertips roll: by {} J in the run \
                 cube-continuous, where {} J are dissipated in all; the balance would miss it",
                number(taken_by_equation_46(ideal)),
                number(dissipated(ideal))
            ),
        ),
        choice(
            "Table I, object",
            "0.0018 kg with 1.35e-3 kg m^2, which no body of 0.42 m has",
            "kept in the scene hand-arm; mass and inertia of a foam body in hand-arm-consistent",
            format!("{}; {}", ends(arm), ends(evidence.run("hand-arm-consistent")?)),
        ),
        choice(
            "Table I, links",
            "inertias beside the centres of mass",
            "they are about the near joint, as their numbers show",
            NOT_VARIED.to_owned(),
        ),
        choice(
            "Sec. 5",
            "no joint axes, no finger bases",
            "those with which Tables I and III meet: see docs/equations.md and the hand's file",
            format!(
                "indentations of {} mm at the start follow from it",
                arm.scene
                    .start
                    .indentations_m
                    .iter()
                    .map(|m| format!("{:.2}", 1e3 * m))
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
        ),
        choice(
            "Sec. 5",
            "no sampling period",
            "1 ms, as in the experiments",
            format!("{}; {}", ends(arm), ends(evidence.run("hand-arm-continuous")?)),
        ),
        choice(
            "Table II",
            "K_st = 0.05238 N m",
            "as printed",
            format!("{}; {}", ends(arm), ends(evidence.run("hand-arm-stiff")?)),
        ),
        choice(
            "Table IV",
            "no xi, no b, no link inertias for the hand of the experiments",
            "the xi and b of Table I with this fingertip's own contact area; uniform cylinders",
            [outcome(sweeps, "normal-viscosity"), outcome(sweeps, "torsional-viscosity")].join("; "),
        ),
        choice(
            "Table V",
            "maximum torque 257 N m",
            "257 mN m at the motor, 1.39 N m behind the gear",
            format!("the largest torque in the run cube is {} N m", number(largest_torque(cube))),
        ),
        choice(
            "Sec. 6",
            "no joint friction, though it is said to help against the weight",
            "4.7 mN m at each joint, from a motor of that class",
            [outcome(sweeps, "friction"), outcome(sweeps, "friction-without-delay")].join("; "),
        ),
        choice(
            "Sec. 6",
            "no initial condition",
            "fingertips in the middle of the faces, just touching; the force rises over 0.3 s",
            NOT_VARIED.to_owned(),
        ),
        choice(
            "Table VI",
            "triangular pyramid",
            "triangular prism, as everywhere else",
            NOT_VARIED.to_owned(),
        ),
    ])
}

/// Returns the end of a run, in words.
fn ends(done: &Done) -> String {
    match (done.summary().lost_at_s, done.summary().settle_time_s) {
        (Some(t_s), _) => format!("{}: lost at {t_s:.1} s", done.name),
        (None, Some(t_s)) => format!("{}: at rest from {t_s:.2} s on", done.name),
        (None, None) => format!("{}: held for {:.0} s", done.name, done.summary().duration_s),
    }
}

/// Half of what torsion took, of all that was dissipated.
fn torsion_share(done: &Done) -> f64 {
    let last = done.run.samples.last().map(|sample| sample.energies).unwrap_or_default();
    0.5 * last.torsion_j / dissipated(done)
}

fn dissipated(done: &Done) -> f64 {
    done.run.samples.last().map_or(0.0, |sample| sample.energies.dissipated_j() + sample.energies.damping_j)
}

fn taken_by_equation_46(done: &Done) -> f64 {
    let indentations =
        |sample: &Sample| sample.contacts.iter().map(|contact| contact.indentation_m).sum::<f64>();
    let samples = &done.run.samples;
    let change = samples.last().zip(samples.first()).map_or(0.0, |(a, b)| indentations(a) - indentations(b));
    (done.scene.control.force_n() * change).abs()
}

fn largest_torque(done: &Done) -> f64 {
    let torques = done.run.samples.iter().flat_map(|sample| &sample.torques_nm);
    torques.fold(0.0, |most, torque| most.max(torque.abs()))
}
