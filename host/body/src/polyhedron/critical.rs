//! Places where a sphere touches a polyhedron that need not be convex: the critical points of the distance from its centre.
//!
//! The energy of a soft sphere with its centre at `c` against a convex body is `P(r - |c - p|)` with the closest point `p`. As a
//! function of the body this is additive: for convex bodies whose union is convex, `E(A + B) = E(A) + E(B) - E(A B)`, since the
//! greater one of their distances is that of what they share. So it extends to all polyhedra in one way only, whatever parts
//! these are cut into (Groemer 1978): the sum over the points of the surface where the distance is critical, each with its index,
//! 1 less the Euler characteristic of what of the body is closer to `c` right beside it (Schneider 1977).
//!
//! - The foot of `c` on a face counts once; so do edges and vertices that `c` is straight in front of, as on a convex body.
//! - In front of a concave edge the feet on both its faces count, and the edge counts -1: as one face goes over into the other,
//!   edge and foot meet and cancel. Forces never jump, and a face feels the same whatever it borders on.

use super::{Closest, Face, Polyhedron};
use crate::closest_of_lines;
use blindgrasp_shared::math::norm;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Error of directions, rad.
const ROUNDING: f64 = 1e-12;

/// A place where a sphere touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Critical {
    /// Number of the face, edge or vertex.
    pub feature: usize,
    /// The place, as seen from the sphere's centre.
    pub place: Closest,
    /// The number of times that it counts; negative at concave edges.
    pub index: i32,
}

/// The faces, edges and vertices of a polyhedron.
#[derive(Clone, Debug)]
pub(super) struct Features {
    faces: Vec<Face>,
    /// A ball around each face: its centre and radius, m.
    balls_m: Vec<(Vector3<f64>, f64)>,
    vertices_m: Vec<Vector3<f64>>,
    edges: Vec<Edge>,
    corners: Vec<Corner>,
}

#[derive(Clone, Debug)]
struct Edge {
    from_m: Vector3<f64>,
    /// Unit vector.
    along: Vector3<f64>,
    length_m: f64,
    /// Unit vectors in the planes of both faces.
    inwards: [Vector3<f64>; 2],
    /// Sum of the normals of both faces.
    outwards: Vector3<f64>,
    is_concave: bool,
}

impl Edge {
    /// Index of its point that is straight in front of a point, which lies in a direction from some point of it.
    fn index(&self, away_m: &Vector3<f64>) -> i32 {
        match (self.inwards.map(|inwards| inwards.dot(away_m) > 0.0), self.is_concave) {
            ([false, false], false) => 1,
            ([true, true], true) => -1,
            _ => 0,
        }
    }
}

#[derive(Clone, Debug)]
struct Corner {
    at_m: Vector3<f64>,
    sectors: Vec<Sector>,
    /// Edges by their numbers, and `true` for those that end here.
    rays: Vec<(usize, bool)>,
    /// Normals of the faces, each times its angle here.
    outwards: Vector3<f64>,
}

/// A face as a vertex sees it.
#[derive(Clone, Debug)]
struct Sector {
    normal: Vector3<f64>,
    /// Unit vectors in its plane, from both edges.
    inwards: [Vector3<f64>; 2],
    /// More than half a turn.
    is_wide: bool,
}

impl Features {
    pub(super) fn of(shape: &Polyhedron) -> Self {
        let mut numbers: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        let mut edges: Vec<Edge> = Vec::new();
        let corner =
            |&at_m| Corner { at_m, sectors: Vec::new(), rays: Vec::new(), outwards: Vector3::zeros() };
        let mut corners: Vec<Corner> = shape.vertices_m.iter().map(corner).collect();
        for face in &shape.faces {
            let normal = face.normal;
            let unit = |from: usize, to: usize| {
                let edge_m = shape.vertices_m[to] - shape.vertices_m[from];
                let length_m = norm(&edge_m);
                (edge_m / length_m, length_m)
            };
            for (from, to) in face.edges() {
                let (along, length_m) = unit(from, to);
                let inwards = normal.cross(&along);
                // Every edge lies between two faces, which run along it in opposite directions.
                if let Some(&number) = numbers.get(&(to, from)) {
                    let edge = &mut edges[number];
                    edge.is_concave = inwards.dot(&edge.outwards) > 0.0;
                    edge.inwards[1] = inwards;
                    edge.outwards += normal;
                } else {
                    let number = edges.len();
                    numbers.insert((from, to), number);
                    corners[from].rays.push((number, false));
                    corners[to].rays.push((number, true));
                    let (from_m, inwards) = (shape.vertices_m[from], [inwards; 2]);
                    edges.push(Edge {
                        from_m,
                        along,
                        length_m,
                        inwards,
                        outwards: normal,
                        is_concave: false,
                    });
                }
            }
            for outline in face.outlines() {
                let count = outline.len();
                for (k, &at) in outline.iter().enumerate() {
                    let [next, last] = [k + 1, k + count - 1].map(|other| unit(at, outline[other % count]).0);
                    let sine = normal.dot(&next.cross(&last));
                    let turn_rad = libm::atan2(sine, next.dot(&last)).rem_euclid(TAU);
                    let inwards = [normal.cross(&next), last.cross(&normal)];
                    corners[at].sectors.push(Sector { normal, inwards, is_wide: sine < 0.0 });
                    corners[at].outwards += normal * turn_rad;
                }
            }
        }
        let ball_m = |face: &Face| {
            let centre_m = face.mean_corner_m(&shape.vertices_m);
            let farthest_m = |far: f64, &k: &usize| far.max(norm(&(shape.vertices_m[k] - centre_m)));
            (centre_m, face.corners.iter().fold(0.0, farthest_m))
        };
        Self {
            balls_m: shape.faces.iter().map(ball_m).collect(),
            faces: shape.faces.clone(),
            vertices_m: shape.vertices_m.clone(),
            edges,
            corners: corners.into_iter().filter(|corner| !corner.sectors.is_empty()).collect(),
        }
    }

