//! The run as a short GIF that plays in a loop.

use super::camera::Camera;
use super::canvas::Canvas;
use super::input::Report;
use super::palette::{FAINT_INK, INK};
use super::picture::words;
use super::quantise::{Quantiser, UNCHANGED};
use super::raster;
use super::scene3d::Stage;
use super::text::{self, Anchor};
use blindgrasp_sim::sample::Sample;

pub(super) const WIDTH: usize = 480;
pub(super) const HEIGHT: usize = 400;
/// Every pixel is the mean of its square.
const SAMPLES: usize = 2;
/// Time for which a frame shows, in the hundredths of a second that GIF counts in: 12.5 frames a second.
const DELAY_CS: u16 = 8;
/// The last frame stays longer, so that one sees where the run ended.
const LAST_DELAY_CS: u16 = 120;
/// Time that playing should take, s.
const PLAYING_S: f64 = 6.0;
/// Speeds to choose from.
const SPEEDS: [f64; 10] = [0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0];
const MOST_FRAMES: usize = 150;
/// Bytes.
const LARGEST_FILE: usize = 1_700_000;

/// The times of the frames, s since the start of the run, and how many seconds of the run pass in a second.
pub(super) struct Schedule {
    pub(super) times: Vec<f64>,
    speed: f64,
}

impl Schedule {
    pub(super) fn new(samples: &[Sample]) -> Self {
        let mut times = samples.iter().map(|sample| sample.t_s).filter(|t| t.is_finite());
        let Some(start) = times.next() else { return Self { times: vec![0.0], speed: 1.0 } };
        let end = times.next_back().unwrap_or(start);
        let duration = end - start;
        // How far playing would be from the wanted time, as a ratio.
        let miss = |speed: f64| {
            let ratio = duration / speed / PLAYING_S;
            ratio.max(1.0 / ratio)
        };
        let speed = SPEEDS.into_iter().min_by(|a, b| miss(*a).total_cmp(&miss(*b))).unwrap_or(1.0);
        let step = (speed * f64::from(DELAY_CS) / 100.0).max(duration / MOST_FRAMES as f64);
        let steps = if duration > 0.0 { (duration / step - 1e-6).ceil() as usize } else { 0 };
        let times = (0..=steps).map(|k| (start + k as f64 * step).min(end)).collect();
        Self { times, speed }
    }
}

/// Draws the animation as a GIF file.
///
/// A run in which everything moves packs badly: then every second frame is left out.
pub(super) fn draw(report: &Report<'_>, stage: &Stage) -> Result<Vec<u8>, String> {
    let schedule = Schedule::new(report.samples);
    let file = encoded(report, stage, &schedule, 1)?;
    if file.len() <= LARGEST_FILE { Ok(file) } else { encoded(report, stage, &schedule, 2) }
}

/// The animation with one of `stride` frames.
fn encoded(report: &Report<'_>, stage: &Stage, schedule: &Schedule, stride: u16) -> Result<Vec<u8>, String> {
    let (from, to) = ([8.0, 34.0], [WIDTH as f64 - 8.0, HEIGHT as f64 - 10.0]);
    let camera = Camera::fitted(stage.view, &stage.extent, from, to);
    let frame = |t: f64| frame(report, stage, &camera, t, schedule.speed);
    let times: Vec<f64> = schedule.times.iter().copied().step_by(usize::from(stride)).collect();
    // All that the run shows is nearly shown by a few of its frames.
    let typical = (0..4).filter_map(|k| times.get(k * (times.len() - 1) / 3));
    let typical: Vec<Canvas> = typical.map(|t| frame(*t)).collect();
    let mut quantiser = Quantiser::new(typical.iter().flat_map(|canvas| &canvas.pixels));

    let mut file = Vec::new();
    let mut encoder = gif::Encoder::new(&mut file, WIDTH as u16, HEIGHT as u16, &quantiser.table())
        .map_err(|e| e.to_string())?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(|e| e.to_string())?;
    let mut shown = vec![UNCHANGED; WIDTH * HEIGHT];
    for (k, t) in times.iter().enumerate() {
        let entries: Vec<u8> = frame(*t).pixels.iter().map(|pixel| quantiser.entry(pixel)).collect();
        let mut change = changed(&shown, &entries);
        change.delay = if k + 1 == times.len() { LAST_DELAY_CS } else { DELAY_CS * stride };
        encoder.write_frame(&change).map_err(|e| e.to_string())?;
        shown = entries;
    }
    drop(encoder);
    Ok(file)
}

