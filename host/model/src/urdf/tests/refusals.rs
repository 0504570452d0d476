//! The very message that each mistake in a URDF gets.

use super::*;

/// Faults in the URDF.
#[test]
fn errors_in_the_urdf_say_where_what_and_what_to_do() {
    let cases = [
        // Not a URDF.
        (
            "<robot name=\"gripper\">",
            "<sdf>",
            "gripper.urdf:95: not XML: expected 'sdf' tag, not 'robot'; correct it there or before",
        ),
        ("</robot>", "", "gripper.urdf:94: not XML: it ends in the middle; is the file complete?"),
        (
            "<link name=\"left-1\">",
            "<link name=\"left-1>",
            "gripper.urdf:19: not XML: expected '\"' not '<'; correct it there or before",
        ),
        (
            "<link name=\"left-1\">",
            "<link name=\"left-1\" name=\"b\">",
            "gripper.urdf:18: not XML: attribute 'name' is already defined; correct it there or before",
        ),
        (
            "<link name=\"mount\"/>",
            "<link name=\"mount\"></lnk>",
            "gripper.urdf:5: not XML: expected 'link' tag, not 'lnk'; correct it there or before",
        ),
        (
            "<link name=\"mount\"/>",
            "<link name=\"mount\"/><sensor:camera/>",
            "gripper.urdf:5: not XML: the prefix `sensor:` is not declared; declare it in <robot> (xmlns:...), or remove what has it",
        ),
        (
            "<link name=\"mount\"/>",
            "<xacro:property name=\"a\" value=\"1\"/>",
            "gripper.urdf: is a xacro file, not a URDF; expand it first: `xacro in.xacro > out.urdf`",
        ),
        (
            "<robot name=\"gripper\">",
            "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><xacro:arg name=\"a\"/>",
            "gripper.urdf:3: is a xacro file, not a URDF; expand it first: `xacro in.xacro > out.urdf`",
        ),
        (
            "0 0.04 0",
            "0 ${width} 0",
            "gripper.urdf:28: joint `left-base`: xyz of <origin>: `0 ${width} 0` is an expression of xacro; expand it first: `xacro in.xacro > out.urdf`",
        ),
        // Numbers.
        (
            "0 0.04 0",
            "0 0.04",
            "gripper.urdf:28: joint `left-base`: xyz of <origin>: `0 0.04` has 2 numbers; has to be 3 numbers",
        ),
        (
            "0 0.04 0",
            "0 0.04 0 1",
            "gripper.urdf:28: joint `left-base`: xyz of <origin>: `0 0.04 0 1` has 4 numbers; has to be 3 numbers",
        ),
        (
            "0 0.04 0",
            "0 oops 0",
            "gripper.urdf:28: joint `left-base`: xyz of <origin>: `oops` is not a number; write it as 0.1 or 1e-1",
        ),
        (
            "0 0.04 0",
            "0,0.04,0",
            "gripper.urdf:28: joint `left-base`: xyz of <origin>: `0,0.04,0` is not a number; separate numbers by blanks, and write decimals with a point",
        ),
        (
            "0 0.04 0",
            "0 nan 0",
            "gripper.urdf:28: joint `left-base`: xyz of <origin>: `nan` is not finite; has to be a finite number",
        ),
        (
            "0 0.04 0",
            "0 -inf 0",
            "gripper.urdf:28: joint `left-base`: xyz of <origin>: `-inf` is not finite; has to be a finite number",
        ),
        (
            "0 0.04 0",
            "0 1e400 0",
            "gripper.urdf:28: joint `left-base`: xyz of <origin>: `1e400` is not finite; has to be a finite number",
        ),
        (
            "0.1 0.2 0.3",
            "0.1 0.2 infinity",
            "gripper.urdf:20: link `left-1`: rpy of <origin>: `infinity` is not finite; has to be a finite number",
        ),
        (
            "lower=\"-0.8\"",
            "lower=\"-0.8 1\"",
            "gripper.urdf:30: joint `left-base`: lower of <limit>: `-0.8 1` has 2 numbers; has to be one number",
        ),
        (
            "lower=\"-0.8\"",
            "lower=\"\"",
            "gripper.urdf:30: joint `left-base`: lower of <limit>: is empty; has to be one number",
        ),
        (
            "effort=\"1.2\"",
            "effort=\"-1.2\"",
            "gripper.urdf:30: joint `left-base`: effort of <limit> is negative: -1.2; check the number",
        ),
        (
            "<mass value=\"0.04\"/>",
            "<mass value=\"-0.04\"/>",
            "gripper.urdf:21: link `left-1`: value of <mass> is negative: -0.04; check the number",
        ),
        (
            "<mass value=\"0.04\"/>",
            "<mass value=\"nan\"/>",
            "gripper.urdf:21: link `left-1`: value of <mass>: `nan` is not finite; has to be a finite number",
        ),
        (
            "<mass value=\"0.04\"/>",
            "<mass/>",
            "gripper.urdf:19: link `left-1`: no mass; add <mass value=\"...\"/>",
        ),
        ("<mass value=\"0.04\"/>", "", "gripper.urdf:19: link `left-1`: no mass; add <mass value=\"...\"/>"),
        (
            "<inertia ixx=\"8e-6\" iyy=\"8e-6\" izz=\"1e-6\"/>",
            "",
            "gripper.urdf:34: link `left-2`: a mass without inertia; add <inertia ixx=... iyy=... izz=.../>, about the mass centre",
        ),
        (
            "<inertia ixx=\"8e-6\" iyy=\"8e-6\" izz=\"1e-6\"/>",
            "<inertia ixx=\"8e-6\" iyy=\"8e-6\"/>",
            "gripper.urdf:37: link `left-2`: no izz; add izz=\"...\"",
        ),
        (
            "<inertia ixx=\"8e-6\" iyy=\"8e-6\" izz=\"1e-6\"/>",
            "<inertia ixx=\"8e-6\" iyy=\"-8e-6\" izz=\"1e-6\"/>",
            "gripper.urdf:37: link `left-2`: iyy of <inertia> is negative: -8e-6; check the number",
        ),
        (
            "damping=\"1e-4\"",
            "damping=\"-1\"",
            "gripper.urdf:31: joint `left-base`: damping of <dynamics> is negative: -1.0; check the number",
        ),
        // Names and the tree.
        (
            "<link name=\"left-1\">",
            "<link>",
            "gripper.urdf:18: a link without a name; write <link name=\"...\">",
        ),
        (
            "<joint name=\"left-base\" type=\"revolute\">",
            "<joint type=\"revolute\">",
            "gripper.urdf:25: a joint without a name; write <joint name=\"...\">",
        ),
        (
            "<link name=\"left-2\">",
            "<link name=\"left-1\">",
            "gripper.urdf:33: link `left-1` is there twice, the first in line 18; rename one of them",
        ),
        (
            "<joint name=\"left-knuckle\"",
            "<joint name=\"left-base\"",
            "gripper.urdf:40: joint `left-base` is there twice, the first in line 25; rename one of them",
        ),
        (
            "<parent link=\"left-1\"/>",
            "<parent link=\"left_1\"/>",
            "gripper.urdf:41: joint `left-knuckle`: there is no link `left_1`; did you mean `left-1`?",
        ),
        (
            "<parent link=\"left-1\"/>",
            "",
            "gripper.urdf:40: joint `left-knuckle`: no parent; add <parent link=\"...\"/>",
        ),
        (
            "<parent link=\"left-1\"/>",
            "<parent/>",
            "gripper.urdf:40: joint `left-knuckle`: no parent; add <parent link=\"...\"/>",
        ),
        (
            "<child link=\"left-2\"/>",
            "",
            "gripper.urdf:40: joint `left-knuckle`: no child; add <child link=\"...\"/>",
        ),
        (
            "<parent link=\"left-1\"/>",
            "<parent link=\"left-2\"/>",
            "gripper.urdf:40: joint `left-knuckle`: joins link `left-2` to itself; name another parent or child",
        ),
        (
            "<parent link=\"left-1\"/>",
            "<parent link=\"left-tip\"/>",
            "gripper.urdf:40: links go round in a circle: `left-2` -> `left-tip` -> `left-2`; remove one of the joints: a URDF is a tree",
        ),
        (
            "<child link=\"left-2\"/>",
            "<child link=\"right-2\"/>",
            "gripper.urdf:80: link `right-2` hangs on two joints, `left-knuckle` and `right-knuckle`; remove one of them: a URDF is a tree, and has no closed loops",
        ),
        (
            "<link name=\"mount\"/>",
            "<link name=\"mount\"/><link name=\"shelf\"/>",
            "gripper.urdf:5: links `mount` and `shelf` hang on no joint; a URDF has one root: join them by a fixed joint, or remove one",
        ),
        // Joints.
        (
            "type=\"revolute\"",
            "type=\"hinge\"",
            "gripper.urdf:25: joint `left-base`: type `hinge` is unknown; known: fixed, revolute, continuous, prismatic, floating, planar, spherical",
        ),
        (
            "type=\"revolute\"",
            "type=\"Revolute\"",
            "gripper.urdf:25: joint `left-base`: type `Revolute` is unknown; did you mean `revolute`?",
        ),
        (
            "type=\"revolute\"",
            "",
            "gripper.urdf:25: joint `left-base`: no type; known: fixed, revolute, continuous, prismatic, floating, planar, spherical",
        ),
        (
            "type=\"revolute\"",
            "type=\"prismatic\"",
            "gripper.urdf:25: joint `left-base` is prismatic, but the law is for revolute joints; hold it still with `locked_m = { left-base = 0.0 }` in [urdf] (or `--lock` of `hand new`)",
        ),
        (
            "type=\"revolute\"",
            "type=\"floating\"",
            "gripper.urdf:25: joint `left-base` is floating, but the law is for revolute joints; make it fixed in the URDF, or choose a `base` below it in [urdf]",
        ),
        (
            "type=\"revolute\"",
            "type=\"planar\"",
            "gripper.urdf:25: joint `left-base` is planar, but the law is for revolute joints; make it fixed in the URDF, or choose a `base` below it in [urdf]",
        ),
        (
            "type=\"revolute\"",
            "type=\"spherical\"",
            "gripper.urdf:25: joint `left-base` is spherical, but the law is for revolute joints; make it fixed in the URDF, or choose a `base` below it in [urdf]",
        ),
        (
            "<axis xyz=\"1 0 0\"/>",
            "<axis xyz=\"0 0 0\"/>",
            "gripper.urdf:29: joint `left-base`: the axis is zero; give its direction, such as 0 0 1",
        ),
        (
            "<axis xyz=\"1 0 0\"/>",
            "<axis xyz=\"1 1 0\"/>",
            "gripper.urdf:29: joint `left-base`: the axis is 1.4142 long; has to be a unit vector: divide it by its length",
        ),
        (
            "<axis xyz=\"1 0 0\"/>",
            "<axis/>",
            "gripper.urdf:29: joint `left-base`: an axis without xyz; add xyz=\"...\"",
        ),
        (
            "<axis xyz=\"1 0 0\"/>",
            "<axis xyz=\"1 0 0\"/><mimic joint=\"right-base\"/>",
            "gripper.urdf:25: joint `left-base` follows `right-base` (<mimic>), but the law sets each torque on its own; hold it still with `locked_rad = { left-base = 0.0 }` in [urdf] (or `--lock` of `hand new`), or remove <mimic> from each that has a motor of its own",
        ),
        (
            "<limit lower=\"-0.8\" upper=\"1.4\" effort=\"1.2\" velocity=\"10\"/>",
            "",
            "gripper.urdf:25: joint `left-base`: no limits; give `limits_rad` in [joint_defaults], or in its [[joint]]",
        ),
        (
            " effort=\"1.2\"",
            "",
            "gripper.urdf:30: joint `left-base`: <limit> has no effort; give `torque_limit_nm` in [joint_defaults], or in its [[joint]]",
        ),
        (
            "effort=\"1.2\"",
            "effort=\"0\"",
            "gripper.urdf:30: joint `left-base`: effort is 0; give `torque_limit_nm` in [joint_defaults], or in its [[joint]]",
        ),
        (
            " velocity=\"10\"",
            "",
            "gripper.urdf:30: joint `left-base`: <limit> has no velocity; give `speed_limit_rad_s` in [joint_defaults], or in its [[joint]]",
        ),
        (
            "velocity=\"10\"",
            "velocity=\"0.0\"",
            "gripper.urdf:30: joint `left-base`: velocity is 0; give `speed_limit_rad_s` in [joint_defaults], or in its [[joint]]",
        ),
        (
            " lower=\"-0.8\" upper=\"1.4\"",
            "",
            "gripper.urdf:30: joint `left-base`: no limits; give `limits_rad` in [joint_defaults], or in its [[joint]]",
        ),
        (
            "lower=\"-0.8\" upper=\"1.4\"",
            "lower=\"1.4\" upper=\"-0.8\"",
            "gripper.urdf:30: joint `left-base`: lower (1.4) is not below upper (-0.8); correct <limit>, or give `limits_rad` in its [[joint]]",
        ),
        (
            "lower=\"-0.8\" upper=\"1.4\"",
            "lower=\"0\" upper=\"0\"",
            "gripper.urdf:30: joint `left-base`: lower (0.0) is not below upper (0.0); correct <limit>, or give `limits_rad` in its [[joint]]",
        ),
        (
            "lower=\"-0.8\" upper=\"1.4\"",
            "lower=\"0.8\"",
            "gripper.urdf:30: joint `left-base`: lower (0.8) is not below upper (0.0); correct <limit>, or give `limits_rad` in its [[joint]]",
        ),
        // What the hand says to it.
        (
            "<inertia ixx=\"8e-6\" iyy=\"8e-6\" izz=\"1e-6\"/>",
            "<inertia ixx=\"8e-6\" iyy=\"8e-6\" izz=\"1e-6\" iyz=\"1e-3\"/>",
            "gripper.urdf:37: link `left-2`: iyz is larger than its two moments of inertia allow; give the inertia about the mass centre, in kg m^2",
        ),
        (
            "<mass value=\"0.03\"/>",
            "<mass value=\"1e300\"/>",
            "gripper.urdf:34: joint.2.mass_kg: 1e300 is out of range; has to be between 0.0 and 10000.0",
        ),
        (
            "lower=\"-0.8\" upper=\"1.4\"",
            "lower=\"-800\" upper=\"1.4\"",
            "gripper.urdf:30: joint.1.limits_rad: -800.0 is out of range; has to be within 100.0 of zero",
        ),
        (
            "<joint name=\"left-base\"",
            "<joint name=\"left&#10;base\"",
            "gripper.urdf:25: joint.1.name: is not a name; has to be a word of at most 100 bytes, without control characters",
        ),
        (
            "<joint name=\"left-base\"",
            "<joint name=\"left-base-0123456789012345678901234567890123456789012345678901234567890123456789012345678901234567890123456789\"",
            "gripper.urdf:25: joint.1.name: is not a name; has to be a word of at most 100 bytes, without control characters",
        ),
        (
            "<joint name=\"left-base\"",
            "<joint name=\" \"",
            "gripper.urdf:25: a joint without a name; write <joint name=\"...\">",
        ),
    ];
    assert_all(&cases, GRIPPER, &|urdf| message(HAND, urdf));
}

