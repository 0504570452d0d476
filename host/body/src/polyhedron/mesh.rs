//! A polyhedron from the triangles of its surface.

use super::error::MeshFault;
use super::surface::survey;
use super::{Face, Flatness, Polyhedron, PolyhedronError, mass, outlines, regions};
use nalgebra::Vector3;

/// The most triangles that a mesh may have.
pub const MAX_TRIANGLES: usize = 200_000;
/// Larger coordinates make no sense, m.
const LARGEST_M: f64 = 1e6;
/// A body is a sheet when its volume is less than this, in units of the cube of its diagonal.
const LEAST_VOLUME: f64 = 1e-9;

impl Polyhedron {
    /// The body that a closed surface of triangles encloses, which are counter-clockwise seen from outside. Triangles that
    /// lie in one plane to within `flatness` become one face; faces are numbered in the order of their first triangles.
    /// Vertices that no triangle uses are left out.
    ///
    /// # Errors
    /// The first thing that keeps the triangles from enclosing one body, with its place.
    pub fn mesh(
        vertices_m: &[Vector3<f64>],
        triangles: &[[usize; 3]],
        flatness: &Flatness,
    ) -> Result<Self, PolyhedronError> {
        check(vertices_m, triangles)?;
        let (mut vertices_m, triangles) = used(vertices_m, triangles);
        let survey = survey(&triangles);
        survey.check_closed(&vertices_m, &triangles)?;
        survey.check_oriented(&triangles)?;
        let properties = mass::of(&vertices_m, triangles.iter());
        let diagonal_m = diagonal_m(&vertices_m);
        let least = LEAST_VOLUME * diagonal_m.powi(3);
        if properties.volume_m3 <= -least {
            return Err(MeshFault::InsideOut.into());
        }
        if !(properties.volume_m3 > least && properties.inertia_per_kg_m2.iter().all(|v| v.is_finite())) {
            return Err(MeshFault::NoVolume.into());
        }
        for vertex in &mut vertices_m {
            *vertex -= properties.centre_m;
        }
        let regions = regions::regions(&vertices_m, &triangles, &survey, flatness, diagonal_m);
        let mut outlines = outlines::outlines(&vertices_m, &triangles, &survey, flatness, &regions);
        let mut own: Vec<Vec<[usize; 3]>> = vec![Vec::new(); regions.planes.len()];
        for (corners, &face) in triangles.iter().zip(&regions.face_of) {
            own[face as usize].push(*corners);
        }
        let faces = regions
            .planes
            .iter()
            .zip(own)
            .enumerate()
            .map(|(k, (&plane, triangles))| {
                let (corners, holes) = std::mem::take(&mut outlines[k]);
                Face::new(&vertices_m, plane, corners, holes, triangles)
            })
            .collect();
        Ok(Self { vertices_m, faces })
    }
}

/// Extent of a set of points from corner to corner of the box around it, m.
pub fn diagonal_m(points_m: &[Vector3<f64>]) -> f64 {
    let (low, high) = bounds_m(points_m);
    blindgrasp_shared::math::norm(&(high - low))
}

/// Lowest and highest coordinates, m.
pub fn bounds_m(points_m: &[Vector3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    let start = points_m.first().copied().unwrap_or_default();
    points_m.iter().fold((start, start), |(low, high), point| (low.inf(point), high.sup(point)))
}

/// Checks single numbers.
fn check(vertices_m: &[Vector3<f64>], triangles: &[[usize; 3]]) -> Result<(), MeshFault> {
    if triangles.len() > MAX_TRIANGLES {
        return Err(MeshFault::TooMany { count: triangles.len() });
    }
    let wrong = |p: &Vector3<f64>| !(p.amax() <= LARGEST_M) || p.iter().any(|v| v.is_nan());
    if let Some(vertex) = vertices_m.iter().position(wrong) {
        return Err(MeshFault::OutOfRange { vertex });
    }
    let vertices = vertices_m.len();
    let wrong = |&[a, b, c]: &[usize; 3]| a.max(b).max(c) >= vertices || a == b || b == c || c == a;
    match triangles.iter().position(wrong) {
        Some(triangle) => Err(MeshFault::Corners { triangle, vertices }),
        None => Ok(()),
    }
}

/// Without the vertices that no triangle uses.
fn used(vertices_m: &[Vector3<f64>], triangles: &[[usize; 3]]) -> (Vec<Vector3<f64>>, Vec<[usize; 3]>) {
    let mut place = vec![usize::MAX; vertices_m.len()];
    for &corner in triangles.iter().flatten() {
        place[corner] = 0;
    }
    let mut kept = Vec::new();
    for (place, vertex) in place.iter_mut().zip(vertices_m).filter(|(place, _)| **place == 0) {
        *place = kept.len();
        kept.push(*vertex);
    }
    (kept, triangles.iter().map(|corners| corners.map(|k| place[k])).collect())
}
