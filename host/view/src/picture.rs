//! Pictures of the grasp: the rendered scene with title, time, finger forces and scale bars.

use super::camera::Camera;
use super::canvas::Canvas;
use super::input::Report;
use super::palette::{self, FAINT_INK, INK, Rgb};
use super::scene3d::{FORCE, Stage};
use super::text::{self, Anchor, Turn};
use super::{raster, units};
use blindgrasp_sim::sample::Sample;

pub(super) const WIDTH: usize = 960;
pub(super) const HEIGHT: usize = 720;
/// Every pixel is the mean of its square.
const SAMPLES: usize = 3;

/// The moment of a run that a picture shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Moment {
    Start,
    End,
}

impl Moment {
    pub(super) fn file_name(self) -> &'static str {
        match self {
            Self::Start => "grasp-start",
            Self::End => "grasp-end",
        }
    }

    /// The first or the last sample in which the hand can be drawn.
    fn sample(self, samples: &[Sample]) -> Option<&Sample> {
        let whole = |sample: &&Sample| sample.angles_rad.iter().all(|angle| angle.is_finite());
        match self {
            Self::Start => samples.iter().find(whole),
            Self::End => samples.iter().rev().find(whole),
        }
    }
}

/// Draws the grasp at one moment.
pub(super) fn draw(report: &Report<'_>, stage: &Stage, moment: Moment) -> Canvas {
    let sample = moment.sample(report.samples);
    let camera =
        Camera::fitted(stage.view, &stage.extent, [24.0, 62.0], [WIDTH as f64 - 24.0, HEIGHT as f64 - 62.0]);
    let mesh = stage.mesh(report, sample);
    let mut canvas = raster::render(&mesh, &camera, (WIDTH, HEIGHT), SAMPLES, stage.outline_m);
    words(&mut canvas, &text::shortened(report.title, 56), (26, 36), 19.0, Anchor::Left, INK);
    if let Some(sample) = sample {
        let name = match moment {
            Moment::Start => "start",
            Moment::End => "end",
        };
        let time = format!("{name}, t = {:.3} s", sample.t_s);
        words(&mut canvas, &time, (26, 60), 14.0, Anchor::Left, FAINT_INK);
        finger_table(&mut canvas, report, sample);
    }
    let right = scale_bar(&mut canvas, 26, camera.pixels_per_m, "m");
    if sample.is_some_and(|sample| !sample.contacts.is_empty()) {
        scale_bar(&mut canvas, right + 40, stage.m_per_n * camera.pixels_per_m, "N");
    }
    canvas
}

/// Normal force of each finger, beside its colour.
fn finger_table(canvas: &mut Canvas, report: &Report<'_>, sample: &Sample) {
    let right = WIDTH as i32 - 26;
    for finger in 0..report.hand.fingertip_count() {
        let y = 36 + 22 * finger as i32;
        let force = sample.contacts.get(finger).map_or(f64::NAN, |contact| contact.normal_force_n);
        let force = if force.is_finite() { format!("{force:.2} N") } else { "\u{2013}".to_owned() };
        words(canvas, &force, (right, y), 14.0, Anchor::Right, INK);
        words(canvas, &format!("finger {}", finger + 1), (right - 78, y), 14.0, Anchor::Right, INK);
        let dot = [((right - 148) as f32, y as f32 - 5.0)];
        canvas.stroke(&dot, 12.0, palette::of(finger), 1.0);
    }
}

/// A round length or force at the lower edge, drawn to scale, and what it is. Returns where its words end.
pub(super) fn scale_bar(canvas: &mut Canvas, left: i32, pixels_per_unit: f64, unit: &str) -> i32 {
    let y = canvas.height as i32 - 28;
    let Some(value) = round_below(130.0 / pixels_per_unit) else { return left };
    let length = (value * pixels_per_unit) as f32;
    let (from, to, row) = (left as f32, left as f32 + length, y as f32);
    if unit == "N" {
        // As the arrows in the picture are: light, with a dark rim.
        for (width, colour) in [(6.5, INK), (4.0, FORCE)] {
            let (shaft, head) = (to - 2.0, to - 10.0);
            canvas.stroke(&[(from, row), (shaft, row)], width, colour, 1.0);
            canvas.stroke(&[(head, row - 5.0), (shaft, row), (head, row + 5.0)], width, colour, 1.0);
        }
    } else {
        canvas.stroke(&[(from, row), (to, row)], 2.0, FAINT_INK, 1.0);
        for end in [from, to] {
            canvas.stroke(&[(end, row - 4.0), (end, row + 4.0)], 2.0, FAINT_INK, 1.0);
        }
    }
    let (prefix, factor) = units::prefix(value);
    // Multiples of 1, 2 and 5 print exactly once the prefix has brought them near one.
    let label = format!("{} {prefix}{unit}", (value * factor * 1e6).round() / 1e6);
    words(canvas, &label, (to as i32 + 10, y + 5), 14.0, Anchor::Left, FAINT_INK);
    to as i32 + 10 + text::width(&label, 14.0) as i32
}

/// The largest 1, 2 or 5 times a power of ten that is not above `limit`.
pub(super) fn round_below(limit: f64) -> Option<f64> {
    if !(limit > 0.0 && limit.is_finite()) {
        return None;
    }
    let power = 10_f64.powf(limit.log10().floor());
    [5.0, 2.0, 1.0].map(|m| m * power).into_iter().find(|value| *value <= limit * (1.0 + 1e-9))
}

/// Text with its baseline at `at`.
pub(super) fn words(
    canvas: &mut Canvas,
    words: &str,
    at: (i32, i32),
    size: f32,
    anchor: Anchor,
    colour: Rgb,
) {
    text::draw(canvas, words, at, 0.0, size, anchor, Turn::None, colour);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_have_round_lengths() {
        for (limit, value) in [(0.07, 0.05), (1.0, 1.0), (4.99, 2.0), (0.0023, 0.002)] {
            let found = round_below(limit).unwrap();
            assert!((found - value).abs() < 1e-12, "{found} below {limit}");
        }
        assert_eq!(round_below(f64::NAN), None);
        assert_eq!(round_below(0.0), None);
    }
}
