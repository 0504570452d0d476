//! The earlier law, of the paper's references 14 and 15 (Tahara et al.): where the paper's law has `u_st`, it has a
//! compensation by the time integral of each joint's velocity,
//!
//! ```text
//! u_I = -K_I * integral of dq/dt since the grasp began = -K_I (q - q(t0))
//! ```
//!
//! and is computed as what it equals: a spring at each joint, at rest where the joint was when the latch closed, so
//! that nothing has to be summed up and nothing drifts. It is the negative gradient of `V_I = K_I/2 |q - q(t0)|^2`.
//!
//! It is here so that the two can be compared: `K_st = 0` with `K_I > 0` is the earlier law. Like `u_st` it holds
//! fingertips that would roll. Unlike `u_s` and `u_st` it is no set of forces and moments between fingertips:
//! - what it does depends on how far each joint has turned, and so on the way that the grasp took, not on how the
//!   fingertips stand to each other;
//! - what the fingers' joints put on an object need not sum to zero, and joints that carry all fingers pull the hand back
//!   to where it grasped: an arm feels it, and it disturbs whoever moves the object.
//!
//! The paper names this law without printing it (Secs. 1 and 3). One gain serves all joints.

use super::{Effect, Gain, Law, LawsConfig, Ramp, Signal, Stance};
use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::hand::{Hand, Posture};
use crate::math::Real;
use core::marker::PhantomData;

/// `K_I`.
pub const GAINS: [Gain; 1] = [Gain {
    key: "integral_gain_nm_rad",
    unit: "N m/rad",
    words: "Gain K_I of the earlier law's integral of each joint's velocity; zero leaves it out",
    may_be_zero: true,
    ramp: Ramp::Stiffness,
    potential: Signal {
        key: "integral_potential_j",
        unit: "J",
        words: "Potential V_I of the joints' turns since the grasp began",
    },
}];

/// None but its potential.
pub const SIGNALS: [Signal; 0] = [];

/// The joint angles when the grasp began, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latch<T, const J: usize, const F: usize> {
    angles_rad: [T; J],
}

impl<const J: usize, const F: usize> Latch<f32, J, F> {
    pub(super) fn save(
        &self,
        joints: usize,
        _fingertips: usize,
        to: &mut Saver<'_>,
    ) -> Result<(), BufferTooSmall> {
        to.f32s(&self.angles_rad, joints)
    }

    pub(super) fn load(
        joints: usize,
        _fingertips: usize,
        from: &mut Loader<'_>,
    ) -> Result<Self, SnapshotError> {
        let mut angles_rad = [0.0; J];
        from.f32s(&mut angles_rad, joints)?;
        Ok(Self { angles_rad })
    }
}

/// The law, which needs to know nothing of the hand beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegralLaw<T>(PhantomData<T>);

impl<T: Real, const J: usize, const F: usize> Law<T, J, F, 1, 0> for IntegralLaw<T> {
    type Latch = Latch<T, J, F>;

    fn prepare(_hand: &Hand<T, J, F>, _config: &LawsConfig<T, J>) -> Self {
        Self(PhantomData)
    }

    fn latch(_hand: &Hand<T, J, F>, _posture: &Posture<T, J, F>, angles_rad: &[T; J]) -> Latch<T, J, F> {
        Latch { angles_rad: *angles_rad }
    }

    fn torques(
        &self,
        stance: &Stance<'_, T, J, F>,
        latch: &Latch<T, J, F>,
        &[gain_nm_rad]: &[T; 1],
        torques_nm: &mut [T; J],
    ) -> Effect<T, 1, 0> {
        let mut squares = T::zero();
        for ((torque, angle), latched) in torques_nm.iter_mut().zip(stance.angles_rad).zip(&latch.angles_rad)
        {
            let turned = *angle - *latched;
            *torque -= gain_nm_rad * turned;
            squares += turned * turned;
        }
        Effect::of_springs([squares * gain_nm_rad * T::from_f64(0.5)])
    }
}
