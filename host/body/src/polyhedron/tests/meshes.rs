//! Bodies from triangles: faces, outlines, refusals.

use super::*;
use blindgrasp_meshes::{Mesh, bracket, grid_box, icosphere, plate};

/// Returns the tolerances of a file that does not have them: two degrees, and a thousandth of the diagonal.
fn usual(vertices: &[Vector3<f64>]) -> Flatness {
    Flatness { angle_rad: 2f64.to_radians(), distance_m: 1e-3 * diagonal_m(vertices) }
}

/// Rounding alone.
fn strict() -> Flatness {
    Flatness { angle_rad: 1e-6, distance_m: 1e-9 }
}

pub(super) fn body((vertices, triangles): &Mesh) -> Polyhedron {
    Polyhedron::mesh(vertices, triangles, &usual(vertices)).unwrap()
}

fn with_noise((mut vertices, triangles): Mesh, share: f64, seed: u64) -> Mesh {
    let mut numbers = Numbers(seed);
    let noise = share * diagonal_m(&vertices);
    for vertex in &mut vertices {
        *vertex += numbers.vector() * noise;
    }
    (vertices, triangles)
}

#[test]
fn twelve_triangles_of_a_cube_make_six_faces_in_the_order_of_the_triangles() {
    let size = [0.04, 0.05, 0.06];
    let body = body(&grid_box(size, 1));
    let same = Polyhedron::cuboid(size).unwrap();
    assert_eq!(body.faces.len(), 6);
    for (face, like) in body.faces.iter().zip(&same.faces) {
        assert_eq!(face.normal, like.normal);
        assert_close(face.distance_m, like.distance_m, 1e-15);
        assert_eq!((face.corners.len(), face.holes.len(), face.triangles.len()), (4, 0, 2));
        assert!(face.is_convex());
    }
    assert_sound(&body);
}

/// Noise of up to a thousandth of the diagonal in each coordinate, on coarse meshes and on fine ones: twelve to 12,288
/// triangles, whose normals are off by up to a degree and by up to twenty.
#[test]
fn a_cube_with_noise_has_six_faces() {
    for (seed, squares) in [1, 2, 3, 5, 8, 12, 16, 24, 32].into_iter().enumerate() {
        let (vertices, triangles) = with_noise(grid_box([0.1; 3], squares), 1e-3, seed as u64);
        let body = Polyhedron::mesh(&vertices, &triangles, &usual(&vertices)).unwrap();
        assert_eq!(body.faces.len(), 6, "{squares} squares");
        let shift = vertices[0] - body.vertices_m[0];
        for (k, face) in body.faces.iter().enumerate() {
            let mut axis = Vector3::zeros();
            axis[k / 2] = if k % 2 == 0 { -1.0 } else { 1.0 };
            // At worst, on twelve triangles, one side of a face is up by the noise, and the other down.
            let noise = 1e-3 * diagonal_m(&vertices);
            assert!((face.normal - axis).norm() < 4.0 * noise / 0.1, "{squares} squares: {}", face.normal);
            assert!((face.distance_m + face.normal.dot(&shift) - 0.05).abs() < 2.0 * noise);
            let (_, radius) = body.widest_circle_m(k);
            assert!((radius - 0.05).abs() < 4.0 * noise, "{radius}");
        }
    }
}

#[test]
fn a_ball_keeps_its_facets() {
    for (cuts, facets) in [(0, 20), (1, 80), (2, 320), (3, 1280)] {
        assert_eq!(body(&icosphere(0.05, cuts)).faces.len(), facets);
        // Noise does not unite them either.
        let noisy = body(&with_noise(icosphere(0.05, cuts), 1e-4, 3));
        assert!(noisy.faces.len() > facets * 9 / 10, "{}", noisy.faces.len());
    }
    // Facets that tilt by less than the tolerance may be one; nothing grows beyond that.
    for cuts in [4, 5] {
        let body = body(&icosphere(0.05, cuts));
        assert!(body.faces.len() > 2000, "{}", body.faces.len());
        for face in &body.faces {
            let off = |&k: &usize| (face.normal.dot(&body.vertices_m[k]) - face.distance_m).abs();
            assert!(face.corners.iter().map(off).fold(0.0, f64::max) < 2e-4);
        }
    }
}

