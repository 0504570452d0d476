//! Random convex polyhedra, and scenes in which the paper's hand grasps them.

use crate::random::Draw;
use blindgrasp::plant::polyhedron::Polyhedron;
use blindgrasp::scene::Scene;
use blindgrasp::scene::file::{ContactFile, ObjectFile, SceneFile, ShapeFile};
use nalgebra::Vector3;

/// Tangential over normal force that a grasp may ask for at its start, to count as graspable.
const GRASPABLE: f64 = 0.5;

/// Corners of a random convex polyhedron, m: points on an ellipsoid with half-axes of 16 to 34 mm. The hull may leave
/// some out.
pub fn corners(draw: &mut Draw) -> Vec<[f64; 3]> {
    let axes: [f64; 3] = std::array::from_fn(|_| draw.within(0.016, 0.034));
    let count = draw.count(5..=13);
    (0..count)
        .map(|_| {
            let direction = draw.unit();
            std::array::from_fn(|k| axes[k] * direction[k])
        })
        .collect()
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
pub fn grasp(like: &SceneFile, corners_m: Vec<[f64; 3]>) -> Option<Scene> {
    let points: Vec<Vector3<f64>> = corners_m.iter().map(|&p| p.into()).collect();
    let shape = Polyhedron::hull(&points).ok()?;
    let radius_m = like.hand.fingertips[0].radius_m;
    let count = shape.faces.len();
    let triples = (0..count * count * count).map(|n| [n / count / count, n / count % count, n % count]);
    let mut rated: Vec<(f64, [usize; 3])> = triples
        .map(|faces| (rate(&shape, faces, radius_m), faces))
        .filter(|(ratio, _)| *ratio < GRASPABLE)
        .collect();
    rated.sort_by(|a, b| a.0.total_cmp(&b.0));
    rated.into_iter().take(60).find_map(|(_, faces)| {
        Scene::build(SceneFile {
            object: ObjectFile {
                name: "polyhedron".to_owned(),
                mass_kg: None,
                // Styrene foam, like the paper's objects (2.1 g in a cube of 48 mm).
                density_kg_m3: Some(19.0),
                shape: ShapeFile::Hull { points_m: corners_m.clone() },
                ..like.object.clone()
            },
            contacts: faces.map(|face| ContactFile { face: Some(face), point_m: None }).to_vec(),
            ..like.clone()
        })
        .ok()
    })
}
