//! `blindgrasp hand check`: what a hand is, whether it can be used, and what is wrong with it.

use super::super::Outcome;
use crate::terminal;
use anyhow::Context;
use blindgrasp::files;
use blindgrasp::model::inspect::finding::Verdict;
use blindgrasp::model::inspect::hand::{HandCheck, NominalHand};
use blindgrasp::view;
use clap::Args;
use std::ffi::OsString;
use std::path::PathBuf;

/// Show what a hand is (tree, joints, reach, masses, forces) and find what is wrong with it
///
/// Each finding says where, what, and the remedy. An error can't be used, or is wrong whatever the hand is for; a warning is
/// likely a mistake; a notice is worth knowing.
///
/// Exit code 0: no errors; 1: errors were found; 2: the file can't be read, or bad usage.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A built-in hand or the path of a hand's file
    file: OsString,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
    /// Draw the hand at its nominal posture and write the picture (SVG) to this file, which is replaced
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let check = HandCheck::load(&arguments.file)?;
    let text = if arguments.json { serde_json::to_string(&check)? + "\n" } else { check.text() };
    terminal::print(&text).context("cannot print the findings")?;
    if let Some(path) = &arguments.picture {
        match &check.nominal {
            Some(NominalHand { hand, capsules, joint_names, angles_rad }) => {
                let svg = view::hand_svg(&check.name, hand, capsules, joint_names, angles_rad);
                files::write(path, svg, true)?;
                eprintln!("blindgrasp: wrote {}", path.display());
            }
            None => {
                eprintln!("blindgrasp: no picture: the tree of joints is not known; correct the errors first")
            }
        }
    }
    Ok(if check.verdict == Verdict::Broken { Outcome::Failed } else { Outcome::Shown })
}
