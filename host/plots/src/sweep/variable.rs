//! A variable along an axis.

use super::super::axes::Ruler;
use super::super::pens::LABEL_SIZE;
use super::super::series;
use blindgrasp_view::text;
use std::ops::Range;

/// Between two labels, pixels.
const GAP: f64 = 10.0;
/// Pixels that a line of text takes.
const LINE: f64 = 17.0;
/// Distance of zero from the smallest number above it on a logarithmic axis: this share of the decades, and at least so
/// many.
const ZERO: (f64, f64) = (0.12, 0.3);
/// Letters of a word along an axis.
const LONGEST_WORD: usize = 16;

/// A quantity that is varied.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its unit; empty where there is none.
    pub unit: String,
    /// The spread of its values along the axis.
    pub spread: Spread,
    /// Its values.
    pub values: Vec<String>,
}

/// The spread of values along an axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Spread {
    /// By their size.
    Linear(Vec<f64>),
    /// By their logarithms; none is below zero. Zero itself lies a little below the others.
    Logarithmic(Vec<f64>),
    /// One after the other.
    Listed,
}

/// The direction of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Along {
    Horizontal,
    Vertical,
}

impl Variable {
    /// Returns the place of each value.
    pub(super) fn places(&self) -> Vec<f64> {
        match &self.spread {
            Spread::Linear(numbers) => numbers.clone(),
            Spread::Logarithmic(numbers) => {
                let zero = zero(numbers);
                let place = |number: &f64| if *number > 0.0 { number.log10() } else { zero };
                numbers.iter().map(place).collect()
            }
            Spread::Listed => (0..self.values.len()).map(|k| k as f64).collect(),
        }
    }

    /// The axis, of so many pixels, with the values at their places and some air on both sides.
    pub(super) fn ruler(&self, air: f64, along: Along, pixels: i32) -> Ruler {
        let places = self.places();
        let (low, high) = series::extremes(places.iter().copied()).unwrap_or((0.0, 0.0));
        let range = low - air..high + air;
        let per_unit = f64::from(pixels) / (range.end - range.start);
        let mut ticks: Vec<(f64, String)> = places.into_iter().zip(self.labels()).collect();
        ticks.sort_by(|a, b| a.0.total_cmp(&b.0));
        if !fits(&ticks, per_unit, along) {
            ticks = match &self.spread {
                Spread::Linear(_) => {
                    let round = series::ticks(&range, 8);
                    round.iter().map(|&tick| (tick, series::label(tick, &round))).collect()
                }
                Spread::Logarithmic(numbers) => {
                    let positive = decades(numbers).map_or(range.clone(), |(low, _)| low..range.end);
                    let zero = numbers.contains(&0.0).then(|| (zero(numbers), "0".to_owned()));
                    zero.into_iter().chain(round_powers(&positive)).collect()
                }
                Spread::Listed => some(ticks, per_unit, along),
            };
        }
        Ruler { words: self.words(), range, ticks }
    }

    /// Name and unit.
    fn words(&self) -> String {
        let name = text::shortened(&self.name, 60);
        let unit = self.unit.replace("^2", "²").replace("^3", "³");
        if unit.is_empty() { name } else { format!("{name}, {unit}") }
    }

    fn labels(&self) -> Vec<String> {
        match &self.spread {
            Spread::Linear(numbers) | Spread::Logarithmic(numbers) => labels(numbers),
            Spread::Listed => self.values.iter().map(|value| text::shortened(value, LONGEST_WORD)).collect(),
        }
    }
}

/// Least and largest logarithm of the numbers above zero.
fn decades(numbers: &[f64]) -> Option<(f64, f64)> {
    series::extremes(numbers.iter().filter(|number| **number > 0.0).map(|number| number.log10()))
}

/// Returns the place of zero on a logarithmic axis.
fn zero(numbers: &[f64]) -> f64 {
    let (low, high) = decades(numbers).unwrap_or_default();
    low - (ZERO.0 * (high - low)).max(ZERO.1)
}

/// Pixels that the longest label of an axis takes.
pub(super) fn widest(ruler: &Ruler) -> f64 {
    ruler.ticks.iter().map(|(_, label)| width(label)).fold(0.0, f64::max)
}

fn width(label: &str) -> f64 {
    f64::from(text::width(label, (f64::from(LABEL_SIZE) / text::SIZE_PER_EM) as f32))
}

/// Returns `true` if labels stand clear of each other.
fn fits(ticks: &[(f64, String)], per_unit: f64, along: Along) -> bool {
    ticks.windows(2).all(|pair| {
        let needed = match along {
            Along::Horizontal => 0.5 * (width(&pair[0].1) + width(&pair[1].1)) + GAP,
            Along::Vertical => LINE,
        };
        (pair[1].0 - pair[0].0) * per_unit >= needed
    })
}

/// Every so many of the ticks, so that they fit.
fn some(ticks: Vec<(f64, String)>, per_unit: f64, along: Along) -> Vec<(f64, String)> {
    let every = |n: usize| ticks.iter().step_by(n).cloned().collect::<Vec<_>>();
    (2..=ticks.len().max(2)).map(every).find(|some| fits(some, per_unit, along)).unwrap_or_default()
}

/// Powers of ten within a range of exponents, and twice and five times these where there are few.
pub(super) fn round_powers(range: &Range<f64>) -> Vec<(f64, String)> {
    let powers = range.start.ceil() as i32..=range.end.floor() as i32;
    let decades = range.end - range.start;
    let factors: &[f64] = if decades < 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let step = (decades / 8.0).ceil().max(1.0) as i32;
    let powers = (powers.start() - 1..=*powers.end()).filter(|power| power % step == 0);
    let numbers = powers.flat_map(|power| factors.iter().map(move |factor| factor * 10_f64.powi(power)));
    let numbers: Vec<f64> =
        numbers.filter(|number| (range.start - 1e-9..range.end + 1e-9).contains(&number.log10())).collect();
    numbers.iter().map(|number| number.log10()).zip(labels(&numbers)).collect()
}

/// Numbers of at most four digits; as powers of ten, or with one, where any of them is large or small.
fn labels(numbers: &[f64]) -> Vec<String> {
    let rounded = numbers.iter().map(|number| format!("{number:.3e}").parse().unwrap_or(*number));
    let rounded: Vec<f64> = rounded.collect();
    let is_plain = rounded.iter().all(|number| *number == 0.0 || (1e-4..1e5).contains(&number.abs()));
    let label = |number: &f64| match format!("{number:e}").split_once('e') {
        Some((digits, power)) if !is_plain && *number != 0.0 => {
            let power = series::power_label(power.parse().unwrap_or(0.0));
            if digits == "1" { power } else { format!("{digits}·{power}") }
        }
        _ => format!("{number}"),
    };
    rounded.iter().map(|number| label(number).replace('-', "\u{2212}")).collect()
}
