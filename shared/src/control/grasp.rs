//! The grasp law `u_s + u_st` (Eqs. 29-34, with the desired attitudes of Eq. 59).
//!
//! - `u_s` (Eq. 30) draws the fingertip centres together: each is pulled towards their **centroid** like by a spring. It
//!   presses the fingertips against whatever is between them. Its damping and the weight of the links are in
//!   [`hold`](super::hold).
//! - `u_st` (Eq. 32) holds the fingertips' **relative attitudes** as they were when the grasp began (the **latch**).
//!   A fingertip can't roll on a face without turning against its neighbours, so this supplies the tangential forces
//!   that the normal forces of `u_s` lack.
//!
//! Neither knows the object. Each is the negative gradient of a potential (Eqs. 43 and 44). The forces and moments
//! that `u_s` and `u_st` put on the fingertips sum to zero, so that a trunk feels neither.
//!
//! How it is computed, and where that departs from the print:
//! - With `D_i = R_fi R_fi,ini^T`, the turn of fingertip `i` since the latch, the sum of three cross products in Eq. 32
//!   is the axial vector of `D_i D_j^T`. The law needs no fingertip frame of its own, only how it turns.
//! - The fingertips are a ring: the neighbours `i - 1` and `i + 1` of the print are taken modulo `N`. Each pair of
//!   neighbours is computed once, since what it does to one fingertip it does to the other with the opposite sign.
//!   Two fingertips are neighbours twice, as the print's sum has it.
//! - The moment between two fingertips of a relative turn `a` is `2 K_st sin a`, as it is printed, or, where
//!   [`AttitudeError::HalfAngle`] is chosen, `4 K_st sin(a/2)`: the same at small turns.
//! - `V_st` has the constant `3 N K_st` added, so that it is zero at the latch and never negative: the energy is then
//!   bounded for every `K_st`, and the condition of Eq. 49 is a sizing rule only.

use super::{Effect, Gain, Law, LawsConfig, Ramp, Signal, Stance};
use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::hand::frame::{dot, product_transposed};
use crate::hand::{Hand, Posture, Wrench};
use crate::math::Real;
use core::fmt;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Deserializer, Serialize, de};

/// `f_d` and `K_st`.
pub const GAINS: [Gain; 2] = [
    Gain {
        key: "force_n",
        unit: "N",
        words: "Nominal grasping force f_d; that of a fingertip (Eq. 57) grows with the object's size",
        may_be_zero: false,
        ramp: Ramp::Force,
        potential: Signal {
            key: "approach_potential_j",
            unit: "J",
            words: "Potential V_s of the approach (Eq. 43)",
        },
    },
    Gain {
        key: "attitude_stiffness_nm",
        unit: "N m",
        words: "Stiffness K_st of the relative attitudes; zero grasps by normal forces alone",
        may_be_zero: true,
        ramp: Ramp::Stiffness,
        potential: Signal {
            key: "attitude_potential_j",
            unit: "J",
            words: "Potential V_st of the relative attitudes (Eq. 44), above its least value",
        },
    },
];

/// None but its potentials.
pub const SIGNALS: [Signal; 0] = [];

/// The form in which the relative turn of two neighbouring fingertips is an error, which `K_st` times makes the moment between
/// them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AttitudeError {
    /// `2 sin a`, the axial vector of the relative turn, of the potential `2 (1 - cos a)`: the paper's (Eqs. 32 and 44).
    /// It is largest at 90 degrees; beyond, the moment falls, and there is no more that could hold the fingertips.
    #[default]
    Sine,
    /// `4 sin(a/2)`, four times the vector part of the relative turn's unit quaternion, of the potential
    /// `8 (1 - cos(a/2))`. It grows up to 180 degrees, to twice what the sine has.
    HalfAngle,
}

impl<'de> Deserialize<'de> for AttitudeError {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Word;
        impl de::Visitor<'_> for Word {
            type Value = AttitudeError;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"sine\" or \"half-angle\"")
            }

            fn visit_str<E: de::Error>(self, word: &str) -> Result<AttitudeError, E> {
                match word {
                    "sine" => Ok(AttitudeError::Sine),
                    "half-angle" => Ok(AttitudeError::HalfAngle),
                    _ => Err(E::invalid_value(de::Unexpected::Str(word), &self)),
                }
            }
        }
        deserializer.deserialize_str(Word)
    }
}