/// A slab with round ends: its flats are tangent to them.
#[test]
fn flats_beside_something_round_stay_what_they_are() {
    // The outline of a slab of 60 x 20 mm with ends of half a circle, in steps of six degrees.
    let mut outline: Vec<[f64; 2]> = Vec::new();
    for (x, start) in [(0.02, -90.0_f64), (-0.02, 90.0)] {
        for k in 0..=30 {
            let (sine, cosine) = (start + 6.0 * f64::from(k)).to_radians().sine_cosine();
            outline.push([x + 0.01 * cosine, 0.01 * sine]);
        }
    }
    let prism = Polyhedron::prism(&outline[..], 0.03).unwrap();
    let triangles: Vec<[usize; 3]> = prism.faces.iter().flat_map(|face| face.triangles.clone()).collect();
    let body = Polyhedron::mesh(&prism.vertices_m, &triangles, &usual(&prism.vertices_m)).unwrap();
    assert_eq!(body.faces.len(), prism.faces.len());
    for (face, like) in body.faces.iter().zip(&prism.faces) {
        assert!((face.normal - like.normal).norm() < 1e-12);
        assert_close(face.distance_m, like.distance_m, 1e-12);
    }
}

#[test]
fn an_l_has_eight_faces_two_of_them_with_a_notch() {
    let body = body(&bracket());
    let turns: Vec<bool> = body.faces.iter().map(Face::is_convex).collect();
    assert_eq!(turns, [false, false, true, true, true, true, true, true]);
    let corners: Vec<usize> = body.faces.iter().map(|face| face.corners.len()).collect();
    assert_eq!(corners, [6, 6, 4, 4, 4, 4, 4, 4]);
    // The centre of mass of 60 x 20 and 20 x 20: at 25 and 15 mm; the inner sides look past it and at it.
    let distances = [15.0, 15.0, 15.0, 35.0, 5.0, -5.0, 25.0, 25.0];
    for (face, distance) in body.faces.iter().zip(distances) {
        assert!((face.distance_m - distance * 1e-3).abs() < 1e-15, "{face:?}");
    }
    // Corner 3 of the bottom is the inner one.
    let top = 1;
    for (x, y, margin) in [
        (50.0, 10.0, 10.0),
        (10.0, 35.0, 5.0),
        (23.0, 24.0, -3.0),
        (10.0, 10.0, 10.0),
        (17.0, 16.0, 5.0),
        (16.0, 17.0, 5.0),
        (20.0, 20.0, 0.0),
        (63.0, 24.0, -5.0),
        (-3.0, -4.0, -5.0),
        (63.0, 10.0, -3.0),
        (40.0, 45.0, -20.615_528_128_088_304),
    ] {
        let point = Vector3::new(x - 25.0, y - 15.0, 99.0) * 1e-3;
        let found = body.margin_m(top, &point) * 1e3;
        assert!((found - margin).abs() < 1e-12, "({x}, {y}): {found} {margin}");
    }
    // The widest circle touches two sides and the inner corner: its centre is on the diagonal, at c with
    // c = (20 - c) sqrt(2).
    let radius = 20.0 * 2f64.square_root() / (1.0 + 2f64.square_root());
    let (centre, found) = body.widest_circle_m(top);
    assert!((found * 1e3 - radius).abs() < 2e-3 * radius, "{found} {radius}");
    assert!((body.margin_m(top, &centre) - found).abs() < 1e-15);
    assert_eq!(body.face_centre_m(top), centre);
    assert!((centre.z - 0.015).abs() < 1e-15);
}

#[test]
fn a_plate_with_a_hole_has_two_faces_with_a_hole() {
    let body = body(&plate());
    assert_eq!(body.faces.len(), 10);
    for (k, face) in body.faces.iter().enumerate() {
        assert_eq!(face.holes.iter().map(Vec::len).collect::<Vec<_>>(), if k < 2 { vec![4] } else { vec![] });
        assert_eq!((face.corners.len(), face.is_convex()), (4, k >= 2));
        // Outlines run counter-clockwise, holes clockwise, about the normal.
        for (place, outline) in face.outlines().enumerate() {
            let first = body.vertices_m[outline[0]];
            let twice = outline.windows(2).fold(0.0, |sum, pair| {
                let [a, b] = [pair[0], pair[1]].map(|k| body.vertices_m[k] - first);
                sum + a.cross(&b).dot(&face.normal)
            });
            assert_eq!(twice > 0.0, place == 0);
        }
    }
    assert_close(body.face_area_m2(0), 60e-3 * 40e-3 - 20e-3 * 20e-3, 1e-14);
    let margin = |x: f64, y: f64| body.margin_m(1, &Vector3::new(x, y, 7.0).map(|v| v * 1e-3)) * 1e3;
    for (x, y, expected) in
        [(0.0, 0.0, -10.0), (12.0, 0.0, 2.0), (20.0, 0.0, 10.0), (28.0, 0.0, 2.0), (13.0, 14.0, 5.0)]
    {
        assert!((margin(x, y) - expected).abs() < 1e-12, "{} {expected}", margin(x, y));
    }
    // The middle of the face is in no hole.
    assert!(body.margin_m(0, &body.face_centre_m(0)) > 0.0099);
}

