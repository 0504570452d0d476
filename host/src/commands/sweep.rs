//! `blindgrasp sweep`: a scene over a grid of values.

use super::Outcome;
use super::progress::Progress;
use crate::terminal;
use anyhow::{Context, bail};
use blindgrasp::device::interrupt;
use blindgrasp::model::Setting;
use blindgrasp::record::table::Kind;
use blindgrasp::sweep::{
    self, Axis, Edge, Identity, Journal, Output, Overview, Plan, Row, Swept, Value, Varied,
};
use clap::Args;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// More rows are not printed: they are in the file.
const MOST_ROWS: usize = 60;

/// Run a scene over a grid of values, on all cores
///
/// Writes a row a run: the values, what became of the grasp, and the effective scene, which `blindgrasp sim` runs again. Beside
/// it goes a picture: over one key when the object came to rest or was lost, and the friction that the grasp asked for; over two
/// keys a map. A sweep that is stopped (Ctrl-C) or killed goes on where it was if the same command is given again.
///
/// Exit code 0: it was run, whatever became of the grasps; 1: it was stopped before its end; 2: bad input or usage.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A built-in scene (see `blindgrasp sim --help`) or the path of a scene file
    scene: String,
    /// Vary a value of the scene: evenly (control.force_n=1..10:10), evenly in its logarithm (friction.scale=0.01..1:9:log), or
    /// as listed (object=cube,prism). Several make a grid
    #[arg(long = "vary", value_name = "KEY=VALUES")]
    axes: Vec<String>,
    /// The table that is written, and what it is: it ends in .parquet or .csv
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Change a value of the scene for all runs, such as control.force_n=4 (may be repeated)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Run everything with so many seeds of the noise
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: u32,
    /// Simulated time of each run, s, in place of the scene's
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Of one key that takes numbers: add values by bisection until the point where the grasp begins to fail is known to this
    /// relative width, such as 0.01
    #[arg(long, value_name = "WIDTH", value_parser = width, allow_negative_numbers = true)]
    refine: Option<f64>,
    /// Start anew, and overwrite what is there
    #[arg(long)]
    force: bool,
    /// Print the overview as one JSON object
    #[arg(long)]
    json: bool,
}

fn width(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(width) if (1e-6..1.0).contains(&width) => Ok(width),
        _ => Err("a relative width, from 1e-6 to less than 1".into()),
    }
}

/// The overview with what only the command knows.
#[derive(Serialize)]
struct Told<'a> {
    #[serde(flatten)]
    overview: &'a Overview,
    file: String,
    pictures: Vec<String>,
    wall_s: f64,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let output = Output::choose(&arguments.out)?;
    let mut plan = plan(arguments)?;
    output.prepare(&plan, arguments.force)?;
    let identity = Identity::of(&plan, arguments.refine);
    let (journal, found) = Journal::open(&output.journal(), &identity, arguments.force)?;
    warn(&plan);
    if !found.rows.is_empty() {
        let dropped = match found.dropped {
            0 => String::new(),
            bytes => format!("; its last {bytes} bytes were not whole"),
        };
        let path = journal.path().display();
        eprintln!("blindgrasp: going on: {} runs are done already, says {path}{dropped}", found.rows.len());
    }

    interrupt::listen();
    let begun = Instant::now();
    let progress = Progress::new();
    let counts = [found.rows.len(), plan.runs()].map(|count| AtomicU64::new(count as u64));
    let show = |[done, runs]: [u64; 2]| progress.show(done, runs, |_| format!("{done} of {runs} runs"));
    show(counts.each_ref().map(|count| count.load(Ordering::Relaxed)));
    let each = |row: &Row| {
        let done = counts[0].fetch_add(1, Ordering::Relaxed) + 1;
        // Bisection adds runs.
        let last = row.run as u64 + 1;
        show([done, counts[1].fetch_max(last, Ordering::Relaxed).max(last)]);
        journal.keep(row)
    };
    let swept = sweep::run_refined(&mut plan, found.rows, arguments.refine, each, || !interrupt::wanted());
    drop(progress);
    let Swept { rows, is_whole } =
        swept.context("the sweep is stopped; the same command goes on from where it was")?;
    if !is_whole {
        let (done, all) = (rows.len(), plan.runs());
        let path = journal.path().display();
        eprintln!(
            "blindgrasp: stopped after {done} of {all} runs; they are kept in {path}: the same command goes on from there"
        );
        return Ok(Outcome::Failed);
    }
    let wall_s = begun.elapsed().as_secs_f64();
    let overview = Overview::of(&plan, &rows);
    output.write(&plan, &rows)?;
    journal.remove()?;

    let pictures = output.pictures(&plan);
    let name = |path: &PathBuf| path.display().to_string();
    let text = if arguments.json {
        let pictures = pictures.iter().map(name).collect();
        serde_json::to_string(&Told { overview: &overview, file: name(&arguments.out), pictures, wall_s })?
            + "\n"
    } else {
        describe(&plan, &rows, &overview, wall_s)
    };
    terminal::print(&text).context("cannot print the overview")?;
    let written: Vec<String> = [arguments.out.clone()].iter().chain(&pictures).map(name).collect();
    eprintln!("blindgrasp: wrote {}", written.join(", "));
    Ok(Outcome::Shown)
}

