//! Regions, the triangles of a mesh that make up a face: everything that is flat to within a tolerance.
//!
//! Neighbouring patches are united, beginning with single triangles, in the order of how well one plane fits both. The plane
//! of a patch passes through its area's centre; its normal is the mean of its triangles' normals weighted with their areas,
//! which hangs on the patch's rim alone, so that noise inside of it cancels. Two patches fit when each of them is within
//! [`Flatness::distance_m`] of the common plane (root mean square over its area), and
//!
//! 1. first, when their normals are within [`Flatness::angle_rad`] of each other. That finds the faces of what comes from a
//!    CAD program, where neighbours in one face agree to rounding and everything else is a corner or a facet of something
//!    round. Normals of narrow triangles are given what an error of the vertices ([`VERTEX`]) does to them.
//! 2. then, on meshes with noise, up to a much larger angle [`ROUGH`]: the finer the triangles, the more noise tilts them. A
//!    fine mesh of something round looks the same from near. What tells them apart is the sum of the bends at the edges
//!    inside, each with its sign: noise goes up and down, a ball bends one way. What bends as a whole by more than
//!    `angle_rad`, or is off its plane by more than four times `distance_m` somewhere, stays what it was after the first
//!    step.
//!
//! Both steps go through the edges in the order of cost a few times: `n log n`.

use super::Flatness;
use super::surface::{NONE, Survey, end, origin};
use blindgrasp_shared::math::{Real, norm};
use nalgebra::{Matrix3, Vector3};

/// Accuracy of vertices, in units of the body's diagonal: some roundings of a 32-bit float.
const VERTEX: f64 = 2e-6;
/// The most that noise may tilt a triangle, rad: 45 degrees.
const ROUGH: f64 = std::f64::consts::FRAC_PI_4;
/// The farthest that a vertex may be off its face with noise, in units of [`Flatness::distance_m`].
const FARTHEST: f64 = 4.0;
/// So many edges tell chance from a bend.
const MANY: usize = 16;
/// Rounds through all edges. Each unites what the one before made ready; four are enough for what tests have seen.
const ROUNDS: usize = 12;

/// A connected part of the surface, as sums over its triangles.
#[derive(Clone, Copy, Debug)]
struct Patch {
    /// m^2
    area: f64,
    /// Area times centre.
    first: Vector3<f64>,
    /// Area times the mean of `x x^T`.
    second: Matrix3<f64>,
    /// Area times normal.
    vector: Vector3<f64>,
    /// Least height of the most regular of its triangles, m.
    height: f64,
}

impl Patch {
    fn of([a, b, c]: [Vector3<f64>; 3], least_area: f64) -> Self {
        let vector = (b - a).cross(&(c - a)) / 2.0;
        let longest = [b - a, c - b, a - c].map(|edge| edge.norm_squared()).into_iter().fold(0.0, f64::max);
        // What has no area has a place all the same.
        let area = norm(&vector).max(least_area);
        let sum = a + b + c;
        let squares = a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose();
        Self {
            area,
            first: sum * (area / 3.0),
            second: squares * (area / 12.0),
            vector,
            height: 2.0 * norm(&vector) / longest.square_root(),
        }
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            area: self.area + other.area,
            first: self.first + other.first,
            second: self.second + other.second,
            vector: self.vector + other.vector,
            height: self.height.max(other.height),
        }
    }

    /// Normal and distance of the plane that fits it; no normal where it has no area.
    fn plane(&self) -> (Vector3<f64>, f64) {
        let length = norm(&self.vector);
        let normal = if length > 0.0 { self.vector / length } else { Vector3::zeros() };
        (normal, normal.dot(&self.first) / self.area)
    }

    /// Mean square distance from a plane, m^2.
    fn mean_square(&self, (normal, distance): &(Vector3<f64>, f64)) -> f64 {
        let mean = normal.dot(&self.first) / self.area;
        let square = normal.dot(&(self.second * normal)) / self.area;
        (square - mean * mean).max(0.0) + (mean - distance).powi(2)
    }
}

