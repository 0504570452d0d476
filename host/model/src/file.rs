//! The keys of files: scenes, hands, objects. Every key carries its unit; nothing else is allowed. The words of their
//! documentation are those of `docs/scenes.md`.
//!
//! These structs are the effective configuration: what stays after references are followed, defaults filled in and
//! `--set` applied. Tests build them in code and hand them to [`Scene::build`](super::Scene::build).

mod control;
mod key;
mod object;
mod push;
mod safety;
mod world;

pub use control::Control;
pub use key::{FileKey, ShapeKind};
pub use object::{ObjectFile, ShapeFile};
pub use push::PushFile;
pub use safety::{Safety, SafetyKey};
pub use world::{ContactLaw, MoveFile, PlantSettings, ShakeFile, TableFile, TurnFile};

use key::keys;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::collections::BTreeMap;

/// The version of the format that this program reads and writes.
pub const SCHEMA: u32 = 1;

keys! {
    /// A scene: a hand, an object, where they meet, and everything that a run depends on.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct SceneFile {
        /// Version of the format: 1.
        pub schema: u32,
        /// Name of the scene, a word.
        pub name: String,
        /// A sentence or two on it.
        #[serde(default)]
        pub description: String,
        /// Length of the run, s; `--duration` sets it.
        pub duration_s: f64,
        /// Seed of the noise on the sensors; it does nothing while there is none.
        #[serde(default)]
        pub seed: u32,
        /// The hand: the name of a built-in one, the path of its file relative to this one, or all of it as a table
        /// (`hands.md` has its keys).
        pub hand: HandFile,
        /// The object: the name of a built-in one, the path of its file relative to this one, or all of it as a table (its
        /// keys are below).
        pub object: ObjectFile,
        /// Position and attitude of the object at the start.
        pub pose: PoseFile,
        /// The points at which fingertips touch the object: one `[[contact]]` for each fingertip, in the hand's order. None where the
        /// hand begins open, without touch: with `start.posture` or `start.angles_rad`, and `plant.contact = "coulomb"`.
        #[serde(rename = "contact", default, skip_serializing_if = "Vec::is_empty")]
        pub contacts: Vec<ContactFile>,
        /// Posture and indentation at the start.
        #[serde(default)]
        pub start: StartFile,
        /// The controller.
        pub control: Control,
        /// The joint sensors.
        #[serde(default)]
        pub sensors: Sensors,
        /// The motors and their amplifiers.
        #[serde(default)]
        pub actuators: Actuators,
        /// Friction of the joints.
        #[serde(default)]
        pub friction: Friction,
        /// The simulated world.
        #[serde(default)]
        pub plant: PlantSettings,
        /// The commands to the hand, step by step, once it is armed; without them it grasps at time 0.
        #[serde(rename = "script", default, skip_serializing_if = "Vec::is_empty")]
        pub script: Vec<StepFile>,
    }
}

keys! {
    /// A step of a script. It is done when the one before it was, what it waits for has come, and its time is over.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct StepFile {
        /// The command, in the words of `console`: `posture preshape`, `grasp`, `move z_mm=15 turn_z_deg=20`, `put-down`.
        #[serde(rename = "do")]
        pub order: String,
        /// The notice that has to come first, since the step before: `in-posture`, `holding`, `at-target`, `on-ground`, ...
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub when: Option<String>,
        /// Time that is to pass then, s.
        #[serde(default)]
        pub after_s: f64,
        /// Time from the beginning of the run before which it is not done, s.
        #[serde(default)]
        pub at_s: f64,
        /// Longest time to wait for what it waits for, s; then the script is over.
        #[serde(default = "ten")]
        pub within_s: f64,
    }
}

fn ten() -> f64 {
    10.0
}

keys! {
    /// A position and an attitude in the base frame of the hand.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct PoseFile {
        /// Position of the object's centre of mass, m.
        pub position_m: [f64; 3],
        /// Attitude of the object: roll, pitch and yaw about fixed x, y and z axes, in this order, rad; without it, 0.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub rotation_rpy_rad: Option<[f64; 3]>,
        /// Attitude as a unit quaternion w, x, y, z, instead of the angles.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub quaternion_wxyz: Option<[f64; 4]>,
    }
}

keys! {
    /// The point at which a fingertip touches the object. The object frame has the axes of the shape's description and its origin at the
    /// object's centre of mass.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct ContactFile {
        /// Number of the face, from 0 (`object check` lists them); without it, the face that the point lies on.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub face: Option<usize>,
        /// Point of the face in the object frame, m; without it, the mean of the face's corners. Where `start.angles_rad`
        /// places the fingers, it does nothing but find the face.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub point_m: Option<[f64; 3]>,
    }
}

