//! Shapes of links as capsules.

use super::*;
use crate::file::CapsuleFile;
use blindgrasp_body::{MAX_JOINTS, Part, Posture};
use blindgrasp_meshes::Numbers;
use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use roxmltree::{Document, Node};

/// Two fingers with shapes of every kind, also behind fixed joints and a joint that is held still.
const SHAPES: &str = include_str!("shapes.urdf");

fn hand(tail: &str) -> String {
    let toml = changed(HAND, "base = \"palm\"", "base = \"palm\"\nlocked_rad = { bend = 0.4 }");
    format!("{toml}{tail}")
}

/// Three numbers of an attribute; zero without.
fn triple(node: Option<Node<'_, '_>>, name: &str) -> Vector3<f64> {
    let text = node.and_then(|node| node.attribute(name)).unwrap_or("0 0 0");
    Vector3::from_iterator(text.split_whitespace().map(|word| word.parse::<f64>().unwrap()))
}

fn find<'a, 'b>(node: Node<'a, 'b>, tag: &str) -> Option<Node<'a, 'b>> {
    node.children().find(|child| child.has_tag_name(tag))
}

/// `<origin>` as its definition has it: turned about fixed x, y and z in this order, then moved.
fn origin(node: Node<'_, '_>) -> (Matrix3<f64>, Vector3<f64>) {
    let origin = find(node, "origin");
    let turn = triple(origin, "rpy");
    let about = |axis: Unit<Vector3<f64>>, angle: f64| Rotation3::from_axis_angle(&axis, angle);
    let attitude = about(Vector3::z_axis(), turn.z)
        * about(Vector3::y_axis(), turn.y)
        * about(Vector3::x_axis(), turn.x);
    (attitude.into_inner(), triple(origin, "xyz"))
}

/// A point of a link's frame in that of the palm, by following the file's joints upwards.
fn in_palm(
    document: &Document<'_>,
    link: &str,
    point: Vector3<f64>,
    angle: &dyn Fn(&str) -> f64,
) -> Vector3<f64> {
    if link == "palm" {
        return point;
    }
    let is_carrier = |node: &Node<'_, '_>| {
        node.has_tag_name("joint") && find(*node, "child").unwrap().attribute("link") == Some(link)
    };
    let joint = document.descendants().find(is_carrier).unwrap();
    let (attitude, offset) = origin(joint);
    let turn = match joint.attribute("type") {
        Some("revolute") => Rotation3::from_axis_angle(
            &Unit::new_normalize(triple(find(joint, "axis"), "xyz")),
            angle(joint.attribute("name").unwrap()),
        ),
        _ => Rotation3::identity(),
    };
    let parent = find(joint, "parent").unwrap().attribute("link").unwrap();
    in_palm(document, parent, attitude * (turn * point) + offset, angle)
}

/// The capsules that the shapes of the file were made for, by hand: link, ends in the frame of the shape, radius.
fn expected() -> Vec<(&'static str, usize, [[f64; 3]; 2], f64)> {
    let mut expected = Vec::new();
    // The palm, 60 x 80 x 20 mm: three as thick as it is, side by side along x.
    for x in [-0.02, 0.0, 0.02] {
        expected.push(("palm", 0, [[x, -0.03, 0.0], [x, 0.03, 0.0]], 0.01));
    }
    // A disc of 20 mm and 10 mm: chords of the circle of 15 mm.
    let chord = (0.015_f64 * 0.015 - 0.005 * 0.005).square_root();
    for (y, half) in [(-0.015, 0.0), (-0.005, chord), (0.005, chord), (0.015, 0.0)] {
        expected.push(("mount", 0, [[-half, y, 0.0], [half, y, 0.0]], 0.005));
    }
    expected.push(("left-1", 0, [[0.0, 0.0, -0.012], [0.0, 0.0, 0.012]], 0.008));
    expected.push(("left-plate", 0, [[-0.01, 0.0, 0.0], [0.01, 0.0, 0.0]], 0.003));
    expected.push(("left-2", 0, [[0.0, 0.0, -0.006], [0.0, 0.0, 0.006]], 0.004));
    expected.push(("left-2", 1, [[0.0; 3]; 2], 0.007));
    expected.push(("right-bent", 0, [[0.0, 0.0, -0.01], [0.0, 0.0, 0.01]], 0.005));
    expected
}

