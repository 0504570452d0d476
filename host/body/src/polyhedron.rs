//! The grasped object: a rigid polyhedron with planar faces, not always convex.
//!
//! - The surface is closed and oriented: every edge lies between two faces, which run along it in opposite directions. It
//!   may have tunnels (a nut has), but is in one piece.
//! - A face is a planar polygon, which may have notches and holes. Corners of a face read from a mesh may lie off its plane
//!   by the noise of the mesh; what is said of points *on* the face is meant in its plane.
//! - Every constructor moves the origin to the centre of mass of the uniform body, so that `distance_m` of a face is the
//!   paper's `Y_i`. On a body that is not convex it may be zero or negative: Eq. 5 holds all the same. The axes stay those
//!   of the description; the inertia is a full tensor in them.

mod clearance;
mod convex;
mod critical;
mod error;
mod face;
mod hull;
mod mass;
mod mesh;
mod obj;
mod outlines;
mod pole;
mod regions;
mod solids;
pub mod surface;
#[cfg(test)]
mod tests;
mod touchable;

pub use clearance::Obstacles;
pub use convex::Closest;
pub use critical::Critical;
pub use error::counted;
pub use error::{MeshFault, PolyhedronError};
pub use mesh::{MAX_TRIANGLES, bounds_m, diagonal_m};
pub use touchable::Touchable;

use blindgrasp_shared::math::norm;
use nalgebra::{Matrix3, Vector3};

/// The most points that [`Polyhedron::hull`] and [`Polyhedron::prism`] take: their checks look at all triples.
pub const MAX_POINTS: usize = 100;

/// A planar face, seen in the object frame. Corners are indices into the vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Unit normal pointing **out of** the object. (The paper's `C_iY` points into it.)
    pub normal: Vector3<f64>,
    /// Distance of the face's plane from the origin of the object frame, m (`Y_i`, once the origin is the centre of mass);
    /// negative where the outside is on the origin's side.
    pub distance_m: f64,
    /// Corners of the outer outline, counter-clockwise seen from outside.
    pub corners: Vec<usize>,
    /// Corners of the holes, clockwise seen from outside.
    pub holes: Vec<Vec<usize>>,
    /// Triangles that make up the face, counter-clockwise seen from outside.
    pub triangles: Vec<[usize; 3]>,
    /// No holes, and no corner turns inwards.
    convex: bool,
}

/// A polyhedron in the object frame, whose origin is the centre of mass.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    /// Vertices, m.
    pub vertices_m: Vec<Vector3<f64>>,
    /// Faces.
    pub faces: Vec<Face>,
}

/// The tolerances within which a part of a mesh is flat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flatness {
    /// Largest angle between neighbours in a face, rad.
    pub angle_rad: f64,
    /// Largest distance of a face's parts from its plane, m: root mean square over each of them.
    pub distance_m: f64,
}

/// Volume, and what it takes to turn a mass into an inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Volume, m^3.
    pub volume_m3: f64,
    /// Centre of mass of the uniform body, m.
    pub centre_m: Vector3<f64>,
    /// Inertia of the uniform body about its centre of mass for each kilogram, m^2.
    pub inertia_per_kg_m2: Matrix3<f64>,
}

impl Polyhedron {
    /// Signed distance of a point from a face's outline once the point is moved onto the face's plane along the normal, m:
    /// from the nearest edge, of the outer outline or of a hole; positive on the face, negative beside it.
    pub fn margin_m(&self, face: usize, point_m: &Vector3<f64>) -> f64 {
        self.faces[face].margin_m(&self.vertices_m, point_m)
    }

    /// A point well inside a face, m: the mean of the corners of a convex one; of others the point that is farthest from
    /// the outline.
    pub fn face_centre_m(&self, face: usize) -> Vector3<f64> {
        let shape = &self.faces[face];
        if shape.convex { shape.mean_corner_m(&self.vertices_m) } else { self.widest_circle_m(face).0 }
    }

    /// Centre and radius of the widest circle that fits on a face, m; the radius to within a thousandth.
    pub fn widest_circle_m(&self, face: usize) -> (Vector3<f64>, f64) {
        pole::of(&self.faces[face], &self.vertices_m)
    }

    /// Area of a face, m^2.
    pub fn face_area_m2(&self, face: usize) -> f64 {
        self.faces[face].area_m2(&self.vertices_m)
    }

    /// The face that a point lies on, with the point's distance from it, m: of the faces whose outline contains the point
    /// to within `tolerance_m`, the nearest.
    pub fn nearest_face(&self, point_m: &Vector3<f64>, tolerance_m: f64) -> Option<(usize, f64)> {
        (0..self.faces.len())
            .map(|k| (k, (self.faces[k].normal.dot(point_m) - self.faces[k].distance_m).abs()))
            .filter(|(k, _)| self.margin_m(*k, point_m) >= -tolerance_m)
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Distance of a point over a face from the nearest part of the body that rises above the face's plane, m; infinite
    /// where nothing does, as on every face of a convex body. Whoever asks often asks [`Obstacles`].
    pub fn clearance_m(&self, face: usize, point_m: &Vector3<f64>) -> f64 {
        Obstacles::above(self, face).distance_m(point_m)
    }

    /// Largest distance of a vertex from the origin, m.
    pub fn radius_m(&self) -> f64 {
        self.vertices_m.iter().map(norm).fold(0.0, f64::max)
    }
}
