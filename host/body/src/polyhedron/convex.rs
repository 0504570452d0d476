//! Signed distance of a point from a convex polyhedron. Face, edge and vertex are one formula: the normal points from the
//! closest point of the surface to the point, and turns round where the point is inside.

use super::Polyhedron;
use blindgrasp_shared::math::norm;
use nalgebra::Vector3;

/// The most that a vertex may stand out of a face's plane, in units of the body's extent, while the body counts as convex.
const FLAT: f64 = 1e-6;

/// A convex polyhedron, prepared to be asked often.
#[derive(Clone, Debug)]
pub(super) struct Convex {
    sides: Vec<Side>,
}

#[derive(Clone, Debug)]
struct Side {
    normal: Vector3<f64>,
    distance_m: f64,
    edges: Vec<Edge>,
}

#[derive(Clone, Debug)]
struct Edge {
    from_m: Vector3<f64>,
    /// Unit vector.
    along: Vector3<f64>,
    length_m: f64,
    /// Unit vector in the face's plane.
    inwards: Vector3<f64>,
}

/// The point of a surface that is closest to a given one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// It, m.
    pub point_m: Vector3<f64>,
    /// Unit vector along the line from it to the given point, out of the body.
    pub normal: Vector3<f64>,
    /// Distance of the given point, m; negative inside.
    pub distance_m: f64,
}

impl Convex {
    /// Of a polyhedron; `None` if it is not convex.
    pub(super) fn of(shape: &Polyhedron) -> Option<Self> {
        let flat_m = FLAT * shape.radius_m();
        let is_inside = |point_m: &Vector3<f64>| {
            shape.faces.iter().all(|face| face.normal.dot(point_m) - face.distance_m <= flat_m)
        };
        if !(shape.faces.iter().all(|face| face.is_convex()) && shape.vertices_m.iter().all(is_inside)) {
            return None;
        }
        let sides = shape.faces.iter().map(|face| {
            let edges = face.edges().map(|(from, to)| {
                let from_m = shape.vertices_m[from];
                let edge_m = shape.vertices_m[to] - from_m;
                let length_m = norm(&edge_m);
                let along = edge_m / length_m;
                Edge { from_m, along, length_m, inwards: face.normal.cross(&along) }
            });
            Side { normal: face.normal, distance_m: face.distance_m, edges: edges.collect() }
        });
        Some(Self { sides: sides.collect() })
    }

    /// The part of a line that is inside, by shares of the line.
    pub(super) fn inside(&self, ends_m: &[Vector3<f64>; 2]) -> Option<[f64; 2]> {
        let (mut low, mut high) = (0.0, 1.0);
        for side in &self.sides {
            let [from_m, to_m] = ends_m.map(|end_m| side.normal.dot(&end_m) - side.distance_m);
            match (from_m > 0.0, to_m > 0.0) {
                (true, true) => return None,
                (true, false) => low = f64::max(low, from_m / (from_m - to_m)),
                (false, true) => high = f64::min(high, from_m / (from_m - to_m)),
                (false, false) => {}
            }
        }
        (low < high).then_some([low, high])
    }

