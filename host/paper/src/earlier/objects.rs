//! Objects of several shapes, under each law.

use crate::evidence::{EvidenceError, scene};
use crate::laws::{Case, Grasped};
use blindgrasp_model::file::SceneFile;
use blindgrasp_place::population::PlacingHand;
use rayon::prelude::*;
use serde::Serialize;

const RUN: &str = "objects";
/// From the middle of the octahedron to its corners, m: its faces are about as wide as the cube's.
const OCTAHEDRON_M: f64 = 0.04;

/// The result of an object.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Object {
    /// Its name.
    pub name: &'static str,
    /// Time for which it was grasped, s.
    pub duration_s: f64,
    /// Under each law, in the order of [`Case::ALL`].
    pub grasps: Vec<Grasped>,
}

impl Object {
    /// Under a law with its gain.
    pub fn under(&self, case: Case) -> Option<&Grasped> {
        self.grasps.iter().find(|grasped| grasped.case == case)
    }
}

/// A shape, and how it comes into the hand.
type Shape = (&'static str, fn() -> Result<SceneFile, EvidenceError>);

/// The shapes, all in the paper's model.
pub(super) const SHAPES: [Shape; 3] =
    [("prism", || ideal("prism-ideal")), ("cube", || ideal("cube-ideal")), ("octahedron", octahedron)];

/// Long enough for what is lost to be lost; the paper knows no links.
fn ideal(name: &str) -> Result<SceneFile, EvidenceError> {
    Ok(scene(RUN, name, &["duration_s=10", "plant.links=false"].map(str::to_owned))?.file)
}

/// Returns the scene of an octahedron, where the search of `scene new` puts it.
fn octahedron() -> Result<SceneFile, EvidenceError> {
    let like = ideal("cube-ideal")?;
    let hand = PlacingHand::of(like).map_err(|cause| EvidenceError::of(RUN, cause))?;
    let corner = |axis: usize, sign: f64| {
        let mut point_m = [0.0; 3];
        point_m[axis] = sign * OCTAHEDRON_M;
        point_m
    };
    let corners = (0..3).flat_map(|axis| [1.0, -1.0].map(|sign| corner(axis, sign))).collect();
    let placed = hand.place(hand.hull(corners), 1);
    let none = || EvidenceError::of(RUN, "the search finds no grasp for its object");
    placed.ok().and_then(|mut all| all.pop()).map(|placement| placement.scene.file).ok_or_else(none)
}

/// Grasps each, under each law.
pub(super) fn grasp(told: &(dyn Fn(&str) + Sync)) -> Result<Vec<Object>, EvidenceError> {
    let one = |(name, file): &Shape| {
        let file = file()?;
        let grasps = Case::ALL.into_par_iter().map(|case| Grasped::under(case, RUN, &file));
        let grasps = grasps.collect::<Result<_, _>>()?;
        told(RUN);
        Ok(Object { name, duration_s: file.duration_s, grasps })
    };
    SHAPES.par_iter().map(one).collect()
}
