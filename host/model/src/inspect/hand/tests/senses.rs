//! Each axis of the shipped hands turned round.

use super::*;

fn turn(joint: &mut crate::file::JointFile) {
    joint.axis = joint.axis.map(|v| 0.0 - v);
}

/// Returns the findings on axes after one was turned round, by severity and key.
fn told(file: &HandFile) -> Vec<(Severity, String)> {
    let findings = check(file).findings;
    let of_axes = findings.iter().filter(|finding| finding.key.ends_with(".axis"));
    of_axes.map(|finding| (finding.severity, finding.key.clone())).collect()
}

/// A joint whose range has a side is found with a warning, whichever it is. One with a symmetric range leaves the same hand:
/// it is told where at least two other fingers say what was meant.
#[test]
fn axes_that_are_turned_round_are_found() {
    for name in PAPER_S {
        let file = HandFile::load(name).unwrap();
        for k in 0..file.joints.len() {
            let mut file = file.clone();
            turn(&mut file.joints[k]);
            let key = format!("joint.{}.axis", k + 1);
            let [lower, upper] = file.joints[k].limits_rad;
            let expected = match (lower + upper == 0.0, file.fingertips.len()) {
                (false, _) => vec![(Severity::Warning, key)],
                (true, 2) => vec![],
                (true, _) => vec![(Severity::Notice, key)],
            };
            let severities: Vec<_> =
                check(&file).findings.iter().map(|f| (f.severity, f.key.clone())).collect();
            assert_eq!(severities, expected, "{name} {}", file.joints[k].name);
        }
    }
}

/// Over all shipped hands, arms and thumbs included: nearly all of those that make another hand, whose range is not
/// symmetric, and some of the others; and of hands as they are shipped, none.
#[test]
fn nearly_all_axes_of_all_hands_are_found() {
    // Of those that make another hand, and of all.
    let (mut found, mut all) = ([0, 0], [0, 0]);
    for name in HandFile::built_in() {
        let file = HandFile::load(name).unwrap();
        assert_eq!(told(&file), [], "{name}");
        for k in 0..file.joints.len() {
            let mut file = file.clone();
            turn(&mut file.joints[k]);
            let is_found = told(&file).iter().any(|(_, key)| *key == format!("joint.{}.axis", k + 1));
            let [lower, upper] = file.joints[k].limits_rad;
            let counted = if lower + upper == 0.0 { 1..2 } else { 0..2 };
            for kind in counted {
                all[kind] += 1;
                found[kind] += usize::from(is_found);
            }
            if !is_found {
                println!("{name}: {} is missed", file.joints[k].name);
            }
        }
    }
    println!(
        "of {} axes turned round, {} are found; of {} that make another hand, {}",
        all[1], found[1], all[0], found[0]
    );
    assert!(found[0] * 100 >= all[0] * 95 && found[1] * 100 >= all[1] * 75, "{found:?} of {all:?}");
}

/// The same hand with other signs: nothing is wrong with it.
#[test]
fn a_joint_that_counts_the_other_way_is_none_of_it() {
    for name in HandFile::built_in() {
        let file = HandFile::load(name).unwrap();
        // One joint, and all of them.
        for turned in (0..file.joints.len()).map(|k| k..k + 1).chain(std::iter::once(0..file.joints.len())) {
            let mut file = file.clone();
            for joint in &mut file.joints[turned] {
                turn(joint);
                let [lower, upper] = joint.limits_rad;
                joint.limits_rad = [0.0 - upper, 0.0 - lower];
                joint.nominal_rad = 0.0 - joint.nominal_rad;
            }
            let told = told(&file);
            assert!(told.iter().all(|(severity, _)| *severity == Severity::Notice), "{name} {told:?}");
        }
    }
}