/// Ends of all capsules in random postures, by the hand's own kinematics and by the file's.
///
/// Tolerance: a dozen rotations of vectors of a decimetre.
#[test]
fn capsules_are_where_the_shapes_are() {
    let (file, hand, warnings) = load(&hand(""), SHAPES).unwrap();
    assert_eq!(warnings, Vec::<String>::new());
    let capsules = file.capsules(&hand);
    let expected = expected();
    let links: Vec<Option<&str>> = file.capsules.iter().map(|capsule| capsule.link.as_deref()).collect();
    assert_eq!(
        links,
        [vec![None; 7], vec![Some("left-base"); 2], vec![Some("left-knuckle"); 2], vec![Some("right-base")]]
            .concat()
    );
    let document = Document::parse(SHAPES).unwrap();
    let mut numbers = Numbers(3);
    for _ in 0..20 {
        let mut angles = [0.0; MAX_JOINTS];
        angles.iter_mut().for_each(|angle| *angle = numbers.vector().x);
        let angle = |name: &str| match file.joints.iter().position(|joint| joint.name == name) {
            Some(k) => angles[k],
            None => 0.4,
        };
        let mut posture = Posture::at_base();
        hand.forward_kinematics(&angles, &mut posture);
        for (k, (link, shape, ends, radius_m)) in expected.iter().enumerate() {
            assert!((capsules[k].radius_m - radius_m).abs() < 1e-15, "{k}");
            let is_link =
                |node: &Node<'_, '_>| node.has_tag_name("link") && node.attribute("name") == Some(link);
            let node = document.descendants().find(is_link).unwrap();
            let collision =
                node.children().filter(|child| child.has_tag_name("collision")).nth(*shape).unwrap();
            let (attitude, offset) = origin(collision);
            let found = Part::Capsule(k).ends_m(&posture, &capsules);
            for (found, end) in found.iter().zip(ends) {
                let expected = in_palm(&document, link, attitude * Vector3::from(*end) + offset, &angle);
                assert!((found - expected).norm() < 1e-15, "{k}: {found} {expected}");
            }
        }
    }
}

/// A capsule around a fingertip ends where its round end reaches the fingertip's centre; a shape that is the fingertip is none.
#[test]
fn fingertips_stay_free() {
    let with = |collision: &str| {
        let urdf = changed(
            GRIPPER,
            "<collision><geometry><sphere radius=\"0.01\"/></geometry></collision>",
            &format!("<collision>{collision}</collision>"),
        );
        load(HAND, &urdf).unwrap().0.capsules
    };
    assert_eq!(with("<geometry><sphere radius=\"0.01\"/></geometry>"), []);
    assert_eq!(with("<geometry><sphere radius=\"0.02\"/></geometry>"), []);
    assert_eq!(with("<geometry><box size=\"0.02 0.03 0.04\"/></geometry>"), []);
    let apart = |capsules: &[CapsuleFile]| {
        let [capsule] = capsules else { panic!("{capsules:?}") };
        let centre = Vector3::new(0.0, 0.005, 0.04);
        [capsule.from_m, capsule.to_m].map(|end| (Vector3::from(end) - centre).norm())
    };
    // Of a radius less than the fingertip's, and of one that is larger.
    for (radius, stays) in [(0.004, 0.01), (0.012, 0.012)] {
        let shape = format!(
            "<origin xyz=\"0 0 -0.02\"/><geometry><capsule radius=\"{radius}\" length=\"0.04\"/></geometry>"
        );
        let [far, near] = apart(&with(&shape));
        assert!((far - 0.04).abs() < 1e-15 && (near - stays).abs() < 1e-15, "{far} {near}");
    }
    // Aside from it, nothing is cut; within it, nothing is left.
    let aside = "<origin xyz=\"0.03 0 0\"/><geometry><capsule radius=\"0.01\" length=\"0.04\"/></geometry>";
    assert!(apart(&with(aside)).iter().all(|apart| (apart - 0.0013_f64.square_root()).abs() < 1e-15));
    assert_eq!(with("<geometry><capsule radius=\"0.002\" length=\"0.015\"/></geometry>"), []);
}

