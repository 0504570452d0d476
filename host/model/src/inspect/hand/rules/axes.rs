//! Axes that point the wrong way: a joint whose positive sense is the negative of what its user thinks.
//!
//! Turning an axis round and exchanging its limits gives the same hand; only the sign of its angle is another. So an axis
//! alone is never wrong, an axis against its limits may be. What speaks against a joint:
//!
//! 1. **Its neighbours.** The flexing joints of a finger are parallel, and their ranges bend it the same way. One that is
//!    antiparallel to the others, without its range being mirrored, bends against them.
//! 2. **Its range.** A finger closes farther than it opens: the larger side of a range that is clearly one-sided closes the
//!    hand. Looked at with the fingers stretched and at the nominal posture, since far from both a curled finger may well
//!    move away from the others.
//! 3. **The other fingers.** In a hand whose fingers are copies of each other, moved or turned about the palm's middle, one
//!    joint of one finger turns the other way than those at its place.
//!
//! The first two are warnings: something is wrong. The third alone is one where the joint's range is one-sided; a symmetric
//! range leaves the same hand, and a mirrored finger may be meant. Joints of the trunk have no sense of their own.

use super::super::found::Found;
use super::super::specimen::Specimen;
use crate::inspect::finding::{Finding, Severity};
use blindgrasp_body::Posture;
use nalgebra::{Matrix3, Vector3};

/// Cosine between axes that are parallel, as drawn by hand.
const PARALLEL: f64 = 0.99;
/// Cosine beyond which a joint opens or closes the hand, and does not just move a fingertip aside.
const CLEARLY: f64 = 0.3;
/// A range is one-sided from here on: the middle of the range over half of it. A third is one side twice the other.
const ONE_SIDED: f64 = 0.33;
/// And it has a side at all.
const SIDED: f64 = 0.05;

/// All three.
pub(in super::super) fn senses(specimen: &Specimen, found: &mut Found) {
    if !found.trusts(&["axis", "limits_rad", "offset_m", "rotation_rpy_rad"]) {
        return;
    }
    let stretched = specimen.stretched();
    for finger in 0..specimen.fingers() {
        neighbours(specimen, finger, &stretched, found);
    }
    for &k in specimen.own.iter().flatten() {
        range(specimen, k, &stretched, found);
    }
    copies(specimen, &stretched, found);
}

/// Returns the side of zero that a range is on, from -1 to 1 for ranges that have zero at an end, and beyond for those
/// without it.
fn side(specimen: &Specimen, joint: usize) -> f64 {
    let (lower, upper) = specimen.hand.range_rad(joint);
    (upper + lower) / (upper - lower)
}

fn remedy(specimen: &Specimen, joint: usize) -> String {
    let joint = &specimen.file.joints[joint];
    let turned = joint.axis.map(|v| 0.0 - v);
    let [lower, upper] = joint.limits_rad;
    format!(
        "write axis = {turned:?}; or, if its sense is right, limits_rad = {:?}",
        [0.0 - upper, 0.0 - lower]
    )
}

fn tell(specimen: &Specimen, severity: Severity, joint: usize, what: String) -> Finding {
    specimen.on_joint(severity, (joint, "axis"), what, remedy(specimen, joint))
}

/// 1: in each run of parallel joints, those that are antiparallel to most and bend against them.
fn neighbours(specimen: &Specimen, finger: usize, stretched: &Posture, found: &mut Found) {
    let axis = |k: usize| stretched.link(k).axis();
    let runs = specimen.own[finger].chunk_by(|&a, &b| axis(a).dot(&axis(b)).abs() > PARALLEL);
    for run in runs.filter(|run| run.len() > 1) {
        // The senses of most; where there is no majority, those that close the hand.
        let sense = |k: usize| axis(k).dot(&axis(run[0])).signum();
        let sum: f64 = run.iter().map(|&k| sense(k)).sum();
        let closes: f64 = run.iter().map(|&k| sense(k) * specimen.closing(stretched, k)).sum();
        let most = if sum == 0.0 { closes.signum() } else { sum.signum() };
        let bend = |k: usize| {
            if side(specimen, k).abs() > SIDED { sense(k) * side(specimen, k).signum() } else { 0.0 }
        };
        let bends: f64 = run.iter().filter(|&&k| sense(k) == most).map(|&k| bend(k)).sum();
        for &k in run.iter().filter(|&&k| sense(k) != most) {
            let other = run
                .iter()
                .find(|&&j| sense(j) == most)
                .map_or("", |&j| specimen.file.joints[j].name.as_str());
            if bend(k) * bends < 0.0 {
                let what =
                    format!("its axis is antiparallel to that of `{other}`, and bends the finger against it");
                found.push(tell(specimen, Severity::Warning, k, what));
            } else if bend(k) == 0.0 {
                let what = format!("its axis is antiparallel to that of `{other}`");
                found.push(tell(specimen, Severity::Notice, k, what));
            }
        }
    }
}

