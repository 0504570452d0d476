//! All that the loader refuses, not only the first.
//!
//! Each joint is put before the loader alone, on a small hand of its own, and what is refused is replaced by something
//! harmless until nothing is left; then the tree as a whole. So every refusal is the loader's own, and none hides another.

use super::rules::numbers::direction;
use crate::file::{FingertipFile, InertiaFile, JointFile, SCHEMA};
use crate::{Control, HandFile, Safety, SceneError};
use blindgrasp_body::Hand;
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Numbers beyond are not computed with, in whatever unit they are.
const LARGEST: f64 = 1e6;

type Accept = fn(&HandFile) -> Result<Hand, SceneError>;

/// Returns the refusals of a hand's numbers; keys are those of the file.
pub(super) fn refused_numbers(file: &HandFile) -> Vec<SceneError> {
    let mut file = file.clone();
    mend_numbers(&mut file, |file| file.prepare(&mut Vec::new()))
}

/// Replaces the numbers that no kinematics can be computed with; those that are only out of range stay. Returns whether it
/// is still known where everything is, and can be computed with.
pub(super) fn mend_kinematics(file: &mut HandFile) -> bool {
    let small = |values: &[f64]| values.iter().all(|v| v.abs() < LARGEST);
    let joints = file.joints.iter().all(|joint| {
        let lengths = joint.offset_m.iter().chain(&joint.mass_centre_m).chain(&joint.rotation_rpy_rad);
        direction(joint.axis).is_some() && lengths.chain([&joint.mass_kg]).all(|v| small(&[*v]))
    });
    let tips = file.fingertips.iter().all(|tip| small(&tip.offset_m) && small(&[tip.radius_m]));
    mend_numbers(file, HandFile::kinematics);
    joints && tips
}

fn mend_numbers(file: &mut HandFile, accept: Accept) -> Vec<SceneError> {
    let mut errors = mend_head(file, accept);
    for (k, joint) in file.joints.iter_mut().enumerate() {
        let refused = mend(joint, |joint| accept(&around_joint(joint)), mend_joint);
        errors.extend(refused.into_iter().map(|error| renumbered(error, "joint", k)));
    }
    for (i, tip) in file.fingertips.iter_mut().enumerate() {
        let refused = mend(tip, |tip| accept(&around_fingertip(tip)), mend_fingertip);
        errors.extend(refused.into_iter().map(|error| renumbered(error, "fingertip", i)));
    }
    errors
}

/// Format, name, gains and safety numbers.
fn mend_head(file: &mut HandFile, accept: Accept) -> Vec<SceneError> {
    let mut head = HandFile {
        schema: file.schema,
        name: file.name.clone(),
        control: file.control.clone(),
        safety: file.safety.clone(),
        ..around_joint(&sound_joint())
    };
    let errors = mend(&mut head, accept, |head, key| match key {
        "schema" => head.schema = SCHEMA,
        "name" => head.name = "hand".into(),
        _ => {
            head.safety.reset(key);
            head.control.iter_mut().for_each(|control| mend_control(control, key));
        }
    });
    (file.schema, file.name) = (head.schema, head.name);
    (file.control, file.safety) = (head.control, head.safety);
    errors
}

/// Repairs a thing until it is accepted, or the same is refused again; returns what was refused.
fn mend<T>(
    thing: &mut T,
    accept: impl Fn(&T) -> Result<Hand, SceneError>,
    repair: impl Fn(&mut T, &str),
) -> Vec<SceneError> {
    let (mut errors, mut keys) = (Vec::new(), BTreeSet::new());
    while let Err(error) = accept(thing) {
        if !keys.insert(error.key.clone()) {
            break;
        }
        repair(thing, error.key.splitn(3, '.').last().unwrap_or_default());
        errors.push(error);
    }
    errors
}

fn renumbered(mut error: SceneError, list: &str, index: usize) -> SceneError {
    if let Some(rest) = error.key.strip_prefix(&format!("{list}.1.")) {
        error.key = format!("{list}.{}.{rest}", index + 1);
    }
    error
}

fn sound_joint() -> JointFile {
    JointFile {
        name: "joint".into(),
        parent: None,
        offset_m: [0.0; 3],
        rotation_rpy_rad: [0.0; 3],
        axis: [0.0, 0.0, 1.0],
        limits_rad: [-PI, PI],
        nominal_rad: 0.0,
        mass_kg: 0.0,
        mass_centre_m: [0.0; 3],
        inertia_kg_m2: InertiaFile::default(),
        damping_gain_nm_s_rad: 0.0,
        torque_limit_nm: 1.0,
        speed_limit_rad_s: 1.0,
        encoder_counts_per_turn: 1000.0,
        encoder_reversed: false,
        encoder_zero_count: 0,
        motor_reversed: false,
        torque_per_volt_nm_v: 1.0,
        viscous_friction_nm_s_rad: 0.0,
        coulomb_friction_nm: 0.0,
        presliding_rad: 1e-3,
        presliding_damping_nm_s_rad: 0.0,
    }
}