#[test]
fn a_file_s_own_capsules_replace_those_of_the_urdf() {
    assert_eq!(load(&format!("capsule = []\n{}", hand("")), SHAPES).unwrap().0.capsules, []);
    let own = "\n[capsule_defaults]\nradius_m = 0.004\nfriction = 0.3\n[[capsule]]\nfrom_m = [0.0, 0.0, 0.0]\nto_m = [0.0, 0.0, 0.01]\n\
               [[capsule]]\nlink = \"left-plate\"\nfrom_m = [0.0, 0.0, 0.0]\nto_m = [0.01, 0.0, 0.0]\n";
    let (file, ..) = load(&hand(own), SHAPES).unwrap();
    let [palm, plate] = &file.capsules[..] else { panic!("{:?}", file.capsules) };
    assert_eq!((&palm.link, palm.to_m, palm.friction), (&None, [0.0, 0.0, 0.01], Some(0.3)));
    // In the frame of the joint that carries it.
    assert_eq!((plate.link.as_deref(), plate.radius_m), (Some("left-base"), 0.004));
    let (sine, cosine) = 0.3_f64.sine_cosine();
    for (found, expected) in plate.to_m.iter().zip([0.01 * cosine, 0.012, 0.03 - 0.01 * sine]) {
        assert!((found - expected).abs() < 1e-17, "{:?}", plate.to_m);
    }
    // Defaults reach the URDF's, too.
    let (file, ..) = load(&hand("\n[capsule_defaults]\nfriction = 0.3\n"), SHAPES).unwrap();
    assert!(file.capsules.len() == 12 && file.capsules.iter().all(|capsule| capsule.friction == Some(0.3)));
    let line = 1 + hand(own).lines().position(|line| line == "link = \"left-plate\"").unwrap();
    for (from, to, expected) in [
        (
            "\"left-plate\"",
            "\"left-plat\"",
            "gripper.urdf has no link `left-plat`; did you mean `left-plate`?",
        ),
        (
            "\"left-plate\"",
            "\"world\"",
            "link `world` is not below the base; choose a link of the hand, or another base ([urdf])",
        ),
    ] {
        let toml = changed(&hand(own), from, to);
        assert_eq!(message(&toml, SHAPES), format!("hand.toml:{line}: capsule.2.link: {expected}"));
    }
}

#[test]
fn what_a_hand_can_t_have_is_told() {
    let ball = |k: usize, radius: f64| {
        format!(
            "<collision><origin xyz=\"0 0 {}\"/><geometry><sphere radius=\"{radius}\"/></geometry></collision>",
            -0.01 * k as f64
        )
    };
    let balls = |count: usize, radius: f64| {
        let balls: String = (0..count).map(|k| ball(k, radius)).collect();
        changed(GRIPPER, "<link name=\"palm\">", &format!("<link name=\"palm\">{balls}"))
    };
    let (file, _, warnings) = load(HAND, &balls(64, 0.01)).unwrap();
    assert_eq!((file.capsules.len(), warnings), (64, vec![]));
    let (file, _, warnings) = load(HAND, &balls(65, 0.01)).unwrap();
    assert_eq!(file.capsules, []);
    assert_eq!(
        warnings,
        [
            "gripper.urdf:3: its <collision> shapes make 65 capsules, of which a hand may have 64: links touch nothing; give the hand's file [[capsule]]s of its own"
        ]
    );
    // As many flat boxes as there may be elements: bounded time and room.
    let flat = "<collision><geometry><box size=\"1 8 8\"/></geometry></collision>".repeat(60_000);
    let (file, _, warnings) =
        load(HAND, &changed(GRIPPER, "<link name=\"palm\">", &format!("<link name=\"palm\">{flat}")))
            .unwrap();
    assert!(file.capsules.is_empty() && warnings[0].contains("make 480000 capsules"), "{warnings:?}");
    let (file, _, warnings) = load(HAND, &balls(2, 1e-5)).unwrap();
    assert_eq!(file.capsules, []);
    assert_eq!(
        warnings,
        [
            "gripper.urdf:3: 2 capsules of its <collision> shapes are too small or too large: they touch nothing; give the hand's file [[capsule]]s of its own"
        ]
    );
}

