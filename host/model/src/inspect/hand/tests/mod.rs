//! Hands that are right, each kind of mistake in one that was, and damage at random.

mod damage;
mod mistakes;
mod senses;
mod structure;

use super::*;
use crate::inspect::finding::Severity;

/// Hands of the paper's fingers, which the tests change.
const PAPER_S: [&str; 2] = ["three-finger", "two-finger"];

/// The text of a shipped hand without its postures, which follow from all other numbers.
fn text(name: &str) -> String {
    let path = format!("{}/../../models/hands/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    text.split("\n# Postures").next().unwrap().to_owned()
}

/// A shipped hand as the rules see it.
pub(super) fn specimen(name: &str) -> Specimen {
    specimen_of(HandFile::load(name).unwrap())
}

pub(super) fn specimen_of(file: HandFile) -> Specimen {
    examine(&file, &mut Found::default()).unwrap()
}

/// A check of a file that was changed in code.
fn check(file: &HandFile) -> HandCheck {
    HandCheck::parse(&toml::to_string(file).unwrap(), "hand.toml").unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn shipped_hands_have_nothing_above_a_notice() {
    for name in HandFile::built_in() {
        let check = HandCheck::load(name).unwrap();
        let worse = check.findings.iter().filter(|finding| finding.severity != Severity::Notice);
        let told: Vec<&str> = worse.map(|finding| finding.what.split('`').next().unwrap_or("")).collect();
        // Four of the paper's fingers on its palm are in each other's way where three are not.
        let expected = if name == "four-finger" { vec!["overlaps fingertip "; 3] } else { vec![] };
        assert_eq!(told, expected, "{}", check.text());
        assert_eq!(check.counts.errors, 0);
        let everyone = check.fingertips.len();
        assert_eq!(check.meeting.unwrap().all.unwrap().fingertips.len(), everyone, "{name}");
        assert!(check.nominal.is_some());
    }
}

#[test]
fn the_numbers_of_the_paper_s_hand() {
    let check = HandCheck::load("three-finger").unwrap();
    let masses = check.masses.unwrap();
    // Table IV: 38 + 24 + 54 g a finger.
    assert!(masses.fingers_kg.iter().all(|kg| (kg - 0.116).abs() < 1e-12));
    assert_eq!(masses.trunk_kg, 0.0);
    assert!((masses.total_kg - 0.348).abs() < 1e-12);
    let centre = masses.centre_m.unwrap();
    assert!(centre[0].abs() < 1e-12 && centre[1].abs() < 1e-12, "on the palm's axis: {centre:?}");
    for reach in &check.reach {
        assert!((reach.finger_length_m - 0.158).abs() < 1e-12 && (reach.bones_m - 0.193).abs() < 1e-12);
        assert!(reach.from_finger_most_m <= reach.finger_length_m + 1e-12);
        assert!(reach.from_base_most_m <= reach.bones_m + 1e-12);
    }
    let flex = &check.joints[3];
    assert_eq!(
        (flex.number, flex.part, flex.moves.as_slice()),
        (4, Some("finger"), &["finger-1".to_owned()][..])
    );
    assert!(flex.closing.unwrap() > 0.3);
    assert!(check.joints[0].closing.unwrap().abs() < 1e-9, "abduction moves the fingertip aside");
}
#[test]
fn json_has_these_keys() {
    let keys =
        |value: &serde_json::Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>().join(" ");
    let check = serde_json::to_value(HandCheck::load("three-finger").unwrap()).unwrap();
    assert_eq!(
        keys(&check),
        "capsules closing counts description findings fingertips joints masses meeting name postures reach verdict"
    );
    assert_eq!(
        keys(&check["joints"][0]),
        "axis axis_in_base closing encoder_counts_per_turn limits_rad moves name nominal_rad number parent part \
         speed_limit_rad_s torque_limit_nm"
    );
    assert_eq!(
        keys(&check["fingertips"][0]),
        "grasping_force_n least_force_n limited_by link name number own_joints radius_m shared_joints"
    );
    assert_eq!(
        keys(&check["reach"][0]),
        "bones_m finger_base_m finger_length_m fingertip from_base_least_m from_base_most_m from_finger_least_m \
         from_finger_most_m"
    );
    assert_eq!(keys(&check["postures"][0]), "angles_rad from_middle_m middle_m name");
    assert_eq!(keys(&check["masses"]), "centre_m fingers_kg total_kg trunk_kg");
    assert_eq!(keys(&check["meeting"]["all"]), "ball_radius_m centre_m fingertips");
    assert_eq!(
        keys(&check["closing"]),
        "force_n lag_m least_half_width_m most_force_n moving_force_n posture stiffest"
    );
    assert_eq!(check["verdict"], "good");
    assert_eq!(check["findings"].as_array().map(Vec::len), Some(0));
}
