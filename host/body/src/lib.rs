//! Rigid bodies and what they are made of: the hand with its [`dynamics`] and [`inverse_kinematics`], [`polyhedron`], fingertips,
//! capsules and joints. Nothing moves here: that is the plant's.

mod capsule;
pub mod dynamics;
mod equilibrium;
pub mod inverse_kinematics;
mod parts;
pub mod polyhedron;

pub use capsule::{Capsule, Part, closest_of_lines, overlap_m, pairs};
pub use equilibrium::equilibrium_indentations;
pub use parts::{CORNER_STIFFNESS_N_M, ContactFriction, FaceContact, FingertipModel, JointFriction, Push};

/// The largest hand that the host loads: joints.
pub const MAX_JOINTS: usize = 24;
/// The largest hand that the host loads: fingertips.
pub const MAX_FINGERS: usize = 5;
/// The longest chain of joints that can be simulated: a finger, or the trunk.
pub const MAX_CHAIN: usize = 8;

/// A hand of any size, in the precision of the plant.
pub type Hand = blindgrasp_shared::hand::Hand<f64, MAX_JOINTS, MAX_FINGERS>;
/// A posture of a [`Hand`].
pub type Posture = blindgrasp_shared::hand::Posture<f64, MAX_JOINTS, MAX_FINGERS>;
