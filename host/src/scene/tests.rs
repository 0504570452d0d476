use super::*;
use crate::Posture;
use crate::scene::file::{ContactFile, Indentation, InertiaFile, ShapeFile};

/// A sequence of numbers that is the same everywhere.
struct Numbers(u64);

impl Numbers {
    /// In [0, 1).
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| 2.0 * self.next() - 1.0)
    }
}

fn text(name: &str) -> &'static str {
    Kind::Scene.built_in().iter().find(|(built_in, _)| *built_in == name).unwrap().1
}

fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse(text, "s.toml", Path::new(""), &[])
}

fn load(name: &str, settings: &[&str]) -> Result<Scene, SceneError> {
    let settings: Vec<String> = settings.iter().map(|s| s.to_string()).collect();
    Scene::load(name, &settings)
}

/// Places fingertips, in the object frame.
fn centres(scene: &Scene) -> Vec<Vector3<f64>> {
    let mut angles = [0.0; crate::MAX_JOINTS];
    angles[..scene.start.angles_rad.len()].copy_from_slice(&scene.start.angles_rad);
    let mut posture = Posture::at_base();
    scene.hand.forward_kinematics(&angles, &mut posture);
    let to_object = scene.start.attitude.inverse();
    (0..scene.contacts.len()).map(|i| to_object * (posture.centres_m[i] - scene.start.position_m)).collect()
}

/// Eq. 5 for every fingertip gives the indentation that the scene says, and the foot is the contact point.
fn assert_touches(scene: &Scene) {
    for (i, (contact, centre)) in scene.contacts.iter().zip(centres(scene)).enumerate() {
        let c_y = contact.frame.column(1);
        let indentation = scene.fingertips[i].radius_m + contact.distance_m + c_y.dot(&centre);
        assert!((indentation - scene.start.indentations_m[i]).abs() < 3e-12, "{indentation}");
        let point = centre + c_y * (scene.fingertips[i].radius_m - indentation);
        assert!((point - scene.start.points_m[i]).norm() < 3e-12);
        assert!(scene.object.margin_m(contact.face, &point) > 0.0);
        assert!((contact.frame.transpose() * contact.frame - Matrix3::identity()).amax() < 1e-14);
        let (c_x, c_z) = (contact.frame.column(0), contact.frame.column(2));
        assert!((c_x.cross(&c_y) - c_z).amax() < 1e-14, "C_X x C_Y = C_Z");
        assert!((c_y + scene.object.faces[contact.face].normal).amax() == 0.0, "C_Y points into the object");
    }
}

#[test]
fn shipped_scenes_touch_and_have_no_warnings() {
    for name in Scene::built_in() {
        let scene = load(name, &[]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scene.name, name);
        assert_eq!(scene.warnings, Vec::<String>::new());
        assert_eq!((scene.hand.joint_count(), scene.hand.fingertip_count()), (12, 3));
        assert_eq!(scene.substeps, 10);
        assert_touches(&scene);
        let ideal = name.contains('-');
        assert_eq!(scene.sensors.ideal, ideal);
        assert_eq!(scene.joints.iter().all(|joint| joint.torque_limit_nm.is_infinite()), ideal);
        assert_eq!(scene.joints.iter().all(|joint| joint.friction.coulomb_nm == 0.0), ideal);
        assert_eq!(scene.actuators.output_delay_ticks, u32::from(!ideal));
    }
}

#[test]
fn shipped_objects_are_those_of_table_vi() {
    let prism = load("prism", &[]).unwrap();
    assert_eq!(prism.mass_kg, 0.0015);
    // Uniform: m a^2 / 12 about the axis, m (a^2 / 24 + h^2 / 12) across.
    let expected = Vector3::new(4.15125e-7, 4.15125e-7, 4.5e-7);
    assert!((prism.inertia_kg_m2 - Matrix3::from_diagonal(&expected)).amax() < 1e-18);
    let cube = load("cube", &[]).unwrap();
    assert!((cube.inertia_kg_m2 - Matrix3::identity() * (0.0021 * 0.048 * 0.048 / 6.0)).amax() < 1e-18);
    // Finger 1 on the -y face, 2 and 3 on +x and -x.
    let inwards: Vec<_> = cube.contacts.iter().map(|contact| contact.frame.column(1).into_owned()).collect();
    assert_eq!(inwards, [Vector3::y(), -Vector3::x(), Vector3::x()]);
    assert!(cube.contacts.iter().all(|contact| (contact.distance_m - 0.024).abs() < 1e-17));
}

