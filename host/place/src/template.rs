//! A scene as `scene new` writes it, before its pose and its contacts are known.

use super::SceneFile;
use blindgrasp_model::SceneError;
use blindgrasp_model::file::{
    Actuators, Control, Friction, HandFile, Indentation, ObjectFile, PlantSettings, PoseFile, SCHEMA,
    Sensors, StartFile,
};

/// Length of a run, s.
const DURATION_S: f64 = 5.0;
/// Depth to which the fingers of a real hand touch before they grasp, m.
const JUST_TOUCHING_M: f64 = 1e-4;

/// A scene with a hand and an object: with the gains of the hand's file, its encoders, limits and friction, and one tick of
/// delay; or `ideal`, in the paper's own model, which has none of these.
///
/// # Errors
/// A hand that says nothing of its gains.
pub fn template(hand: HandFile, object: ObjectFile, ideal: bool) -> Result<SceneFile, SceneError> {
    let Some(gains) = hand.control.clone() else {
        return Err(SceneError::new(
            "hand.control",
            format!("the hand `{}` says nothing of its gains", hand.name),
            "add a table [control] to its file, with the keys that a scene's has: force_n, attitude_stiffness_nm, ...",
        ));
    };
    // It begins in touch.
    let gains = Control { closing_speed_m_s: 0.0, ..gains };
    let control = if ideal { Control { soft_start_s: 0.0, end_stops: false, ..gains } } else { gains };
    let start = if ideal { Indentation::Equilibrium } else { Indentation::Metres(JUST_TOUCHING_M) };
    let model =
        if ideal { ", in the paper's model" } else { ", with encoders, motor limits and joint friction" };
    Ok(SceneFile {
        schema: SCHEMA,
        name: format!("{}-{}{}", hand.name, object.name, if ideal { "-ideal" } else { "" }),
        description: format!("{} in the hand {}{model}", object.name, hand.name),
        duration_s: DURATION_S,
        seed: 1,
        hand,
        object,
        pose: PoseFile::default(),
        contacts: Vec::new(),
        start: StartFile { indentation_m: start, ..StartFile::default() },
        control,
        sensors: Sensors { ideal, noise_counts: 0.0 },
        actuators: if ideal {
            Actuators { output_delay_ticks: 0.0, torque_limits: false, slew_limit_nm_s: None }
        } else {
            Actuators::default()
        },
        friction: Friction { scale: if ideal { 0.0 } else { 1.0 } },
        script: Vec::new(),
        plant: PlantSettings::default(),
    })
}
