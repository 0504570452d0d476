//! The three laws that are compared: normal forces alone, the paper's, and the earlier one; and what becomes of a grasp under
//! each.

use super::evidence::{EvidenceError, simulation};
use blindgrasp_model::Scene;
use blindgrasp_model::file::{Control, SceneFile};
use blindgrasp_sim::summary::Summary;
use serde::Serialize;

/// Period of a law that is as near to the continuous time of the theory as the tick goes, s.
const CONTINUOUS_S: f64 = 1e-4;

/// A law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// `u_s` alone.
    NormalOnly,
    /// `u_s + u_st`, with `K_st` for its gain, N m.
    Attitudes,
    /// `u_s + u_I`, with `K_I` for its gain, N m/rad.
    Integral,
}

impl Law {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::NormalOnly, Self::Attitudes, Self::Integral];

    /// As it is written.
    pub fn words(self) -> &'static str {
        match self {
            Self::NormalOnly => "u_s",
            Self::Attitudes => "u_s + u_st",
            Self::Integral => "u_s + u_I",
        }
    }

    /// Makes it the law of a controller.
    pub fn set(self, control: &mut Control, gain: f64) {
        (control.gains.grasp[1], control.gains.integral) = match self {
            Self::NormalOnly => (0.0, [0.0]),
            Self::Attitudes => (gain, [0.0]),
            Self::Integral => (0.0, [gain]),
        };
    }
}

/// A law with its gain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// The law.
    pub law: Law,
    /// Its gain.
    pub gain: f64,
}

/// Gains with which both laws are compared on many objects: `K_st` of Table VII and four times that, N m; and the same numbers
/// for `K_I`, N m/rad, of which the paper prints none. For a small turn of a fingertip both are the moment for each radian, give
/// or take the number of joints that turn; the least that hold the cube are 2e-3 for the one and 3e-3 for the other.
pub const GAINS: [f64; 2] = [5e-3, 2e-2];

impl Case {
    /// `u_s` alone.
    pub const NORMAL_ONLY: Self = Self { law: Law::NormalOnly, gain: 0.0 };
    /// `u_s + u_st` with the gain of Table VII.
    pub const PAPER: Self = Self { law: Law::Attitudes, gain: GAINS[0] };
    /// The laws that are compared on many objects.
    pub const ALL: [Self; 5] = [
        Self::NORMAL_ONLY,
        Self::PAPER,
        Self { law: Law::Attitudes, gain: GAINS[1] },
        Self { law: Law::Integral, gain: GAINS[0] },
        Self { law: Law::Integral, gain: GAINS[1] },
    ];

    /// In words.
    pub fn words(self) -> String {
        match self.law {
            Law::NormalOnly => self.law.words().to_owned(),
            law => format!("{}, {}", law.words(), self.gain),
        }
    }
}

/// The time and the reason of a loss.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Lost {
    /// The time, s.
    pub at_s: f64,
    /// The reason.
    pub why: String,
}

impl Lost {
    /// Of a run, if it was.
    pub fn of(summary: &Summary) -> Option<Self> {
        let why = || summary.lost_reason.clone().unwrap_or_default();
        summary.lost_at_s.map(|at_s| Self { at_s, why: why() })
    }
}

/// The result of a grasp under a law.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Grasped {
    /// The law with its gain.
    pub case: Case,
    /// The loss with the law at the scene's rate, if there was one.
    pub lost: Option<Lost>,
    /// Only of one that was, and by a law that holds: how it was lost with the law at 10 kHz, if it was there too.
    pub lost_at_10_khz: Option<Lost>,
}

impl Grasped {
    /// Grasps as a scene says, under a law; what is lost by a law that should hold it is tried again with the law at 10 kHz.
    ///
    /// # Errors
    /// A scene or a run that can't be done.
    pub fn under(case: Case, run: &str, file: &SceneFile) -> Result<Self, EvidenceError> {
        let lost = |period_s: f64| -> Result<Option<Lost>, EvidenceError> {
            let mut file = file.clone();
            case.law.set(&mut file.control, case.gain);
            file.control.period_s = period_s;
            let mut simulation = simulation(run, &built(run, file)?)?;
            while let Ok(Some(_)) = simulation.step() {}
            Ok(Lost::of(&simulation.summary()))
        };
        let at_its_rate = lost(file.control.period_s)?;
        let lost_at_10_khz = match &at_its_rate {
            Some(_) if case.law != Law::NormalOnly => lost(CONTINUOUS_S)?,
            other => other.clone(),
        };
        Ok(Self { case, lost: at_its_rate, lost_at_10_khz })
    }

    /// Held with the law at the scene's rate.
    pub fn held(&self) -> bool {
        self.lost.is_none()
    }

    /// Held with the law at 10 kHz, or at less.
    pub fn held_at_10_khz(&self) -> bool {
        self.held() || self.lost_at_10_khz.is_none()
    }
}

/// A scene that was put together.
///
/// # Errors
/// What is wrong with it.
pub fn built(run: &str, file: SceneFile) -> Result<Scene, EvidenceError> {
    Scene::build(file).map_err(|cause| EvidenceError::of(run, cause))
}