/// The limits within which two patches are one.
struct Limits {
    angle: f64,
    mean_square: f64,
    /// Accuracy of vertices, m.
    vertex: f64,
}

impl Limits {
    /// Returns how badly one plane fits both, or `None` if it does not.
    fn cost(&self, a: &Patch, b: &Patch) -> Option<f64> {
        // The length of a chord for the angle that it spans: the same to a hundredth up to half a radian.
        let tilt = norm(&(a.plane().0 - b.plane().0));
        let unsure = self.vertex / a.height + self.vertex / b.height;
        let plane = a.with(b).plane();
        let square = a.mean_square(&plane).max(b.mean_square(&plane));
        // A triangle that is a line has no normal: its height is zero, and the quotient infinite.
        (tilt <= self.angle + unsure && square <= self.mean_square).then_some(square)
    }
}

/// Sets that grow together.
struct Sets {
    parents: Vec<u32>,
    patches: Vec<Patch>,
}

impl Sets {
    fn find(&mut self, mut k: u32) -> u32 {
        while self.parents[k as usize] != k {
            let parent = self.parents[k as usize];
            self.parents[k as usize] = self.parents[parent as usize];
            k = self.parents[k as usize];
        }
        k
    }

    /// Unites neighbours as long as any fit.
    fn unite(&mut self, survey: &Survey, limits: &Limits) {
        let mut edges: Vec<u32> = (0..survey.twins.len() as u32)
            .filter(|&half| survey.twins[half as usize] > half && survey.twins[half as usize] != NONE)
            .collect();
        for _ in 0..ROUNDS {
            let mut ranked = Vec::with_capacity(edges.len());
            edges.retain(|&half| {
                let [a, b] = self.sides(survey, half);
                if a != b {
                    let cost = limits.cost(&self.patches[a as usize], &self.patches[b as usize]);
                    ranked.extend(cost.map(|cost| (cost, half)));
                }
                a != b
            });
            ranked.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let mut united = false;
            for (_, half) in ranked {
                let [a, b] = self.sides(survey, half);
                let [patch_a, patch_b] = [a, b].map(|k| self.patches[k as usize]);
                if a != b && limits.cost(&patch_a, &patch_b).is_some() {
                    // The root of a set is its first triangle.
                    self.parents[a.max(b) as usize] = a.min(b);
                    self.patches[a.min(b) as usize] = patch_a.with(&patch_b);
                    united = true;
                }
            }
            if !united {
                break;
            }
        }
    }

    fn sides(&mut self, survey: &Survey, half: u32) -> [u32; 2] {
        [half, survey.twins[half as usize]].map(|half| self.find(half / 3))
    }

    fn roots(&mut self) -> Vec<u32> {
        (0..self.parents.len() as u32).map(|k| self.find(k)).collect()
    }
}

/// The face that each triangle belongs to, and the planes of the faces: outward unit normal, and distance from the
/// origin, m. Faces are numbered in the order of their first triangles.
pub(super) struct Regions {
    pub(super) face_of: Vec<u32>,
    pub(super) planes: Vec<(Vector3<f64>, f64)>,
}

/// Divides a closed, oriented mesh into faces.
pub(super) fn regions(
    vertices_m: &[Vector3<f64>],
    triangles: &[[usize; 3]],
    survey: &Survey,
    flatness: &Flatness,
    diagonal_m: f64,
) -> Regions {
    let least_area = 1e-20 * diagonal_m * diagonal_m;
    let singles: Vec<Patch> =
        triangles.iter().map(|corners| Patch::of(corners.map(|k| vertices_m[k]), least_area)).collect();
    let mut sets = Sets { parents: (0..triangles.len() as u32).collect(), patches: singles.clone() };
    let limits = Limits {
        angle: flatness.angle_rad,
        mean_square: flatness.distance_m.powi(2),
        vertex: VERTEX * diagonal_m,
    };
    sets.unite(survey, &limits);
    let smooth = sets.roots();
    sets.unite(survey, &Limits { angle: ROUGH, ..limits });
    let mut rough = sets.roots();
    let is_round =
        Check { vertices_m, triangles, survey, flatness, singles: &singles }.round(&sets, &smooth, &rough);
    for (root, smooth) in rough.iter_mut().zip(&smooth) {
        if is_round[*root as usize] {
            *root = *smooth;
        }
    }

    let mut numbers = vec![NONE; triangles.len()];
    let mut patches: Vec<Patch> = Vec::new();
    let face_of = rough
        .iter()
        .zip(&singles)
        .map(|(&root, single)| {
            let number = &mut numbers[root as usize];
            if *number == NONE {
                *number = patches.len() as u32;
                patches.push(*single);
            } else {
                patches[*number as usize] = patches[*number as usize].with(single);
            }
            *number
        })
        .collect();
    Regions { face_of, planes: patches.iter().map(Patch::plane).collect() }
}

