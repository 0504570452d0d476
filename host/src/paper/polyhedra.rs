//! The paper's title: an *arbitrary* polyhedral object. Random convex polyhedra in the paper's own model, with and without
//! `u_st`.

use super::evidence::{EvidenceError, simulation};
use crate::plant::polyhedron::Polyhedron;
use crate::scene::file::{ContactFile, ObjectFile, SceneFile, ShapeFile};
use crate::scene::{Scene, SceneError};
use crate::sim::summary::Summary;
use blindgrasp_shared::math::Real;
use fastrand::Rng;
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::PI;

/// Tangential over normal force that a grasp may ask for at its start, to count as graspable.
const GRASPABLE: f64 = 0.5;
/// Half-axes of the ellipsoid that the corners lie on, m.
const HALF_AXES_M: [f64; 2] = [0.016, 0.034];
/// Of styrene foam, like the paper's objects (2.1 g in a cube of 48 mm), kg/m^3.
const DENSITY_KG_M3: f64 = 19.0;
/// Triples of faces that are tried, the best first.
const TRIPLES: usize = 60;
/// A polyhedron that can be grasped turns up within so many.
const MOST_TRIES: usize = 50;

/// What became of the polyhedra.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Polyhedra {
    /// How many had to be drawn to find so many that can be grasped.
    pub drawn: usize,
    /// How long each was grasped, s.
    pub duration_s: f64,
    /// One a polyhedron.
    pub outcomes: Vec<Outcome>,
}

/// What became of one polyhedron: why it was lost, if it was.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Outcome {
    /// With `u_st`.
    pub with: Option<String>,
    /// Without.
    pub without: Option<String>,
}

impl Polyhedra {
    /// Share that was held, with `u_st` and without.
    pub fn held(&self) -> [f64; 2] {
        let share = |lost: fn(&Outcome) -> bool| {
            self.outcomes.iter().filter(|outcome| !lost(outcome)).count() as f64 / self.outcomes.len() as f64
        };
        [share(|outcome| outcome.with.is_some()), share(|outcome| outcome.without.is_some())]
    }
}

/// Grasps so many random polyhedra; `told` is called after each, from any thread.
///
/// # Errors
/// A built-in scene or a run that can't be done.
pub fn grasped(count: usize, seed: u64, told: &(dyn Fn(&str) + Sync)) -> Result<Polyhedra, EvidenceError> {
    const RUN: &str = "polyhedra";
    let bad = |cause: SceneError| EvidenceError::Scene { run: RUN.to_owned(), cause };
    let like = Scene::load("cube-ideal", &["duration_s=5.0".to_owned()]).map_err(bad)?.file;
    let mut rng = Rng::with_seed(seed);
    let (mut drawn, mut scenes) = (0, Vec::new());
    while scenes.len() < count && drawn < MOST_TRIES * count {
        drawn += 1;
        scenes.extend(grasp(&like, corners(&mut rng)));
    }
    let lost = |scene: &Scene| -> Result<Option<String>, EvidenceError> {
        let Summary { lost_reason, .. } = simulation(RUN, scene)?.run(|_| {}).summary;
        Ok(lost_reason)
    };
    let one = |scene: &Scene| -> Result<Outcome, EvidenceError> {
        let mut file = scene.file.clone();
        file.control.attitude_stiffness_nm = 0.0;
        let outcome = Outcome { with: lost(scene)?, without: lost(&Scene::build(file).map_err(bad)?)? };
        told(RUN);
        Ok(outcome)
    };
    let outcomes = scenes.par_iter().with_max_len(1).map(one).collect::<Result<Vec<_>, _>>()?;
    Ok(Polyhedra { drawn, duration_s: like.duration_s, outcomes })
}

/// Corners of a random convex polyhedron, m: points on an ellipsoid. The hull may leave some out.
fn corners(rng: &mut Rng) -> Vec<[f64; 3]> {
    let [low, high] = HALF_AXES_M;
    let axes: [f64; 3] = std::array::from_fn(|_| within(rng, low, high));
    let count = rng.usize(5..=13);
    (0..count)
        .map(|_| {
            let direction = unit(rng);
            std::array::from_fn(|k| axes[k] * direction[k])
        })
        .collect()
}

fn within(rng: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.f64()
}

/// A unit vector, evenly spread over the sphere.
fn unit(rng: &mut Rng) -> Vector3<f64> {
    let z = within(rng, -1.0, 1.0);
    let (sine, cosine) = within(rng, -PI, PI).sine_cosine();
    let radius = (1.0 - z * z).square_root();
    Vector3::new(radius * cosine, radius * sine, z).normalize()
}

/// Three faces, one a finger, and how far from their normals the law would push the fingertips at the start: the largest
/// ratio of tangential to normal force in the middle of each.
fn rate(shape: &Polyhedron, faces: [usize; 3], radius_m: f64) -> f64 {
    let centres = faces.map(|face| shape.face_centre_m(face) + shape.faces[face].normal * radius_m);
    let centroid = centres.iter().sum::<Vector3<f64>>() / 3.0;
    let ratios = faces.iter().zip(&centres).map(|(&face, centre)| {
        let (pull, normal) = (centroid - centre, -shape.faces[face].normal);
        let pressed = pull.dot(&normal);
        if pressed > 0.0 { (pull - normal * pressed).norm() / pressed } else { f64::INFINITY }
    });
    ratios.fold(0.0, f64::max)
}

/// A scene that grasps a polyhedron: of all triples of faces, the one that the hand can reach and that asks for the least
/// friction. `None` if no triple is graspable.
fn grasp(like: &SceneFile, corners_m: Vec<[f64; 3]>) -> Option<Scene> {
    let points: Vec<Vector3<f64>> = corners_m.iter().map(|&p| p.into()).collect();
    let shape = Polyhedron::hull(&points).ok()?;
    let radius_m = like.hand.fingertips.first()?.radius_m;
    let count = shape.faces.len();
    let triples = (0..count * count * count).map(|n| [n / count / count, n / count % count, n % count]);
    let mut rated: Vec<(f64, [usize; 3])> = triples
        .map(|faces| (rate(&shape, faces, radius_m), faces))
        .filter(|(ratio, _)| *ratio < GRASPABLE)
        .collect();
    rated.sort_by(|a, b| a.0.total_cmp(&b.0));
    rated.into_iter().take(TRIPLES).find_map(|(_, faces)| {
        Scene::build(SceneFile {
            object: ObjectFile {
                name: "polyhedron".to_owned(),
                mass_kg: None,
                density_kg_m3: Some(DENSITY_KG_M3),
                shape: ShapeFile::Hull { points_m: corners_m.clone() },
                ..like.object.clone()
            },
            contacts: faces.map(|face| ContactFile { face: Some(face), point_m: None }).to_vec(),
            ..like.clone()
        })
        .ok()
    })
}
