//! `blindgrasp export`: a recording as a table.

use super::Outcome;
use super::progress::Progress;
use super::reading::{Span, chosen_device, damage_of, show, start_ns};
use crate::terminal;
use anyhow::Context;
use blindgrasp::files::NewFile;
use blindgrasp::record::export::{ExportError, Exported, Format, Request, export};
use blindgrasp::record::mcap::Recording;
use clap::{Args, ValueEnum};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Write a recording as a table: a row a record
///
/// Units stand in the names of the columns; those of joints begin with the joint's name. What was not sent is empty, or null.
/// Numbers keep all their bits. An hour of a hand of 12 joints takes seconds and little memory.
///
/// Exit code 0: everything is in the table; 1: the recording is damaged, and what could be read of it is; 2: there is no
/// table, or bad usage.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A recording (MCAP) of `blindgrasp record` or `sim --out`
    file: PathBuf,
    /// The format
    #[arg(long = "to", value_name = "FORMAT")]
    format: To,
    /// The table's file, or - for stdout [default: the recording's name with another ending]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Overwrite the table's file
    #[arg(long)]
    force: bool,
    /// The device, if the recording has several: hand1, hand2, ...
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Only these columns, separated by commas: names with * for anything, joints, or signals of all joints (angle_rad,
    /// finger-1-abduct, finger-1-*.torque_nm); time_s is always there
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    signals: Vec<String>,
    #[command(flatten)]
    span: Span,
}

#[derive(Clone, Copy, ValueEnum)]
enum To {
    /// Comma-separated values with a header
    Csv,
    /// Apache Parquet with units in its metadata
    Parquet,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    arguments.span.check()?;
    let (format, ending) = match arguments.format {
        To::Csv => (Format::Csv, "csv"),
        To::Parquet => (Format::Parquet, "parquet"),
    };
    format.check()?;
    let recording = Recording::open(&arguments.file)?;
    let request = Request {
        device: chosen_device(&recording, arguments.device.as_deref())?,
        signals: arguments.signals.clone(),
        from_s: arguments.span.from,
        until_s: arguments.span.until,
        start_ns: start_ns(&recording),
    };
    let path = arguments.out.clone().unwrap_or_else(|| arguments.file.with_extension(ending));
    let mut file = match path.as_path() {
        path if path == Path::new("-") => None,
        path => Some(NewFile::create(path, arguments.force)?),
    };
    let to: Box<dyn Write + Send> = match &mut file {
        None => terminal::document(),
        Some(file) => Box::new(file),
    };
    let mut entries = recording.entries()?;
    let progress = Progress::new();
    let exported = export(&mut entries, |entries| show(&progress, entries.position()), &request, format, to);
    drop(progress);
    let exported = match exported {
        Err(ExportError::Table(error)) if error.is_broken_pipe() => return Ok(Outcome::Shown),
        exported => exported.with_context(|| path.display().to_string())?,
    };
    file.map_or(Ok(()), NewFile::finish)?;
    let Exported { rows, lost, gaps, ended } = exported;
    eprintln!("blindgrasp: {}: {rows} rows; {lost} records lost, {gaps} gaps", path.display());
    let is_whole = ended.is_none() && entries.damage().is_none();
    for words in [ended, damage_of(&recording, &entries)].into_iter().flatten() {
        eprintln!("blindgrasp: {}: {words}", arguments.file.display());
    }
    Ok(if is_whole { Outcome::Shown } else { Outcome::Failed })
}
