//! Scenes: a hand, an object and the conditions of a run, read from TOML files, checked, and prepared for the simulator.
//!
//! - **Built in** are the scenes, hands and objects of `models/`, under the names of their files. A name that ends in
//!   `.toml` or contains a separator is a path instead; references in a file are relative to that file.
//! - The **effective configuration** is what stays once references are followed, defaults filled in and `--set` applied:
//!   [`Scene::file`], written by [`Scene::effective_toml`] and read back as the same scene.
//! - An error is one line: where, which key, what is wrong, what to do. What is odd but can be simulated is a warning.
//!
//! Frames: the *base frame* of the hand is the world; the *object frame* has its origin at the object's centre of mass.

pub mod file;

use crate::{Hand, plant::polyhedron::Polyhedron};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

pub use file::{Actuators, Control, Friction, PlantSettings, SceneFile, Sensors};

/// A scene, checked and ready for the simulator.
#[derive(Clone, Debug)]
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
    pub fingertips: Vec<FingertipParameters>,
    /// The object in its own frame.
    pub object: Polyhedron,
    /// Its name.
    pub object_name: String,
    /// Its mass, kg.
    pub mass_kg: f64,
    /// Its inertia about its centre of mass in the object frame, kg m^2. Not diagonal in general.
    pub inertia_kg_m2: Matrix3<f64>,
    /// The face that each fingertip touches, in the hand's order.
    pub contacts: Vec<FaceContact>,
    /// Where everything is at the start; all speeds are zero.
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
    /// How many steps of the integrator make one control period.
    pub substeps: usize,
    /// What is odd but can be simulated, in words.
    pub warnings: Vec<String>,
    /// The effective configuration.
    pub file: SceneFile,
}

/// What the simulator needs to know of a joint besides the [`Hand`]. Limits and friction are those that the scene asks for:
/// switched off, they are infinite and zero.
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
    /// Viscous friction, with the scene's factor, N m s/rad.
    pub viscous_friction_nm_s_rad: f64,
    /// Coulomb friction, with the scene's factor, N m.
    pub coulomb_friction_nm: f64,
    /// How far the joint gives before its Coulomb friction lets it slide, rad.
    pub presliding_rad: f64,
}

/// What the simulator needs to know of a soft fingertip besides the [`Hand`].
#[derive(Clone, Debug, PartialEq)]
pub struct FingertipParameters {
    /// Its name.
    pub name: String,
    /// Radius `r_i`, m.
    pub radius_m: f64,
    /// Stiffness `k_i` of Eq. 14, N/m^2.
    pub stiffness_n_m2: f64,
    /// Damping `xi_i` of Eq. 14 for each square metre of contact area, (N s/m)/m^2.
    pub damping_n_s_m_per_m2: f64,
    /// Torsional damping `b_i` of Eq. 15 for each square metre of contact area, (N m s/rad)/m^2.
    pub torsional_damping_nm_s_rad_per_m2: f64,
}

impl FingertipParameters {
    /// Contact area `pi (2 r dr - dr^2)` of Table I at the indentation `dr`, m^2; zero without contact.
    pub fn contact_area_m2(&self, indentation_m: f64) -> f64 {
        let indentation_m = indentation_m.max(0.0);
        std::f64::consts::PI * (2.0 * self.radius_m - indentation_m) * indentation_m
    }
}

/// The face that a fingertip touches, as the paper sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceContact {
    /// Index of the face.
    pub face: usize,
    /// `R_Ci` of Eq. 3: columns `C_X`, `C_Y` (the face's normal **into** the object) and `C_Z` in the object frame.
    pub frame: Matrix3<f64>,
    /// `Y_i` of Eq. 5: distance of the face's plane from the centre of mass, m.
    pub distance_m: f64,
    /// Contact point at the start in the object frame, m.
    pub point_m: Vector3<f64>,
}

/// Where everything is at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Joint angles, rad.
    pub angles_rad: Vec<f64>,
    /// Centre of mass of the object in the base frame, m.
    pub position_m: Vector3<f64>,
    /// Attitude `R` of the object.
    pub attitude: UnitQuaternion<f64>,
    /// Indentation `dr_i` of each fingertip, m.
    pub indentations_m: Vec<f64>,
}