/// Several joints of the same kind are told at once.
#[test]
fn joints_that_follow_others_are_told_together() {
    let urdf = GRIPPER.replace("<origin xyz=\"0 0 0.06\"", "<mimic joint=\"x\"/><origin xyz=\"0 0 0.06\"");
    assert_eq!(
        message(HAND, &urdf),
        "gripper.urdf:40: joints `left-knuckle`, `right-knuckle` follow others (<mimic>), but the law sets each torque on its own; hold them still with `locked_rad = { left-knuckle = 0.0, right-knuckle = 0.0 }` in [urdf] (or `--lock` of `hand new`), or remove <mimic> from each that has a motor of its own"
    );
}

#[test]
fn files_that_are_no_text_are_told() {
    let refused =
        |urdf: &[u8]| load_bytes(HAND, urdf).map(|(file, _, _)| file.name).expect_err("has to be refused");
    let cases: [(&[u8], &str); 10] = [
        (b"", "gripper.urdf:1: not XML: there is nothing in it; is this a URDF?"),
        (b"hello", "gripper.urdf:1: not XML: unknown token; is this a URDF?"),
        (b"\n\n<robot>\xff</robot>", "gripper.urdf:3: not UTF-8 text; save it as UTF-8"),
        (b"\xff\xfe<\0r\0o\0b\0o\0t\0", "gripper.urdf:1: not UTF-8 text; save it as UTF-8"),
        (b"<robot/>", "gripper.urdf:1: has no <link>; is this a URDF?"),
        (b"<sdf/>", "gripper.urdf:1: the root is <sdf>, not <robot>; that is SDF: convert it to URDF first"),
        (
            b"<mujoco/>",
            "gripper.urdf:1: the root is <mujoco>, not <robot>; that is MJCF: convert it to URDF first",
        ),
        (b"<html/>", "gripper.urdf:1: the root is <html>, not <robot>; is this a URDF?"),
        (&[b' '; 5 << 20], "hand.toml:4: urdf.file: `gripper.urdf`: 5 MiB are too many; check the path"),
        (
            b"<!DOCTYPE robot SYSTEM \"a.dtd\"><robot/>",
            "gripper.urdf:1: has a DTD; remove <!DOCTYPE ...>: a URDF needs none",
        ),
    ];
    for (urdf, expected) in cases {
        assert_eq!(refused(urdf), expected);
    }
    // Windows' line ends, and a mark at the start.
    for text in [GRIPPER.replace('\n', "\r\n"), format!("\u{feff}{GRIPPER}")] {
        assert!(load(HAND, &text).is_ok());
    }
}
