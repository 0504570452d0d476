//! Exported scenes, read back.

use crate::Scene;
use crate::tests::load;
use blindgrasp_body::pairs as parts_pairs;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
use std::f64::consts::PI;

fn numbers(node: Node<'_, '_>, attribute: &str) -> Vec<f64> {
    let text = node.attribute(attribute).unwrap_or_else(|| panic!("{attribute} of {node:?}"));
    text.split(' ').map(|number| number.parse().unwrap()).collect()
}

fn number(node: Node<'_, '_>, attribute: &str) -> f64 {
    numbers(node, attribute)[0]
}

fn named<'a, 'i>(document: &'a Document<'i>, tag: &str, name: &str) -> Node<'a, 'i> {
    let is = |node: &Node<'_, '_>| node.has_tag_name(tag) && node.attribute("name") == Some(name);
    document.descendants().find(is).unwrap_or_else(|| panic!("<{tag} name={name}>"))
}

fn inertial<'a, 'i>(body: Node<'a, 'i>) -> Node<'a, 'i> {
    body.children().find(|node| node.has_tag_name("inertial")).unwrap()
}

fn quaternion(node: Node<'_, '_>) -> UnitQuaternion<f64> {
    let wxyz = numbers(node, "quat");
    UnitQuaternion::new_unchecked(Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]))
}

