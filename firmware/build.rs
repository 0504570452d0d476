//! Turns a hand's file into what the firmware is built with.
//!
//! `HAND` names the file: a path from the root of the repository, or the name of a built-in hand. It is read and
//! checked as `blindgrasp sim` would, and becomes `hand.bin` in `OUT_DIR`, kinematics and configuration as the simulation
//! would use them, to the bit (`blindgrasp_shared::model`), and the constants in `hand.rs`:
//!
//! - `JOINTS`, `FINGERS`: its exact sizes;
//! - `IMAGE_HAND`, `IMAGE_PIL`: what the two images say of themselves (`blindgrasp_shared::identity::Image`), so that
//!   a host knows before it flashes, and on a running hand, for which hand and from which sources an image was built.
//!
//! The same sources and the same hand give the same bytes wherever the repository lies.

use blindgrasp_model::HandModel;
use blindgrasp_shared::identity::Image;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use crc::{CRC_32_ISO_HDLC, Crc};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

#[path = "src/boards/stm32f405/capacity.rs"]
mod capacity;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
const DEFAULT_HAND: &str = "models/hands/three-finger.toml";
/// Folders with the sources of an image.
const FOLDERS: [&str; 2] = ["firmware/src", "shared/src"];
/// Other files that an image is made from.
const FILES: [&str; 6] = [
    ".cargo/config.toml",
    "Cargo.lock",
    "Cargo.toml",
    "firmware/Cargo.toml",
    "memory.x",
    "shared/Cargo.toml",
];

fn main() {
    if let Err(error) = build() {
        println!("cargo::error={error}");
    }
}

fn build() -> Result<()> {
    let root = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("..").canonicalize()?;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    // The paths of the sources, of `HAND` and in the messages about it are relative to the root.
    env::set_current_dir(&root)?;
    for path in FOLDERS.iter().chain(&FILES) {
        println!("cargo::rerun-if-changed={}", root.join(path).display());
    }

    fs::copy("memory.x", out.join("memory.x")).map_err(|error| format!("memory.x: {error}"))?;
    println!("cargo::rustc-link-search={}", out.display());

    let hand = load_hand(&root)?;
    let model = hand.bytes();
    let (joint_count, fingertip_count) = (hand.hand.joint_count(), hand.hand.fingertip_count());
    let mut image = Image {
        interface_version: INTERFACE_VERSION,
        kind: "hand",
        hand: &hand.name,
        hand_hash: blindgrasp_shared::model::hash(&model),
        firmware_version: env!("CARGO_PKG_VERSION"),
        build_hash: build_hash()?,
        joint_count: joint_count.try_into()?,
        fingertip_count: fingertip_count.try_into()?,
        period_us: hand.config.period_us,
    };
    let image_hand = constant("IMAGE_HAND", &image)?;
    image.kind = "pil";
    let image_pil = constant("IMAGE_PIL", &image)?;
    let constants = format!(
        "/// Joints of the hand.\npub const JOINTS: usize = {joint_count};\n\
         /// Fingertips of the hand.\npub const FINGERS: usize = {fingertip_count};\n\
         /// What the image for real joints is.\n{image_hand}\
         /// What the image with joints over the link is.\n{image_pil}"
    );
    fs::write(out.join("hand.rs"), constants)?;
    fs::write(out.join("hand.bin"), model)?;
    Ok(())
}

/// The hand that `HAND` names.
fn load_hand(root: &Path) -> Result<HandModel> {
    println!("cargo::rerun-if-env-changed=HAND");
    let name = env::var("HAND").ok().filter(|name| !name.is_empty()).unwrap_or_else(|| DEFAULT_HAND.into());
    for file in HandModel::files(&name) {
        println!("cargo::rerun-if-changed={}", root.join(file).display());
    }
    let hand = HandModel::load(&name)
        .map_err(|error| format!("HAND={name} (paths are relative to {}): {error}", root.display()))?;
    let joints = hand.hand.joint_count();
    if joints > capacity::MOST_JOINTS {
        return Err(format!(
            "HAND={name}: the hand has {joints} joints, and the board has counters and outputs for {}: \
             without firmware, `blindgrasp sim` and `blindgrasp serve` run it",
            capacity::MOST_JOINTS
        )
        .into());
    }
    for warning in &hand.warnings {
        println!("cargo::warning=HAND={name}: {warning}");
    }
    Ok(hand)
}

/// A description of an image as a constant.
fn constant(name: &str, image: &Image<'_>) -> Result<String> {
    let mut buffer = [0; 512];
    let length = image.encode(&mut buffer)?;
    Ok(format!("pub static {name}: [u8; {length}] = {:?};\n", &buffer[..length]))
}

/// CRC-32 of everything that an image is made of: each file's path, length and bytes, in the order of the paths.
fn build_hash() -> Result<u32> {
    let mut files: Vec<PathBuf> = FILES.iter().map(PathBuf::from).collect();
    for folder in FOLDERS {
        sources(Path::new(folder), &mut files)?;
    }
    files.sort();
    let mut digest = CRC.digest();
    for path in files {
        let bytes = fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        for part in path.iter() {
            digest.update(part.as_encoded_bytes());
            digest.update(b"/");
        }
        digest.update(&(bytes.len() as u64).to_le_bytes());
        digest.update(&bytes);
    }
    Ok(digest.finalize())
}

/// Adds the Rust files below a folder.
fn sources(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))? {
        let path = entry?.path();
        if path.is_dir() {
            sources(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    Ok(())
}
