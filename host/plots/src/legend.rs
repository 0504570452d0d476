//! The legend at the side of a panel.

use super::figure::Panel;
use super::pens::{LABEL_SIZE, letters, pen, reason};
use blindgrasp_view::palette::INK;
use blindgrasp_view::text;
use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, DrawingBackend, PathElement, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};

pub(super) const WIDTH: i32 = 172;
pub(super) const PITCH: i32 = 19;

/// Draws heading, line samples and names.
pub(super) fn draw<B: DrawingBackend>(
    panel: &Panel,
    area: &DrawingArea<B, Shift>,
    scale: i32,
) -> Result<(), String> {
    let words = |colour| letters(LABEL_SIZE, scale, colour).pos(Pos::new(HPos::Left, VPos::Center));
    let mut y = 15;
    if !panel.heading.is_empty() {
        let at = (4 * scale, y * scale);
        area.draw(&Text::new(text::shortened(&panel.heading, 22), at, words(INK))).map_err(reason)?;
        y += PITCH;
    }
    for line in &panel.lines {
        let sample = [(4.0, f64::from(y)), (36.0, f64::from(y))];
        for part in line.dash.cut(sample.to_vec(), (1.0, 1.0)) {
            let fine = |v: f64| (v * f64::from(scale)).round() as i32;
            let part: Vec<(i32, i32)> = part.into_iter().map(|(x, y)| (fine(x), fine(y))).collect();
            area.draw(&PathElement::new(part, pen(line.colour, scale))).map_err(reason)?;
        }
        let at = (43 * scale, y * scale);
        area.draw(&Text::new(text::shortened(&line.name, 17), at, words(INK))).map_err(reason)?;
        y += PITCH;
    }
    Ok(())
}
