//! The paper's law against the one before it: a comparison that the paper asserts in its Secs. 1 and 3, and does not show.
//!
//! - `paths`: the cube is pushed on its way, this way and that, under each law and over decades of its gain: where does the grasp
//!   come to rest, and with which forces?
//! - `objects`: what is held, under each law.
//! - `figure` draws the first of these.
//! - `arm`: what an arm feels of each law, when the object is pushed in its hand.
//! - `moved`: what is held is moved by position and attitude, beside each law.

mod arm;
mod figure;
mod moved;
mod objects;
mod paths;

pub use arm::Carried;
pub use moved::{Moved, Off, SHARES, Stop};
pub use objects::Object;
pub use paths::{Final, GAINS, PATHS};

use super::evidence::EvidenceError;
use super::laws::Law;
use serde::Serialize;

/// All that was compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Comparison {
    /// Of the cube, pushed on its way.
    pub paths: Vec<Final>,
    /// Of objects of several shapes.
    pub objects: Vec<Object>,
    /// Of the hand-arm.
    pub arm: Vec<Carried>,
    /// Of what is moved.
    pub moved: Vec<Moved>,
}

/// Returns the number of runs.
pub fn runs() -> usize {
    paths::plan().len() + objects::SHAPES.len() + arm::LAWS.len() + moved::runs()
}

impl Comparison {
    /// Does all runs; `told` is called after each, from any thread.
    ///
    /// # Errors
    /// A scene or a run that can't be done.
    pub fn gather(told: &(dyn Fn(&str) + Sync)) -> Result<Self, EvidenceError> {
        // The long ones first.
        Ok(Self {
            moved: moved::go(told)?,
            arm: arm::carry(told)?,
            paths: paths::follow(told)?,
            objects: objects::grasp(told)?,
        })
    }

    /// The ends of all paths under a law with a gain.
    pub fn ends(&self, law: Law, gain: f64) -> impl Iterator<Item = &Final> {
        self.paths.iter().filter(move |end| end.law == law && end.gain == gain)
    }
}