/// The square of the smallest `cos(a/2)` that is divided by. Beyond the turn that has it, 1.1 degrees short of 180, where the
/// axis is lost in rounding, the moment falls to zero in proportion to `cos(a/2)`, and so has a potential there too.
const LEAST_COSINE_SQUARED: f64 = 1e-4;

/// Returns the error `2 sin a` and its potential, both for a stiffness of one, of a relative turn that is given by the axial
/// vector and the trace of its matrix.
fn sine<T: Real>(axial: Vector3<T>, trace: T) -> (Vector3<T>, T) {
    (axial, T::from_i32(3) - trace)
}

/// Returns the same of the error `4 sin(a/2)`.
fn half_angle<T: Real>(axial: Vector3<T>, trace: T) -> (Vector3<T>, T) {
    // cos(a/2), as 1 + trace = 4 cos(a/2)^2; with the bound below it, both formulas are those of either side.
    let squared = (T::one() + trace) * T::from_f64(0.25);
    let least = T::from_f64(LEAST_COSINE_SQUARED);
    let cosine = if squared > least { squared } else { least }.square_root();
    let per_cosine = T::one() / cosine;
    let missing = T::from_i32(2) - cosine - squared * per_cosine;
    (axial * per_cosine, missing * T::from_i32(4))
}

/// The attitudes of the fingertips when the grasp began, `R_fi,ini` (Eq. 59).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latch<T, const J: usize, const F: usize> {
    pub(crate) attitudes: [Matrix3<T>; F],
}

impl<const J: usize, const F: usize> Latch<f32, J, F> {
    pub(super) fn save(
        &self,
        _joints: usize,
        fingertips: usize,
        to: &mut Saver<'_>,
    ) -> Result<(), BufferTooSmall> {
        self.attitudes.iter().take(fingertips).try_for_each(|attitude| to.f32s(attitude.as_slice(), 9))
    }

    pub(super) fn load(
        _joints: usize,
        fingertips: usize,
        from: &mut Loader<'_>,
    ) -> Result<Self, SnapshotError> {
        let mut attitudes = [Matrix3::identity(); F];
        attitudes
            .iter_mut()
            .take(fingertips)
            .try_for_each(|attitude| from.f32s(attitude.as_mut_slice(), 9))?;
        Ok(Self { attitudes })
    }
}

/// The grasp law, prepared for one hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspLaw<T> {
    /// One over the sum of the fingertips' radii, 1/m.
    per_radii_1_m: T,
    share_of_one: T,
    attitude_error: AttitudeError,
}

impl<T: Real, const J: usize, const F: usize> Law<T, J, F, 2, 0> for GraspLaw<T> {
    type Latch = Latch<T, J, F>;

    fn prepare(hand: &Hand<T, J, F>, config: &LawsConfig<T, J>) -> Self {
        let radii = (0..hand.fingertip_count()).fold(T::zero(), |sum, i| sum + hand.radius_m(i));
        Self {
            per_radii_1_m: T::one() / radii,
            share_of_one: T::one() / T::from_i32(hand.fingertip_count() as i32),
            attitude_error: config.attitude_error,
        }
    }

    fn latch(_hand: &Hand<T, J, F>, posture: &Posture<T, J, F>, _angles_rad: &[T; J]) -> Latch<T, J, F> {
        Latch { attitudes: posture.attitudes }
    }

    // Not inlined: with all that surrounds it, the compiler would run out of registers.
    #[inline(never)]
    fn torques(
        &self,
        stance: &Stance<'_, T, J, F>,
        latch: &Latch<T, J, F>,
        &[force_n, attitude_stiffness_nm]: &[T; 2],
        torques_nm: &mut [T; J],
    ) -> Effect<T, 2, 0> {
        let &Stance { hand, posture, .. } = stance;
        let (moments_nm, attitude_potential_j) = if attitude_stiffness_nm > T::zero() {
            self.hold_attitudes(hand, posture, latch, attitude_stiffness_nm)
        } else {
            ([Vector3::zeros(); F], T::zero())
        };
        let stiffness = self.approach_stiffness_n_m(force_n);
        let centroid = self.centroid_m(hand, posture);
        let mut squares = T::zero();
        let fingertips = hand.prepared_fingertips().iter().zip(&posture.centres_m);
        for ((fingertip, centre), moment_nm) in fingertips.zip(moments_nm) {
            let away = centroid - centre;
            squares += dot(&away, &away);
            let wrench = Wrench { force_n: away * stiffness, moment_nm };
            hand.push(posture, fingertip.link, centre, &wrench, torques_nm);
        }
        let approach_potential_j = squares * stiffness * T::from_f64(0.5);
        Effect::of_springs([approach_potential_j, attitude_potential_j])
    }
}