    /// Gives the places that a sphere around a point outside may touch, which are closer than a distance. Returns the closest point
    /// of the surface; from inside that is the only place, and others are given that are not to be believed.
    pub(super) fn see(
        &self,
        point_m: &Vector3<f64>,
        within_m: f64,
        mut see: impl FnMut(Critical),
    ) -> Critical {
        // The least square of the distance so far, of whichever side.
        let mut nearest = Nearest { squared: f64::INFINITY, critical: None };
        let mut begun = self.faces.len();
        for (k, edge) in self.edges.iter().enumerate() {
            let from_m = point_m - edge.from_m;
            let along_m = edge.along.dot(&from_m);
            if !(along_m > 0.0 && along_m < edge.length_m) {
                continue;
            }
            let away_m = from_m - edge.along * along_m;
            let squared = away_m.norm_squared();
            let index = edge.index(&from_m);
            let counts = index != 0 && squared < within_m * within_m;
            if counts || squared < nearest.squared {
                let critical =
                    self.at(begun + k, edge.from_m + edge.along * along_m, &away_m, &edge.outwards, index);
                nearest.look(critical);
                // In front of it from inside, an edge is no place to touch.
                if counts && critical.place.distance_m > 0.0 {
                    see(critical);
                }
            }
        }
        begun += self.edges.len();
        for (k, corner) in self.corners.iter().enumerate() {
            let away_m = point_m - corner.at_m;
            let squared = away_m.norm_squared();
            let is_near = squared < within_m * within_m;
            if is_near || squared < nearest.squared {
                let index = if is_near { corner.index(&away_m, &self.edges) } else { 0 };
                let critical = self.at(begun + k, corner.at_m, &away_m, &corner.outwards, index);
                nearest.look(critical);
                if index != 0 && critical.place.distance_m > 0.0 {
                    see(critical);
                }
            }
        }
        // Last, since most faces are farther away than the nearest edge or vertex.
        for (feature, face) in self.faces.iter().enumerate() {
            let (centre_m, radius_m) = self.balls_m[feature];
            let apart_m = norm(&(point_m - centre_m)) - radius_m;
            if apart_m > within_m && apart_m * apart_m > nearest.squared {
                continue;
            }
            let distance_m = face.normal.dot(point_m) - face.distance_m;
            let counts = distance_m > 0.0 && distance_m < within_m;
            if !(counts || distance_m * distance_m < nearest.squared)
                || !(face.margin_m(&self.vertices_m, point_m) > 0.0)
            {
                continue;
            }
            let foot_m = point_m - face.normal * distance_m;
            let place = Closest { point_m: foot_m, normal: face.normal, distance_m };
            let critical = Critical { feature, place, index: 1 };
            nearest.look(critical);
            if counts {
                see(critical);
            }
        }
        nearest.critical.unwrap_or(Critical {
            feature: 0,
            place: Closest { point_m: *point_m, normal: Vector3::z(), distance_m: 0.0 },
            index: 1,
        })
    }