/// The grasp at the sample that is current at time `t`.
fn frame(report: &Report<'_>, stage: &Stage, camera: &Camera, t: f64, speed: f64) -> Canvas {
    let after = report.samples.partition_point(|sample| sample.t_s <= t);
    let sample = report.samples.get(after.saturating_sub(1));
    let mesh = stage.mesh(report, sample);
    let mut canvas = raster::render(&mesh, camera, (WIDTH, HEIGHT), SAMPLES, stage.outline_m);
    words(&mut canvas, &text::shortened(report.title, 28), (12, 24), 15.0, Anchor::Left, INK);
    if sample.is_some() {
        // Digits of DejaVu Sans are all equally wide, so that the label keeps still.
        let label = format!("t = {t:.2} s   (×{speed})");
        words(&mut canvas, &label, (WIDTH as i32 - 12, 24), 13.0, Anchor::Right, FAINT_INK);
    }
    canvas
}

/// The rectangle in which two frames differ; inside it, what stays is left transparent, which packs well.
fn changed(before: &[u8], now: &[u8]) -> gif::Frame<'static> {
    let differs = |k: &usize| before[*k] != now[*k];
    let rows = |y: usize| (y * WIDTH..(y + 1) * WIDTH).any(|k| differs(&k));
    let top = (0..HEIGHT).find(|&y| rows(y)).unwrap_or(0);
    let bottom = (0..HEIGHT).rev().find(|&y| rows(y)).unwrap_or(0);
    let columns = |x: usize| (top..=bottom).any(|y| differs(&(y * WIDTH + x)));
    let left = (0..WIDTH).find(|&x| columns(x)).unwrap_or(0);
    let right = (0..WIDTH).rev().find(|&x| columns(x)).unwrap_or(0);
    let pixels = (top..=bottom)
        .flat_map(|y| (left..=right).map(move |x| y * WIDTH + x))
        .map(|k| if differs(&k) { now[k] } else { UNCHANGED });
    gif::Frame {
        left: left as u16,
        top: top as u16,
        width: (right - left + 1) as u16,
        height: (bottom - top + 1) as u16,
        buffer: pixels.collect::<Vec<u8>>().into(),
        transparent: Some(UNCHANGED),
        dispose: gif::DisposalMethod::Keep,
        ..gif::Frame::default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture;
    use super::*;

    #[test]
    fn a_run_plays_in_about_six_seconds() {
        for (run_s, speed) in [(5, 1.0), (7, 1.0), (20, 3.0), (1, 0.2)] {
            let schedule = Schedule::new(&fixture::samples(run_s * 1000 + 1));
            assert_eq!(schedule.speed, speed, "{run_s} s");
            let playing_s = schedule.times.len() as f64 * f64::from(DELAY_CS) / 100.0;
            assert!((4.0..9.0).contains(&playing_s), "{playing_s} s");
            assert_eq!(schedule.times.last(), Some(&(run_s as f64)));
        }
        assert_eq!(Schedule::new(&[]).times, [0.0]);
        let short = Schedule::new(&fixture::samples(50));
        assert_eq!((short.speed, short.times.len()), (0.1, 8), "no slower than a tenth");
        assert!(Schedule::new(&fixture::samples(1)).times.len() == 1);
    }

    #[test]
    fn only_what_changed_is_stored() {
        let before = vec![7; WIDTH * HEIGHT];
        let mut now = before.clone();
        (now[3 * WIDTH + 10], now[5 * WIDTH + 12]) = (1, 2);
        let frame = changed(&before, &now);
        assert_eq!((frame.left, frame.top, frame.width, frame.height), (10, 3, 3, 3));
        let same = UNCHANGED;
        assert_eq!(*frame.buffer, [1, same, same, same, same, same, same, same, 2]);
        assert_eq!(*changed(&now, &now).buffer, [same]);
    }
}
