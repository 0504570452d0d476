//! A hand without a scene: what its firmware is built with.

use super::{
    Scene,
    check::{Result, fail},
    controller::Setup,
    error::{Place, SceneError, one_line},
    file::{Actuators, HandFile, JointFile, PlantSettings, PostureFile, Sensors},
    library::{Document, Kind, is_path},
    open,
};
use blindgrasp_body::{Hand, MAX_FINGERS, MAX_JOINTS};
use blindgrasp_shared::cycle::{NamedPosture, POSTURES_MOST, Postures};
use blindgrasp_shared::model;
use blindgrasp_shared::parameter::ParameterError;
use blindgrasp_shared::tick::{Config, Params};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Bytes that the largest hand and its configuration take: 250 a joint are more than enough.
const MODEL_BYTES: usize = 1000 + 300 * MAX_JOINTS;

/// A hand, checked, with the configuration that its file asks for: the gains of `[control]`, the numbers of `[safety]`, and all
/// limits and faults that a real hand has. Gravity is along `-z` of the base: the palm looks up.
#[derive(Clone, Debug, PartialEq)]
pub struct HandModel {
    /// Its name.
    pub name: String,
    /// Kinematics and link masses.
    pub hand: Hand,
    /// Names of the joints, in the hand's order.
    pub joint_names: Vec<String>,
    /// Names of the fingertips, in the hand's order.
    pub fingertip_names: Vec<String>,
    /// The controller's configuration; zero beyond the hand's joints.
    pub config: Config<MAX_JOINTS>,
    /// Its named postures.
    pub postures: Vec<PostureFile>,
    /// Torque at each joint for each volt at its amplifier, N m/V.
    pub torques_per_volt_nm_v: Vec<f32>,
    /// Oddities that can be used, in words.
    pub warnings: Vec<String>,
}

impl HandModel {
    /// Loads a hand by its built-in name or by its path, which ends in `.toml` or contains a separator. Its file needs the
    /// table `[control]`.
    ///
    /// # Errors
    /// One line: where, which key, what is wrong, what to do.
    pub fn load(name_or_path: impl AsRef<OsStr>) -> std::result::Result<Self, SceneError> {
        Self::load_with_file(name_or_path).map(|(model, _)| model)
    }

