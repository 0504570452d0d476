//! Hands' files to start from.

use super::super::starter::{FingertipRequest, Starter, StarterRequest};
use super::*;
use crate::HandModel;
use blindgrasp_shared::math::Real;

/// Starts from a URDF; errors are without the folder.
fn start(urdf: &str, change: impl Fn(&mut StarterRequest)) -> Result<(Folder, Starter), String> {
    let folder = Folder::new("", urdf.as_bytes());
    let mut request = StarterRequest {
        file: "gripper.urdf".into(),
        folder: folder.0.path().to_owned(),
        ..StarterRequest::default()
    };
    change(&mut request);
    match request.start(|_, _| None) {
        Ok(starter) => Ok((folder, starter)),
        Err(error) => Err(folder.plain(&error.to_string())),
    }
}

fn refused(urdf: &str, change: impl Fn(&mut StarterRequest)) -> String {
    start(urdf, change).map(|(_, starter)| starter.text).expect_err("has to be refused")
}

/// The hand that is read from the file that was started.
fn read(folder: &Folder, starter: &Starter) -> HandFile {
    std::fs::write(folder.path("hand.toml"), &starter.text).unwrap();
    let (model, file) =
        HandModel::load_with_file(folder.path("hand.toml")).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(model.warnings, Vec::<String>::new());
    file
}

fn fingertip(link: &str) -> FingertipRequest {
    FingertipRequest { link: link.into(), offset_m: None, radius_m: None }
}

/// The paper's hand, as a URDF, gets the gains that the paper gives it (Table VII).
#[test]
fn gains_of_the_paper_s_hand_are_those_of_table_vii() {
    let original = HandFile::load("three-finger").unwrap();
    let (folder, starter) = start(&original.to_urdf(), |_| ()).unwrap();
    let hand = read(&folder, &starter);
    let control = hand.control.as_ref().unwrap();
    assert_eq!((control.force_n(), control.attitude_stiffness_nm()), (5.0, 5e-3));
    for (ours, theirs) in hand.fingertips.iter().zip(&original.fingertips) {
        assert_eq!(ours.radius_m, theirs.radius_m);
        // 8 % of the radius under 5 N; the paper's is indented by 9.6 %.
        let ratio = ours.stiffness_n_m2 / theirs.stiffness_n_m2;
        assert!((1.4..1.5).contains(&ratio), "{ratio}");
    }
    for (ours, theirs) in hand.joints.iter().zip(&original.joints) {
        assert_eq!(ours.name, theirs.name);
        // Within a factor of seven, which costs no grasp.
        let ratio = ours.damping_gain_nm_s_rad / theirs.damping_gain_nm_s_rad;
        assert!((1.0 / 7.0..7.0).contains(&ratio), "{}: {ratio}", ours.name);
        assert_eq!(ours.coulomb_friction_nm, theirs.coulomb_friction_nm);
    }
    assert_eq!(starter.guesses.len(), 4);
    assert_eq!(hand.capsules, original.capsules);
}

/// Every built-in hand, written as a URDF, makes a file that can be used.
#[test]
fn every_built_in_hand_can_be_started_again() {
    for name in HandFile::built_in() {
        let original = HandFile::load(name).unwrap();
        let (folder, starter) = start(&original.to_urdf(), |_| ()).unwrap();
        let hand = read(&folder, &starter);
        assert_eq!(hand.joints.len(), original.joints.len(), "{name}");
        assert_eq!(hand.fingertips.len(), original.fingertips.len(), "{name}");
        for tip in &original.fingertips {
            let is_same = |other: &&crate::file::FingertipFile| {
                other.link == tip.link && other.offset_m == tip.offset_m && other.radius_m == tip.radius_m
            };
            assert_eq!(hand.fingertips.iter().filter(is_same).count(), 1, "{name}: {}", tip.name);
        }
        assert_eq!(hand.capsules.len(), original.capsules.len(), "{name}");
        for capsule in &original.capsules {
            assert!(hand.capsules.contains(capsule), "{name}: {capsule:?}");
        }
    }
}

