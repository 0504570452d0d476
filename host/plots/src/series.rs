//! Numbers on their way to a plot: ranges, ticks, unit prefixes, thinning.

use std::ops::Range;

/// Thins a signal to what `columns` pixel columns can show: the smallest and the largest value of each column, in the
/// order in which they occur, so that no peak is lost. Values that are not finite are left out and break the line.
pub(super) fn thinned(times: &[f64], values: &[f64], columns: usize) -> Vec<Vec<(f64, f64)>> {
    let span = time_range(times);
    let per_second = columns as f64 / (span.end - span.start);
    let (mut lines, mut line) = (Vec::new(), Vec::new());
    let mut column = Column::default();
    for (&t, &value) in times.iter().zip(values) {
        if !(t.is_finite() && value.is_finite()) {
            column.flush(&mut line);
            if !line.is_empty() {
                lines.push(std::mem::take(&mut line));
            }
            continue;
        }
        let index = ((t - span.start) * per_second) as usize;
        if column.index != Some(index) {
            column.flush(&mut line);
            column.index = Some(index);
        }
        column.add((t, value));
    }
    column.flush(&mut line);
    if !line.is_empty() {
        lines.push(line);
    }
    lines
}

/// The samples that share a pixel column.
#[derive(Default)]
struct Column {
    index: Option<usize>,
    lowest: Option<(f64, f64)>,
    highest: Option<(f64, f64)>,
}

impl Column {
    fn add(&mut self, sample: (f64, f64)) {
        if self.lowest.is_none_or(|lowest| sample.1 < lowest.1) {
            self.lowest = Some(sample);
        }
        if self.highest.is_none_or(|highest| sample.1 > highest.1) {
            self.highest = Some(sample);
        }
    }

    /// Moves what the column holds to the line.
    fn flush(&mut self, line: &mut Vec<(f64, f64)>) {
        if let (Some(lowest), Some(highest)) = (self.lowest, self.highest) {
            let (first, last) = if lowest.0 <= highest.0 { (lowest, highest) } else { (highest, lowest) };
            line.push(first);
            if last != first {
                line.push(last);
            }
        }
        *self = Self::default();
    }
}

/// From the first to the last finite time; widened where there is no width.
pub(super) fn time_range(times: &[f64]) -> Range<f64> {
    let (low, high) = extremes(times.iter().copied()).unwrap_or((0.0, 1.0));
    if high > low { low..high } else { low - 0.5..low + 0.5 }
}

/// `range`, lengthened a little where that lets it end at a tick: a run of 5 s has its last sample at 4.999 s.
pub(super) fn to_next_tick(range: Range<f64>, count: usize) -> Range<f64> {
    let slack = 0.004 * (range.end - range.start);
    let longer = range.start..range.end + slack;
    match ticks(&longer, count).last() {
        Some(last) if *last > range.end => range.start..*last,
        _ => range,
    }
}

/// Smallest and largest finite value; `None` where there is none.
pub(super) fn extremes(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|v| v.is_finite()).fold(None, |range, v| match range {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

/// A range for a linear axis: all values and zero, with some air; `-1..1` where everything is zero.
pub(super) fn linear_range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = extremes(values).unwrap_or((0.0, 0.0));
    // Beyond this, differences overflow; no plot of a hand needs it.
    let (low, high) = (low.clamp(-1e300, 0.0), high.clamp(0.0, 1e300));
    let air = 0.06 * (high - low);
    match (low < 0.0, high > 0.0) {
        (false, false) => -1.0..1.0,
        (below, above) => {
            (low - if below { air } else { air / 2.0 })..(high + if above { air } else { air / 2.0 })
        }
    }
}

/// A range of powers of ten for a logarithmic axis: from the largest value down, at most nine decades. `None` where
/// nothing is larger than zero.
pub(super) fn decades(values: impl Iterator<Item = f64>) -> Option<Range<f64>> {
    let (low, high) = extremes(values.filter(|v| *v > 0.0))?;
    let top = high.log10().ceil();
    let bottom = low.log10().floor().max(top - 9.0);
    Some(bottom.min(top - 1.0)..top)
}

/// Cuts a line into dashes of `on` pixels with gaps of `off`; `pixels` are the lengths of a unit along both axes.
///
/// A dash is as long as the line that it follows, except that a climb counts as no steeper than three: a signal that
/// fills a band then shows as a hatched band, through which the lines behind it are seen.
pub(super) fn dashes(
    points: &[(f64, f64)],
    pixels: (f64, f64),
    (on, off): (f64, f64),
) -> Vec<Vec<(f64, f64)>> {
    let mut dashes = vec![points.first().copied().into_iter().collect::<Vec<_>>()];
    let (mut drawing, mut left) = (true, on);
    for pair in points.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let along = (to.0 - from.0).abs() * pixels.0;
        let climb = ((to.1 - from.1).abs() * pixels.1).min(3.0 * along);
        let length = nalgebra::Vector2::new(along, climb).norm();
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let share = done / length;
            let cut = (from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share);
            if drawing {
                dashes.last_mut().into_iter().for_each(|dash| dash.push(cut));
            } else {
                dashes.push(vec![cut]);
            }
            drawing = !drawing;
            left = if drawing { on } else { off };
        }
        left -= length - done;
        if drawing {
            dashes.last_mut().into_iter().for_each(|dash| dash.push(to));
        }
    }
    dashes
}