#[test]
fn equilibrium_indentation_is_that_of_eq_57() {
    for name in ["prism-ideal", "cube-ideal"] {
        let scene = load(name, &["start.indentation_m=equilibrium"]).unwrap();
        let centres = centres(&scene);
        let middle = centres.iter().sum::<Vector3<f64>>() / 3.0;
        for (i, contact) in scene.contacts.iter().enumerate() {
            let desired = scene.control.force_n / 0.045 * contact.frame.column(1).dot(&(middle - centres[i]));
            let force = scene.fingertips[i].stiffness_n_m2 * scene.start.indentations_m[i].powi(2);
            assert!((force / desired - 1.0).abs() < 1e-9, "{force} {desired}");
        }
    }
}

#[test]
fn effective_configuration_gives_the_same_scene() {
    let settings =
        ["control.force_n=4.1", "hand.joint.*.coulomb_friction_nm=1.7e-3", "plant.gravity_on_object=true"];
    for name in Scene::built_in() {
        for settings in [&settings[..], &[]] {
            let scene = load(name, settings).unwrap();
            let text = scene.effective_toml();
            assert_eq!(parse(&text).unwrap_or_else(|error| panic!("{error}")), scene);
        }
    }
    // Every shape and every optional key.
    let mut file = load("cube", &[]).unwrap().file;
    file.object.inertia_kg_m2 = Some(InertiaFile(vec![1e-6, 1.1e-6, 1.2e-6, 1e-8, 0.0, 0.0]));
    file.object.shape = ShapeFile::PolygonPrism {
        corners_m: vec![[-0.024, -0.024], [0.024, -0.024], [0.024, 0.024], [-0.024, 0.024]],
        height_m: 0.1,
    };
    file.actuators.slew_limit_nm_s = Some(100.0);
    file.pose.rotation_rpy_rad = None;
    file.pose.quaternion_wxyz = Some([1.0, 0.0, 0.0, 1e-4]);
    file.start.indentation_m = Indentation::Equilibrium;
    let scene = Scene::build(file).unwrap();
    assert_eq!(parse(&scene.effective_toml()).unwrap(), scene);
    // The posture as it was found, given as angles: the same contacts.
    let mut file = scene.file.clone();
    file.start.angles_rad = Some(scene.start.angles_rad.clone());
    let again = Scene::build(file).unwrap();
    assert_touches(&again);
    for (a, b) in again.start.indentations_m.iter().zip(&scene.start.indentations_m) {
        assert!((a - b).abs() < 1e-11);
    }
    assert_eq!(parse(&again.effective_toml()).unwrap(), again);
}

#[test]
fn settings_reach_everything() {
    let scene = load(
        "cube",
        &[
            "control.force_n=4",
            "plant.substep_s=5e-5",
            "hand.joint.2.mass_kg=0.02",
            "hand.joint.finger-3-flex-3.limits_rad=[-0.1, 1.5]",
            "hand.fingertip.*.radius_m = 0.016",
            "object.mass_kg=0.5",
            "pose.position_m.3=0.12",
            "start.indentation_m=equilibrium",
            "seed=7",
            "description=two words",
        ],
    )
    .unwrap();
    assert_eq!(scene.control.force_n, 4.0);
    assert_eq!(scene.substeps, 20);
    assert_eq!(scene.hand.link(1).mass_kg, 0.02);
    assert_eq!(scene.hand.range_rad(11), (-0.1, 1.5));
    assert!(scene.fingertips.iter().all(|fingertip| fingertip.radius_m == 0.016));
    assert_eq!(scene.mass_kg, 0.5);
    assert_eq!(scene.start.position_m.z, 0.12);
    assert_eq!(scene.file.start.indentation_m, Indentation::Equilibrium);
    assert_eq!(scene.description, "two words");
    // References come first, so that settings inside of them apply to what they name.
    let scene = load(
        "cube",
        &[
            "object.mass_kg=0.25",
            "object=prism",
            "contact.2.point_m=[0.015, 0.0086602540378443865, 0]",
            "contact.1.point_m=[0, -0.01732050807568877, 0]",
            "contact.3.point_m=[-0.015, 0.0086602540378443865, 0]",
        ],
    )
    .unwrap();
    assert_eq!((scene.object_name.as_str(), scene.mass_kg), ("prism", 0.25));
}

