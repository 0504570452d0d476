//! `blindgrasp pil`: the closed loop with the firmware in it.

use super::progress::Progress;
use super::{Outcome, sim};
use crate::terminal;
use anyhow::Context;
#[cfg(not(unix))]
use anyhow::bail;
use blindgrasp::device::build::pil_image;
use blindgrasp::device::client::{Client, Patience, Traffic};
use blindgrasp::device::interrupt;
use blindgrasp::device::talk;
use blindgrasp::device::transport::Transport;
use blindgrasp::model::{HandModel, Scene};
use blindgrasp::record::compare::{Comparison, Difference};
use blindgrasp::rig::pil::{Linked, Pilot, Plan};
use blindgrasp::sim::Simulation;
use blindgrasp::sim::summary::Summary;
use blindgrasp_shared::link::rate::FIRST_BAUD;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The hand whose firmware is measured if no scene says otherwise.
const BENCH_SCENE: &str = "cube";
/// The firmware's measurements: key, and what it is.
#[cfg(unix)]
const FIGURES: [(&str, &str); 7] = [
    ("law_gravity_off", "grasp law without gravity compensation"),
    ("law_gravity_on", "grasp law with gravity compensation"),
    ("tick", "whole tick"),
    ("tick_move", "the same, with a `move` taken"),
    ("encode_full", "encoding of its record in full"),
    ("encode_input", "digest and encoding of its input record"),
    ("save", "saving its state, one tick in a thousand"),
];

/// Run a scene with the firmware in the loop, and compare it bit for bit with the host
///
/// The image `pil` is built (inside the repository) and runs in QEMU, or on a board with --port. Every tick, it is sent the
/// encoder counts of the simulated hand, and answers with torques. The host does the same ticks itself: not a bit may
/// differ.
///
/// Exit code 0: the grasp held and no bit differs; 1: it was lost, or one does; 2: bad input or usage, or no firmware.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A built-in scene (prism, cube, ...) with encoders, or the path of a scene file
    #[arg(required_unless_present = "bench")]
    scene: Option<String>,
    /// Run the firmware in QEMU (this is the default)
    #[arg(long, conflicts_with = "port")]
    qemu: bool,
    /// In QEMU, go through the firmware's driver of the serial port; slower
    #[arg(long, conflicts_with = "port")]
    uart: bool,
    /// A serial port with a board that runs the image `pil`, and was reset; or unix:PATH for a socket at which somebody listens
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// Rate of the line, baud, if the board's image was built with another [default: 1000000]
    #[arg(long, value_name = "BAUD", requires = "port", value_parser = clap::value_parser!(u32).range(1..))]
    baud: Option<u32>,
    /// The ELF file of the image, in place of one that is built
    #[arg(long, value_name = "ELF", conflicts_with = "port")]
    image: Option<PathBuf>,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
    /// Simulated time, s, in place of the number of ticks
    #[arg(long, value_name = "S", allow_negative_numbers = true, conflicts_with = "ticks")]
    duration: Option<f64>,
    /// Number of ticks of the grasp [default: 10000, or those of the scene's script; with --uart 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    ticks: Option<u32>,
    /// Change a value of the scene, such as control.force_n=4 (may be repeated)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Count the instructions of the firmware's parts in QEMU instead of running a scene
    #[arg(long, conflicts_with_all = ["port", "uart", "duration", "ticks"])]
    bench: bool,
}

/// Ticks of a run, where nothing else is said: a few seconds.
const TICKS: u32 = 10_000;
/// The same through the emulated serial port, which takes a hundred times as long.
const TICKS_BY_UART: u32 = 1_000;

