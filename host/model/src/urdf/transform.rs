//! The pose of one frame in another, and its angles.

use super::super::hand::rotation;
use nalgebra::{Matrix3, Vector3};

/// A rigid transform: from the coordinates of a frame to those of the frame that it is given in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    /// Axes of the frame, as columns.
    pub(super) attitude: Matrix3<f64>,
    /// Its origin, m.
    pub(super) offset_m: Vector3<f64>,
}

impl Transform {
    pub(super) fn identity() -> Self {
        Self { attitude: Matrix3::identity(), offset_m: Vector3::zeros() }
    }

    /// From an offset, and roll, pitch and yaw about fixed axes.
    pub(super) fn new(offset_m: [f64; 3], rpy_rad: [f64; 3]) -> Self {
        Self { attitude: matrix(rpy_rad), offset_m: offset_m.into() }
    }

    /// A frame that is given in this one.
    pub(super) fn then(&self, inner: &Self) -> Self {
        Self { attitude: self.attitude * inner.attitude, offset_m: self.point(&inner.offset_m) }
    }

    /// A point.
    pub(super) fn point(&self, inner_m: &Vector3<f64>) -> Vector3<f64> {
        self.offset_m + self.attitude * inner_m
    }
}

/// The rotation matrix of roll, pitch and yaw about fixed axes.
pub(super) fn matrix(rpy_rad: [f64; 3]) -> Matrix3<f64> {
    rotation(rpy_rad).to_rotation_matrix().into_inner()
}

/// Roll, pitch and yaw about fixed axes of a rotation.
///
/// Near a pitch of a right angle roll and yaw are not unique, and both come from entries that are little but rounding.
/// Whatever the yaw, the rotation that is left after it is taken back has a well-conditioned pitch and roll.
pub(super) fn roll_pitch_yaw(m: &Matrix3<f64>) -> [f64; 3] {
    // Not of the standard library, whose last bit differs between machines: firmware is built from these numbers.
    let yaw = libm::atan2(m.m21, m.m11);
    let (sine, cosine) = libm::sincos(yaw);
    let pitch = libm::atan2(-m.m31, cosine * m.m11 + sine * m.m21);
    let roll = libm::atan2(sine * m.m13 - cosine * m.m23, cosine * m.m22 - sine * m.m12);
    [roll, pitch, yaw]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Tolerance: a rotation has entries of at most one; some twenty roundings of 1.1e-16 in the angles, the quaternion and
    /// the matrix.
    #[test]
    fn angles_give_back_the_rotation_also_in_gimbal_lock() {
        let mut worst: f64 = 0.0;
        let special = [
            0.0,
            FRAC_PI_2,
            -FRAC_PI_2,
            PI,
            FRAC_PI_2 - 1e-9,
            1e-12 - FRAC_PI_2,
            FRAC_PI_2 + 1e-5,
            0.3,
            -2.0,
        ];
        for roll in special {
            for pitch in special {
                for yaw in special {
                    let m = matrix([roll, pitch, yaw]);
                    worst = worst.max((matrix(roll_pitch_yaw(&m)) - m).amax());
                }
            }
        }
        assert!(worst < 3e-15, "{worst:e}");
    }
}
