//! Scenes: a hand, an object and the conditions of a run, read from TOML files, checked, and prepared for the simulator.
//!
//! - **Built in** are the scenes, hands and objects of `models/`, under the names of their files. A name that ends in
//!   `.toml` or contains a separator is a path instead; references in a file are relative to that file.
//! - The **effective configuration** is what stays once references are followed, defaults filled in and `--set` applied:
//!   [`Scene::file`], written by [`Scene::effective_toml`] and read back as the same scene.
//! - An error is one line: where, which key, what is wrong, what to do. What is odd but can be simulated is a warning.
//!
//! Frames: the *base frame* of the hand is the world; the *object frame* has its origin at the object's centre of mass.

mod build;
mod check;
mod controller;
mod crossing;
mod draft;
mod error;
pub mod file;
mod hand;
mod hand_model;
pub mod inspect;
mod library;
pub mod mesh;
mod mjcf;
mod object;
pub mod order;
mod read;
mod script;
mod start;
#[cfg(test)]
pub(crate) mod tests;
mod tree;
mod urdf;
mod world;

use blindgrasp_body::JointFriction;
use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_body::{Capsule, ContactFriction, FaceContact, FingertipModel};
use blindgrasp_body::{Hand, MAX_JOINTS};
use blindgrasp_shared::control::LawsConfig;
use blindgrasp_shared::cycle::Postures;
use blindgrasp_shared::math::Real;
use blindgrasp_shared::tick::Config;
use controller::Setup;
use inspect::finding::Finding;
use library::{Document, Kind};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::ffi::OsStr;
use std::path::Path;
use tree::Node;

pub use draft::Draft;
pub(crate) use error::one_line;
pub use error::{Place, SceneError, suggestion};
pub use file::{
    Actuators, Control, Friction, HandFile, ObjectFile, PlantSettings, PostureFile, Safety, SceneFile,
    Sensors, StepFile,
};
pub use hand::posture;
pub(crate) use hand::{Examined, direction, still_joints};
pub use hand_model::HandModel;
pub use library::is_of_files;
pub use mjcf::Mjcf;
pub use object::ObjectBody;
pub(crate) use object::breaks_triangle;
pub use script::Step;
pub use tree::Setting;
pub use urdf::{FingertipRequest, Starter, StarterRequest, TunedGains};

/// A scene, checked and ready for the simulator.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Its name.
    pub name: String,
    /// A sentence or two about it.
    pub description: String,
    /// Length of the run, s.
    pub duration_s: f64,
    /// Seed of the noise.
    pub seed: u32,
    /// Kinematics and link masses of the hand.
    pub hand: Hand,
    /// One a joint, in the hand's order.
    pub joints: Vec<JointParameters>,
    /// One a fingertip, in the hand's order.
    pub fingertips: Vec<FingertipModel>,
    /// The friction of each fingertip against the object, where contacts have friction.
    pub fingertip_friction: Vec<ContactFriction>,
    /// Links and palm, where they touch; empty otherwise.
    pub capsules: Vec<Capsule>,
    /// The sliding friction of each capsule against the object.
    pub capsule_friction: Vec<f64>,
    /// The object in its own frame.
    pub object: Polyhedron,
    /// Its name.
    pub object_name: String,
    /// Its mass, kg.
    pub mass_kg: f64,
    /// Its inertia about its centre of mass in the object frame, kg m^2. Not diagonal in general.
    pub inertia_kg_m2: Matrix3<f64>,
    /// The face that each fingertip touches, in the hand's order; none where the hand begins open.
    pub contacts: Vec<FaceContact>,
    /// The posture and the places at the start; all speeds are zero.
    pub start: Start,
    /// The controller.
    pub control: Control,
    /// The joint sensors.
    pub sensors: Sensors,
    /// The motors and their amplifiers.
    pub actuators: Actuators,
    /// The friction of the joints. Its factor is already in [`JointParameters`].
    pub friction: Friction,
    /// The simulated world.
    pub plant: PlantSettings,
    /// Step of the integrator, s.
    pub substep_s: f64,
    /// The number of steps of the integrator in one control period.
    pub substeps: usize,
    /// Oddities that can be simulated, in words.
    pub warnings: Vec<String>,
    /// The commands to the hand, step by step.
    pub script: Vec<Step>,
    /// The effective configuration.
    pub file: SceneFile,
}

