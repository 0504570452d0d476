//! The very message that each mistake in a hand's file gets that names a URDF.

use super::*;

/// Faults in the hand's file.
#[test]
fn errors_in_the_hand_s_file_name_it() {
    let cases = [
        ("file = \"gripper.urdf\"", "", "hand.toml:3: urdf.file: is missing; add `file = ...`"),
        ("file = \"gripper.urdf\"", "file = 3", "hand.toml:4: urdf.file: is integer `3`; has to be a string"),
        (
            "file = \"gripper.urdf\"",
            "file = \"griper.urdf\"",
            "hand.toml:4: urdf.file: `griper.urdf`: no such file; check the path",
        ),
        (
            "file = \"gripper.urdf\"",
            "file = \".\"",
            "hand.toml:4: urdf.file: `.`: it is a folder, not a file; name a .urdf file",
        ),
        (
            "file = \"gripper.urdf\"",
            "fil = \"gripper.urdf\"",
            "hand.toml:4: urdf.fil: unknown key; did you mean `file`?",
        ),
        (
            "base = \"palm\"",
            "base = \"plam\"",
            "hand.toml:5: urdf.base: there is no link `plam`; did you mean `palm`?",
        ),
        (
            "base = \"palm\"",
            "base = \"right-2\"",
            "hand.toml:24: fingertip.1.link: link `left-tip` is not below the base; choose a link of a finger, or another base, or hold less still ([urdf])",
        ),
        (
            "base = \"palm\"",
            "base = \"left-tip\"",
            "hand.toml:24: fingertip.1.link: no joint moves link `left-tip`; choose a link of a finger, or another base, or hold less still ([urdf])",
        ),
        (
            "base = \"palm\"",
            "locked = { a = 1 }",
            "hand.toml:5: urdf.locked: unknown key; did you mean `locked_m`?",
        ),
        (
            "base = \"palm\"",
            "locked_rad = { left-nuckle = 0.1 }",
            "hand.toml:5: urdf.locked_rad.left-nuckle: there is no such joint; did you mean `left-knuckle`?",
        ),
        (
            "base = \"palm\"",
            "locked_rad = { left-knuckle = 3 }",
            "hand.toml:5: urdf.locked_rad.left-knuckle: 3.0 is outside the joint's limits; has to be between -0.2 and 1.6",
        ),
        (
            "base = \"palm\"",
            "locked_rad = { left-knuckle = nan }",
            "hand.toml:5: urdf.locked_rad.left-knuckle: is NaN; has to be a finite number",
        ),
        (
            "base = \"palm\"",
            "locked_rad = { left-knuckle = \"a\" }",
            "hand.toml:5: urdf.locked_rad.left-knuckle: is string \"a\"; has to be a number",
        ),
        (
            "base = \"palm\"",
            "locked_m = { left-knuckle = 0.1 }",
            "hand.toml:5: urdf.locked_m.left-knuckle: the joint is revolute; put it into locked_rad",
        ),
        (
            "base = \"palm\"",
            "locked_rad = { left-pad = 0.1 }",
            "hand.toml:5: urdf.locked_rad.left-pad: the joint is fixed as it is; leave it out",
        ),
        (
            "base = \"palm\"",
            "locked_rad = { left-knuckle = 0.1, left-base = 0.1 }",
            "hand.toml:24: fingertip.1.link: no joint moves link `left-tip`; choose a link of a finger, or another base, or hold less still ([urdf])",
        ),
        (
            "base = \"palm\"",
            "ignore = [\"effort\", \"speed\"]",
            "hand.toml:5: urdf.ignore.2: `speed` is unknown; known: effort, velocity, damping, friction",
        ),
        (
            "link = \"left-tip\"",
            "link = \"left-top\"",
            "hand.toml:24: fingertip.1.link: gripper.urdf has no link `left-top`; did you mean `left-tip`?",
        ),
        (
            "link = \"left-tip\"",
            "link = \"palm\"",
            "hand.toml:24: fingertip.1.link: no joint moves link `palm`; choose a link of a finger, or another base, or hold less still ([urdf])",
        ),
        ("link = \"left-tip\"", "", "hand.toml:22: fingertip.1.link: is missing; add `link = ...`"),
        (
            "offset_m = [0.0, 0.0, 0.0]",
            "offset_m = [0.0, 0.0]",
            "hand.toml:16: fingertip.1.offset_m: has 2 items; has to be a list of 3",
        ),
        (
            "offset_m = [0.0, 0.0, 0.0]",
            "",
            "hand.toml:22: fingertip.1.offset_m: is missing; add `offset_m = ...`",
        ),
        (
            "damping_gain_nm_s_rad = 1e-3",
            "",
            "hand.toml:3: joint `left-base`: no `damping_gain_nm_s_rad`, of which URDF knows nothing; give `damping_gain_nm_s_rad` in [joint_defaults], or in its [[joint]]",
        ),
        (
            "encoder_counts_per_turn = 4096",
            "",
            "hand.toml:3: joint `left-base`: no `encoder_counts_per_turn`, of which URDF knows nothing; give `encoder_counts_per_turn` in [joint_defaults], or in its [[joint]]",
        ),
        (
            "[control]",
            "[[joint]]\nname = \"left-base\"\n[control]",
            "hand.toml:3: joint `left-knuckle` of the URDF moves a fingertip and has no [[joint]]; add it, or hold it still with `locked_rad = { left-knuckle = 0.0 }`",
        ),
        (
            "[control]",
            "[[joint]]\nnam = \"left-base\"\n[control]",
            "hand.toml:7: joint.1.name: is missing; add the name of the URDF's joint: `name = ...`",
        ),
        (
            "[control]",
            "[[joint]]\nname = 3\n[control]",
            "hand.toml:8: joint.1.name: is not a string; has to be the name of a joint of the URDF",
        ),
        (
            "[control]",
            "[[joint]]\nname = \"left-knuckle\"\n[control]",
            "hand.toml:8: joint.1.name: joint `left-base`, which carries it, does not come before it; move the [[joint]] `left-base` up, or add it",
        ),
        (
            "[control]",
            "[[joint]]\nname = \"left-bas\"\n[control]",
            "hand.toml:8: joint.1.name: gripper.urdf has no joint `left-bas`; did you mean `left-base`?",
        ),
        (
            "[control]",
            "[[joint]]\nname = \"left-pad\"\n[control]",
            "hand.toml:8: joint.1.name: joint `left-pad` is fixed in the URDF; leave it out: what it carries is merged with what carries it",
        ),
        (
            "[control]",
            "[[joint]]\nname = \"mount-palm\"\n[control]",
            "hand.toml:8: joint.1.name: joint `mount-palm` is fixed in the URDF; leave it out: what it carries is merged with what carries it",
        ),
        (
            "[control]",
            "[[joint]]\nname = \"left-base\"\n[[joint]]\nname = \"left-base\"\n[control]",
            "hand.toml:10: joint.2.name: `left-base` is there twice; leave one out",
        ),
        (
            "[control]",
            "[[joint]]\nname = \"left-base\"\nparent = \"right-base\"\n[control]",
            "hand.toml:3: joint `left-knuckle` of the URDF moves a fingertip and has no [[joint]]; add it, or hold it still with `locked_rad = { left-knuckle = 0.0 }`",
        ),
        (
            "[control]",
            "[[joint]]\nname = \"left-base\"\n[[joint]]\nname = \"left-knuckle\"\nparent = \"right-base\"\n[control]",
            "hand.toml:3: joint `right-base` of the URDF moves a fingertip and has no [[joint]]; add it, or hold it still with `locked_rad = { right-base = 0.0 }`",
        ),
        (
            "schema = 1",
            "schema = 1\njoint = 3",
            "hand.toml:2: joint: is not a list; write each joint as a [[joint]]",
        ),
        (
            "[joint_defaults]",
            "[joint_defaults]\nmass = 1",
            "hand.toml:12: joint.1.mass: unknown key; did you mean `mass_kg`?",
        ),
    ];
    assert_all(&cases, HAND, &|toml| message(toml, GRIPPER));
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