#[test]
fn a_file_says_what_is_guessed() {
    let (folder, starter) = start(GRIPPER, |request| request.base = Some("palm".into())).unwrap();
    let hand = read(&folder, &starter);
    let links: Vec<&str> = hand.fingertips.iter().map(|tip| tip.link.as_str()).collect();
    assert_eq!(links, ["left-knuckle", "right-knuckle"]);
    assert_eq!(
        starter.guesses,
        [
            "fingertip on link `left-tip`; its centre: a sphere of the link; its radius of 0.01 m: a sphere of the link",
            "fingertip on link `right-tip`; its centre: a sphere of the link; its radius of 0.01 m: a sphere of the link",
            "friction of `left-knuckle`, `right-base`, `right-knuckle`",
            "gains: force 6.1 N, attitude stiffness 0.0041 N m, closing, damping; encoders; torques per volt; stiffness of the fingertips",
        ]
    );
    // What the URDF knows is not repeated.
    assert!(!starter.text.contains("torque_limit_nm") && !starter.text.contains("limits_rad"));
    assert_eq!(starter.text.matches("coulomb_friction_nm").count(), 3);
}

/// Effort and velocity of 0 or 1000, friction that no motor turns against, joints without limits.
#[test]
fn placeholders_are_replaced_by_guesses() {
    let urdf =
        GRIPPER.replace("effort=\"1.2\"", "effort=\"1000\"").replace("velocity=\"12\"", "velocity=\"0\"");
    let urdf = changed(&urdf, "friction=\"0.01\"", "friction=\"2000\"");
    let urdf =
        changed(&urdf, "name=\"right-base\" type=\"revolute\"", "name=\"right-base\" type=\"continuous\"");
    let (folder, starter) = start(&urdf, |request| request.base = Some("palm".into())).unwrap();
    let hand = read(&folder, &starter);
    for joint in &hand.joints {
        assert!(joint.torque_limit_nm < 3.0 && joint.speed_limit_rad_s <= 12.0, "{joint:?}");
        assert!(joint.coulomb_friction_nm > 0.0 && joint.coulomb_friction_nm < 0.01 * joint.torque_limit_nm);
    }
    assert_eq!(hand.joints[2].limits_rad, [-std::f64::consts::PI, std::f64::consts::PI]);
    for expected in [
        "torque limits of `left-base`, `right-base`",
        "speed limits of `left-knuckle`, `right-knuckle`",
        "joint limits of `right-base`",
        "friction of all joints",
    ] {
        assert!(starter.guesses.iter().any(|guess| guess == expected), "{:?}", starter.guesses);
    }
}

/// A finger of 80 g and torque limits of ten times what it has: the force stays at ten times its weight.
#[test]
fn a_force_beyond_the_finger_s_weight_is_asked_about() {
    let urdf = GRIPPER.replace("effort=\"1.2\"", "effort=\"12\"").replace("effort=\"0.8\"", "effort=\"8\"");
    let (folder, starter) = start(&urdf, |request| request.base = Some("palm".into())).unwrap();
    let force_n = read(&folder, &starter).control.unwrap().force_n();
    assert_eq!(force_n, 7.4); // (0.08 + 0.07) / 2 kg * 9.81 m/s^2 * 10
    assert!(
        starter.guesses[3]
            .starts_with("force: 10 times the weight of a finger; the torque limits would allow 6"),
        "{:?}",
        starter.guesses
    );
}

