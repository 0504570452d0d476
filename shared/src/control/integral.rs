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

use crate::math::Real;

/// Adds `u_I` to the torques, N m. Returns `V_I`, J.
pub(super) fn pull_back<T: Real, const J: usize>(
    gain_nm_rad: T,
    latched_rad: &[T; J],
    angles_rad: &[T; J],
    torques_nm: &mut [T; J],
) -> T {
    let mut squares = T::zero();
    for ((torque, angle), latched) in torques_nm.iter_mut().zip(angles_rad).zip(latched_rad) {
        let turned = *angle - *latched;
        *torque -= gain_nm_rad * turned;
        squares += turned * turned;
    }
    squares * gain_nm_rad * T::from_f64(0.5)
}
