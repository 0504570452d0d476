use super::super::Flatness;
use super::*;
use crate::polyhedron::clearance::nearest;
use blindgrasp_meshes::{Mesh, Numbers, bracket, pit, plate, valley};
use blindgrasp_shared::math::norm;

fn body((vertices, triangles): &Mesh) -> Polyhedron {
    let flatness = Flatness { angle_rad: 1e-6, distance_m: 1e-9 };
    Polyhedron::mesh(vertices, triangles, &flatness).unwrap()
}

/// An L, sheared: nothing is at right angles.
fn sheared() -> Mesh {
    let (mut vertices, triangles) = bracket();
    for vertex in &mut vertices {
        vertex.x += 0.3 * vertex.y + 0.2 * vertex.z;
        vertex.z += 0.1 * vertex.x;
    }
    (vertices, triangles)
}

fn bodies() -> Vec<(Polyhedron, i32)> {
    // With their Euler characteristics: the plate has a tunnel.
    [(bracket(), 1), (plate(), 0), (pit(), 1), (sheared(), 1), (valley(), 1)]
        .iter()
        .map(|(mesh, euler)| (body(mesh), *euler))
        .collect()
}

/// The square of the depth of a sphere, and its slopes: the energy of a soft one but for a factor.
fn energy(surface: &Touchable, centre_m: &Vector3<f64>, radius_m: f64) -> (f64, Vector3<f64>) {
    let mut places = Vec::new();
    surface.touches(centre_m, radius_m, &mut places);
    places.iter().fold((0.0, Vector3::zeros()), |(energy, slope), critical| {
        let depth_m = radius_m - critical.place.distance_m;
        let index = f64::from(critical.index);
        (energy + index * depth_m * depth_m, slope - critical.place.normal * (2.0 * index * depth_m))
    })
}

/// Against the nearest of all triangles, and the side by the solid angle that the surface fills.
///
/// Tolerance: coordinates of 0.1 m, a hundred roundings.
#[test]
fn the_closest_point_is_the_nearest_of_all_triangles() {
    let mut numbers = Numbers(5);
    for (shape, _) in bodies() {
        let surface = Touchable::of(&shape);
        assert!(!surface.is_convex());
        let triangles: Vec<_> = shape
            .faces
            .iter()
            .flat_map(|face| &face.triangles)
            .map(|corners| corners.map(|k| shape.vertices_m[k]))
            .collect();
        let mut inside = 0;
        for _ in 0..2000 {
            let point = numbers.vector() * 0.05;
            let closest = surface.closest(&point);
            let least = triangles
                .iter()
                .map(|corners| norm(&(nearest(corners, &point) - point)))
                .fold(f64::INFINITY, f64::min);
            // Van Oosterom and Strackee.
            let angle: f64 = triangles
                .iter()
                .map(|corners| {
                    let [a, b, c] = corners.map(|corner| corner - point);
                    let (x, y, z) = (norm(&a), norm(&b), norm(&c));
                    2.0 * libm::atan2(
                        a.dot(&b.cross(&c)),
                        x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y,
                    )
                })
                .sum();
            let sign = if angle > 6.0 { -1.0 } else { 1.0 };
            inside += usize::from(sign < 0.0);
            assert!((closest.distance_m - sign * least).abs() < 1e-15, "{closest:?} {least} {angle}");
            let there = closest.point_m + closest.normal * closest.distance_m;
            assert!((there - point).norm() < 1e-15 && (closest.normal.norm() - 1.0).abs() < 1e-12);
        }
        assert!(inside > 10, "{inside}");
    }
}

/// Morse: the indices of all critical points add up to the body's Euler characteristic, seen from anywhere outside.
#[test]
fn all_indices_add_up_to_the_euler_characteristic() {
    let mut numbers = Numbers(6);
    for (shape, euler) in bodies() {
        let surface = Touchable::of(&shape);
        let (mut places, mut kinds) = (Vec::new(), [0; 3]);
        for _ in 0..5000 {
            let point = numbers.vector() * 0.06;
            if surface.closest(&point).distance_m <= 0.0 {
                continue;
            }
            surface.touches(&point, f64::INFINITY, &mut places);
            assert_eq!(
                places.iter().map(|critical| critical.index).sum::<i32>(),
                euler,
                "{point} {places:?}"
            );
            for critical in &places {
                kinds[if critical.index < 0 { 0 } else { 1 }] += 1;
                kinds[2] += usize::from(critical.index != 1);
            }
        }
        assert!(kinds[0] > 50 && kinds[1] > 4000, "{kinds:?}");
    }
}

