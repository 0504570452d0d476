//! One face: its plane, its outline, and how far inside of it a point lies.

use super::Face;
use blindgrasp_shared::math::{Real, norm};
use nalgebra::Vector3;

/// A corner turns inwards when the sine of its turn is below minus this: what rounding makes of a straight one does not.
const STRAIGHT: f64 = 1e-9;

impl Face {
    /// A face whose plane is known.
    pub fn new(
        vertices_m: &[Vector3<f64>],
        (normal, distance_m): (Vector3<f64>, f64),
        corners: Vec<usize>,
        holes: Vec<Vec<usize>>,
        triangles: Vec<[usize; 3]>,
    ) -> Self {
        let convex = holes.is_empty() && is_convex(vertices_m, &normal, &corners);
        Self { normal, distance_m, corners, holes, triangles, convex }
    }

    /// The face of a convex loop of corners, counter-clockwise seen from outside, in the plane that fits them.
    pub fn convex(vertices_m: &[Vector3<f64>], corners: Vec<usize>) -> Self {
        // Newell's normal: twice the area of the loop as a vector, exact for planar loops.
        let first = vertices_m[corners[0]];
        let area = corners.windows(2).fold(Vector3::zeros(), |sum, pair| {
            sum + (vertices_m[pair[0]] - first).cross(&(vertices_m[pair[1]] - first))
        });
        let normal = area / norm(&area);
        let distance_m =
            corners.iter().map(|&k| normal.dot(&vertices_m[k])).sum::<f64>() / corners.len() as f64;
        let triangles = corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]).collect();
        Self { normal, distance_m, corners, holes: Vec::new(), triangles, convex: true }
    }

    /// Returns `true` if it has no holes and no corner that turns inwards.
    pub fn is_convex(&self) -> bool {
        self.convex
    }

    /// The outer outline and the holes.
    pub fn outlines(&self) -> impl Iterator<Item = &[usize]> {
        std::iter::once(self.corners.as_slice()).chain(self.holes.iter().map(Vec::as_slice))
    }

    /// All edges, from and to, the inside on the left seen from outside.
    pub fn edges(&self) -> impl Iterator<Item = (usize, usize)> {
        self.outlines().flat_map(|corners| {
            corners.iter().zip(corners.iter().cycle().skip(1)).map(|(&from, &to)| (from, to))
        })
    }

    pub(super) fn mean_corner_m(&self, vertices_m: &[Vector3<f64>]) -> Vector3<f64> {
        self.corners.iter().map(|&k| vertices_m[k]).sum::<Vector3<f64>>() / self.corners.len() as f64
    }

    pub(super) fn area_m2(&self, vertices_m: &[Vector3<f64>]) -> f64 {
        let twice = |[a, b, c]: [Vector3<f64>; 3]| (b - a).cross(&(c - a)).dot(&self.normal);
        self.triangles.iter().map(|corners| twice(corners.map(|k| vertices_m[k]))).sum::<f64>() / 2.0
    }

    pub(super) fn margin_m(&self, vertices_m: &[Vector3<f64>], point_m: &Vector3<f64>) -> f64 {
        if self.convex {
            // Inside, the nearest edge is the one whose line is nearest.
            let inside = self
                .edges()
                .map(|(from, to)| {
                    let edge = vertices_m[to] - vertices_m[from];
                    let inwards = self.normal.cross(&edge);
                    inwards.dot(&(point_m - vertices_m[from])) / norm(&inwards)
                })
                .fold(f64::INFINITY, f64::min);
            if !(inside < 0.0) {
                return inside;
            }
        }
        self.distance_from_outline_m(vertices_m, point_m)
    }

    /// [`Self::margin_m`] for any polygon: the nearest edge by looking at all of them, and the side by how often a line from
    /// the point crosses the outlines.
    fn distance_from_outline_m(&self, vertices_m: &[Vector3<f64>], point_m: &Vector3<f64>) -> f64 {
        let [x, y] = self.axes();
        // In the plane, seen from the point.
        let place = |k: usize| {
            let from_point = vertices_m[k] - point_m;
            [x.dot(&from_point), y.dot(&from_point)]
        };
        let (mut nearest, mut inside) = (f64::INFINITY, false);
        for corners in self.outlines() {
            let Some(&last) = corners.last() else { continue };
            let mut a = place(last);
            for &corner in corners {
                let b = place(corner);
                nearest = nearest.min(distance_squared_from_segment(a, b));
                // The line from the point along +x. An end of an edge counts as above it or below, never as on it, so that
                // a line through a corner crosses one of the two edges there, or both, or none.
                if (a[1] > 0.0) != (b[1] > 0.0) {
                    let crossing = a[0] * b[1] - b[0] * a[1];
                    inside ^= (crossing > 0.0) == (b[1] > a[1]);
                }
                a = b;
            }
        }
        let distance = nearest.square_root();
        if inside { distance } else { -distance }
    }

    /// Two unit vectors in the plane, the second to the left of the first seen from outside.
    pub(super) fn axes(&self) -> [Vector3<f64>; 2] {
        let helper = if self.normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let across = helper.cross(&self.normal);
        let first = across / norm(&across);
        [first, self.normal.cross(&first)]
    }
}

/// Squared distance of the origin from the segment between two points of the plane.
fn distance_squared_from_segment(a: [f64; 2], b: [f64; 2]) -> f64 {
    let edge = [b[0] - a[0], b[1] - a[1]];
    let length_squared = edge[0] * edge[0] + edge[1] * edge[1];
    let along = -(a[0] * edge[0] + a[1] * edge[1]);
    if !(along > 0.0) {
        a[0] * a[0] + a[1] * a[1]
    } else if along >= length_squared {
        b[0] * b[0] + b[1] * b[1]
    } else {
        // The height of the triangle with the origin: loses fewer digits than the foot does.
        let twice_area = a[0] * b[1] - b[0] * a[1];
        twice_area * twice_area / length_squared
    }
}

/// Returns `true` if a simple loop turns left or goes straight on at each corner.
fn is_convex(vertices_m: &[Vector3<f64>], normal: &Vector3<f64>, corners: &[usize]) -> bool {
    let count = corners.len();
    (0..count).all(|k| {
        let [a, b, c] = [k, (k + 1) % count, (k + 2) % count].map(|k| vertices_m[corners[k]]);
        let (to, on) = (b - a, c - b);
        normal.dot(&to.cross(&on)) >= -STRAIGHT * norm(&to) * norm(&on)
    })
}
