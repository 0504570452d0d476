//! Triangles as a file has them: each for itself.

use nalgebra::Vector3;

/// A fault of a file, and the remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The fault, with its place in the file.
    pub what: String,
    /// The remedy.
    pub remedy: String,
}

impl Problem {
    /// Makes one.
    pub fn new(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { what: what.into(), remedy: remedy.into() }
    }
}

/// Triangles in the unit of the file, and the number of each in the file, from 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Soup {
    pub(super) triangles: Vec<[Vector3<f64>; 3]>,
    pub(super) numbers: Vec<u32>,
}

impl Soup {
    pub(super) fn with_capacity(count: usize) -> Self {
        Self { triangles: Vec::with_capacity(count), numbers: Vec::with_capacity(count) }
    }

    pub(super) fn push(&mut self, corners: [Vector3<f64>; 3], number: usize) {
        self.triangles.push(corners);
        self.numbers.push(number as u32);
    }

    /// Every length multiplied.
    pub(super) fn scale(&mut self, by: impl Fn(f64) -> f64) {
        for corner in self.triangles.iter_mut().flatten() {
            *corner = corner.map(&by);
        }
    }

    /// The triangles.
    pub fn triangles(&self) -> &[[Vector3<f64>; 3]] {
        &self.triangles
    }

    /// Returns the extents along x, y and z.
    pub fn size(&self) -> Vector3<f64> {
        let Some(start) = self.triangles.first().map(|corners| corners[0]) else { return Vector3::zeros() };
        let all = self.triangles.iter().flatten();
        let (low, high) = all.fold((start, start), |(low, high), p| (low.inf(p), high.sup(p)));
        high - low
    }
}
