//! Hands whose kinematics are in a URDF.
//!
//! A hand's file may name a URDF in a table `[urdf]`. [`expand`] puts what the URDF says into the configuration tree, as the
//! `joint`, `fingertip` and `capsule` entries of an ordinary hand, each value with its place in the URDF. Everything behind it, from
//! `--set` to the firmware, sees an ordinary hand.
//!
//! ```text
//! text --xml, reader--> links, joints --topology--> tree --assembly--> bodies, joints --expand--> nodes
//! ```
//!
//! What URDF can't say (fingertips, gains, encoders) stands in the hand's file, and what stands there wins. Where URDF is
//! silent or has a placeholder, that is an error or a notice, never a number made up.
//!
//! `roxmltree` and not `urdf-rs` reads the file: the latter (0.10) overflows the stack on nested elements, passes over what is
//! no number in a list of numbers, gives zero for limits, efforts and masses that are not there, refuses files for the shape
//! of a visual, and knows no lines.

mod assembly;
mod body;
mod complete;
mod expand;
pub(crate) mod export;
mod keys;
mod reader;
mod robot;
mod shape;
mod starter;
#[cfg(test)]
mod tests;
mod topology;
mod transform;
mod xml;

pub(super) use expand::{expand, file_of};
pub use starter::{FingertipRequest, Starter, StarterRequest, TunedGains};