impl<T: Real> GraspLaw<T> {
    /// Returns `A = f_d / sum(r_i)` (Eq. 38), N/m.
    pub fn approach_stiffness_n_m(&self, force_n: T) -> T {
        force_n * self.per_radii_1_m
    }

    /// Returns the wrenches of `u_s`, as if the law knew the fingertips' centres only: `A (x_c - x_i)` (Eq. 30).
    pub fn approach_wrenches<const J: usize, const F: usize>(
        &self,
        hand: &Hand<T, J, F>,
        posture: &Posture<T, J, F>,
        force_n: T,
    ) -> [Wrench<T>; F] {
        let mut wrenches = [Wrench::zero(); F];
        let (stiffness, centroid) = (self.approach_stiffness_n_m(force_n), self.centroid_m(hand, posture));
        for (wrench, centre) in wrenches.iter_mut().zip(&posture.centres_m).take(hand.fingertip_count()) {
            wrench.force_n = (centroid - centre) * stiffness;
        }
        wrenches
    }

    /// Returns the wrenches of `u_st`: `K_st B_sti` (Eq. 38).
    pub fn attitude_wrenches<const J: usize, const F: usize>(
        &self,
        hand: &Hand<T, J, F>,
        posture: &Posture<T, J, F>,
        latch: &Latch<T, J, F>,
        stiffness_nm: T,
    ) -> [Wrench<T>; F] {
        let (moments_nm, _) = self.hold_attitudes(hand, posture, latch, stiffness_nm);
        moments_nm.map(|moment_nm| Wrench { force_n: Vector3::zeros(), moment_nm })
    }

    /// Returns the centroid of the fingertips' centres (Eq. 31), m. The potential of Eq. 43 is `A / 2` times the sum of the
    /// squares of what leads there from each.
    fn centroid_m<const J: usize, const F: usize>(
        &self,
        hand: &Hand<T, J, F>,
        posture: &Posture<T, J, F>,
    ) -> Vector3<T> {
        let centres = posture.centres_m.iter().take(hand.fingertip_count());
        centres.fold(Vector3::zeros(), |sum, centre| sum + centre) * self.share_of_one
    }

    /// Returns the moments that hold the relative attitudes (Eq. 32), N m, and their potential (Eq. 44, above its least
    /// value), J.
    fn hold_attitudes<const J: usize, const F: usize>(
        &self,
        hand: &Hand<T, J, F>,
        posture: &Posture<T, J, F>,
        latch: &Latch<T, J, F>,
        stiffness_nm: T,
    ) -> ([Vector3<T>; F], T) {
        match self.attitude_error {
            AttitudeError::Sine => hold_attitudes(hand, posture, latch, stiffness_nm, sine),
            AttitudeError::HalfAngle => hold_half_angles(hand, posture, latch, stiffness_nm),
        }
    }
}

// Not inlined: the paper's form beside it would pay for it.
#[inline(never)]
fn hold_half_angles<T: Real, const J: usize, const F: usize>(
    hand: &Hand<T, J, F>,
    posture: &Posture<T, J, F>,
    latch: &Latch<T, J, F>,
    stiffness_nm: T,
) -> ([Vector3<T>; F], T) {
    hold_attitudes(hand, posture, latch, stiffness_nm, half_angle)
}

/// The same with one form of the attitude error, so that the form is not asked for with each pair.
#[inline(always)]
fn hold_attitudes<T: Real, const J: usize, const F: usize>(
    hand: &Hand<T, J, F>,
    posture: &Posture<T, J, F>,
    latch: &Latch<T, J, F>,
    stiffness_nm: T,
    error_of: impl Fn(Vector3<T>, T) -> (Vector3<T>, T),
) -> ([Vector3<T>; F], T) {
    // How far each fingertip turned since the latch, D_i.
    let turns: [Matrix3<T>; F] =
        core::array::from_fn(|i| product_transposed(&posture.attitudes[i], &latch.attitudes[i]));
    let mut potentials = T::zero();
    // What one fingertip feels from its neighbour; the neighbour feels the opposite.
    let mut pull = |from: &Matrix3<T>, towards: &Matrix3<T>| {
        let (axial, trace) = axial_and_trace(from, towards);
        let (error, potential) = error_of(axial, trace);
        potentials += potential;
        error * stiffness_nm
    };
    let count = hand.fingertip_count();
    let around = match (turns.first(), turns.get(count.wrapping_sub(1))) {
        (Some(first), Some(last)) => pull(last, first),
        _ => Vector3::zeros(),
    };
    let mut behind = around;
    let moments_nm = core::array::from_fn(|i| {
        if i >= count {
            return Vector3::zeros();
        }
        let ahead = match turns.get(i + 1) {
            Some(next) if i + 1 < count => pull(&turns[i], next),
            _ => around,
        };
        let moment = ahead - behind;
        behind = ahead;
        moment
    });
    (moments_nm, potentials * stiffness_nm)
}

