//! `blindgrasp hand check` as a user meets it: exit codes, streams, JSON, and the picture.

use crate::folder::{Folder, text};
use serde_json::Value;
use std::path::Path;
use std::process::Output;

fn check(arguments: &[&str]) -> Output {
    Folder::new().run(&[&["hand", "check"], arguments].concat())
}

/// Writes a file with the three-fingered hand, changed.
fn hand(folder: &Folder, from: &str, to: &str) -> String {
    let text = include_str!("../../models/hands/three-finger.toml");
    assert!(text.contains(from), "{from}");
    folder.write("hand.toml", text.replacen(from, to, 1))
}

#[test]
fn a_good_hand_has_exit_code_0() {
    let output = check(&["three-finger"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    for words in [
        "finger-1-flex-2",
        "47 .. 158 of 158",
        "348 g",
        "all 3 around a ball",
        "presses with 0.20 N, at most 0.33 N",
        "good: nothing found",
    ] {
        assert!(table.contains(words), "no `{words}` in {table}");
    }
}

#[test]
fn warnings_are_told_and_allowed_errors_are_not() {
    let folder = Folder::new();
    let flipped = hand(&folder, "axis = [0.0, 1.0, 0.0]", "axis = [0.0, -1.0, 0.0]");
    let output = check(&[&flipped]);
    assert_eq!(output.status.code(), Some(0));
    assert!(
        text(&output.stdout).contains("antiparallel")
            && text(&output.stdout).ends_with("doubtful: 1 warning\n")
    );
    let broken = hand(&folder, "offset_m = [0.0, 0.0, 0.064]", "offset_m = [0.0, 0.0, 64.0]");
    let output = check(&["--json", &broken]);
    assert_eq!(output.status.code(), Some(1));
    let check: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!((&check["verdict"], &check["counts"]["errors"]), (&"broken".into(), &1.into()));
    assert_eq!(check["findings"][0]["key"], "joint.3.offset_m");
    assert_eq!(check["findings"][0]["file"], broken.as_str());
    assert!(check["findings"][0]["line"].is_u64() && check["joints"].as_array().map(Vec::len) == Some(12));
}

#[test]
fn what_can_not_be_read_has_exit_code_2_and_one_line() {
    let folder = Folder::new();
    let unread = hand(&folder, "schema = 1", "schema = one");
    for arguments in
        [&[unread.as_str()][..], &["no-such-hand"], &["nowhere/hand.toml"], &["nowhere/hand.urdf"]]
    {
        let output = check(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty());
        assert_eq!(text(&output.stderr).lines().count(), 1, "{}", text(&output.stderr));
    }
    assert_eq!(check(&[]).status.code(), Some(2));
}

#[test]
fn the_picture_is_written() {
    let folder = Folder::new();
    let output = check(&["two-finger", "--picture", &folder.path("hand.svg")]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let svg = folder.read("hand.svg");
    assert!(svg.starts_with("<svg ") && svg.contains("finger-2-flex-3") && !svg.contains("NaN"));
    // A picture that can't be written is bad usage; what was found is told all the same.
    let output = check(&["two-finger", "--picture", "/nowhere/hand.svg"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stdout).contains("good: nothing found"));
    // Nothing to draw: told, and no file.
    let unknown = hand(&folder, "parent = \"finger-1-flex-1\"", "parent = \"wrist\"");
    let picture = folder.path("unknown.svg");
    let output = check(&[&unknown, "--picture", &picture]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("no picture") && !Path::new(&picture).exists());
}
