//! Normal forces alone, and what `u_st` adds: which objects are held, and over which stiffnesses (Secs. 3 and 6).

use super::{lost, row, runs};
use crate::paper::claim::{Claim, Figure, Row, Verdict};
use crate::paper::evidence::{Done, Evidence, EvidenceError};
use crate::paper::sensitivity::Sweep;

/// What is varied.
const KEY: &str = "control.attitude_stiffness_nm";
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
    let rows = sweeps.iter().filter(|sweep| sweep.key == KEY).map(region_row);
    Claim {
        key: "stiffness-region",
        words: "The artificial constraint enhances the region of stable grasping; its range is chosen by K_st",
        place: "Secs. 1 and 3",
        criterion: "the cube is held at the K_st of Table VII and at every larger one of the sweep, and lost without",
        tolerance: "Steps of the sweep: the region is known to the next value.",
        rows: rows.collect(),
    }
}

pub(super) fn region_row(sweep: &Sweep) -> Row {
    let points = || sweep.points.iter().filter_map(|point| Some((point.number?, point.held)));
    let above: Vec<bool> =
        points().filter(|(value, _)| *value >= TABLE_VII_NM).map(|(_, held)| held).collect();
    let all_above = !above.is_empty() && above.iter().all(|held| *held);
    let usual = above.first().copied().unwrap_or(false);
    let lost_without = points().any(|(value, held)| value == 0.0 && !held);
    let values = |held: bool| {
        let values = sweep.points.iter().filter(|point| point.held == held).map(|point| point.value.as_str());
        let values = values.collect::<Vec<_>>().join(", ");
        if values.is_empty() { "none of them".to_owned() } else { values + " N m" }
    };
    let (sampled, friction) = (sweep.name == "stiffness", sweep.has_friction);
    let holds = all_above && lost_without;
    let remark = match (holds, friction, sampled) {
        (false, true, _) => "with the friction of the joints it is held without u_st too",
        (false, false, true) => {
            "at 1 kHz it is lost again with a K_st that is too large: torques that are held for a millisecond feed energy in"
        }
        _ => "",
    };
    Row {
        run: sweep.name.clone(),
        measured: format!("held with K_st = {}; lost with {}", values(true), values(false)),
        figures: Vec::new(),
        verdict: Verdict::of(holds, usual && (friction || sampled)),
        remark: remark.to_owned(),
    }
}
