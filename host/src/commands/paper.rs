//! `blindgrasp paper`: every table, figure and claim of the paper, run and checked.

use super::Outcome;
use super::progress::Progress;
use crate::terminal;
use anyhow::Context;
use blindgrasp::files::NewFolder;
use blindgrasp::paper::claim::{Claim, Verdict};
use blindgrasp::paper::expected::Surprise;
use blindgrasp::paper::files;
use blindgrasp::paper::report::{self, Paper};
use clap::Args;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

/// Run the simulation and the experiments of the paper, and check each of its claims
///
/// Exit code 0: every claim that the documentation calls reproduced is; 1: one is not; 2: bad input or usage.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Write the report (paper.html), figures, traces and claims.json to this directory
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Overwrite a report in the directory
    #[arg(long, requires = "out")]
    force: bool,
    /// Print claims, figures' data, sweeps and choices as one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    // Now, and not after minutes of runs.
    let folder = arguments.out.as_ref().map(|path| NewFolder::create(path, arguments.force)).transpose()?;
    let progress = Progress::new();
    let runs = AtomicU64::new(0);
    let paper = Paper::reproduce(&|name| {
        let done = runs.fetch_add(1, Ordering::Relaxed) + 1;
        // Bisection adds runs.
        let of = done.max(report::runs() as u64);
        progress.show(done, of, |_| format!("{done} of {of} runs, {name}"));
    })?;
    drop(progress);
    let text = if arguments.json { paper.json().to_string() + "\n" } else { table(&paper) };
    terminal::print(&text).context("cannot print the claims")?;
    if let (Some(folder), Some(path)) = (folder, &arguments.out) {
        files::write(&folder, &paper)?;
        folder.finish()?;
        eprintln!("blindgrasp: wrote {}", path.display());
    }
    eprintln!("blindgrasp: {} runs in {:.0} s on {} cores", paper.runs(), paper.wall_s, paper.cores);
    Ok(if paper.failed() { Outcome::Failed } else { Outcome::Shown })
}

/// The claims as a table.
fn table(paper: &Paper) -> String {
    let mut text = String::new();
    for claim in &paper.claims {
        describe(&mut text, claim);
    }
    let rows = || paper.claims.iter().flat_map(|claim| &claim.rows);
    for verdict in [Verdict::Reproduced, Verdict::Differs, Verdict::NotReproduced] {
        let count = rows().filter(|row| row.verdict == verdict).count();
        let _ = writeln!(text, "{:<24}{count}", verdict.words());
    }
    for surprise in &paper.surprises {
        let _ = writeln!(text, "{}", surprising(surprise));
    }
    if paper.surprises.is_empty() {
        text += "Every verdict is the one that the documentation states.\n";
    }
    text
}

fn describe(text: &mut String, claim: &Claim) {
    let _ = writeln!(text, "{} ({})\n  if {}", claim.words, claim.place, claim.criterion);
    for row in &claim.rows {
        let _ = writeln!(text, "  {:<26}{:<22}{}", row.run, row.verdict.words(), row.measured);
        if !row.remark.is_empty() {
            let _ = writeln!(text, "  {:<48}{}", "", row.remark);
        }
    }
    text.push('\n');
}

fn surprising(surprise: &Surprise) -> String {
    let words = |verdict: Option<Verdict>| verdict.map_or("nothing", Verdict::words);
    format!(
        "{}, claim `{}` in run `{}`: {}, where the documentation states {}",
        if surprise.is_worse() { "WORSE" } else { "better" },
        surprise.claim,
        surprise.run,
        words(surprise.found),
        words(surprise.expected)
    )
}
