//! The file of a placed scene, with comments that say what touches what, and why.

use super::Placement;
use blindgrasp_model::file::{Indentation, SceneFile};
use blindgrasp_shared::control::{AttitudeError, GAINS};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The scene as a file: reading it gives the placement's scene again. `hand` and `object` are built-in names, or paths
/// relative to the file.
/// `outcome` says in words what a simulation of it came to.
pub fn scene_text(placement: &Placement, hand: &str, object: &str, outcome: &str) -> String {
    let file = &placement.scene.file;
    let mut text = String::new();
    head(&mut text, file, [hand, object, outcome]);
    pose(&mut text, file);
    contacts(&mut text, placement);
    start(&mut text, file);
    settings(&mut text, file);
    text
}

/// A string as TOML has it.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

fn head(text: &mut String, file: &SceneFile, [hand, object, outcome]: [&str; 3]) {
    let model = if file.sensors.ideal {
        "# The paper's own model: no friction, true joint angles, no delay, no limits.\n"
    } else {
        "# Encoders, motors, limits and friction are those of the hand; the gains are those of its [control].\n"
    };
    let _ = write!(
        text,
        "# Written by `blindgrasp scene new`: where the fingertips touch, and how the object lies between them.\n{model}\
         # Simulated before it was written: {outcome}.\n\
         schema = {}\nname = {}\ndescription = {}\nduration_s = {:?}\nseed = {}\nhand = {}\nobject = {}\n",
        file.schema,
        quoted(&file.name),
        quoted(&file.description),
        file.duration_s,
        file.seed,
        quoted(hand),
        quoted(object),
    );
}

fn pose(text: &mut String, file: &SceneFile) {
    let pose = &file.pose;
    let _ = write!(
        text,
        "\n[pose]                        # of the object's centre of mass, in the base frame of the hand\nposition_m = {:?}\n",
        pose.position_m
    );
    if let Some(angles) = &pose.rotation_rpy_rad {
        let _ = writeln!(text, "rotation_rpy_rad = {angles:?}");
    }
    if let Some(quaternion) = &pose.quaternion_wxyz {
        let _ = writeln!(text, "quaternion_wxyz = {quaternion:?}");
    }
}

fn contacts(text: &mut String, placement: &Placement) {
    let (scene, quality) = (&placement.scene, &placement.quality);
    let _ = write!(
        text,
        "\n# Chance to hold for 5 s in the paper's model, by where the law comes to rest: {:.2}. The joint with the least room before\n\
         # an end stop is `{}`, with {:.2} rad. C_Y is the normal into the object, in the base frame; forces are those at the start.\n",
        quality.chance, quality.tightest_joint, quality.room_rad,
    );
    for (i, contact) in scene.file.contacts.iter().enumerate() {
        let tip = &quality.fingertips[i];
        let normal = (scene.start.attitude * scene.contacts[i].frame.column(1))
            .map(|v| (v * 100.0).round() / 100.0 + 0.0);
        let _ = write!(
            text,
            "[[contact]]                   # {}: C_Y = ({}, {}, {})\n\
             # {:.2} N along C_Y and {:.2} N across; rolls {:.1} mm until u_st holds it, {:.1} mm from the edge of its face.\n",
            scene.file.hand.fingertips[i].name,
            normal.x,
            normal.y,
            normal.z,
            tip.normal_force_n,
            tip.tangential_force_n,
            tip.rolled_m * 1e3,
            tip.margin_m * 1e3,
        );
        if let Some(face) = contact.face {
            let _ = writeln!(text, "face = {face}");
        }
        if let Some(point) = &contact.point_m {
            let _ = writeln!(text, "point_m = {point:?}");
        }
    }
}

fn start(text: &mut String, file: &SceneFile) {
    let _ = write!(text, "\n[start]\n");
    let _ = match file.start.indentation_m {
        Indentation::Equilibrium => writeln!(text, "indentation_m = \"equilibrium\" # of Eq. 57"),
        Indentation::Metres(m) => writeln!(text, "indentation_m = {m:?}          # the fingers just touch"),
    };
    if !file.start.trunk_rad.is_empty() {
        let _ = write!(text, "\n[start.trunk_rad]\n");
        for (joint, angle) in &file.start.trunk_rad {
            let _ = writeln!(text, "{} = {angle:?}", quoted(joint));
        }
    }
}

fn settings(text: &mut String, file: &SceneFile) {
    let (control, plant) = (&file.control, &file.plant);
    let _ = write!(
        text,
        "\n[control]\nforce_n = {:?}                 # f_d\nattitude_stiffness_nm = {:?}   # K_st\ndamping_scale = {:?}\n\
         gravity_compensation = {}\nperiod_s = {:?}\nsoft_start_s = {:?}\nestimator_bandwidth_hz = {:?}\nend_stops = {}\n",
        control.force_n(),
        control.attitude_stiffness_nm(),
        control.damping_scale,
        control.gravity_compensation,
        control.period_s,
        control.soft_start_s,
        control.estimator_bandwidth_hz,
        control.end_stops,
    );
    if control.attitude_error != AttitudeError::Sine {
        let _ = writeln!(text, "attitude_error = \"half-angle\"   # of u_st: 4 sin(a/2)");
    }
    if control.amplifier_start_ms != 0 {
        let _ = writeln!(text, "amplifier_start_ms = {}", control.amplifier_start_ms);
    }
    for (gain, value) in GAINS.iter().zip(control.gains.iter()).skip(control.gains.grasp.len()) {
        if *value != 0.0 {
            let _ = writeln!(text, "{} = {value:?}    # {}", gain.key, gain.words);
        }
    }
    let _ = write!(
        text,
        "\n[sensors]\nideal = {}\nnoise_counts = {:?}\n\n[actuators]\noutput_delay_ticks = {:?}\ntorque_limits = {}\n",
        file.sensors.ideal,
        file.sensors.noise_counts,
        file.actuators.output_delay_ticks,
        file.actuators.torque_limits,
    );
    if let Some(slew) = file.actuators.slew_limit_nm_s {
        let _ = writeln!(text, "slew_limit_nm_s = {slew:?}");
    }
    let _ = write!(
        text,
        "\n[friction]\nscale = {:?}\n\n{}",
        file.friction.scale,
        // Only what TOML can't express fails, and none of the structs contains such a thing.
        toml::to_string(&BTreeMap::from([("plant", plant)])).unwrap_or_default(),
    );
}
