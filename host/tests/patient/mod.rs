//! A hand whose file lets the heartbeat fail for longer: the machine that tests run on has other things to do, and the
//! line can only tighten what the file says.

use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// The file of the hand, beside its scene.
pub(crate) const HAND: &str = "patient.toml";

/// Writes the scene `cube` with such a hand into a folder, and returns its path.
pub(crate) fn scene(folder: &TempDir, heartbeat_ms: u32) -> PathBuf {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models");
    let read = |file: &str| std::fs::read_to_string(models.join(file)).expect("a model");
    let hand = read("hands/three-finger.toml") + &format!("\n[safety]\nheartbeat_ms = {heartbeat_ms}\n");
    std::fs::write(folder.path().join(HAND), hand).expect("a file");
    let scene =
        read("scenes/cube.toml").replacen("hand = \"three-finger\"", &format!("hand = \"{HAND}\""), 1);
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene).expect("a file");
    path
}
