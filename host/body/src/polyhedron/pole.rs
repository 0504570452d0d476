//! The widest circle on a face: its centre is the face's pole of inaccessibility.
//!
//! Squares that cover the face are looked at in the order of the best that they may hold, and quartered until none can
//! hold anything better.

use super::Face;
use blindgrasp_shared::math::norm;
use nalgebra::Vector3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The radius is found to within this share of itself.
const PRECISION: f64 = 1e-3;
/// Edges are looked at this often at most: what is found by then is good, if not the best.
const MOST_LOOKS: usize = 20_000_000;

/// A square in the plane of the face.
struct Square {
    centre: [f64; 2],
    half: f64,
    /// The largest margin that a point of the square may have, m.
    at_most: f64,
}

impl PartialEq for Square {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Square {}

impl PartialOrd for Square {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Square {
    fn cmp(&self, other: &Self) -> Ordering {
        self.at_most.total_cmp(&other.at_most)
    }
}

/// Centre and radius of the widest circle on a face, m.
pub(super) fn of(face: &Face, vertices_m: &[Vector3<f64>]) -> (Vector3<f64>, f64) {
    if let [a, b, c] = face.corners[..]
        && face.convex
    {
        return in_triangle([a, b, c].map(|k| vertices_m[k]), face);
    }
    let axes = face.axes();
    let corners = || face.corners.iter().map(|&k| axes.map(|axis| axis.dot(&vertices_m[k])));
    let bound = |of: fn(f64, f64) -> f64, start: f64| {
        corners().fold([start; 2], |bound, corner| [of(bound[0], corner[0]), of(bound[1], corner[1])])
    };
    let (low, high) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
    let at = |[x, y]: [f64; 2]| axes[0] * x + axes[1] * y + face.normal * face.distance_m;
    let margin = |place: [f64; 2]| face.margin_m(vertices_m, &at(place));
    let square = |centre: [f64; 2], half: f64| Square {
        at_most: margin(centre) + half * std::f64::consts::SQRT_2,
        centre,
        half,
    };

    let size = [high[0] - low[0], high[1] - low[1]];
    let half = size[0].min(size[1]) / 2.0;
    // Squares side by side along the longer way; a needle is covered by a hundred larger ones.
    let half = half.max(size[0].max(size[1]) / 200.0);
    let mut squares = BinaryHeap::new();
    for i in 0..(size[0] / (2.0 * half)).ceil().max(1.0) as usize {
        for j in 0..(size[1] / (2.0 * half)).ceil().max(1.0) as usize {
            let centre = [low[0] + half * (2 * i + 1) as f64, low[1] + half * (2 * j + 1) as f64];
            squares.push(square(centre, half));
        }
    }
    let start = axes.map(|axis| axis.dot(&face.mean_corner_m(vertices_m)));
    let mut best = (start, margin(start));
    let looks = 4 * face.edges().count();
    for _ in 0..MOST_LOOKS.div_ceil(looks) {
        let Some(Square { centre, half, at_most }) = squares.pop() else { break };
        if !(at_most > best.1 + PRECISION * best.1.abs()) {
            break;
        }
        let here = at_most - half * std::f64::consts::SQRT_2;
        if here > best.1 {
            best = (centre, here);
        }
        let half = half / 2.0;
        for [x, y] in [[-half, -half], [half, -half], [-half, half], [half, half]] {
            squares.push(square([centre[0] + x, centre[1] + y], half));
        }
    }
    (at(best.0), best.1)
}

/// The inscribed circle: its centre is the mean of the corners, weighted with the opposite sides.
fn in_triangle([a, b, c]: [Vector3<f64>; 3], face: &Face) -> (Vector3<f64>, f64) {
    let sides = [norm(&(c - b)), norm(&(a - c)), norm(&(b - a))];
    let around = sides[0] + sides[1] + sides[2];
    let centre = (a * sides[0] + b * sides[1] + c * sides[2]) / around;
    let twice_area = (b - a).cross(&(c - a)).dot(&face.normal);
    // Onto the fitted plane, which the corners may miss by the noise of a mesh.
    let centre = centre + face.normal * (face.distance_m - face.normal.dot(&centre));
    (centre, twice_area / around)
}
