//! Control laws: joint angles and speeds in, joint torques out, nothing known of the object.
//!
//! Each law is its own file. The paper's is [`grasp`].

pub mod grasp;

pub use grasp::{GraspConfig, GraspLaw, Grip, Latch, Monitor};