/// Centre and radius from what there is: a sphere, a name, a box, the mass.
#[test]
fn fingertips_are_found_in_four_ways() {
    let without_spheres =
        GRIPPER.replace("<collision><geometry><sphere radius=\"0.01\"/></geometry></collision>", "");
    let of = |urdf: &str| {
        let (folder, starter) = start(urdf, |_| ()).unwrap();
        let hand = read(&folder, &starter);
        let tip = &hand.fingertips[0];
        (tip.link.clone(), tip.offset_m, tip.radius_m)
    };
    // By their names: the link's origin, and a tenth of 0.06 m and the way to the tip.
    let (link, offset, radius) = of(&without_spheres);
    assert_eq!((link.as_str(), offset, radius), ("left-knuckle", [0.0, 0.005, 0.04], 0.01));
    // A sphere of another link, far from the joint; a small one is a marker.
    let ball = "<link name=\"left-2\"><visual><origin xyz=\"0 0 0.05\"/><geometry><sphere radius=\"0.008\"/></geometry></visual>\
                <visual><origin xyz=\"0 0 0.5\"/><geometry><sphere radius=\"0.001\"/></geometry></visual>";
    let (_, offset, radius) = of(&changed(&without_spheres, "<link name=\"left-2\">", ball)
        .replace("<link name=\"right-2\">", &ball.replace("left-2", "right-2")));
    assert_eq!((offset, radius), ([0.0, 0.0, 0.05], 0.008));
    // No spheres and no names: a box, ...
    let nameless = without_spheres.replace("-tip", "-pad-link");
    let boxed = nameless.replace(
        "<link name=\"right-pad-link\">",
        "<link name=\"right-pad-link\"><collision><origin xyz=\"0 0 0.01\"/><geometry><box size=\"0.01 0.02 0.03\"/></geometry></collision>",
    );
    let (folder, starter) = start(&boxed, |_| ()).unwrap();
    let hand = read(&folder, &starter);
    assert_eq!((hand.fingertips[1].offset_m, hand.fingertips[1].radius_m), ([0.0, 0.005, 0.05], 0.005));
    // ... or a rod: twice the way to the centre of mass, less the radius.
    let (_, offset, radius) = of(&nameless);
    assert_eq!(radius, 0.011);
    let length = (2.0_f64 * 0.025 - radius * 0.025 / 0.00125_f64.hypot(0.025)) * 1e5;
    assert!((offset[2] * 1e5 - length).abs() < 0.51, "{offset:?} {length}");
}

/// Surfaces come from the URDF; what has none, and what is in each other's way, is told and stands in the file.
#[test]
fn surfaces_are_told() {
    let palm = "<link name=\"palm\"><collision><geometry><mesh filename=\"palm.dae\"/></geometry></collision>\
                <collision><geometry><box size=\"0.02 0.02\"/></geometry></collision>\
                <collision><geometry><sphere radius=\"0.2\"/></geometry></collision>";
    let left = "<link name=\"left-2\"><collision><origin xyz=\"0 -0.04 0\"/><geometry><capsule radius=\"0.01\" length=\"0.02\"/></geometry></collision>";
    let between =
        "<link name=\"left-1\"><collision><geometry><sphere radius=\"0.001\"/></geometry></collision>";
    let mut urdf = GRIPPER.to_owned();
    for (link, shapes) in [("palm", palm), ("left-1", between), ("left-2", left)] {
        urdf = changed(&urdf, &format!("<link name=\"{link}\">"), shapes);
    }
    let (folder, starter) = start(&urdf, |request| request.base = Some("palm".into())).unwrap();
    assert!(starter.guesses.iter().all(|guess| !guess.contains("surface")), "{:?}", starter.guesses);
    let [gap, overlap] = &starter.warnings[..] else { panic!("{:?}", starter.warnings) };
    assert_eq!(
        gap,
        "no surface, so that nothing touches it there: `palm` (a <box> that can't be read), `palm` (a mesh: it is neither STL nor OBJ)"
    );
    let told = ["surfaces of links: 3 capsules in <collision> shapes", gap.as_str(), overlap.as_str()];
    let end = "; give [[capsule]]s that don't, or set plant.links = false in scenes";
    assert!(
        overlap.starts_with("the palm (capsule 1) and link `left-knuckle` (capsule 3) overlap in 200 of 200 random postures (and so does another pair), and no scene can start so")
            && overlap.ends_with(end),
        "{overlap}"
    );
    for line in told {
        assert!(starter.text.contains(&format!("\n# - {line}.\n")), "{}", starter.text);
    }
    std::fs::write(folder.path("hand.toml"), &starter.text).unwrap();
    assert_eq!(HandFile::load(folder.path("hand.toml")).unwrap().capsules.len(), 3);
}