/// Random hulls as meshes of their triangles, in any order, turned and shifted: the same faces, masses and margins.
#[test]
fn random_hulls_come_back_from_their_triangles() {
    let mut numbers = Numbers(7);
    for round in 0..200 {
        let count = 4 + numbers.below(27);
        let points: Vec<_> = (0..count).map(|_| numbers.vector().normalize() * 0.03).collect();
        let hull = match round % 4 {
            // Faces of more than three corners as well.
            0 => Polyhedron::regular_prism(3 + numbers.below(20), 0.01, 0.03).unwrap(),
            1 => Polyhedron::regular_pyramid(3 + numbers.below(20), 0.01, 0.03).unwrap(),
            _ => Polyhedron::hull(&points).unwrap(),
        };
        let (turn, shift) = (numbers.rotation(), numbers.vector());
        let mut order: Vec<usize> = (0..hull.vertices_m.len()).collect();
        numbers.shuffle(&mut order);
        let mut vertices = vec![Vector3::zeros(); order.len()];
        for (vertex, &place) in hull.vertices_m.iter().zip(&order) {
            vertices[place] = turn * vertex + shift;
        }
        let mut triangles: Vec<[usize; 3]> = Vec::new();
        for face in &hull.faces {
            for corners in &face.triangles {
                let mut corners = corners.map(|k| order[k]);
                corners.rotate_left(numbers.below(3));
                triangles.push(corners);
            }
        }
        numbers.shuffle(&mut triangles);
        let body = Polyhedron::mesh(&vertices, &triangles, &strict()).unwrap();
        assert_eq!(body.faces.len(), hull.faces.len());
        let expected = turn * hull.mass_properties().inertia_per_kg_m2 * turn.transpose();
        // A metre off, coordinates of centimetres are rounded at 1e-14 of their size.
        let inertia = body.mass_properties().inertia_per_kg_m2;
        assert!((inertia - expected).amax() < 1e-12 * expected.amax());
        for (k, face) in hull.faces.iter().enumerate() {
            let normal = turn * face.normal;
            let same = (0..body.faces.len())
                .max_by(|&a, &b| {
                    body.faces[a].normal.dot(&normal).total_cmp(&body.faces[b].normal.dot(&normal))
                })
                .unwrap();
            let found = &body.faces[same];
            assert!((found.normal - normal).norm() < 1e-10, "{}", (found.normal - normal).norm());
            assert!((found.distance_m - face.distance_m).abs() < 1e-13);
            let mut corners: Vec<usize> = face.corners.iter().map(|&k| order[k]).collect();
            let start = corners.iter().position(|k| *k == found.corners[0]).unwrap();
            corners.rotate_left(start);
            // Vertices keep their order where all of them are used.
            assert_eq!(corners, found.corners);
            for _ in 0..5 {
                let point = hull.face_centre_m(k) + numbers.vector() * 0.01;
                let margins = [hull.margin_m(k, &point), body.margin_m(same, &(turn * point))];
                assert!((margins[0] - margins[1]).abs() < 1e-12, "{margins:?}");
            }
        }
    }
}

#[test]
fn faces_and_outlines_fit_together_under_any_noise() {
    let mut numbers = Numbers(8);
    let samples = [grid_box([0.05, 0.04, 0.03], 6), bracket(), plate(), icosphere(0.03, 3)];
    for round in 0..120 {
        let noise = 10f64.powf(-6.0 + 4.0 * numbers.unit());
        let mesh = with_noise(samples[round % 4].clone(), noise, round as u64);
        let flatness =
            Flatness { angle_rad: 0.3 * numbers.unit().powi(3), distance_m: 1e-3 * numbers.unit().powi(3) };
        let Ok(body) = Polyhedron::mesh(&mesh.0, &mesh.1, &flatness) else { continue };
        assert_eq!(body.faces.iter().map(|face| face.triangles.len()).sum::<usize>(), mesh.1.len());
        let mut edges: Vec<(usize, usize)> = body.faces.iter().flat_map(Face::edges).collect();
        edges.sort_unstable();
        let count = edges.len();
        edges.dedup();
        assert_eq!(edges.len(), count, "an edge belongs to two outlines");
        assert!(edges.iter().all(|&(a, b)| edges.binary_search(&(b, a)).is_ok()), "outlines do not fit");
        for k in 0..body.faces.len() {
            assert_close(body.faces[k].normal.norm(), 1.0, 1e-12);
            assert!(body.face_area_m2(k) > 0.0);
            assert!(body.face_centre_m(k).iter().all(|v| v.is_finite()));
        }
    }
}