    /// Returns the point of the surface that is closest to a point.
    pub(super) fn closest(&self, point_m: &Vector3<f64>) -> Closest {
        let height_m = |side: &Side| side.normal.dot(point_m) - side.distance_m;
        let mut highest = Closest { point_m: *point_m, normal: Vector3::z(), distance_m: f64::NEG_INFINITY };
        let mut edges: &[Edge] = &[];
        for side in &self.sides {
            let distance_m = height_m(side);
            if distance_m > highest.distance_m {
                highest.distance_m = distance_m;
                highest.normal = side.normal;
                edges = &side.edges;
            }
        }
        highest.point_m -= highest.normal * highest.distance_m;
        let is_on_face = |edge: &Edge| edge.inwards.dot(&(highest.point_m - edge.from_m)) >= 0.0;
        if highest.distance_m <= 0.0 || edges.iter().all(is_on_face) {
            return highest;
        }
        // No plane is farther away than the surface: if the foot on the farthest is beside its face, an edge is closest.
        let mut nearest = (f64::INFINITY, highest.point_m);
        for edge in self.sides.iter().filter(|side| height_m(side) > 0.0).flat_map(|side| &side.edges) {
            let along_m = edge.along.dot(&(point_m - edge.from_m)).clamp(0.0, edge.length_m);
            let foot_m = edge.from_m + edge.along * along_m;
            let squared = (point_m - foot_m).norm_squared();
            if squared < nearest.0 {
                nearest = (squared, foot_m);
            }
        }
        let away_m = point_m - nearest.1;
        let distance_m = norm(&away_m);
        // On an edge itself there is no line to the closest point.
        let normal = if distance_m > 0.0 { away_m / distance_m } else { highest.normal };
        Closest { point_m: nearest.1, normal, distance_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polyhedron::{Flatness, clearance::nearest};
    use blindgrasp_meshes::{Numbers, bracket};

    fn hull(numbers: &mut Numbers) -> Polyhedron {
        let points: Vec<_> = (0..12).map(|_| numbers.vector() * 0.03).collect();
        Polyhedron::hull(&points).unwrap()
    }

    /// Against the nearest of all triangles, a formula of its own, and the side by the planes.
    ///
    /// Tolerance: coordinates of 0.1 m, a hundred roundings.
    #[test]
    fn it_is_the_nearest_of_all_triangles() {
        let mut numbers = Numbers(7);
        for _ in 0..20 {
            let shape = hull(&mut numbers);
            let convex = Convex::of(&shape).unwrap();
            let mut features = [0; 2];
            for _ in 0..1000 {
                let point = numbers.vector() * 0.06;
                let closest = convex.closest(&point);
                let least = shape
                    .faces
                    .iter()
                    .flat_map(|face| &face.triangles)
                    .map(|corners| norm(&(nearest(&corners.map(|k| shape.vertices_m[k]), &point) - point)))
                    .fold(f64::INFINITY, f64::min);
                let inside = shape.faces.iter().all(|face| face.normal.dot(&point) < face.distance_m);
                features[usize::from(inside)] += 1;
                let expected = if inside { -least } else { least };
                assert!((closest.distance_m - expected).abs() < 1e-15, "{closest:?} {expected}");
                let there = closest.point_m + closest.normal * closest.distance_m;
                assert!((there - point).norm() < 1e-15 && (closest.normal.norm() - 1.0).abs() < 1e-12);
            }
            assert!(features[0] > 500 && features[1] > 5, "{features:?}");
        }
    }

    /// Distance and normal change steadily from face to edge to vertex.
    #[test]
    fn nothing_jumps_at_an_edge() {
        let convex = Convex::of(&Polyhedron::cuboid([0.04; 3]).unwrap()).unwrap();
        let mut numbers = Numbers(3);
        for _ in 0..2000 {
            // Outside, near a boundary between features: the planes through a face's edges.
            let mut point = Vector3::new(0.02, 0.02, 0.02) + numbers.vector().abs() * 0.01;
            point[numbers.below(3)] = 0.02;
            let step = numbers.vector() * 1e-9;
            let (a, b) = (convex.closest(&(point - step)), convex.closest(&(point + step)));
            assert!((a.distance_m - b.distance_m).abs() < 5e-9);
            // The normal turns by at most the step over the distance.
            assert!((a.normal - b.normal).norm() * a.distance_m.max(1e-9) < 1e-8, "{a:?} {b:?}");
        }
    }

    #[test]
    fn a_bracket_is_not_convex() {
        let (vertices, triangles) = bracket();
        let flatness = Flatness { angle_rad: 1e-3, distance_m: 1e-6 };
        assert!(Convex::of(&Polyhedron::mesh(&vertices, &triangles, &flatness).unwrap()).is_none());
    }
}
