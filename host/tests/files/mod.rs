//! Files that commands write: never over what should stay, never half under their names, whatever happens.
#![allow(clippy::unwrap_used, reason = "only tests are here")]

mod interruptions;
mod refusals;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The command, in a folder. It is sent signals, also where the tests themselves run in the background and ignore some.
fn blindgrasp(folder: &Path) -> Command {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.map_or(0, |mask| u64::from_str_radix(mask.trim(), 16).unwrap());
    let mut command = match ignored & 0b11 {
        0 => Command::new(env!("CARGO_BIN_EXE_blindgrasp")),
        _ => Command::new("env"),
    };
    if ignored & 0b11 != 0 {
        command.args(["--default-signal=INT,HUP", env!("CARGO_BIN_EXE_blindgrasp")]);
    }
    command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    blindgrasp(folder).args(arguments).output().unwrap()
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs a command that succeeds; returns what it says.
fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", told(&output));
    told(&output)
}

/// Names of the files in a folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// A tetrahedron of 40 mm.
fn mesh() -> String {
    let corners = [[0, 0, 0], [40, 0, 0], [0, 40, 0], [0, 0, 40]];
    let mut mesh = "solid\n".to_owned();
    for triangle in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
        mesh += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in triangle.map(|k: usize| corners[k]) {
            mesh += &format!("vertex {x} {y} {z}\n");
        }
        mesh += "endloop\nendfacet\n";
    }
    mesh + "endsolid\n"
}

/// Inputs for every command: a recording, a hand with its URDF, an object with its mesh, a scene.
fn inputs(folder: &Path) {
    succeed(folder, &["sim", "cube", "--duration", "0.3", "--out", "run.mcap"]);
    succeed(folder, &["hand", "export", "three-finger", "--urdf", "--out", "hand.urdf"]);
    succeed(folder, &["hand", "new", "hand.urdf"]);
    fs::write(folder.join("part.stl"), mesh()).unwrap();
    succeed(folder, &["object", "new", "part.stl", "--unit", "mm", "--density-kg-m3", "100"]);
    succeed(folder, &["sim", "cube", "--duration", "0.01", "--out", "run"]);
    fs::rename(folder.join("run/scene.toml"), folder.join("scene.toml")).unwrap();
    fs::remove_dir_all(folder.join("run")).unwrap();
}
