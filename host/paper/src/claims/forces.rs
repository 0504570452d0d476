//! The forces of the equilibrium (Eqs. 51 to 57, Figs. 8 and 13).

use super::balance::{Holder, torsion_time_s};
use super::{calm, largest, row, runs};
use crate::claim::{Claim, Figure, Row, Verdict, number, percent};
use crate::evidence::{Done, Evidence, EvidenceError};
use blindgrasp_sim::sample::{ContactSample, Sample};

/// Part of a force, or of it times the fingertip's radius, that may be left.
const LEFT: f64 = 0.01;

const RUNS: [&str; 6] =
    ["prism", "cube", "prism-continuous", "cube-continuous", "hand-arm", "hand-arm-stiff"];

const TOLERANCE: &str = "Looked at when the run ends; a grasp that was lost, when it was calmest. 1 % is above what stuck joints hold \
    of a normal force (4.7 mN m over a finger of 0.1 m are 0.05 N of 3 to 4 N), and far below what unbalanced forces would \
    show.";

pub(super) fn residuals(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    Ok(Claim {
        key: "residuals",
        words: "The residuals of the closed loop vanish: all external forces converge to zero",
        place: "Eqs. 51 and 52, Fig. 8",
        criterion: "every force of Eq. 38 is below 1 % of the largest normal force, every moment below 1 % of that force times \
                    the fingertip's radius",
        tolerance: TOLERANCE,
        rows: runs(evidence, &RUNS)?.into_iter().map(residual_row).collect(),
    })
}

pub(super) fn residual_row(done: &Done) -> Row {
    let Some(sample) = calm(done) else { return none(done) };
    let scale = Scale::of(done, sample);
    let force = largest(sample.contacts.iter().map(|c| c.force_residual_n.norm()));
    let moment = largest(sample.contacts.iter().map(|c| c.moment_residual_nm.norm()));
    let (force_share, moment_share) = (force / scale.force_n, moment / scale.moment_nm);
    let holds = force_share < LEFT && moment_share < LEFT;
    let holder = Holder::of(done, sample);
    let mut row = row(
        done,
        format!(
            "force {} N ({}), moment {} N m ({}), at {:.1} s",
            number(force),
            percent(force_share),
            number(moment),
            percent(moment_share),
            sample.t_s
        ),
        judged(done, holds, holder),
    );
    if !holds {
        row.remark = remark(done, sample, holder);
    }
    row.figures = vec![
        Figure::new("force_residual", force, "N"),
        Figure::new("moment_residual", moment, "N m"),
        Figure::new("at", sample.t_s, "s"),
    ];
    row.figures.extend(match holder {
        Holder::Friction(share) => Some(Figure::new("share_of_coulomb_friction", share, "")),
        Holder::Viscosity(left) => Some(Figure::new("left_by_viscosity", left, "")),
        Holder::Nothing => None,
    });
    row
}

/// Returns the reason for which a residual is still there, in words.
fn remark(done: &Done, sample: &Sample, holder: Holder) -> String {
    match holder {
        Holder::Friction(share) => format!(
            "the paper's hand has no joint friction. Here stuck joints hold what is left, the most loaded one with {} of its \
             Coulomb friction",
            percent(share)
        ),
        Holder::Viscosity(left) => {
            let time = torsion_time_s(done, sample).map_or(String::new(), |time_s| {
                format!("; it lets go with a time constant b / K_st of about {} s", number(time_s))
            });
            format!(
                "the torsional viscosity of the fingertips and the damping hold what is left (all but {} of the sum of Eq. 35){time}",
                percent(left)
            )
        }
        Holder::Nothing => "things still accelerate".to_owned(),
    }
}

/// The verdict: what is held by something that is known differs as explained, unless the grasp was lost.
fn judged(done: &Done, holds: bool, holder: Holder) -> Verdict {
    let held = done.summary().grasp_held;
    Verdict::of(holds && held, held && holder.is_known())
}

pub(super) fn tangential(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    Ok(Claim {
        key: "tangential",
        words: "u_st makes a counter force that balances the tangential force of u_s",
        place: "Eqs. 53 and 54",
        criterion: "both sides of each equation agree with the multiplier to 1 % of the largest normal force",
        tolerance: TOLERANCE,
        rows: runs(evidence, &RUNS)?.into_iter().map(tangential_row).collect(),
    })
}

