//! Motors and encoders: too weak for the hand's own weight, or numbers that no motor has.

use super::super::found::Found;
use super::super::specimen::Specimen;
use super::super::strength;
use crate::inspect::finding::Severity;
use std::f64::consts::TAU;

/// A strong finger lifts a hundred times its weight; one whose torques are in millinewton metres, tens of thousands.
const STRONGEST: f64 = 1000.0;
/// From a joint that takes two minutes for a turn, rad/s, ...
const SLOWEST_RAD_S: f64 = 0.05;
/// ... to a bare motor at 10,000 turns a minute, rad/s. The gears of hands begin at about 5 : 1.
const FASTEST_RAD_S: f64 = 1050.0;
/// A count that moves a fingertip by more can be felt in the grasp, m, ...
const COARSE_M: f64 = 0.5e-3;
/// ... or by more than this share of its radius: indentations grow with the fingertips.
const COARSE: f64 = 1.0 / 30.0;

/// The torque limit against the weight that the joint carries, with the palm up.
pub(in super::super) fn torques(specimen: &Specimen, found: &mut Found) {
    if !found.trusts(&["offset_m", "mass_kg", "mass_centre_m", "axis", "rotation_rpy_rad"]) {
        return;
    }
    let nominal = strength::weight_nm(specimen);
    let greatest = strength::greatest_weight_nm(specimen);
    for k in 0..specimen.joints() {
        let limit = specimen.file.joints[k].torque_limit_nm;
        if !found.trusts_joint(specimen, k, "torque_limit_nm") {
            continue;
        }
        // The joints of a finger often have one motor: the hardest loaded one says what size it is.
        let finger = specimen.finger_of(k).map_or(greatest[k], |finger| {
            specimen.own[finger].iter().map(|&j| greatest[j]).fold(0.0, f64::max)
        });
        let key = (k, "torque_limit_nm");
        if nominal[k].abs() > limit {
            let what = format!(
                "its torque limit of {limit} N m can't hold what it carries at the nominal posture: {:.3} N m",
                nominal[k].abs()
            );
            let remedy = "give it in newton metres at the joint, gear included; check the masses";
            found.push(specimen.on_joint(Severity::Warning, key, what, remedy));
        } else if greatest[k] > limit {
            let what = format!(
                "its torque limit of {limit} N m can't hold what it carries in every posture: up to {:.3} N m",
                greatest[k]
            );
            let remedy = "keep it away from there, or give it a stronger motor";
            found.push(specimen.on_joint(Severity::Notice, key, what, remedy));
        } else if finger > 0.0 && limit > STRONGEST * finger {
            let what = format!(
                "its torque limit of {limit} N m is {:.0} times what its finger weighs on a joint",
                limit / finger
            );
            let remedy = format!("write newton metres: {limit} mN m are {} N m", limit / 1e3);
            found.push(specimen.on_joint(Severity::Warning, key, what, remedy));
        }
    }
}

/// The speed limit.
pub(in super::super) fn speeds(specimen: &Specimen, found: &mut Found) {
    for (k, joint) in specimen.file.joints.iter().enumerate() {
        let speed = joint.speed_limit_rad_s;
        let remedy = if speed < SLOWEST_RAD_S {
            "write rad/s at the joint".to_owned()
        } else if speed > FASTEST_RAD_S {
            format!(
                "write rad/s at the joint, gear included: {speed} turns a minute are {:.1} rad/s",
                speed * TAU / 60.0
            )
        } else {
            continue;
        };
        let what = format!("its speed limit of {speed} rad/s is that of no joint");
        found.push(specimen.on_joint(Severity::Warning, (k, "speed_limit_rad_s"), what, remedy));
    }
}

/// Finds encoders one count of which moves the fingertips too far.
pub(in super::super) fn encoders(specimen: &Specimen, found: &mut Found) {
    if !found.trusts(&["offset_m"]) {
        return;
    }
    for (k, joint) in specimen.file.joints.iter().enumerate() {
        let step = |i: usize| TAU / joint.encoder_counts_per_turn * strength::lever_m(specimen, i, k);
        let coarse = |i: &usize| step(*i) > COARSE_M.max(COARSE * specimen.hand.radius_m(*i));
        let moved = (0..specimen.fingers()).filter(|&i| specimen.hand.moves(k, i)).filter(coarse);
        let Some(worst) = moved.max_by(|&a, &b| step(a).total_cmp(&step(b))) else { continue };
        let what = format!(
            "one of its {} counts a turn moves fingertip `{}` by {:.2} mm",
            joint.encoder_counts_per_turn,
            specimen.file.fingertips[worst].name,
            step(worst) * 1e3
        );
        let remedy = "count a turn of the joint, gear included, and all edges";
        found.push(specimen.on_joint(Severity::Warning, (k, "encoder_counts_per_turn"), what, remedy));
    }
}
