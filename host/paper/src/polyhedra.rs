//! The paper's title: an *arbitrary* polyhedral object. Random convex polyhedra in the paper's own model, under each law.

use super::evidence::{EvidenceError, scene};
use super::laws::{Case, Grasped};
use blindgrasp_place::population::{Draw, PlacingHand, RandomPolyhedron, SEED, polyhedra};
use rayon::prelude::*;
use serde::Serialize;

const RUN: &str = "polyhedra";

/// The results of the polyhedra.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Polyhedra {
    /// The number that were drawn.
    pub drawn: usize,
    /// Time for which each was grasped, s.
    pub duration_s: f64,
    /// One a polyhedron for which the hand has a grasp.
    pub outcomes: Vec<Outcome>,
}

/// The result of one polyhedron.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Number of its faces.
    pub faces: usize,
    /// Its largest distance between two corners, m.
    pub extent_m: f64,
    /// Under each law, in the order of [`Case::ALL`].
    pub grasps: Vec<Grasped>,
}

impl Outcome {
    /// Under a law with its gain.
    pub fn under(&self, case: Case) -> Option<&Grasped> {
        self.grasps.iter().find(|grasped| grasped.case == case)
    }

    /// Returns `true` if it was held under a law, at the rate of the experiments.
    pub fn held(&self, case: Case) -> bool {
        self.under(case).is_some_and(Grasped::held)
    }
}

impl Polyhedra {
    /// Returns the number that were held under a law, at the rate of the experiments.
    pub fn held(&self, case: Case) -> usize {
        self.count(case, Grasped::held)
    }

    /// Returns the number that were held under a law with the law at 10 kHz, or at less.
    pub fn held_at_10_khz(&self, case: Case) -> usize {
        self.count(case, Grasped::held_at_10_khz)
    }

    /// Returns a number as a share of those that were grasped.
    pub fn share(&self, count: usize) -> f64 {
        count as f64 / self.outcomes.len() as f64
    }

    fn count(&self, case: Case, test: fn(&Grasped) -> bool) -> usize {
        self.outcomes.iter().filter_map(|outcome| outcome.under(case)).filter(|grasped| test(grasped)).count()
    }
}

/// Grasps the first so many polyhedra of the population; `told` is called after each, from any thread.
///
/// # Errors
/// A built-in scene or a run that can't be done.
pub fn grasped(count: usize, told: &(dyn Fn(&str) + Sync)) -> Result<Polyhedra, EvidenceError> {
    // The paper knows no links.
    let settings = ["duration_s=5.0", "plant.links=false"].map(str::to_owned);
    let like = scene(RUN, "cube-ideal", &settings)?.file;
    let duration_s = like.duration_s;
    let hand = PlacingHand::of(like).map_err(|cause| EvidenceError::of(RUN, cause))?;
    let bodies = polyhedra(&mut Draw::new(SEED), count);
    let one = |body: &RandomPolyhedron| -> Result<Option<Outcome>, EvidenceError> {
        let placed = hand.place(hand.hull(body.corners_m.clone()), 1).ok().and_then(|mut all| all.pop());
        let grasps = placed.map(|placement| {
            let file = &placement.scene.file;
            Case::ALL.into_iter().map(|case| Grasped::under(case, RUN, file)).collect::<Result<Vec<_>, _>>()
        });
        told(RUN);
        let outcome = |grasps| Outcome { faces: body.faces, extent_m: body.extent_m, grasps };
        Ok(grasps.transpose()?.map(outcome))
    };
    let outcomes = bodies.par_iter().with_max_len(1).map(one).collect::<Result<Vec<_>, _>>()?;
    Ok(Polyhedra { drawn: count, duration_s, outcomes: outcomes.into_iter().flatten().collect() })
}
