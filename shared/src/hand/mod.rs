//! The hand: a tree of revolute joints with fingertips.
//!
//! - A **joint** turns its **link** about an axis fixed in its parent link, or in the **base** (the palm, or the foot
//!   of an arm). Every link has one joint, so both carry the same index.
//! - The **trunk** is what several fingertips share: the joints of an arm. It needs no special treatment here.
//! - A **fingertip** is a soft hemisphere on a link; its *centre* is the centre of that sphere.
//! - Positions and attitudes are in the base frame, in metres and radians. The base does not move.
//!
//! [`model`] takes a description in the user's frames and prepares it once; [`kinematics`] computes with it.
//! Arrays have a capacity fixed at compile time (`J` joints, `F` fingertips) and a count known at run time: the firmware
//! has exact sizes, the host can load any hand.

mod check;
pub(crate) mod frame;
pub mod kinematics;
pub mod model;
mod turn;

pub use kinematics::{LinkPose, Posture, Wrench};
pub use model::{Bend, Fingertip, Hand, HandError, Joint, Link, PreparedJoint};
pub use turn::Turn;
