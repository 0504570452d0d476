//! The sampled loop about situations at rest, each as one matrix from tick to tick.
//!
//! ```text
//! s' = exp(A) s + held torques       s: displacements over T, velocities; a tick of continuous time
//! x' = t^2 (x + v) + (1 - t^2) q     the estimator (shared/src/estimate.rs), behind its play, which is not linear
//! v' = v + (1 - t)^2 (q - x - v)
//! u  = law(x', v')                   acts for a period, `n + f` periods later
//! ```
//!
//! All lengths and angles are in units of `T` metres and radians, so that the entries of the matrix are of like size.

use super::situation::Situation;
use blindgrasp_plant::small_motions::SmallMotions;
use blindgrasp_shared::estimate::pole;
use nalgebra::{Complex, ComplexField, DMatrix, Schur};
use serde::Serialize;
use std::f64::consts::TAU;

/// Motions that come or go at less than this rate are neutral, 1/s: the whole hand, of whose place the law knows nothing, and fingertips that
/// only their torsional viscosity holds.
const NEUTRAL_HZ: f64 = 0.3;
/// Motions that fall below this share within a tick are none that anybody sees.
const VANISHING: f64 = 0.2;

/// The sampled loop of a hand.
#[derive(Clone, Debug)]
pub struct SampledLoop {
    /// The situations in which it has to be stable.
    pub situations: Vec<Situation>,
    /// Sampling period `T`, s.
    pub period_s: f64,
    /// Control periods from the reading of the encoders to the torque that follows from it.
    pub delay_ticks: f64,
    /// Bandwidth of the estimator, Hz; without an estimator the law gets true angles and speeds.
    pub bandwidth_hz: Option<f64>,
}

/// A mode of the loop: the continuous motion that an eigenvalue, or a pair of them, is the sample of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mode {
    /// Its frequency, Hz; zero of a motion that does not swing.
    pub frequency_hz: f64,
    /// Its damping ratio; negative where it grows.
    pub damping_ratio: f64,
    /// The rate at which it decays, 1/s; negative where it grows.
    pub rate_1_s: f64,
}

impl SampledLoop {
    /// The matrix that takes the loop's state from one tick to the next.
    fn matrix(&self, situation: &Situation) -> DMatrix<f64> {
        let Situation { motions, stiffness_nm_rad, damping_nm_s_rad, .. } = situation;
        let (joints, free) = motions.joints.shape();
        let (t, turns) = (self.period_s, &motions.joints);
        let (whole, part) = (self.delay_ticks.floor() as usize, self.delay_ticks.fract());
        let held = whole + usize::from(part > 0.0);
        let (step, torque) = self.plant(motions, 1.0);
        let (_, torque_new) =
            if part > 0.0 { self.plant(motions, 1.0 - part) } else { (step.clone(), torque.clone()) };
        let torque_old = torque - &torque_new;

        let (estimate, estimates) = (2 * free, if self.bandwidth_hz.is_some() { 2 * joints } else { 0 });
        let line = estimate + estimates;
        let size = line + held * joints;
        let mut matrix = DMatrix::zeros(size, size);
        let set = |matrix: &mut DMatrix<f64>, row: usize, column: usize, block: &DMatrix<f64>| {
            matrix.view_mut((row, column), block.shape()).copy_from(block);
        };
        set(&mut matrix, 0, 0, &step);
        // The law's torques, as rows over the state.
        let (k, c) = (stiffness_nm_rad * t, damping_nm_s_rad);
        let mut law = DMatrix::zeros(joints, size);
        match self.bandwidth_hz {
            None => {
                set(&mut law, 0, 0, &(&k * turns));
                set(&mut law, 0, free, &(c * turns));
            }
            Some(bandwidth_hz) => {
                let pole = f64::from(pole(bandwidth_hz as f32, t as f32));
                let one = DMatrix::identity(joints, joints);
                let (keep, beta) = (pole * pole, (1.0 - pole) * (1.0 - pole));
                let mut estimator = DMatrix::zeros(2 * joints, size);
                set(&mut estimator, 0, 0, &(turns * (1.0 - keep)));
                set(&mut estimator, 0, estimate, &(&one * keep));
                set(&mut estimator, 0, estimate + joints, &(&one * keep));
                set(&mut estimator, joints, 0, &(turns * beta));
                set(&mut estimator, joints, estimate, &(&one * -beta));
                set(&mut estimator, joints, estimate + joints, &(&one * (1.0 - beta)));
                law = &k * estimator.rows(0, joints) + c * estimator.rows(joints, joints);
                set(&mut matrix, estimate, 0, &estimator);
            }
        }
        // The torques of so many ticks ago, as rows over the state.
        let ago = |ticks: usize| match ticks.checked_sub(1) {
            None => law.clone(),
            Some(place) => {
                let mut rows = DMatrix::zeros(joints, size);
                set(&mut rows, 0, line + place * joints, &DMatrix::identity(joints, joints));
                rows
            }
        };
        let mut acting = &torque_new * ago(whole);
        if part > 0.0 {
            acting += &torque_old * ago(whole + 1);
        }
        let mut top = matrix.rows_mut(0, 2 * free);
        top += acting;
        for place in 0..held {
            set(&mut matrix, line + place * joints, 0, &ago(place));
        }
        matrix
    }

