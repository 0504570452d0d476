//! The page `docs/your-own-hand.md`, as a new user would go through it: its commands, one after the other, in an empty folder.

#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::Command;

/// The most commands that the way may take.
const MOST: usize = 10;

#[test]
fn the_page_leads_from_urdf_and_stl_to_a_grasp_that_holds() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = fs::read_to_string(root.join("docs/your-own-hand.md")).unwrap();
    let block = page.split("```sh\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let commands: Vec<&str> = block.lines().map(|line| line.split("  #").next().unwrap().trim()).collect();
    assert!(commands.len() <= MOST, "{} commands", commands.len());

    let folder = tempfile::tempdir().unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_blindgrasp"));
    // The first command builds, which is done.
    assert!(commands[0].starts_with("cargo build --release"), "{}", commands[0]);
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());
    std::os::unix::fs::symlink(root.canonicalize().unwrap().join("models"), folder.path().join("models"))
        .unwrap();
    for command in &commands[1..] {
        let output = Command::new("sh")
            .args(["-c", command])
            .env("PATH", &path)
            .current_dir(&folder)
            .output()
            .unwrap();
        let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        println!("$ {command}\n{out}{err}");
        assert!(output.status.success(), "{command}: {err}");
        assert!(!err.contains("warning"), "{command}: {err}");
    }
    // `sim` has said by its exit code that the grasp held; and it came to rest.
    let summary = fs::read_to_string(folder.path().join("run/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["grasp_held"], true, "{summary}");
    assert_eq!(summary["settled"], true, "{summary}");
    for written in ["my-hand.toml", "my-hand.svg", "part.toml", "part.svg", "grasp.toml", "run/grasp.gif"] {
        assert!(folder.path().join(written).is_file(), "{written}");
    }
}
