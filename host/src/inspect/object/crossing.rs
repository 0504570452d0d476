//! Whether a surface cuts through itself.
//!
//! Two triangles cross when an edge of one passes through the inside of the other: the ends of the edge lie on different sides
//! of the triangle, and the line through them passes all of its sides on the same hand. Which side a point is on is told by an
//! exact predicate (Shewchuk's), so that what only touches (neighbours, parts that lie on one another) is never taken for a
//! crossing, and no crossing is missed by rounding.

use super::boxes::Boxes;
use nalgebra::Vector3;
use robust::{Coord3D, orient3d};

/// Pairs that are looked at: more than a hundred for each triangle of the largest mesh mean that many lie in one place.
const MOST_PAIRS: usize = 20_000_000;

/// Places where a surface cuts through itself.
pub(super) struct Crossings {
    /// Pairs of triangles.
    pub(super) count: usize,
    /// The first two triangles, in the order of their numbers.
    pub(super) first: Option<[usize; 2]>,
    /// Whether all of them were looked for.
    pub(super) is_complete: bool,
}

/// Looks for them.
pub(super) fn crossings(boxes: &Boxes, corners: &[[usize; 3]]) -> Crossings {
    let (mut count, mut first) = (0, None::<[usize; 2]>);
    let is_complete = boxes.pairs(MOST_PAIRS, |a, b| {
        if cross([a, b], boxes, corners) {
            count += 1;
            let pair = [a.min(b), a.max(b)];
            first = Some(first.map_or(pair, |first| first.min(pair)));
        }
    });
    Crossings { count, first, is_complete }
}

pub(super) fn cross([a, b]: [usize; 2], boxes: &Boxes, corners: &[[usize; 3]]) -> bool {
    pierces(a, b, boxes, corners) || pierces(b, a, boxes, corners)
}

/// Whether an edge of one triangle passes through the inside of the other. An edge that ends in a corner of the other does not.
fn pierces(one: usize, other: usize, boxes: &Boxes, corners: &[[usize; 3]]) -> bool {
    let plane = &boxes.triangles[other];
    (0..3).map(|k| (k, (k + 1) % 3)).any(|(from, to)| {
        let shared = |k: usize| corners[other].contains(&corners[one][k]);
        if shared(from) || shared(to) {
            return false;
        }
        let [p, q] = [from, to].map(|k| &boxes.triangles[one][k]);
        let [a, b, c] = plane;
        let (above, below) = (side(a, b, c, p), side(a, b, c, q));
        if !(above * below < 0.0) {
            return false;
        }
        let hands = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
        hands.iter().all(|hand| *hand > 0.0) || hands.iter().all(|hand| *hand < 0.0)
    })
}

/// On which side of the plane through three points a fourth lies; 0 on it, and nowhere else.
fn side(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>, d: &Vector3<f64>) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    orient3d(a, b, c, d).signum_or_zero()
}

trait Sign {
    fn signum_or_zero(self) -> Self;
}

impl Sign for f64 {
    /// The product of two tiny numbers may be zero.
    fn signum_or_zero(self) -> f64 {
        if self > 0.0 {
            1.0
        } else if self < 0.0 {
            -1.0
        } else {
            0.0
        }
    }
}