/// Every joint, mass and inertia of a scene's file stands in the export, to the bit; nothing else has a mass.
fn assert_whole(scene: &Scene) {
    let text = scene.to_mjcf().unwrap().text;
    let document = Document::parse(&text).unwrap();
    let bodies = document.descendants().filter(|node| node.has_tag_name("body"));
    let masses_kg: f64 = bodies
        .flat_map(|body| body.children())
        .filter(|node| node.has_tag_name("inertial"))
        .map(|i| number(i, "mass"))
        .sum();
    let expected_kg = scene.mass_kg + scene.file.hand.joints.iter().map(|joint| joint.mass_kg).sum::<f64>();
    assert!((masses_kg / expected_kg - 1.0).abs() < 1e-12, "{masses_kg} {expected_kg}");
    for (k, joint) in scene.file.hand.joints.iter().enumerate() {
        let hinge = named(&document, "joint", &joint.name);
        let body = hinge.parent().unwrap();
        assert_eq!(body.attribute("name"), Some(&*format!("{}-link", joint.name)));
        let parent = joint.parent.as_ref().map(|parent| format!("{parent}-link"));
        assert_eq!(body.parent().unwrap().attribute("name"), parent.as_deref());
        assert_eq!(numbers(body, "pos"), joint.offset_m);
        let [roll, pitch, yaw] = joint.rotation_rpy_rad;
        assert!(quaternion(body).angle_to(&UnitQuaternion::from_euler_angles(roll, pitch, yaw)) < 1e-7);
        assert_eq!(numbers(hinge, "axis"), joint.axis);
        assert_eq!(numbers(hinge, "range"), joint.limits_rad);
        assert_eq!(number(hinge, "damping"), joint.viscous_friction_nm_s_rad * scene.friction.scale);
        assert_eq!(number(hinge, "frictionloss"), joint.coulomb_friction_nm * scene.friction.scale);
        assert_eq!(number(hinge, "armature"), joint.rotor_inertia_kg_m2);
        let motor = named(&document, "motor", &joint.name);
        assert_eq!(numbers(motor, "ctrlrange"), [-joint.torque_limit_nm, joint.torque_limit_nm]);
        if joint.mass_kg > 0.0 {
            assert_eq!(number(inertial(body), "mass"), joint.mass_kg);
            assert_eq!(numbers(inertial(body), "pos"), joint.mass_centre_m);
            let given = &joint.inertia_kg_m2.0;
            assert_eq!(numbers(inertial(body), "fullinertia")[..given.len()], given[..]);
        }
        // The keyframe has the joints in the order of the file's bodies.
        let hinges: Vec<_> = document
            .descendants()
            .filter(|node| node.has_tag_name("joint") && node.has_attribute("name"))
            .collect();
        let place = hinges.iter().position(|node| *node == hinge).unwrap();
        assert_eq!(numbers(named(&document, "key", "start"), "qpos")[place], scene.start.angles_rad[k]);
    }
    for (tip, depth_m) in scene.file.hand.fingertips.iter().zip(super::settled_m(scene)) {
        for (name, radius_m) in [("tip", tip.radius_m), ("tip-core", tip.radius_m - depth_m)] {
            let sphere = named(&document, "geom", &format!("{}-{name}", tip.name));
            assert_eq!(sphere.parent().unwrap().attribute("name"), Some(&*format!("{}-link", tip.link)));
            assert_eq!((numbers(sphere, "pos"), number(sphere, "size")), (tip.offset_m.to_vec(), radius_m));
        }
    }
    let object = named(&document, "body", "object");
    assert_eq!(
        (number(inertial(object), "mass"), numbers(object, "pos")[..].to_vec()),
        (scene.mass_kg, scene.start.position_m.as_slice().to_vec())
    );
    let i = &scene.inertia_kg_m2;
    let moments = [i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]];
    assert_eq!(numbers(inertial(object), "fullinertia"), moments);
    let pairs = document.descendants().filter(|node| node.has_tag_name("pair")).count();
    let (fingers, tables) = (scene.fingertips.len(), scene.plant.tables.len());
    let moving = scene.capsules.iter().filter(|capsule| capsule.link.is_some()).count();
    let on_capsules = scene.capsules.len() + moving * tables;
    let in_hand = if scene.plant.links_touch() { parts_pairs(&scene.hand, &scene.capsules).len() } else { 0 };
    assert_eq!(pairs, fingers * (1 + tables) + tables + on_capsules + in_hand);
    for (k, capsule) in scene.file.hand.capsules.iter().enumerate() {
        let geom = named(&document, "geom", &format!("capsule-{}", k + 1));
        let body = capsule.link.as_ref().map(|link| format!("{link}-link"));
        assert_eq!(geom.parent().unwrap().attribute("name"), body.as_deref());
        assert_eq!(number(geom, "size"), capsule.radius_m);
        if capsule.from_m == capsule.to_m {
            assert_eq!(
                (geom.attribute("type"), numbers(geom, "pos")),
                (Some("sphere"), capsule.to_m.to_vec())
            );
        } else {
            assert_eq!(numbers(geom, "fromto"), [capsule.from_m, capsule.to_m].concat());
        }
    }
    for (t, table) in scene.plant.tables.iter().enumerate() {
        let body = named(&document, "body", &format!("table-{}", t + 1));
        assert_eq!((body.attribute("mocap"), numbers(body, "pos")), (Some("true"), table.point_m.to_vec()));
        assert!((quaternion(body) * Vector3::z() - Vector3::from(table.normal)).norm() < 1e-12);
    }
}

/// Hands with parents in an order that is not MJCF's, with an arm, with rotors; objects that are boxes and others.
#[test]
fn everything_is_in_it_to_the_bit() {
    let scenes = ["cube", "prism", "four-finger-cube", "brick-allegro", "hand-arm"];
    for name in scenes {
        let settings = [
            "plant.contact=coulomb",
            "actuators.torque_limits=true",
            "friction.scale=1.5",
            "plant.substep_s=1e-4",
        ];
        assert_whole(&load(name, &settings).unwrap());
    }
    assert_whole(&load("cube-table", &[]).unwrap());
    let other_normal = ["plant.table.1.normal=[0.0, 0.6, 0.8]", "plant.table.1.point_m=[0.0, 0.0, -1.0]"];
    assert_whole(&load("cube-table", &other_normal).unwrap());
}

