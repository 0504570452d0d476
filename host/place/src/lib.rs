//! Placement: for a hand and an object, which faces the fingertips touch, where on them, how the object lies, and the posture
//! that holds it there; or why there is none.
//!
//! ```text
//! faces --> combinations --> contact points --> arrangements --> positions --> posture --> scene
//! facet     combination      points, rolling    arrangement      reach,        stance      search
//!                            candidate                           position
//! ```
//!
//! 1. Every choice of **faces** is rated with contacts in their middles (fingertips may share a face); of objects with very
//!    many faces, only the widest are chosen from.
//! 2. For the best of them, **contact points** are chosen, for the best chance to hold under the law's own equilibrium
//!    ([`Quality`] says how it is reckoned). The hand does not come into it yet, but for its radii and gains.
//! 3. Beginning with the best, fingertips and contacts are **arranged**, in the given attitude or in a spread of them, a
//!    **position** of the object is looked up in a map of where the fingertips get to ([`Reach`]), and the inverse kinematics
//!    of scenes takes the **posture**. Fingertips may not overlap, touch with their backs, or meet another part of the object;
//!    bones may not pass through it. Joints that move several fingertips (a trunk) stay where they are.
//! 4. The best are built as **scenes**, whose own checks have the last word.
//!
//! What fails is counted, test by test, with the nearest miss: a [`Refusal`]. Nothing is random; no grasp is simulated. The
//! search is thorough but not complete: the map has holes, and the contact points of a choice do not give way to the hand.

mod arrangement;
mod attitude;
mod candidate;
mod combination;
mod facet;
mod points;
pub mod population;
mod position;
mod quality;
mod reach;
mod refusal;
mod rolling;
mod search;
mod stance;
mod table;
mod task;
mod template;
#[cfg(test)]
mod tests;
mod text;

use blindgrasp_model::{Parts, Scene, SceneError, SceneFile};

pub use quality::{FingertipQuality, Quality};
pub use reach::Reach;
pub use refusal::{Refusal, Test};
pub use template::template;
pub use text::scene_text;

/// The friction that a grasp may ask for: rubber on most things gives that much. The model's fingertips never slip.
pub const FRICTION_LIMIT: f64 = 1.0;
/// The middle of a face has to be this far from its edges, in radii of a fingertip.
const NARROWEST: f64 = 0.05;
/// Distance beyond the needed one at which fingertips are placed, as a share of it.
const SPARE: f64 = 0.03;

/// The request for a placement.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// A scene. Faces and points of its contacts that are given stay; contacts that are empty, or missing, are found.
    pub like: &'a SceneFile,
    /// Its hand and object, prepared.
    pub parts: &'a Parts,
    /// The reach of the hand's fingertips.
    pub reach: &'a Reach,
    /// `true` if the object may be anywhere, instead of where the scene says.
    pub any_position: bool,
    /// `true` if it may have any attitude, instead of the scene's.
    pub any_attitude: bool,
}

/// A hand that holds an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// The scene.
    pub scene: Scene,
    /// Its quality.
    pub quality: Quality,
}

/// The reason for which there is no placement.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoPlacement {
    /// The request can't be met.
    #[error(transparent)]
    Input(#[from] SceneError),
    /// None exists, as far as the search sees.
    #[error("{0}")]
    None(Refusal),
}

/// The best placements, at most `most`, the best first.
///
/// # Errors
/// Why there is none.
pub fn place(request: &Request<'_>, most: usize) -> Result<Vec<Placement>, NoPlacement> {
    search::run(request, most)
}
