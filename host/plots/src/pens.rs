//! The pens and letters of a figure, in pixels of the finished picture times a scale.

use super::series;
use blindgrasp_view::palette::Rgb;
use plotters::prelude::{FontDesc, FontFamily, FontStyle, RGBColor, ShapeStyle, TextStyle};
use plotters::style::text_anchor::Pos;
use plotters_backend::BackendColor;
use std::fmt::Display;

const LINE_WIDTH: f64 = 1.6;
/// Size of all text but the title.
pub(super) const LABEL_SIZE: i32 = 15;

/// The dashes of a line: pixels drawn and pixels left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dash {
    /// Not broken.
    Solid,
    /// Pixels drawn, pixels left out.
    Broken(f64, f64),
}

impl Dash {
    /// The dashes of the `k`-th of several lines, so that lines that coincide still show.
    pub fn of(k: usize) -> Self {
        let broken = [(9.0, 4.0), (3.0, 3.0), (16.0, 5.0), (11.0, 11.0), (2.0, 7.0)];
        match k.checked_sub(1).and_then(|k| broken.get(k % broken.len())) {
            Some((on, off)) => Self::Broken(*on, *off),
            None => Self::Solid,
        }
    }

    /// Cuts a line; `pixels` are the lengths of a unit along both axes.
    pub(super) fn cut(self, points: Vec<(f64, f64)>, pixels: (f64, f64)) -> Vec<Vec<(f64, f64)>> {
        match self {
            Self::Solid => vec![points],
            Self::Broken(on, off) => {
                let mut dashes = series::dashes(&points, pixels, (on, off));
                dashes.retain(|dash| dash.len() > 1);
                dashes
            }
        }
    }
}

/// A plain style.
pub(super) fn ink(colour: Rgb, width: u32) -> ShapeStyle {
    ShapeStyle { color: RGBColor(colour[0], colour[1], colour[2]).into(), filled: false, stroke_width: width }
}

/// The style of a signal.
pub(super) fn pen(colour: Rgb, scale: i32) -> ShapeStyle {
    ink(colour, (LINE_WIDTH * f64::from(scale)).round() as u32)
}

/// Upright text, anchored at its upper left corner.
pub(super) fn letters(size: i32, scale: i32, colour: Rgb) -> TextStyle<'static> {
    TextStyle {
        font: FontDesc::new(FontFamily::SansSerif, f64::from(size * scale), FontStyle::Normal),
        color: BackendColor { alpha: 1.0, rgb: (colour[0], colour[1], colour[2]) },
        pos: Pos::default(),
    }
}

/// An error of Plotters in words.
pub(super) fn reason(error: impl Display) -> String {
    error.to_string()
}

/// Lets Plotters measure text: with this font under the name that its SVG files ask the viewer for.
pub(super) fn register_font() {
    static ONCE: std::sync::OnceLock<()> = std::sync::OnceLock::new();
    ONCE.get_or_init(|| {
        // Fails only for a broken font, and then drawing reports that there is none.
        let _ = plotters::style::register_font(
            "sans-serif",
            plotters::style::FontStyle::Normal,
            dejavu::sans::regular(),
        );
    });
}
