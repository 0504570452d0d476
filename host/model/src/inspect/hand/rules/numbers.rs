//! Numbers that are wrong by themselves, as the user wrote them: axes that are no unit vectors, angles in degrees, lengths in
//! other units than metres.

use super::super::found::Found;
use super::length;
use crate::inspect::finding::{Finding, Severity};
use crate::{HandFile, direction};
use blindgrasp_body::Part;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// No angle of a joint needs to be larger, rad; in degrees, those of most joints are.
const LARGEST_ANGLE_RAD: f64 = TAU * (1.0 + 1e-6);
/// Longer than the longest bone of an arm, m.
const LONGEST_BONE_M: f64 = 3.0;
/// No bone is so many times as long as the middle one, arm and finger included.
const LONGEST_BONE: f64 = 40.0;
/// Usual length of a finger's bones, m, where there are none to compare with.
const USUAL_BONE_M: f64 = 0.05;
/// And their fingertips, in bones.
const USUAL_RADIUS: f64 = 0.2;
/// A fingertip that is none, in bones.
const SPECK: f64 = 1e-3;
/// A unit that makes a length so many times the usual one, or that part of it, is not what was meant.
const UNLIKELY: f64 = 4.0;
/// Largest difference of an axis from a unit vector: what the loader takes, six digits.
const AXIS_TOLERANCE: f64 = 1e-5;

/// Axes have to have length one.
pub(in super::super) fn axes(file: &HandFile, found: &mut Found) {
    for (k, joint) in file.joints.iter().enumerate() {
        let axis = joint.axis;
        let (what, remedy) = match (direction(axis), norm(axis)) {
            (None, _) => (format!("its axis {axis:?} has no direction"), "give a unit vector".to_owned()),
            (Some(_), length) if (length - 1.0).abs() < AXIS_TOLERANCE => continue,
            (Some(unit), length) => {
                let unit = unit.map(|v| (v * 1e7).round() / 1e7 + 0.0);
                let length = if length < 1e6 { (length * 1e6).round() / 1e6 } else { length };
                (format!("its axis {axis:?} has length {length:?}, not 1"), format!("write {unit:?}"))
            }
        };
        found.push(on_joint(file, Severity::Error, k, "axis", what, remedy));
    }
}

/// The length of a vector; of one that is too large to be squared, that of its largest component.
fn norm(vector: [f64; 3]) -> f64 {
    let vector = Vector3::from(vector);
    if vector.amax() > 1e150 { vector.amax() } else { vector.norm() }
}

/// Angles beyond a whole turn are degrees, or a joint that turns and turns, which this hand can't have.
pub(in super::super) fn degrees(file: &HandFile, found: &mut Found) {
    for (k, joint) in file.joints.iter().enumerate() {
        for (key, angles) in [
            ("limits_rad", &joint.limits_rad[..]),
            ("nominal_rad", &[joint.nominal_rad]),
            ("rotation_rpy_rad", &joint.rotation_rpy_rad),
        ] {
            if angles.iter().any(|angle| angle.abs() > LARGEST_ANGLE_RAD) {
                let radians: Vec<f64> = angles.iter().map(|angle| rounded(angle.to_radians())).collect();
                let what = format!("{key} of {} goes beyond a whole turn", listed(angles));
                let remedy = format!("write radians: if these are degrees, {}", listed(&radians));
                found.push(on_joint(file, Severity::Warning, k, key, what, remedy));
            }
        }
    }
}

/// Bones as long as a room, or that dwarf all others, are in millimetres or centimetres.
pub(in super::super) fn lengths(file: &HandFile, found: &mut Found) {
    let all = bones(file);
    let mut lengths: Vec<f64> =
        all.iter().map(|(_, length)| *length).filter(|length| *length > 0.0).collect();
    lengths.sort_by(f64::total_cmp);
    let Some(&middle) = lengths.get(lengths.len() / 2) else { return };
    let dwarfs = |bone: f64| lengths.len() > 3 && bone > LONGEST_BONE * middle;
    for (key, bone) in all.into_iter().filter(|(_, bone)| *bone > LONGEST_BONE_M || dwarfs(*bone)) {
        let what = format!("its bone is {} long", length(bone));
        let remedy = in_metres(bone, if middle > LONGEST_BONE_M { USUAL_BONE_M } else { middle });
        found.push(Finding::new(Severity::Warning, what, remedy).about(subject_of(file, &key)).key(key));
    }
}

