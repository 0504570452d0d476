//! The images for the microcontroller, built when they are asked for.

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};

/// The hand that an image is for if nothing else is said.
pub const DEFAULT_HAND: &str = "models/hands/three-finger.toml";

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the repository is there")
}

/// Path of the ELF of the image `hand` or `pil` for a hand; nothing is built anew that is there already.
pub fn image(kind: &str, hand: &str) -> PathBuf {
    let mut command = Command::new("tests/firmware-toolchain");
    // As the command `pil` has it: unset and set to the default are not the same to cargo, which would build anew.
    match hand {
        DEFAULT_HAND => command.env_remove("HAND"),
        _ => command.env("HAND", hand),
    };
    let output = command
        .args(["cargo", "build", "--quiet", "--locked", "-p", "blindgrasp-firmware", "--bin", kind])
        .args(["--profile", "firmware", "--target", "thumbv7em-none-eabihf"])
        .args(["--message-format", "json-render-diagnostics"])
        .current_dir(root())
        .stderr(Stdio::inherit())
        .output()
        .expect("tests/firmware-toolchain runs");
    assert!(output.status.success(), "the image `{kind}` for {hand} does not build");
    let messages = String::from_utf8(output.stdout).expect("cargo speaks UTF-8");
    let mut executables = messages.lines().filter_map(|line| {
        let (_, rest) = line.split_once("\"executable\":\"")?;
        rest.split_once('"').map(|(path, _)| path)
    });
    PathBuf::from(executables.next_back().expect("cargo names what it built"))
}

/// The same as a file of its own, which stays as it is while the image is built for another hand. `tests/run` names a folder
/// that is empty when it begins (`BLINDGRASP_IMAGES`): there, an image is built by the first test that asks for it.
pub fn kept_image(kind: &str, hand: &str) -> PathBuf {
    static KEPT: Mutex<BTreeMap<(String, String), PathBuf>> = Mutex::new(BTreeMap::new());
    // Building one after the other: cargo writes all hands to the same path.
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let path = kept.entry((kind.to_owned(), hand.to_owned())).or_insert_with(|| {
        let name = Path::new(hand).file_stem().expect("the hand is a file").to_string_lossy();
        let name = format!("{kind}-{name}.elf");
        let folder = env::var_os("BLINDGRASP_IMAGES").map(PathBuf::from);
        if let Some(there) = folder.as_ref().map(|folder| folder.join(&name)).filter(|path| path.exists()) {
            return there;
        }
        let built = image(kind, hand);
        let copy = folder.map_or_else(|| built.with_file_name(&name), |folder| folder.join(&name));
        fs::copy(&built, &copy).expect("the image can be copied");
        copy
    });
    path.clone()
}
