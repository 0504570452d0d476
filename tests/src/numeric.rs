//! Derivatives by differences, and the largest of many errors.

use blindgrasp_shared::math::Real;
use std::fmt;
use std::ops::{Add, Mul, Sub};

/// Derivative of `f` at zero: central differences at `step` and `step / 2`, extrapolated (Richardson).
///
/// The truncation error is `step^4 / 480` times the fifth derivative; the rounding error is about three times that of
/// `f` divided by `step`.
pub fn derivative<T>(step: f64, f: impl Fn(f64) -> T) -> T
where
    T: Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>,
{
    let difference = |h: f64| (f(h) - f(-h)) * (0.5 / h);
    difference(0.5 * step) * (4.0 / 3.0) - difference(step) * (1.0 / 3.0)
}

/// Errors of a sweep: the largest, and the root of the mean square.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    largest: f64,
    squares: f64,
    count: u32,
}

impl Errors {
    /// No errors yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes note of an error.
    ///
    /// # Panics
    /// If it is NaN, which would otherwise be smaller than any tolerance.
    pub fn add(&mut self, error: f64) {
        assert!(!error.is_nan(), "an error is NaN");
        self.largest = self.largest.max(error.abs());
        self.squares += error * error;
        self.count += 1;
    }

    /// The largest magnitude.
    ///
    /// # Panics
    /// If there was none: a sweep over nothing proves nothing.
    pub fn largest(&self) -> f64 {
        assert!(self.count > 0, "nothing was measured");
        self.largest
    }

    /// The root of the mean square.
    pub fn rms(&self) -> f64 {
        (self.squares / f64::from(self.count)).square_root()
    }
}

impl fmt::Display for Errors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "max {:.2e}, rms {:.2e} of {}", self.largest, self.rms(), self.count)
    }
}

/// The order that two errors show when the step was halved between them.
pub fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}
