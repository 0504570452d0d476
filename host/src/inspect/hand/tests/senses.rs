//! Each axis of the shipped hands turned round.

use super::*;

/// A joint whose range has a side is found with a warning, whichever it is. One with a symmetric range leaves the same hand:
/// it is told where at least two other fingers say what was meant.
#[test]
fn axes_that_are_turned_round_are_found() {
    let (mut found, mut all) = (0, 0);
    for name in SHIPPED {
        let file = HandFile::load(name).unwrap();
        for k in 0..file.joints.len() {
            let mut file = file.clone();
            file.joints[k].axis = file.joints[k].axis.map(|v| 0.0 - v);
            let key = format!("joint.{}.axis", k + 1);
            let check = check(&file);
            let told: Vec<_> =
                check.findings.iter().map(|finding| (finding.severity, &finding.key)).collect();
            let [lower, upper] = file.joints[k].limits_rad;
            let expected = match (lower + upper == 0.0, file.fingertips.len()) {
                (false, _) => vec![(Severity::Warning, &key)],
                (true, 2) => vec![],
                (true, _) => vec![(Severity::Notice, &key)],
            };
            assert_eq!(told, expected, "{name} {}", file.joints[k].name);
            all += 1;
            found += told.len();
        }
    }
    println!("of {all} axes turned round, {found} are found");
    assert!(found as f64 >= 0.9 * all as f64);
}

/// The same hand with other signs: nothing is wrong with it.
#[test]
fn a_joint_that_counts_the_other_way_is_none_of_it() {
    for name in SHIPPED {
        let file = HandFile::load(name).unwrap();
        // One joint, and all of them.
        for turned in (0..file.joints.len()).map(|k| k..k + 1).chain([0..file.joints.len()]) {
            let mut file = file.clone();
            for joint in &mut file.joints[turned] {
                joint.axis = joint.axis.map(|v| 0.0 - v);
                let [lower, upper] = joint.limits_rad;
                joint.limits_rad = [0.0 - upper, 0.0 - lower];
                joint.nominal_rad = 0.0 - joint.nominal_rad;
            }
            let check = check(&file);
            let worst = check.findings.iter().map(|finding| finding.severity).min();
            assert!(worst.is_none_or(|worst| worst == Severity::Notice), "{}", check.text());
        }
    }
}