/// Axial vector and trace of `a b^T`: the sum of the cross products of the columns of `a` with those of `b`, and the
/// sum of their dot products. Only the entries that these need are formed.
// Inlined: called by both forms of the attitude error, it would not be otherwise.
#[inline(always)]
fn axial_and_trace<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> (Vector3<T>, T) {
    let entry = |row: usize, column: usize| {
        a[(row, 0)] * b[(column, 0)] + a[(row, 1)] * b[(column, 1)] + a[(row, 2)] * b[(column, 2)]
    };
    let axial = Vector3::new(entry(1, 2) - entry(2, 1), entry(2, 0) - entry(0, 2), entry(0, 1) - entry(1, 0));
    (axial, entry(0, 0) + entry(1, 1) + entry(2, 2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::norm;

    /// Matrix of a turn about an axis of length one, rounded.
    fn turn(axis: Vector3<f64>, angle_rad: f64) -> Matrix3<f32> {
        let (sine, cosine) = angle_rad.sine_cosine();
        let exact = Matrix3::identity() * cosine
            + axis.cross_matrix() * sine
            + axis * axis.transpose() * (1.0 - cosine);
        exact.map(|entry| entry as f32)
    }

    /// In single precision, about any axis, up to half a turn and beyond: no number that is none, no more than there may be, and
    /// what it is to be up to a degree of half a turn.
    ///
    /// Tolerances: the trace is a sum of nine products of entries that are rounded to 6e-8, twice: it is off by up to 1e-6;
    /// where `cos(a/2)` is 0.01, `1 + trace` is 4e-4, so that the cosine is off by 0.13 %, and the error of 4 by 5e-3.
    #[test]
    fn half_angles_are_finite_and_bounded_at_half_a_turn() {
        let (mut largest, mut off) = (0.0_f32, 0.0_f64);
        let mut axes =
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.6, 0.0, 0.8], [0.48, -0.6, 0.64], [-0.36, 0.48, -0.8]]
                .map(Vector3::from);
        axes[4].normalize_mut();
        for axis in axes {
            for k in 0..=40_000_i32 {
                // From 0 to 200 degrees, more densely around 180.
                let degrees =
                    if k < 20_000 { f64::from(k) * 1e-2 } else { 180.0 + f64::from(k - 30_000) * 1e-4 };
                let angle_rad = degrees.to_radians();
                // The second turn goes on from the first, as fingertips do that have turned together.
                let first = turn(Vector3::new(0.0, 0.8, 0.6), 1.0);
                let second = turn(axis, angle_rad) * first;
                let (axial, trace) = axial_and_trace(&first, &second);
                let (error, potential) = half_angle(axial, trace);
                assert!(error.iter().all(|entry| entry.is_finite()), "{degrees}: {error}");
                assert!((-1e-5..8.0 + 1e-5).contains(&potential), "{degrees}: {potential}");
                let size = norm(&error);
                largest = largest.max(size);
                if degrees < 178.85 {
                    let (sine, _) = (0.5 * angle_rad).sine_cosine();
                    off = off.max((f64::from(size) - 4.0 * sine).abs());
                }
            }
        }
        std::println!("largest {largest}; off by {off:e} up to 178.85 degrees");
        assert!(largest < 4.0 + 5e-3, "{largest}");
        assert!(off < 5e-3, "{off}");
        // Exactly half a turn, and entries that have been rounded to more than that.
        for trace in [-1.0_f32, -1.000_000_4] {
            let (error, potential) = half_angle(Vector3::new(3e-8, 0.0, -6e-8), trace);
            assert!(norm(&error) < 1e-5 && (potential - 7.96).abs() < 1e-3, "{error} {potential}");
        }
    }
}
