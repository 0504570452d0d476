//! A range of colours for a range of numbers.

use blindgrasp_view::palette::{BLUE, Rgb, VERMILLION, mix};
use std::ops::Range;

/// Colours from one end to the other, by way of the middle.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ramp {
    stops: [Rgb; 3],
    pub(super) range: Range<f64>,
}

impl Ramp {
    /// Blues: the later at rest, the darker.
    pub(super) fn rested(times_s: impl Iterator<Item = f64>) -> Option<Self> {
        Self::over(times_s, [[214, 233, 246], BLUE, [0, 38, 77]])
    }

    /// Reds: the sooner lost, the darker.
    pub(super) fn lost(times_s: impl Iterator<Item = f64>) -> Option<Self> {
        Self::over(times_s, [[96, 30, 0], VERMILLION, [251, 217, 186]])
    }

    fn over(values: impl Iterator<Item = f64>, stops: [Rgb; 3]) -> Option<Self> {
        let (low, high) = super::super::series::extremes(values)?;
        let range =
            if high - low > 1e-3 * high.abs().max(1e-3) { low..high } else { 0.9 * low..1.1 * high + 1e-3 };
        Some(Self { stops, range })
    }

    /// The colour of a number.
    pub(super) fn colour(&self, value: f64) -> Rgb {
        let share = ((value - self.range.start) / (self.range.end - self.range.start)).clamp(0.0, 1.0);
        let [first, middle, last] = self.stops;
        if share < 0.5 { mix(middle, first, 2.0 * share) } else { mix(last, middle, 2.0 * share - 1.0) }
    }
}
