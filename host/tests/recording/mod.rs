//! Recordings: what is written comes back, from whole files and from damaged ones, here and in Python.

#![allow(clippy::unwrap_used)]

mod damage;
mod full_disk;
mod hand;
mod python;
mod refusals;
mod round_trip;
mod simulation;

use std::process::Command;

/// Runs a test of this folder once more, in a process of its own and under limits that a shell sets, and returns what it
/// printed. In that process, [`is_limited`] is true.
fn run_limited(limits: &str, test: &str) -> String {
    let program = std::env::current_exe().unwrap();
    let output = Command::new("sh")
        .args([
            "-c",
            &format!("{limits}; exec \"$0\" --exact recording::{test} --include-ignored --nocapture --test-threads 1"),
        ])
        .arg(program)
        .env("RECORDING_LIMITED", "1")
        .output()
        .unwrap();
    let told = [output.stdout, output.stderr].concat();
    let told = String::from_utf8_lossy(&told).into_owned();
    assert!(output.status.success(), "{told}");
    assert!(told.contains("1 passed"), "no such test: {told}");
    told
}

fn is_limited() -> bool {
    std::env::var_os("RECORDING_LIMITED").is_some()
}
