//! The scalar that everything in this crate is generic over, and the only place that names trigonometry and
//! square roots.
//!
//! The controller runs in `f32`, the simulated plant and the tests in `f64`, with the same code. The `f32` functions
//! are built from additions, multiplications and bit patterns alone, in one fixed order and without fused
//! multiply-add, so that they give the same bits on every target; none of them touches an `f64`, which the
//! microcontroller would compute in software.

use core::ops::Neg;
use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, Scalar, Vector3};
use num_traits::{One, Zero};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The reals of this crate: `f32` in the controller, `f64` in the plant and the tests.
///
/// The names differ from the standard library's on purpose: a call can't reach a platform's own sine by accident.
pub trait Real:
    Scalar
    + Copy
    + PartialOrd
    + Zero
    + One
    + Neg<Output = Self>
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
    + Serialize
    + DeserializeOwned
{
    /// Sine and cosine of an angle in radians.
    ///
    /// `f32`: absolute error below 2e-7 over `[-2 pi, 2 pi]` (a test samples 8 million arguments and prints the
    /// largest error, 1.2e-7) and below 1e-6 up to 1,000 rad; NaN for infinities and NaN.
    /// `f64`: libm's, below 1 ulp.
    fn sine_cosine(self) -> (Self, Self);

    /// Correctly rounded square root; NaN for negative numbers.
    fn square_root(self) -> Self;

    /// The nearest value of this type. Meant for constants: the compiler folds it.
    fn from_f64(value: f64) -> Self;

    /// This value of a message.
    fn from_f32(value: f32) -> Self;

    /// This value as an `f64`, exactly. For hosts and tests; the tick never calls it.
    fn to_f64(self) -> f64;

    /// A whole number, rounded to the nearest value of this type.
    fn from_i32(value: i32) -> Self;

    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;

    /// Magnitude.
    fn magnitude(self) -> Self {
        if self < Self::zero() { -self } else { self }
    }

    /// The value moved into `[low, high]`; NaN stays NaN.
    fn limited(self, low: Self, high: Self) -> Self {
        if self < low {
            low
        } else if self > high {
            high
        } else {
            self
        }
    }
}

impl Real for f32 {
    #[inline]
    fn sine_cosine(self) -> (f32, f32) {
        // Cody-Waite reduction to [-pi/4, pi/4]: pi/2 in two parts, of which the first has so few bits that its product
        // with the quadrant number is exact for quadrants below 2^16.
        const HALF_PI_HIGH: f32 = 1.570_312_5;
        const HALF_PI_LOW: f32 = 4.838_267_949e-4;
        // Adding 1.5 * 2^23 leaves the nearest whole number in the low bits of the mantissa.
        const ROUND: f32 = 12_582_912.0;
        let shifted = self * core::f32::consts::FRAC_2_PI + ROUND;
        let quadrant = shifted.to_bits();
        let turns = shifted - ROUND;
        let r = (self - turns * HALF_PI_HIGH) - turns * HALF_PI_LOW;
        let r2 = r * r;
        // Minimax polynomials on [-pi/4, pi/4] by Remez' algorithm; before rounding, their errors are 2e-9 and 3.3e-8.
        let s = ((-1.949_495e-4 * r2 + 8.331_973e-3) * r2 - 1.666_665_06e-1) * (r2 * r) + r;
        let c = ((-1.359_724_7e-3 * r2 + 4.165_625_2e-2) * r2 - 4.999_989_3e-1) * r2 + 1.0;
        // A quarter turn for bit 0 of the quadrant, half a turn for bit 1.
        let (s, c) = if quadrant & 1 == 0 { (s, c) } else { (c, -s) };
        if quadrant & 2 == 0 { (s, c) } else { (-s, -c) }
    }

    fn square_root(self) -> f32 {
        libm::sqrtf(self)
    }

    // One instruction; with the comparison, the sign of a zero would have to be kept.
    #[inline]
    fn magnitude(self) -> f32 {
        self.abs()
    }

    #[inline]
    fn from_f64(value: f64) -> f32 {
        value as f32
    }

    #[inline]
    fn from_f32(value: f32) -> f32 {
        value
    }

    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    #[inline]
    fn from_i32(value: i32) -> f32 {
        value as f32
    }

    #[inline]
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
}

impl Real for f64 {
    fn sine_cosine(self) -> (f64, f64) {
        libm::sincos(self)
    }

    fn square_root(self) -> f64 {
        libm::sqrt(self)
    }

    #[inline]
    fn from_f64(value: f64) -> f64 {
        value
    }

    #[inline]
    fn from_f32(value: f32) -> f64 {
        f64::from(value)
    }

    fn to_f64(self) -> f64 {
        self
    }

    #[inline]
    fn from_i32(value: i32) -> f64 {
        f64::from(value)
    }

    #[inline]
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
}

/// Euclidean norm.
pub fn norm<T: Real>(v: &Vector3<T>) -> T {
    v.dot(v).square_root()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Largest error of sine and cosine over `samples` evenly spaced arguments of `[-range, range]`.
    fn largest_error(range: f64, samples: i32) -> f64 {
        let mut largest: f64 = 0.0;
        for k in -samples..=samples {
            let x = (range * f64::from(k) / f64::from(samples)) as f32;
            let (s, c) = x.sine_cosine();
            let (exact_s, exact_c) = f64::from(x).sine_cosine();
            largest = largest.max((f64::from(s) - exact_s).abs()).max((f64::from(c) - exact_c).abs());
        }
        largest
    }

    #[test]
    fn sine_and_cosine_keep_their_stated_error() {
        let near = largest_error(2.0 * PI, 4_000_000);
        let far = largest_error(1000.0, 4_000_000);
        std::println!(
            "sine, cosine in f32: max error {near:.2e} over [-2 pi, 2 pi], {far:.2e} over 1,000 rad"
        );
        assert!(near < 2e-7, "{near:e}");
        assert!(far < 1e-6, "{far:e}");
    }

    #[test]
    fn sine_and_cosine_at_special_arguments() {
        assert_eq!(0.0_f32.sine_cosine(), (0.0, 1.0));
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let (s, c) = x.sine_cosine();
            assert!(s.is_nan() && c.is_nan());
        }
        for k in 0..1000 {
            let x = k as f32 * 0.0123;
            let (s, c) = x.sine_cosine();
            assert_eq!((-x).sine_cosine(), (-s, c), "odd and even at {x}");
        }
    }

    #[test]
    #[expect(clippy::disallowed_methods, reason = "compared with the standard library's")]
    fn square_root_is_correctly_rounded() {
        for x in [0.0_f32, 1.0, 2.0, 1e-30, 3.4e38, 0.1] {
            assert_eq!(x.square_root(), x.sqrt());
        }
        assert!((-1.0_f32).square_root().is_nan());
    }
}