/// A box as an OBJ file, mm.
fn box_of_mm(sides: [f64; 3]) -> String {
    let mut text = String::new();
    for k in 0..8 {
        let corner = |axis: usize| if k >> axis & 1 == 1 { sides[axis] / 2.0 } else { -sides[axis] / 2.0 };
        text += &format!("v {:?} {:?} {:?}\n", corner(0), corner(1), corner(2));
    }
    text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
}

/// Capsules in the boxes around meshes are written down as guesses, with those of the URDF, which they replace.
#[test]
fn surfaces_of_meshes_are_guessed() {
    let mesh = |file: &str, origin: &str| {
        format!(
            "<collision>{origin}<geometry><mesh filename=\"{file}\" scale=\"0.001 0.001 0.001\"/></geometry></collision>"
        )
    };
    let palm = mesh("package://gripper/meshes/palm.obj", "<origin xyz=\"0.01 0 -0.03\" rpy=\"0 0 0.5\"/>");
    let ball = "<collision><origin xyz=\"0.1 0 0.001\"/><geometry><sphere radius=\"0.0123456789\"/></geometry></collision>";
    // Around the fingertip, whose link is turned.
    let (tip, missing) =
        (mesh("tip.obj", "<origin xyz=\"0 0 -0.03\"/>"), mesh("package://other/palm.obj", ""));
    let mut urdf = GRIPPER.to_owned();
    for (link, shapes) in [("palm", &format!("{palm}{ball}")), ("left-tip", &tip), ("right-2", &missing)] {
        let link = format!("<link name=\"{link}\">");
        urdf = changed(&urdf, &link, &format!("{link}{shapes}"));
    }
    let above = tempfile::tempdir().unwrap();
    let (package, meshes) = (above.path().join("gripper/urdf"), above.path().join("gripper/meshes"));
    for folder in [&package, &meshes] {
        std::fs::create_dir_all(folder).unwrap();
    }
    std::fs::write(package.join("gripper.urdf"), urdf).unwrap();
    std::fs::write(meshes.join("palm.obj"), box_of_mm([60.0, 20.0, 40.0])).unwrap();
    std::fs::write(package.join("tip.obj"), box_of_mm([8.0, 8.0, 60.0])).unwrap();
    let request = StarterRequest {
        file: "gripper.urdf".into(),
        folder: package.clone(),
        base: Some("palm".into()),
        ..StarterRequest::default()
    };
    let starter = request.start(|_, _| None).unwrap();
    let guess = "surfaces of links: 3 capsules in the smallest boxes around meshes";
    assert_eq!(starter.guesses.last().unwrap(), guess);
    let gap = "no surface, so that nothing touches it there: `right-2` (a mesh: its file is not found)";
    assert_eq!(starter.warnings[0], gap);
    for line in ["surfaces of links: 1 capsule in <collision> shapes", guess, gap] {
        assert!(starter.text.contains(&format!("\n# - {line}.\n")), "{}", starter.text);
    }
    std::fs::write(package.join("hand.toml"), &starter.text).unwrap();
    let hand = HandFile::load(package.join("hand.toml")).unwrap();
    let links: Vec<Option<&str>> = hand.capsules.iter().map(|capsule| capsule.link.as_deref()).collect();
    assert_eq!(links, [None, None, None, Some("left-knuckle")]);
    // The URDF's own to the bit; guesses to a hundredth of a millimetre.
    let ball = &hand.capsules[0];
    assert_eq!((ball.from_m, ball.to_m, ball.radius_m), ([0.1, 0.0, 0.001], [0.1, 0.0, 0.001], 0.0123456789));
    let (sine, cosine) = 0.5_f64.sine_cosine();
    let near = |found: [f64; 3], expected: [f64; 3]| {
        found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 0.51e-5)
    };
    let mut ends: Vec<[f64; 3]> = hand.capsules[1..3].iter().flat_map(|it| [it.from_m, it.to_m]).collect();
    ends.sort_by(|a, b| (a[2], a[0]).partial_cmp(&(b[2], b[0])).unwrap());
    let expected = [(-0.02, -0.04), (0.02, -0.04), (-0.02, -0.02), (0.02, -0.02)];
    for (found, (x, z)) in ends.into_iter().zip(expected) {
        assert!(near(found, [0.01 + x * cosine, x * sine, z]), "{found:?}");
    }
    // From 56 mm before the fingertip's centre, 4 mm inside the box, to where its round end leaves the fingertip's 10 mm free.
    let (sine, cosine) = 0.3_f64.sine_cosine();
    let finger = &hand.capsules[3];
    let at = |before: f64| [-before * sine, 0.005, 0.04 - before * cosine];
    let (far, free) =
        if near(finger.to_m, at(0.01)) { (finger.from_m, finger.to_m) } else { (finger.to_m, finger.from_m) };
    assert!(near(far, at(0.056)) && near(free, at(0.01)) && finger.radius_m == 0.004, "{finger:?}");
    assert_eq!(
        starter.text.matches("radius_m = 0.01  # GUESS: in the smallest box around a mesh").count(),
        2
    );
}