/// The whole message, for a scene whose text is changed in one place.
fn message(change: impl Fn(&str) -> String) -> String {
    let error = parse(&change(text("cube"))).expect_err("has to be refused").to_string();
    assert!(!error.contains('\n'), "{error}");
    error
}

#[test]
fn errors_say_where_what_and_what_to_do() {
    let replaced = |from: &'static str, to: &'static str| {
        assert!(text("cube").contains(from), "{from}");
        message(|text| text.replacen(from, to, 1))
    };
    let cases = [
        ("force_n = 5.0", "forc_n = 5.0", "s.toml:27: control.forc_n: unknown key; did you mean `force_n`?"),
        ("force_n = 5.0", "force_n = nan", "s.toml:27: control.force_n: is NaN; has to be a finite number"),
        (
            "force_n = 5.0",
            "force_n = \"5 N\"",
            "s.toml:27: control.force_n: is string \"5 N\"; has to be a number",
        ),
        (
            "force_n = 5.0",
            "force_n = -1",
            "s.toml:27: control.force_n: -1.0 is out of range; has to be between 1e-6 and 10000.0",
        ),
        ("force_n = 5.0", "", "s.toml:26: control.force_n: is missing; add `force_n = ...`"),
        (
            "substep_s = 1e-4",
            "substep_s = 3e-4",
            "s.toml:47: plant.substep_s: 0.0003 s does not divide the sampling period of 0.001 s; 2.5e-4 does",
        ),
        (
            "schema = 1",
            "schema = 2",
            "s.toml:2: schema: 2 is a format that this program does not know; write it as format 1",
        ),
        (
            "\"three-finger\"",
            "\"three-fingers\"",
            "s.toml:7: hand: no built-in hand is called `three-fingers`; did you mean `three-finger`? (a path has to end in .toml or contain a /)",
        ),
        (
            "object = \"cube\"",
            "object = \"no/such.toml\"",
            "s.toml:8: object: `no/such.toml`: no such file; check the path",
        ),
        (
            "position_m = [0.0, 0.0, 0.125]",
            "position_m = [0.0, 0.125]",
            "s.toml:11: pose.position_m: has 2 items; has to be a list of 3",
        ),
        (
            "position_m = [0.0, 0.0, 0.125]",
            "position_m = [0, 0, 0, 0]",
            "s.toml:11: pose.position_m: has 4 items; has to be a list of 3",
        ),
        (
            "position_m = [0.0, 0.0, 0.125]",
            "position_m = [0.0, inf, 0]",
            "s.toml:11: pose.position_m.2: is inf; has to be a finite number",
        ),
        (
            "position_m = [0.0, 0.0, 0.125]",
            "position_m = [0.0, 0.0, 0.25]",
            "s.toml:16: contact.1: fingertip `finger-1` stays 92.030 mm away; move the object (pose.position_m) or the contact point",
        ),
        (
            "point_m = [0.0, -0.024, 0.0]",
            "point_m = [0.0, -0.025, 0.0]",
            "s.toml:17: contact.1.point_m: is not on the surface but 1.000 mm off face 2; give a point of a face in the object frame, whose origin is the centre of mass",
        ),
        (
            "point_m = [0.0, -0.024, 0.0]",
            "face = 6",
            "s.toml:17: contact.1.face: the object has no face 6; has to be between 0 and 5",
        ),
        (
            "point_m = [0.0, -0.024, 0.0]",
            "face = 2\npoint_m = [0.03, -0.024, 0.0]",
            "s.toml:18: contact.1.point_m: is 6.000 mm beyond the edge of face 2; move it inside",
        ),
        (
            "[[contact]]                   # finger 1: C_Y = +y\npoint_m = [0.0, -0.024, 0.0]\n",
            "",
            "s.toml:16: contact: 2 contacts for 3 fingertips; give one [[contact]] for each fingertip, in the hand's order",
        ),
        (
            "indentation_m = 1e-4",
            "indentation_m = 0.02",
            "s.toml:24: start.indentation_m: 0.02 m for fingertip `finger-1` of radius 0.015 m; has to be positive and less than the radius: less force, or stiffer fingertips",
        ),
        (
            "indentation_m = 1e-4",
            "indentation_m = \"deep\"",
            "s.toml:24: start.indentation_m: is string \"deep\"; has to be a length in metres, or \"equilibrium\"",
        ),
        (
            "output_delay_ticks = 1",
            "output_delay_ticks = -1",
            "s.toml:40: actuators.output_delay_ticks: is integer `-1`; has to be a whole number, not negative",
        ),
        ("ideal = false", "ideal = 0", "s.toml:36: sensors.ideal: is integer `0`; has to be true or false"),
        ("[friction]", "[frction]", "s.toml:43: frction: unknown key; did you mean `friction`?"),
        (
            "seed = 1",
            "seed = 1970-01-01",
            "s.toml:6: a date means nothing here; use a number, a string, true or false",
        ),
        (
            "seed = 1",
            "seed = ",
            "s.toml:6: not TOML: string values must be quoted, expected literal string; see https://toml.io",
        ),
        (
            "name = \"cube\"",
            "name = \"a\\nb\"",
            "s.toml:3: name: is no name; has to be a word of at most 100 bytes, without control characters",
        ),
    ];
    for (from, to, expected) in cases {
        let found = replaced(from, to);
        if found != expected {
            println!(
                "F {found}
E {expected}"
            );
        }
    }
}