/// The parts of a scene before hand and object meet, checked and prepared.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// Kinematics and link masses of the hand.
    pub hand: Hand,
    /// Its links and palm, whatever the contact; empty where the scene says that they don't touch.
    pub capsules: Vec<Capsule>,
    /// The object.
    pub object: ObjectBody,
    /// The number of steps of the integrator in one control period.
    pub substeps: usize,
    /// Oddities that can be simulated, in words.
    pub warnings: Vec<String>,
}

impl Parts {
    /// Of a configuration whose pose and contacts are still to be found.
    ///
    /// # Errors
    /// One line: which key, what is wrong, what to do.
    pub fn of(file: &SceneFile) -> Result<Self, SceneError> {
        build::parts(file)
    }
}

/// The parameters of a joint that the simulator needs besides the [`Hand`]. Torque limit and friction are those that
/// the scene asks for: switched off, they are infinite and zero.
#[derive(Clone, Debug, PartialEq)]
pub struct JointParameters {
    /// Its name.
    pub name: String,
    /// Gain `C` of Eq. 30, with the scene's factor, N m s/rad.
    pub damping_gain_nm_s_rad: f64,
    /// The largest torque of the motor at the joint, N m; infinite where the scene switches the limits off.
    pub torque_limit_nm: f64,
    /// The largest speed of the motor at the joint, rad/s.
    pub speed_limit_rad_s: f64,
    /// Encoder counts in one turn of the joint.
    pub encoder_counts_per_turn: f64,
    /// `true` if the count falls while the joint turns in its positive direction.
    pub encoder_reversed: bool,
    /// The count at joint angle zero.
    pub encoder_zero_count: i32,
    /// Friction, with the scene's factor.
    pub friction: JointFriction,
}

/// The posture and the places at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Joint angles, rad.
    pub angles_rad: Vec<f64>,
    /// Centre of mass of the object in the base frame, m.
    pub position_m: Vector3<f64>,
    /// Attitude `R` of the object.
    pub attitude: UnitQuaternion<f64>,
    /// Indentation `dr_i` of each fingertip, m; none where the hand begins open.
    pub indentations_m: Vec<f64>,
    /// Contact point of each fingertip in the object frame, m; none where the hand begins open.
    pub points_m: Vec<Vector3<f64>>,
}

impl Scene {
    /// Loads a scene by its built-in name or by its path, which ends in `.toml` or contains a separator, with settings
    /// `KEY=VALUE`: keys of the effective configuration such as `control.force_n` or `hand.joint.3.mass_kg`. Items of a
    /// list go by their number from 1, by the `name` they have, or `*` for all.
    ///
    /// # Errors
    /// One line: where, which key, what is wrong, what to do.
    pub fn load(name_or_path: impl AsRef<OsStr>, settings: &[String]) -> Result<Self, SceneError> {
        Self::from_document(open(Kind::Scene, name_or_path.as_ref())?, settings)
    }

    /// Reads a scene from a text. `source` is its name in errors; references are relative to `folder`.
    ///
    /// # Errors
    /// One line: where, which key, what is wrong, what to do.
    pub fn parse(text: &str, source: &str, folder: &Path, settings: &[String]) -> Result<Self, SceneError> {
        Self::from_document(Document::parse(text, source, folder)?, settings)
    }

    fn from_document(document: Document, settings: &[String]) -> Result<Self, SceneError> {
        let settings = settings.iter().map(|text| Setting::parse(text)).collect::<Result<Vec<_>, _>>()?;
        Draft::of(document, &settings)?.scene(&settings)
    }

    /// Checks and prepares a scene that was put together in code.
    ///
    /// # Errors
    /// One line: which key, what is wrong, what to do.
    pub fn build(file: SceneFile) -> Result<Self, SceneError> {
        build::scene(file)
    }

    /// The effective configuration, hand and object included. Reading it gives this scene again.
    pub fn effective_toml(&self) -> String {
        self.file.to_toml()
    }

    /// The configuration of the controller; zero beyond the hand's joints.
    pub fn controller_config(&self) -> Config<MAX_JOINTS> {
        self.setup().config()
    }

    /// The hand's named postures, as the controller has them.
    pub fn named_postures(&self) -> Postures<MAX_JOINTS> {
        hand_model::named_postures(&self.file.hand.postures)
    }

    /// The control laws and their gains, in either precision.
    pub fn laws_config<T: Real>(&self) -> LawsConfig<T, MAX_JOINTS> {
        self.setup().laws()
    }