/// Three capsules of the three-fingered hand: palm, a link, and a ball on another.
const CAPSULES: &str = "hand.capsule=[{ from_m = [-0.02, 0.0, -0.01], to_m = [0.02, 0.0, -0.01], radius_m = 0.01 }, \
    { link = \"finger-1-flex-2\", from_m = [0.0, 0.0, 0.0], to_m = [0.0, 0.0, 0.02], radius_m = 0.006, friction = 0.2 }, \
    { link = \"finger-2-flex-3\", from_m = [0.001, 0.0, 0.0], to_m = [0.001, 0.0, 0.0], radius_m = 0.005 }]";

/// The pairs of links and palm: hard and with friction of their own; with a fingertip as soft as that.
#[test]
fn links_touch_what_they_touch_in_ours() {
    let scene = load("cube-table", &[CAPSULES]).unwrap();
    assert_whole(&scene);
    let text = scene.to_mjcf().unwrap().text;
    let document = Document::parse(&text).unwrap();
    let pair = |first: &str, second: &str| {
        document.descendants().find(|node| {
            let are = |a, b| node.attribute("geom1") == Some(a) && node.attribute("geom2") == Some(b);
            are(first, second) || are(second, first)
        })
    };
    let friction = |first: &str, second: &str| {
        let pair = pair(first, second).unwrap_or_else(|| panic!("{first} and {second}"));
        assert_eq!(pair.attribute("condim"), Some("3"));
        (numbers(pair, "friction")[0], pair.attribute("solref").unwrap())
    };
    let sliding = scene.fingertip_friction[0].sliding;
    assert!(sliding > 0.2 && scene.capsule_friction == [sliding, 0.2, sliding]);
    assert_eq!(friction("capsule-1", "object"), (sliding, super::HARD));
    assert_eq!(friction("capsule-2", "object"), (0.2, super::HARD));
    assert_eq!(friction("capsule-2", "table-1"), (scene.plant.tables[0].friction, super::HARD));
    assert_eq!(friction("capsule-2", "capsule-3"), (0.2, super::HARD));
    let [tip, other] = ["finger-2-tip-core", "finger-3-tip-core"];
    let (of_tip, soft) = friction("capsule-2", tip);
    assert!(of_tip == 0.2 && soft != super::HARD && number(pair("capsule-2", tip).unwrap(), "margin") > 0.0);
    // Two fingertips give way twice as far.
    let margin = |first: &str, second: &str| number(pair(first, second).unwrap(), "margin");
    assert!((margin(tip, other) - margin(tip, "object") - margin(other, "object")).abs() < 1e-15);
    // The palm does not move, and links that are joined never touch.
    assert!(pair("capsule-1", "table-1").is_none());
    assert!(pair("capsule-1", "capsule-2").is_none() && pair("capsule-3", tip).is_none());
    let silent = load("cube-table", &[CAPSULES, "plant.links=false"]).unwrap();
    assert_whole(&silent);
    let text = silent.to_mjcf().unwrap().text;
    assert!(text.contains("name=\"capsule-3\"") && !text.contains("geom1=\"capsule"));
}

