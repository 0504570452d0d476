//! Random convex polyhedra: of four to thirty faces, of any proportions, rotated anywhere, over a decade of sizes.

use crate::random::Draw;
use blindgrasp::plant::polyhedron::Polyhedron;
use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// Fewest and most faces.
pub const FACES: std::ops::RangeInclusive<usize> = 4..=30;
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
    /// How many faces it has.
    pub faces: usize,
    /// Largest distance between two corners, m.
    pub extent_m: f64,
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

/// Where three planes meet that no other cuts off.
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
pub fn extent(points: &[Vector3<f64>]) -> f64 {
    points.iter().flat_map(|a| points.iter().map(move |b| (a - b).norm())).fold(0.0, f64::max)
}

/// Each face in triangles, cut in four so many times.
const CUTS: usize = 2;
/// How far a vertex of a mesh is from where it should be, in units of the body's extent: about what a 3-D print has.
const NOISE: f64 = 2e-4;

/// The same body as a mesh with noise, as the text of an ASCII STL in millimetres: faces cut into small triangles, whose
/// vertices are each moved a little.
///
/// # Panics
/// If the corners are none of a polyhedron's.
pub fn noisy_stl(draw: &mut Draw, body: &RandomPolyhedron) -> String {
    let corners: Vec<Vector3<f64>> = body.corners_m.iter().map(|&corner| corner.into()).collect();
    let shape = Polyhedron::hull(&corners).expect("a polyhedron");
    let mut triangles: Vec<[Vector3<f64>; 3]> = Vec::new();
    for face in &shape.faces {
        let at = |k: usize| shape.vertices_m[face.corners[k]];
        triangles.extend((1..face.corners.len() - 1).map(|k| [at(0), at(k), at(k + 1)]));
    }
    for _ in 0..CUTS {
        triangles = triangles.iter().flat_map(cut_in_four).collect();
    }
    // Triangles that share a vertex have it in the same place, to rounding.
    let mut moved: BTreeMap<[i64; 3], Vector3<f64>> = BTreeMap::new();
    let mut text = String::from("solid noise\n");
    for triangle in &triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for vertex in triangle {
            let key = <[f64; 3]>::from(vertex / (1e-7 * body.extent_m)).map(|v| v.round() as i64);
            let noise = NOISE * body.extent_m;
            let [x, y, z]: [f64; 3] =
                (*moved.entry(key).or_insert_with(|| vertex + draw.vector(noise)) * 1e3).into();
            text += &format!("vertex {x:e} {y:e} {z:e}\n");
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid noise\n"
}

fn cut_in_four(&[a, b, c]: &[Vector3<f64>; 3]) -> [[Vector3<f64>; 3]; 4] {
    let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}
