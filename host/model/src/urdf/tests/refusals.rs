//! The very message that each mistake in a URDF gets.

use super::*;

/// Faults in the URDF.
#[test]
fn errors_in_the_urdf_say_where_what_and_what_to_do() {
    for case in cases(include_str!("urdf.cases")) {
        case.check(GRIPPER, |urdf| message(HAND, urdf));
    }
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
