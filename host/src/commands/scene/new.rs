//! `blindgrasp scene new`: where the fingertips of a hand touch an object, and a scene file that begins there.

use super::show;
use crate::commands::Outcome;
use crate::terminal;
use anyhow::{Context, bail};
use blindgrasp::files;
use blindgrasp::model::file::{ContactFile, SceneFile};
use blindgrasp::model::{HandFile, ObjectFile, Parts, Scene, suggestion};
use blindgrasp::place::{NoPlacement, Reach, Request, place, scene_text, template};
use blindgrasp::sim::Simulation;
use blindgrasp::sim::summary::Summary;
use blindgrasp::sim::verdict::Outcome as Verdict;
use clap::Args;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};

/// The most placements that can be listed.
const LONGEST_LIST: usize = 100;

/// Find where the fingertips of a hand best touch an object, and write a scene that begins there
///
/// All choices of faces are rated by where the law comes to rest: how far the fingertips roll until u_st holds them, and how
/// far the faces' edges are; the best that the fingers can reach is written: with weight and friction, on a table that goes away.
/// What a simulation of it comes to is printed, and stands in the file.
///
/// Exit code 0: written, and held when it was simulated; 1: there is no placement, or it was lost, with the reason; 2: bad input or
/// usage.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A built-in hand, or the path of a hand's file
    hand: OsString,
    /// A built-in object, or the path of an object's file
    object: OsString,
    /// The file to write; without it HAND-OBJECT.toml here
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
    /// Overwrite the file
    #[arg(long)]
    force: bool,
    /// In the paper's own model: no friction in the joints, true joint angles, no delay, no limits; with --rolling
    #[arg(long)]
    ideal: bool,
    /// In the paper's world: the object has no weight and lies on no table, and fingertips never slip
    #[arg(long)]
    rolling: bool,
    /// Put a fingertip (by name, or by number from 1) on a face, by number from 0 (may be repeated)
    #[arg(long = "face", value_name = "FINGER=FACE")]
    faces: Vec<String>,
    /// Put a fingertip on a point of the object's surface, m, in the object's frame (may be repeated)
    #[arg(long = "point", value_name = "FINGER=X,Y,Z", allow_hyphen_values = true)]
    points: Vec<String>,
    /// Position of the object's centre of mass in the hand's base frame, m; without it, where the fingers get to best
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    position: Option<String>,
    /// Roll, pitch and yaw of the object, rad; without it, as its file describes it
    #[arg(long = "rotation-rpy", value_name = "R,P,Y", allow_hyphen_values = true)]
    rotation: Option<String>,
    /// Choose among many attitudes of the object
    #[arg(long, conflicts_with = "rotation")]
    any_attitude: bool,
    /// Angle of a joint that moves several fingertips, such as an arm's, rad; without it the nominal one (may be repeated)
    #[arg(long = "trunk", value_name = "JOINT=RAD", allow_hyphen_values = true)]
    trunk: Vec<String>,
    /// Grasping force f_d, N, in place of the hand's
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    force_n: Option<f64>,
    /// Print the best N placements
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=LONGEST_LIST as i64))]
    list: u16,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let like = scene_like(arguments)?;
    let path = arguments
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}.toml", like.name.replace(['/', '\\'], "-"))));
    files::check(&path, arguments.force)?;
    let parts = Parts::of(&like)?;
    let reach = Reach::of_scene(&like, &parts)?;
    let request = Request {
        like: &like,
        parts: &parts,
        reach: &reach,
        any_position: arguments.position.is_none(),
        any_attitude: arguments.any_attitude,
    };
    let mut placements = match place(&request, usize::from(arguments.list)) {
        Ok(placements) => placements,
        Err(NoPlacement::Input(error)) => return Err(error.into()),
        Err(NoPlacement::None(refusal)) => {
            let text =
                if arguments.json { show::refusal_json(&refusal)? } else { show::refusal(&refusal, &like) };
            print(&text)?;
            return Ok(Outcome::Failed);
        }
    };
    let references = [(&arguments.hand, "hand"), (&arguments.object, "object")]
        .map(|(name, what)| reference(name, &path).with_context(|| format!("the path of the {what}")));
    let [hand, object] = references;
    let is_on_table = !(arguments.ideal || arguments.rolling);
    if is_on_table && let Some(best) = placements.first_mut() {
        let file = best.on_a_table();
        if file.plant.links != like.plant.links {
            eprintln!(
                "blindgrasp: the arm reaches below the table's surface, as if it stood beside it: links touch nothing in this scene (plant.links = false)"
            );
        }
        best.scene = Scene::build(file)?;
    }
    let summary = Simulation::new(&placements[0].scene)?.run().summary;
    let outcome = in_words(&summary);
    let text = scene_text(&placements[0], &hand?, &object?, &outcome);
    let shown = if arguments.json {
        show::json(&placements, &path, &summary, &outcome)?
    } else {
        show::text(&placements, &outcome)
    };
    files::write(&path, &text, arguments.force)?;
    print(&shown)?;
    eprintln!("blindgrasp: wrote {}; `blindgrasp sim {}` runs it", path.display(), shown_path(&path));
    Ok(if summary.grasp_held { Outcome::Shown } else { Outcome::Failed })
}

