//! Seeded random numbers and rotations. The same seed gives the same on every machine.

use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// A source of random things.
#[derive(Clone, Debug)]
pub struct Draw(fastrand::Rng);

impl Draw {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    /// A number between two others.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.f64()
    }

    /// A whole number from a range.
    pub fn count(&mut self, range: RangeInclusive<usize>) -> usize {
        self.0.usize(range)
    }

    /// True with a probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.0.f64() < probability
    }

    /// A vector with entries in `[-size, size]`.
    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.within(-size, size))
    }

    /// A unit vector, evenly spread over the sphere.
    pub fn unit(&mut self) -> Vector3<f64> {
        let z = self.within(-1.0, 1.0);
        let (sine, cosine) = self.within(-PI, PI).sine_cosine();
        let radius = (1.0 - z * z).square_root();
        Vector3::new(radius * cosine, radius * sine, z).normalize()
    }

    /// A rotation, about any axis by any angle.
    pub fn rotation(&mut self) -> Matrix3<f64> {
        let (sine, cosine) = self.within(-PI, PI).sine_cosine();
        let cross = self.unit().cross_matrix();
        Matrix3::identity() + cross * sine + cross * cross * (1.0 - cosine)
    }
}
