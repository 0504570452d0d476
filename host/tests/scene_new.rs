//! `blindgrasp scene new` as a user meets it: what it prints and writes, and what it says where there is no placement.

use crate::folder::{Folder, text};
use serde_json::Value;
use std::fs;
use std::process::Output;

fn new_scene(folder: &Folder, arguments: &[&str]) -> Output {
    folder.run(&[&["scene", "new"], arguments].concat())
}

fn refused(folder: &Folder, arguments: &[&str], words: &str) {
    folder.refused(&[&["scene", "new"], arguments].concat(), &[words]);
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", text(&output.stderr)))
}

#[test]
fn what_is_written_is_what_is_printed_and_what_sim_runs() {
    let folder = Folder::new();
    let output = new_scene(&folder, &["three-finger", "cube", "--ideal", "--json", "--list", "3"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let printed = json(&output);
    assert_eq!(
        (&printed["placed"], &printed["scene"]),
        (&Value::from(true), &Value::from("three-finger-cube-ideal.toml"))
    );
    let placements = printed["placements"].as_array().expect("a list");
    assert_eq!(placements.len(), 3);
    let score = |k: usize| placements[k]["quality"]["score"].as_f64().expect("a number");
    assert!(score(0) >= score(1) && score(1) >= score(2));
    // The effective scene of a run has the joint angles that were printed, in its first row.
    let run = folder.run(&["sim", "three-finger-cube-ideal.toml", "--duration", "0.01", "--out", "run"]);
    assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
    let trace = folder.read("run/trace.csv");
    let row: Vec<f64> = trace
        .lines()
        .nth(1)
        .expect("a row")
        .split(',')
        .skip(1)
        .take(12)
        .map(|v| v.parse().expect("a number"))
        .collect();
    let angles = placements[0]["angles_rad"].as_array().expect("a list");
    for (a, b) in row.iter().zip(angles) {
        assert_eq!(Some(*a), b.as_f64());
    }
    // The text says the same.
    let shown = new_scene(&folder, &["three-finger", "cube", "--ideal", "--force", "--list", "2"]);
    let table = text(&shown.stdout);
    assert!(
        table.contains("chance to hold") && table.contains("finger-3") && table.contains("faces"),
        "{table}"
    );
    assert!(text(&shown.stderr).contains("wrote three-finger-cube-ideal.toml"));
}

#[test]
fn a_file_is_overwritten_only_by_force() {
    let folder = Folder::new();
    let arguments = ["two-finger", "cube", "--out", "mine.toml"];
    assert_eq!(new_scene(&folder, &arguments).status.code(), Some(0));
    refused(
        &folder,
        &arguments,
        "mine.toml: is there already; choose another with --out, or overwrite it with --force",
    );
    assert_eq!(new_scene(&folder, &[&arguments[..], &["--force"]].concat()).status.code(), Some(0));
}

#[test]
fn references_are_relative_to_the_file() {
    let folder = Folder::new();
    fs::create_dir_all(folder.path("scenes/deep")).expect("a directory");
    let block =
        "schema = 1\nname = \"block\"\ndensity_kg_m3 = 20\n[shape.box]\nsize_m = [0.05, 0.04, 0.05]\n";
    folder.write("parts/block.toml", block);
    let output = new_scene(
        &folder,
        &[
            "three-finger",
            "parts/block.toml",
            "--out",
            "scenes/deep/s.toml",
            "--any-attitude",
            "--force-n",
            "4",
        ],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let written = folder.read("scenes/deep/s.toml");
    assert!(
        written.contains("object = \"../../parts/block.toml\"") && written.contains("force_n = 4.0"),
        "{written}"
    );
    let run = folder.run(&["sim", "scenes/deep/s.toml", "--duration", "0.1"]);
    assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
}

#[test]
fn what_the_user_fixes_is_respected() {
    let folder = Folder::new();
    let output = new_scene(
        &folder,
        &[
            "three-finger",
            "cube",
            "--json",
            "--face",
            "finger-1=2",
            "--point",
            "3=-0.024,0,0",
            "--position",
            "0,0.01,0.13",
            "--rotation-rpy",
            "0,0,0",
        ],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let placement = &json(&output)["placements"][0];
    assert_eq!((&placement["faces"][0], &placement["faces"][2]), (&Value::from(2), &Value::from(0)));
    assert_eq!(placement["position_m"], serde_json::json!([0.0, 0.01, 0.13]));
}

#[test]
fn no_placement_is_told_with_exit_code_1() {
    let folder = Folder::new();
    let arguments = ["three-finger", "cube", "--position", "1,0,0"];
    let output = new_scene(&folder, &arguments);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let reason = "the given position is none at which, in this attitude, all 3 fingertips get to contacts of theirs at once";
    assert!(text(&output.stdout).starts_with(&format!("no placement of cube in three-finger: {reason}\n")));
    let output = new_scene(&folder, &[&arguments[..], &["--json"]].concat());
    assert_eq!(output.status.code(), Some(1));
    let printed = json(&output);
    assert_eq!((&printed["placed"], printed["reason"].as_str()), (&Value::from(false), Some(reason)));
    assert!(printed["tests"].as_array().is_some_and(|tests| !tests.is_empty()));
    assert_eq!(fs::read_dir(folder.path("")).expect("a folder").count(), 0, "nothing is written");
}

#[test]
fn bad_input_has_exit_code_2() {
    let folder = Folder::new();
    refused(&folder, &["three-fingers", "cube"], "did you mean `three-finger`?");
    refused(&folder, &["three-finger", "cub"], "did you mean `cube`?");
    refused(&folder, &["three-finger", "nowhere/x.toml"], "nowhere/x.toml: no such file");
    refused(&folder, &["three-finger", "cube", "--face", "1"], "--face 1: has to be FINGER=...");
    refused(
        &folder,
        &["three-finger", "cube", "--face", "finger-9=1"],
        "there is no fingertip `finger-9`; did you mean `finger-",
    );
    refused(&folder, &["three-finger", "cube", "--face", "0=1"], "there is no fingertip `0`");
    refused(&folder, &["three-finger", "cube", "--face", "1=top"], "`top` is not a number of a face");
    refused(
        &folder,
        &["three-finger", "cube", "--face", "1=6"],
        "contact.1.face: the object has no face 6; has to be between 0 and 5",
    );
    refused(
        &folder,
        &["three-finger", "cube", "--position", "1,2"],
        "has to be three numbers with commas between them",
    );
    refused(
        &folder,
        &["three-finger", "cube", "--position", "1,2,nan"],
        "has to be three numbers with commas between them",
    );
    refused(&folder, &["three-finger", "cube", "--force-n", "-1"], "control.force_n: -1.0 is out of range");
    refused(&folder, &["hand-arm", "cuboid", "--trunk", "arm=0.1"], "there is no joint `arm`");
    folder.write("bad.toml", "schema = 1\nname = \"x\"\nmass_kg = 1\n[shape.box]\nsize_m = [0.1, -1, 0.1]\n");
    refused(
        &folder,
        &["three-finger", "./bad.toml"],
        "bad.toml:5: shape.box.size_m: the length along y has to be positive",
    );
    let both = new_scene(&folder, &["three-finger", "cube", "--any-attitude", "--rotation-rpy", "0,0,1"]);
    assert_eq!(both.status.code(), Some(2));
}
