//! The claim that `u_st` can supply the counter force which Eqs. 53 and 54 ask for at all.
//!
//! `B_sti` is a sum of two axial vectors of rotation matrices, one for each neighbour. Such a vector is twice the sine of the
//! angle long, so that no turn of the fingertips makes `K_st |B_sti|` larger than `4 K_st`. Eqs. 53 and 54 ask it to balance the
//! tangential force of `u_s` times the rolling radius.

use super::{calm, largest, row, runs};
use crate::claim::{Claim, Figure, Row, Verdict, number};
use crate::evidence::{Done, Evidence, EvidenceError};
use blindgrasp_sim::sample::Sample;

/// The longest `B_sti`.
const LONGEST: f64 = 4.0;

pub(super) fn reach(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let names = ["prism-continuous", "cube-continuous", "hand-arm", "hand-arm-consistent", "hand-arm-stiff"];
    Ok(Claim {
        key: "counter-force",
        words: "u_st generates a counter force large enough for the tangential force of u_s",
        place: "Eqs. 38, 53 and 54, Table II",
        criterion: "the tangential force that u_s asks for, times the rolling radius, is at most 4 K_st in the posture of the start: \
                    no turn of the fingertips makes K_st B_sti longer",
        tolerance: "None: an inequality. Where it fails the fingertips have to roll to where u_s asks for less.",
        rows: runs(evidence, &names)?.into_iter().map(reach_row).collect(),
    })
}

/// The largest moment that Eqs. 53 and 54 ask of `u_st` in the posture of a sample, N m.
fn needed_nm(done: &Done, sample: &Sample) -> f64 {
    let contacts = sample.contacts.iter().enumerate();
    largest(contacts.map(|(finger, contact)| {
        let rolling_m = done.scene.hand.radius_m(finger) - contact.indentation_m;
        // Eq. 38: what u_s asks of the multiplier is the multiplier and the residual.
        let asked = |k: usize, axis: usize| -contact.force_residual_n[axis] - contact.lambda_n[k];
        rolling_m * nalgebra::Vector2::new(asked(0, 0), asked(1, 2)).norm()
    }))
}

pub(super) fn reach_row(done: &Done) -> Row {
    let (Some(first), Some(calm)) = (done.run.samples.first(), calm(done)) else {
        return row(done, "no sample".to_owned(), Verdict::NotReproduced);
    };
    let most_nm = LONGEST * done.scene.control.attitude_stiffness_nm();
    let (start_nm, calm_nm) = (needed_nm(done, first), needed_nm(done, calm));
    let (held, holds) = (done.summary().grasp_held, start_nm <= most_nm);
    let words = format!(
        "needed {} N m at the start, {} N m at {:.0} s; at most {} N m",
        number(start_nm),
        number(calm_nm),
        calm.t_s,
        number(most_nm)
    );
    let mut row = row(done, words, Verdict::of(holds, held && calm_nm <= most_nm));
    row.remark = match (holds, held) {
        (true, _) => String::new(),
        (false, true) => "the fingertips roll until u_s asks for little enough".to_owned(),
        (false, false) => {
            "the printed K_st can't balance this grasp where it starts; the fingertips roll on, and off their faces".to_owned()
        }
    };
    row.figures = vec![
        Figure::new("needed_at_start", start_nm, "N m"),
        Figure::new("needed_when_calm", calm_nm, "N m"),
        Figure::new("at_most", most_nm, "N m"),
    ];
    row
}
