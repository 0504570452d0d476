//! Joints that follow a path to a posture, and hold it.
//!
//! ```text
//! u = J (ddq_d + 2 w (dq_d - dq) + w^2 (q_d - q)) + s
//! ```
//!
//! `J` is what a joint feels with the others free, `w` the bandwidth. `s` is the integral of the error, bounded: what overcomes the
//! friction of the joints.

use super::Followed;
use super::path::Path;
use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::estimate::Motion;
use crate::math::Real;
use crate::parameter::ParameterError;
use crate::period::Period;

/// Numbers of moving, as a user gives them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingConfig<const J: usize> {
    /// Inertia that each joint feels with the others free, `1 / (M^-1)_kk` and the rotor's, kg m^2.
    pub inertia_kg_m2: [f32; J],
    /// Bandwidth, rad/s.
    pub bandwidth_rad_s: f32,
    /// Largest speed of a joint on its path, rad/s.
    pub speed_rad_s: f32,
    /// Most that the integral of the error may become, N m.
    pub integral_nm: f32,
}

impl<const J: usize> MovingConfig<J> {
    /// No torque, and no speed.
    pub const LEAST: Self =
        Self { inertia_kg_m2: [0.0; J], bandwidth_rad_s: 0.0, speed_rad_s: 0.0, integral_nm: 0.0 };

    pub(super) fn check(&self, joint_count: usize) -> Result<(), ParameterError> {
        let fails = |parameter: &'static str, joint| {
            let reason = "has to be zero or positive";
            Err(ParameterError { parameter: parameter.into(), joint, reason })
        };
        let is_good = |value: f32| value >= 0.0 && value.is_finite();
        if let Some(joint) =
            self.inertia_kg_m2.iter().take(joint_count).position(|&inertia| !is_good(inertia))
        {
            return fails("moving.inertia_kg_m2", Some(joint));
        }
        if !is_good(self.bandwidth_rad_s) {
            return fails("moving.bandwidth_rad_s", None);
        }
        if !is_good(self.speed_rad_s) {
            return fails("moving.speed_rad_s", None);
        }
        if !is_good(self.integral_nm) {
            return fails("moving.integral_nm", None);
        }
        Ok(())
    }
}

/// Share of the error, per radian of bandwidth, that goes into the integral: the third pole is at a fifth of the bandwidth.
const INTEGRAL_SHARE: f32 = 0.2;

/// A path to a posture, and what holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moving<const J: usize> {
    pub(crate) path: Path<J>,
    integral_nm: [f32; J],
}

impl<const J: usize> Moving<J> {
    /// At rest there.
    pub(crate) const fn resting(angles_rad: [f32; J]) -> Self {
        Self { path: Path::resting(angles_rad), integral_nm: [0.0; J] }
    }

    /// Adds the torques of some of the joints, N m, at the place of this tick. Returns the energy of what follows.
    pub(crate) fn torques(
        &mut self,
        config: &MovingConfig<J>,
        period: Period,
        motion: &Motion<J>,
        is_moved: impl Fn(usize) -> bool,
        torques_nm: &mut [f32; J],
    ) -> Followed {
        let mut followed = Followed::NOTHING;
        let place = self.path.place();
        let period_s = period.seconds();
        let per_s = 1_000_000.0 / period.microseconds() as f32;
        let w = config.bandwidth_rad_s;
        let most = config.integral_nm;
        for k in 0..J {
            if !is_moved(k) {
                continue;
            }
            let inertia = config.inertia_kg_m2[k];
            let error = place.value[k] - motion.angles_rad[k];
            let slow = place.per_tick[k] * per_s - motion.speeds_rad_s[k];
            let acceleration = place.per_tick2[k] * per_s * per_s;
            let integral = self.integral_nm[k] + inertia * w * w * w * INTEGRAL_SHARE * period_s * error;
            self.integral_nm[k] = integral.limited(-most, most);
            let torque = inertia * (acceleration + w * (2.0 * slow + w * error)) + self.integral_nm[k];
            torques_nm[k] += torque;
            followed.potential_j += 0.5 * inertia * w * w * error * error;
            followed.fed_j += torque * place.per_tick[k];
        }
        followed
    }

    pub(crate) fn save(&self, joints: usize, to: &mut Saver<'_>) -> Result<(), BufferTooSmall> {
        self.path.save(joints, to)?;
        to.f32s(&self.integral_nm, joints)
    }

    pub(crate) fn load(joints: usize, from: &mut Loader<'_>) -> Result<Self, SnapshotError> {
        let mut moving = Self { path: Path::load(joints, from)?, integral_nm: [0.0; J] };
        from.f32s(&mut moving.integral_nm, joints)?;
        Ok(moving)
    }
}
