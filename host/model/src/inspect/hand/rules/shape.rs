//! The hand as a whole: fingers that can't place their fingertip, fingertips that can't meet, fingers in each other's way.

use super::super::found::Found;
use super::super::meeting::Meetings;
use super::super::specimen::Specimen;
use super::{length, names};
use crate::check::item;
use crate::inspect::finding::{Finding, Severity};
use crate::posture;
use blindgrasp_body::{Part, closest_of_lines, overlap_m, pairs};
use nalgebra::Vector3;

/// A finger longer than an arm, m, ...
const LONGEST_FINGER_M: f64 = 1.5;
/// ... and one shorter than a fly.
const SHORTEST_FINGER_M: f64 = 3e-3;
/// The simulated hand's longest chain of joints that one fingertip has for itself, or all share.
const LONGEST_CHAIN: usize = blindgrasp_body::MAX_CHAIN;

/// The size of the fingers.
pub(in super::super) fn size(specimen: &Specimen, found: &mut Found) {
    if !found.trusts(&["offset_m"]) {
        return;
    }
    let longest = (0..specimen.fingers()).map(|i| specimen.finger_length_m(i)).fold(0.0, f64::max);
    if longest > LONGEST_FINGER_M || (longest > 0.0 && longest < SHORTEST_FINGER_M) {
        let what = format!("its longest finger is {} long", length(longest));
        found.push(Finding::new(Severity::Warning, what, "write offset_m in metres"));
    }
}

/// Finds fingertips with too few or too many joints.
pub(in super::super) fn freedom(specimen: &Specimen, found: &mut Found) {
    for (i, own) in specimen.own.iter().enumerate() {
        let on =
            |severity, what: String, remedy: &str| specimen.on_fingertip(severity, (i, "link"), what, remedy);
        let finding = match own.len() {
            0 => on(
                Severity::Warning,
                "has no joint of its own: it can't move against the others".into(),
                "name the last joint of its finger as link",
            ),
            1 | 2 => on(
                Severity::Notice,
                format!(
                    "has {} of its own: its centre stays on a {}",
                    joints(own.len()),
                    if own.len() == 1 { "line" } else { "surface" }
                ),
                "if it was meant, contact points have to be where it gets",
            ),
            count if count > LONGEST_CHAIN => on(
                Severity::Warning,
                format!("has {count} joints of its own: the simulation takes at most {LONGEST_CHAIN}"),
                "leave some out",
            ),
            _ => continue,
        };
        found.push(finding);
    }
    let trunk = (0..specimen.joints()).filter(|&k| specimen.finger_of(k).is_none()).count();
    if trunk > LONGEST_CHAIN {
        let what =
            format!("{trunk} joints move several fingertips: the simulation takes at most {LONGEST_CHAIN}");
        found.push(Finding::new(Severity::Warning, what, "leave some out"));
    }
}

fn joints(count: usize) -> String {
    format!("{count} joint{}", if count == 1 { "" } else { "s" })
}

/// Fingertips that touch no ball together.
pub(in super::super) fn meeting(specimen: &Specimen, meetings: &Meetings, found: &mut Found) {
    if !found.trusts(&["offset_m", "axis", "rotation_rpy_rad", "limits_rad", "radius_m"]) {
        return;
    }
    let everyone = specimen.fingers();
    let name = |i: &usize| specimen.file.fingertips[*i].name.as_str();
    let small = length(specimen.mean_radius_m());
    let some = meetings.small.as_ref().map(|meeting| &meeting.fingertips);
    let remedy = "check axes, limits and where the fingers start";
    let (severity, what, remedy) = match (some, &meetings.all) {
        (Some(some), _) if some.len() == everyone => return,
        (Some(some), Some(all)) => (
            Severity::Notice,
            format!(
                "of {everyone} fingertips, {} ({}) can hold a ball of {small} radius between them; all together, none smaller than about {}",
                some.len(),
                names(some.iter().map(name)),
                length(all.ball_radius_m)
            ),
            "if it was not meant, check axes, limits and where the fingers start",
        ),
        (None, Some(all)) if all.ball_radius_m < 0.5 * longest_finger_m(specimen) => (
            Severity::Notice,
            format!(
                "the fingertips can't hold a ball smaller than about {} in radius",
                length(all.ball_radius_m)
            ),
            "if it was not meant, check axes, limits and where the fingers start",
        ),
        (None, Some(all)) => (
            Severity::Warning,
            format!(
                "the fingertips come no nearer to each other than around a ball of {} radius",
                length(all.ball_radius_m)
            ),
            remedy,
        ),
        (Some(some), None) => {
            let others: Vec<usize> = (0..everyone).filter(|i| !some.contains(i)).collect();
            let what = format!(
                "no posture was found in which fingertip{} {} can meet the others around any ball",
                if others.len() == 1 { "" } else { "s" },
                names(others.iter().map(name))
            );
            (Severity::Warning, what, remedy)
        }
        (None, None) => (Severity::Error, "no two fingertips can meet around any ball".to_owned(), remedy),
    };
    found.push(Finding::new(severity, what, remedy));
}

fn longest_finger_m(specimen: &Specimen) -> f64 {
    (0..specimen.fingers()).map(|i| specimen.finger_length_m(i)).fold(0.0, f64::max)
}

