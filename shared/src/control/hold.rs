//! The torques that act whenever the hand has torque, with a grasp or without: the damping `-C dq` and the weight of
//! the links `g(q)` (the parts of Eq. 29 that no law has for its own).

use crate::hand::{Hand, Posture};
use crate::math::Real;
use crate::parameter::ParameterError;
use nalgebra::Vector3;

/// Damping and weight, as a user gives them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold<T, const J: usize> {
    /// Damping `C` of each joint, N m s/rad.
    pub damping_nm_s: [T; J],
    /// Gravity in the base frame, m/s^2; `None` leaves the weight of the links uncompensated.
    pub gravity_m_s2: Option<Vector3<T>>,
}

impl<T: Real, const J: usize> Hold<T, J> {
    /// Checks the numbers.
    ///
    /// # Errors
    /// The first that is not finite, or a negative damping.
    pub(super) fn check(&self, joint_count: usize) -> Result<(), ParameterError> {
        let mut damping = self.damping_nm_s.iter().take(joint_count);
        if let Some(joint) = damping.position(|&c| !(c >= T::zero() && c.is_finite())) {
            let reason = "has to be zero or positive";
            return Err(ParameterError { parameter: "damping_nm_s".into(), joint: Some(joint), reason });
        }
        if self.gravity_m_s2.is_some_and(|g| !g.iter().all(|v| v.is_finite())) {
            let reason = "has to be finite";
            return Err(ParameterError { parameter: "gravity_m_s2".into(), joint: None, reason });
        }
        Ok(())
    }

    /// Sets the torques to those of the damping, N m. Returns the power that it takes, `dq^T C dq`, W.
    // Not inlined: the compiler would do half of it at the end, and keep all speeds for that.
    #[inline(never)]
    pub(super) fn damp(&self, speeds_rad_s: &[T; J], torques_nm: &mut [T; J]) -> T {
        let mut power_w = T::zero();
        for ((torque, damping), speed) in torques_nm.iter_mut().zip(&self.damping_nm_s).zip(speeds_rad_s) {
            *torque = -(*damping * *speed);
            power_w -= *torque * *speed;
        }
        power_w
    }

    /// Adds what holds the links' weight to the torques, N m. Returns the potential energy of that weight above some
    /// level, J; zero where it is not held.
    pub(super) fn hold_weight<const F: usize>(
        &self,
        hand: &Hand<T, J, F>,
        posture: &Posture<T, J, F>,
        torques_nm: &mut [T; J],
    ) -> T {
        match &self.gravity_m_s2 {
            Some(gravity) => hand.hold_weight(posture, gravity, torques_nm),
            None => T::zero(),
        }
    }
}
