//! Trees that are none, and what is still said of their joints.

use super::*;

fn lines(text: &str) -> Vec<String> {
    HandCheck::parse(text, "hand.toml").unwrap_or_else(|error| panic!("{error}")).findings.lines()
}

fn number(text: &str, words: &str) -> usize {
    1 + text.lines().position(|line| line.contains(words)).unwrap()
}

#[test]
fn a_joint_that_moves_no_fingertip_is_told_and_left_out() {
    let stray = "
[[joint]]
name = \"thumb-1\"
axis = [0.0, 1.0, 0.0]
limits_rad = [-1.0, 1.0]
damping_gain_nm_s_rad = 3e-4
[[joint]]
name = \"thumb-2\"
parent = \"thumb-1\"
axis = [0.0, 1.5, 0.0]
limits_rad = [-1.0, 1.0]
damping_gain_nm_s_rad = 3e-4
";
    // Before the others, so that their numbers in the file are not those in the hand.
    let text = text("two-finger");
    let at = text.find("[[joint]]").unwrap();
    let text =
        format!("{}{stray}{}", &text[..at], &text[at..].replacen("mass_kg = 0.038", "mass_kg = 380", 1));
    assert_eq!(
        lines(&text),
        [
            format!(
                "error: hand.toml:{}: joint `thumb-1`: moves no fingertip; leave it out and add its mass to its parent",
                number(&text, "name = \"thumb-1\"")
            ),
            format!(
                "error: hand.toml:{}: joint `thumb-2`: its axis [0.0, 1.5, 0.0] has length 1.5, not 1; write [0.0, 1.0, 0.0]",
                number(&text, "1.5")
            ),
            format!(
                "warning: hand.toml:{}: joint `finger-1-flex-1`: its mass of 380 kg is more than a finger of 158 mm can have; \
                 write kilograms: 380 g are 0.38 kg",
                number(&text, "380")
            ),
        ]
    );
    let check = HandCheck::parse(&text, "hand.toml").unwrap();
    assert_eq!(check.joints.len(), 10);
    assert_eq!((check.joints[0].part, check.joints[2].part), (None, Some("finger")));
    assert_eq!(check.nominal.unwrap().joint_names.len(), 8);
    assert_eq!(check.masses.unwrap().fingers_kg.len(), 2);
}

#[test]
fn where_the_tree_is_not_known_numbers_are_still_looked_at() {
    let text = text("three-finger")
        .replacen("parent = \"finger-1-flex-1\"", "parent = \"finger-9\"", 1)
        .replacen("limits_rad = [-0.6, 0.6]", "limits_rad = [-34, 34]", 1);
    let check = HandCheck::parse(&text, "hand.toml").unwrap();
    assert_eq!((check.counts.errors, check.counts.warnings), (1, 1));
    assert!(
        check.reach.is_empty()
            && check.masses.is_none()
            && check.meeting.is_none()
            && check.nominal.is_none()
    );
    assert!(check.text().contains("broken: 1 error, 1 warning"));
}

#[test]
fn too_few_and_too_many() {
    let two = text("two-finger");
    let one = &two[..two.rfind("[[fingertip]]").unwrap()];
    let text = one.replacen("mass_kg = 0.038", "mass_kg = -1", 1);
    assert_eq!(
        lines(&text),
        [
            format!(
                "error: hand.toml:{}: joint `finger-1-flex-1`: mass_kg: -1.0 is out of range; has to be between 0.0 and 10000.0",
                number(&text, "mass_kg = -1")
            ),
            format!(
                "error: hand.toml:{}: the hand has 1 fingertip: grasping needs at least two; add a [[fingertip]]",
                number(&text, "[[fingertip]]")
            ),
        ]
    );
    let mut file = HandFile::load("three-finger").unwrap();
    file.postures.clear();
    for k in 0..13 {
        let mut joint = file.joints[3].clone();
        joint.name = format!("more-{k}");
        file.joints.push(joint);
    }
    let told: Vec<String> = check(&file).findings.iter().map(|finding| finding.what.clone()).collect();
    assert_eq!(told, ["the hand has 25 joints: at most 24 are supported"]);
}