/// Fingers in each other's way at the nominal posture, where grasps begin. The paper's model has no contact between them.
pub(in super::super) fn overlaps(specimen: &Specimen, found: &mut Found) {
    if !found.trusts(&["offset_m", "axis", "rotation_rpy_rad", "limits_rad", "radius_m", "nominal_rad"]) {
        return;
    }
    let name = |i: usize| &specimen.file.fingertips[i].name;
    for b in 0..specimen.fingers() {
        for a in 0..b {
            let tips = &specimen.posture.centres_m;
            let overlap = specimen.hand.radius_m(a) + specimen.hand.radius_m(b) - (tips[a] - tips[b]).norm();
            let what = if overlap > 0.0 {
                format!("overlaps fingertip `{}` by {} at the nominal posture", name(a), length(overlap))
            } else if cross(specimen, a, b) {
                format!("its finger crosses that of fingertip `{}` at the nominal posture", name(a))
            } else {
                continue;
            };
            let remedy = "change nominal_rad, or where the fingers start";
            found.push(specimen.on_fingertip(Severity::Warning, (b, "name"), what, remedy));
        }
    }
}

/// Returns `true` if bones of two fingers come nearer to each other than a quarter of the smaller fingertip's radius,
/// well within what any finger is thick. Where fingers start, at their first bones' inner ends, they may share a shaft.
fn cross(specimen: &Specimen, a: usize, b: usize) -> bool {
    let near = 0.25 * specimen.hand.radius_m(a).min(specimen.hand.radius_m(b));
    let (ours, theirs) = (bones(specimen, a), bones(specimen, b));
    let starts = (specimen.base_m(a) - specimen.base_m(b)).norm() < 2.0 * near;
    ours.iter().enumerate().any(|(m, our)| {
        theirs
            .iter()
            .enumerate()
            .any(|(n, their)| !(starts && m == 0 && n == 0) && apart_m([our, their]) < near)
    })
}

/// From joint to joint and to the fingertip, m.
fn bones(specimen: &Specimen, finger: usize) -> Vec<[Vector3<f64>; 2]> {
    let joints = specimen.own[finger].iter().map(|&k| specimen.posture.link(k).origin_m);
    let points: Vec<Vector3<f64>> = joints.chain([specimen.posture.centres_m[finger]]).collect();
    points.windows(2).map(|pair| [pair[0], pair[1]]).filter(|[from, to]| (to - from).norm() > 0.0).collect()
}

/// The distance between two lines, m.
fn apart_m([p, q]: [&[Vector3<f64>; 2]; 2]) -> f64 {
    let [s, t] = closest_of_lines([p, q]);
    (p[0] + (p[1] - p[0]) * s - q[0] - (q[1] - q[0]) * t).norm()
}

/// The keys that say where surfaces of the hand are, but for the angles.
const SURFACES: [&str; 7] = ["offset_m", "axis", "rotation_rpy_rad", "radius_m", "from_m", "to_m", "link"];

/// Links, palm and fingertips inside each other in a named posture: no scene begins so, and a hand that goes there jams.
pub(in super::super) fn postures(specimen: &Specimen, found: &mut Found) {
    if !found.trusts(&SURFACES) {
        return;
    }
    let (file, hand) = (&specimen.file, &specimen.hand);
    let capsules = file.capsules(hand);
    for (p, named) in file.postures.iter().enumerate() {
        let posture = posture(hand, &named.angles_rad);
        let overlaps = pairs(hand, &capsules).into_iter();
        let overlaps = overlaps.map(|parts| (overlap_m(parts, hand, &posture, &capsules), parts));
        let Some((overlap, parts)) = overlaps.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if overlap > 0.0 {
            let [a, b] = parts.map(|part| file.part_in_words(part));
            let what = format!("{a} and {b} overlap by {}", length(overlap));
            let finding = Finding::new(Severity::Warning, what, "change its angles, or correct the capsules")
                .about(format!("posture `{}`", named.name))
                .key(item("posture", p, "angles_rad"));
            found.push(finding);
        }
    }
}

/// Links, palm and fingertips inside each other at the nominal posture.
pub(in super::super) fn crossings(specimen: &Specimen, found: &mut Found) {
    if !found.trusts(&SURFACES) || !found.trusts(&["limits_rad", "nominal_rad"]) {
        return;
    }
    let (file, hand) = (&specimen.file, &specimen.hand);
    let capsules = file.capsules(hand);
    for parts in pairs(hand, &capsules) {
        // Of two fingertips there is a rule of its own.
        let Some(Part::Capsule(number)) = parts.into_iter().rfind(|part| matches!(part, Part::Capsule(_)))
        else {
            continue;
        };
        let overlap = overlap_m(parts, hand, &specimen.posture, &capsules);
        if overlap > 0.0 {
            let own = Part::Capsule(number);
            let other = if parts[0] == own { parts[1] } else { parts[0] };
            let what = format!(
                "overlaps {} by {} at the nominal posture",
                file.part_in_words(other),
                length(overlap)
            );
            let remedy = "correct the capsules or nominal_rad: where links touch, no scene begins so";
            let finding = Finding::new(Severity::Warning, what, remedy)
                .about(file.part_in_words(own))
                .key(item("capsule", number, "from_m"));
            found.push(finding);
        }
    }
}