/// The fingertip of a capsule is the ball at its far end, and the rest of it stays clear of that.
#[test]
fn a_capsule_ends_in_the_fingertip() {
    let capsule = "<collision><origin xyz=\"0 0 0.02\"/><geometry><capsule radius=\"0.008\" length=\"0.04\"/></geometry></collision>";
    let urdf = GRIPPER
        .replace("<collision><geometry><sphere radius=\"0.01\"/></geometry></collision>", "")
        .replace("-tip", "-pad-link")
        .replace("<link name=\"left-2\">", &format!("<link name=\"left-2\">{capsule}"));
    let (folder, starter) = start(&urdf, |_| ()).unwrap();
    let hand = read(&folder, &starter);
    assert_eq!((hand.fingertips[0].offset_m, hand.fingertips[0].radius_m), ([0.0, 0.0, 0.04], 0.008));
    let [rest] = &hand.capsules[..] else { panic!("{:?}", hand.capsules) };
    assert_eq!((rest.link.as_deref(), rest.from_m), (Some("left-knuckle"), [0.0; 3]));
    assert!((rest.to_m[2] - 0.032).abs() < 1e-15, "{rest:?}");
    assert!(
        starter.guesses[0].contains("its centre: the end of a capsule of the link"),
        "{:?}",
        starter.guesses
    );
}

#[test]
fn what_is_asked_for_is_taken() {
    let (folder, starter) = start(GRIPPER, |request| {
        request.base = Some("palm".into());
        request.locked = vec![("left-knuckle".into(), 0.5)];
        request.fingertips = vec![
            FingertipRequest {
                offset_m: Some([0.0, 0.0, 0.01]),
                radius_m: Some(0.02),
                ..fingertip("left-2")
            },
            fingertip("right-tip"),
        ];
    })
    .unwrap();
    let hand = read(&folder, &starter);
    assert_eq!(hand.joints.len(), 3);
    assert_eq!(hand.fingertips[0].radius_m, 0.02);
    assert!(starter.text.contains("[urdf.locked_rad]\nleft-knuckle = 0.5\n"), "{}", starter.text);
    assert!(starter.guesses.iter().all(|guess| !guess.contains("left-2")), "{:?}", starter.guesses);
}

/// Half of 1.2341 and 1.2345 has more than two digits.
#[test]
fn nominal_angles_are_within_small_limits() {
    let urdf = changed(GRIPPER, "lower=\"-0.8\" upper=\"1.4\"", "lower=\"1.2341\" upper=\"1.2345\"");
    let (folder, starter) = start(&urdf, |_| ()).unwrap();
    assert!((read(&folder, &starter).joints[0].nominal_rad - 1.2343).abs() < 1e-12);
}