#[test]
fn errors_in_hands_and_objects_name_their_file() {
    let cases: &[(&str, &str)] = &[
        (
            "hand.joint.2.mass_kg=-1",
            "--set: hand.joint.2.mass_kg: -1.0 is out of range; has to be between 0.0 and 10000.0",
        ),
        ("hand.joint.2.mas_kg=1", "--set: hand.joint.2.mas_kg: unknown key; did you mean `mass_kg`?"),
        (
            "hand.joint.2.axis=[0, 2, 0]",
            "--set: hand.joint.2.axis: joint `finger-1-flex-1`: axis has to be a unit vector; divide it by its length",
        ),
        (
            "hand.joint.2.limits_rad=[1, -1]",
            "--set: hand.joint.2.limits_rad: joint `finger-1-flex-1`: limits have to be finite, the lower below the upper; write [lower, upper]",
        ),
        (
            "hand.joint.2.parent=finger-1-flex-3",
            "--set: hand.joint.2.parent: joint `finger-1-flex-3` does not come before this one; move it up",
        ),
        (
            "hand.joint.2.parent=finger-1-abdct",
            "--set: hand.joint.2.parent: there is no joint `finger-1-abdct`; did you mean `finger-1-abduct`?",
        ),
        (
            "hand.joint.2.name=finger-1-abduct",
            "--set: hand.joint.2.name: `finger-1-abduct` is there twice; rename one of them",
        ),
        (
            "hand.joint.2.inertia_kg_m2=[1, 1]",
            "--set: hand.joint.2.inertia_kg_m2: has 2 items; has to be [xx, yy, zz] or [xx, yy, zz, xy, xz, yz]",
        ),
        (
            "hand.joint.2.inertia_kg_m2=[1, 1, 1, 5, 0, 0]",
            "--set: hand.joint.2.inertia_kg_m2: joint `finger-1-flex-1`: inertia has to be symmetric and positive semidefinite; give the inertia about the mass centre as [xx, yy, zz, xy, xz, yz]",
        ),
        (
            "hand.joint.2.nominal_rad=5",
            "--set: hand.joint.2.nominal_rad: 5.0 is outside the limits; has to be between -1.2 and 1.6",
        ),
        (
            "hand.joint.13.mass_kg=1",
            "--set: hand.joint.13.mass_kg: the list has no `13`; use a number from 1 to 12, a name, or * for all",
        ),
        ("hand.joint=[]", "--set: hand.joint: the hand has no joint; add a [[joint]]"),
        (
            "hand.fingertip=[]",
            "--set: hand.fingertip: the hand has 0 fingertips: grasping needs at least two; add a [[fingertip]]",
        ),
        (
            "hand.fingertip.1.link=wrist",
            "--set: hand.fingertip.1.link: there is no joint `wrist`; known: finger-1-abduct, finger-1-flex-1, finger-1-flex-2, finger-1-flex-3, finger-2-abduct, finger-2-flex-1, finger-2-flex-2, finger-2-flex-3, finger-3-abduct, finger-3-flex-1, finger-3-flex-2, finger-3-flex-3",
        ),
        (
            "hand=four-finger",
            "--set: hand: no built-in hand is called `four-finger`; known: three-finger (a path has to end in .toml or contain a /)",
        ),
        (
            "object.mass_kg=0",
            "--set: object.mass_kg: 0.0 is out of range; has to be between 1e-9 and 10000.0",
        ),
        (
            "object.density_kg_m3=100",
            "--set: object.density_kg_m3: mass and density are both given; leave one out",
        ),
        (
            "object.inertia_kg_m2=[1, 1, 0]",
            "--set: object.inertia_kg_m2: is not positive definite; give the inertia about the centre of mass as [xx, yy, zz, xy, xz, yz], or leave it out",
        ),
        (
            "object.shape.box.size_m.1=0",
            "objects/cube.toml:9: object.shape.box.size_m: the length along x has to be positive and finite, not 0.0; describe a convex body in metres",
        ),
        (
            "object.shape.box.size_m.1=48",
            "objects/cube.toml:8: object.shape: reaches 2.400e1 m from its centre of mass; give lengths in metres, between 0.1 mm and 10 m",
        ),
        ("object.shape.box.sze=1", "--set: object.shape.box.sze: unknown key; did you mean `size_m`?"),
        (
            "object.shape.prsm.side_m=1",
            "objects/cube.toml:8: object.shape: has 2 keys; give one of box, prism, polygon_prism, hull",
        ),
        (
            "object.shape={pyramid = {}}",
            "--set: object.shape.pyramid: `pyramid` is unknown; known: box, prism, polygon_prism, hull",
        ),
        (
            "object.shape={hull={points_m=[[0,0,0],[1,0,0],[0,1,0],[1,1,0]]}}",
            "--set: object.shape.hull.points_m: all points lie in one plane: no volume; describe a convex body in metres",
        ),
        (
            "start.trunk_rad.elbow=1",
            "--set: start.trunk_rad.elbow: there is no joint `elbow`; nothing is known here",
        ),
        (
            "start.angles_rad=[0, 1]",
            "--set: start.angles_rad: 2 angles for 12 joints; give one for each joint, in the hand's order",
        ),
        (
            "pose.quaternion_wxyz=[1, 0, 0, 0]",
            "--set: pose.quaternion_wxyz: angles and quaternion are both given; leave one out",
        ),
        ("control=4", "--set: control: is integer `4`; has to be a table"),
        (
            "duration_s.x=3",
            "--set: duration_s.x: `x` is below a value that is neither table nor list; leave it out",
        ),
        ("nonsense", "--set: nonsense: is not a setting; write KEY=VALUE, such as control.force_n=4"),
        ("=4", "--set: =4: is not a setting; write KEY=VALUE, such as control.force_n=4"),
    ];
    for (setting, expected) in cases {
        let error = load("cube", &[setting]).expect_err(setting).to_string();
        assert_eq!(error, *expected);
    }
    let deep = format!("{}=1", vec!["a"; 100_000].join("."));
    assert!(load("cube", &[&deep]).unwrap_err().to_string().len() < 1000);
    assert_eq!(
        load("cub", &[]).unwrap_err().to_string(),
        "cub: no built-in scene is called `cub`; did you mean `cube`? (a path has to end in .toml or contain a /)"
    );
}

