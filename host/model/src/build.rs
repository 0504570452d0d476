//! From the effective configuration to a [`Scene`]: every number checked, everything prepared.

use super::{
    Parts, Scene,
    check::{Refused, Result, all_within, fail, item, name, schema, within},
    file::{Control, PushFile, SceneFile},
    hand::{joint_parameters, overlaps, still_joints},
    object::object,
    start::start,
    world,
};
use blindgrasp_shared::control::GAINS;
use nalgebra::Vector3;

/// Longer runs are likely mistakes, s.
const LONGEST_RUN_S: f64 = 3600.0;
/// The longest step of the integrator, unless a scene asks for another, s: docs/architecture.md has the errors that it makes.
const LONGEST_STEP_S: f64 = 5e-4;
/// Longer delays are likely mistakes.
const LONGEST_DELAY_TICKS: f64 = 1000.0;

/// Checks what is known before hand and object meet.
pub(super) fn parts(file: &SceneFile) -> Result<Parts> {
    let mut warnings = Vec::new();
    name("name", &file.name)?;
    let substeps = settings(file)?;
    late_pushes(file, &mut warnings);
    // The gains of the scene are what acts; those of the hand say which firmware is its own.
    let hand = file.hand.prepare(&mut warnings).map_err(|error| error.below("hand"))?;
    let object = object(&file.object, &mut warnings).map_err(|error| error.below("object"))?;
    let touch = file.plant.links.unwrap_or(true);
    let capsules = if touch { file.hand.capsules(&hand) } else { Vec::new() };
    Ok(Parts { hand, capsules, object, substeps, warnings })
}

/// Checks a configuration and prepares the scene.
pub(super) fn scene(file: SceneFile) -> Result<Scene> {
    let parts = parts(&file)?;
    let attitude = file.pose.attitude()?;
    all_within("pose.position_m", &file.pose.position_m, 100.0)?;
    let position_m = Vector3::from(file.pose.position_m);

    let Parts { hand, object, .. } = &parts;
    let (contacts, start) = start(&file, hand, &object.shape, position_m, attitude)?;
    if let Some(&k) = still_joints(hand, &start.angles_rad).first() {
        let problem = format!("joint `{}` moves no mass", file.hand.joints[k].name);
        return fail(item("hand.joint", k, "mass_kg"), problem, "give its link a mass and an inertia");
    }
    world::at_start(&file, &parts, &start)?;
    let Parts { hand, capsules, object, substeps, mut warnings } = parts;
    world::sinking(&file.plant, object.mass_kg, &mut warnings);
    world::falling(&file, &object.shape, &start, &mut warnings);
    overlaps(&file.hand, &hand, &start.angles_rad, &mut warnings);

    Ok(Scene {
        name: file.name.clone(),
        description: file.description.clone(),
        duration_s: file.duration_s,
        seed: file.seed,
        hand,
        joints: file.hand.joints.iter().map(|joint| joint_parameters(joint, &file)).collect(),
        fingertips: file.hand.fingertip_models(),
        fingertip_friction: world::frictions(&file),
        capsules: if file.plant.links_touch() { capsules } else { Vec::new() },
        capsule_friction: world::capsule_frictions(&file),
        object: object.shape,
        object_name: file.object.name.clone(),
        mass_kg: object.mass_kg,
        inertia_kg_m2: object.inertia_kg_m2,
        contacts,
        start,
        control: file.control.clone(),
        sensors: file.sensors.clone(),
        actuators: file.actuators.clone(),
        friction: file.friction.clone(),
        plant: file.plant.clone(),
        script: file.steps(LONGEST_RUN_S)?,
        substep_s: file.plant.substep_s.unwrap_or(file.control.period_s / substeps as f64),
        substeps,
        warnings,
        file,
    })
}

