//! Surfaces that cut through themselves.
//!
//! Two triangles cross when an edge of one passes through the other: the ends of the edge lie on different sides of its plane,
//! and the line through them passes none of its sides on the wrong hand. Which side a point is on is told by an exact
//! predicate (Shewchuk's), so that rounding neither makes a crossing nor hides one. An edge may pass exactly through a side or a
//! corner of the other triangle, which happens where parts are symmetric; not so where the two have a corner in common, since
//! a sliver's edge may well run through its own corner. Parts that lie on one another in one plane are not found.

use crate::boxes::Boxes;
use nalgebra::Vector3;
use robust::{Coord3D, orient3d};

/// Pairs that are looked at: more than a hundred for each triangle of the largest mesh mean that many lie in one place.
const MOST_PAIRS: usize = 20_000_000;

/// Places where a surface cuts through itself.
pub struct Crossings {
    /// Pairs of triangles.
    pub count: usize,
    /// The first two triangles, in the order of their numbers.
    pub first: Option<[usize; 2]>,
    /// `true` if all of them were looked for.
    pub is_complete: bool,
}

/// Looks for them.
pub fn crossings(boxes: &Boxes, corners: &[[usize; 3]]) -> Crossings {
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

/// Returns `true` if an edge of one triangle passes through the other. An edge that ends in a corner of the other does
/// not.
fn pierces(one: usize, other: usize, boxes: &Boxes, corners: &[[usize; 3]]) -> bool {
    let plane = &boxes.triangles[other];
    let are_neighbours = corners[one].iter().any(|k| corners[other].contains(k));
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
        let on_one = |hand: f64| hands.iter().all(|h| h * hand > 0.0 || (*h == 0.0 && !are_neighbours));
        on_one(1.0) || on_one(-1.0)
    })
}

/// On which side of the plane through three points a fourth lies: 1 or -1, and 0 on it and nowhere else.
fn side(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>, d: &Vector3<f64>) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    let volume = orient3d(a, b, c, d);
    // Not the volume itself: the product of two tiny ones may be zero.
    if volume == 0.0 { 0.0 } else { volume.signum() }
}
