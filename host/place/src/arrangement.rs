//! Arrangements, each a contact for every fingertip and an attitude of the object: ordered by how well the contacts lie
//! as the fingertips of the nominal posture do.

use super::candidate::Candidate;
use super::combination::orders;
use super::rolling::{Coordinates, of};
use super::task::Task;
use nalgebra::{UnitQuaternion, Vector3};

/// Arrangements that are tried for a choice of faces, where the attitude is free.
const TRIED: usize = 40;

/// Fingertips on faces, and an attitude of the object.
pub(super) struct Arrangement {
    /// The faces that the fingertips take which may choose.
    pub(super) order: Vec<u8>,
    /// Contact points, by fingertip.
    pub(super) z: Coordinates,
    pub(super) attitude: UnitQuaternion<f64>,
}

/// Two fingertips that never get as far apart as their contacts are.
pub(super) struct TooWide {
    pub(super) fingertips: (usize, usize),
    /// Distance of the contacts, m, if they lie opposite each other.
    pub(super) distance_m: f64,
    /// By how much it is too large, m.
    pub(super) by_m: f64,
}

/// The arrangements of a candidate that are worth a try, the best first; if there are none, because two fingertips never get
/// far enough apart, the nearest miss.
pub(super) fn all(task: &Task<'_>, candidate: &Candidate) -> Result<Vec<Arrangement>, TooWide> {
    let free = task.free();
    let mut rated: Vec<(f64, Arrangement)> = Vec::new();
    let mut miss: Option<TooWide> = None;
    for order in orders(&candidate.choice[..free]) {
        let z = permuted(task, candidate, &order);
        let facets = task.assigned(&order);
        let rolling = task.rolling(&facets);
        let centres: Vec<Vector3<f64>> = (0..task.count).map(|i| rolling.centre_m(&z, i)).collect();
        if let Some(wide) = too_wide(task, &centres) {
            if miss.as_ref().is_none_or(|known| wide.by_m < known.by_m) {
                miss = Some(wide);
            }
            continue;
        }
        let middle = centres.iter().sum::<Vector3<f64>>() / task.count as f64;
        for attitude in &task.attitudes {
            let misfit: f64 = centres
                .iter()
                .zip(&task.nominal_m)
                .map(|(centre, nominal)| (attitude * (centre - middle) - nominal).norm_squared())
                .sum();
            rated.push((misfit, Arrangement { order: order.clone(), z, attitude: *attitude }));
        }
    }
    if let (true, Some(miss)) = (rated.is_empty(), miss) {
        return Err(miss);
    }
    rated.sort_by(|a, b| a.0.total_cmp(&b.0));
    if task.attitudes.len() > 1 {
        rated.truncate(TRIED);
    }
    Ok(rated.into_iter().map(|(_, arrangement)| arrangement).collect())
}

/// The contact points of a candidate, each for the fingertip that takes its face in this order.
fn permuted(task: &Task<'_>, candidate: &Candidate, order: &[u8]) -> Coordinates {
    let choosing: Vec<usize> = (0..task.count).filter(|&i| task.fixed[i].is_none()).collect();
    let mut z = candidate.z;
    let mut taken = vec![false; choosing.len()];
    for (&i, face) in choosing.iter().zip(order) {
        let slot = (0..choosing.len()).find(|&k| !taken[k] && candidate.choice[k] == *face);
        let Some(slot) = slot else { continue };
        taken[slot] = true;
        let here = of(&candidate.z, choosing[slot]);
        (z[2 * i], z[2 * i + 1]) = (here.x, here.y);
    }
    z
}

fn too_wide(task: &Task<'_>, centres_m: &[Vector3<f64>]) -> Option<TooWide> {
    let mut worst: Option<TooWide> = None;
    for i in 0..task.count {
        for j in 0..i {
            let between_m = (centres_m[i] - centres_m[j]).norm();
            let by_m = between_m - task.request.reach.farthest_m[i][j];
            let distance_m = between_m - task.rolling_radii_m[i] - task.rolling_radii_m[j];
            if by_m > 0.0 && worst.as_ref().is_none_or(|known| by_m > known.by_m) {
                worst = Some(TooWide { fingertips: (j, i), distance_m, by_m });
            }
        }
    }
    worst
}