/// The result as `--json` prints it.
#[derive(Serialize)]
struct Report<'a> {
    /// Ticks of the grasp; those before it are compared, too.
    ticks: usize,
    bits_differ: u64,
    exchanges_per_s: f64,
    first_difference: Option<&'a Difference>,
    firmware: &'a str,
    link: &'a Traffic,
    #[serde(flatten)]
    summary: &'a Summary,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    interrupt::listen();
    let scene = load(arguments)?;
    for warning in &scene.warnings {
        eprintln!("blindgrasp: warning: {warning}");
    }
    if arguments.bench {
        return bench(&scene, arguments);
    }
    let plan = Plan::new(&scene).with_context(|| format!("scene {}", scene.name))?;
    let transport = match &arguments.port {
        Some(port) => talk::open_at(port, arguments.baud.unwrap_or(FIRST_BAUD))?,
        None => emulated(&image(arguments, &plan.hand, &scene)?, arguments.uart)?,
    };
    let linked = Linked::connect(&plan, Client::new(transport, Patience::default()))?;
    let mut simulation = Simulation::with_controller(&scene, Pilot::new(&plan, linked))
        .with_context(|| format!("scene {}", scene.name))?;
    let progress = Progress::new();
    let mut ticks = 0;
    let ended = loop {
        match simulation.step() {
            Ok(Some(step)) => {
                ticks += usize::from(step.sample.is_some());
                sim::show(&progress, step.t_s, scene.duration_s);
            }
            Ok(None) => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    drop(progress);

    let linked = simulation.controller().peer();
    let Comparison { bits_differ, first_difference, .. } = linked.comparison();
    if let Some(difference) = first_difference {
        eprintln!("blindgrasp: first difference: {difference}");
    }
    ended?;
    let summary = &simulation.summary();
    let report = Report {
        ticks,
        bits_differ: *bits_differ,
        exchanges_per_s: ticks as f64 / summary.wall_s,
        first_difference: first_difference.as_ref(),
        firmware: linked.firmware().map_or("", |firmware| firmware.words.as_str()),
        link: linked.traffic(),
        summary,
    };
    let text = if arguments.json { serde_json::to_string(&report)? + "\n" } else { describe(&report) };
    print(&text)?;
    Ok(if summary.grasp_held && *bits_differ == 0 { Outcome::Shown } else { Outcome::Failed })
}

/// The scene, for as long as is asked for.
fn load(arguments: &Arguments) -> anyhow::Result<Scene> {
    let name = arguments.scene.as_deref().unwrap_or(BENCH_SCENE);
    let mut settings = arguments.settings.clone();
    settings.extend(arguments.duration.map(|s| format!("duration_s={s:?}")));
    let mut scene = Scene::load(name, &settings)?;
    // Part of a script is no cycle.
    let is_whole = arguments.duration.is_some()
        || arguments.ticks.is_none() && !arguments.uart && !scene.script.is_empty();
    if !is_whole {
        let ticks = arguments.ticks.unwrap_or(if arguments.uart { TICKS_BY_UART } else { TICKS });
        // The first is at time 0.
        scene.duration_s = f64::from(ticks - 1) * scene.control.period_s;
    }
    Ok(scene)
}

/// The image to run.
fn image(arguments: &Arguments, hand: &HandModel, scene: &Scene) -> anyhow::Result<PathBuf> {
    match &arguments.image {
        Some(path) => Ok(path.clone()),
        None => {
            eprintln!("blindgrasp: building the image `pil` for the hand `{}`", hand.name);
            Ok(pil_image(hand, &scene.file.hand)?)
        }
    }
}

#[cfg(unix)]
fn emulated(image: &Path, uart: bool) -> anyhow::Result<Box<dyn Transport>> {
    let qemu = blindgrasp::device::qemu::Qemu::new(image, Patience::default().start)?;
    Ok(Box::new(if uart { qemu.with_uart()? } else { qemu.with_pipes()? }))
}

#[cfg(not(unix))]
fn emulated(_image: &Path, _uart: bool) -> anyhow::Result<Box<dyn Transport>> {
    bail!(
        "firmware runs in QEMU only where there are named pipes, as on Linux and macOS: use a board with --port"
    )
}

/// Counts instructions.
#[cfg(unix)]
fn bench(scene: &Scene, arguments: &Arguments) -> anyhow::Result<Outcome> {
    let image = image(arguments, &HandModel::of(scene)?, scene)?;
    let qemu = blindgrasp::device::qemu::Qemu::new(&image, Patience::default().start)?;
    let figures = qemu.bench(&FIGURES.map(|(key, _)| key))?;
    if arguments.json {
        print(&(serde_json::to_string(&figures)? + "\n"))?;
    } else {
        let mut text = "instructions, at most:\n".to_owned();
        for (key, words) in FIGURES {
            text += &format!("{words:<42}{:>8}\n", figures[key]);
        }
        print(&text)?;
    }
    Ok(Outcome::Shown)
}

#[cfg(not(unix))]
fn bench(_scene: &Scene, _arguments: &Arguments) -> anyhow::Result<Outcome> {
    bail!("instructions are counted in QEMU, which is used on Linux and macOS only")
}

fn print(text: &str) -> anyhow::Result<()> {
    terminal::print(text).context("cannot print the summary")
}

/// The summary as a table.
fn describe(report: &Report<'_>) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| text += &format!("{name:<22}{value}\n");
    line("firmware", report.firmware.to_owned());
    line(
        "bits",
        match report.first_difference {
            None => format!("none differs in {} ticks", report.ticks),
            Some(first) => format!("{} values DIFFER; first at {first}", report.bits_differ),
        },
    );
    line("exchanges", format!("{:.0} a second", report.exchanges_per_s));
    line("link", report.link.to_string());
    text + &sim::describe(report.summary)
}
