//! Products of rotations and vectors, written out. nalgebra's own go through its general product, which for matrices of
//! this size costs several times their arithmetic; this is the inner loop of the tick.

use super::model::Bend;
use crate::math::Real;
use nalgebra::{Matrix3, Vector3};

/// `m v`.
#[inline]
pub(crate) fn turn_vector<T: Real>(m: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        m.m11 * v.x + m.m12 * v.y + m.m13 * v.z,
        m.m21 * v.x + m.m22 * v.y + m.m23 * v.z,
        m.m31 * v.x + m.m32 * v.y + m.m33 * v.z,
    )
}

/// `a b`.
#[inline]
pub(crate) fn product<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    let row = |x: T, y: T, z: T| {
        [
            x * b.m11 + y * b.m21 + z * b.m31,
            x * b.m12 + y * b.m22 + z * b.m32,
            x * b.m13 + y * b.m23 + z * b.m33,
        ]
    };
    let [r1, r2, r3] = [row(a.m11, a.m12, a.m13), row(a.m21, a.m22, a.m23), row(a.m31, a.m32, a.m33)];
    Matrix3::new(r1[0], r1[1], r1[2], r2[0], r2[1], r2[2], r3[0], r3[1], r3[2])
}

/// `a b^T`.
#[inline]
pub(crate) fn product_transposed<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    product(a, &Matrix3::new(b.m11, b.m21, b.m31, b.m12, b.m22, b.m32, b.m13, b.m23, b.m33))
}

/// A frame after a turn about its own z axis, given the sine and cosine of its angle.
#[inline]
pub(crate) fn turn_about_z<T: Real>(f: &Matrix3<T>, sine: T, cosine: T) -> Matrix3<T> {
    let x = |x: T, y: T| x * cosine + y * sine;
    let y = |x: T, y: T| y * cosine - x * sine;
    Matrix3::new(
        x(f.m11, f.m12),
        y(f.m11, f.m12),
        f.m13,
        x(f.m21, f.m22),
        y(f.m21, f.m22),
        f.m23,
        x(f.m31, f.m32),
        y(f.m31, f.m32),
        f.m33,
    )
}

impl<T: Real> Bend<T> {
    /// The bend from the axes of the parent's chain, against which the parent's link is turned by an angle of this sine
    /// and cosine.
    #[inline]
    pub(super) fn after(&self, sine: T, cosine: T) -> Self {
        Self {
            turn_sine: self.turn_sine * cosine + self.turn_cosine * sine,
            turn_cosine: self.turn_cosine * cosine - self.turn_sine * sine,
            ..*self
        }
    }

    /// A vector given in the old axes, in the new ones.
    #[inline]
    pub(super) fn into_new(self, v: &Vector3<T>) -> Vector3<T> {
        let normal = v.y * self.turn_cosine - v.x * self.turn_sine;
        Vector3::new(
            v.x * self.turn_cosine + v.y * self.turn_sine,
            normal * self.twist_cosine + v.z * self.twist_sine,
            v.z * self.twist_cosine - normal * self.twist_sine,
        )
    }

    /// A vector given in the new axes, in the old ones.
    #[inline]
    pub(super) fn into_old(self, v: &Vector3<T>) -> Vector3<T> {
        let normal = v.y * self.twist_cosine - v.z * self.twist_sine;
        Vector3::new(
            v.x * self.turn_cosine - normal * self.turn_sine,
            v.x * self.turn_sine + normal * self.turn_cosine,
            v.y * self.twist_sine + v.z * self.twist_cosine,
        )
    }

    /// The new axes in the old ones, as columns.
    #[inline]
    pub(super) fn axes(&self) -> Matrix3<T> {
        let Self { turn_sine, turn_cosine, twist_sine, twist_cosine } = *self;
        Matrix3::new(
            turn_cosine,
            -turn_sine * twist_cosine,
            turn_sine * twist_sine,
            turn_sine,
            turn_cosine * twist_cosine,
            -turn_cosine * twist_sine,
            T::zero(),
            twist_sine,
            twist_cosine,
        )
    }

    /// Sets the new axes in whatever axes the old ones are given: row by row, where they stay, because nine numbers at a time
    /// are more than the tick has registers for.
    #[inline]
    pub(super) fn turn_axes(self, old: &Matrix3<T>, new: &mut Matrix3<T>) {
        for row in 0..3 {
            let turned = self.into_new(&Vector3::new(old[(row, 0)], old[(row, 1)], old[(row, 2)]));
            new[(row, 0)] = turned.x;
            new[(row, 1)] = turned.y;
            new[(row, 2)] = turned.z;
        }
    }
}

/// First column.
#[inline]
pub(crate) fn x_axis<T: Real>(m: &Matrix3<T>) -> Vector3<T> {
    Vector3::new(m.m11, m.m21, m.m31)
}

/// Second column.
#[inline]
pub(crate) fn y_axis<T: Real>(m: &Matrix3<T>) -> Vector3<T> {
    Vector3::new(m.m12, m.m22, m.m32)
}

/// Third column.
#[inline]
pub(crate) fn z_axis<T: Real>(m: &Matrix3<T>) -> Vector3<T> {
    Vector3::new(m.m13, m.m23, m.m33)
}

/// Cross product.
#[inline]
pub(crate) fn cross<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// Dot product.
#[inline]
pub(crate) fn dot<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a.x * b.x + a.y * b.y + a.z * b.z
}