/// Everything that is a plain number. Returns the number of sub-steps in a control period.
fn settings(file: &SceneFile) -> Result<usize> {
    schema("schema", file.schema)?;
    let control = &file.control;
    let mut refused = Refused::default();
    self::control(control, &mut refused);
    refused.or(Some(()))?;
    within("duration_s", file.duration_s, control.period_s, LONGEST_RUN_S)?;
    within("sensors.noise_counts", file.sensors.noise_counts, 0.0, 1e6)?;
    within("actuators.output_delay_ticks", file.actuators.output_delay_ticks, 0.0, LONGEST_DELAY_TICKS)?;
    if let Some(slew) = file.actuators.slew_limit_nm_s {
        within("actuators.slew_limit_nm_s", slew, 1e-6, 1e9)?;
    }
    within("friction.scale", file.friction.scale, 0.0, 1e4)?;
    all_within("plant.gravity_m_s2", &file.plant.gravity_m_s2, 1000.0)?;
    world::settings(&file.plant, LONGEST_RUN_S)?;
    file.plant.pushes.iter().enumerate().try_for_each(|(index, push)| self::push(index, push))?;
    let Some(substep_s) = file.plant.substep_s else {
        return Ok((control.period_s / LONGEST_STEP_S - 1e-6).ceil() as usize);
    };
    within("plant.substep_s", substep_s, 1e-7, control.period_s)?;
    let ratio = control.period_s / substep_s;
    let substeps = ratio.round();
    if !((ratio - substeps).abs() < 1e-6 * ratio) {
        return fail(
            "plant.substep_s",
            format!("{substep_s} s does not divide the sampling period of {} s", control.period_s),
            format!("{:e} does", control.period_s / ratio.ceil()),
        );
    }
    Ok(substeps as usize)
}

/// A push that does something.
fn push(index: usize, push: &PushFile) -> Result<()> {
    let key = |key: &str| item("plant.push", index, key);
    within(&key("from_s"), push.from_s, 0.0, LONGEST_RUN_S)?;
    within(&key("for_s"), push.for_s, 1e-6, LONGEST_RUN_S)?;
    within(&key("rise_s"), push.rise_s, 0.0, 0.5 * push.for_s)?;
    all_within(&key("force_n"), &push.force_n, 1e4)?;
    all_within(&key("moment_nm"), &push.moment_nm, 1e4)?;
    if push.force_n.iter().chain(&push.moment_nm).all(|part| *part == 0.0) {
        return fail(key("force_n"), "pushes with nothing", "give a force_n, a moment_nm, or both");
    }
    Ok(())
}

/// Pushes that come too late for the run: it may have been shortened for once.
fn late_pushes(file: &SceneFile, warnings: &mut Vec<String>) {
    let late = file.plant.pushes.iter().enumerate().filter(|(_, push)| push.from_s >= file.duration_s);
    warnings.extend(late.map(|(index, push)| {
        let key = item("plant.push", index, "from_s");
        format!("{key}: the run of {:?} s is over before the push at {:?} s", file.duration_s, push.from_s)
    }));
}

/// Checks the gains, of a scene or of a hand.
pub(super) fn control(control: &Control, refused: &mut Refused) {
    let period = |period_s: f64| {
        within("control.period_s", period_s, 1e-4, 0.1)?;
        let microseconds = period_s * 1e6;
        if (microseconds - microseconds.round()).abs() > 1e-6 {
            let problem = format!("{period_s:?} s is not a whole number of microseconds");
            return fail("control.period_s", problem, format!("{:?} is", microseconds.round() * 1e-6));
        }
        Ok(())
    };
    refused.take(period(control.period_s));
    refused.take_all(GAINS.iter().zip(control.gains.iter()).map(|(gain, &value)| {
        let least = if gain.may_be_zero { 0.0 } else { 1e-6 };
        within(&format!("control.{}", gain.key), value, least, 1e4)
    }));
    // The tick's own bounds, so that the file and the key are named here.
    let fastest_hz = 1.0 / (std::f64::consts::PI * control.period_s);
    for (key, value, least, most) in [
        ("damping_scale", control.damping_scale, 0.0, 1e4),
        ("soft_start_s", control.soft_start_s, 0.0, LONGEST_RUN_S),
        ("amplifier_start_ms", control.amplifier_start_ms.into(), 0.0, LONGEST_RUN_S * 1e3),
        ("estimator_bandwidth_hz", control.estimator_bandwidth_hz, 1e-3 * fastest_hz, 0.999 * fastest_hz),
    ] {
        refused.take(within(&format!("control.{key}"), value, least, most));
    }
}