#[test]
fn massless_fingers_are_refused() {
    let error = load(
        "cube",
        &["hand.joint.finger-2-flex-3.mass_kg=0", "hand.joint.finger-2-flex-3.inertia_kg_m2=[0, 0, 0]"],
    )
    .unwrap_err();
    assert_eq!(
        error.to_string(),
        "--set: hand.joint.8.mass_kg: joint `finger-2-flex-3` moves no mass; give its link a mass and an inertia"
    );
}

#[test]
fn what_is_odd_is_a_warning() {
    // The paper's printed object (Table I): 1.8 g, and an inertia that no 0.42 m body of that mass has.
    let scene =
        load("cube", &["object.mass_kg=1.8e-3", "object.inertia_kg_m2=[1.354e-3, 0.765e-3, 1.354e-3]"])
            .unwrap();
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].starts_with("object `cube`: its inertia needs mass outside of it"));
    assert_eq!(scene.inertia_kg_m2[(1, 1)], 0.765e-3);
    let scene = load("cube", &["object.inertia_kg_m2=[1e-7, 1e-7, 3e-7]"]).unwrap();
    assert!(scene.warnings[0].contains("larger than the sum of the two others"), "{:?}", scene.warnings);
    let scene = load("cube", &["hand.joint.2.inertia_kg_m2=[1e-5, 1e-5, 3e-5]"]).unwrap();
    assert!(scene.warnings[0].starts_with("link `finger-1-flex-1`"), "{:?}", scene.warnings);
}