/// Joints that move nothing that matters are held still in words.
#[test]
fn idle_joints_are_held_still() {
    let urdf = changed(
        GRIPPER,
        "</robot>",
        "<link name=\"camera\"/><joint name=\"pan\" type=\"revolute\"><parent link=\"palm\"/><child link=\"camera\"/>\
         <limit lower=\"0.1\" upper=\"1\"/></joint></robot>",
    );
    let (folder, starter) = start(&urdf, |_| ()).unwrap();
    assert_eq!(read(&folder, &starter).joints.len(), 4);
    assert!(starter.text.contains("[urdf.locked_rad]\npan = 0.1\n"), "{}", starter.text);
    assert_eq!(starter.guesses[0], "held still, as they move no fingertip: `pan`");
}

#[test]
fn errors_name_the_option() {
    let base = |link: &'static str| move |request: &mut StarterRequest| request.base = Some(link.into());
    let tip = |link: &'static str| {
        move |request: &mut StarterRequest| request.fingertips = vec![fingertip(link); 2]
    };
    let lock = |joint: &'static str, position: f64| {
        move |request: &mut StarterRequest| request.locked = vec![(joint.into(), position)]
    };
    assert_eq!(refused(GRIPPER, base("plam")), "--base: there is no link `plam`; did you mean `palm`?");
    assert_eq!(
        refused(GRIPPER, base("left-1")),
        "gripper.urdf:3: only link `left-tip` looks like a fingertip; name the fingertips: --fingertip LINK[:x,y,z[:radius_m]]"
    );
    assert_eq!(
        refused(GRIPPER, base("left-2")),
        "gripper.urdf:3: no joint moves; a hand needs revolute joints below its base that --lock does not hold still"
    );
    assert_eq!(
        refused(GRIPPER, tip("left-top")),
        "--fingertip: there is no link `left-top`; did you mean `left-tip`?"
    );
    assert_eq!(
        refused(GRIPPER, tip("palm")),
        "gripper.urdf:6: no joint moves link `palm`, which is to be a fingertip; name another link, or hold less still"
    );
    assert_eq!(
        refused(GRIPPER, lock("left-nuckle", 0.0)),
        "--lock: left-nuckle: there is no such joint; did you mean `left-knuckle`?"
    );
    assert_eq!(
        refused(GRIPPER, lock("left-knuckle", 9.0)),
        "--lock: left-knuckle: 9.0 is outside the joint's limits; has to be between -0.2 and 1.6"
    );
    let massless = GRIPPER.replace("<inertial>", "<!--").replace("</inertial>", "-->");
    assert_eq!(
        refused(&massless, |_| ()),
        "gripper.urdf:25: joint `left-base` moves no mass; give the links that it moves an <inertial> in the URDF"
    );
    let mut fingers = String::new();
    for k in 0..6 {
        fingers += &format!(
            "<link name=\"tip-{k}\"/><joint name=\"j{k}\" type=\"revolute\"><parent link=\"palm\"/><child link=\"tip-{k}\"/></joint>"
        );
    }
    let many = format!("<robot name=\"r\"><link name=\"palm\"/>{fingers}</robot>");
    assert_eq!(
        refused(&many, |_| ()),
        "gripper.urdf:1: nothing tells where the finger ends whose last link is `tip-0`; name the fingertips: --fingertip LINK[:x,y,z[:radius_m]]"
    );
    let many = many
        .replace("/><joint", "><visual><geometry><sphere radius=\"0.01\"/></geometry></visual></link><joint");
    assert_eq!(
        refused(&many, |_| ()),
        "gripper.urdf:1: 6 links look like fingertips, of which 5 can be used: `tip-0`, `tip-1`, `tip-2`, `tip-3`, `tip-4`, `tip-5`; name the fingertips: --fingertip LINK[:x,y,z[:radius_m]]"
    );
}
