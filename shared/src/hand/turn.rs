//! Rotations as unit quaternions: four numbers that are easy to keep, to compose and to make exact again.

use super::frame::{cross, dot};
use crate::math::Real;
use nalgebra::{Matrix3, Vector3};

/// A rotation in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn<T> {
    /// Cosine of half the angle.
    pub w: T,
    /// The axis, times the sine of half the angle.
    pub v: Vector3<T>,
}

impl<T: Real> Turn<T> {
    /// Returns no rotation.
    pub fn none() -> Self {
        Self { w: T::one(), v: Vector3::zeros() }
    }

    /// Returns the rotation by a rotation vector, rad.
    pub fn by(vector_rad: &Vector3<T>) -> Self {
        let angle = dot(vector_rad, vector_rad).square_root();
        let (sine, cosine) = (angle * T::from_f64(0.5)).sine_cosine();
        // Of a small angle, the sine is the angle.
        let per_angle = if angle > T::from_f64(1e-12) { sine / angle } else { T::from_f64(0.5) };
        Self { w: cosine, v: vector_rad * per_angle }
    }

    /// Returns this rotation followed by another: `other self`.
    #[must_use]
    pub fn then(&self, other: &Self) -> Self {
        let w = other.w * self.w - dot(&other.v, &self.v);
        Self { w, v: self.v * other.w + other.v * self.w + cross(&other.v, &self.v) }
    }

    /// Returns this rotation followed by a small one, rad, without a sine or a root: right up to the cube of the angle.
    #[must_use]
    pub fn nudged(&self, vector_rad: &Vector3<T>) -> Self {
        let half = vector_rad * T::from_f64(0.5);
        let turn = self.then(&Self { w: T::one(), v: half });
        // One over the root of a square near 1, by two steps of Newton's method: for a tenth of a radian right to 1e-13.
        let square = turn.w * turn.w + dot(&turn.v, &turn.v);
        let (three_halves, half_square) = (T::from_f64(1.5), square * T::from_f64(0.5));
        let nearly = three_halves - half_square;
        let per_length = nearly * (three_halves - half_square * nearly * nearly);
        Self { w: turn.w * per_length, v: turn.v * per_length }
    }

    /// Returns the rotation back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { w: self.w, v: -self.v }
    }

    /// Returns the shorter of the two quaternions of the same rotation: up to half a turn.
    #[must_use]
    pub fn shorter(&self) -> Self {
        if self.w < T::zero() { Self { w: -self.w, v: -self.v } } else { *self }
    }

    /// Returns a vector after the rotation.
    pub fn turn(&self, vector: &Vector3<T>) -> Vector3<T> {
        let across = cross(&self.v, vector) * T::from_i32(2);
        vector + across * self.w + cross(&self.v, &across)
    }

    /// Returns the rotation of a matrix, right up to where half a turn is near.
    pub fn of(matrix: &Matrix3<T>) -> Self {
        let w = (T::one() + matrix.m11 + matrix.m22 + matrix.m33).limited(T::from_f64(1e-6), T::from_i32(4));
        let w = w.square_root() * T::from_f64(0.5);
        let axial = Vector3::new(matrix.m32 - matrix.m23, matrix.m13 - matrix.m31, matrix.m21 - matrix.m12);
        Self { w, v: axial * (T::from_f64(0.25) / w) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: &Vector3<f64>, b: &Vector3<f64>, by: f64) {
        assert!((a - b).norm() < by, "{a} {b}");
    }

    #[test]
    fn rotations_turn_vectors_and_compose() {
        let (a, b) = (Vector3::new(0.3, -0.8, 0.5), Vector3::new(-1.1, 0.2, 0.4));
        let (first, second) = (Turn::by(&a), Turn::by(&b));
        let vector = Vector3::new(1.0, 2.0, -0.5);
        let exact = |turn: &Vector3<f64>, vector: Vector3<f64>| nalgebra::Rotation3::new(*turn) * vector;
        near(&first.turn(&vector), &exact(&a, vector), 1e-14);
        near(&first.then(&second).turn(&vector), &exact(&b, exact(&a, vector)), 1e-14);
        near(&first.inverse().turn(&first.turn(&vector)), &vector, 1e-14);
        near(&Turn::of(nalgebra::Rotation3::new(a).matrix()).v, &first.v, 1e-14);
        assert_eq!(Turn::by(&Vector3::<f64>::zeros()), Turn::none());
    }

    #[test]
    fn a_nudge_is_a_small_rotation() {
        let (turn, nudge) = (Turn::by(&Vector3::new(0.3, -0.8, 0.5)), Vector3::new(1e-3, 2e-3, -1e-3));
        let (nudged, exact) = (turn.nudged(&nudge), turn.then(&Turn::by(&nudge)));
        near(&nudged.v, &exact.v, 1e-8);
        assert!((nudged.w * nudged.w + nudged.v.norm_squared() - 1.0).abs() < 1e-15);
    }
}
