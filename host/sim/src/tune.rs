//! Tuning of a hand by the sampled loop about a grasp: its margins, and gains that have some.
//!
//! A [`Situation`] at rest is linearised: hand, object that rolls between soft fingertips, and the law, whatever it consists of. With the
//! estimator, the output delay and the motors, which hold a torque for a period, it is a [`SampledLoop`], whose eigenvalues say
//! whether the loop is stable, and for how much more delay, damping or stiffness it stays so.
//!
//! - Joint friction is left out: it helps, where there is some, but nobody knows it.
//! - A grasp that begins is another one than where it comes to rest: both count.
//! - The play of the estimator and the encoders' counts are left out: they matter for motions of a few counts only.
//! - The hand that touches nothing has to be stable with the same gains, or a grasp never comes to its rest.
//! - Damping gains are measured in inertias: `C_k = r / (M^-1)_kk`, with the rate `r` at which a joint alone would slow down. With one rate
//!   for all joints no finger's light end is damped faster than the loop can follow, while its base is hardly damped.

pub mod sampled;
pub mod situation;

pub use sampled::{Mode, SampledLoop};
pub use situation::Situation;

use blindgrasp_model::{HandFile, HandModel, Scene};
use blindgrasp_shared::parameter::ParameterError;
use nalgebra::DVector;
use serde::Serialize;
use std::f64::consts::PI;

/// The reason for which a hand can't be tuned.
#[derive(Clone, Debug, thiserror::Error)]
pub enum TuneError {
    /// The controller refuses its gains.
    #[error("control: {0}")]
    Control(#[from] ParameterError),
    /// There is no grasp at rest.
    #[error("there is no grasp at rest: {0}")]
    NoGrasp(String),
}

/// Most delay that is added to find a margin, ticks.
const MOST_TICKS: f64 = 20.0;
/// Largest factor on the gains of the laws to find a margin: how much firmer than its file a hand may grasp unless that says otherwise.
const MOST_FIRMNESS: f64 = 4.0;
/// Largest factor on the damping gains to find a margin.
const MOST_FACTOR: f64 = 100.0;
/// Bandwidths of the estimator that are tried, as shares of the largest, `1 / (pi T)`: from 50 Hz at 1 kHz on.
const BANDWIDTHS: [f64; 5] = [0.16, 0.32, 0.48, 0.64, 0.96];
/// Rates of damping that are tried, from the first, each so many times the one before, 1/s at a period of 1 ms.
const RATES: (f64, f64, i32) = (5.0, 1.3, 16);

/// The margins of a loop.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// Largest modulus of an eigenvalue that is not neutral; the loop is unstable from 1 on.
    pub spectral_radius: f64,
    /// Delay that could be added before the loop becomes unstable, ticks; negative where it is unstable, and less delay would make it
    /// stable. None: no delay is stable. At most 20.
    pub delay_margin_ticks: Option<f64>,
    /// Factors on all damping gains between which the loop is stable; none where it is not. From 0.01 to 100.
    pub damping_margin: Option<[f64; 2]>,
    /// Factor on the gains of the laws, force and stiffness, up to which the loop is stable; none where it is not. At most 4.
    pub force_margin: Option<f64>,
    /// The least damped mode.
    pub least_damped: Option<Mode>,
    /// The slowest mode.
    pub slowest: Option<Mode>,
}

/// Gains that were found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tuned {
    /// Bandwidth of the estimator, Hz.
    pub bandwidth_hz: Option<f64>,
    /// The rate at which a joint alone would slow down, 1/s.
    pub damping_rate_1_s: f64,
    /// Damping gain of each joint, N m s/rad.
    pub damping_nm_s_rad: Vec<f64>,
    /// The margins with these gains.
    pub margins: Margins,
}

impl SampledLoop {
    /// The loop of a scene about its grasp, with gains of the laws so many times as firm.
    ///
    /// # Errors
    /// The reason for which there is none.
    pub fn of_scene(scene: &Scene, firmness: f64) -> Result<Self, TuneError> {
        Ok(Self {
            situations: Situation::of_scene(scene, firmness)?,
            period_s: scene.control.period_s,
            delay_ticks: scene.actuators.output_delay_ticks,
            bandwidth_hz: (!scene.sensors.ideal).then_some(scene.control.estimator_bandwidth_hz),
        })
    }

    /// The loop of a hand about its nominal grasp, a tick late, as its firmware is, with gains of the laws so many times as firm.
    ///
    /// # Errors
    /// The reason for which there is none.
    pub fn nominal(
        hand: &HandModel,
        file: &HandFile,
        rotors: bool,
        firmness: f64,
    ) -> Result<Self, TuneError> {
        Ok(Self {
            situations: Situation::nominal(hand, file, rotors, firmness)?,
            period_s: f64::from(hand.config.period_us) * 1e-6,
            delay_ticks: 1.0,
            bandwidth_hz: Some(hand.config.estimator.bandwidth_hz.into()),
        })
    }