/// The data that tell noise from what is round.
struct Check<'a> {
    vertices_m: &'a [Vector3<f64>],
    triangles: &'a [[usize; 3]],
    survey: &'a Survey,
    flatness: &'a Flatness,
    singles: &'a [Patch],
}

impl Check<'_> {
    /// For each root of a patch that the second step made, whether it is none after all: it bends as a whole, or some of it
    /// is far off its plane.
    fn round(&self, sets: &Sets, smooth: &[u32], rough: &[u32]) -> Vec<bool> {
        let mut several = vec![false; rough.len()];
        for (&rough, &smooth) in rough.iter().zip(smooth) {
            several[rough as usize] |= rough != smooth;
        }
        let mut bends = vec![Bend::default(); rough.len()];
        let mut round = vec![false; rough.len()];
        for (triangle, &root) in rough.iter().enumerate().filter(|(_, root)| several[**root as usize]) {
            let plane = sets.patches[root as usize].plane();
            round[root as usize] |= self.is_off(triangle, &plane);
            for half in 3 * triangle as u32..3 * triangle as u32 + 3 {
                let twin = self.survey.twins[half as usize];
                if half < twin && rough[twin as usize / 3] == root {
                    bends[root as usize].add(self.bend(half, twin, &plane.0));
                }
            }
        }
        for (root, bend) in bends.iter().enumerate().filter(|(root, _)| several[*root]) {
            round[root] |= bend.is_systematic(sets.patches[root].area, self.flatness.angle_rad);
        }
        round
    }

    fn is_off(&self, triangle: usize, (normal, distance): &(Vector3<f64>, f64)) -> bool {
        let near = |&k: &usize| {
            (normal.dot(&self.vertices_m[k]) - distance).abs() <= FARTHEST * self.flatness.distance_m
        };
        !self.triangles[triangle].iter().all(near)
    }

    /// Angle at an edge times its length, rad m; positive where the surface is convex.
    fn bend(&self, half: u32, twin: u32, usual: &Vector3<f64>) -> f64 {
        // What has next to no height has no normal to speak of.
        let normal = |half: u32| {
            let single = &self.singles[half as usize / 3];
            if single.height > 0.01 * self.flatness.distance_m { single.plane().0 } else { *usual }
        };
        let edge = self.vertices_m[end(self.triangles, half)] - self.vertices_m[origin(self.triangles, half)];
        normal(half).cross(&normal(twin)).dot(&edge)
    }
}

/// The bends at the edges inside a patch.
#[derive(Clone, Copy, Debug, Default)]
struct Bend {
    edges: usize,
    sum: f64,
    /// Sum of the squares.
    squares: f64,
}

impl Bend {
    fn add(&mut self, bend: f64) {
        self.edges += 1;
        self.sum += bend;
        self.squares += bend * bend;
    }

    /// Returns `true` if the patch bends from side to side by more than an angle, and not by chance. Of bends of one
    /// sign, the sum is larger than the root of the sum of squares; with noise, what is added at one edge of a triangle
    /// is taken away at the others, and it is much smaller.
    fn is_systematic(&self, area_m2: f64, angle_rad: f64) -> bool {
        let by_chance = self.edges >= MANY && self.sum * self.sum < 0.5 * self.squares;
        self.sum.abs() > angle_rad * area_m2.square_root() && !by_chance
    }
}
