//! `blindgrasp serve`: a simulated hand behind a serial port.

use super::Outcome;
use crate::terminal;
use anyhow::{Context, bail};
use blindgrasp::device::interrupt;
use blindgrasp::model::Scene;
use blindgrasp::rig::line::Line;
use blindgrasp::rig::pty::{Link, Pty};
use blindgrasp::rig::serve::{News, Served, serve};
use blindgrasp::rig::simulated::{Happening, SimulatedHand, begins_open};
use blindgrasp_shared::link::rate::FIRST_BAUD;
use clap::Args;
use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;

/// Simulate a hand behind a serial port, in real time, for everything that talks to one
///
/// It is a pseudo-terminal, whose name is printed: give it to `console`, `record` or `monitor` as --port. Behind it is the
/// firmware's own code, with the parameters of the scene and its plant. Everything stands still until the first grasp; when
/// the object is lost, or let go, it is put back within a second. Ctrl-C ends it.
///
/// Where the hand begins open, as in `pick-cube`, everything moves from `arm` on, and is put back when the hand is disarmed. You
/// drive: the scene's script is not run, and its tables stay where they are.
///
/// Exit code 0: ended by the user; 2: bad input or usage.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A built-in scene (prism, cube, ...) with encoders, or the path of a scene file
    scene: OsString,
    /// A symbolic link to the port, to be made
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Speed of the line to the host; 0 for one that is as fast as the host
    #[arg(long, value_name = "BAUD", default_value_t = FIRST_BAUD)]
    baud: u32,
    /// Let the first joint's encoder fail for 0.1 s, so many seconds after each grasp, or after `arm` where the hand begins open
    #[arg(long, value_name = "S", value_parser = seconds)]
    fail_after: Option<f64>,
    /// Change a value of the scene, such as control.force_n=4 (may be repeated)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
}

/// A time that can be waited for.
fn seconds(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|seconds| (0.0..=1e6).contains(seconds))
        .ok_or("seconds from 0 to 1000000 are wanted".to_owned())
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let scene = Scene::load(&arguments.scene, &arguments.settings)?;
    for warning in &scene.warnings {
        eprintln!("blindgrasp: warning: {warning}");
    }
    if arguments.baud != 0 && arguments.baud < 9600 {
        bail!("--baud {}: 9600 at least, or 0", arguments.baud);
    }
    let mut hand =
        SimulatedHand::new(&scene, arguments.baud).with_context(|| format!("scene {}", scene.name))?;
    if let Some(after_s) = arguments.fail_after {
        hand.fail_after(after_s);
    }
    if begins_open(&scene) {
        eprintln!(
            "blindgrasp: you drive: the scene's script is not run, and nothing happens by itself at a time of the scene, such as a table that goes away"
        );
    }
    let mut pty = Pty::open().context("there is no pseudo-terminal")?;
    let port = pty.port().to_owned();
    let made = |path: &PathBuf| {
        if let Ok(before) = fs::read_link(path)
            && before != port
            && before.exists()
        {
            let (path, before) = (path.display(), before.display());
            eprintln!(
                "blindgrasp: {path} led to {before}, which is still there; from now on it leads to this hand"
            );
        }
        Link::new(path, &port).with_context(|| format!("cannot make the symbolic link {}", path.display()))
    };
    let _link = arguments.link.as_ref().map(made).transpose()?;
    interrupt::listen();
    terminal::print(&format!("port {}\n", port.display())).context("cannot print the port")?;
    let period_s = scene.control.period_s;
    let served = serve(&mut hand, &mut Line::new(arguments.baud), &mut pty, |tick, news| {
        let words = match news {
            News::World(Happening::Grasped) => "a grasp begins".to_owned(),
            News::World(Happening::Lost(lost)) => format!("the object is lost: {lost}; it is put back"),
            News::World(Happening::Dropped(lost)) => {
                format!("the object is lost: {lost}; it is put back when the hand is disarmed")
            }
            News::World(Happening::LetGo) => "it is let go; everything is put back".to_owned(),
            News::World(Happening::PutBack) => "the object is back".to_owned(),
            News::Missed(ticks) => format!("this program stood still: {ticks} ticks are missed"),
        };
        eprintln!("{:.3} s: {words}", tick as f64 * period_s);
    })
    .context("the pseudo-terminal fails")?;
    let Served { ticks, late, missed, dropped, lost_bytes } = served;
    eprintln!(
        "{ticks} ticks, {late} of them late, {missed} missed; {dropped} records and answers dropped, {lost_bytes} bytes not read in time"
    );
    Ok(Outcome::Shown)
}