#[test]
fn scenes_built_in_code_refuse_numbers_that_are_none() {
    let good = load("cube", &[]).unwrap().file;
    let fields: &[fn(&mut SceneFile) -> &mut f64] = &[
        |s| &mut s.duration_s,
        |s| &mut s.control.force_n,
        |s| &mut s.control.attitude_stiffness_nm,
        |s| &mut s.control.damping_scale,
        |s| &mut s.control.period_s,
        |s| &mut s.control.soft_start_s,
        |s| &mut s.control.estimator_bandwidth_hz,
        |s| &mut s.sensors.noise_counts,
        |s| &mut s.friction.scale,
        |s| &mut s.plant.substep_s,
        |s| &mut s.plant.gravity_m_s2[2],
        |s| &mut s.pose.position_m[1],
        |s| &mut s.pose.rotation_rpy_rad.as_mut().unwrap()[0],
        |s| &mut s.contacts[0].point_m.as_mut().unwrap()[2],
        |s| s.object.mass_kg.as_mut().unwrap(),
        |s| &mut s.hand.joints[1].offset_m[0],
        |s| &mut s.hand.joints[1].rotation_rpy_rad[0],
        |s| &mut s.hand.joints[1].axis[0],
        |s| &mut s.hand.joints[1].limits_rad[0],
        |s| &mut s.hand.joints[1].limits_rad[1],
        |s| &mut s.hand.joints[1].nominal_rad,
        |s| &mut s.hand.joints[1].mass_kg,
        |s| &mut s.hand.joints[1].mass_centre_m[0],
        |s| &mut s.hand.joints[1].inertia_kg_m2.0[0],
        |s| &mut s.hand.joints[1].damping_gain_nm_s_rad,
        |s| &mut s.hand.joints[1].torque_limit_nm,
        |s| &mut s.hand.joints[1].speed_limit_rad_s,
        |s| &mut s.hand.joints[1].encoder_counts_per_turn,
        |s| &mut s.hand.joints[1].viscous_friction_nm_s_rad,
        |s| &mut s.hand.joints[1].coulomb_friction_nm,
        |s| &mut s.hand.joints[1].presliding_rad,
        |s| &mut s.hand.fingertips[1].offset_m[0],
        |s| &mut s.hand.fingertips[1].radius_m,
        |s| &mut s.hand.fingertips[1].stiffness_n_m2,
        |s| &mut s.hand.fingertips[1].damping_n_s_m_per_m2,
        |s| &mut s.hand.fingertips[1].torsional_damping_nm_s_rad_per_m2,
    ];
    for (k, field) in fields.iter().enumerate() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
            let mut file = good.clone();
            *field(&mut file) = value;
            assert!(Scene::build(file).is_err(), "field {k} with {value}");
        }
        for value in [0.0, -0.0, 1e-300, f64::MIN_POSITIVE, -1.0, 1.0] {
            let mut file = good.clone();
            *field(&mut file) = value;
            if let Ok(scene) = Scene::build(file) {
                assert!(scene.start.angles_rad.iter().all(|angle| angle.is_finite()));
            }
        }
    }
    for indentation in [f64::NAN, 0.0, -1e-3, 0.015, f64::INFINITY] {
        let mut file = good.clone();
        file.start.indentation_m = Indentation::Metres(indentation);
        assert!(Scene::build(file).is_err());
    }
}

