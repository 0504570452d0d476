//! Choices of faces with contact points, before any finger is asked whether it gets there.

use super::FRICTION_LIMIT;
use super::combination::{self, Choice, Combination};
use super::facet::Facet;
use super::points;
use super::quality::chance;
use super::refusal::Count;
use super::rolling::{Coordinates, Rolling, of};
use super::task::Task;
use nalgebra::Vector3;

/// Choices of faces for which contact points are chosen: the best with contacts in the middle of the faces.
const CHOSEN: usize = 400;

/// Faces and contact points; the fingertips that may choose take the faces in rising order.
pub(super) struct Candidate {
    pub(super) choice: Choice,
    pub(super) z: Coordinates,
    pub(super) chance: f64,
}

/// Contact points on faces, by fingertip.
pub(super) struct Contacts {
    pub(super) z: Coordinates,
    pub(super) chance: f64,
    /// Fingertip centres in the object frame, m.
    pub(super) centres_m: Vec<Vector3<f64>>,
}

/// The reason for which contact points are none for a grasp.
pub(super) enum Unfit {
    /// The law would pull a fingertip off.
    PulledOff,
    /// Friction that is asked for.
    Slips(f64),
    /// Fingertips overlap, m.
    Close(f64),
}

/// The candidates, the best first; what failed is counted.
pub(super) fn all(task: &Task<'_>, count: &mut Count) -> Vec<Candidate> {
    let free = task.free();
    if free > 0 && task.facets.is_empty() {
        return Vec::new();
    }
    let fixed: Vec<&Facet> = task.fixed.iter().flatten().map(|fixed| &fixed.facet).collect();
    // Which fingertip takes which face is open: all have the mean radius.
    let mean = task.rolling_radii_m.iter().sum::<f64>() / task.count as f64;
    let radii = vec![mean; task.count];
    let (combinations, rated) = combination::rate(&task.facets, &fixed, free, &radii, task.gains, CHOSEN);
    (count.choices, count.pulled_off) = (rated.all, rated.pulled_off);
    let mut candidates = Vec::with_capacity(combinations.len());
    for Combination { choice, .. } in combinations {
        let facets = task.assigned(&choice[..free]);
        let fixed = task.fixed_points();
        let start = points::start(&facets, task.fingertips(&fixed));
        match contacts(task, &facets, start) {
            Ok(Contacts { z, chance, .. }) => candidates.push(Candidate { choice, z, chance }),
            Err(Unfit::PulledOff) => count.pulled_off += 1,
            Err(Unfit::Slips(friction)) => count.slips.add(friction, ()),
            Err(Unfit::Close(overlap)) => count.close.add(overlap, ()),
        }
    }
    candidates.sort_by(|a, b| b.chance.total_cmp(&a.chance).then(a.choice.cmp(&b.choice)));
    candidates
}

/// Chooses contact points for fingertips on given faces.
pub(super) fn contacts(task: &Task<'_>, facets: &[&Facet], start: Coordinates) -> Result<Contacts, Unfit> {
    let rolling = task.rolling(facets);
    let fixed = task.fixed_points();
    let z = points::improve(facets, &rolling, task.fingertips(&fixed), start);
    rate(task, facets, &rolling, z)
}

fn rate(task: &Task<'_>, facets: &[&Facet], rolling: &Rolling, z: Coordinates) -> Result<Contacts, Unfit> {
    let mut friction: f64 = 0.0;
    let mut margin = f64::INFINITY;
    for (i, facet) in facets.iter().enumerate() {
        let normal = rolling.normal_n(&z, i);
        if !(normal > 0.0) {
            return Err(Unfit::PulledOff);
        }
        friction = friction.max(rolling.pull_n(&z, i).norm() / normal);
        margin = margin.min(facet.margin_at_m(&of(&z, i)) / rolling.rolling_radius_m(i));
    }
    let centres_m: Vec<Vector3<f64>> = (0..task.count).map(|i| rolling.centre_m(&z, i)).collect();
    let mut overlap = f64::NEG_INFINITY;
    for i in 0..task.count {
        for j in 0..i {
            let radii = task.request.parts.hand.radius_m(i) + task.request.parts.hand.radius_m(j);
            overlap = overlap.max(radii - (centres_m[i] - centres_m[j]).norm());
        }
    }
    if overlap > 0.0 {
        return Err(Unfit::Close(overlap));
    }
    if !(friction <= FRICTION_LIMIT) {
        return Err(Unfit::Slips(friction));
    }
    Ok(Contacts { z, chance: chance(margin, rolling.mean_square_turn(&z)), centres_m })
}