    /// Hand and object over a part of a tick: the matrix of the state, and that of torques held meanwhile.
    fn plant(&self, motions: &SmallMotions, ticks: f64) -> (DMatrix<f64>, DMatrix<f64>) {
        let (joints, free) = motions.joints.shape();
        let t = self.period_s;
        // Positive definite: no direction is without mass.
        let inverse = motions
            .inertia
            .clone()
            .cholesky()
            .map_or_else(|| DMatrix::from_element(free, free, f64::NAN), |factor| factor.inverse());
        let mut a = DMatrix::zeros(2 * free + joints, 2 * free + joints);
        a.view_mut((0, free), (free, free)).fill_with_identity();
        a.view_mut((free, 0), (free, free)).copy_from(&(&inverse * &motions.stiffness * (-t * t)));
        a.view_mut((free, free), (free, free)).copy_from(&(&inverse * &motions.damping * -t));
        a.view_mut((free, 2 * free), (free, joints)).copy_from(&(&inverse * motions.joints.transpose() * t));
        let moved = exponential(&(a * ticks));
        (
            moved.view((0, 0), (2 * free, 2 * free)).into_owned(),
            moved.view((0, 2 * free), (2 * free, joints)).into_owned(),
        )
    }

    /// Eigenvalues of the matrix of a situation that are not neutral; NaN where they can't be found.
    fn eigenvalues(&self, situation: &Situation) -> Vec<Complex<f64>> {
        let matrix = self.matrix(situation);
        let is_finite = matrix.iter().all(|entry| entry.is_finite());
        // Where the iteration stalls, a little less is asked of it.
        let schur = [1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10]
            .iter()
            .filter(|_| is_finite)
            .find_map(|&tolerance| Schur::try_new(matrix.clone(), tolerance, 30 * matrix.nrows()));
        schur.map_or_else(
            || vec![Complex::from(f64::NAN)],
            |schur| {
                let values = schur.complex_eigenvalues();
                values.iter().copied().filter(|value| !self.is_neutral(value)).collect()
            },
        )
    }

    /// Returns the largest modulus of an eigenvalue in any situation. Motions that neither come back nor go on don't count: the law
    /// knows nothing of where the whole hand is.
    pub fn spectral_radius(&self) -> f64 {
        let values = self.situations.iter().flat_map(|situation| self.eigenvalues(situation));
        // NaN stays.
        values
            .map(ComplexField::modulus)
            .fold(0.0, |most: f64, value| if most.is_nan() || most >= value { most } else { value })
    }

    /// Returns `true` if everything that moves decays.
    pub fn is_stable(&self) -> bool {
        self.spectral_radius() < 1.0
    }

    /// Returns the modes of all situations that are not neutral and do not vanish within a tick, the least damped first.
    pub fn modes(&self) -> Vec<Mode> {
        let values = self.situations.iter().flat_map(|situation| self.eigenvalues(situation));
        let mut modes: Vec<Mode> = values
            .filter(|value| value.im >= 0.0 && value.modulus() > VANISHING)
            .map(|value| {
                let rate_1_s = -value.modulus().ln() / self.period_s;
                let turning_rad_s = value.argument() / self.period_s;
                Mode {
                    frequency_hz: turning_rad_s / TAU,
                    damping_ratio: rate_1_s / rate_1_s.hypot(turning_rad_s),
                    rate_1_s,
                }
            })
            .collect();
        modes.sort_by(|a, b| a.damping_ratio.total_cmp(&b.damping_ratio));
        modes
    }