#[test]
fn random_polyhedra_make_scenes_in_code() {
    let mut numbers = Numbers(11);
    let base = load("prism-ideal", &[]).unwrap().file;
    let mut made = 0;
    for _ in 0..60 {
        let points: Vec<[f64; 3]> = (0..8).map(|_| (numbers.vector().normalize() * 0.03).into()).collect();
        let shape = Polyhedron::hull(&points.iter().map(|&p| p.into()).collect::<Vec<_>>()).unwrap();
        let mut file = base.clone();
        file.object.shape = ShapeFile::Hull { points_m: points };
        // The face that looks most towards each finger.
        let towards = [[0.0, -1.0], [0.866, 0.5], [-0.866, 0.5]].map(|[x, y]| Vector3::new(x, y, 0.0));
        file.contacts = towards
            .iter()
            .map(|way| {
                let along = |k: &usize| shape.faces[*k].normal.dot(way);
                let face = (0..shape.faces.len()).max_by(|a, b| along(a).total_cmp(&along(b)));
                ContactFile { face, point_m: None }
            })
            .collect();
        match Scene::build(file) {
            Ok(scene) => {
                assert_touches(&scene);
                assert_eq!(parse(&scene.effective_toml()).unwrap(), scene);
                made += 1;
            }
            Err(error) => {
                assert!(error.key.starts_with("contact") || error.key.starts_with("start"), "{error}")
            }
        }
    }
    println!("{made} of 60 random polyhedra placed");
    assert!(made > 30, "{made}");
}

