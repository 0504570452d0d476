mod clearance;
mod masses;
mod meshes;

use super::*;
use blindgrasp_meshes::Numbers;
use blindgrasp_shared::math::Real;

fn assert_close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance * b.abs().max(a.abs()), "{a} {b}");
}

fn assert_inertia(properties: &MassProperties, expected: &Matrix3<f64>) {
    let error = (properties.inertia_per_kg_m2 - expected).amax() / expected.amax();
    assert!(error < 1e-12, "{error:e}: {} {expected}", properties.inertia_per_kg_m2);
}

/// Planes and loops agree, the origin is the centre of mass, everything is convex.
fn assert_sound(body: &Polyhedron) {
    let scale = body.radius_m();
    let properties = body.mass_properties();
    assert!(properties.centre_m.norm() < 1e-12 * scale, "{}", properties.centre_m);
    for (k, face) in body.faces.iter().enumerate() {
        assert_close(face.normal.norm(), 1.0, 1e-14);
        assert!(face.distance_m > 0.0);
        for (index, vertex) in body.vertices_m.iter().enumerate() {
            let height = face.normal.dot(vertex) - face.distance_m;
            assert!(height < 1e-8 * scale, "face {k} vertex {index}: {height:e}");
            assert!(!face.corners.contains(&index) || height > -1e-8 * scale);
        }
        assert!(body.margin_m(k, &body.face_centre_m(k)) > 0.0);
    }
}

#[test]
fn box_matches_its_closed_form() {
    let [a, b, c] = [0.048, 0.06, 0.1];
    let body = Polyhedron::cuboid([a, b, c]).unwrap();
    assert_sound(&body);
    let properties = body.mass_properties();
    assert_close(properties.volume_m3, a * b * c, 1e-12);
    let expected = Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b) / 12.0;
    assert_inertia(&properties, &Matrix3::from_diagonal(&expected));
    let normals: [i32; 6] = [-1, 1, -2, 2, -3, 3];
    for (face, axis) in body.faces.iter().zip(normals) {
        let mut normal = Vector3::zeros();
        normal[axis.unsigned_abs() as usize - 1] = f64::from(axis.signum());
        assert_eq!(face.normal, normal);
    }
}

#[test]
fn triangular_prism_matches_its_closed_form() {
    let (side, height) = (0.06, 0.039);
    let body = Polyhedron::regular_prism(3, side, height).unwrap();
    assert_sound(&body);
    let properties = body.mass_properties();
    let area = side * side * 3.0_f64.square_root() / 4.0;
    assert_close(properties.volume_m3, area * height, 1e-12);
    // An equilateral triangle: a^2 / 24 about each axis in its plane.
    let (plane, rod) = (side * side / 24.0, height * height / 12.0);
    assert_inertia(
        &properties,
        &Matrix3::from_diagonal(&Vector3::new(plane + rod, plane + rod, 2.0 * plane)),
    );
    // The sides look along -y, then counter-clockwise.
    let root = 3.0_f64.square_root() / 2.0;
    for (face, [x, y]) in body.faces.iter().zip([[0.0, -1.0], [root, 0.5], [-root, 0.5]]) {
        assert!((face.normal - Vector3::new(x, y, 0.0)).norm() < 1e-15);
        assert_close(face.distance_m, side / (12.0_f64).square_root(), 1e-14);
    }
}

