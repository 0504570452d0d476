//! Repairs, with their notices, and refusals, with their places.

use super::*;
use blindgrasp_meshes::{Numbers, grid_box};

/// The bracket after a change to its triangles.
fn changed(change: impl FnOnce(&mut Mesh)) -> Result<Repaired, Problem> {
    let mut mesh = bracket();
    change(&mut mesh);
    read("b.stl", &binary(&mesh))
}

/// It is the bracket again, and this was said.
fn assert_repaired(repaired: &Repaired, notices: &[&str]) {
    assert_eq!(repaired.notices, notices);
    let (found, expected) = (polyhedron(repaired), polyhedron(&changed(|_| {}).unwrap()));
    assert_eq!(found.faces.len(), expected.faces.len());
    for (face, like) in found.faces.iter().zip(&expected.faces) {
        // Cracks are closed within 1e-4 of the diagonal.
        assert!((face.normal - like.normal).norm() < 1e-3, "{} {}", face.normal, like.normal);
        assert!((face.distance_m - like.distance_m).abs() < 1e-5);
    }
}

fn refused(result: Result<Repaired, Problem>) -> String {
    result.expect_err("has to be refused").what
}

#[test]
fn vertices_that_are_nearly_the_same_are_welded() {
    // Corners of single triangles, off by a rounding.
    let repaired = changed(|(vertices, triangles)| {
        for k in [3, 9, 17] {
            vertices.push(vertices[triangles[k][0]] + Vector3::repeat(3e-8));
            triangles[k][0] = vertices.len() - 1;
        }
    });
    assert_repaired(&repaired.unwrap(), &["3 vertices within 7.8e-5 mm of another welded to it"]);
}

#[test]
fn triangles_without_area_and_those_that_are_twice_there_are_left_out() {
    let repaired = changed(|(_, triangles)| {
        triangles.insert(2, [5, 5, 3]);
        triangles.insert(7, triangles[4]);
        triangles.push([triangles[4][1], triangles[4][0], triangles[4][2]]);
    });
    assert_repaired(
        &repaired.unwrap(),
        &[
            "1 triangle without area left out, the first number 3",
            "2 triangles that are there twice left out, the first number 8",
        ],
    );
}

#[test]
fn triangles_that_show_their_inside_are_turned_over() {
    let repaired = changed(|(_, triangles)| {
        for k in [0, 7, 11] {
            triangles[k].swap(0, 1);
        }
    });
    assert_repaired(
        &repaired.unwrap(),
        &["3 triangles that showed their inside turned over, the first number 1"],
    );
    let repaired = changed(|(_, triangles)| triangles.iter_mut().for_each(|corners| corners.swap(0, 2)));
    assert_repaired(&repaired.unwrap(), &["it was inside out: all triangles turned over"]);
    // All but three.
    let repaired = changed(|(_, triangles)| triangles[3..].iter_mut().for_each(|corners| corners.swap(0, 2)));
    assert_repaired(
        &repaired.unwrap(),
        &["17 triangles that showed their inside turned over, the first number 4"],
    );
}

#[test]
fn cracks_are_closed() {
    // One side stands two micrometres off all others.
    let repaired = changed(|(vertices, triangles)| {
        let mut own = std::collections::HashMap::new();
        for corner in triangles[10..12].iter_mut().flatten() {
            *corner = *own.entry(*corner).or_insert_with(|| {
                vertices.push(vertices[*corner] + Vector3::new(2e-6, 0.0, 1e-6));
                vertices.len() - 1
            });
        }
    });
    assert_repaired(&repaired.unwrap(), &["8 open edges closed: cracks of up to 7.8e-3 mm"]);
}

