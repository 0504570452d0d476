//! `blindgrasp sim`: the closed loop on the host.

use super::Outcome;
use super::progress::Progress;
use crate::terminal;
use anyhow::Context;
use blindgrasp::files::{self, NewFolder, OutputError};
use blindgrasp::model::Scene;
use blindgrasp::sim::Simulation;
use blindgrasp::sim::csv::Trace;
use blindgrasp::sim::recorder::Recorder;
use blindgrasp::sim::sample::Sample;
use blindgrasp::sim::summary::Summary;
use blindgrasp::sim::thinned::Thinned;
use blindgrasp::sim::verdict::Outcome as Verdict;
use blindgrasp::view;
use clap::Args;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// The effective scene, in a run's folder.
const SCENE: &str = "scene.toml";
/// The file of the samples.
const TRACE: &str = "trace.csv";

/// Run a scene in simulation: the controller of the firmware against the simulated hand and object
///
/// Exit code 0: the grasp held, to the end or until the object was put down; 1: it was lost, or there was none; 2: bad input or usage.
#[derive(Args)]
pub(crate) struct Arguments {
    #[arg(help = scene_help())]
    scene: OsString,
    /// Write summary, effective scene, trace, plots, pictures, an animation and a recording to this directory; if the name ends in .mcap, write the recording alone, to this file
    #[arg(long, value_name = "DIR|FILE.mcap")]
    out: Option<PathBuf>,
    /// Overwrite a run in the directory, or the file
    #[arg(long, requires = "out")]
    force: bool,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
    /// Simulated time, s, in place of the scene's
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Change a value of the scene, such as control.force_n=4 (may be repeated)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
}

fn scene_help() -> String {
    let names: Vec<&str> = Scene::built_in().collect();
    format!("A built-in scene ({}) or the path of a scene file", names.join(", "))
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut settings = arguments.settings.clone();
    settings.extend(arguments.duration.map(|s| format!("duration_s={s:?}")));
    let scene = Scene::load(&arguments.scene, &settings)?;
    // What can't be written is told after the run, when its summary is safe; not so what may not be.
    let mut output = arguments.out.as_ref().map(|path| Destination::of(path, arguments.force));
    if let Some(Err(error)) = output.take_if(|made| !matches!(made, Ok(_) | Err(OutputError::Io { .. }))) {
        return Err(error.into());
    }
    for warning in &scene.warnings {
        eprintln!("blindgrasp: warning: {warning}");
    }
    let mut simulation = Simulation::new(&scene).with_context(|| format!("scene {}", scene.name))?;
    let mut recorder = output
        .as_ref()
        .and_then(|made| made.as_ref().ok())
        .map(|to| Recorder::create(&to.recording(), to.force(), &scene, simulation.controller()));
    let progress = Progress::new();
    let mut files = match &output {
        Some(Ok(Destination::Folder(folder))) => Some(Files::begin(folder)),
        _ => None,
    };
    while let Ok(Some(step)) = simulation.step() {
        show(&progress, step.t_s, scene.duration_s);
        if let Some(Ok(recorder)) = &mut recorder {
            recorder.see(&step);
        }
        if let (Some(files), Some(sample)) = (&mut files, step.sample) {
            files.see(sample);
        }
    }
    drop(progress);

    let summary = simulation.summary();
    let text = if arguments.json { serde_json::to_string(&summary)? + "\n" } else { describe(&summary) };
    terminal::print(&text).context("cannot print the summary")?;
    if let Some(recorder) = recorder {
        recorder?.finish()?;
    }
    if let Some(files) = files {
        files.write(&scene, &summary)?;
    }
    if let (Some(made), Some(path)) = (output, &arguments.out) {
        if let Destination::Folder(folder) = made? {
            folder.finish()?;
        }
        eprintln!("blindgrasp: wrote {}", path.display());
    }
    Ok(if summary.grasp_held { Outcome::Shown } else { Outcome::Failed })
}

/// Shows how much is simulated.
pub(super) fn show(progress: &Progress, t_s: f64, duration_s: f64) {
    progress
        .show((t_s * 1e3) as u64, (duration_s * 1e3) as u64, |percent| format!("{percent:>3} % simulated"));
}

/// The place that a run is written to.
enum Destination {
    Folder(NewFolder),
    /// A recording alone, and whether it may be overwritten.
    Recording(PathBuf, bool),
}

impl Destination {
    fn of(path: &Path, force: bool) -> Result<Self, OutputError> {
        if path.extension().is_some_and(|extension| extension == "mcap") {
            files::check(path, force)?;
            return Ok(Self::Recording(path.to_owned(), force));
        }
        // Of what is written, a scene is what may have been read.
        files::check(&path.join(SCENE), true)?;
        Ok(Self::Folder(NewFolder::create(path, force)?))
    }

    fn recording(&self) -> PathBuf {
        match self {
            Self::Folder(folder) => folder.written_to().join("record.mcap"),
            Self::Recording(path, _) => path.clone(),
        }
    }

    fn force(&self) -> bool {
        matches!(self, Self::Recording(_, true))
    }
}