    /// Returns the delay that could be added, ticks; see [`Margins`].
    pub fn delay_margin_ticks(&self) -> Option<f64> {
        let stable = |added: f64| self.with(|changed| changed.delay_ticks += added).is_stable();
        let step = 0.25;
        if stable(0.0) {
            let Some(steps) = (1..)
                .take_while(|&k| step * f64::from(k) <= MOST_TICKS)
                .find(|&k| !stable(step * f64::from(k)))
            else {
                return Some(MOST_TICKS);
            };
            return Some(edge(step * f64::from(steps - 1), step * f64::from(steps), stable));
        }
        let less = (1..).map(|k| -step * f64::from(k)).take_while(|less| self.delay_ticks + less > -step);
        let mut less = less.map(|less| less.max(-self.delay_ticks));
        less.find(|&less| stable(less)).map(|less| edge(less, less + step, stable))
    }

    /// Returns the margins. `firmer` is the loop about the grasp that is so many times as firm; its damping and estimator don't matter.
    pub fn margins(&self, firmer: &dyn Fn(f64) -> Option<Self>) -> Margins {
        let damped = |factor: f64| self.with_gains(&(self.gains_nm_s_rad() * factor)).is_stable();
        let firm = |factor| {
            let firmer = firmer(factor).map(|firmer| {
                let gained = firmer.with_gains(&self.gains_nm_s_rad());
                gained.with(|changed| changed.bandwidth_hz = self.bandwidth_hz)
            });
            firmer.is_some_and(|firmer| firmer.is_stable())
        };
        let spectral_radius = self.spectral_radius();
        let is_stable = spectral_radius < 1.0;
        let modes = self.modes();
        Margins {
            spectral_radius,
            delay_margin_ticks: self.delay_margin_ticks(),
            damping_margin: is_stable.then(|| {
                [last_stable(1.0 / 1.2, MOST_FACTOR, damped), last_stable(1.2, MOST_FACTOR, damped)]
            }),
            force_margin: is_stable.then(|| last_stable(1.2, MOST_FIRMNESS, firm)),
            least_damped: modes.first().copied(),
            slowest: modes.iter().copied().min_by(|a, b| a.rate_1_s.total_cmp(&b.rate_1_s)),
        }
    }

    /// Returns the gains with the largest delay margin, at the lowest bandwidth of the estimator at which that is as large as wanted;
    /// where it is at none, at the bandwidth at which it is largest. None where nothing is stable.
    ///
    /// A higher bandwidth costs noise: see `shared/src/estimate.rs`.
    pub fn tuned(&self, wanted_ticks: f64, firmer: &dyn Fn(f64) -> Option<Self>) -> Option<Tuned> {
        let inertias_kg_m2 = self.inertias_kg_m2();
        let bandwidths: Vec<Option<f64>> = match self.bandwidth_hz {
            None => vec![None],
            Some(_) => BANDWIDTHS.iter().map(|share| Some((share / (PI * self.period_s)).round())).collect(),
        };
        let mut best: Option<(f64, f64, Self)> = None;
        for bandwidth_hz in bandwidths {
            let (first, step, count) = RATES;
            for rate_1_s in (0..count).map(|k| first * step.powi(k) * 1e-3 / self.period_s) {
                let gained = self.with_gains(&(&inertias_kg_m2 * rate_1_s));
                let tried = gained.with(|changed| changed.bandwidth_hz = bandwidth_hz);
                let Some(margin) = tried.is_stable().then(|| tried.delay_margin_ticks()).flatten() else {
                    continue;
                };
                if best.as_ref().is_none_or(|(most, ..)| margin > *most) {
                    best = Some((margin, rate_1_s, tried));
                }
            }
            if best.as_ref().is_some_and(|(margin, ..)| *margin >= wanted_ticks) {
                break;
            }
        }
        best.map(|(_, damping_rate_1_s, tuned)| Tuned {
            bandwidth_hz: tuned.bandwidth_hz,
            damping_rate_1_s,
            damping_nm_s_rad: tuned.gains_nm_s_rad().iter().copied().collect(),
            margins: tuned.margins(firmer),
        })
    }

    /// Returns the loop with damping gains, N m s/rad.
    #[must_use]
    pub fn with_gains(&self, gains_nm_s_rad: &DVector<f64>) -> Self {
        self.with(|changed| {
            changed.situations.iter_mut().for_each(|situation| situation.set_gains(gains_nm_s_rad.clone()));
        })
    }

    /// The damping gain of each joint, N m s/rad.
    fn gains_nm_s_rad(&self) -> DVector<f64> {
        self.situations
            .first()
            .map_or_else(|| DVector::zeros(0), |situation| situation.gains_nm_s_rad.clone())
    }

    /// Inertia of each joint while all others are loose, kg m^2.
    fn inertias_kg_m2(&self) -> DVector<f64> {
        let first = self.situations.first();
        first.map_or_else(
            || DVector::zeros(0),
            |situation| DVector::from_column_slice(&situation.inertias_kg_m2),
        )
    }
}

/// The place between a stable and an unstable value where that changes.
fn edge(mut stable: f64, mut unstable: f64, is_stable: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..10 {
        let middle = 0.5 * (stable + unstable);
        if is_stable(middle) {
            stable = middle;
        } else {
            unstable = middle;
        }
    }
    stable
}

/// The last stable factor on a gain, going from 1 by a step to at most `most` times or its inverse.
fn last_stable(step: f64, most: f64, is_stable: impl Fn(f64) -> bool) -> f64 {
    let end = if step > 1.0 { most } else { 1.0 / most };
    let mut factor = 1.0;
    while factor != end {
        let next = (factor * step).clamp(1.0 / most, most);
        if !is_stable(next) {
            return edge(factor, next, is_stable);
        }
        factor = next;
    }
    end
}