fn plan(arguments: &Arguments) -> anyhow::Result<Plan> {
    let axes = arguments.axes.iter().map(|text| Axis::parse(text)).collect::<Result<Vec<_>, _>>()?;
    if axes.is_empty() && arguments.seeds == 1 {
        bail!("there is nothing to sweep: give --vary KEY=FROM..TO:N, or --seeds N");
    }
    let mut settings =
        arguments.settings.iter().map(|text| Setting::parse(text)).collect::<Result<Vec<_>, _>>()?;
    if let Some(duration_s) = arguments.duration {
        settings.push(Setting::parse(&format!("duration_s={duration_s:?}"))?);
    }
    let plan = Plan::new(&arguments.scene, settings, axes, arguments.seeds)?;
    let is_number = |kind| matches!(kind, Kind::Whole | Kind::Double);
    if arguments.refine.is_some() && !(plan.axes().len() == 1 && is_number(plan.kind(0))) {
        bail!("--refine: serves for one key that takes numbers; leave it out");
    }
    Ok(plan)
}

/// Says what is odd about the scene, or about its seeds.
fn warn(plan: &Plan) {
    let Some(scene) = (0..plan.runs()).find_map(|run| plan.scene(run).ok()) else { return };
    for warning in &scene.warnings {
        eprintln!("blindgrasp: warning: {warning}");
    }
    let is_varied = plan.axes().iter().any(|axis| axis.key.starts_with("sensors."));
    let is_noisy = !scene.sensors.ideal && scene.sensors.noise_counts > 0.0;
    if plan.seeds() > 1 && !is_varied && !is_noisy {
        eprintln!(
            "blindgrasp: warning: --seeds: the scene has no noise, so that all seeds give the same; set sensors.noise_counts"
        );
    }
}

/// The overview as a table; of a sweep of one key, every row, if there are not too many.
fn describe(plan: &Plan, rows: &[Row], overview: &Overview, wall_s: f64) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<22}{value}");
    };
    line("scene", overview.scene.clone());
    for varied in &overview.varied {
        line("varied", in_words(varied, overview.added / overview.seeds as usize));
    }
    if overview.seeds > 1 {
        line("seeds", overview.seeds.to_string());
    }
    let added = match overview.added {
        0 => String::new(),
        added => format!(", of which {added} by bisection"),
    };
    line("runs", format!("{} in {wall_s:.1} s{added}", overview.runs));
    line("held", format!("{}, of which {} came to rest", overview.held, overview.settled));
    line("lost", overview.lost.to_string());
    if let Some(reason) = &overview.refused_reason {
        line("refused", format!("{} ({reason})", overview.refused));
    }
    for Edge { held, lost } in &overview.edges {
        let (low, high) = (held.min(*lost), held.max(*lost));
        let end = |value| {
            let word = if value == *held { "held" } else { "lost" };
            format!("{} ({word})", Value::number(value).text)
        };
        line("begins to fail", format!("between {} and {}", end(low), end(high)));
    }
    if let [varied] = overview.varied.as_slice()
        && rows.len() <= MOST_ROWS
    {
        text += &each_row(plan, rows, varied);
    }
    text
}

/// A key and its values, but for the last `added`.
fn in_words(varied: &Varied, added: usize) -> String {
    let Varied { key, unit, values } = varied;
    let values = &values[..values.len() - added];
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    match values {
        [first, .., last] if values.len() > 6 => {
            format!("{key}: {} values from {first} to {last}{unit}", values.len())
        }
        values => format!("{key}: {}{unit}", values.join(", ")),
    }
}

/// A line a run, in the order of the values.
fn each_row(plan: &Plan, rows: &[Row], varied: &Varied) -> String {
    let value = |row: &Row| {
        plan.values(row.run).next().map_or((String::new(), None), |value| (value.text.clone(), value.number))
    };
    let mut rows: Vec<(&Row, (String, Option<f64>))> = rows.iter().map(|row| (row, value(row))).collect();
    if rows.iter().all(|(_, (_, number))| number.is_some()) {
        rows.sort_by(|(_, (_, a)), (_, (_, b))| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    }
    let heading =
        if varied.unit.is_empty() { varied.key.clone() } else { format!("{}, {}", varied.key, varied.unit) };
    let width = rows
        .iter()
        .map(|(_, (text, _))| text.chars().count())
        .chain([heading.chars().count()])
        .max()
        .unwrap_or(0);
    let mut text = format!("{heading:<width$}  grasp  at rest, s  friction needed\n");
    for (row, (value, _)) in rows {
        let outcome = match &row.outcome {
            sweep::Outcome::Refused(reason) => format!("refused: {reason}"),
            sweep::Outcome::Ran(summary) => match (summary.lost_at_s, &summary.lost_reason, &summary.fault) {
                (Some(t_s), Some(reason), None) => format!("LOST at {t_s:.3} s: {reason}"),
                (Some(t_s), _, Some(fault)) => format!("LOST at {t_s:.3} s: {fault}"),
                _ => {
                    let rest = summary.settle_time_s.map_or("not yet".to_owned(), |t_s| format!("{t_s:.3}"));
                    format!("held   {rest:>10}  {:>15.3}", summary.friction_demand_max)
                }
            },
        };
        let _ = writeln!(text, "{value:<width$}  {outcome}");
    }
    text
}