#[test]
fn what_encloses_no_body_is_refused() {
    let (vertices, triangles) = bracket();
    let message = |vertices: &[Vector3<f64>], triangles: &[[usize; 3]]| {
        Polyhedron::mesh(vertices, triangles, &strict()).unwrap_err().to_string()
    };
    let changed = |change: &dyn Fn(&mut Vec<[usize; 3]>)| {
        let mut triangles = triangles.clone();
        change(&mut triangles);
        message(&vertices, &triangles)
    };
    assert_eq!(changed(&|t| t.clear()), "it has no triangles");
    assert_eq!(
        changed(&|t| {
            t.remove(8);
        }),
        "it is not closed: 3 open edges, the first at triangle 1 from (60, 0, 0) to (0, 0, 0) mm"
    );
    assert_eq!(
        changed(&|t| t.push([0, 2, 8])),
        "2 edges belong to more than two triangles, the first to triangles 1, 2 and 21, from (0, 0, 0) to (60, 20, 0) mm"
    );
    assert_eq!(changed(&|t| t[5].swap(0, 1)), "triangles 5 and 6 are turned against each other");
    assert_eq!(
        changed(&|t| t.iter_mut().for_each(|corners| corners.swap(0, 1))),
        "it is inside out: its triangles are clockwise seen from outside"
    );
    assert_eq!(
        changed(&|t| t[2][0] = 99),
        "triangle 3 needs three different vertices of the 12 that there are"
    );
    assert_eq!(
        changed(&|t| t[2][0] = t[2][1]),
        "triangle 3 needs three different vertices of the 12 that there are"
    );
    let mut two = (vertices.clone(), triangles.clone());
    two.0.extend(vertices.iter().map(|v| v + Vector3::x()));
    two.1.extend(triangles.iter().map(|corners| corners.map(|k| k + 12)));
    assert_eq!(
        message(&two.0, &two.1),
        "it is in 2 parts: triangle 1 belongs to one, triangle 21 at (1000, 0, 0) mm to another"
    );
    let flat: Vec<_> = vertices.iter().map(|v| Vector3::new(v.x, v.y, 0.0)).collect();
    assert_eq!(message(&flat, &triangles), "it encloses no volume");
    let mut far = vertices.clone();
    far[4].x = f64::NAN;
    assert_eq!(message(&far, &triangles), "vertex 5 is out of range");
    far[4].x = 1e7;
    assert_eq!(message(&far, &triangles), "vertex 5 is out of range");
    let many = vec![[0, 1, 2]; MAX_TRIANGLES + 1];
    assert_eq!(message(&vertices, &many), "200001 triangles are too many: at most 200000");
}

#[test]
fn damaged_meshes_never_panic() {
    let mut numbers = Numbers(9);
    for round in 0..2000 {
        let (mut vertices, mut triangles) = if round % 2 == 0 { bracket() } else { icosphere(0.03, 1) };
        for _ in 0..=numbers.below(3) {
            let (triangle, corner) = (numbers.below(triangles.len()), numbers.below(3));
            let vertex = numbers.below(vertices.len());
            match numbers.below(6) {
                0 => triangles[triangle][corner] = numbers.below(vertices.len() + 1),
                1 => triangles[triangle].swap(0, 1),
                2 => {
                    triangles.swap_remove(triangle);
                }
                3 => triangles.push(triangles[triangle]),
                4 => vertices[vertex] = vertices[numbers.below(vertices.len())],
                _ => vertices[vertex] *= [f64::NAN, 1e300, 1e-300, 0.0][numbers.below(4)],
            }
        }
        match Polyhedron::mesh(&vertices, &triangles, &usual(&vertices)) {
            Ok(body) => {
                for k in 0..body.faces.len() {
                    body.face_centre_m(k);
                }
            }
            Err(error) => assert!(!error.to_string().contains('\n')),
        }
    }
}