    fn is_neutral(&self, value: &Complex<f64>) -> bool {
        (value - Complex::from(1.0)).modulus() < NEUTRAL_HZ * self.period_s
    }

    /// Returns the loop with a change.
    #[must_use]
    pub fn with(&self, change: impl FnOnce(&mut Self)) -> Self {
        let mut changed = self.clone();
        change(&mut changed);
        changed
    }
}

/// The exponential of a matrix: a Taylor series of a small part of it, squared.
fn exponential(a: &DMatrix<f64>) -> DMatrix<f64> {
    let size = a.column_iter().map(|column| column.lp_norm(1)).fold(0.0, f64::max);
    let halvings = size.max(0.25).log2().ceil() as i32 + 2;
    let part = a * 0.5_f64.powi(halvings);
    let one = DMatrix::identity(a.nrows(), a.ncols());
    // Horner's rule; the part is below 1/4, whose 14th power over 14! is below rounding.
    let mut sum = one.clone();
    for k in (1..=14).rev() {
        sum = &one + &part * sum / f64::from(k);
    }
    for _ in 0..halvings {
        sum = &sum * &sum;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::math::Real;
    use nalgebra::DVector;

    /// A single joint that is damped at a rate.
    fn damped_joint(rate_1_s: f64, delay_ticks: f64) -> SampledLoop {
        let one = |value: f64| DMatrix::from_element(1, 1, value);
        let inertia = 3e-4;
        let situation = Situation {
            motions: SmallMotions {
                inertia: one(inertia),
                damping: one(0.0),
                stiffness: one(0.0),
                joints: one(1.0),
            },
            stiffness_nm_rad: one(0.0),
            damping_nm_s_rad: one(-rate_1_s * inertia),
            gains_nm_s_rad: DVector::from_element(1, rate_1_s * inertia),
            inertias_kg_m2: vec![inertia],
        };
        SampledLoop { situations: vec![situation], period_s: 1e-3, delay_ticks, bandwidth_hz: None }
    }

    /// With `g = r T`, the speed of the joint follows `v' = v - g ((1 - f) v_n + f v_(n+1))`, `n` and `n + 1` ticks ago: stable up to
    /// g = 2, 2, 1 and (sqrt(5) - 1) / 2 for delays of 0, 1/2, 1 and 2 ticks, by Jury's criterion.
    #[test]
    fn a_damped_joint_is_stable_up_to_what_theory_says() {
        for (delay_ticks, limit) in
            [(0.0, 2.0), (0.5, 2.0), (1.0, 1.0), (2.0, (Real::square_root(5.0_f64) - 1.0) / 2.0)]
        {
            assert!(damped_joint(0.999e3 * limit, delay_ticks).is_stable(), "{delay_ticks}");
            assert!(!damped_joint(1.001e3 * limit, delay_ticks).is_stable(), "{delay_ticks}");
        }
        // From one tick on: the margin is where g = 0.7 lies between 1 and 0.618.
        let margin = damped_joint(700.0, 1.0).delay_margin_ticks().expect("it is stable");
        assert!((0.5..1.0).contains(&margin), "{margin}");
        let slow = damped_joint(1.0, 0.0).modes();
        assert!(
            slow.len() == 1 && (slow[0].rate_1_s - 1.0).abs() < 1e-3 && slow[0].frequency_hz == 0.0,
            "{slow:?}"
        );
    }

    #[test]
    fn the_exponential_is_that_of_a_known_matrix() {
        // Of a rotation, far and near, and of a fast decay beside a slow one.
        for angle in [1e-3_f64, 1.0, 700.0] {
            let turned = exponential(&DMatrix::from_row_slice(2, 2, &[0.0, -angle, angle, 0.0]));
            let (sine, cosine) = Real::sine_cosine(angle);
            assert!((turned[(0, 0)] - cosine).abs() < 1e-11 && (turned[(1, 0)] - sine).abs() < 1e-11);
        }
        let fallen = exponential(&DMatrix::from_row_slice(2, 2, &[-1000.0, 0.0, 0.0, -1e-3]));
        assert!(
            fallen[(0, 0)].abs() < 1e-12 && (fallen[(1, 1)] - (-1e-3_f64).exp()).abs() < 1e-12,
            "{fallen}"
        );
    }
}
