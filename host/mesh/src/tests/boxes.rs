//! Crossings and rays, against all triangles one by one.

use crate::crossing::cross;
use crate::{Boxes, crossings};
use blindgrasp_meshes::icosphere;
use blindgrasp_shared::math::Real;

#[test]
fn crossings_are_those_of_all_pairs() {
    let mut numbers = blindgrasp_meshes::Numbers(70);
    for _ in 0..30 {
        let (mut vertices, triangles) = icosphere(0.03, 2);
        let vertex = numbers.below(vertices.len());
        vertices[vertex] += numbers.vector() * 0.05;
        let boxes = Boxes::around(triangles.iter().map(|t| t.map(|k| vertices[k])).collect());
        let found = crossings(&boxes, &triangles);
        let mut all = 0;
        for a in 0..triangles.len() {
            for b in a + 1..triangles.len() {
                all += usize::from(cross([a, b], &boxes, &triangles));
            }
        }
        assert_eq!(found.count, all);
        assert!(found.is_complete && (all > 0) == found.first.is_some());
    }
}

/// Walls against all triangles, one by one.
#[test]
fn rays_meet_what_is_first() {
    let mut numbers = blindgrasp_meshes::Numbers(71);
    let (vertices, triangles) = icosphere(1.0, 3);
    let boxes = Boxes::around(triangles.iter().map(|t| t.map(|k| vertices[k])).collect());
    for _ in 0..200 {
        let (start, along) = (numbers.vector() * 0.5, numbers.vector().normalize());
        let found = boxes.first(&start, &along, usize::MAX);
        // On a ball of 1,280 facets, within a percent of the ball.
        let b = start.dot(&along);
        let ball = (b * b + 1.0 - start.norm_squared()).square_root() - b;
        assert!((found - ball).abs() < 0.01, "{found} {ball}");
    }
}