/// Written as a URDF and read again, capsules are the same to the bit: cylinders with a sphere on each end, or balls. So are
/// fingertips, whatever is around them.
#[test]
fn capsules_survive_an_export() {
    let mut numbers = Numbers(8);
    for name in HandFile::built_in() {
        let mut original = HandFile::load(name).unwrap();
        let links = std::iter::once(None).chain(original.joints.iter().map(|joint| Some(joint.name.clone())));
        original.capsules = links
            .enumerate()
            .flat_map(|(k, link)| {
                let mut capsule = || {
                    let [from_m, to_m] = [numbers.vector(), numbers.vector()].map(|v| (v * 0.03).into());
                    let radius_m = 0.005 + 0.004 * numbers.vector().x;
                    CapsuleFile { link: link.clone(), from_m, to_m, radius_m, friction: None }
                };
                let (first, second) = (capsule(), capsule());
                let ball = CapsuleFile { to_m: second.from_m, ..second.clone() };
                if k % 2 == 0 { vec![first, ball] } else { vec![ball, first, second] }
            })
            .collect();
        let toml = "schema = 1\nname = \"again\"\n[urdf]\nfile = \"gripper.urdf\"\n[joint_defaults]\n\
                    damping_gain_nm_s_rad = 1e-3\nencoder_counts_per_turn = 4096\n";
        let tips = original.fingertips.iter().map(|tip| {
            format!(
                "[[fingertip]]\nname = {0:?}\nlink = \"{0}-tip\"\noffset_m = [0.0, 0.0, 0.0]\nradius_m = {1:?}\n\
                 stiffness_n_m2 = 1e6\ndamping_n_s_m_per_m2 = 1.0\ntorsional_damping_nm_s_rad_per_m2 = 1e4\n",
                tip.name, tip.radius_m
            )
        });
        let toml = format!("{toml}{}", tips.collect::<String>());
        original.capsules.truncate(64);
        let (again, ..) = load(&toml, &original.to_urdf()).unwrap();
        assert_eq!(again.capsules, original.capsules, "{name}");
        for (ours, theirs) in again.fingertips.iter().zip(&original.fingertips) {
            assert_eq!((&ours.link, ours.offset_m), (&theirs.link, theirs.offset_m));
        }
    }
}

/// A wide box has as many as there may be beside each other, spread evenly.
#[test]
fn flat_boxes_are_covered() {
    let with = |size: &str| {
        let shape = format!("<collision><geometry><box size=\"{size}\"/></geometry></collision>");
        let urdf = changed(GRIPPER, "<link name=\"palm\">", &format!("<link name=\"palm\">{shape}"));
        load(HAND, &urdf).unwrap().0.capsules
    };
    let places = |capsules: &[CapsuleFile]| capsules.iter().map(|it| it.from_m[1]).collect::<Vec<_>>();
    let close = |found: &[f64], expected: &[f64]| {
        found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15)
    };
    assert!(close(&places(&with("0.04 0.01 0.01")), &[0.0]));
    assert!(close(&places(&with("0.04 0.0101 0.01")), &[-0.00005, 0.00005]));
    assert!(close(&places(&with("0.04 0.03 0.01")), &[-0.01, 0.0, 0.01]));
    let wide = with("0.2 0.16 0.01");
    assert_eq!(wide.len(), 8);
    assert!(wide.iter().all(|it| it.radius_m == 0.005 && (it.to_m[0] - 0.095).abs() < 1e-15));
    assert!((wide[7].from_m[1] - 0.075).abs() < 1e-15);
}