/// An L cut into two boxes: both, less the rectangle that they share. A thin plate stands for that one; halving its thickness
/// halves
#[test]
fn it_is_the_sum_over_convex_parts_less_what_they_share() {
    let shape = body(&bracket());
    let surface = Touchable::of(&shape);
    let origin = shape.vertices_m.iter().fold(Vector3::repeat(f64::INFINITY), |least, v| least.inf(v));
    let cuboid = |from: [f64; 3], to: [f64; 3]| {
        let (from, to) = (Vector3::from(from), Vector3::from(to));
        (Touchable::of(&Polyhedron::cuboid((to - from).into()).unwrap()), origin + (from + to) / 2.0)
    };
    let parts = [
        (1.0, cuboid([0.0, 0.0, 0.0], [0.06, 0.02, 0.03])),
        (1.0, cuboid([0.0, 0.02, 0.0], [0.02, 0.04, 0.03])),
        (-1.0, cuboid([0.0, 0.02 - 5e-10, 0.0], [0.02, 0.02 + 5e-10, 0.03])),
    ];
    let mut numbers = Numbers(7);
    let mut touching = 0;
    for _ in 0..20_000 {
        let centre = numbers.vector() * 0.05;
        if surface.closest(&centre).distance_m <= 1e-3 {
            continue;
        }
        let (got, slope) = energy(&surface, &centre, 0.02);
        let mut expected = (0.0, Vector3::zeros());
        for (sign, (part, middle)) in &parts {
            let (energy, slope) = energy(part, &(centre - middle), 0.02);
            expected.0 += sign * energy;
            expected.1 += slope * *sign;
        }
        touching += usize::from(got > 0.0);
        assert!(
            (got - expected.0).abs() < 1e-10 && (slope - expected.1).norm() < 2e-8,
            "{centre} {got} {expected:?}"
        );
    }
    assert!(touching > 1000, "{touching}");
}

/// The energy is a potential: on a walk around every body it changes by what its slopes say, to second order in the step, also
/// where places come and go; and forces don't jump.
#[test]
fn its_slopes_are_those_of_a_potential_everywhere() {
    let mut numbers = Numbers(8);
    for (shape, _) in bodies() {
        let surface = Touchable::of(&shape);
        let mut changes = 0;
        for _ in 0..4000 {
            let from = numbers.vector() * 0.05;
            let step = numbers.vector() * 1e-5;
            let to = from + step;
            if surface.closest(&from).distance_m <= 2e-3 || surface.closest(&to).distance_m <= 2e-3 {
                continue;
            }
            let radius_m = 0.015;
            let ((before, slope), (after, slope_after)) =
                (energy(&surface, &from, radius_m), energy(&surface, &to, radius_m));
            let change = 0.5 * (slope + slope_after).dot(&step);
            changes += usize::from(change != 0.0);
            // Second derivatives: 2 for each place along the line to it, and 2 depth / distance across, at most 15; some ten places.
            let bound = 150.0 * step.norm();
            assert!((slope - slope_after).norm() < bound, "{from} {slope} {slope_after}");
            assert!(
                (after - before - change).abs() < bound * step.norm(),
                "{from} {before} {after} {change}"
            );
        }
        assert!(changes > 500, "{changes}");
    }
}