/// A fingertip larger than the bones of its finger, or no larger than a speck on them.
pub(in super::super) fn radii(file: &HandFile, found: &mut Found) {
    let longest = bones(file).into_iter().map(|(_, bone)| bone).fold(0.0, f64::max);
    if !(longest > 0.0 && found.trusts(&["offset_m"])) {
        return;
    }
    for (i, tip) in file.fingertips.iter().enumerate() {
        let (radius, beside) = (tip.radius_m, length(longest));
        let what = if radius > longest {
            format!("its radius of {} is more than the longest bone's {beside}", length(radius))
        } else if radius > 0.0 && radius < SPECK * longest {
            format!("its radius of {} is nothing beside bones of {beside}", length(radius))
        } else {
            continue;
        };
        let key = format!("fingertip.{}.radius_m", i + 1);
        let remedy = in_metres(radius, USUAL_RADIUS * longest);
        found.push(Finding::new(Severity::Warning, what, remedy).about(subject_of(file, &key)).key(key));
    }
}

/// The keys of all bones, and their lengths, m.
fn bones(file: &HandFile) -> Vec<(String, f64)> {
    let joints = file.joints.iter().map(|joint| norm(joint.offset_m)).enumerate();
    let tips = file.fingertips.iter().map(|tip| norm(tip.offset_m)).enumerate();
    let keyed =
        |list: &'static str| move |(k, bone): (usize, f64)| (format!("{list}.{}.offset_m", k + 1), bone);
    joints.map(keyed("joint")).chain(tips.map(keyed("fingertip"))).collect()
}

/// Returns the remedy for a length that is unlike the usual one: with the unit that it is written in, if one is likely.
fn in_metres(value: f64, usual_m: f64) -> String {
    let far = |factor: f64| (value * factor / usual_m).ln().abs();
    let (factor, unit) = if far(1e-3) <= far(1e-2) { (1e-3, "millimetres") } else { (1e-2, "centimetres") };
    if far(factor) < UNLIKELY.ln() {
        format!("write metres: in {unit} this is {}", length(value * factor))
    } else {
        "write metres".to_owned()
    }
}

fn on_joint(
    file: &HandFile,
    severity: Severity,
    joint: usize,
    key: &str,
    what: String,
    remedy: String,
) -> Finding {
    let key = format!("joint.{}.{key}", joint + 1);
    Finding::new(severity, what, remedy).about(subject_of(file, &key)).key(key)
}

/// Returns the subject of a key, in words.
pub(in super::super) fn subject_of(file: &HandFile, key: &str) -> String {
    let mut path = key.split('.');
    let (list, number) = (path.next(), path.next());
    let index =
        number.and_then(|number| number.parse::<usize>().ok()).and_then(|number| number.checked_sub(1));
    let name = match (list, index) {
        (Some("joint"), Some(k)) => file.joints.get(k).map(|joint| ("joint", &joint.name)),
        (Some("fingertip"), Some(i)) => file.fingertips.get(i).map(|tip| ("fingertip", &tip.name)),
        (Some("posture"), Some(p)) => file.postures.get(p).map(|posture| ("posture", &posture.name)),
        _ => None,
    };
    match name {
        Some((list, name)) => format!("{list} `{name}`"),
        None => match list {
            Some("capsule") => match index {
                Some(k) if k < file.capsules.len() => file.part_in_words(Part::Capsule(k)),
                _ => String::new(),
            },
            Some(table @ ("control" | "safety")) => format!("[{table}]"),
            _ => String::new(),
        },
    }
}

/// Four significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.4}").parse().unwrap_or(value)
}

fn listed(values: &[f64]) -> String {
    match values {
        [one] => format!("{one}"),
        many => format!("{many:?}"),
    }
}
