//! Hands from URDFs that are right.

use super::super::super::library::{Document, Home};
use super::super::super::{Scene, read::read, tree::Node};
use super::*;
use blindgrasp_shared::math::Real;

/// The hand's values, with everything from the URDF.
#[test]
fn a_hand_takes_over_what_the_urdf_says() {
    let (file, _, warnings) = load(HAND, GRIPPER).unwrap();
    assert_eq!(warnings, Vec::<String>::new());
    let names: Vec<&str> = file.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["left-base", "left-knuckle", "right-base", "right-knuckle"]);
    let parents: Vec<Option<&str>> = file.joints.iter().map(|joint| joint.parent.as_deref()).collect();
    assert_eq!(parents, [None, Some("left-base"), None, Some("right-base")]);
    let left = &file.joints[0];
    // As written: the palm is the base, so that nothing stands before it.
    assert_eq!((left.offset_m, left.rotation_rpy_rad), ([0.0, 0.04, 0.0], [0.0; 3]));
    assert_eq!((left.axis, left.limits_rad), ([1.0, 0.0, 0.0], [-0.8, 1.4]));
    assert_eq!((left.torque_limit_nm, left.speed_limit_rad_s), (1.2, 10.0));
    assert_eq!((left.viscous_friction_nm_s_rad, left.coulomb_friction_nm), (1e-4, 0.01));
    assert_eq!((left.mass_kg, left.mass_centre_m), (0.04, [0.0, 0.0, 0.02]));
    assert_eq!((left.damping_gain_nm_s_rad, left.nominal_rad), (1e-3, 0.0));
    // What is not given has its default.
    assert_eq!(file.joints[1].coulomb_friction_nm, 0.0);
    // A body alone, without angles: to the bit.
    assert_eq!(file.joints[3].inertia_kg_m2.0, [8e-6, 8e-6, 1e-6, 0.0, 0.0, 0.0]);
    // The tip's 10 g at (0, 5, 40) mm with the 30 g at (0, 0, 20) mm.
    let knuckle = &file.joints[1];
    assert!((knuckle.mass_kg - 0.04).abs() < 1e-17);
    for (found, expected) in knuckle.mass_centre_m.iter().zip([0.0, 0.00125, 0.025]) {
        assert!((found - expected).abs() < 1e-17);
    }
    // Reduced mass 7.5 g, distance (5, 20) mm in y and z; the tip is turned about y, which a sphere does not show.
    let reduced = 0.03 * 0.01 / 0.04;
    let expected = [
        8e-6 + 1e-6 + reduced * (25e-6 + 400e-6),
        8e-6 + 1e-6 + reduced * 400e-6,
        1e-6 + 1e-6 + reduced * 25e-6,
        0.0,
        0.0,
        -reduced * 100e-6,
    ];
    for (found, expected) in knuckle.inertia_kg_m2.0.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-20, "{found} {expected}");
    }
    // The fingertips sit on the knuckles' links.
    let tip = &file.fingertips[0];
    assert_eq!((tip.link.as_str(), tip.offset_m), ("left-knuckle", [0.0, 0.005, 0.04]));
}

#[test]
fn offsets_of_fingertips_are_in_the_frame_of_their_link() {
    let toml = changed(HAND, "link = \"left-tip\"", "link = \"left-tip\"\noffset_m = [0.001, 0.0, 0.002]");
    let (file, _, _) = load(&toml, GRIPPER).unwrap();
    let (sine, cosine) = 0.3_f64.sine_cosine();
    let expected = [0.001 * cosine + 0.002 * sine, 0.005, 0.04 - 0.001 * sine + 0.002 * cosine];
    for (found, expected) in file.fingertips[0].offset_m.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-17);
    }
}

#[test]
fn what_stands_above_the_base_is_part_of_the_first_offset() {
    let (file, _, _) = load(&changed(HAND, "base = \"palm\"\n", ""), GRIPPER).unwrap();
    let (sine, cosine) = 0.5_f64.sine_cosine();
    let expected = [-0.04 * sine, 0.04 * cosine, 0.1];
    for (found, expected) in file.joints[0].offset_m.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-17);
    }
    assert!((file.joints[0].rotation_rpy_rad[2] - 0.5).abs() < 1e-15);
}

