//! A hand without a scene: what its firmware is built with.

use super::{
    build::control,
    check::{Result, fail, name},
    controller::Setup,
    error::{Place, SceneError},
    file::{Actuators, HandFile, PlantSettings, SCHEMA, Sensors},
    hand::hand,
    library::{Document, Kind, complete_hand},
    read::read,
};
use crate::{Hand, MAX_FINGERS, MAX_JOINTS};
use blindgrasp_shared::tick::{Config, Model, Params};
use std::path::Path;

/// A hand, checked, with the configuration that its file asks for: encoders, torque limits, soft end stops as in
/// `[control]`, and gravity along `-z` of its base, which is a palm that looks up.
#[derive(Clone, Debug, PartialEq)]
pub struct HandModel {
    /// Its name.
    pub name: String,
    /// Kinematics and link masses.
    pub hand: Hand,
    /// Names of the joints, in the hand's order.
    pub joint_names: Vec<String>,
    /// The controller's configuration; zero beyond the hand's joints.
    pub config: Config<f32, MAX_JOINTS>,
    /// What is odd but can be used, in words.
    pub warnings: Vec<String>,
}

impl HandModel {
    /// Loads a hand by its built-in name or by its path, which ends in `.toml` or contains a separator. Its file needs the
    /// table `[control]`.
    ///
    /// # Errors
    /// One line: where, which key, what is wrong, what to do.
    pub fn load(name_or_path: &str) -> std::result::Result<Self, SceneError> {
        let whole = Place::whole(name_or_path);
        let mut tree =
            Document::open(Kind::Hand, name_or_path, Path::new("")).map_err(|error| error.at(&whole))?.node;
        complete_hand(&mut tree);
        let file = read(&tree, "")?;
        Self::build(&file).map_err(|mut error| {
            // The checks know the keys of a scene.
            if let Some(key) = error.key.strip_prefix("hand.") {
                error.key = key.into();
            }
            let place = tree.place_of(&error.key).clone();
            error.at(&place)
        })
    }

    fn build(file: &HandFile) -> Result<Self> {
        if file.schema != SCHEMA {
            return fail(
                "schema",
                format!("{} is a format that this program does not know", file.schema),
                format!("write it as format {SCHEMA}"),
            );
        }
        name("name", &file.name)?;
        let Some(gains) = &file.control else {
            return fail(
                "control",
                "the hand says nothing of its gains, which its firmware needs",
                "add a table [control] with the keys that a scene's has: force_n, attitude_stiffness_nm, ...",
            );
        };
        control(gains)?;
        let mut warnings = Vec::new();
        let hand = hand(file, &mut warnings)?;
        let setup = Setup {
            joints: &file.joints,
            control: gains,
            sensors: &Sensors::default(),
            actuators: &Actuators::default(),
            gravity_m_s2: PlantSettings::default().gravity_m_s2,
        };
        let config = setup.config();
        // What is in range in f64 may not be in f32.
        if let Err(error) = Params::new(hand.cast::<f32>(), &config) {
            return fail("control", format!("the controller refuses it: {error}"), "");
        }
        let joint_names = file.joints.iter().map(|joint| joint.name.clone()).collect();
        Ok(Self { name: file.name.clone(), hand, joint_names, config, warnings })
    }

    /// What the firmware is built with, as [`Model::decode`] reads it.
    pub fn encode(&self) -> Vec<u8> {
        let model: Model<MAX_JOINTS, MAX_FINGERS> = Model { hand: self.hand.cast(), config: self.config };
        let mut buffer = vec![0; 1024];
        loop {
            match model.encode(&mut buffer) {
                Ok(bytes) => return bytes.to_vec(),
                Err(_) => buffer.resize(2 * buffer.len(), 0),
            }
        }
    }
}
