//! The part that all figures which Plotters draws have in common: a bitmap and an SVG file of the same picture, and its
//! title.

use super::backend::Pen;
use super::pens::{letters, reason, register_font};
use blindgrasp_view::canvas::Canvas;
use blindgrasp_view::palette::INK;
use blindgrasp_view::text;
use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, DrawingBackend, IntoDrawingArea, SVGBackend, Text, WHITE};
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Sizes are in pixels of the finished picture. Bitmaps are drawn this much larger and averaged down; SVG files, in which
/// Plotters rounds to whole units, count in fractions of a pixel.
const BITMAP_SCALE: i32 = 3;
const SVG_SCALE: i32 = 4;

pub(super) const WIDTH: i32 = 960;
pub(super) const TITLE_HEIGHT: i32 = 46;
/// Of a panel alone, without its labels: for a page that is read on a telephone too.
pub(super) const PANEL_WIDTH: i32 = 460;
pub(super) const PANEL_HEIGHT: i32 = 190;
const TITLE_SIZE: i32 = 21;

/// A figure.
pub(super) trait Drawing {
    /// Width and height, pixels.
    fn size(&self) -> (i32, i32);

    /// Draws it, in pixels times a scale.
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, scale: i32) -> Result<(), String>;

    /// The figure as a PNG file.
    fn png(&self) -> Result<Vec<u8>, String> {
        let (width, height) = self.size();
        let pixels = |length: i32| (length * BITMAP_SCALE) as usize;
        let mut canvas = Canvas::new(pixels(width), pixels(height));
        let root = Pen(&mut canvas).into_drawing_area();
        self.draw(&root, BITMAP_SCALE)?;
        drop(root);
        canvas.reduced(BITMAP_SCALE as usize).png().map_err(reason)
    }

    /// The figure as an SVG file.
    fn svg(&self) -> Result<Vec<u8>, String> {
        let shown = self.size();
        let (width, height) = ((shown.0 * SVG_SCALE) as u32, (shown.1 * SVG_SCALE) as u32);
        let mut file = String::new();
        let root = SVGBackend::with_string(&mut file, (width, height)).into_drawing_area();
        self.draw(&root, SVG_SCALE)?;
        drop(root);
        // The size in which a viewer shows it; the view box keeps the fine units.
        let fine = format!("width=\"{width}\" height=\"{height}\" viewBox");
        let coarse = format!("width=\"{}\" height=\"{}\" viewBox", shown.0, shown.1);
        // Areas that touch show no paper between them.
        let file =
            file.replacen(&fine, &coarse, 1).replace("<rect ", "<rect shape-rendering=\"crispEdges\" ");
        Ok(file.into_bytes())
    }
}

/// White paper.
pub(super) fn paper<B: DrawingBackend>(root: &DrawingArea<B, Shift>) -> Result<(), String> {
    register_font();
    root.fill(&WHITE).map_err(reason)
}

/// White paper, and the title, so many pixels from the left.
pub(super) fn begin<B: DrawingBackend>(
    root: &DrawingArea<B, Shift>,
    title: &str,
    left: i32,
    scale: i32,
) -> Result<(), String> {
    paper(root)?;
    let style = letters(TITLE_SIZE, scale, INK).pos(Pos::new(HPos::Left, VPos::Center));
    let corner = (left * scale, TITLE_HEIGHT / 2 * scale);
    root.draw(&Text::new(text::shortened(title, 72), corner, style)).map_err(reason)
}