#[test]
fn edges_that_end_in_the_middle_of_another_are_joined() {
    // The long side is cut in two on its own: the lids know nothing of the two new vertices.
    let repaired = changed(|(vertices, triangles)| {
        vertices.extend([Vector3::new(0.03, 0.0, 0.0), Vector3::new(0.03, 0.0, 0.03)]);
        triangles.splice(8..10, [[0, 12, 13], [0, 13, 6], [12, 1, 7], [12, 7, 13]]);
    });
    assert_repaired(
        &repaired.unwrap(),
        &[
            "6 open edges closed: cracks of up to 7.8e-3 mm",
            "2 triangles cut at vertices of a neighbour in the middle of an edge",
        ],
    );
}

#[test]
fn slivers_belong_to_the_face_beside_them() {
    // A vertex in the middle of an edge on one side, and a triangle of no height on the other.
    let repaired = changed(|(vertices, triangles)| {
        vertices.push(Vector3::new(0.03, 1e-9, 0.0));
        triangles.splice(8..10, [[0, 12, 7], [12, 1, 7], [0, 7, 6], [0, 1, 12]]);
    });
    let repaired = repaired.unwrap();
    assert_eq!(repaired.triangles.len(), 22);
    assert_repaired(&repaired, &[]);
}

#[test]
fn holes_are_refused_with_their_place() {
    assert_eq!(
        refused(changed(|(_, triangles)| {
            triangles.remove(8);
        })),
        "it is not closed: 3 open edges, the first at triangle 1 from (60, 0, 0) to (0, 0, 0) mm"
    );
    // Numbers are those of the file, before anything is left out.
    assert_eq!(
        refused(changed(|(_, triangles)| {
            triangles[8] = [3, 3, 3];
            triangles.insert(0, [2, 2, 2]);
        })),
        "it is not closed: 3 open edges, the first at triangle 2 from (60, 0, 0) to (0, 0, 0) mm"
    );
    let (mut vertices, mut triangles) = grid_box([0.05; 3], 20);
    triangles.retain(|corners| corners.iter().all(|&k| vertices[k].z < 0.02));
    vertices.iter_mut().for_each(|v| v.z += 0.025);
    assert_eq!(
        refused(read("b.stl", &binary(&(vertices, triangles)))),
        "it is not closed: 80 open edges, the first at triangle 34 from (-25, -25, 42.5) to (-25, -22.5, 42.5) mm"
    );
}

#[test]
fn what_is_no_single_body_is_refused_with_its_place() {
    // A second bracket beside the first, and one that shares an edge with it.
    let beside = |shift: Vector3<f64>| {
        changed(move |(vertices, triangles)| {
            let count = vertices.len();
            let more: Vec<_> = vertices.iter().map(|v| v + shift).collect();
            vertices.extend(more);
            let more: Vec<_> = triangles.iter().map(|corners| corners.map(|k| k + count)).collect();
            triangles.extend(more);
        })
    };
    assert_eq!(
        refused(beside(Vector3::new(0.1, 0.0, 0.0))),
        "it is in 2 parts: triangle 1 belongs to one, triangle 21 at (100, 0, 0) mm to another"
    );
    assert_eq!(
        refused(beside(Vector3::new(0.06, 0.02, 0.0))),
        "1 edge belongs to more than two triangles, the first to triangles 11, 14 and 30, from (60, 20, 0) to (60, 20, 30) mm"
    );
    // A hollow.
    let hollow = changed(|(vertices, triangles)| {
        let count = vertices.len();
        let (inner, inside) = grid_box([0.01; 3], 1);
        vertices.extend(inner.iter().map(|v| v + Vector3::repeat(0.01)));
        triangles.extend(inside.iter().map(|corners| corners.map(|k| k + count)));
    });
    assert_eq!(
        refused(hollow),
        "it is in 2 parts: triangle 1 belongs to one, triangle 21 at (5, 5, 5) mm to another"
    );
}