    /// The same, with all that its file says.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_with_file(
        name_or_path: impl AsRef<OsStr>,
    ) -> std::result::Result<(Self, HandFile), SceneError> {
        Self::from_document(open(Kind::Hand, name_or_path.as_ref())?)
    }

    /// The hand that a device has been built with, and its file: from `file`, if that is named, else among those built in. The
    /// name that a device tells is never taken for a path.
    ///
    /// # Errors
    /// Why it is not known, and what to do: one line.
    pub fn of_device(
        file: Option<&str>,
        name: &str,
        hash: u32,
    ) -> std::result::Result<(Self, HandFile), String> {
        let remedy = "name its file with --hand";
        if file.is_none() && !Kind::Hand.built_in().iter().any(|&(known, _)| known == name) {
            return Err(format!("the hand `{}` is not built in; {remedy}", one_line(name)));
        }
        let file = file.unwrap_or(name);
        match Self::load_with_file(file) {
            Ok((hand, file)) if hand.hash() == hash => Ok((hand, file)),
            Ok(_) => Err(format!("the firmware was built with another hand than `{file}`; {remedy}")),
            Err(error) => Err(format!("{error}; {remedy}")),
        }
    }

    /// Reads a hand from a text. `source` is its name in errors.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(text: &str, source: &str) -> std::result::Result<Self, SceneError> {
        Self::from_document(Document::parse(text, source, Path::new(""))?).map(|(model, _)| model)
    }

    /// The files on the disk that a hand is read from: its own, and its URDF. As far as they can be told; none for a hand
    /// built in.
    pub fn files(name_or_path: impl AsRef<OsStr>) -> Vec<PathBuf> {
        let name_or_path = name_or_path.as_ref();
        if !is_path(name_or_path) {
            return Vec::new();
        }
        let document = Document::open(Kind::Hand, name_or_path, Path::new(""));
        let urdf = document.ok().and_then(|document| document.urdf_path());
        std::iter::once(name_or_path.into()).chain(urdf).collect()
    }

    /// Of a hand's file, with all that it says.
    pub(super) fn from_document(document: Document) -> std::result::Result<(Self, HandFile), SceneError> {
        let (file, model, warnings) = checked(document, |file, warnings| {
            let hand = file.prepare(warnings)?;
            Self::of_prepared(file, hand)
        })?;
        Ok((Self { warnings, ..model }, file))
    }

    /// The hand of a scene, with the configuration of its own file.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn of(scene: &Scene) -> std::result::Result<Self, SceneError> {
        let place = Place::whole(&format!("scene {}, hand {}", scene.name, scene.file.hand.name));
        Self::build(&scene.file.hand).map_err(|error| error.at(&place))
    }

    /// CRC-32 of all that a firmware takes from the hand: equal hands have equal firmware.
    pub fn hash(&self) -> u32 {
        model::hash(&self.bytes())
    }

    /// Returns the bytes that a firmware is built with: the hand, its configuration and the scales of its outputs, as
    /// [`model`] writes them. The same hand gives the same bytes, wherever its file lies.
    ///
    /// # Panics
    /// Never: the largest hand fits.
    pub fn bytes(&self) -> Vec<u8> {
        let mut buffer = [0; MODEL_BYTES];
        let (hand, outputs) = (self.hand.cast(), &self.torques_per_volt_nm_v);
        let postures = self.named_postures();
        model::encode(&hand, &postures, &self.config, outputs, &mut buffer)
            .expect("the largest hand fits")
            .to_vec()
    }

    /// Returns the names of the postures.
    pub fn posture_names(&self) -> Vec<String> {
        self.postures.iter().map(|posture| posture.name.clone()).collect()
    }

    /// Returns the postures as the controller has them.
    pub fn named_postures(&self) -> Postures<MAX_JOINTS> {
        named_postures(&self.postures)
    }

    /// Returns the parameters of its controller, with a configuration.
    ///
    /// # Errors
    /// The first that can't be used.
    pub fn params(
        &self,
        config: &Config<MAX_JOINTS>,
    ) -> std::result::Result<Params<MAX_JOINTS, MAX_FINGERS>, ParameterError> {
        Params::new(self.hand.cast(), config)?.with_postures(self.named_postures())
    }

    pub(crate) fn build(file: &HandFile) -> Result<Self> {
        let mut warnings = Vec::new();
        let hand = file.prepare(&mut warnings)?;
        Ok(Self { warnings, ..Self::of_prepared(file, hand)? })
    }

    /// Of a hand's file that was checked, and the hand that it is.
    pub(crate) fn of_prepared(file: &HandFile, hand: Hand) -> Result<Self> {
        let Some(gains) = &file.control else {
            return fail(
                "control",
                "the hand says nothing of its gains, which its firmware needs",
                "add a table [control] with the keys that a scene's has: force_n, attitude_stiffness_nm, ...",
            );
        };
        let setup = Setup {
            hand: &hand,
            joints: &file.joints,
            control: gains,
            safety: &file.safety,
            sensors: &Sensors::default(),
            actuators: &Actuators::default(),
            gravity_m_s2: PlantSettings::default().gravity_m_s2,
        };
        let mut config = setup.config();
        config.faults.heartbeat_ms = Some(file.safety.heartbeat_ms);
        config.faults.late_ticks = Some(file.safety.late_ticks);
        // What is in range in f64 may not be in f32.
        if let Err(error) = Params::new(hand.cast::<f32>(), &config) {
            return fail("control", format!("the controller refuses it: {error}"), "");
        }
        let joint_names = file.joints.iter().map(|joint| joint.name.clone()).collect();
        let fingertip_names = file.fingertips.iter().map(|fingertip| fingertip.name.clone()).collect();
        let per_volt = |joint: &JointFile| joint.torque_per_volt_nm_v as f32;
        let torques_per_volt_nm_v = file.joints.iter().map(per_volt).collect();
        let (name, postures, warnings) = (file.name.clone(), file.postures.clone(), Vec::new());
        Ok(Self {
            name,
            hand,
            joint_names,
            fingertip_names,
            config,
            postures,
            torques_per_volt_nm_v,
            warnings,
        })
    }
}

/// Returns the postures of a file as the controller has them.
pub(super) fn named_postures(postures: &[PostureFile]) -> Postures<MAX_JOINTS> {
    let mut named = [NamedPosture::default(); POSTURES_MOST];
    for (to, from) in named.iter_mut().zip(postures) {
        let angles_rad: Vec<f32> = from.angles_rad.iter().map(|&angle| angle as f32).collect();
        *to = NamedPosture::new(&from.name, &angles_rad);
    }
    Postures::first_of(named, postures.len())
}

impl HandFile {
    /// Loads a hand by its built-in name or by its path, checks it, and prepares its kinematics; with what is odd in it, in
    /// words. Unlike a [`HandModel`], it may do without `[control]`.
    ///
    /// # Errors
    /// One line: where, which key, what is wrong, what to do.
    pub fn load_checked(
        name_or_path: impl AsRef<OsStr>,
    ) -> std::result::Result<(Self, Hand, Vec<String>), SceneError> {
        checked(open(Kind::Hand, name_or_path.as_ref())?, Self::prepare)
    }
}

/// Reads a hand and checks it; what is wrong gets its place. The warnings so far are those of reading it.
fn checked<T>(
    document: Document,
    check: impl FnOnce(&HandFile, &mut Vec<String>) -> Result<T>,
) -> Result<(HandFile, T, Vec<String>)> {
    let (file, places) = HandFile::from_document(document)?;
    let mut warnings = places.warnings();
    let found = check(&file, &mut warnings).map_err(|error| places.locate(error))?;
    Ok((file, found, warnings))
}
