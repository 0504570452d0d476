//! The very message that each mistake in a hand's file gets that names a URDF.

use super::*;

/// Faults in the hand's file.
#[test]
fn errors_in_the_hand_s_file_name_it() {
    for case in cases(include_str!("hand.cases")) {
        case.check(HAND, |toml| message(toml, GRIPPER));
    }
    let no_tips = &HAND[..HAND.find("[[fingertip]]").unwrap()];
    assert_eq!(
        message(no_tips, GRIPPER),
        "hand.toml:3: fingertip: is missing; add a [[fingertip]], with the URDF's link"
    );
    let last = "\n[[joint]]\nname = \"left-base\"\nmas_kg = 1\n[[joint]]\nname = \"left-knuckle\"\n[[joint]]\nname = \"right-base\"\n[[joint]]\nname = \"right-knuckle\"\n";
    assert_eq!(
        message(&format!("{HAND}{last}"), GRIPPER),
        "hand.toml:32: joint.1.mas_kg: unknown key; did you mean `mass_kg`?"
    );
}

#[test]
fn a_urdf_alone_is_no_hand() {
    for name in ["gripper.urdf", "some/gripper.urdf"] {
        let expected = format!(
            "{name}: a URDF alone is not a hand: it has no fingertips and gains; `blindgrasp hand new {name}` writes a hand's file that names it"
        );
        assert_eq!(HandFile::load(name).unwrap_err().to_string(), expected);
    }
}

/// More joints than a hand can have.
#[test]
fn too_many_joints_are_told_with_the_remedy() {
    let mut urdf = String::from("<robot name=\"r\"><link name=\"palm\"/>");
    let mut parent = "palm".to_owned();
    for k in 0..25 {
        let child = if k == 24 { "left-tip".into() } else { format!("l{k}") };
        urdf += &format!(
            "<link name=\"{child}\"/><joint name=\"j{k}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/></joint>"
        );
        parent = child;
    }
    urdf += "<link name=\"right-tip\"/><joint name=\"r\" type=\"fixed\"><parent link=\"l3\"/><child link=\"right-tip\"/></joint></robot>";
    assert_eq!(
        message(HAND, &urdf),
        "gripper.urdf:1: 25 joints move a fingertip: at most 24 are supported; choose a `base` closer to the hand, hold joints still, or name fewer fingertips"
    );
}
