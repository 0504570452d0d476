//! A run at several times: pictures of the same stage, one by one and side by side.

use super::Files;
use super::camera::Camera;
use super::canvas::Canvas;
use super::input::Report;
use super::palette::INK;
use super::picture::{scale_bar, words};
use super::raster;
use super::scene3d::Stage;
use super::text::Anchor;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use blindgrasp_sim::sample::Sample;
use std::fmt::Write as _;

/// Pixels of one picture.
const WIDTH: usize = 480;
const HEIGHT: usize = 400;
/// Every pixel is the mean of its square.
const SAMPLES: usize = 3;
/// Pictures side by side.
const COLUMNS: usize = 3;

/// Pictures of a run at several times.
pub struct Strip {
    /// Times of the pictures, s.
    pub times_s: Vec<f64>,
    pictures: Vec<Canvas>,
}

impl Strip {
    /// Draws the run at the samples that are current at some times. Room and scale are those of the samples from the first
    /// to the last of these times.
    pub fn new(report: &Report<'_>, times_s: &[f64]) -> Self {
        let end = times_s.iter().copied().fold(0.0, f64::max);
        let shown = report.samples.partition_point(|sample| sample.t_s <= end);
        let report = Report { samples: &report.samples[..shown], ..*report };
        let stage = Stage::new(&report);
        let (from, to) = ([16.0, 40.0], [WIDTH as f64 - 16.0, HEIGHT as f64 - 52.0]);
        let camera = Camera::fitted(stage.view, &stage.extent, from, to);
        let current = |t_s: f64| {
            let after = report.samples.partition_point(|sample| sample.t_s <= t_s + 1e-9);
            report.samples.get(after.saturating_sub(1))
        };
        let samples: Vec<&Sample> = times_s.iter().filter_map(|t_s| current(*t_s)).collect();
        let pictures = samples.iter().map(|sample| picture(&report, &stage, &camera, sample)).collect();
        Self { times_s: samples.iter().map(|sample| sample.t_s).collect(), pictures }
    }

    /// One picture as a PNG file. `None` if there is no such picture.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn picture_png(&self, k: usize) -> Option<Result<Vec<u8>, String>> {
        self.pictures.get(k).map(|canvas| canvas.png().map_err(|error| error.to_string()))
    }

    /// All pictures in rows; the SVG file holds them as bitmaps.
    pub fn files(&self) -> Files {
        [self.png(), self.svg()]
    }

    fn png(&self) -> Result<Vec<u8>, String> {
        let (columns, rows) = self.grid();
        let mut all = Canvas::new(columns * WIDTH, rows * HEIGHT);
        for (k, picture) in self.pictures.iter().enumerate() {
            all.paste(picture, (k % columns * WIDTH, k / columns * HEIGHT));
        }
        all.png().map_err(|error| error.to_string())
    }

    fn svg(&self) -> Result<Vec<u8>, String> {
        let (columns, rows) = self.grid();
        let (width, height) = (columns * WIDTH, rows * HEIGHT);
        let mut file = format!(
            "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\">\n"
        );
        for (k, picture) in self.pictures.iter().enumerate() {
            let (x, y) = (k % columns * WIDTH, k / columns * HEIGHT);
            let png = STANDARD.encode(picture.png().map_err(|error| error.to_string())?);
            let _ = writeln!(
                file,
                "<image x=\"{x}\" y=\"{y}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" href=\"data:image/png;base64,{png}\"/>"
            );
        }
        file += "</svg>\n";
        Ok(file.into_bytes())
    }

    fn grid(&self) -> (usize, usize) {
        let columns = self.pictures.len().clamp(1, COLUMNS);
        (columns, self.pictures.len().div_ceil(columns).max(1))
    }
}

fn picture(report: &Report<'_>, stage: &Stage, camera: &Camera, sample: &Sample) -> Canvas {
    let mesh = stage.mesh(report, Some(sample));
    let mut canvas = raster::render(&mesh, camera, (WIDTH, HEIGHT), SAMPLES, stage.outline_m);
    words(&mut canvas, &format!("t = {:.2} s", sample.t_s), (16, 28), 16.0, Anchor::Left, INK);
    let right = scale_bar(&mut canvas, 16, camera.pixels_per_m, "m");
    scale_bar(&mut canvas, right + 30, stage.m_per_n * camera.pixels_per_m, "N");
    canvas
}