keys! {
    /// Posture and indentation at the start, at rest.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct StartFile {
        /// Indentation of the fingertips at the start, m; or `"equilibrium"`, at which the normal forces are those of Eq. 57,
        /// where the grasp settles.
        #[serde(default)]
        pub indentation_m: Indentation,
        /// Angles of joints that move several fingertips (an arm's), rad, by their names: `trunk_rad = { wrist = 0.3 }`. Those
        /// left out stay at their nominal angles.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        pub trunk_rad: BTreeMap<String, f64>,
        /// Name of a posture of the hand's file, for the angles of all joints.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub posture: Option<String>,
        /// Angles of all joints, rad, in the hand's order. They replace the inverse kinematics: contact points and indentations
        /// follow.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub angles_rad: Option<Vec<f64>>,
    }
}

/// Indentation `dr_i` at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Indentation {
    /// The same for every fingertip, m.
    Metres(f64),
    /// The one of Eq. 57, at which the normal forces are those that the grasp settles at. In files: `"equilibrium"`.
    Equilibrium,
}

impl Default for Indentation {
    /// The fingers just touch.
    fn default() -> Self {
        Self::Metres(1e-4)
    }
}

impl Serialize for Indentation {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Metres(m) => serializer.serialize_f64(*m),
            Self::Equilibrium => serializer.serialize_str("equilibrium"),
        }
    }
}

impl<'de> Deserialize<'de> for Indentation {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = Indentation;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "a length in metres, or \"equilibrium\"")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Indentation, E> {
                Ok(Indentation::Metres(v))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Indentation, E> {
                Ok(Indentation::Metres(v as f64))
            }
            fn visit_str<E: de::Error>(self, v: &str) -> Result<Indentation, E> {
                match v {
                    "equilibrium" => Ok(Indentation::Equilibrium),
                    _ => Err(E::invalid_value(de::Unexpected::Str(v), &self)),
                }
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

keys! {
    /// The joint sensors.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct Sensors {
        /// `true`: the controller gets true angles and speeds in place of encoder counts, as in the paper's model.
        #[serde(default)]
        pub ideal: bool,
        /// Standard deviation of the noise on the encoders, counts.
        #[serde(default)]
        pub noise_counts: f64,
    }
}

keys! {
    /// The motors and their amplifiers.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct Actuators {
        /// Control periods from the reading of the encoders to the torque that follows from it, 0 to 1000, whole or not. A
        /// controller that reads first and writes last has 1.
        #[serde(default = "one")]
        pub output_delay_ticks: f64,
        /// `false`: the motors have no torque limits, as in the paper's model.
        #[serde(default = "yes")]
        pub torque_limits: bool,
        /// Fastest change of a torque, N m/s; without it, a joint's whole torque within the hand's `safety.slew_s`, if torque
        /// limits apply.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub slew_limit_nm_s: Option<f64>,
    }
}

impl Default for Actuators {
    fn default() -> Self {
        Self { output_delay_ticks: 1.0, torque_limits: true, slew_limit_nm_s: None }
    }
}

keys! {
    /// The friction of the joints.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct Friction {
        /// Factor on the friction of the hand's joints; 0 in the paper's model, which has none.
        #[serde(default = "one")]
        pub scale: f64,
    }
}

impl Default for Friction {
    fn default() -> Self {
        Self { scale: 1.0 }
    }
}

keys! {
    /// A hand.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct HandFile {
        /// Version of the format: 1.
        pub schema: u32,
        /// A word.
        pub name: String,
        /// A sentence or two.
        #[serde(default)]
        pub description: String,
        /// The gains of its firmware. A scene has its own.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub control: Option<Control>,
        /// Its safety numbers, in its firmware and in scenes.
        #[serde(default)]
        pub safety: Safety,
        /// The joints, each after its parent. In a file, keys of `[joint_defaults]` stand for those that a joint leaves out.
        #[serde(rename = "joint")]
        pub joints: Vec<JointFile>,
        /// The fingertips. In a file, keys of `[fingertip_defaults]` stand for those that a fingertip leaves out.
        #[serde(rename = "fingertip")]
        pub fingertips: Vec<FingertipFile>,
        /// The surfaces of links and palm. In a file, keys of `[capsule_defaults]` stand for those that a capsule leaves out.
        #[serde(rename = "capsule", default, skip_serializing_if = "Vec::is_empty")]
        pub capsules: Vec<CapsuleFile>,
        /// Postures that commands and scenes name.
        #[serde(rename = "posture", default, skip_serializing_if = "Vec::is_empty")]
        pub postures: Vec<PostureFile>,
    }
}

