//! The three laws that are compared: normal forces alone, the paper's, and the earlier one; and what becomes of a grasp under
//! each.

use super::evidence::{EvidenceError, simulation};
use crate::scene::Scene;
use crate::scene::file::{Control, SceneFile};
use crate::sim::summary::Summary;
use serde::Serialize;

/// `K_st` of Table VII, N m.
pub const ATTITUDE_STIFFNESS_NM: f64 = 5e-3;
/// `K_I` where one is taken for many objects, N m/rad: the paper prints none. It is five times the least with which the cube is
/// held (between 2e-3 and 4e-3, in the sweeps), where `K_st` of Table VII is three times its own least.
pub const INTEGRAL_GAIN_NM_RAD: f64 = 2e-2;
/// How often the law acts where it is as near to the continuous time of the theory as the tick goes, s.
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

    /// The gain that is taken where there is one for many objects.
    pub fn usual(self) -> f64 {
        match self {
            Self::NormalOnly => 0.0,
            Self::Attitudes => ATTITUDE_STIFFNESS_NM,
            Self::Integral => INTEGRAL_GAIN_NM_RAD,
        }
    }

    /// Makes it the law of a controller.
    pub fn set(self, control: &mut Control, gain: f64) {
        (control.attitude_stiffness_nm, control.integral_gain_nm_rad) = match self {
            Self::NormalOnly => (0.0, 0.0),
            Self::Attitudes => (gain, 0.0),
            Self::Integral => (0.0, gain),
        };
    }
}

/// When and why a grasp was lost.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Lost {
    /// When, s.
    pub at_s: f64,
    /// Why.
    pub why: String,
}

impl Lost {
    /// Of a run, if it was.
    pub fn of(summary: &Summary) -> Option<Self> {
        let why = || summary.lost_reason.clone().unwrap_or_default();
        summary.lost_at_s.map(|at_s| Self { at_s, why: why() })
    }
}

/// What became of a grasp under a law.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Grasped {
    /// The law.
    pub law: Law,
    /// How it was lost with the law at the scene's rate, if it was.
    pub lost: Option<Lost>,
    /// Only of one that was: how it was lost with the law at 10 kHz, if it was there too.
    pub lost_at_10_khz: Option<Lost>,
}

impl Grasped {
    /// Grasps as a scene says, under a law with its usual gain; what is lost is tried again with the law at 10 kHz.
    ///
    /// # Errors
    /// A scene or a run that can't be done.
    pub fn under(law: Law, run: &str, file: &SceneFile) -> Result<Self, EvidenceError> {
        let lost = |period_s: f64| -> Result<Option<Lost>, EvidenceError> {
            let mut file = file.clone();
            law.set(&mut file.control, law.usual());
            file.control.period_s = period_s;
            Ok(Lost::of(&simulation(run, &built(run, file)?)?.run_summed(|_| true)))
        };
        let at_its_rate = lost(file.control.period_s)?;
        let lost_at_10_khz = if at_its_rate.is_some() { lost(CONTINUOUS_S)? } else { None };
        Ok(Self { law, lost: at_its_rate, lost_at_10_khz })
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
    Scene::build(file).map_err(|cause| EvidenceError::Scene { run: run.to_owned(), cause })
}
