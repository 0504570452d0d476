//! `blindgrasp replay`: a recording through the controller again.

use super::Outcome;
use super::progress::Progress;
use super::reading::{Span, chosen_device, damage_of, show, start_ns};
use crate::terminal;
use anyhow::Context;
use blindgrasp::model::HandModel;
use blindgrasp::record::mcap::Recording;
use blindgrasp::record::replay::{Change, Report, Wanted, replay};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Run a recording through the controller again, and compare it bit for bit
///
/// The recorded counts, events and commands go through the same tick as on the hand, and what comes out is compared with
/// what was recorded. The hand's file, the parameters and the state come from the recording; what can't be computed (before
/// the first snapshot of the state, after a gap until the next) is listed with its reason.
///
/// With --set, every tick is computed twice, with the recorded and with the changed parameters, and torques, limits and
/// faults are compared. That is open loop: the counts are the recorded ones, and a hand with these parameters would have
/// moved otherwise.
///
/// Exit code 0: no bits differ; 1: some do; 2: it can't be replayed, or bad usage.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A recording (MCAP) of `blindgrasp record` or `sim --out`
    file: PathBuf,
    /// The device, if the recording has several: hand1, hand2, ...
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Change a parameter, as `console` names them: KEY=VALUE, KEY[INDEX]=VALUE (from 0) or KEY.JOINT=VALUE; the value `off`
    /// switches a limit or a fault off (may be repeated)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// The hand's file, in place of the recorded one
    #[arg(long, value_name = "FILE")]
    hand: Option<String>,
    #[command(flatten)]
    span: Span,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// The result as `--json` prints it.
#[derive(Serialize)]
struct Timed {
    #[serde(flatten)]
    report: Report,
    wall_s: f64,
    ticks_per_s: f64,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let started = Instant::now();
    arguments.span.check()?;
    let changes = arguments.settings.iter().map(|text| text.parse::<Change>());
    let wanted = Wanted {
        changes: changes.collect::<Result<_, _>>().context("--set")?,
        typed: arguments.settings.clone(),
        hand: arguments.hand.as_deref().map(HandModel::load).transpose()?,
        from_s: arguments.span.from,
        until_s: arguments.span.until,
    };
    let recording = Recording::open(&arguments.file)?;
    let device = chosen_device(&recording, arguments.device.as_deref())?;
    let name = recording.devices()[device].clone();
    let mut entries = recording.entries()?;
    let progress = Progress::new();
    let replayed = replay(
        &mut entries,
        |entries| show(&progress, entries.position()),
        device,
        &name,
        start_ns(&recording),
        wanted,
    );
    drop(progress);
    let mut report = replayed?;
    report.damage = damage_of(&recording, &entries);
    if let Some(damage) = &report.damage {
        eprintln!("blindgrasp: {}: {damage}", arguments.file.display());
    }
    let is_same = report.bits_differ == 0;
    let wall_s = started.elapsed().as_secs_f64();
    let ticks_per_s = report.ticks as f64 / wall_s;
    let text = if arguments.json {
        serde_json::to_string(&Timed { report, wall_s, ticks_per_s })? + "\n"
    } else {
        format!("{report}\n{:.2} s, {ticks_per_s:.0} ticks a second\n", wall_s)
    };
    terminal::print(&text).context("cannot print the result")?;
    Ok(if is_same { Outcome::Shown } else { Outcome::Failed })
}