keys! {
    /// A revolute joint, the link that it carries, and its motor.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct JointFile {
        /// Its name, which is also its link's.
        pub name: String,
        /// Name of the joint on whose link it sits; without it, the base.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub parent: Option<String>,
        /// Position of its link frame in the parent's link frame, m.
        #[serde(default)]
        pub offset_m: [f64; 3],
        /// Attitude of its link frame at zero angle in the parent's link frame: roll, pitch and yaw about fixed x, y and z
        /// axes, in this order, rad.
        #[serde(default)]
        pub rotation_rpy_rad: [f64; 3],
        /// Its axis in its link frame, a unit vector.
        pub axis: [f64; 3],
        /// Lower and upper end stop, rad.
        pub limits_rad: [f64; 2],
        /// Angle that the inverse kinematics starts from and stays close to, rad.
        #[serde(default)]
        pub nominal_rad: f64,
        /// Mass of the link, kg; 0 for a link that is counted in another.
        #[serde(default)]
        pub mass_kg: f64,
        /// Centre of mass in the link frame, m.
        #[serde(default)]
        pub mass_centre_m: [f64; 3],
        /// Inertia about the centre of mass in the axes of the link frame, kg m^2: xx, yy, zz, and xy, xz, yz unless zero.
        #[serde(default)]
        pub inertia_kg_m2: InertiaFile,
        /// Gain `C` of Eq. 30, N m s/rad.
        pub damping_gain_nm_s_rad: f64,
        /// The largest torque at the joint, N m.
        pub torque_limit_nm: f64,
        /// The largest speed at the joint, rad/s.
        pub speed_limit_rad_s: f64,
        /// Encoder counts in one turn of the joint, all edges counted.
        pub encoder_counts_per_turn: f64,
        /// `true` where the count falls while the joint turns in its positive direction.
        #[serde(default)]
        pub encoder_reversed: bool,
        /// The count at joint angle zero.
        #[serde(default)]
        pub encoder_zero_count: i32,
        /// `true` where a positive voltage at the amplifier pushes the joint in its negative direction.
        #[serde(default)]
        pub motor_reversed: bool,
        /// Size of the torque at the joint for each volt at its amplifier, N m/V: amplifier (A/V) times motor (N m/A) times gear.
        #[serde(default = "JointFile::torque_per_volt_nm_v")]
        pub torque_per_volt_nm_v: f64,
        /// Inertia of the motor's rotor as the joint feels it: times the square of the gear, kg m^2.
        #[serde(default)]
        pub rotor_inertia_kg_m2: f64,
        /// Viscous friction at the joint, N m s/rad.
        #[serde(default)]
        pub viscous_friction_nm_s_rad: f64,
        /// Coulomb friction at the joint, N m.
        #[serde(default)]
        pub coulomb_friction_nm: f64,
        /// Angle by which the joint gives before its Coulomb friction lets it slide, rad.
        #[serde(default = "JointFile::presliding_rad")]
        pub presliding_rad: f64,
        /// Damping of the joint while it sticks, N m s/rad.
        #[serde(default)]
        pub presliding_damping_nm_s_rad: f64,
    }
}

impl JointFile {
    fn presliding_rad() -> f64 {
        2e-4
    }

    /// Of the paper's motor: 1.1 A/V of its amplifier, 23.4 mN m/A, gear 5.4 to 1. 10 V are then 1.39 N m, the most that it
    /// can do.
    fn torque_per_volt_nm_v() -> f64 {
        0.138996
    }
}

/// A symmetric tensor in a file: `[xx, yy, zz]` or `[xx, yy, zz, xy, xz, yz]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct InertiaFile(pub Vec<f64>);

impl Default for InertiaFile {
    fn default() -> Self {
        Self(vec![0.0; 3])
    }
}

keys! {
    /// A soft hemispherical fingertip. Its contact area is `pi (2 r dr - dr^2)`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct FingertipFile {
        /// Its name.
        pub name: String,
        /// Name of the joint whose link it is part of.
        pub link: String,
        /// Centre of its sphere in the link frame, m.
        pub offset_m: [f64; 3],
        /// Radius `r_i`, m.
        pub radius_m: f64,
        /// Stiffness `k_i` of Eq. 14, N/m^2.
        pub stiffness_n_m2: f64,
        /// Damping `xi_i` of Eq. 14 for each square metre of contact area, (N s/m)/m^2.
        pub damping_n_s_m_per_m2: f64,
        /// Torsional damping `b_i` of Eq. 15 for each square metre of contact area, (N m s/rad)/m^2.
        pub torsional_damping_nm_s_rad_per_m2: f64,
        /// Coefficient of its friction; the object's file may have a lower one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub friction: Option<f64>,
        /// Largest torque about the contact's normal for each newton of normal force, m.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub torsional_friction_m: Option<f64>,
    }
}

keys! {
    /// A part of a link's surface, or of the palm's: all points within a radius of a line.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct CapsuleFile {
        /// Name of the joint whose link it is part of; without it, the palm: the base.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub link: Option<String>,
        /// Beginning of its line in the link frame, m.
        pub from_m: [f64; 3],
        /// End of its line, m; the beginning again for a ball.
        pub to_m: [f64; 3],
        /// Radius, m.
        pub radius_m: f64,
        /// Coefficient of its friction; the object's file may have a lower one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub friction: Option<f64>,
    }
}

keys! {
    /// A named posture of a hand.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct PostureFile {
        /// Its name: 1 to 15 small letters, digits and hyphens.
        pub name: String,
        /// An angle for each joint, in the order of the file, rad.
        pub angles_rad: Vec<f64>,
    }
}

fn one() -> f64 {
    1.0
}

fn yes() -> bool {
    true
}
