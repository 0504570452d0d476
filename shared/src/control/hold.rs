//! What acts whenever the hand has torque, with a grasp or without: the damping `-C dq` and the weight of the links `g(q)`
//! (the parts of Eq. 29 that no law has for its own).

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

    /// Returns the torques of the damping, N m.
    pub(super) fn damping_nm(&self, speeds_rad_s: &[T; J]) -> [T; J] {
        core::array::from_fn(|k| -(self.damping_nm_s[k] * speeds_rad_s[k]))
    }

    /// Returns the power that the damping takes, `dq^T C dq`, W.
    pub fn damping_power_w(&self, speeds_rad_s: &[T; J]) -> T {
        let joints = self.damping_nm_s.iter().zip(speeds_rad_s);
        joints.fold(T::zero(), |sum, (damping, speed)| sum + *damping * *speed * *speed)
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
