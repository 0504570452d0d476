//! `blindgrasp object check`: what an object is, whether it can be used, and what is wrong with it.

use super::super::Outcome;
use crate::terminal;
use anyhow::Context;
use blindgrasp::files;
use blindgrasp::model::inspect::finding::Verdict;
use blindgrasp::model::inspect::object::{ObjectCheck, Wanted};
use blindgrasp::model::mesh::Unit;
use blindgrasp::view;
use clap::Args;
use std::ffi::OsString;
use std::path::PathBuf;

/// Show what an object is (volume, mass, faces with the room on them) and find what is wrong with it
///
/// Each finding says where, what, and the remedy. An error can't be used; a warning is likely a mistake; a notice is worth
/// knowing.
///
/// Exit code 0: no errors; 1: errors were found; 2: the file can't be read, or bad usage.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A built-in object, the path of an object's file, or a mesh (.stl, .obj) with its --unit
    file: OsString,
    /// The unit of a mesh: mm, cm, m or in
    #[arg(long, value_parser = super::unit)]
    unit: Option<Unit>,
    /// Radius of the fingertip that is to touch the object, mm: finds the faces that are too small for it
    #[arg(long, value_name = "MM")]
    fingertip: Option<f64>,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
    /// Draw the object with the numbers of its faces and write the picture (SVG) to this file, which is replaced
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if arguments.fingertip.is_some_and(|radius| !(1e-3..=1e3).contains(&radius)) {
        anyhow::bail!("--fingertip: has to be between 0.001 and 1000 mm");
    }
    let wanted =
        Wanted { unit: arguments.unit, fingertip_m: arguments.fingertip.map(|radius| radius * 1e-3) };
    let check = ObjectCheck::load(&arguments.file, &wanted)?;
    let text = if arguments.json { serde_json::to_string(&check)? + "\n" } else { check.text() };
    terminal::print(&text).context("cannot print the findings")?;
    if let Some(path) = &arguments.picture {
        match &check.shape {
            Some(shape) => {
                let svg = view::object_svg(shape, &check.name);
                files::write(path, svg, true)?;
                eprintln!("blindgrasp: wrote {}", path.display());
            }
            None => eprintln!("blindgrasp: no picture: it is not a body; correct the errors first"),
        }
    }
    Ok(if check.verdict == Verdict::Broken { Outcome::Failed } else { Outcome::Shown })
}