/// 2: the larger side of its range opens the hand.
fn range(specimen: &Specimen, k: usize, stretched: &Posture, found: &mut Found) {
    let side = side(specimen, k);
    let closing = [stretched, &specimen.posture].map(|posture| specimen.closing(posture, k) * side.signum());
    if side.abs() > ONE_SIDED && closing.iter().all(|cosine| *cosine < -CLEARLY) {
        let (lower, upper) = specimen.hand.range_rad(k);
        let larger = if side > 0.0 { upper } else { lower };
        let what = format!("the larger side of its range, to {larger} rad, opens the hand");
        found.push(tell(specimen, Severity::Warning, k, what));
    }
}

/// 3: a finger that is a copy of others but for the sense of one joint.
fn copies(specimen: &Specimen, stretched: &Posture, found: &mut Found) {
    for frames in [moved(specimen), turned(specimen)] {
        let axes = |finger: usize| -> Vec<Vector3<f64>> {
            let to_own = frames[finger].transpose();
            specimen.own[finger].iter().map(|&k| to_own * stretched.link(k).axis()).collect()
        };
        let all: Vec<Vec<Vector3<f64>>> = (0..specimen.fingers()).map(axes).collect();
        // The joint in which a finger differs from another by its sense, counted from the fingertip: the first joints of a
        // finger may be more than the other has. `Some(None)` for a copy.
        let difference = |a: usize, b: usize| -> Option<Option<usize>> {
            let mut turned = None;
            for (place, (u, v)) in all[a].iter().rev().zip(all[b].iter().rev()).enumerate() {
                match u.dot(v) {
                    cosine if cosine > PARALLEL => {}
                    cosine if cosine < -PARALLEL && turned.is_none() => turned = Some(place),
                    _ => return None,
                }
            }
            (all[a].len().abs_diff(all[b].len()) < 2 && all[a].len().min(all[b].len()) > 1).then_some(turned)
        };
        for odd in 0..specimen.fingers() {
            let others = (0..specimen.fingers()).filter(|&i| i != odd);
            let places: Vec<usize> = others.clone().filter_map(|i| difference(odd, i).flatten()).collect();
            let first = others.clone().find(|&i| difference(odd, i).flatten().is_some());
            // At least two others that agree, none that is like this one.
            let alone = !others.clone().any(|i| difference(odd, i) == Some(None));
            let (Some(&place), Some(first), true) = (places.first(), first, alone) else { continue };
            if places.len() > 1 && places.iter().all(|&other| other == place) {
                let of = |finger: usize| specimen.own[finger][specimen.own[finger].len() - 1 - place];
                let (k, other) = (of(odd), of(first));
                let mirrored = side(specimen, k) * side(specimen, other) < 0.0;
                if side(specimen, k).abs() > SIDED && mirrored {
                    continue; // The same range: only the sign is another.
                }
                let severity =
                    if side(specimen, k).abs() > SIDED { Severity::Warning } else { Severity::Notice };
                let name = &specimen.file.joints[other].name;
                let what = format!("turns the other way than `{name}` and its like in the other fingers");
                found.push(tell(specimen, severity, k, what));
            }
        }
    }
}

/// Frames of fingers that are copies moved without turning: all the same.
fn moved(specimen: &Specimen) -> Vec<Matrix3<f64>> {
    vec![Matrix3::identity(); specimen.fingers()]
}

/// Frames of fingers that are copies turned about the palm's middle: x from the middle to where the finger starts, z out of
/// the plane through all of these places. The same for all where they have no plane.
fn turned(specimen: &Specimen) -> Vec<Matrix3<f64>> {
    let bases: Vec<Vector3<f64>> = (0..specimen.fingers()).map(|i| specimen.base_m(i)).collect();
    let middle = bases.iter().sum::<Vector3<f64>>() / bases.len() as f64;
    let spokes: Vec<Vector3<f64>> = bases.iter().map(|base| base - middle).collect();
    let area: Vector3<f64> = spokes.iter().zip(spokes.iter().cycle().skip(1)).map(|(a, b)| a.cross(b)).sum();
    let Some(normal) = area.try_normalize(1e-9 * specimen.span_m() * specimen.span_m()) else {
        return moved(specimen);
    };
    let frame = |spoke: &Vector3<f64>| {
        let out = (spoke - normal * normal.dot(spoke)).try_normalize(1e-9 * specimen.span_m())?;
        Some(Matrix3::from_columns(&[out, normal.cross(&out), normal]))
    };
    spokes.iter().map(frame).collect::<Option<_>>().unwrap_or_else(|| moved(specimen))
}