/// Round positions in `range`, about `count` of them: multiples of 1, 2 or 5 times a power of ten.
pub(super) fn ticks(range: &Range<f64>, count: usize) -> Vec<f64> {
    let rough = (range.end - range.start) / count.max(1) as f64;
    if !(rough > 0.0 && rough.is_finite()) {
        return Vec::new();
    }
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|step| *step >= rough * 0.999);
    let step = step.unwrap_or(10.0 * power);
    let (first, last) = ((range.start / step - 1e-9).ceil(), (range.end / step + 1e-9).floor());
    let number = ((last - first).max(-1.0) + 1.0).min(100.0) as usize;
    // Adding zero turns a negative zero into a positive one.
    (0..number).map(|k| (first + k as f64) * step + 0.0).collect()
}

/// Labels for ticks: as many decimals as tell them apart.
pub(super) fn label(tick: f64, ticks: &[f64]) -> String {
    let step = ticks.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    if !step.is_finite() || !(1e-9..1e6).contains(&step) {
        return if tick == 0.0 { "0".into() } else { format!("{tick:.1e}") };
    }
    let decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    format!("{tick:.decimals$}").replace('-', "\u{2212}")
}

/// A power of ten as a label.
pub(super) fn power_label(exponent: f64) -> String {
    const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digits = format!("{exponent:.0}");
    let raised = digits.chars().filter_map(|c| match c {
        '-' => Some('⁻'),
        c => c.to_digit(10).and_then(|digit| SUPERSCRIPTS.get(digit as usize).copied()),
    });
    format!("10{}", raised.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_peak_and_breaks_at_gaps() {
        let times: Vec<f64> = (0..10_000).map(|k| f64::from(k) * 1e-3).collect();
        let mut values = vec![0.0; 10_000];
        (values[1234], values[7777]) = (5.0, -3.0);
        let lines = thinned(&times, &values, 500);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].len() <= 1002);
        assert_eq!(extremes(lines[0].iter().map(|p| p.1)), Some((-3.0, 5.0)));
        assert!(lines[0].windows(2).all(|pair| pair[0].0 < pair[1].0), "in the order of time");
        values[5000] = f64::NAN;
        assert_eq!(thinned(&times, &values, 500).len(), 2);
        assert!(thinned(&[], &[], 500).is_empty());
        assert_eq!(thinned(&[2.0], &[3.0], 500), [[(2.0, 3.0)]]);
    }

    #[test]
    fn ranges_are_never_empty() {
        assert_eq!(linear_range([0.0, f64::NAN].into_iter()), -1.0..1.0);
        assert_eq!(linear_range(std::iter::empty()), -1.0..1.0);
        assert_eq!(time_range(&[2.0]), 1.5..2.5);
        assert_eq!(time_range(&[f64::NAN]), 0.0..1.0);
        assert_eq!(decades([0.0, f64::NAN].into_iter()), None);
        assert_eq!(decades([1e-30, 0.5].into_iter()), Some(-9.0..0.0));
        assert_eq!(decades([1.0].into_iter()), Some(-1.0..0.0));
    }

    #[test]
    fn dashes_follow_the_line() {
        let flat = dashes(&[(0.0, 1.0), (25.0, 1.0)], (1.0, 1.0), (6.0, 4.0));
        let ends: Vec<(f64, f64)> = flat.iter().map(|dash| (dash[0].0, dash[dash.len() - 1].0)).collect();
        assert_eq!(ends, [(0.0, 6.0), (10.0, 16.0), (20.0, 25.0)]);
        // A zigzag over two pixels a swing, 1,000 high: as if it climbed three for one.
        let zigzag: Vec<(f64, f64)> = (0..100).map(|k| (f64::from(k), f64::from(k % 2) * 1000.0)).collect();
        let hatched = dashes(&zigzag, (1.0, 1.0), (6.0, 4.0));
        assert!((28..36).contains(&hatched.len()), "{}", hatched.len());
        assert_eq!(dashes(&[], (1.0, 1.0), (6.0, 4.0)), [[]]);
    }

    #[test]
    fn ticks_are_round_and_labels_short() {
        let near = ticks(&(-0.13..0.31), 5);
        let labels: Vec<String> = near.iter().map(|tick| label(*tick, &near)).collect();
        assert_eq!(labels, ["−0.1", "0.0", "0.1", "0.2", "0.3"]);
        let whole = ticks(&(0.0..5.0), 6);
        assert_eq!(whole.iter().map(|tick| label(*tick, &whole)).collect::<String>(), "012345");
        assert_eq!(power_label(-12.0), "10⁻¹²");
        assert!(ticks(&(1.0..1.0), 5).is_empty());
        assert!(ticks(&(f64::NAN..1.0), 5).is_empty());
    }
}
