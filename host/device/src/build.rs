//! The image of a hand's firmware: inside the repository, it is built, which takes no time where nothing has changed.
//! Elsewhere somebody has to say where it is.

use blindgrasp_model::{HandFile, HandModel};
use serde::Deserialize;
use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The hand that an image is for if nothing else is said (`firmware/build.rs`).
const DEFAULT_HAND: &str = "three-finger";
/// Decides which compiler builds for the microcontroller, and runs a command with it.
const TOOLCHAIN: &str = "tests/firmware-toolchain";
/// The variable that tells the build which hand the image is for.
const HAND: &str = "HAND";

/// An error in getting an image.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// This is no place to build in.
    #[error(
        "no firmware image: run this inside the repository of blindgrasp, where it is built, or name one with --image"
    )]
    OutsideRepository,
    /// The hand could not be written to a file for the build.
    #[error("cannot write the scene's hand to {}", .path.display())]
    Hand {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// The build could not be started.
    #[error("cannot run {TOOLCHAIN}")]
    Start(#[source] io::Error),
    /// It failed; the compiler has said why.
    #[error("the firmware can't be built ({0}): see above; or name an image with --image")]
    Failed(std::process::ExitStatus),
    /// It says that it has succeeded, but not where the image is.
    #[error("the firmware was built, but cargo does not say where the image is")]
    NoImage,
}

/// Builds the image `pil` for the hand of a file; returns its path. The compiler's messages go to stderr.
///
/// # Errors
/// If it can't be built.
pub fn pil_image(hand: &HandModel, file: &HandFile) -> Result<PathBuf, BuildError> {
    let folder = env::current_dir().map_err(BuildError::Start)?;
    let root = repository(&folder).ok_or(BuildError::OutsideRepository)?;
    let mut command = Command::new(root.join(TOOLCHAIN));
    command.current_dir(root).args(["cargo", "build", "--package", "blindgrasp-firmware", "--bin", "pil"]);
    command.args(["--profile", "firmware", "--target", "thumbv7em-none-eabihf"]);
    command.args(["--message-format", "json-render-diagnostics"]);
    match hand_file(root, hand, file)? {
        // Unset and set to the default are not the same to cargo, which would build anew.
        None => command.env_remove(HAND),
        Some(path) => command.env(HAND, path),
    };
    let output = command.stdin(Stdio::null()).stderr(Stdio::inherit()).output().map_err(BuildError::Start)?;
    if !output.status.success() {
        return Err(BuildError::Failed(output.status));
    }
    executable(&String::from_utf8_lossy(&output.stdout)).ok_or(BuildError::NoImage)
}

/// The repository that a folder is in.
fn repository(folder: &Path) -> Option<&Path> {
    folder.ancestors().find(|folder| {
        ["firmware/Cargo.toml", "memory.x", TOOLCHAIN].iter().all(|file| folder.join(file).is_file())
    })
}

/// Returns the hand's file that the build is told: nothing, for the one that it takes anyway.
fn hand_file(root: &Path, hand: &HandModel, file: &HandFile) -> Result<Option<PathBuf>, BuildError> {
    let built_in = |name: &str| HandModel::load(name).is_ok_and(|known| known.hash() == hand.hash());
    if hand.name == DEFAULT_HAND && built_in(DEFAULT_HAND) {
        return Ok(None);
    }
    let known = Path::new("models/hands").join(&hand.name).with_extension("toml");
    if root.join(&known).is_file() && built_in(&hand.name) {
        return Ok(Some(known));
    }
    // The same hand has the same path, so that cargo sees that it has not changed.
    let target = env::var_os("CARGO_TARGET_DIR").map_or(root.join("target"), PathBuf::from);
    let path = root.join(target).join("hands").join(format!("{}-{:08x}.toml", hand.name, hand.hash()));
    let text = file.to_toml();
    if fs::read_to_string(&path).ok().as_ref() != Some(&text) {
        let written = fs::create_dir_all(path.parent().unwrap_or(root)).and_then(|()| fs::write(&path, text));
        written.map_err(|source| BuildError::Hand { path: path.clone(), source })?;
    }
    Ok(Some(path))
}

/// The program that cargo has built, from its messages.
fn executable(messages: &str) -> Option<PathBuf> {
    #[derive(Deserialize)]
    struct Message {
        reason: String,
        executable: Option<PathBuf>,
    }
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<Message>(line).ok())
        .filter(|message| message.reason == "compiler-artifact")
        .find_map(|message| message.executable)
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_model::Scene;

    #[test]
    fn the_image_is_found_among_the_messages() {
        let messages = r#"{"reason":"compiler-artifact","executable":null,"target":{}}
not json
{"reason":"build-script-executed","executable":"/wrong"}
{"reason":"compiler-artifact","executable":"/target/firmware/pil"}
{"reason":"build-finished","success":true}"#;
        assert_eq!(executable(messages), Some("/target/firmware/pil".into()));
        assert_eq!(executable("{}"), None);
    }

    #[test]
    fn a_hand_is_named_as_the_build_knows_it() {
        let root = tempfile::tempdir().unwrap();
        let changed = ["hand.joint.1.torque_limit_nm=1.0".to_owned()];
        let scene = Scene::load("cube", &changed).unwrap();
        fs::create_dir_all(root.path().join("models/hands")).unwrap();
        for name in ["three-finger", "two-finger"] {
            fs::write(root.path().join("models/hands").join(name).with_extension("toml"), "").unwrap();
        }
        let file = |hand: &HandModel| hand_file(root.path(), hand, &scene.file.hand).unwrap();
        assert_eq!(file(&HandModel::load("three-finger").unwrap()), None);
        let two = HandModel::load("two-finger").unwrap();
        assert_eq!(file(&two), Some("models/hands/two-finger.toml".into()));

        // One that is like none of them, though it has a known name.
        let hand = HandModel::of(&scene).unwrap();
        let path = file(&hand).unwrap();
        assert_eq!(HandModel::load(path.to_str().unwrap()).unwrap().hash(), hand.hash());
        assert!(path.ends_with(format!("three-finger-{:08x}.toml", hand.hash())), "{}", path.display());
        if env::var_os("CARGO_TARGET_DIR").is_some() {
            fs::remove_file(path).unwrap();
        }
    }

    #[test]
    fn the_repository_is_found_from_below() {
        let root = tempfile::tempdir().unwrap();
        let below = root.path().join("host/src");
        for folder in ["firmware", "tests", "host/src"] {
            fs::create_dir_all(root.path().join(folder)).unwrap();
        }
        for file in ["firmware/Cargo.toml", "memory.x"] {
            fs::write(root.path().join(file), "").unwrap();
        }
        assert_eq!(repository(&below), None);
        fs::write(root.path().join(TOOLCHAIN), "").unwrap();
        assert_eq!(repository(&below), Some(root.path()));
    }
}
