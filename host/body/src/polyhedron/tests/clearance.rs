//! Parts of a body that a fingertip beside them may run into.

use super::meshes::body;
use super::*;
use blindgrasp_meshes::{bracket, grid_box, plate};

/// A point of the bracket's own frame, mm, as seen from its centre of mass.
fn at(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x - 25.0, y - 15.0, z - 15.0) * 1e-3
}

#[test]
fn nothing_rises_above_the_faces_of_a_convex_body() {
    let mut numbers = Numbers(30);
    for _ in 0..50 {
        let points: Vec<_> = (0..20).map(|_| numbers.vector() * 0.03).collect();
        let body = Polyhedron::hull(&points).unwrap();
        for face in 0..body.faces.len() {
            assert!(Obstacles::above(&body, face).is_empty());
            assert_eq!(body.clearance_m(face, &numbers.vector()), f64::INFINITY);
        }
    }
    // Nor does noise.
    let (mut vertices, triangles) = grid_box([0.1; 3], 8);
    for vertex in &mut vertices {
        *vertex += numbers.vector() * 1e-4;
    }
    let body = body(&(vertices, triangles));
    for face in 0..6 {
        assert!(Obstacles::above(&body, face).is_empty());
    }
}

#[test]
fn an_inner_side_sees_the_other_one() {
    let body = body(&bracket());
    // Side 4 looks along +y, beside side 5, which looks along +x.
    for (point, distance) in [
        (at(30.0, 25.0, 15.0), 10.0),
        (at(50.0, 27.0, 3.0), 30.0),
        (at(23.0, 44.0, 15.0), 5.0),
        (at(23.0, 44.0, -12.0), 13.0),
        (at(20.0, 30.0, 15.0), 0.0),
    ] {
        let found = body.clearance_m(4, &point) * 1e3;
        assert!((found - distance).abs() < 1e-9, "{found} {distance}");
    }
    // The outer sides see nothing.
    for face in [0, 1, 2, 3, 6, 7] {
        assert!(Obstacles::above(&body, face).is_empty());
    }
    // Through the hole of a plate one side sees the three others.
    let plate = super::meshes::body(&plate());
    let middle = Vector3::new(0.0, 0.0, 0.0);
    assert!((plate.clearance_m(6, &middle) - 0.01).abs() < 1e-9);
}

/// Against points spread over the triangles, and against what the nearest point of a triangle has to satisfy.
#[test]
fn the_nearest_point_of_a_triangle_is_the_nearest() {
    let mut numbers = Numbers(31);
    for round in 0..2000 {
        let mut corners = [numbers.vector(), numbers.vector(), numbers.vector()];
        if round % 10 == 0 {
            // A needle, and a point.
            corners[2] = corners[0] + (corners[1] - corners[0]) * numbers.unit();
        }
        if round % 100 == 0 {
            corners = [corners[0]; 3];
        }
        let point = numbers.vector() * 2.0;
        let nearest = super::super::clearance::nearest(&corners, &point);
        // No corner is nearer along the way to it: the condition for the nearest point of a convex set.
        for corner in &corners {
            assert!((point - nearest).dot(&(corner - nearest)) < 1e-12);
        }
        // And it is in the triangle: no farther from any point of it than the farthest corner.
        let inside = corners.iter().any(|corner| (nearest - corner).norm() < 1e-12) || {
            let area = |a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>| (b - a).cross(&(c - a)).norm();
            let [a, b, c] = &corners;
            let parts = area(a, b, &nearest) + area(b, c, &nearest) + area(c, a, &nearest);
            (parts - area(a, b, c)).abs() < 1e-9
        };
        assert!(inside);
    }
}
