//! `blindgrasp scene export`: a scene in a format of other tools.

use super::super::Outcome;
use blindgrasp::files;
use blindgrasp::model::Scene;
use clap::Args;
use std::ffi::OsString;
use std::path::PathBuf;

/// Write a scene for another engine
///
/// As MJCF, for MuJoCo: hand, object and tables with their masses, inertias, friction and contacts, motors, and the start as a
/// keyframe. The controller is not in it. What MJCF has no words for is told, a line each.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A built-in scene, or the path of a scene's file
    scene: OsString,
    /// The MJCF file to write
    #[arg(long, value_name = "FILE.xml", required = true)]
    mjcf: PathBuf,
    /// Override a value of the scene (may be repeated), as `control.force_n=3`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Overwrite the file
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let path = &arguments.mjcf;
    files::check(path, arguments.force)?;
    let scene = Scene::load(&arguments.scene, &arguments.settings)?;
    for warning in &scene.warnings {
        eprintln!("blindgrasp: warning: {warning}");
    }
    let mjcf = scene.to_mjcf()?;
    files::write(path, &mjcf.text, arguments.force)?;
    for line in &mjcf.left_out {
        eprintln!("blindgrasp: not in MJCF: {line}");
    }
    eprintln!("blindgrasp: wrote {}", path.display());
    Ok(Outcome::Shown)
}