#[test]
fn entries_choose_the_order_and_win() {
    let entries = "
[[joint]]
name = \"right-base\"
torque_limit_nm = 0.5
parent_is_not_needed = 1
[[joint]]
name = \"right-knuckle\"
parent = \"right-base\"
mass_kg = 0.05
[[joint]]
name = \"left-base\"
limits_rad = [-0.1, 0.2]
[[joint]]
name = \"left-knuckle\"
";
    let entries = entries.replace("parent_is_not_needed = 1\n", "");
    let (file, _, _) = load(&format!("{HAND}{entries}"), GRIPPER).unwrap();
    let names: Vec<&str> = file.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["right-base", "right-knuckle", "left-base", "left-knuckle"]);
    assert_eq!(file.joints[0].torque_limit_nm, 0.5);
    assert_eq!((file.joints[1].mass_kg, file.joints[1].mass_centre_m), (0.05, [0.0, 0.0, 0.02]));
    assert_eq!(file.joints[2].limits_rad, [-0.1, 0.2]);
}

/// A joint that is held still is part of the link below, turned as it is held.
#[test]
fn locked_joints_are_merged_where_they_are_held() {
    let toml = changed(HAND, "base = \"palm\"", "base = \"palm\"\nlocked_rad = { left-knuckle = 0.7 }");
    let (file, hand, warnings) = load(&toml, GRIPPER).unwrap();
    assert_eq!((file.joints.len(), warnings.len()), (3, 0));
    // The knuckle turns about x by 0.7 rad, after the 0.05 rad of its origin.
    let (sine, cosine) = 0.75_f64.sine_cosine();
    let expected = [0.0, 0.005 * cosine - 0.04 * sine, 0.06 + 0.005 * sine + 0.04 * cosine];
    for (found, expected) in file.fingertips[0].offset_m.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-16);
    }
    assert!((hand.link(0).mass_kg - 0.08).abs() < 1e-16);
}

#[test]
fn what_is_odd_is_a_notice() {
    let cases = [
        (
            changed(GRIPPER, "type=\"revolute\"", "type=\"continuous\""),
            "gripper.urdf:25: joint `left-base` is continuous: its limits are taken as -pi and pi; give `limits_rad` in its [[joint]]",
        ),
        (
            changed(GRIPPER, "effort=\"1.2\"", "effort=\"1000\""),
            "gripper.urdf:30: joint `left-base`: effort of 1000.0 N m looks like a placeholder; if so, give `torque_limit_nm` in [joint_defaults] and `ignore = [\"effort\"]` in [urdf]",
        ),
        (
            changed(GRIPPER, "velocity=\"10\"", "velocity=\"1e4\""),
            "gripper.urdf:30: joint `left-base`: velocity of 10000.0 rad/s looks like a placeholder; if so, give `speed_limit_rad_s` in [joint_defaults] and `ignore = [\"velocity\"]` in [urdf]",
        ),
        (
            changed(GRIPPER, "friction=\"0.01\"", "friction=\"10\""),
            "gripper.urdf:31: joint `left-base`: its friction of 10.0 N m is more than its motor can turn against; if it is a placeholder, add `ignore = [\"friction\", \"damping\"]` to [urdf]",
        ),
        (
            changed(GRIPPER, "damping=\"1e-4\"", "damping=\"3\""),
            "gripper.urdf:31: joint `left-base`: its damping of 3.0 N m s/rad leaves its motor nothing at 10.0 rad/s; if it is a placeholder, add `ignore = [\"friction\", \"damping\"]` to [urdf]",
        ),
        (
            changed(
                GRIPPER,
                "</robot>",
                "<link name=\"camera\"/>\n<joint name=\"pan\" type=\"revolute\"><parent link=\"palm\"/><child link=\"camera\"/></joint></robot>",
            ),
            "gripper.urdf:96: joint `pan` moves no fingertip and is held still at zero; say where with locked_rad (or locked_m) in [urdf]",
        ),
    ];
    for (urdf, expected) in cases {
        let (file, _, warnings) = load(HAND, &urdf).unwrap();
        assert_eq!(warnings, [expected]);
        assert_eq!(file.joints.len(), 4);
    }
    // Many of the same are told once.
    let (_, _, warnings) = load(HAND, &GRIPPER.replace("effort=\"1.2\"", "effort=\"1000\"")).unwrap();
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].contains("looks like a placeholder (and so it is with another joint); if so"),
        "{}",
        warnings[0]
    );
    // Each can be silenced by the hand's file.
    let quiet = changed(HAND, "base = \"palm\"", "base = \"palm\"\nignore = [\"effort\", \"friction\"]");
    let quiet = changed(&quiet, "[joint_defaults]", "[joint_defaults]\ntorque_limit_nm = 0.3");
    let urdf = changed(
        &changed(GRIPPER, "friction=\"0.01\"", "friction=\"10\""),
        "effort=\"1.2\"",
        "effort=\"1000\"",
    );
    let (file, _, warnings) = load(&quiet, &urdf).unwrap();
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!((file.joints[0].torque_limit_nm, file.joints[0].coulomb_friction_nm), (0.3, 0.0));
}