/// A strip glued to itself with half a turn, doubled to have no rim: a Klein bottle in three dimensions cuts through itself, but
/// its triangles are right.
#[test]
fn one_sided_surfaces_are_refused() {
    const AROUND: usize = 24;
    const ACROSS: usize = 8;
    let mut vertices = Vec::new();
    for i in 0..AROUND {
        let u = i as f64 / AROUND as f64 * std::f64::consts::TAU;
        for j in 0..ACROSS {
            // Not where the figure of eight crosses itself.
            let v = (j as f64 + 0.5) / ACROSS as f64 * std::f64::consts::TAU;
            use blindgrasp_shared::math::Real;
            let ((su, cu), (sh, ch)) = (u.sine_cosine(), (u / 2.0).sine_cosine());
            let ((sv, _), (s2v, _)) = (v.sine_cosine(), (2.0 * v).sine_cosine());
            let r = 0.03 + 0.01 * (ch * sv - sh * s2v);
            vertices.push(Vector3::new(r * cu, r * su, 0.01 * (sh * sv + ch * s2v)));
        }
    }
    let at = |i: usize, j: usize| {
        // Around once, what was up is down.
        let j = if i == AROUND { ACROSS - 1 - j % ACROSS } else { j % ACROSS };
        i % AROUND * ACROSS + j
    };
    let mut triangles = Vec::new();
    for i in 0..AROUND {
        for j in 0..ACROSS {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let message = refused(read("k.obj", &wavefront(&(vertices, triangles))));
    assert!(message.starts_with("its surface has only one side: going around it, triangle "), "{message}");
}

/// Welded or not, turned or not, in any order and anywhere: the same faces.
#[test]
fn random_hulls_come_back_from_a_file() {
    let mut numbers = Numbers(50);
    for round in 0..100 {
        let count = 4 + numbers.below(27);
        let points: Vec<_> = (0..count).map(|_| numbers.vector().normalize() * 0.03).collect();
        let hull = Polyhedron::hull(&points).unwrap();
        let (turn, shift) = (numbers.rotation(), numbers.vector() * 0.1);
        let mut mesh: Mesh = (Vec::new(), Vec::new());
        for corners in hull.faces.iter().flat_map(|face| &face.triangles) {
            // Each triangle with vertices of its own, off by less than what is welded.
            let noise = 2e-8 * f64::from(round % 2);
            let first = mesh.0.len();
            mesh.0.extend(corners.map(|k| turn * hull.vertices_m[k] + shift + numbers.vector() * noise));
            let swap = numbers.below(4) == 0;
            mesh.1.push(if swap { [first, first + 2, first + 1] } else { [first, first + 1, first + 2] });
        }
        numbers.shuffle(&mut mesh.1);
        let repaired = read("h.stl", &binary(&mesh)).unwrap();
        // Points on a ball make triangles, some of which are nearly in one plane.
        let exact = Flatness { angle_rad: 0.0, distance_m: 0.0 };
        let body = Polyhedron::mesh(&repaired.vertices, &repaired.triangles, &exact).unwrap();
        assert_eq!(body.faces.len(), hull.faces.len());
        for (k, face) in hull.faces.iter().enumerate() {
            // Coordinates of a decimetre are rounded at 4 nm in an STL, and noise is 20 nm: what is wider than a millimetre
            // tilts by less than a thousandth, also with a needle that it takes in.
            if hull.widest_circle_m(k).1 > 5e-4 {
                let normal = turn * face.normal;
                let is_same = |found: &&blindgrasp_body::polyhedron::Face| {
                    (found.normal - normal).norm() < 1e-3 && (found.distance_m - face.distance_m).abs() < 1e-6
                };
                assert!(body.faces.iter().any(|found| is_same(&found)), "round {round} face {k}");
            }
        }
        let (found, expected) = (body.mass_properties(), hull.mass_properties());
        // Surface times 20 nm over the volume.
        assert!((found.volume_m3 / expected.volume_m3 - 1.0).abs() < 1e-4);
        let inertia = turn * expected.inertia_per_kg_m2 * turn.transpose();
        assert!((found.inertia_per_kg_m2 - inertia).amax() < 1e-4 * inertia.amax());
    }
}
