//! A hand's file to start from, for a URDF: what the URDF says stays there, and what it can't say is guessed, marked, and told
//! how. Every guess scales with the hand.

mod fingertips;
mod gains;
mod meshes;
mod surfaces;
mod text;

use super::super::check::Result;
use super::super::error::{Place, SceneError};
use super::super::file::HandFile;
use super::super::hand::posture;
use super::super::hand_model::HandModel;
use super::super::library::{Document, read_text};
use super::super::one_line;
use super::keys::Keys;
use super::robot::{Kind, Robot};
use super::topology::Tree;
use blindgrasp_body::{Hand, overlap_m, pairs};
use gains::Gains;
use std::path::{Path, PathBuf};
use surfaces::Surfaces;

/// Random postures in which surfaces are looked at.
const POSTURES: usize = 200;

/// The request for a hand's file.
#[derive(Clone, Debug, Default)]
pub struct StarterRequest {
    /// The URDF as the hand's file is to name it: relative to [`folder`](Self::folder), or absolute.
    pub file: String,
    /// The folder that the hand's file is to be in.
    pub folder: PathBuf,
    /// The link that is the base frame; the root without it.
    pub base: Option<String>,
    /// Joints to hold still, and their angles, rad; for prismatic joints m.
    pub locked: Vec<(String, f64)>,
    /// The fingertips; guessed, if there is none.
    pub fingertips: Vec<FingertipRequest>,
}

/// A fingertip; what is left out is guessed.
#[derive(Clone, Debug, PartialEq)]
pub struct FingertipRequest {
    /// A link of the URDF.
    pub link: String,
    /// Its centre in the frame of the link, m.
    pub offset_m: Option<[f64; 3]>,
    /// Its radius, m.
    pub radius_m: Option<f64>,
}

/// Gains that a hand is tuned to.
#[derive(Clone, Debug, PartialEq)]
pub struct TunedGains {
    /// Bandwidth of the estimator, Hz.
    pub bandwidth_hz: f64,
    /// Damping gain of each joint, N m s/rad.
    pub damping_nm_s_rad: Vec<f64>,
}

/// A hand's file to start from.
#[derive(Clone, Debug, PartialEq)]
pub struct Starter {
    /// The file.
    pub text: String,
    /// The guesses in it, with their rules.
    pub guesses: Vec<String>,
    /// The oddities of the URDF or the hand, in words.
    pub warnings: Vec<String>,
}

impl StarterRequest {
    /// Reads the URDF, guesses what it can't say, and makes sure that the file can be used. Damping and the estimator's bandwidth are what
    /// the hand, with all other guesses, is tuned to; where that is none, they are guessed too.
    ///
    /// # Errors
    /// One line: where, what is wrong, what to do.
    pub fn start(
        &self,
        tune: impl Fn(&HandModel, &HandFile) -> Option<TunedGains>,
    ) -> std::result::Result<Starter, SceneError> {
        let path = self.folder.join(&self.file);
        let text = read_text(&path, ".urdf")?;
        let robot = Robot::parse(&text, &path.to_string_lossy())?;
        let tree = Tree::of(&robot)?;
        let keys = self.keys(&robot);
        let draft = fingertips::choose(&robot, &tree, &keys, &self.fingertips)
            .and_then(|fingertips| text::Draft::new(&robot, &tree, keys, fingertips))
            .map_err(on_command_line)?;
        // Kinematics and masses as any command will see them; gains do not matter to them.
        let (model, file) = self.hand(&draft.write(&Gains::preliminary(&draft), &Surfaces::default()))?;
        let mut gains = Gains::new(&draft, &file, &model.hand)?;
        let mut surfaces = Surfaces::of(&draft, path.parent().unwrap_or(Path::new("")));
        let (mut model, file) = self.hand(&draft.write(&gains, &surfaces))?;
        let mut tuned = tune(&model, &file);
        if tuned.is_none() {
            gains.frame = None;
            let without;
            (model, without) = self.hand(&draft.write(&gains, &surfaces))?;
            tuned = tune(&model, &without);
        }
        tuned.iter().for_each(|tuned| gains.tune(tuned));
        let HandModel { hand, mut warnings, .. } = model;
        let mut guesses = draft.guesses(&gains);
        guesses.extend(surfaces.guess());
        let odd: Vec<String> = surfaces.gap().into_iter().chain(overlap(&file, &hand)).collect();
        let known = surfaces.of_the_urdf(&file).into_iter().chain(surfaces.guess());
        surfaces.comments = known.chain(odd.iter().cloned()).collect();
        warnings.extend(odd);
        let text = draft.write(&gains, &surfaces);
        self.hand(&text)?;
        Ok(Starter { text, guesses, warnings })
    }

    /// The table `[urdf]`.
    fn keys(&self, robot: &Robot) -> Keys {
        let mut keys = Keys { file: self.file.clone(), base: self.base.clone(), ..Keys::default() };
        for (name, position) in &self.locked {
            let is_prismatic =
                robot.joint_index(name).is_some_and(|k| robot.joints[k].kind == Kind::Prismatic);
            let list = if is_prismatic { &mut keys.locked_m } else { &mut keys.locked_rad };
            list.insert(name.clone(), *position);
        }
        keys
    }

    /// The hand of a file that is not written yet.
    fn hand(&self, text: &str) -> Result<(HandModel, HandFile)> {
        HandModel::from_document(Document::parse(text, "the new hand's file", &self.folder)?)
    }
}

/// Tells the capsules that are inside each other, or a fingertip, in whatever posture; `hand check` tells those of the nominal one.
fn overlap(file: &HandFile, hand: &Hand) -> Option<String> {
    let capsules = file.capsules(hand);
    let mut random = fastrand::Rng::with_seed(1);
    let mut overlaps = pairs(hand, &capsules);
    for _ in 0..POSTURES {
        let angle = |(lower, upper): (f64, f64)| lower + (upper - lower) * random.f64();
        let angles_rad: Vec<f64> = (0..hand.joint_count()).map(|k| hand.range_rad(k)).map(angle).collect();
        let posture = posture(hand, &angles_rad);
        overlaps.retain(|parts| overlap_m(*parts, hand, &posture, &capsules) > 0.0);
    }
    let [first, second] = overlaps.first()?.map(|part| file.part_in_words(part));
    let others = match overlaps.len() - 1 {
        0 => String::new(),
        1 => " (and so does another pair)".into(),
        count => format!(" (and so do {count} more pairs)"),
    };
    Some(one_line(&format!(
        "{first} and {second} overlap in {POSTURES} of {POSTURES} random postures{others}, and no scene can start so; give \
         [[capsule]]s that don't, or set plant.links = false in scenes"
    )))
}

/// Errors about keys of `[urdf]` come from options of the command.
fn on_command_line(mut error: SceneError) -> SceneError {
    for (key, option) in
        [("urdf.base", "--base"), ("urdf.locked_rad.", "--lock"), ("urdf.locked_m.", "--lock")]
    {
        if let Some(name) = error.key.strip_prefix(key) {
            error.key = name.into();
            return error.at(&Place::whole(option));
        }
    }
    error
}