/// A fault in the mass of a link matters only where it moves.
#[test]
fn masses_that_do_not_move_may_be_wrong() {
    let urdf = changed(GRIPPER, "<mass value=\"0.5\"/>", "<mass value=\"nan\"/>");
    assert_eq!(load(HAND, &urdf).unwrap().0, load(HAND, GRIPPER).unwrap().0);
    let urdf = changed(GRIPPER, "<mass value=\"0.01\"/>", "<mass value=\"nan\"/>");
    assert_eq!(
        load(HAND, &urdf).map(|(file, ..)| file.name).unwrap_err(),
        "gripper.urdf:49: link `left-tip`: value of <mass>: `nan` is not finite; has to be a finite number"
    );
}

/// Zero would not be a nominal angle.
#[test]
fn joints_that_exclude_zero_have_a_nominal_angle_in_their_middle() {
    let urdf = changed(GRIPPER, "lower=\"-0.8\" upper=\"1.4\"", "lower=\"0.2\" upper=\"1.4\"");
    let (file, _, _) = load(HAND, &urdf).unwrap();
    assert!((file.joints[0].nominal_rad - 0.8).abs() < 1e-15);
}

/// A bound that is left out of a limit is zero, says URDF.
#[test]
fn a_limit_may_have_one_end() {
    let urdf = changed(GRIPPER, "lower=\"-0.8\" upper=\"1.4\"", "lower=\"-0.8\"");
    assert_eq!(load(HAND, &urdf).unwrap().0.joints[0].limits_rad, [-0.8, 0.0]);
}

/// A defaults' key counts where the URDF is silent, and only there.
#[test]
fn defaults_come_after_the_urdf() {
    let toml = changed(
        HAND,
        "[joint_defaults]",
        "[joint_defaults]\ntorque_limit_nm = 0.1\ncoulomb_friction_nm = 0.5",
    );
    let urdf = changed(GRIPPER, "effort=\"0.8\"", "effort=\"0\"");
    let (file, _, _) = load(&toml, &urdf).unwrap();
    let torques: Vec<f64> = file.joints.iter().map(|joint| joint.torque_limit_nm).collect();
    assert_eq!(torques, [1.2, 0.1, 1.2, 0.8]);
    let frictions: Vec<f64> = file.joints.iter().map(|joint| joint.coulomb_friction_nm).collect();
    assert_eq!(frictions, [0.01, 0.5, 0.5, 0.5]);
}

