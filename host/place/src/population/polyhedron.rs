//! Random convex polyhedra: of four to thirty faces, of any proportions, rotated anywhere, over a decade of sizes.

use super::Draw;
use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, Vector3};
use std::ops::RangeInclusive;

/// Fewest and most faces.
pub const FACES: RangeInclusive<usize> = 4..=30;
/// Smallest and largest extent, m: a decade.
pub const EXTENT_M: [f64; 2] = [0.020, 0.200];
/// The shortest axis of the ellipsoid that the faces touch, or the corners lie on, in units of the longest.
const FLATTEST: f64 = 0.4;
/// Planes that meet far out make needles: farther than this from the middle, in units of the longest axis, is too far.
const FARTHEST: f64 = 2.5;

/// A random polyhedron.
#[derive(Clone, Debug)]
pub struct RandomPolyhedron {
    /// Its corners, m.
    pub corners_m: Vec<[f64; 3]>,
    /// Number of its faces.
    pub faces: usize,
    /// Largest distance between two corners, m.
    pub extent_m: f64,
}

/// So many random polyhedra, with numbers of faces that take turns.
pub fn polyhedra(draw: &mut Draw, count: usize) -> Vec<RandomPolyhedron> {
    FACES.cycle().take(count).map(|faces| polyhedron(draw, faces)).collect()
}

/// A random polyhedron with this many faces: half of those with an even number are hulls of points on an ellipsoid, whose
/// faces are triangles; all others are bounded by planes that touch one, and have corners where three faces meet.
pub fn polyhedron(draw: &mut Draw, faces: usize) -> RandomPolyhedron {
    loop {
        let axes = Vector3::from_fn(|_, _| draw.within(FLATTEST, 1.0));
        let corners = if faces.is_multiple_of(2) && draw.chance(0.5) {
            // Euler's formula: a polyhedron of triangles with V corners has 2 V - 4 faces.
            (0..faces / 2 + 2).map(|_| draw.unit().component_mul(&axes)).collect()
        } else {
            let planes: Vec<_> = (0..faces).map(|_| tangent_plane(&draw.unit(), &axes)).collect();
            meeting_points(&planes)
        };
        let rotation = draw.rotation();
        let wanted_m = EXTENT_M[0] * (EXTENT_M[1] / EXTENT_M[0]).powf(draw.within(0.0, 1.0));
        let extent = extent(&corners);
        if !corners.iter().all(|corner| corner.norm() < FARTHEST) || !(extent > 0.0) {
            continue;
        }
        let corners: Vec<Vector3<f64>> =
            corners.iter().map(|corner| rotation * corner * (wanted_m / extent)).collect();
        // Planes that do not enclose a body, or corners that are too close to tell apart.
        if Polyhedron::hull(&corners).is_ok_and(|shape| shape.faces.len() == faces) {
            let corners_m = corners.into_iter().map(Into::into).collect();
            return RandomPolyhedron { corners_m, faces, extent_m: wanted_m };
        }
    }
}

/// The plane `n . x = d` that touches an ellipsoid where its normal is `n`.
fn tangent_plane(normal: &Vector3<f64>, axes: &Vector3<f64>) -> (Vector3<f64>, f64) {
    (*normal, normal.component_mul(axes).norm_squared().square_root())
}

/// Returns the points where three planes meet that no other cuts off.
fn meeting_points(planes: &[(Vector3<f64>, f64)]) -> Vec<Vector3<f64>> {
    let mut points = Vec::new();
    for i in 0..planes.len() {
        for j in 0..i {
            for k in 0..j {
                let normals = [i, j, k].map(|at| planes[at].0.transpose());
                let Some(inverse) = Matrix3::from_rows(&normals).try_inverse() else { continue };
                let point = inverse * Vector3::new(planes[i].1, planes[j].1, planes[k].1);
                let inside = |(at, (normal, distance)): (usize, &(Vector3<f64>, f64))| {
                    [i, j, k].contains(&at) || normal.dot(&point) <= *distance
                };
                if planes.iter().enumerate().all(inside) {
                    points.push(point);
                }
            }
        }
    }
    points
}

/// Largest distance between two points.
fn extent(points: &[Vector3<f64>]) -> f64 {
    points.iter().flat_map(|a| points.iter().map(move |b| (a - b).norm())).fold(0.0, f64::max)
}
