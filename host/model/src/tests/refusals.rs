//! Scenes that are wrong: the very message that each mistake gets.

use super::cases::cases;
use super::*;
use crate::file::CapsuleFile;

/// The whole message of a scene that has to be refused.
fn message(text: &str) -> String {
    let error = parse(text).expect_err("has to be refused").to_string();
    assert!(!error.contains('\n'), "{error}");
    error
}

#[test]
fn errors_say_where_what_and_what_to_do() {
    for case in cases(include_str!("scene.cases")) {
        case.check(text("cube"), message);
    }
}

#[test]
fn errors_in_hands_and_objects_name_their_file() {
    for case in cases(include_str!("settings.cases")) {
        let setting = case.edits[0].0.as_str();
        let error = load("cube", &[setting]).expect_err(setting).to_string();
        assert_eq!(error, case.said[0].1);
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
    let mut good = load("cube", &[]).unwrap().file;
    let palm =
        CapsuleFile { link: None, from_m: [0.0; 3], to_m: [0.01, 0.0, 0.0], radius_m: 1e-3, friction: None };
    good.hand.capsules.push(palm);
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
        |s| s.plant.substep_s.get_or_insert(1e-4),
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
        |s| &mut s.hand.joints[1].rotor_inertia_kg_m2,
        |s| s.hand.fingertips[1].friction.get_or_insert(0.5),
        |s| s.hand.fingertips[1].torsional_friction_m.get_or_insert(1e-3),
        |s| s.object.friction.get_or_insert(0.5),
        |s| &mut s.hand.capsules[0].from_m[0],
        |s| &mut s.hand.capsules[0].to_m[2],
        |s| &mut s.hand.capsules[0].radius_m,
        |s| s.hand.capsules[0].friction.get_or_insert(0.5),
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
fn a_hand_has_at_most_64_capsules() {
    let mut file = load("cube", &[]).unwrap().file;
    let ball = CapsuleFile { link: None, from_m: [0.0; 3], to_m: [0.0; 3], radius_m: 1e-3, friction: None };
    file.hand.capsules = vec![ball.clone(); 64];
    assert!(Scene::build(file.clone()).is_ok());
    file.hand.capsules.push(ball);
    assert_eq!(
        Scene::build(file).unwrap_err().to_string(),
        "hand.capsule: the hand has 65 capsules: at most 64 are supported; leave some out"
    );
}

/// A hand that begins open touches nothing, and stands where the scene says.
#[test]
fn a_hand_that_begins_open_touches_nothing() {
    for (scene, settings, said) in [
        (
            "pick-cube",
            &["start.posture=opn"][..],
            "--set: start.posture: the hand `three-finger` has no posture `opn`; did you mean `open`?",
        ),
        (
            "pick-cube",
            &["start.angles_rad=[0]"],
            "scenes/pick-cube.toml:15: start.posture: angles are given as well; leave start.posture or start.angles_rad out",
        ),
        (
            "cube",
            &["contact=[]"],
            "--set: contact: 0 contacts for 3 fingertips; give one [[contact]] for each fingertip, in the hand's order; or none, and \
             start.posture: then the hand begins open",
        ),
        (
            "cube",
            &["contact=[]", "start.posture=open"],
            "--set: start.posture: fingertips that roll touch the object from the start on, and no [[contact]] says where; a hand that \
             begins open needs plant.contact = \"coulomb\"",
        ),
        (
            "pick-cube",
            &["start.posture=preshape", "pose.position_m.2=-0.0205"],
            "--set: start.posture: fingertip `finger-1` is 10.490 mm inside the object at the start; open the hand wider, or move the \
             object (pose.position_m)",
        ),
        (
            "pick-cube",
            &["pose.position_m.3=0.13"],
            "scenes/pick-cube.toml:30: plant.table.1.point_m: the object is 5.000 mm inside the table; move the table or the object's pose",
        ),
        (
            "pick-cube",
            &["pose.position_m.3=0.03"],
            "scenes/pick-cube.toml:25: plant.links: the palm (capsule 3) is 4.000 mm inside the object at the start; move contacts or \
             object, correct the hand's capsules, or set it to false",
        ),
        (
            "cube-table",
            &["start.posture=open"],
            "scenes/cube-table.toml:15: contact.1: fingertip `finger-1` is 35.994 mm away from its face; change start.angles_rad or the pose",
        ),
    ] {
        assert_eq!(load(scene, settings).expect_err(said).to_string(), said);
    }
    let thick = ["hand.fingertip.*.radius_m=0.07", "pose.position_m.1=0.3", "plant.table=[]"];
    let near = load("pick-cube", &thick).expect_err("fingertips in each other");
    assert_eq!((near.key.as_str(), near.remedy.as_str()), ("start", "open the hand wider"));
    let falls = load("pick-cube", &["pose.position_m.3=0.12"]).unwrap();
    assert_eq!(
        falls.warnings,
        ["pose.position_m: the object lies on no table, and the hand is open: it falls"]
    );
    let scene = load("pick-cube", &[]).unwrap();
    assert_eq!(scene.start.angles_rad, scene.file.hand.postures[0].angles_rad);
    assert!(scene.contacts.is_empty() && scene.start.points_m.is_empty());
    assert_eq!(parse(&scene.effective_toml()).unwrap(), scene);
    let angles = format!("start={{angles_rad={:?}}}", scene.start.angles_rad);
    assert_eq!(load("pick-cube", &[&angles]).unwrap().start, scene.start);
}

/// With links switched off, only fingertips are in each other's way.
#[test]
fn links_may_be_inside_each_other_where_they_do_not_touch() {
    let (thick, deep) = ("hand.capsule.*.radius_m=0.03", "plant.table.1.point_m.3=0.3");
    let error = load("cube-table", &[thick, deep]).unwrap_err();
    assert_eq!(error.key, "plant.links");
    let error = load("cube-table", &[thick]).unwrap_err();
    assert_eq!(error.key, "plant.table.1.point_m");
    assert!(load("cube-table", &[thick, "plant.links=false"]).is_ok());
    assert!(load("cube", &[thick]).is_ok(), "nothing touches but fingertips where they roll");
    let mut crossing = vec!["contact.1.point_m=[0.02, -0.024, 0]", "contact.2.point_m=[0.024, -0.02, 0]"];
    let rolling = load("cube", &crossing).unwrap();
    assert!(rolling.warnings[0].starts_with("fingertips `finger-1` and `finger-2` overlap"));
    crossing.push("plant.links=false");
    assert_eq!(load("cube-table", &crossing).unwrap_err().key, "contact.2.point_m");
    let into_object = "hand.capsule.6.radius_m=0.018";
    let error = load("over-an-edge", &[into_object]).unwrap_err();
    assert!(
        error.problem.starts_with("link `finger-1-flex-3` (capsule 6) is ") && error.key == "plant.links"
    );
    assert!(error.problem.ends_with(" mm inside the object at the start"), "{error}");
    assert!(load("over-an-edge", &[into_object, "plant.links=false"]).is_ok());
    // A palm touches no table.
    assert!(
        load("cube-table", &["hand.capsule.1.from_m=[0, -1, 1]", "hand.capsule.1.to_m=[0, -1, 1]"]).is_ok()
    );
}
