//! `blindgrasp hand export`: a hand in a format of other tools.

use super::super::Outcome;
use crate::terminal;
use anyhow::Context;
use blindgrasp::files;
use blindgrasp::model::HandFile;
use clap::Args;
use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;

/// Write a hand as a URDF that other tools load
///
/// Links with their inertias, joints with limits and friction, fingertips as links of their own with a sphere, capsules as
/// a cylinder and two spheres; without any, bones as cylinders. Numbers keep all their bits. Gains, encoders and the stiffness of the fingertips are not in it.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A built-in hand, or the path of a hand's file
    hand: OsString,
    /// The format: URDF (there is no other yet)
    #[arg(long, required = true)]
    urdf: bool,
    /// The file to write [default: stdout]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Overwrite the file
    #[arg(long, requires = "out")]
    force: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let (file, _, warnings) = HandFile::load_checked(&arguments.hand)?;
    for warning in warnings {
        eprintln!("blindgrasp: warning: {warning}");
    }
    let text = file.to_urdf();
    match &arguments.out {
        None => terminal::document().write_all(text.as_bytes()).context("cannot print the URDF")?,
        Some(path) => {
            files::write(path, &text, arguments.force)?;
            eprintln!("blindgrasp: wrote {}", path.display());
        }
    }
    Ok(Outcome::Shown)
}
