//! Hands that are right, and each kind of mistake in one that was.

use super::*;

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
fn flips() {
    for name in ["three-finger", "two-finger"] {
        let file = HandFile::load(name).unwrap();
        for k in 0..file.joints.len() {
            let mut file = file.clone();
            file.joints[k].axis = file.joints[k].axis.map(|v| -v);
            let check = check(&file);
            println!("{name} {}: {}", file.joints[k].name, check.findings.summary());
            for finding in check.findings.iter() {
                println!("    {finding}");
            }
        }
    }
}
