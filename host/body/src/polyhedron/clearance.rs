//! The parts of a body that rise above the plane of one of its faces: what a fingertip on that face may run into.

use super::Polyhedron;
use blindgrasp_shared::math::{Real, norm};
use nalgebra::Vector3;

/// Height above a face from which on something counts, in units of the body's extent: rounding.
const LEVEL: f64 = 1e-9;

/// The parts of a body above the plane of one of its faces, as triangles in the object frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Obstacles {
    triangles: Vec<[Vector3<f64>; 3]>,
}

impl Obstacles {
    /// Returns the parts that rise above a face. The face's neighbours across its outer edges begin at its plane: what
    /// is no higher than the corners of its triangles are off the plane themselves, twice over, does not count.
    pub fn above(body: &Polyhedron, face: usize) -> Self {
        let shape = &body.faces[face];
        let height = |k: usize| shape.normal.dot(&body.vertices_m[k]) - shape.distance_m;
        let rough = shape.triangles.iter().flatten().map(|&k| height(k).abs()).fold(0.0, f64::max);
        let extent = shape.corners.iter().map(|&k| norm(&body.vertices_m[k])).fold(0.0, f64::max);
        let level = 2.0 * rough + LEVEL * extent;
        // Each vertex is looked at once; most bodies have none up there.
        let heights: Vec<f64> = (0..body.vertices_m.len()).map(|k| height(k) - level).collect();
        let mut triangles = Vec::new();
        if heights.iter().any(|&height| height > 0.0) {
            for (_, other) in body.faces.iter().enumerate().filter(|(k, _)| *k != face) {
                for corners in &other.triangles {
                    cut(corners.map(|k| (body.vertices_m[k], heights[k])), &mut triangles);
                }
            }
        }
        Self { triangles }
    }

    /// Returns `true` if there are none.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Distance of a point from the nearest of them, m; infinite where there are none.
    pub fn distance_m(&self, point_m: &Vector3<f64>) -> f64 {
        let squared = |corners: &[Vector3<f64>; 3]| (nearest(corners, point_m) - point_m).norm_squared();
        self.triangles.iter().map(squared).fold(f64::INFINITY, f64::min).square_root()
    }
}

/// Adds the part of a triangle where the height is positive: nothing, the whole, a triangle, or a quadrilateral.
fn cut(corners: [(Vector3<f64>, f64); 3], triangles: &mut Vec<[Vector3<f64>; 3]>) {
    let mut part = Vec::with_capacity(4);
    for k in 0..3 {
        let ((a, above_a), (b, above_b)) = (corners[k], corners[(k + 1) % 3]);
        if above_a > 0.0 {
            part.push(a);
        }
        if (above_a > 0.0) != (above_b > 0.0) {
            part.push(a + (b - a) * (above_a / (above_a - above_b)));
        }
    }
    if let [a, b, c, ref rest @ ..] = part[..] {
        triangles.push([a, b, c]);
        triangles.extend(rest.iter().map(|&d| [a, c, d]));
    }
}

/// The point of a triangle that is nearest to a point. The triangle may be a needle.
pub(super) fn nearest(corners: &[Vector3<f64>; 3], point: &Vector3<f64>) -> Vector3<f64> {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let foot = point - normal * (normal.dot(&(point - a)) / normal.norm_squared());
    let edges = [(a, b), (b, c), (c, a)];
    // NaN, where there is no normal, is on no side.
    if edges.iter().all(|(from, to)| normal.dot(&(*to - *from).cross(&(foot - *from))) >= 0.0) {
        return foot;
    }
    edges
        .map(|(from, to)| nearest_of_segment(from, to, point))
        .into_iter()
        .min_by(|p, q| (p - point).norm_squared().total_cmp(&(q - point).norm_squared()))
        .unwrap_or(*a)
}

fn nearest_of_segment(from: &Vector3<f64>, to: &Vector3<f64>, point: &Vector3<f64>) -> Vector3<f64> {
    let along = to - from;
    let share = along.dot(&(point - from)) / along.norm_squared();
    if !(share > 0.0) {
        *from
    } else if share < 1.0 {
        from + along * share
    } else {
        *to
    }
}
