//! The bound on `K_st` (Eqs. 48 and 49), and what it is good for.
//!
//! It follows from potentials that the law knows of itself. With `V_s` of Eq. 43 and the traces that Eq. 44 sums up, the
//! condition `V_s + V_st >= 0` with the print's `V_st` reads `K_st <= V_s / sum(1 + 2 cos a_i)`, which is Eq. 49.

use super::{row, runs};
use crate::claim::{Claim, Figure, Row, Verdict, number};
use crate::evidence::{Done, Evidence, EvidenceError};
use blindgrasp_sim::sample::Sample;

pub(super) fn bound(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let names =
        ["prism-continuous", "cube-continuous", "hand-arm", "hand-arm-consistent", "cube-above-bound"];
    Ok(Claim {
        key: "bound",
        words: "E stays positive if K_st is below the bound of Eq. 49",
        place: "Eqs. 48 and 49",
        criterion: "K_st is below the bound at every sample, and the print's E is positive there",
        tolerance: "None: both sides are computed.",
        rows: runs(evidence, &names)?.into_iter().map(bound_row).collect(),
    })
}

/// The bound of Eq. 49, N m, and `E` of Eq. 40 with the print's own `V_st`, J.
fn evaluated(done: &Done, sample: &Sample) -> (f64, f64) {
    let stiffness_nm = done.scene.control.attitude_stiffness_nm();
    let most = 3.0 * done.scene.hand.fingertip_count() as f64;
    // Eq. 44 with its constant is K_st (3 N - sum of the traces). Where the traces sum to nothing or less, any K_st will do.
    let traces = most - sample.energies.potentials_j.grasp[1] / stiffness_nm;
    let bound_nm = if traces > 0.0 { sample.energies.potentials_j.grasp[0] / traces } else { f64::INFINITY };
    (bound_nm, sample.energies.of_equation_40_j() - most * stiffness_nm)
}

pub(super) fn bound_row(done: &Done) -> Row {
    let stiffness_nm = done.scene.control.attitude_stiffness_nm();
    let samples = &done.run.samples;
    let least = samples
        .iter()
        .map(|sample| evaluated(done, sample))
        .fold((f64::INFINITY, f64::INFINITY), |least, now| (least.0.min(now.0), least.1.min(now.1)));
    let start = samples.first().map_or(f64::NAN, |sample| evaluated(done, sample).0);
    let (below, positive) = (stiffness_nm <= least.0, least.1 > 0.0);
    let held = done.summary().grasp_held;
    let mut row = row(
        done,
        format!(
            "K_st = {} N m; bound {} N m at the start, at least {} N m; the print's E at least {} J; {}",
            number(stiffness_nm),
            number(start),
            number(least.0),
            number(least.1),
            if held { "held" } else { "lost in the end" }
        ),
        // Above the bound the equation promises nothing: what is shown is that nothing hangs on it.
        Verdict::of(below && positive, !below && held),
    );
    row.remark = if below {
        String::new()
    } else {
        "above the bound, and held all the same: the bound is needed only because the print's V_st has an arbitrary constant. \
         With 3 N K_st added no term of E is ever negative, for any K_st; Eq. 49 is a rule for sizing"
            .to_owned()
    };
    row.figures = vec![
        Figure::new("stiffness", stiffness_nm, "N m"),
        Figure::new("bound_at_start", start, "N m"),
        Figure::new("least_bound", least.0, "N m"),
        Figure::new("least_printed_energy", least.1, "J"),
    ];
    row
}