/// MuJoCo's law with the numbers of the file is ours where the grasp settles, in force and in slope.
#[test]
fn fingertips_press_as_ours_where_they_settle() {
    let scene = load("cube-table", &["object.mass_kg=0.3"]).unwrap();
    let text = scene.to_mjcf().unwrap().text;
    let document = Document::parse(&text).unwrap();
    let rotors = scene.rotors_kg_m2();
    for (i, tip) in scene.fingertips.iter().enumerate() {
        let core = format!("{}-tip-core", scene.file.hand.fingertips[i].name);
        let inverse_kg = super::yields_per_kg(&scene.hand, &rotors, scene.hand.fingertip_link(i));
        for (other, yields) in [("object", inverse_kg + 1.0 / 0.3), ("table-1", inverse_kg)] {
            let is = |node: &Node<'_, '_>| {
                node.attribute("geom1") == Some(&core) && node.attribute("geom2") == Some(other)
            };
            let pair = document.descendants().find(is).unwrap();
            let (solref, solimp) = (numbers(pair, "solref"), numbers(pair, "solimp"));
            // As MuJoCo's documentation has it, for a midpoint next to zero and a power of 2.
            let force_n = |depth_m: f64, rate_m_s: f64| {
                let x = depth_m / solimp[2];
                let impedance = solimp[0] + (1.0 - (1.0 - x).powi(2)) * (solimp[1] - solimp[0]);
                let pull = -solref[0] * impedance * impedance / (solimp[1] * solimp[1]) * depth_m
                    - solref[1] / solimp[1] * impedance * rate_m_s;
                pull / ((1.0 - impedance) * yields)
            };
            let depth_m = number(pair, "margin");
            let expected_n = tip.stiffness_n_m2 * depth_m * depth_m;
            assert!((force_n(depth_m, 0.0) / expected_n - 1.0).abs() < 1e-3);
            let slope = (force_n(1.001 * depth_m, 0.0) - force_n(0.999 * depth_m, 0.0)) / (0.002 * depth_m);
            assert!((slope / (2.0 * tip.stiffness_n_m2 * depth_m) - 1.0).abs() < 0.02, "{slope}");
            for share in [1.0 / 7.0, 0.2, 0.3, 0.4, 0.6, 0.8, 1.2, 1.5] {
                let ratio = force_n(share * depth_m, 0.0) / (share * share * expected_n);
                assert!((ratio - 1.0).abs() < 0.08, "{share}: {ratio}");
            }
            let damping = force_n(depth_m, 1.0) - force_n(depth_m, 0.0);
            let area_m2 = PI * (2.0 * tip.radius_m - depth_m) * depth_m;
            assert!((damping / (tip.damping_n_s_m3 * area_m2) - 1.0).abs() < 1e-3);
        }
    }
}

/// Yield of a link to a force against that from the kinetic energy of a hand of one joint: a point mass on a rod.
#[test]
fn a_link_yields_as_its_inertia_says() {
    let scene = load("cube-table", &[]).unwrap();
    let hand = &scene.hand;
    let rotors = scene.rotors_kg_m2();
    // The first joint moves nothing at its own link, which is a point on its axis; without rotors links yield more.
    assert!(super::yields_per_kg(hand, &rotors, 0).abs() < 1e-12);
    let last = hand.fingertip_link(0);
    let (with, without) = (super::yields_per_kg(hand, &rotors, last), super::yields_per_kg(hand, &[], last));
    // MuJoCo 4.0.1 has 9.79655336 for the body `finger-1-flex-3-link`.
    assert!((with - 9.796_553_36).abs() < 1e-7 && without > with, "{with} {without}");
}

#[test]
fn what_is_left_out_is_told() {
    let told = |settings: &[&str]| load("cube-table", settings).unwrap().to_mjcf().unwrap().left_out;
    let keys = |lines: Vec<String>| {
        lines.iter().map(|line| line.split(':').next().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(
        keys(told(&[])),
        ["plant.table.1.move", "plant.shake", "hand.joint.*.presliding_rad", "control, sensors, actuators"]
    );
    assert_eq!(
        keys(told(&["friction.scale=0", "plant.shake=[]", "plant.table=[]"])),
        ["control, sensors, actuators"]
    );
}

#[test]
fn fingertips_that_never_slip_are_refused() {
    assert_eq!(
        load("cube", &[]).unwrap().to_mjcf().unwrap_err().to_string(),
        "plant.contact: is \"rolling\": fingertips that never slip can't be said in MJCF; set it to \"coulomb\""
    );
}

#[test]
fn objects_that_are_not_convex_are_refused() {
    let scene = load("l-bracket", &["plant.contact=coulomb", "plant.links=false"]).unwrap();
    assert_eq!(
        scene.to_mjcf().unwrap_err().to_string(),
        "object.shape: `l-bracket` is not convex: MuJoCo would take its convex hull; export a scene with a convex object, such as its hull"
    );
}