#[test]
fn tetrahedron_matches_its_closed_form() {
    // Corner of a cube: volume a b c / 6, moments about the centre of mass from those of the unit simplex,
    // whose covariance is (4 on the diagonal of 1/80 * 3/4, off -1/80).
    let mut numbers = Numbers(1);
    for _ in 0..100 {
        let size = numbers.vector().map(|v| 0.01 + v.abs());
        let shift = numbers.vector() * 10.0;
        let points = [Vector3::zeros(), Vector3::x() * size.x, Vector3::y() * size.y, Vector3::z() * size.z]
            .map(|p| p + shift);
        let body = Polyhedron::hull(&points).unwrap();
        assert_eq!(body.faces.len(), 4);
        let properties = body.mass_properties();
        assert_close(properties.volume_m3, size.x * size.y * size.z / 6.0, 1e-11);
        let simplex = Matrix3::from_fn(|r, c| if r == c { 3.0 / 80.0 } else { -1.0 / 80.0 });
        let scale = Matrix3::from_diagonal(&size);
        let spread = scale * simplex * scale;
        let expected = Matrix3::identity() * spread.trace() - spread;
        // Ten units off, the corners themselves are rounded at 1e-15.
        assert!((properties.inertia_per_kg_m2 - expected).amax() < 1e-13);
    }
    let points = [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
    let simplex = Matrix3::from_fn(|r, c| if r == c { 3.0 / 40.0 } else { 1.0 / 80.0 });
    assert_inertia(&Polyhedron::hull(&points).unwrap().mass_properties(), &simplex);
}

#[test]
fn hull_finds_a_turned_box_again() {
    let mut numbers = Numbers(2);
    for _ in 0..100 {
        let size = numbers.vector().map(|v| 0.02 + v.abs());
        let straight = Polyhedron::cuboid(size.into()).unwrap();
        let (turn, shift) = (numbers.rotation(), numbers.vector());
        let mut points: Vec<_> = straight.vertices_m.iter().map(|p| turn * p + shift).collect();
        // Points inside, in the middle of a face, of an edge: none is a corner.
        points.insert(3, shift);
        points.insert(5, turn * Vector3::new(size.x / 2.0, 0.0, 0.0) + shift);
        points.insert(0, turn * Vector3::new(size.x / 2.0, size.y / 2.0, 0.0) + shift);
        let body = Polyhedron::hull(&points).unwrap();
        assert_sound(&body);
        assert_eq!((body.vertices_m.len(), body.faces.len()), (8, 6));
        let expected = turn * straight.mass_properties().inertia_per_kg_m2 * turn.transpose();
        assert_inertia(&body.mass_properties(), &expected);
        assert!(body.faces.iter().all(|face| face.corners.len() == 4));
    }
}

#[test]
fn hull_of_many_points_is_closed_and_convex() {
    let mut numbers = Numbers(3);
    for count in [4, 5, 6, 8, 12, 20, 40, 70, 100] {
        let points: Vec<_> = (0..count).map(|_| numbers.vector().normalize() * 0.03).collect();
        let body = Polyhedron::hull(&points).unwrap();
        assert_sound(&body);
        assert_eq!(body.faces.len(), 2 * count - 4, "points on a sphere make triangles");
    }
}

#[test]
fn regular_prisms_of_many_sides_approach_the_cylinder() {
    let sides = MAX_POINTS;
    let radius = 0.03;
    let side = 2.0 * radius * (std::f64::consts::PI / sides as f64).sine_cosine().0;
    let body = Polyhedron::regular_prism(sides, side, 0.05).unwrap();
    assert_sound(&body);
    let cylinder = std::f64::consts::PI * radius * radius * 0.05;
    assert_close(body.mass_properties().volume_m3, cylinder, 1e-3);
    assert_eq!(body.margin_m(sides, &Vector3::zeros()).signum(), 1.0);
}

#[test]
fn margin_is_the_distance_from_the_nearest_edge() {
    let body = Polyhedron::cuboid([0.2, 0.4, 0.6]).unwrap();
    let top = 5;
    for (x, y, margin) in
        [(0.0, 0.0, 0.1), (0.09, 0.0, 0.01), (0.0, -0.195, 0.005), (0.12, 0.0, -0.02), (0.1, 0.0, 0.0)]
    {
        // The height over the face does not matter.
        for z in [0.3, 0.35, -1.0] {
            let found = body.margin_m(top, &Vector3::new(x, y, z));
            assert!((found - margin).abs() < 1e-15, "{found} {margin}");
        }
    }
    let (face, distance) = body.nearest_face(&Vector3::new(0.02, -0.2001, 0.1), 1e-9).unwrap();
    assert_eq!(face, 2);
    assert!((distance - 1e-4).abs() < 1e-12);
    assert_eq!(body.nearest_face(&Vector3::new(1.0, 1.0, 1.0), 1e-9), None);
}

#[test]
fn what_is_no_polyhedron_is_refused() {
    use PolyhedronError as E;
    let p = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
    let square = [p(0., 0., 0.), p(1., 0., 0.), p(0., 1., 0.), p(1., 1., 0.)];
    assert_eq!(Polyhedron::hull(&square), Err(E::NoVolume));
    assert_eq!(
        Polyhedron::hull(&[p(0., 0., 0.), p(1., 0., 0.), p(2., 0., 0.), p(3., 0., 0.)]),
        Err(E::NoVolume)
    );
    assert_eq!(Polyhedron::hull(&square[..3]), Err(E::TooFewPoints { count: 3, least: 4, shape: "hull" }));
    let mut twice = square.to_vec();
    twice.extend([p(0., 0., 1.), p(1., 0., 0.)]);
    assert_eq!(Polyhedron::hull(&twice), Err(E::Duplicate { first: 1, second: 5 }));
    twice[5].y = f64::NAN;
    assert_eq!(Polyhedron::hull(&twice), Err(E::NotFinite { point: 5 }));
    assert_eq!(
        Polyhedron::hull(&[p(1e300, 0., 0.), p(-1e300, 0., 0.), p(0., 1e300, 0.), p(0., 0., 1e300)]),
        Err(E::NoVolume)
    );
    assert!(matches!(Polyhedron::hull(&vec![p(0., 0., 0.); 101]), Err(E::TooManyPoints { .. })));
    assert!(matches!(Polyhedron::hull(&[p(0., 0., 0.); 4]), Err(E::Duplicate { .. })));
    assert!(matches!(Polyhedron::cuboid([1.0, 0.0, 1.0]), Err(E::Length { .. })));
    assert!(matches!(Polyhedron::cuboid([1.0, 1.0, f64::NAN]), Err(E::Length { .. })));
    assert!(matches!(Polyhedron::regular_prism(2, 1.0, 1.0), Err(E::TooFewPoints { .. })));
    assert!(matches!(Polyhedron::regular_prism(usize::MAX, 1.0, 1.0), Err(E::TooManyPoints { .. })));
    let clockwise = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]];
    assert!(matches!(Polyhedron::prism(&clockwise, 1.0), Err(E::NotConvex { .. })));
    let dented = [[0.0, 0.0], [1.0, 0.0], [0.2, 0.2], [0.0, 1.0]];
    assert_eq!(Polyhedron::prism(&dented, 1.0), Err(E::NotConvex { corner: 2 }));
    // A star that winds twice turns left at every corner.
    let star: Vec<[f64; 2]> = (0..5)
        .map(|k| {
            let (sine, cosine) = (f64::from(k) * 4.0 * std::f64::consts::PI / 5.0).sine_cosine();
            [cosine, sine]
        })
        .collect();
    assert!(matches!(Polyhedron::prism(&star, 1.0), Err(E::NotConvex { .. })));
}

#[test]
fn random_points_with_near_coincidences_never_panic() {
    let mut numbers = Numbers(4);
    let (mut made, mut refused) = (0, 0);
    for _ in 0..500 {
        let count = 4 + (numbers.unit() * 10.0) as usize;
        let mut points: Vec<_> = (0..count).map(|_| numbers.vector()).collect();
        for k in 0..count {
            // Snap some onto others' planes, with an error of every size.
            if numbers.unit() < 0.5 {
                let noise = 10f64.powi(-(numbers.unit() * 18.0) as i32) * numbers.unit();
                points[k].z = if numbers.unit() < 0.5 { 1.0 + noise } else { -1.0 - noise };
            }
        }
        match Polyhedron::hull(&points) {
            Ok(body) => {
                assert_sound(&body);
                made += 1;
            }
            Err(error) => {
                assert!(!error.to_string().contains('\n'));
                refused += 1;
            }
        }
    }
    println!("{made} hulls, {refused} refused");
    assert!(made > 300);
}