/// A hand of the program names a URDF of the program.
#[test]
fn a_built_in_hand_may_have_a_urdf() {
    let document = Document { node: Node::parse(HAND, "hands/gripper.toml").unwrap(), home: Home::BuiltIn };
    let tree = document.complete_hand(&mut Vec::new()).unwrap();
    let file: HandFile = read(&tree, "").unwrap();
    assert_eq!(file, load(HAND, GRIPPER).unwrap().0);
    assert_eq!(tree.place_of("joint.2.axis").to_string(), "hands/gripper.urdf:44");
    let toml = HAND.replace("gripper.urdf", "other.urdf");
    let document = Document { node: Node::parse(&toml, "hands/gripper.toml").unwrap(), home: Home::BuiltIn };
    let error = document.complete_hand(&mut Vec::new()).unwrap_err();
    assert_eq!(error.to_string(), "hands/gripper.toml:4: urdf.file: is not built in; name it by its path");
}

/// A scene whose hand names a URDF is an ordinary scene: settings reach it, and its effective form stands alone.
#[test]
fn scenes_know_no_difference() {
    let folder = Folder::new(HAND, GRIPPER.as_bytes());
    let scene = format!(
        "schema = 1\nname = \"s\"\nduration_s = 1.0\nhand = {:?}\nobject = \"cube\"\n[pose]\nposition_m = [0.0, 0.0, 0.09]\n\
         [[contact]]\npoint_m = [0.0, 0.024, 0.0]\n[[contact]]\npoint_m = [0.0, -0.024, 0.0]\n\
         [start]\nindentation_m = 1e-4\n[control]\nforce_n = 1.0\nattitude_stiffness_nm = 1e-3\n",
        folder.path("hand.toml")
    );
    std::fs::write(folder.path("scene.toml"), scene).unwrap();
    let load = |settings: &[&str]| {
        let settings: Vec<String> = settings.iter().map(|setting| setting.to_string()).collect();
        Scene::load(folder.path("scene.toml"), &settings)
    };
    let scene = load(&["hand.joint.left-base.mass_kg=0.5"]).unwrap();
    assert_eq!(scene.hand.link(0).mass_kg, 0.5);
    let again = Scene::parse(&scene.effective_toml(), "again", std::path::Path::new(""), &[]).unwrap();
    assert_eq!(again, scene);
    // Settings of the URDF's table come before it is followed.
    let locked =
        load(&["hand.urdf.locked_rad.left-knuckle=0.7"]).map_err(|error| folder.plain(&error.to_string()));
    assert!(locked.unwrap_err().starts_with("scene.toml:8: contact.1: "), "one joint less to reach it");
    let error = load(&["hand.urdf.locked_rad.left-knuckl=0.7"]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "--set: hand.urdf.locked_rad.left-knuckl: there is no such joint; did you mean `left-knuckle`?"
    );
    // A path on the command line is relative to where the command runs.
    std::fs::write(folder.path("other.urdf"), GRIPPER.replace("0.04 0\"", "0.041 0\"")).unwrap();
    let other = load(&[&format!("hand.urdf.file={}", folder.path("other.urdf"))]).unwrap();
    assert_eq!(other.file.hand.joints[0].offset_m, [0.0, 0.041, 0.0]);
    // Errors of the finished hand name the URDF.
    std::fs::write(folder.path("gripper.urdf"), changed(GRIPPER, "xyz=\"0 0.04 0\"", "xyz=\"0 40 0\""))
        .unwrap();
    assert_eq!(
        folder.plain(&load(&[]).unwrap_err().to_string()),
        "gripper.urdf:28: hand.joint.1.offset_m: 40.0 is out of range; has to be within 10.0 of zero"
    );
}

#[test]
fn the_files_of_a_hand_are_known_also_when_they_are_wrong() {
    let folder = Folder::new(HAND, b"nonsense");
    let files = HandModel::files(folder.path("hand.toml"));
    assert_eq!(files, [folder.0.path().join("hand.toml"), folder.0.path().join("gripper.urdf")]);
    std::fs::write(folder.path("hand.toml"), "nonsense").unwrap();
    assert_eq!(HandModel::files(folder.path("hand.toml")), [folder.0.path().join("hand.toml")]);
    assert_eq!(HandModel::files("three-finger"), Vec::<std::path::PathBuf>::new());
}
