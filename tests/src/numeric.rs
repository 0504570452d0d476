//! Derivatives by differences, and the largest of many errors.

use blindgrasp_shared::math::Real;
use std::f64::consts::PI;
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

/// Value and derivative at zero of functions that can only be had at positive arguments: those of the polynomial through samples at
/// the Chebyshev nodes up to a largest argument, where what is rounded grows the least (the derivative of a sum of `n` samples by
/// some `2 n^2`). What they change by without the last sample tells what they are off by.
#[derive(Clone, Debug)]
pub struct Taylor {
    /// Values at zero.
    pub value: Vec<f64>,
    /// By how much a sample less changes them.
    pub doubt: Vec<f64>,
    /// Derivatives at zero.
    pub slope: Vec<f64>,
    /// By how much a sample less changes these.
    pub slope_doubt: Vec<f64>,
}

impl Taylor {
    /// From several functions, sampled together.
    pub fn at_zero(largest: f64, samples: usize, f: impl Fn(f64) -> Vec<f64>) -> Self {
        let angle = |k: usize| (k as f64 + 0.5) / samples as f64 * PI;
        let at: Vec<f64> = (0..samples).map(|k| 0.5 * largest * (1.0 - angle(k).sine_cosine().1)).collect();
        let sampled: Vec<Vec<f64>> = at.iter().map(|&x| f(x)).collect();
        let combined = |weights: &[f64]| -> Vec<f64> {
            let term =
                |n: usize| weights.iter().zip(&sampled).map(|(weight, numbers)| weight * numbers[n]).sum();
            (0..sampled[0].len()).map(term).collect()
        };
        let [(values, slopes), (values_before, slopes_before)] =
            [lagrange_at_zero(&at), lagrange_at_zero(&at[..samples - 1])];
        let (value, slope) = (combined(&values), combined(&slopes));
        let off = |now: &[f64], before: &[f64]| now.iter().zip(before).map(|(a, b)| (a - b).abs()).collect();
        let doubt = off(&value, &combined(&values_before));
        let slope_doubt = off(&slope, &combined(&slopes_before));
        Self { value, doubt, slope, slope_doubt }
    }
}

/// Values and derivatives at zero of the Lagrange polynomials of some points.
fn lagrange_at_zero(at: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let others = |j: usize| (0..at.len()).filter(move |&m| m != j);
    let value = |j: usize| others(j).map(|m| at[m] / (at[m] - at[j])).product::<f64>();
    let slope = |j: usize| -value(j) * others(j).map(|m| 1.0 / at[m]).sum::<f64>();
    ((0..at.len()).map(value).collect(), (0..at.len()).map(slope).collect())
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