    /// Gives the places inside of a line, by its share, where it passes an edge or a vertex that is turned to it.
    pub(super) fn passes(&self, ends_m: &[Vector3<f64>; 2], mut see: impl FnMut(f64)) {
        let along_m = ends_m[1] - ends_m[0];
        let is_within = |share: f64| share > 0.0 && share < 1.0;
        for edge in self.edges.iter().filter(|edge| !edge.is_concave) {
            let to_m = edge.from_m + edge.along * edge.length_m;
            let [share, on_edge] = closest_of_lines([ends_m, &[edge.from_m, to_m]]);
            let away_m = ends_m[0] + along_m * share - edge.from_m;
            if is_within(share) && is_within(on_edge) && edge.outwards.dot(&away_m) > 0.0 {
                see(share);
            }
        }
        for corner in &self.corners {
            let share = along_m.dot(&(corner.at_m - ends_m[0])) / along_m.norm_squared();
            if !is_within(share) {
                continue;
            }
            let away_m = ends_m[0] + along_m * share - corner.at_m;
            // Where an edge leads nearer to the line, it is the edge that it passes. Along an edge it passes both ends.
            let leads_nearer = |&(number, ends_here): &(usize, bool)| {
                let along_m = self.edges[number].along.dot(&away_m);
                if ends_here { -along_m } else { along_m }
            };
            let none_m = ROUNDING * norm(&away_m);
            if corner.rays.iter().all(|ray| leads_nearer(ray) <= none_m) {
                see(share);
            }
        }
    }

    /// A part of a line that is inside the body, by shares of the line: up to where it crosses the surface next.
    pub(super) fn inside(&self, ends_m: &[Vector3<f64>; 2]) -> Option<[f64; 2]> {
        let along_m = ends_m[1] - ends_m[0];
        let crossing = |face: &Face| {
            let [from_m, to_m] = ends_m.map(|end_m| face.normal.dot(&end_m) - face.distance_m);
            let share = from_m / (from_m - to_m);
            ((from_m > 0.0) != (to_m > 0.0)
                && face.margin_m(&self.vertices_m, &(ends_m[0] + along_m * share)) > 0.0)
                .then_some(share)
        };
        let mut shares: Vec<f64> = self.faces.iter().filter_map(crossing).collect();
        shares.sort_by(f64::total_cmp);
        let first = *shares.first()?;
        let begins_inside = self.see(&ends_m[0], 0.0, |_| ()).place.distance_m < 0.0;
        Some(if begins_inside { [0.0, first] } else { [first, shares.get(1).copied().unwrap_or(1.0)] })
    }

    /// A point of an edge or a vertex, seen from a point that is so far away.
    fn at(
        &self,
        feature: usize,
        at_m: Vector3<f64>,
        away_m: &Vector3<f64>,
        outwards: &Vector3<f64>,
        index: i32,
    ) -> Critical {
        let distance_m = norm(away_m);
        let sign = if away_m.dot(outwards) < 0.0 { -1.0 } else { 1.0 };
        let normal = if distance_m > 0.0 { away_m * (sign / distance_m) } else { outwards / norm(outwards) };
        let place = Closest { point_m: at_m, normal, distance_m: sign * distance_m };
        Critical { feature, place, index }
    }
}

struct Nearest {
    squared: f64,
    critical: Option<Critical>,
}

impl Nearest {
    fn look(&mut self, critical: Critical) {
        let squared = critical.place.distance_m * critical.place.distance_m;
        if squared < self.squared {
            self.squared = squared;
            self.critical = Some(Critical { index: 1, ..critical });
        }
    }
}

impl Corner {
    /// Index of the vertex for the distance from a point that is so far away.
    ///
    /// The body continued from here without end is in one piece, so that the indices of all its critical points, and one for the
    /// point itself if that lies inside, add up to one.
    fn index(&self, away_m: &Vector3<f64>, edges: &[Edge]) -> i32 {
        let mut sum = 0;
        // The square of the distance to what is closest, and its height above that.
        let (mut nearest, mut height) = (away_m.norm_squared(), self.outwards.dot(away_m));
        let mut look = |squared: f64, above: f64| {
            if squared < nearest {
                (nearest, height) = (squared, above);
            }
        };
        for Sector { normal, inwards, is_wide } in &self.sectors {
            let [a, b] = inwards.map(|inwards| inwards.dot(away_m) > 0.0);
            if (a && b) || (*is_wide && (a || b)) {
                let distance_m = normal.dot(away_m);
                sum += i32::from(distance_m > 0.0);
                look(distance_m * distance_m, distance_m);
            }
        }
        for &(number, ends_here) in &self.rays {
            let edge = &edges[number];
            let along_m = edge.along.dot(away_m);
            if (along_m > 0.0) != ends_here && along_m != 0.0 {
                sum += edge.index(away_m);
                look((away_m - edge.along * along_m).norm_squared(), edge.outwards.dot(away_m));
            }
        }
        i32::from(height >= 0.0) - sum
    }
}
