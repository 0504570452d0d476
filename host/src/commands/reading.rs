//! The part that commands which read a recording have in common.

use super::progress::Progress;
use anyhow::{Context, bail};
use blindgrasp::files;
use blindgrasp::record::mcap::{Damage, Entries, Recording};
use clap::Args;

/// A part of a recording.
#[derive(Args)]
pub(super) struct Span {
    /// From this time on, s since the beginning of the recording
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub(super) from: Option<f64>,
    /// Up to this time, s since the beginning of the recording
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub(super) until: Option<f64>,
}

impl Span {
    pub(super) fn check(&self) -> anyhow::Result<()> {
        match (self.from, self.until) {
            (Some(from), Some(until)) if from > until => {
                bail!("--from {from} is after --until {until}: exchange them")
            }
            _ => Ok(()),
        }
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (0.0..f64::INFINITY).contains(&seconds) => Ok(seconds),
        _ => Err("a time in seconds, from 0 on".into()),
    }
}

/// The number of the device that is wanted of a recording.
pub(super) fn chosen_device(recording: &Recording, wanted: Option<&str>) -> anyhow::Result<usize> {
    let names = recording.devices();
    match wanted {
        Some(wanted) => names.iter().position(|name| name == wanted).with_context(|| {
            format!("--device: there is no `{wanted}` in the recording; it has {}", names.join(", "))
        }),
        None if names.len() == 1 => Ok(0),
        None if names.is_empty() => bail!("the recording is empty: it has no device"),
        None => bail!("the recording has several devices: choose one with --device: {}", names.join(", ")),
    }
}

/// Returns the beginning of a recording, ns.
pub(super) fn start_ns(recording: &Recording) -> u64 {
    recording.span().map_or(0, |(start, _)| start.0)
}

/// Returns the damage of a recording as far as it was read, in words.
pub(super) fn damage_of(recording: &Recording, entries: &Entries) -> Option<String> {
    let is_being_written = files::is_being_written(recording.path());
    let unfinished = !recording.is_finished() && !is_being_written;
    let damage = Damage { unfinished, ..entries.damage().clone() };
    match (is_being_written, damage.is_none() && !unfinished) {
        (false, true) => None,
        (false, false) => Some(damage.to_string()),
        (true, true) => Some("it is still being written: there may be more".to_owned()),
        (true, false) => Some(format!("{damage}; it is still being written: there may be more")),
    }
}

/// Shows how much of a file is read.
pub(super) fn show(progress: &Progress, (read, bytes): (u64, u64)) {
    progress.show(read, bytes, |percent| format!("{percent:>3} % of {:.1} MB", bytes as f64 / 1e6));
}