#[test]
fn references_are_relative_to_the_file() {
    let folder = std::env::temp_dir().join(format!("blindgrasp-scene-test-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("parts")).unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_string()
    };
    write(
        "parts/block.toml",
        b"schema = 1\nname = \"block\"\ndensity_kg_m3 = 20\n[shape.box]\nsize_m = [0.048, 0.048, 0.048]\n",
    );
    let path = write("scene.toml", text("cube").replace("\"cube\"", "\"parts/block.toml\"").as_bytes());
    let scene = load(&path, &[]);
    // The name of the scene went with it.
    assert_eq!(scene.as_ref().map(|scene| scene.object_name.as_str()), Ok("block"));
    assert!((scene.unwrap().mass_kg - 20.0 * 0.048f64.powi(3)).abs() < 1e-15);

    // An error in a part names the part.
    let part =
        write("parts/block.toml", b"schema = 1\nname = \"block\"\nmass_kg = 1\n[shape.box]\nsize = 3\n");
    let part = part.replace("/parts", "/./parts").replace("/./", "/");
    assert_eq!(
        load(&path, &[]).unwrap_err().to_string(),
        format!("{part}:5: object.shape.box.size: unknown key; did you mean `size_m`?")
    );
    let not_text = write("latin.toml", b"schema = 1\nname = \"caf\xe9\"\n");
    assert_eq!(
        load(&not_text, &[]).unwrap_err().to_string(),
        format!("{not_text}:2: not UTF-8 text; save it as UTF-8")
    );
    let missing = folder.join("missing.toml").to_str().unwrap().to_string();
    assert_eq!(
        load(&missing, &[]).unwrap_err().to_string(),
        format!("{missing}: no such file; check the path")
    );
    let a_folder = folder.join("parts").to_str().unwrap().to_string();
    assert_eq!(
        load(&a_folder, &[]).unwrap_err().to_string(),
        format!("{a_folder}: not a file; name a .toml file")
    );
    let large = write("large.toml", &vec![b'#'; 5 << 20]);
    assert_eq!(
        load(&large, &[]).unwrap_err().to_string(),
        format!("{large}: 5 MiB are too many; check the path")
    );
    let windows = write("windows.toml", text("cube").replace('\n', "\r\n").as_bytes());
    assert_eq!(load(&windows, &[]).map(|scene| scene.name), Ok("cube".into()));
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Cuts a text into words, numbers, marks and blanks.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let class = |c: char| match c {
        'a'..='z' | 'A'..='Z' | '0'..='9' | '_' | '.' | '-' | '+' => 0,
        ' ' => 1,
        _ => 2,
    };
    for c in text.chars() {
        match tokens.last_mut() {
            Some(last) if class(c) < 2 && last.chars().next().map(class) == Some(class(c)) => last.push(c),
            _ => tokens.push(c.into()),
        }
    }
    tokens
}

#[test]
fn damaged_texts_never_panic() {
    let replacements = [
        "nan",
        "inf",
        "-inf",
        "-1",
        "0",
        "1",
        "1e300",
        "-1e300",
        "1e-300",
        "5e-324",
        "99999999999999999999",
        "true",
        "\"\"",
        "\"x\"",
        "[]",
        "{}",
        "[[]]",
        "[nan]",
        "1970-01-01",
        "=",
        "[",
        "]",
        "\"",
        "\u{0}",
        "\u{feff}",
        "\u{1f980}",
        "'''",
        "0x7fffffffffffffff",
        "4294967296",
        "18446744073709551615",
        "equilibrium",
        "-0.0",
        "\\",
        "..",
        "1.7976931348623157e308",
    ];
    let huge = format!("[{}]", "0.1,".repeat(20_000));
    let deep = "[".repeat(5_000);
    let mut numbers = Numbers(5);
    let sources: Vec<Vec<String>> = ["cube", "prism-ideal"]
        .into_iter()
        .flat_map(|name| [tokens(text(name)), tokens(&load(name, &[]).unwrap().effective_toml())])
        .chain([tokens(&{
            let mut file = load("cube", &[]).unwrap().file;
            file.object.shape = ShapeFile::Hull {
                points_m: Polyhedron::cuboid([0.048; 3])
                    .unwrap()
                    .vertices_m
                    .iter()
                    .map(|&v| v.into())
                    .collect(),
            };
            Scene::build(file).unwrap().effective_toml()
        })])
        .collect();
    let (mut accepted, mut refused) = (0, 0);
    for round in 0..2000 {
        let mut tokens = sources[round % sources.len()].clone();
        for _ in 0..1 + numbers.below(3) {
            let at = numbers.below(tokens.len());
            match numbers.below(8) {
                0 => {
                    tokens.remove(at);
                }
                1 => tokens.insert(at, tokens[at].clone()),
                2 => {
                    let other = numbers.below(tokens.len());
                    tokens.swap(at, other);
                }
                3 => tokens.truncate(at.max(1)),
                4 if round % 50 == 0 => {
                    tokens[at] = if numbers.below(2) == 0 { huge.clone() } else { deep.clone() }
                }
                _ => tokens[at] = replacements[numbers.below(replacements.len())].into(),
            }
        }
        match parse(&tokens.concat()) {
            Ok(scene) => {
                accepted += 1;
                assert!(scene.start.angles_rad.iter().all(|angle| angle.is_finite()));
                assert!(scene.inertia_kg_m2.iter().all(|v| v.is_finite()));
                assert_touches(&scene);
            }
            Err(error) => {
                refused += 1;
                let line = error.to_string();
                assert!(!line.contains('\n') && line.len() < 900, "{line}");
            }
        }
    }
    println!("{accepted} damaged texts accepted, {refused} refused");
    assert!(accepted > 100 && refused > 100);
}
