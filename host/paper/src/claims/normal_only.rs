//! Normal forces alone, and what `u_st` adds: which objects are held, and over which stiffnesses (Secs. 3 and 6).

use super::{lost, row, runs};
use crate::claim::{Claim, Figure, Row, Verdict};
use crate::evidence::{Done, Evidence, EvidenceError};
use crate::sensitivity::Sweep;

/// The key that is varied.
const KEY: &str = "control.attitude_stiffness_nm";
/// The sweeps in the paper's model, with the law at 1 kHz and at 10 kHz.
const SAMPLED: [&str; 2] = ["stiffness", "stiffness-continuous"];
/// Factor on the `K_st` that the faster law has to hold for sampling to explain the loss. In proportion to its rate it
/// would be ten times.
const FASTER: f64 = 5.0;
/// `K_st` of Table VII, N m.
const TABLE_VII_NM: f64 = 5e-3;

pub(super) fn normal_only(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let names =
        ["prism-normal-only", "cube-normal-only", "hand-arm-normal-only", "cube-normal-only-friction"];
    Ok(Claim {
        key: "normal-only",
        words: "Normal forces alone hold the prism and fail on the cuboid; with u_st the cuboid is held",
        place: "Secs. 3 and 6, Figs. 4 and 13",
        criterion: "without u_st: the prism is held and comes to rest, cuboids are lost (with u_st they are the runs `cube` and \
                    `cube-continuous` of the other claims)",
        tolerance: "None: held or lost, within 20 s.",
        rows: runs(evidence, &names)?.into_iter().map(normal_only_row).collect(),
    })
}

pub(super) fn normal_only_row(done: &Done) -> Row {
    let summary = done.summary();
    let prism = done.scene.object_name == "prism";
    let friction = done.scene.joints.iter().any(|joint| joint.friction.coulomb_nm > 0.0);
    let measured = match (lost(done), summary.settle_time_s) {
        (Some(words), _) => words,
        (None, Some(t_s)) => format!("held, at rest from {t_s:.2} s on"),
        (None, None) => format!("held for {:.0} s, not at rest", summary.duration_s),
    };
    let holds = if prism { summary.settled } else { !summary.grasp_held };
    let mut row = row(done, measured, Verdict::of(holds, !prism && friction));
    if !holds && friction {
        row.remark = "joints that stick hold the cube in place of u_st. The paper's own experiment has friction too (Sec. 6 says \
                      that it helps against gravity), so that its experiment does not show what u_st does; the paper's model does"
            .to_owned();
    }
    row.figures = summary.lost_at_s.map(|t_s| Figure::new("lost_at", t_s, "s")).into_iter().collect();
    row
}

pub(super) fn region(sweeps: &[Sweep]) -> Claim {
    let explained = sampling_explains(sweeps);
    let rows = sweeps.iter().filter(|sweep| sweep.varied.usual.is_some() && sweep.key() == KEY);
    let rows = rows.map(|sweep| region_row(sweep, explained));
    Claim {
        key: "stiffness-region",
        words: "The artificial constraint enhances the region of stable grasping; its range is chosen by K_st",
        place: "Secs. 1 and 3",
        criterion: "the cube is held at the K_st of Table VII and at every larger one of the sweep, and lost without",
        tolerance: "The ends of the region are found by bisection to a tenth of their value.",
        rows: rows.collect(),
    }
}

/// Returns `true` if the largest `K_st` that is held grows as the law gets faster.
fn sampling_explains(sweeps: &[Sweep]) -> bool {
    let largest = |name: &str| {
        let sweep = sweeps.iter().find(|sweep| sweep.varied.name == name)?;
        Some(sweep.limits()?.above.map_or(f64::INFINITY, |edge| edge.held))
    };
    let [slow, fast] = SAMPLED.map(largest);
    slow.zip(fast).is_some_and(|(slow, fast)| fast >= FASTER * slow)
}

fn region_row(sweep: &Sweep, explained: bool) -> Row {
    let stretches = sweep.stretches();
    let lost = || stretches.iter().filter(|stretch| !stretch.held);
    let usual = stretches.iter().any(|s| s.held && (s.from..=s.to).contains(&TABLE_VII_NM));
    let all_above = usual && lost().all(|stretch| stretch.to < TABLE_VII_NM);
    let lost_without = lost().any(|stretch| stretch.from == 0.0);
    let (sampled, friction) =
        (explained && lost_without && SAMPLED.contains(&sweep.varied.name), sweep.has_friction());
    let holds = all_above && lost_without;
    let remark = match (holds, friction, sampled) {
        (false, true, _) => "with the friction of the joints it is held without u_st too",
        (false, false, true) => {
            "it is lost again with a K_st that is too large: torques that are held for a tick feed energy in. The faster the law, \
             the larger the K_st that it holds"
        }
        _ => "",
    };
    Row {
        run: sweep.varied.name.to_owned(),
        measured: format!("K_st: {}", sweep.outcome()),
        figures: Vec::new(),
        verdict: Verdict::of(holds, usual && (friction || sampled)),
        remark: remark.to_owned(),
    }
}
