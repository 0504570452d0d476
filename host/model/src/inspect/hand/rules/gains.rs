//! The gains of the law against the hand that they are for.

use super::super::facts::{self, ClosingFacts};
use super::super::found::Found;
use super::super::specimen::Specimen;
use super::super::strength;
use super::length;
use crate::inspect::finding::{Finding, Severity};

/// Least force of fingertips that close, as a multiple of the one from which they move at all, ...
const MOVES_FOR_CERTAIN: f64 = 2.5;
/// ... and a good one.
const MOVES_WELL: f64 = 5.0;

/// Joints that nothing damps: the law takes energy out of a grasp by `C` of Eq. 30 alone.
pub(in super::super) fn damping(specimen: &Specimen, found: &mut Found) {
    for (k, joint) in specimen.file.joints.iter().enumerate() {
        let key = (k, "damping_gain_nm_s_rad");
        if found.trusts_joint(specimen, k, key.1) && !(joint.damping_gain_nm_s_rad > 0.0) {
            let remedy = "give damping_gain_nm_s_rad, N m s/rad: without it, only friction takes energy out of the grasp";
            found.push(specimen.on_joint(Severity::Warning, key, "has no damping gain", remedy));
        }
    }
}

/// The table `[control]`.
pub(in super::super) fn control(specimen: &Specimen, found: &mut Found) {
    let Some(control) = &specimen.file.control else {
        let remedy = "add it to build a firmware for this hand; a scene has its own";
        found.push(Finding::new(Severity::Notice, "there is no table [control]", remedy).key("control"));
        return;
    };
    let tell = |severity, key: &str, what: String, remedy: &str| {
        Finding::new(severity, what, remedy).about("[control]").key(format!("control.{key}"))
    };
    let damped = specimen.file.joints.iter().any(|joint| joint.damping_gain_nm_s_rad > 0.0);
    if damped && !(control.damping_scale > 0.0) {
        let what = "a factor of 0 takes all joints' damping away".to_owned();
        found.push(tell(Severity::Warning, "damping_scale", what, "give a positive factor"));
    }
    if found.trusts(&["offset_m", "axis", "rotation_rpy_rad", "torque_limit_nm", "radius_m", "force_n"]) {
        force(specimen, control.force_n(), control.gravity_compensation, found, &tell);
        let (stiffness, bound) =
            (control.attitude_stiffness_nm(), strength::stiffness_bound_nm(specimen, control.force_n()));
        if stiffness > bound && found.trusts(&["attitude_stiffness_nm"]) {
            let what = format!(
                "K_st of {stiffness} N m is more than the {bound:.2e} N m that Eq. 49 allows with this f_d at the nominal posture"
            );
            let remedy = "if it was not meant, less K_st or more f_d: Eq. 49 is a sizing rule";
            found.push(tell(Severity::Notice, "attitude_stiffness_nm", what, remedy));
        }
    }
}

/// Finds fingertips that close with too little force to move for certain, or with a spring too soft for what they shall find.
///
/// A finger that hardly overcomes its joints' friction stops where nothing is, and tells a touch. One whose reference gets to the
/// middle of all before it presses with its force tells none: then the hand says that it is empty, with something in it.
pub(in super::super) fn closing(specimen: &Specimen, found: &mut Found) {
    let trusted =
        ["offset_m", "axis", "rotation_rpy_rad", "radius_m", "limits_rad", "nominal_rad", "angles_rad"];
    let Some(closing) = facts::closing(specimen).filter(|_| found.trusts(&trusted)) else { return };
    let tell = |key: &str, what: String, remedy: String| {
        Finding::new(Severity::Warning, what, remedy).about("[control]").key(format!("control.{key}"))
    };
    let ClosingFacts { force_n, moving_force_n, lag_m, least_half_width_m, .. } = closing;
    let is_trusted = found.trusts(&["coulomb_friction_nm", "closing_force_n"]);
    if is_trusted && force_n < MOVES_FOR_CERTAIN * moving_force_n {
        let what = format!(
            "fingertips close with {force_n} N, {:.1} times the {moving_force_n:.3} N from which `{}` moves against the friction \
             of its joints at {}",
            force_n / moving_force_n,
            closing.stiffest,
            closing.posture
        );
        let remedy = format!(
            "give at least {MOVES_FOR_CERTAIN} times ({:.3} N), better {MOVES_WELL} times ({:.3} N)",
            MOVES_FOR_CERTAIN * moving_force_n,
            MOVES_WELL * moving_force_n
        );
        found.push(tell("closing_force_n", what, remedy));
    }
    let size_m = 2.0 * specimen.mean_radius_m();
    if found.trusts(&["closing_force_n", "closing_stiffness_n_m"]) && least_half_width_m > size_m {
        let what = format!(
            "a fingertip that presses with {force_n} N is {} behind its reference: more than a fifth of half the width of \
             objects below {}",
            length(lag_m),
            length(2.0 * least_half_width_m)
        );
        let remedy = format!(
            "give at least {:.0} N/m, for objects from twice the size of a fingertip ({}) on",
            (force_n * least_half_width_m / (lag_m * size_m)).ceil(),
            length(2.0 * size_m)
        );
        found.push(tell("closing_stiffness_n_m", what, remedy));
    }
}

/// Finds a force `f_d` that asks too much of the joints, fingertips held apart as they are at the nominal posture.
fn force(
    specimen: &Specimen,
    force_n: f64,
    compensates: bool,
    found: &mut Found,
    tell: &impl Fn(Severity, &str, String, &str) -> Finding,
) {
    let approach = strength::approach_nm(specimen, force_n);
    let weight = if compensates { strength::weight_nm(specimen) } else { [0.0; blindgrasp_body::MAX_JOINTS] };
    let share = |k: usize| (approach[k] + weight[k]).abs() / specimen.file.joints[k].torque_limit_nm;
    let Some(worst) = (0..specimen.joints()).max_by(|&a, &b| share(a).total_cmp(&share(b))) else { return };
    // A joint that can't even hold its weight was named for that.
    if share(worst) > 1.0 && weight[worst].abs() < specimen.file.joints[worst].torque_limit_nm {
        let joint = &specimen.file.joints[worst];
        let what = format!(
            "f_d of {force_n} N asks joint `{}` for {:.3} N m at the nominal posture, of {} N m",
            joint.name,
            (approach[worst] + weight[worst]).abs(),
            joint.torque_limit_nm
        );
        found.push(tell(
            Severity::Warning,
            "force_n",
            what,
            "give a smaller f_d; it grows with the object (Eq. 57)",
        ));
    }
}