/// Returns the outcome of a simulation in words.
fn in_words(summary: &Summary) -> String {
    let world = if summary.last.slipped_m.is_empty() {
        "in the paper's world"
    } else {
        "with weight, after the table went away"
    };
    match (summary.lost_at_s, &summary.lost_reason, &summary.fault) {
        (Some(t_s), Some(reason), _) => format!("LOST at {t_s:.2} s: {reason}"),
        (_, _, Some(fault)) => format!("ended in {fault}"),
        _ => {
            let slipped_m = summary.last.slipped_m.iter().copied().fold(0.0, f64::max);
            let slipped = match summary.outcome {
                Verdict::Slipped => format!(", but a fingertip slipped by {:.1} mm", slipped_m * 1e3),
                _ => String::new(),
            };
            format!(
                "held for {:.1} s {world}{slipped}; needs a friction of {:.2}",
                summary.duration_s, summary.friction_demand_max
            )
        }
    }
}

fn print(text: &str) -> anyhow::Result<()> {
    terminal::print(text).context("cannot print the placement")
}

/// Returns a path as `sim` takes it, to which a name without a separator or `.toml` is a built-in one.
fn shown_path(path: &Path) -> String {
    let text = path.display().to_string();
    if text.ends_with(".toml") || text.contains(['/', '\\']) { text } else { format!("./{text}") }
}

/// The scene that is asked for, without a placement.
fn scene_like(arguments: &Arguments) -> anyhow::Result<SceneFile> {
    let (hand, _, notices) = HandFile::load_checked(&arguments.hand)?;
    let (object, more) = ObjectFile::load_checked(&arguments.object)?;
    for warning in notices.iter().chain(&more) {
        eprintln!("blindgrasp: warning: {warning}");
    }
    let mut like = template(hand, object, arguments.ideal)?;
    if let Some(force_n) = arguments.force_n {
        like.control.gains.grasp[0] = force_n;
    }
    if let Some(text) = &arguments.position {
        like.pose.position_m = three("--position", text)?;
    }
    if let Some(text) = &arguments.rotation {
        like.pose.rotation_rpy_rad = Some(three("--rotation-rpy", text)?);
    }
    like.start.trunk_rad = trunk(&arguments.trunk)?;
    like.contacts = vec![ContactFile::default(); like.hand.fingertips.len()];
    for text in &arguments.faces {
        let (fingertip, face) = wish("--face", text, &like)?;
        let face = face
            .parse()
            .ok()
            .with_context(|| format!("--face {text}: `{face}` is not a number of a face"))?;
        like.contacts[fingertip].face = Some(face);
    }
    for text in &arguments.points {
        let (fingertip, point) = wish("--point", text, &like)?;
        like.contacts[fingertip].point_m = Some(three("--point", point)?);
    }
    Ok(like)
}

/// `FINGER=...`: the index of the fingertip, and what is behind the equals sign.
fn wish<'a>(option: &str, text: &'a str, like: &SceneFile) -> anyhow::Result<(usize, &'a str)> {
    let Some((finger, value)) = text.split_once('=') else {
        bail!("{option} {text}: has to be FINGER=..., such as {option} 1=...");
    };
    let names = like.hand.fingertips.iter().map(|fingertip| fingertip.name.as_str());
    let by_number = finger.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
    let found = names.clone().position(|name| name == finger).or(by_number);
    match found {
        Some(fingertip) if fingertip < like.hand.fingertips.len() => Ok((fingertip, value)),
        _ => bail!("{option} {text}: there is no fingertip `{finger}`; {}", suggestion(finger, names)),
    }
}

/// Three numbers with commas between them.
fn three(option: &str, text: &str) -> anyhow::Result<[f64; 3]> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse::<f64>()).collect();
    match numbers.map(<[f64; 3]>::try_from) {
        Ok(Ok(numbers)) if numbers.iter().all(|number| number.is_finite()) => Ok(numbers),
        _ => bail!("{option} {text}: has to be three numbers with commas between them, such as 0,0,0.12"),
    }
}

fn trunk(settings: &[String]) -> anyhow::Result<BTreeMap<String, f64>> {
    settings
        .iter()
        .map(|text| {
            let (joint, angle) =
                text.split_once('=').with_context(|| format!("--trunk {text}: has to be JOINT=RAD"))?;
            let angle = angle.parse().ok().filter(|angle: &f64| angle.is_finite());
            Ok((
                joint.to_owned(),
                angle.with_context(|| format!("--trunk {text}: the angle is not a number"))?,
            ))
        })
        .collect()
}

/// Returns the scene's name for a hand or an object: a built-in name, or a path relative to the scene's file.
fn reference(path: &OsString, scene: &Path) -> anyhow::Result<String> {
    let name = path.to_string_lossy();
    if !name.ends_with(".toml") && !name.contains(['/', '\\']) {
        return Ok(name.into_owned());
    }
    let folder = match scene.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    };
    let [target, folder] = [Path::new(path), &folder]
        .map(|path| path.canonicalize().with_context(|| path.display().to_string()));
    let path = relative(target?, &folder?);
    path.to_str().map(str::to_owned).with_context(|| format!("{} is not UTF-8", path.display()))
}

/// Returns an absolute path as one from a folder; between two drives there is none.
fn relative(target: PathBuf, folder: &Path) -> PathBuf {
    let shared = folder.components().zip(target.components()).take_while(|(one, other)| one == other).count();
    if shared == 0 {
        return target;
    }
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(target.components().skip(shared)).collect()
}
