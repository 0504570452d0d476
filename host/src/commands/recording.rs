//! `blindgrasp recording`: recordings as files.

use super::Outcome;
use anyhow::bail;
use blindgrasp::record::mcap::{Finished, Recording, finish};
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// Recordings: finish one whose program was killed
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    Finish(Finish),
}

/// Give a recording whose program was killed, or whose disk was full, the summary that other tools open it by
///
/// All that can be read is in it, to the bit, and what reads recordings here gives the same of it as before. Of a damaged
/// recording, too, what can be read is written, but to another file.
///
/// Exit code 0: it is finished; 1: so is what could be read of a damaged one; 2: it can't be read or written, or bad usage.
#[derive(Args)]
struct Finish {
    /// A recording (MCAP)
    file: PathBuf,
    /// Write it to this file [default: in its place]
    #[arg(long, value_name = "FILE.mcap")]
    out: Option<PathBuf>,
    /// Overwrite that file
    #[arg(long, requires = "out")]
    force: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let Action::Finish(Finish { file, out, force }) = &arguments.action;
    let recording = Recording::open(file)?;
    let shown = file.display();
    if recording.is_finished() && out.is_none() {
        eprintln!("blindgrasp: {shown}: is finished already");
        return Ok(Outcome::Shown);
    }
    match finish(&recording, out.as_deref(), *force)? {
        Finished::Whole { bytes } => {
            let written = out.as_ref().unwrap_or(file).display();
            eprintln!("blindgrasp: wrote {written}: finished, {bytes} bytes");
            Ok(Outcome::Shown)
        }
        Finished::Damaged { bytes, damage } => {
            eprintln!("blindgrasp: {shown}: {damage}");
            let written = out.as_ref().unwrap_or(file).display();
            eprintln!("blindgrasp: wrote {written}: what could be read, {bytes} bytes");
            Ok(Outcome::Failed)
        }
        Finished::Kept { damage } => bail!(
            "{shown}: is damaged, and left as it is: {damage}; write what can be read to another file with --out"
        ),
    }
}