/// The files of a run, beside its recording.
struct Files<'a> {
    folder: &'a NewFolder,
    trace: io::Result<Trace<File>>,
    pictured: Thinned,
}

impl<'a> Files<'a> {
    fn begin(folder: &'a NewFolder) -> Self {
        let trace = File::create(folder.written_to().join(TRACE)).map(Trace::new);
        Self { folder, trace, pictured: Thinned::default() }
    }

    fn see(&mut self, sample: &Sample) {
        if let Ok(trace) = &mut self.trace {
            trace.see(sample);
        }
        self.pictured.see(sample);
    }

    fn write(self, scene: &Scene, summary: &Summary) -> anyhow::Result<()> {
        let folder = self.folder;
        let summary = serde_json::to_string_pretty(summary)? + "\n";
        folder.write("summary.json", |file| file.write_all(summary.as_bytes()))?;
        folder.write(SCENE, |file| file.write_all(scene.effective_toml().as_bytes()))?;
        self.trace.and_then(Trace::finish).with_context(|| format!("cannot write {TRACE}"))?;
        let joint_names: Vec<String> = scene.joints.iter().map(|joint| joint.name.clone()).collect();
        let report = view::Report {
            title: &scene.name,
            hand: &scene.hand,
            capsules: &scene.file.hand.capsules(&scene.hand),
            joint_names: &joint_names,
            object: &scene.object,
            samples: &self.pictured.finish(),
        };
        view::write(folder.written_to(), &report)?;
        #[cfg(feature = "plots")]
        blindgrasp::plots::write(folder.written_to(), &report)?;
        #[cfg(not(feature = "plots"))]
        eprintln!(
            "blindgrasp: no plots: they take `cargo run --release --features plots --` and the same arguments"
        );
        Ok(())
    }
}

/// The summary as a table.
pub(super) fn describe(summary: &Summary) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<22}{value}");
    };
    line("scene", summary.scene.clone());
    line(
        "simulated",
        format!(
            "{:.3} s in {:.2} s ({:.0} x real time)",
            summary.duration_s, summary.wall_s, summary.real_time_factor
        ),
    );
    line(
        "grasp",
        match (summary.lost_at_s, &summary.lost_reason) {
            (Some(t_s), Some(reason)) => format!("LOST at {t_s:.3} s: {reason}"),
            _ if summary.outcome == Verdict::PutDown => "held, and put down".to_owned(),
            _ => match summary.last.slipped_m.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) {
                Some((finger, slipped_m)) if summary.outcome == Verdict::Slipped => {
                    format!("held, but finger {} SLIPPED by {:.1} mm", finger + 1, slipped_m * 1e3)
                }
                _ => "held".to_owned(),
            },
        },
    );
    if let Some(fault) = &summary.fault {
        line("controller", fault.clone());
    }
    if let Some(shortfall) = &summary.shortfall {
        line("script", format!("NOT DONE to its end: {shortfall}"));
    }
    for (k, (t_s, words)) in summary.noticed.iter().enumerate() {
        line(if k == 0 { "noticed" } else { "" }, format!("{t_s:.3} s: {words}"));
    }
    line(
        "at rest",
        match summary.settle_time_s {
            Some(t_s) => format!("from {t_s:.3} s on"),
            None => "not yet".to_owned(),
        },
    );
    let last = &summary.last;
    line("joint speed, max", format!("{:9.2e} rad/s", last.joint_speed_max_rad_s));
    line("object speed", format!("{:9.2e} m/s", last.object_speed_m_s));
    line("object spin", format!("{:9.2e} rad/s", last.object_spin_rad_s));
    line("residual force", format!("{:9.2e} N     (Eq. 38)", last.force_residual_n));
    line("residual moment", format!("{:9.2e} N m   (Eq. 38)", last.moment_residual_nm));
    let needed = [
        ("friction needed, max", summary.friction_demand_max),
        ("  at the end", summary.friction_demand_at_end),
        ("  in the first touch", summary.friction_demand_in_first_touch),
    ];
    needed.iter().for_each(|(name, demand)| line(name, format!("{demand:9.3}")));
    line(
        "energy",
        format!(
            "{:.6} J -> {:.6} J, largest rise {:.1e} J",
            summary.energy.initial_j, summary.energy.final_j, summary.energy.increase_max_j
        ),
    );
    let row = |values: &[f64], scale: f64| {
        values.iter().fold(String::new(), |row, value| row + &format!("{:>10.4}", scale * value))
    };
    let fingers = (1..=last.normal_force_n.len())
        .fold(String::new(), |row, i| row + &format!("{:>10}", format!("finger {i}")));
    line("", fingers);
    line("normal force, N", row(&last.normal_force_n, 1.0));
    line("  of Eq. 57, N", row(&last.desired_normal_force_n, 1.0));
    line("tangential force, N", row(&last.tangential_force_n, 1.0));
    line("indentation, mm", row(&last.indentation_m, 1e3));
    if !last.slipped_m.is_empty() {
        line("slipped, mm", row(&last.slipped_m, 1e3));
        line("table carries", format!("{:9.4} N", last.table_force_n));
        if last.link_force_n > 0.0 {
            line("links carry", format!("{:9.4} N", last.link_force_n));
        }
    }
    text
}
