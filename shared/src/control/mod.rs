//! Control laws: joint angles and speeds in, joint torques out, nothing known of the object.
//!
//! The paper's law is [`grasp`]; [`integral`] is what an earlier one had in place of one of its terms.

pub mod grasp;
pub mod integral;

pub use grasp::{Gains, GraspConfig, GraspLaw, Grip, Latch, Monitor};
