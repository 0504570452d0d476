//! Scenes that are wrong: the very message that each mistake gets.

use super::*;

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
            "substep_s = 1e-4",
            "substep_s = 1e-4\n[[plant.push]]\nfrom_s = 1\nfor_s = 0.2\nrise_s = 0.15\nforce_n = [1, 0, 0]",
            "s.toml:51: plant.push.1.rise_s: 0.15 is out of range; has to be between 0.0 and 0.1",
        ),
        (
            "substep_s = 1e-4",
            "substep_s = 1e-4\n[[plant.push]]\nfrom_s = 1\nfor_s = 0.2",
            "s.toml:48: plant.push.1.force_n: pushes with nothing; give a force_n, a moment_nm, or both",
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
        (
            "output_delay_ticks = 1",
            "output_delay_ticks = 1001",
            "s.toml:40: actuators.output_delay_ticks: 1001 is out of range; has to be a whole number from 0 to 1000",
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
            "s.toml:3: name: is not a name; has to be a word of at most 100 bytes, without control characters",
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
            "hand=five-finger",
            "--set: hand: no built-in hand is called `five-finger`; did you mean `four-finger`? (a path has to end in .toml or contain a /)",
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
            "objects/cube.toml:8: object.shape: reaches 2.400e1 m from its centre of mass; has to be between 0.1 mm and 10 m: give lengths in metres, and a mesh its unit",
        ),
        ("object.shape.box.sze=1", "--set: object.shape.box.sze: unknown key; did you mean `size_m`?"),
        (
            "object.shape.prsm.side_m=1",
            "objects/cube.toml:8: object.shape: has 2 keys; give one of box, prism, polygon_prism, hull, pyramid, mesh",
        ),
        (
            "object.shape={cylinder = {}}",
            "--set: object.shape.cylinder: `cylinder` is unknown; known: box, prism, polygon_prism, hull, pyramid, mesh",
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
fn scenes_built_in_code_refuse_numbers_that_are_none() {
    let good = load("cube", &[]).unwrap().file;
    let fields: &[fn(&mut SceneFile) -> &mut f64] = &[
        |s| &mut s.duration_s,
        |s| &mut s.control.gains.grasp[0],
        |s| &mut s.control.gains.grasp[1],
        |s| &mut s.control.gains.integral[0],
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
        |s| &mut s.hand.safety.slew_s,
        |s| &mut s.hand.safety.energy_travel_rad,
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
        |s| &mut s.hand.joints[1].torque_per_volt_nm_v,
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
