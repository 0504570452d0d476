//! Pictures: what is in them, for hands of any size.

use super::super::fixture;
use super::*;
use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_body::{Capsule, Hand, MAX_JOINTS, Posture};
use blindgrasp_model::inspect::hand::HandCheck;

fn count(svg: &str, words: &str) -> usize {
    svg.matches(words).count()
}

/// No element has a coordinate that is none, and every tag is closed.
fn assert_sound(svg: &str) {
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    for word in ["NaN", "inf", "e-", "e+"] {
        let numbers = svg.lines().filter(|line| !line.starts_with("<text") && !line.starts_with("<svg"));
        assert!(
            numbers
                .clone()
                .all(|line| !line.contains(&format!("\"{word}")) && !line.contains(&format!(" {word}"))),
            "{word}"
        );
    }
    assert_eq!(count(svg, "<text"), count(svg, "</text>"));
}

fn shipped(name: &str) -> String {
    let check = HandCheck::load(name).unwrap();
    let nominal = check.nominal.unwrap();
    hand_svg(&check.name, &nominal.hand, &nominal.capsules, &nominal.joint_names, &nominal.angles_rad)
}

#[test]
fn a_hand_has_all_its_parts_in_both_views() {
    let svg = shipped("three-finger");
    assert_sound(&svg);
    // Three fingertips; three links of each finger, and the palm of three.
    assert_eq!(count(&svg, "fill=\"url(#ball-"), 2 * 3);
    assert_eq!(count(&svg, "<linearGradient"), 2 * (3 * 3 + 3));
    for k in 1..=12 {
        // Its arrow in both views, and in the list.
        assert_eq!(count(&svg, &format!(">{k}</text>")), 3, "{k}");
    }
    for words in [">x</text>", ">y</text>", ">z</text>", ">tip 2</text>", " mm</text>"] {
        assert_eq!(count(&svg, words), 2, "{words}");
    }
    assert_eq!(count(&svg, ">finger-3-flex-2</text>"), 1);
    assert_eq!(svg, shipped("three-finger"), "the same bytes");
}

/// Two capsules across the palm and a ball, and one from each joint of a finger to the next, or to its fingertip.
fn capsules(hand: &Hand) -> Vec<Capsule> {
    let across = |y: f64| [-0.03, 0.03].map(|x| Vector3::new(x, y, -0.01));
    let palm = [across(-0.012), across(0.012), [Vector3::z() * -0.02; 2]].map(|ends_m| (None, ends_m));
    let mut posture = Posture::at_base();
    hand.forward_kinematics(&[0.0; MAX_JOINTS], &mut posture);
    let joints = (0..hand.joint_count()).map(|k| (hand.parent(k), posture.link(k).origin_m));
    let tips = (0..hand.fingertip_count()).map(|i| (Some(hand.fingertip_link(i)), posture.centres_m[i]));
    let links = joints.chain(tips).filter_map(|(link, end_m)| {
        let pose = posture.link(link?);
        let along = pose.attitude.tr_mul(&(end_m - pose.origin_m));
        (along.norm() > 1e-12).then_some((link, [Vector3::zeros(), along]))
    });
    palm.into_iter().chain(links).map(|(link, ends_m)| Capsule { link, ends_m, radius_m: 0.007 }).collect()
}

/// The hand of a fixture with a capsule along each link that has a length, two on the palm, and a ball.
#[test]
fn capsules_are_drawn_in_place_of_rods_joints_and_plates() {
    let (hand, capsules) = (fixture::hand(), capsules(&fixture::hand()));
    let svg = hand_svg("capsules", &hand, &capsules, &[], &[0.3; MAX_JOINTS]);
    assert_sound(&svg);
    // Every line's gradient: three of a finger and those of the palm, of which none is seen end on.
    let lines = capsules.iter().filter(|capsule| capsule.ends_m[0] != capsule.ends_m[1]).count();
    assert_eq!((lines, count(&svg, "<linearGradient")), (11, 2 * 11));
    // Of balls the capsule that is one, and the fingertips; no joint, and no plate.
    assert_eq!(count(&svg, "fill=\"url(#ball-"), 2 * (1 + 3));
    let plates =
        |svg: &str| svg.lines().filter(|line| line.contains("fill-rule") && line.len() > 600).count();
    assert_eq!((plates(&svg), plates(&hand_svg("rods", &hand, &[], &[], &[0.3; MAX_JOINTS]))), (0, 4));
    // A link without keeps its rod.
    let svg = hand_svg("some", &hand, &capsules[..1], &[], &[0.3; MAX_JOINTS]);
    assert_eq!(count(&svg, "<linearGradient"), 2 * (1 + 9));
}

