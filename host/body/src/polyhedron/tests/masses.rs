//! Mass properties against closed forms and against chance.

use super::super::mass;
use super::*;
use blindgrasp_meshes::{Mesh, bracket, grid_box, icosphere, plate};

fn properties((vertices, triangles): &Mesh) -> MassProperties {
    mass::of(vertices, triangles.iter())
}

/// Turned about the origin, then shifted.
fn moved(
    (vertices, triangles): Mesh,
    numbers: &mut Numbers,
    distance: f64,
) -> (Mesh, nalgebra::Rotation3<f64>, Vector3<f64>) {
    let (turn, shift) = (numbers.rotation(), numbers.vector() * distance);
    ((vertices.iter().map(|v| turn * v + shift).collect(), triangles), turn, shift)
}

/// Volume, centre and inertia about it of a set of boxes, some of which count negative: corner, size, sign.
fn boxes(boxes: &[([f64; 3], [f64; 3], f64)]) -> MassProperties {
    let (mut volume_m3, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for (corner, size, sign) in boxes {
        let volume = sign * size.iter().product::<f64>();
        let centre = Vector3::from(*corner) + Vector3::from(*size) / 2.0;
        let own = Matrix3::from_diagonal(&Vector3::from(*size).map(|side| side * side / 12.0));
        volume_m3 += volume;
        first += centre * volume;
        second += (own + centre * centre.transpose()) * volume;
    }
    let centre_m = first / volume_m3;
    let spread = second / volume_m3 - centre_m * centre_m.transpose();
    MassProperties { volume_m3, centre_m, inertia_per_kg_m2: Matrix3::identity() * spread.trace() - spread }
}

/// In 100 random poses up to 100 body lengths from the origin. Positions there are rounded at 1e-14 of the body's size, which
/// moves its moments by a few times as much.
#[test]
fn boxes_profiles_and_plates_match_their_closed_forms_in_any_pose() {
    let mut numbers = Numbers(20);
    let expected = [
        (grid_box([0.04, 0.05, 0.06], 3), boxes(&[([-0.02, -0.025, -0.03], [0.04, 0.05, 0.06], 1.0)])),
        (
            bracket(),
            boxes(&[([0.0, 0.0, 0.0], [0.06, 0.02, 0.03], 1.0), ([0.0, 0.02, 0.0], [0.02, 0.02, 0.03], 1.0)]),
        ),
        (
            plate(),
            boxes(&[
                ([-0.03, -0.02, 0.0], [0.06, 0.04, 0.01], 1.0),
                ([-0.01, -0.01, 0.0], [0.02, 0.02, 0.01], -1.0),
            ]),
        ),
    ];
    let mut worst: f64 = 0.0;
    for (mesh, expected) in expected {
        for _ in 0..100 {
            let (mesh, turn, shift) = moved(mesh.clone(), &mut numbers, 5.0);
            let found = properties(&mesh);
            let inertia = turn * expected.inertia_per_kg_m2 * turn.transpose();
            worst = worst
                .max((found.volume_m3 / expected.volume_m3 - 1.0).abs())
                .max((found.centre_m - (turn * expected.centre_m + shift)).amax() / 0.05)
                .max((found.inertia_per_kg_m2 - inertia).amax() / inertia.amax());
        }
    }
    println!("volume, centre and inertia are off by {worst:.1e} at most");
    assert!(worst < 1e-12, "{worst:e}");
}

/// Tetrahedra from their corners as they are after rounding: nothing is lost far from the origin.
#[test]
fn tetrahedra_match_their_closed_form_a_million_lengths_away() {
    let mut numbers = Numbers(21);
    for distance in [0.0, 1.0, 1e3, 1e6] {
        for _ in 0..100 {
            let corners: Vec<_> = (0..4).map(|_| numbers.vector() + Vector3::repeat(distance)).collect();
            let edges = [1, 2, 3].map(|k| corners[k] - corners[0]);
            let six = edges[0].dot(&edges[1].cross(&edges[2]));
            if six.abs() < 0.1 {
                continue;
            }
            let outside = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
            let triangles = outside.map(|[a, b, c]| if six > 0.0 { [a, b, c] } else { [a, c, b] }).to_vec();
            let found = properties(&(corners.clone(), triangles));
            assert_close(found.volume_m3, six.abs() / 6.0, 1e-12);
            // The covariance of a tetrahedron: that of its corners about their mean, over 20.
            let mean = edges.iter().sum::<Vector3<f64>>() / 4.0;
            let spread = edges
                .iter()
                .chain([&Vector3::zeros()])
                .fold(Matrix3::zeros(), |sum, edge| sum + (edge - mean) * (edge - mean).transpose() / 20.0);
            assert!((found.centre_m - corners[0] - mean).amax() < 4.0 * f64::EPSILON * distance.max(1.0));
            assert_inertia(&found, &(Matrix3::identity() * spread.trace() - spread));
        }
    }
}

/// A ball with dents and bumps of 40 % of its radius, against a million random points. Volume, centre and moments are means
/// over them; with `s` the standard error that the sample itself shows, five `s` are exceeded by chance once in two million.
#[test]
fn a_dented_ball_matches_random_points() {
    let (mut vertices, triangles) = icosphere(0.03, 3);
    for vertex in &mut vertices {
        let [x, y, z] = (*vertex / 0.03).into();
        *vertex *= 1.0 + 0.4 * (4.0 * x * y + 3.0 * z * z * z - 2.0 * x * z).sine_cosine().0;
    }
    let found = properties(&(vertices.clone(), triangles.clone()));
    let centre = found.centre_m;
    let extent = vertices.iter().map(|v| v.amax()).fold(0.0, f64::max);
    // Whether a point is inside: how often the line from it along z crosses the surface. Triangles are kept by where they
    // are along x and y.
    const CELLS: usize = 40;
    let cell = |v: f64| ((v / extent + 1.0) / 2.0 * CELLS as f64).clamp(0.0, CELLS as f64 - 1.0) as usize;
    let mut cells: Vec<Vec<[Vector3<f64>; 3]>> = vec![Vec::new(); CELLS * CELLS];
    for corners in triangles.iter().map(|corners| corners.map(|k| vertices[k])) {
        let ([low_x, low_y, _], [high_x, high_y, _]) = {
            let [a, b, c] = corners;
            (a.inf(&b).inf(&c).into(), a.sup(&b).sup(&c).into())
        };
        for x in cell(low_x)..=cell(high_x) {
            for y in cell(low_y)..=cell(high_y) {
                cells[x * CELLS + y].push(corners);
            }
        }
    }
    let is_inside = |p: &Vector3<f64>| {
        let crossed = |[a, b, c]: &[Vector3<f64>; 3]| {
            let turn =
                |a: &Vector3<f64>, b: &Vector3<f64>| (a.x - p.x) * (b.y - p.y) - (a.y - p.y) * (b.x - p.x);
            let [u, v, w] = [turn(b, c), turn(c, a), turn(a, b)];
            let same_side = (u > 0.0) == (v > 0.0) && (v > 0.0) == (w > 0.0);
            same_side && (u * a.z + v * b.z + w * c.z) / (u + v + w) > p.z
        };
        cells[cell(p.x) * CELLS + cell(p.y)].iter().filter(|corners| crossed(corners)).count() % 2 == 1
    };
    let mut numbers = Numbers(22);
    const POINTS: usize = 1_000_000;
    // Indicator; centre; the six moments about the centre that is to be checked.
    let (mut sums, mut squares) = ([0.0; 10], [0.0; 10]);
    for _ in 0..POINTS {
        let point = numbers.vector() * extent;
        if is_inside(&point) {
            let p = point - centre;
            let (x, y, z) = (p.x, p.y, p.z);
            let terms = [1.0, x, y, z, y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z];
            for k in 0..10 {
                sums[k] += terms[k];
                squares[k] += terms[k] * terms[k];
            }
        }
    }
    let (count, cube) = (POINTS as f64, (2.0 * extent).powi(3));
    let inertia = found.inertia_per_kg_m2 * found.volume_m3;
    let expected = [
        found.volume_m3,
        0.0,
        0.0,
        0.0,
        inertia[(0, 0)],
        inertia[(1, 1)],
        inertia[(2, 2)],
        inertia[(0, 1)],
        inertia[(0, 2)],
        inertia[(1, 2)],
    ];
    for k in 0..10 {
        let mean = sums[k] / count;
        let error = ((squares[k] / count - mean * mean) / count).square_root();
        assert!(
            (mean * cube - expected[k]).abs() < 5.0 * error * cube,
            "{k}: {} {}",
            mean * cube,
            expected[k]
        );
    }
    println!(
        "volume {:.4e} m^3, of random points {:.4e} +- {:.1e}",
        expected[0],
        sums[0] / count * cube,
        ((sums[0] / count) * (1.0 - sums[0] / count) / count).square_root() * cube
    );
    assert!(found.volume_m3 / cube > 0.1 && found.volume_m3 / cube < 0.6);
}

#[test]
fn pyramids_match_their_closed_form() {
    let (side, height) = (0.04, 0.06);
    let body = Polyhedron::regular_pyramid(4, side, height).unwrap();
    assert_sound(&body);
    let found = body.mass_properties();
    assert_close(found.volume_m3, side * side * height / 3.0, 1e-12);
    // About the centre of mass, which is a quarter of the height above the bottom.
    let across = side * side / 20.0 + 3.0 * height * height / 80.0;
    assert_inertia(&found, &Matrix3::from_diagonal(&Vector3::new(across, across, side * side / 10.0)));
    assert_close(body.faces[4].distance_m, height / 4.0, 1e-14);
    assert_eq!(body.faces[4].normal, -Vector3::z());
    // The first side looks along -y, the second along +x.
    assert!(body.faces[0].normal.y < -0.9 && body.faces[0].normal.x.abs() < 1e-15);
    assert!(body.faces[1].normal.x > 0.9);
}