fn sound_fingertip(name: &str) -> FingertipFile {
    FingertipFile {
        name: name.into(),
        link: "joint".into(),
        offset_m: [0.0; 3],
        radius_m: 0.01,
        stiffness_n_m2: 1e6,
        damping_n_s_m_per_m2: 0.0,
        torsional_damping_nm_s_rad_per_m2: 0.0,
    }
}

/// The least hand with this joint.
fn around_joint(joint: &JointFile) -> HandFile {
    let on_it = |name| FingertipFile { link: joint.name.clone(), ..sound_fingertip(name) };
    HandFile {
        schema: SCHEMA,
        name: "hand".into(),
        description: String::new(),
        control: None,
        safety: Safety::default(),
        joints: vec![JointFile { parent: None, ..joint.clone() }],
        fingertips: vec![on_it("1"), on_it("2")],
    }
}

/// The least hand with this fingertip.
fn around_fingertip(tip: &FingertipFile) -> HandFile {
    let tip = FingertipFile { link: "joint".into(), ..tip.clone() };
    // Whatever it is called, the other is not.
    let other = sound_fingertip(&format!("{}2", tip.name.chars().take(20).collect::<String>()));
    HandFile { fingertips: vec![tip, other], ..around_joint(&sound_joint()) }
}

fn mend_joint(joint: &mut JointFile, key: &str) {
    let sound = sound_joint();
    let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
    match key {
        "name" => joint.name = sound.name,
        "offset_m" => joint.offset_m = sound.offset_m,
        "rotation_rpy_rad" => joint.rotation_rpy_rad = sound.rotation_rpy_rad,
        "axis" => joint.axis = direction(joint.axis).unwrap_or(sound.axis),
        "limits_rad" => {
            let [a, b] = joint.limits_rad;
            let has_range = finite(&[a, b]) && a != b && a.abs().max(b.abs()) <= 100.0;
            joint.limits_rad = if has_range { [a.min(b), a.max(b)] } else { sound.limits_rad };
        }
        "nominal_rad" => {
            let [lower, upper] = joint.limits_rad;
            joint.nominal_rad = if lower < upper { f64::clamp(0.0, lower, upper) } else { 0.0 };
        }
        "mass_kg" => joint.mass_kg = sound.mass_kg,
        "mass_centre_m" => joint.mass_centre_m = sound.mass_centre_m,
        "inertia_kg_m2" => joint.inertia_kg_m2 = sound.inertia_kg_m2,
        "damping_gain_nm_s_rad" => joint.damping_gain_nm_s_rad = sound.damping_gain_nm_s_rad,
        "torque_limit_nm" => joint.torque_limit_nm = sound.torque_limit_nm,
        "speed_limit_rad_s" => joint.speed_limit_rad_s = sound.speed_limit_rad_s,
        "encoder_counts_per_turn" => joint.encoder_counts_per_turn = sound.encoder_counts_per_turn,
        "torque_per_volt_nm_v" => joint.torque_per_volt_nm_v = sound.torque_per_volt_nm_v,
        "viscous_friction_nm_s_rad" => joint.viscous_friction_nm_s_rad = sound.viscous_friction_nm_s_rad,
        "coulomb_friction_nm" => joint.coulomb_friction_nm = sound.coulomb_friction_nm,
        "presliding_rad" => joint.presliding_rad = sound.presliding_rad,
        "presliding_damping_nm_s_rad" => {
            joint.presliding_damping_nm_s_rad = sound.presliding_damping_nm_s_rad;
        }
        _ => {}
    }
}

fn mend_fingertip(tip: &mut FingertipFile, key: &str) {
    let sound = sound_fingertip("fingertip");
    match key {
        "name" => tip.name = sound.name,
        "offset_m" => tip.offset_m = sound.offset_m,
        "radius_m" => tip.radius_m = sound.radius_m,
        "stiffness_n_m2" => tip.stiffness_n_m2 = sound.stiffness_n_m2,
        "damping_n_s_m_per_m2" => tip.damping_n_s_m_per_m2 = sound.damping_n_s_m_per_m2,
        "torsional_damping_nm_s_rad_per_m2" => {
            tip.torsional_damping_nm_s_rad_per_m2 = sound.torsional_damping_nm_s_rad_per_m2;
        }
        _ => {}
    }
}

fn mend_control(control: &mut Control, key: &str) {
    match key {
        "period_s" => control.period_s = 1e-3,
        "force_n" => control.gains.grasp[0] = 1.0,
        "attitude_stiffness_nm" => control.gains.grasp[1] = 0.0,
        "damping_scale" => control.damping_scale = 1.0,
        "soft_start_s" => control.soft_start_s = 0.0,
        "amplifier_start_ms" => control.amplifier_start_ms = 0,
        "estimator_bandwidth_hz" => control.estimator_bandwidth_hz = 0.05 / control.period_s,
        _ => {}
    }
}