/// A posture is listed with where its fingertips are; what is wrong with it is told with its name.
#[test]
fn postures_are_listed_and_looked_at() {
    let mut file = HandFile::load("three-finger").unwrap();
    let good = check(&file);
    let [open, preshape] = &good.postures[..] else { panic!("{:?}", good.postures) };
    assert_eq!((open.name.as_str(), preshape.name.as_str()), ("open", "preshape"));
    for (is, is_meant) in open.middle_m.iter().chain(&open.from_middle_m).zip([0.0, 0.0, 0.125, 0.075, 0.075])
    {
        assert!((is - is_meant).abs() < 2e-5, "{is}");
    }
    let shown = good.text();
    assert!(
        shown.contains("\npostures  open: fingertips 75 .. 75 mm from their middle at (0, 0, 125) mm\n"),
        "{shown}"
    );
    // Two fingers curled onto each other.
    for finger in [4, 8] {
        file.postures[1].angles_rad[finger..finger + 4].copy_from_slice(&[0.0, 0.9, 0.9, 0.9]);
    }
    let crossed = check(&file);
    assert_eq!(crossed.verdict, Verdict::Doubtful);
    let [finding] = &crossed.findings.lines()[..] else { panic!("{}", crossed.text()) };
    assert!(finding.contains(": posture `preshape`: ") && finding.contains(" overlap by "), "{finding}");
    file.postures[0].name = "Open".into();
    file.postures[0].angles_rad[1] = -1.3;
    let end = "posture `Open`: `Open` is not a name of a posture; has to be 1 to 15 small letters (a to z), digits and hyphens";
    let lines = check(&file).findings.lines();
    assert!(lines[0].ends_with(end), "{lines:?}");
    assert!(
        lines[1].ends_with("posture `Open`: angles_rad: -1.3 is outside the limits of joint `finger-1-flex-1`; has to be between -1.1 and 1.5"),
        "{lines:?}"
    );
    file.postures[1].angles_rad.pop();
    assert!(
        check(&file).findings.lines()[2].ends_with(
            "posture `preshape`: angles_rad: 11 angles for 12 joints; give one for each joint, in the order of the file"
        ),
        "{}",
        check(&file).text()
    );
}

#[test]
fn fingertips_without_joints_and_fingers_with_too_many() {
    // Both fingertips on one chain: neither can move against the other.
    let mut file = HandFile::load("two-finger").unwrap();
    file.joints.truncate(4);
    file.fingertips[1].link = file.joints[3].name.clone();
    file.fingertips[1].offset_m = [0.0, 0.06, 0.03];
    let told = check(&file);
    let what =
        |check: &HandCheck| check.findings.iter().map(|finding| finding.what.clone()).collect::<Vec<_>>();
    assert!(
        what(&told).iter().filter(|what| what.starts_with("has no joint of its own")).count() == 2,
        "{}",
        told.text()
    );
    // A finger of nine joints.
    let mut file = HandFile::load("two-finger").unwrap();
    for k in 0..5 {
        let mut joint = file.joints[3].clone();
        joint.name = format!("more-{k}");
        joint.parent = Some(if k == 0 { "finger-1-flex-3".into() } else { format!("more-{}", k - 1) });
        file.joints.push(joint);
    }
    file.fingertips[0].link = "more-4".into();
    let told = what(&check(&file));
    assert!(
        told.iter().any(|what| what.contains("9 joints of its own: the simulation takes at most 8")),
        "{told:?}"
    );
}

#[test]
fn fingers_of_metres_and_of_a_millimetre() {
    let scaled = |factor: f64| {
        let mut file = HandFile::load("three-finger").unwrap();
        file.joints.iter_mut().for_each(|joint| joint.offset_m = joint.offset_m.map(|v| v * factor));
        file.fingertips.iter_mut().for_each(|tip| {
            tip.offset_m = tip.offset_m.map(|v| v * factor);
            tip.radius_m *= factor;
        });
        check(&file).findings.iter().map(|finding| finding.what.clone()).collect::<Vec<_>>()
    };
    assert!(scaled(12.0).contains(&"its longest finger is 1.896 m long".to_owned()));
    assert!(scaled(0.01).contains(&"its longest finger is 1.6 mm long".to_owned()));
    assert!(!scaled(4.0).iter().any(|what| what.contains("longest finger")), "the paper's hand-arm");
}

#[test]
fn what_keeps_a_file_from_being_read_is_the_loader_s_to_say() {
    let text = text("three-finger").replacen("schema = 1", "shema = 1", 1);
    let error = HandCheck::parse(&text, "hand.toml").unwrap_err().to_string();
    assert_eq!(error, "hand.toml:7: shema: unknown key; did you mean `schema`?");
    let error = HandCheck::load("three-fingers").unwrap_err().to_string();
    assert!(
        error.starts_with("three-fingers: no built-in hand is called `three-fingers`; did you mean"),
        "{error}"
    );
}
