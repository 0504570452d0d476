//! A face as a place for a contact: a plane with axes of its own, and the half-planes that keep a contact on it.

use crate::plant::polyhedron::Polyhedron;
use nalgebra::{Vector2, Vector3};

/// A half-plane of a face's plane: `inwards . z + offset_m` is how far a point lies inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HalfPlane {
    /// Unit vector in the axes of the face.
    pub(super) inwards: Vector2<f64>,
    /// How far the origin lies inside, m.
    pub(super) offset_m: f64,
}

/// A face in the object frame, with coordinates `z` (m) in its plane.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    /// Its index.
    pub(super) face: usize,
    /// `C_Y`: unit normal into the object.
    pub(super) inward: Vector3<f64>,
    /// Unit vectors in the plane; the first lies along the face's longest edge.
    pub(super) axes: [Vector3<f64>; 2],
    /// A point inside the face, where `z = 0`, m.
    pub(super) origin_m: Vector3<f64>,
    /// How far the origin lies inside the outline, m.
    pub(super) margin_m: f64,
    /// A convex part of the face around the origin: all of it, if the face is convex.
    pub(super) cell: Vec<HalfPlane>,
}

impl Facet {
    /// The face of a polyhedron, around its middle.
    pub(super) fn of(shape: &Polyhedron, face: usize) -> Self {
        let plane = &shape.faces[face];
        let origin_m = shape.face_centre_m(face);
        let corners = plane.corners.iter().map(|&k| shape.vertices_m[k]);
        let edges: Vec<(Vector3<f64>, Vector3<f64>)> = corners.clone().zip(corners.cycle().skip(1)).collect();
        let longest =
            edges.iter().map(|(from, to)| to - from).fold(Vector3::zeros(), |a: Vector3<f64>, b| {
                if b.norm_squared() > a.norm_squared() { b } else { a }
            });
        let along = longest.normalize();
        let axes = [along, plane.normal.cross(&along)];
        let flat = |v: Vector3<f64>| Vector2::new(axes[0].dot(&v), axes[1].dot(&v));
        let cell = edges
            .iter()
            .map(|(from, to)| {
                let inwards = flat(plane.normal.cross(&(to - from)).normalize());
                HalfPlane { inwards, offset_m: inwards.dot(&flat(origin_m - from)) }
            })
            .collect();
        let margin_m = shape.margin_m(face, &origin_m);
        Self { face, inward: -plane.normal, axes, origin_m, margin_m, cell }
    }

    /// How far a coordinate lies inside the convex part, m.
    pub(super) fn margin_at_m(&self, z: &Vector2<f64>) -> f64 {
        self.cell.iter().map(|half| half.inwards.dot(z) + half.offset_m).fold(f64::INFINITY, f64::min)
    }

    /// The point of a coordinate, in the object frame, m.
    pub(super) fn point_m(&self, z: &Vector2<f64>) -> Vector3<f64> {
        self.origin_m + self.axes[0] * z.x + self.axes[1] * z.y
    }

    /// The coordinates of a point of the face, m.
    pub(super) fn coordinates(&self, point_m: &Vector3<f64>) -> Vector2<f64> {
        let from_origin = point_m - self.origin_m;
        Vector2::new(self.axes[0].dot(&from_origin), self.axes[1].dot(&from_origin))
    }
}