/// Against many points of the line. Tolerance: rounding, as long as it is outside; what is inside is seen, if not how deep it is.
#[test]
fn no_point_of_a_line_is_closer() {
    let mut numbers = Numbers(9);
    let cube = Polyhedron::cuboid([0.04, 0.05, 0.06]).unwrap();
    for shape in [cube, body(&bracket()), body(&plate()), body(&pit())] {
        let surface = Touchable::of(&shape);
        let mut pierced = 0;
        for _ in 0..300 {
            let ends = [numbers.vector() * 0.08, numbers.vector() * 0.08];
            let (share, closest) = surface.closest_to_line(&ends);
            let at = |share: f64| ends[0] + (ends[1] - ends[0]) * share;
            assert_eq!(surface.closest(&at(share)), closest);
            let looks = (0..=1000).map(|k| surface.closest(&at(f64::from(k) / 1000.0)).distance_m);
            let least = looks.fold(f64::INFINITY, f64::min);
            let near = closest.distance_m;
            assert!(near <= least + 1e-12 || least < 0.0, "{ends:?} {closest:?} {least}");
            assert!((near < 0.0) == (least < 0.0) || least.abs() < 1e-4, "{ends:?} {closest:?} {least}");
            pierced += usize::from(near < 0.0);
        }
        assert!(pierced > 15, "{pierced}");
    }
}

/// A line above a cube, level and longer than it, lies on two of its edges; a shorter one on its own ends; one that leans on an edge
/// and its own end; along an edge; askew over a face.
#[test]
fn a_rod_lies_on_two_places() {
    let surface = Touchable::of(&Polyhedron::cuboid([0.04; 3]).unwrap());
    for (from, to, expected) in [
        ([-0.05, 0.0, 0.03], [0.05, 0.0, 0.03], [-0.02, 0.02]),
        ([-0.01, 0.0, 0.03], [0.015, 0.0, 0.03], [-0.01, 0.015]),
        ([-0.05, 0.0, 0.03], [0.015, 0.0, 0.03], [-0.02, 0.015]),
        ([-0.05, 0.02, 0.03], [0.05, 0.02, 0.03], [-0.02, 0.02]),
        ([-0.05, -0.001, 0.03], [0.05, 0.001, 0.03], [-0.02, 0.02]),
    ] {
        let ends = [Vector3::from(from), Vector3::from(to)];
        let places = surface.supports(&ends, 0.01).map(|(share, within_m)| {
            assert_eq!(within_m, 0.01);
            ends[0].x + share * (ends[1].x - ends[0].x)
        });
        let sorted = [places[0].min(places[1]), places[0].max(places[1])];
        let off = (sorted[0] - expected[0]).abs().max((sorted[1] - expected[1]).abs());
        assert!(off < 1e-12, "{places:?}");
    }
}

/// Depths don't jump on a walk of a rod around a body, also where places become one or are others.
///
/// Tolerance: a place that passes a corner is as fast as the rod's end times its length over the radius, at most.
#[test]
fn supports_do_not_jump() {
    let mut numbers = Numbers(10);
    for (mesh, _) in [(None, 0), (Some(plate()), 0)] {
        let shape = mesh.as_ref().map_or_else(|| Polyhedron::cuboid([0.04, 0.05, 0.06]).unwrap(), body);
        let surface = Touchable::of(&shape);
        let radius_m = 0.01;
        let depths = |ends: &[Vector3<f64>; 2]| {
            let mut depths = surface.supports(ends, radius_m).map(|(share, within_m)| {
                let closest = surface.closest(&(ends[0] + (ends[1] - ends[0]) * share));
                (within_m - closest.distance_m).max(0.0)
            });
            depths.sort_by(f64::total_cmp);
            depths
        };
        let (mut both, mut worst) = (0, 0.0f64);
        for _ in 0..20_000 {
            let middle = numbers.vector() * 0.05;
            let along = numbers.vector().normalize() * 0.04;
            let ends = [middle - along, middle + along];
            if surface.closest_to_line(&ends).1.distance_m < 0.007 {
                continue;
            }
            let next = ends.map(|end| end + numbers.vector() * 1e-8);
            let (a, b) = (depths(&ends), depths(&next));
            both += usize::from(a[0] > 0.0);
            worst = worst.max((a[0] - b[0]).abs()).max((a[1] - b[1]).abs());
        }
        println!("{both} on two places, {worst:.1e} m");
        assert!(both > 100 && worst < 1e-6, "{both} {worst}");
    }
}