#[test]
fn hands_of_any_size_can_be_drawn() {
    let hand = fixture::hand();
    let names: Vec<String> = (0..hand.joint_count()).map(|k| format!("<&\u{7} {k}")).collect();
    for angle in [0.0, 0.7, -40.0, 1e9] {
        let svg = hand_svg("a & b", &hand, &[], &names, &[angle; MAX_JOINTS]);
        assert_sound(&svg);
        assert!(svg.contains("a &amp; b") && svg.contains("&lt;&amp;\u{fffd} 3"));
    }
    assert_sound(&hand_svg("x", &hand, &[], &[], &[f64::NAN; MAX_JOINTS]));
    // Bones of 64 m.
    let path = format!("{}/../../models/hands/three-finger.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap().replace("0.064]", "64.0]");
    let check = HandCheck::parse(&text, "hand.toml").unwrap();
    let nominal = check.nominal.unwrap();
    let svg =
        hand_svg(&check.name, &nominal.hand, &nominal.capsules, &nominal.joint_names, &nominal.angles_rad);
    assert_sound(&svg);
    assert!(svg.contains(" m</text>"), "the scale bar is in metres");
}

/// Writes pictures of everything that is built in to a folder, to be looked at: `PICTURES=DIR cargo test ... -- --ignored`.
#[test]
#[ignore = "writes files to be looked at"]
fn pictures_to_look_at() {
    let folder = std::env::var("PICTURES").unwrap();
    for name in blindgrasp_model::HandFile::built_in() {
        std::fs::write(format!("{folder}/{name}.svg"), shipped(name)).unwrap();
    }
    let (hand, capsules) = (fixture::hand(), capsules(&fixture::hand()));
    let svg = hand_svg("capsules", &hand, &capsules, &[], &[0.3; MAX_JOINTS]);
    std::fs::write(format!("{folder}/capsules.svg"), svg).unwrap();
    let (names, object, samples) = (fixture::joint_names(), fixture::prism(), fixture::samples(2));
    let report = crate::Report {
        title: "capsules",
        hand: &hand,
        capsules: &capsules,
        joint_names: &names,
        object: &object,
        samples: &samples,
    };
    crate::write(std::path::Path::new(&folder), &report).unwrap();
    for scene in ["cube", "prism", "two-finger-prism", "l-bracket"] {
        let scene = blindgrasp_model::Scene::load(scene, &[]).unwrap();
        std::fs::write(
            format!("{folder}/{}.svg", scene.object_name),
            object_svg(&scene.object, &scene.object_name),
        )
        .unwrap();
    }
}

#[test]
fn faces_are_numbered_once() {
    let cube = Polyhedron::cuboid([0.048, 0.03, 0.02]).unwrap();
    let svg = object_svg(&cube, "block");
    assert_sound(&svg);
    // Three faces from the front, the three others from the back.
    for face in 0..6 {
        assert_eq!(count(&svg, &format!(">{face}</text>")), 1, "{face}");
    }
    assert!(svg.contains("48.0 x 30.0 x 20.0 mm"));
    // Notches and holes are none of the face: of the bracket's faces, each shows somewhere.
    let bracket = blindgrasp_model::Scene::load("l-bracket", &[]).unwrap().object;
    let svg = object_svg(&bracket, "l-bracket");
    assert_sound(&svg);
    let shown = (0..bracket.faces.len()).filter(|face| svg.contains(&format!(">{face}</text>"))).count();
    assert!(shown + 1 >= bracket.faces.len(), "{shown} of {}", bracket.faces.len());
    for sides in [3, 6, 40] {
        let prism = Polyhedron::regular_prism(sides, 0.01, 0.05).unwrap();
        let svg = object_svg(&prism, "prism");
        assert_sound(&svg);
        for face in 0..sides + 2 {
            let shown = count(&svg, &format!(">{face}</text>"));
            // But for sides that both views see edge on.
            assert!(shown == 1 || (shown == 0 && sides == 40), "{face} of {sides}: {shown}");
        }
    }
}
