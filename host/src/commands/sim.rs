//! `blindgrasp sim`: the closed loop on the host.

use super::Outcome;
use anyhow::Context;
use blindgrasp::model::Scene;
use blindgrasp::record::mcap::RecordingError;
use blindgrasp::sim::Simulation;
use blindgrasp::sim::csv::Trace;
use blindgrasp::sim::recorder::Recorder;
use blindgrasp::sim::run_dir::{RunDir, RunDirError};
use blindgrasp::sim::sample::Sample;
use blindgrasp::sim::summary::Summary;
use blindgrasp::sim::thinned::Thinned;
use blindgrasp::view;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write as _};
use std::path::PathBuf;

/// The file of the samples, in a run's directory.
const TRACE: &str = "trace.csv";

/// Run a scene in simulation: the controller of the firmware against the simulated hand and object
///
/// Exit code 0: the grasp held; 1: it was lost; 2: bad input or usage.
#[derive(Args)]
pub(crate) struct Arguments {
    #[arg(help = scene_help())]
    scene: String,
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
    let (directory, recording) = match &arguments.out {
        Some(path) if path.extension().is_some_and(|extension| extension == "mcap") => {
            (None, Some(path.clone()))
        }
        Some(path) => (Some(RunDir::choose(path, arguments.force)?), Some(path.join("record.mcap"))),
        None => (None, None),
    };
    for warning in &scene.warnings {
        eprintln!("blindgrasp: warning: {warning}");
    }
    let mut simulation = Simulation::new(&scene).with_context(|| format!("scene {}", scene.name))?;
    // What can't be written is told after the run, when its summary is safe; not so what is there already.
    let mut recorder = recording.map(|path| {
        // Whether it could be made shows in the next step.
        let _ = directory.as_ref().map(RunDir::create);
        Recorder::create(&path, arguments.force, &scene, simulation.controller())
    });
    if let Some(Err(error)) = recorder.take_if(|made| matches!(made, Err(RecordingError::Exists { .. }))) {
        return Err(error.into());
    }
    let bar = progress_bar(scene.duration_s);
    let mut files = directory.map(Files::begin);
    while let Ok(Some(step)) = simulation.step() {
        bar.set_position((step.t_s * 1e3) as u64);
        if let Some(Ok(recorder)) = &mut recorder {
            recorder.see(&step);
        }
        if let (Some(files), Some(sample)) = (&mut files, step.sample) {
            files.see(sample);
        }
    }
    bar.finish_and_clear();

    let summary = simulation.summary();
    let text = if arguments.json { serde_json::to_string(&summary)? + "\n" } else { describe(&summary) };
    io::stdout().lock().write_all(text.as_bytes()).context("cannot print the summary")?;
    // The recording is nearly all there: what is wrong with it keeps nothing else from being written.
    let recorded = recorder.map_or(Ok(()), |made| made.and_then(Recorder::finish).map(|_| ()));
    if let Some(files) = files {
        files.write(&scene, &summary)?;
    }
    recorded?;
    if let Some(path) = &arguments.out {
        eprintln!("blindgrasp: wrote {}", path.display());
    }
    Ok(if summary.grasp_held { Outcome::Shown } else { Outcome::Failed })
}

/// A bar over simulated milliseconds; hidden where stderr is not a terminal.
pub(super) fn progress_bar(duration_s: f64) -> ProgressBar {
    let style = "{bar:40} {percent:>3} %  {msg}simulated, {eta} left";
    ProgressBar::new((duration_s * 1e3) as u64)
        .with_style(ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// The files of a run, beside its recording.
struct Files {
    directory: RunDir,
    trace: io::Result<Trace<File>>,
    pictured: Thinned,
}

impl Files {
    fn begin(directory: RunDir) -> Self {
        let trace = File::create(directory.path().join(TRACE)).map(Trace::new);
        Self { directory, trace, pictured: Thinned::default() }
    }

    fn see(&mut self, sample: &Sample) {
        if let Ok(trace) = &mut self.trace {
            trace.see(sample);
        }
        self.pictured.see(sample);
    }

    fn write(self, scene: &Scene, summary: &Summary) -> anyhow::Result<()> {
        let directory = &self.directory;
        directory.create()?;
        let summary = serde_json::to_string_pretty(summary)? + "\n";
        directory.write("summary.json", |file| file.write_all(summary.as_bytes()))?;
        directory.write("scene.toml", |file| file.write_all(scene.effective_toml().as_bytes()))?;
        let path = || directory.path().join(TRACE);
        self.trace.and_then(Trace::finish).map_err(|source| RunDirError::Io { path: path(), source })?;
        let joint_names: Vec<String> = scene.joints.iter().map(|joint| joint.name.clone()).collect();
        let report = view::Report {
            title: &scene.name,
            hand: &scene.hand,
            joint_names: &joint_names,
            object: &scene.object,
            samples: &self.pictured.finish(),
        };
        view::write(directory.path(), &report)?;
        #[cfg(feature = "plots")]
        blindgrasp::plots::write(directory.path(), &report)?;
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
            _ => "held".to_owned(),
        },
    );
    if let Some(fault) = &summary.fault {
        line("controller", fault.clone());
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
    line("friction needed, max", format!("{:9.3}", summary.friction_demand_max));
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
    text
}