/// Returns the differences of the multipliers from what `u_s` asks for, and from what `u_st` supplies, N.
fn tangential_errors(done: &Done, finger: usize, contact: &ContactSample) -> [f64; 2] {
    let (force, moment) = (contact.force_residual_n, contact.moment_residual_nm);
    let rolling_m = done.scene.hand.radius_m(finger) - contact.indentation_m;
    let flat = |x: f64, z: f64| nalgebra::Vector2::new(x, z).norm();
    [flat(force.x, force.z), flat(moment.x, moment.z) / rolling_m]
}

pub(super) fn tangential_row(done: &Done) -> Row {
    let Some(sample) = calm(done) else { return none(done) };
    let scale = Scale::of(done, sample);
    let errors = sample.contacts.iter().enumerate().map(|(i, c)| tangential_errors(done, i, c));
    let [asked, supplied] = [0, 1].map(|side| largest(errors.clone().map(|error| error[side])));
    let tangential = largest(sample.contacts.iter().map(ContactSample::tangential_force_n));
    let shares = [asked / scale.force_n, supplied / scale.force_n];
    let holds = shares.iter().all(|share| *share < LEFT);
    let holder = Holder::of(done, sample);
    let mut row = row(
        done,
        format!(
            "tangential force {} N; off by {} N ({}) from u_s, by {} N ({}) from u_st",
            number(tangential),
            number(asked),
            percent(shares[0]),
            number(supplied),
            percent(shares[1])
        ),
        judged(done, holds, holder),
    );
    if !holds {
        row.remark = remark(done, sample, holder);
    }
    row.figures = vec![
        Figure::new("tangential_force", tangential, "N"),
        Figure::new("off_from_u_s", asked, "N"),
        Figure::new("off_from_u_st", supplied, "N"),
    ];
    row
}

pub(super) fn nothing_normal(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    Ok(Claim {
        key: "nothing-normal",
        words: "u_st adds nothing normal to the surfaces",
        place: "Eq. 55",
        criterion: "C_iY . K_st B_sti is below 1 % of the largest normal force times the fingertip's radius",
        tolerance: TOLERANCE,
        rows: runs(evidence, &RUNS)?.into_iter().map(nothing_normal_row).collect(),
    })
}

pub(super) fn nothing_normal_row(done: &Done) -> Row {
    let Some(sample) = calm(done) else { return none(done) };
    let scale = Scale::of(done, sample);
    let moment = largest(sample.contacts.iter().map(|c| c.moment_residual_nm.y.abs()));
    let share = moment / scale.moment_nm;
    let holder = Holder::of(done, sample);
    let holds = share < LEFT;
    let mut row =
        row(done, format!("{} N m ({})", number(moment), percent(share)), judged(done, holds, holder));
    if !holds {
        row.remark = remark(done, sample, holder);
    }
    row.figures = vec![Figure::new("normal_moment", moment, "N m")];
    row
}

pub(super) fn normal(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    Ok(Claim {
        key: "normal-force",
        words: "The grasping force becomes f_d / sum(r) C_iY . (x_c - x_i)",
        place: "Eqs. 56 and 57",
        criterion: "every normal force is within 1 % of it",
        tolerance: TOLERANCE,
        rows: runs(evidence, &RUNS)?.into_iter().map(normal_row).collect(),
    })
}

pub(super) fn normal_row(done: &Done) -> Row {
    let Some(sample) = calm(done) else { return none(done) };
    let error = |c: &ContactSample| (c.normal_force_n / c.desired_normal_force_n - 1.0).abs();
    let worst = largest(sample.contacts.iter().map(error));
    let forces: Vec<String> = sample.contacts.iter().map(|c| number(c.normal_force_n)).collect();
    let desired: Vec<String> = sample.contacts.iter().map(|c| number(c.desired_normal_force_n)).collect();
    let (holds, holder) = (worst < LEFT, Holder::of(done, sample));
    let words = format!("{} N for {} N: within {}", forces.join(", "), desired.join(", "), percent(worst));
    let mut row = row(done, words, judged(done, holds, holder));
    row.figures = vec![Figure::new("largest_error", worst, "")];
    if !holds {
        row.remark = remark(done, sample, holder);
    }
    row
}

/// The sizes that forces and moments are compared with.
struct Scale {
    force_n: f64,
    moment_nm: f64,
}

impl Scale {
    fn of(done: &Done, sample: &Sample) -> Self {
        let force_n = largest(sample.contacts.iter().map(|contact| contact.normal_force_n));
        let hand = &done.scene.hand;
        let radius_m = largest((0..hand.fingertip_count()).map(|i| hand.radius_m(i)));
        Self { force_n, moment_nm: force_n * radius_m }
    }
}

/// A run that was lost before its first sample shows nothing.
fn none(done: &Done) -> Row {
    row(done, "no sample".to_owned(), Verdict::NotReproduced)
}
