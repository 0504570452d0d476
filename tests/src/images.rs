//! The images for the microcontroller, built when they are asked for.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the repository is there")
}

/// Path of the ELF of the image `hand` or `pil` for a hand; nothing is built anew that is there already.
///
/// # Panics
/// If it does not build.
pub fn image(kind: &str, hand: &str) -> PathBuf {
    let output = Command::new("tests/firmware-toolchain")
        .args(["cargo", "build", "--quiet", "--locked", "-p", "blindgrasp-firmware", "--bin", kind])
        .args(["--profile", "firmware", "--target", "thumbv7em-none-eabihf"])
        .args(["--message-format", "json-render-diagnostics"])
        .env("HAND", hand)
        .current_dir(root())
        .stderr(Stdio::inherit())
        .output()
        .expect("tests/firmware-toolchain runs");
    assert!(output.status.success(), "the image `{kind}` for {hand} does not build");
    let messages = String::from_utf8(output.stdout).expect("cargo speaks UTF-8");
    let executables = messages.lines().filter_map(|line| {
        let (_, rest) = line.split_once("\"executable\":\"")?;
        rest.split_once('"').map(|(path, _)| path)
    });
    PathBuf::from(executables.last().expect("cargo names what it built"))
}