    fn setup(&self) -> Setup<'_> {
        Setup {
            hand: &self.hand,
            joints: &self.file.hand.joints,
            control: &self.control,
            safety: &self.file.hand.safety,
            sensors: &self.sensors,
            actuators: &self.actuators,
            gravity_m_s2: self.plant.gravity_m_s2,
        }
    }

    /// Names of the built-in scenes.
    pub fn built_in() -> impl Iterator<Item = &'static str> {
        Kind::Scene.built_in().iter().map(|(name, _)| *name)
    }
}

impl SceneFile {
    /// Returns the text of its file, hand and object included.
    pub fn to_toml(&self) -> String {
        // Only what TOML can't express fails, and none of the structs contains such a thing.
        toml::to_string(self).unwrap_or_default()
    }
}

impl HandFile {
    /// Returns the text of its file.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }

    /// Names of the built-in hands.
    pub fn built_in() -> impl Iterator<Item = &'static str> {
        Kind::Hand.built_in().iter().map(|(name, _)| *name)
    }

    /// Loads a hand by its built-in name or by its path.
    ///
    /// # Errors
    /// What is wrong with the file as a file; a [`Scene`] checks the numbers.
    pub fn load(name_or_path: impl AsRef<OsStr>) -> Result<Self, SceneError> {
        Self::load_with_places(name_or_path).map(|(file, _)| file)
    }

    /// The same, with where its values come from.
    pub(crate) fn load_with_places(name_or_path: impl AsRef<OsStr>) -> Result<(Self, Places), SceneError> {
        Self::from_document(open(Kind::Hand, name_or_path.as_ref())?)
    }

    /// Reads a hand from a text; `source` is its name in places.
    pub(crate) fn parse_with_places(text: &str, source: &str) -> Result<(Self, Places), SceneError> {
        Self::from_document(Document::parse(text, source, Path::new(""))?)
    }

    fn from_document(document: Document) -> Result<(Self, Places), SceneError> {
        let mut notices = Vec::new();
        let tree = document.complete_hand(&mut notices)?;
        Ok((read::read(&tree, "")?, Places { tree, notices }))
    }
}

/// The places that the values of a file come from, and the oddities on the way.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    tree: Node,
    /// Oddities of the file, or of what it names.
    pub(crate) notices: Vec<Finding>,
}

impl Places {
    /// The place of a key, or that of the nearest thing around it.
    pub(crate) fn of(&self, key: &str) -> Place {
        self.tree.place_of(key).clone()
    }

    /// An error with the place of its key.
    fn locate(&self, error: SceneError) -> SceneError {
        let place = self.of(&error.key);
        error.at(&place)
    }

    /// The oddities in words.
    fn warnings(&self) -> Vec<String> {
        self.notices.iter().map(|notice| notice.words(0)).collect()
    }
}

impl ObjectFile {
    /// Loads an object by its built-in name or by its path.
    ///
    /// # Errors
    /// What is wrong with the file as a file; a [`Scene`] checks the numbers.
    pub fn load(name_or_path: impl AsRef<OsStr>) -> Result<Self, SceneError> {
        Self::load_with_places(name_or_path).map(|(file, _)| file)
    }

    /// Reads an object from a text. `source` is its name in errors; its mesh is relative to `folder`.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(text: &str, source: &str, folder: &Path) -> Result<Self, SceneError> {
        read::read(&Document::parse(text, source, folder)?.complete_object(&mut Vec::new())?, "")
    }

    /// Loads an object and checks its numbers; with what is odd in it, in words.
    ///
    /// # Errors
    /// One line: where, which key, what is wrong, what to do.
    pub fn load_checked(name_or_path: impl AsRef<OsStr>) -> Result<(Self, Vec<String>), SceneError> {
        let (file, places) = Self::load_with_places(name_or_path)?;
        let mut warnings = places.warnings();
        file.body(&mut warnings).map_err(|error| places.locate(error))?;
        Ok((file, warnings))
    }

    /// The same, with where its values come from.
    pub(crate) fn load_with_places(name_or_path: impl AsRef<OsStr>) -> Result<(Self, Places), SceneError> {
        let mut notices = Vec::new();
        let tree = open(Kind::Object, name_or_path.as_ref())?.complete_object(&mut notices)?;
        Ok((read::read(&tree, "")?, Places { tree, notices }))
    }
}

fn open(kind: Kind, name_or_path: &OsStr) -> Result<Document, SceneError> {
    Document::open(kind, name_or_path, Path::new("")).map_err(|error| error.at(&Place::of_path(name_or_path)))
}
