//! Mass properties.

use super::{MassProperties, Polyhedron};
use nalgebra::{Matrix3, Vector3};

impl Polyhedron {
    /// Volume, centre of mass and inertia of the uniform body: exact sums over tetrahedra.
    pub fn mass_properties(&self) -> MassProperties {
        of(&self.vertices_m, self.faces.iter().flat_map(|face| &face.triangles))
    }
}

/// Of the body that a closed surface of triangles encloses, which are counter-clockwise seen from outside.
///
/// Tetrahedra stand on the triangles with their tip at the mean of the vertices; those of triangles that look towards the tip
/// count negative. Seen from there all terms are of the body's size, so that no digits are lost however far the body is from
/// the origin; on a convex body all of them are positive.
pub(super) fn of<'a>(
    vertices_m: &[Vector3<f64>],
    triangles: impl Iterator<Item = &'a [usize; 3]>,
) -> MassProperties {
    let tip = vertices_m.iter().sum::<Vector3<f64>>() / vertices_m.len().max(1) as f64;
    let (mut six_volumes, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for corners in triangles {
        let [a, b, c] = corners.map(|k| vertices_m[k] - tip);
        let six = a.dot(&b.cross(&c));
        let sum = a + b + c;
        six_volumes += six;
        // The mean of x over a tetrahedron is the mean of its corners; the mean of x x^T is
        // (sum of p p^T + s s^T) / 20 over its corners p with s their sum. The tip is the origin here.
        first += six * sum / 4.0;
        second +=
            six * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose()) / 20.0;
    }
    let centre = first / six_volumes;
    let spread = second / six_volumes - centre * centre.transpose();
    MassProperties {
        volume_m3: six_volumes / 6.0,
        centre_m: tip + centre,
        inertia_per_kg_m2: Matrix3::identity() * spread.trace() - spread,
    }
}
