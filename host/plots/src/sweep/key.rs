//! The key at the side of a picture: colours and what they mean.

use super::super::pens::{LABEL_SIZE, ink, letters, reason};
use super::super::series;
use super::ramp::Ramp;
use blindgrasp_view::palette::{FAINT_INK, INK};
use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, DrawingBackend, PathElement, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};

pub(super) const WIDTH: i32 = 182;
const LEFT: i32 = 10;
const BAR_WIDTH: i32 = 18;
const BAR_HEIGHT: i32 = 112;
/// Above the first line, between a heading and its bar, below a bar, and from a sample to the next.
const TOP: i32 = 14;
const ABOVE_BAR: i32 = 18;
const BELOW_BAR: i32 = 28;
const PITCH: i32 = 22;

/// Pixels that a key takes.
pub(super) fn height(ramps: usize, samples: usize) -> i32 {
    TOP + ramps as i32 * (ABOVE_BAR + BAR_HEIGHT + BELOW_BAR) + samples as i32 * PITCH
}

/// A key that is being drawn, from the top down.
pub(super) struct Key<'a, B: DrawingBackend> {
    area: &'a DrawingArea<B, Shift>,
    scale: i32,
    y: i32,
}

impl<'a, B: DrawingBackend> Key<'a, B> {
    pub(super) fn new(area: &'a DrawingArea<B, Shift>, scale: i32) -> Self {
        Self { area, scale, y: TOP }
    }

    /// A heading and a bar of colours with its numbers, seconds.
    pub(super) fn ramp(&mut self, heading: &str, ramp: &Ramp) -> Result<(), String> {
        self.words(LEFT, self.y, heading)?;
        let top = self.y + ABOVE_BAR;
        let scale = self.scale;
        let value = |share: f64| ramp.range.start + (ramp.range.end - ramp.range.start) * share;
        for row in 0..BAR_HEIGHT {
            let colour = ramp.colour(value(1.0 - (f64::from(row) + 0.5) / f64::from(BAR_HEIGHT)));
            let corner = |x: i32, y: i32| (x * scale, y * scale);
            let (from, to) = (corner(LEFT, top + row), corner(LEFT + BAR_WIDTH, top + row + 1));
            self.area.draw(&Rectangle::new([from, to], ink(colour, 0).filled())).map_err(reason)?;
        }
        let ticks = series::ticks(&ramp.range, 4);
        for &tick in &ticks {
            let share = (tick - ramp.range.start) / (ramp.range.end - ramp.range.start);
            let y = top + (f64::from(BAR_HEIGHT) * (1.0 - share)).round() as i32;
            let right = LEFT + BAR_WIDTH;
            let line = [(right * scale, y * scale), ((right + 5) * scale, y * scale)];
            self.area.draw(&PathElement::new(line, ink(FAINT_INK, scale as u32))).map_err(reason)?;
            self.words(right + 10, y, &format!("{} s", series::label(tick, &ticks)))?;
        }
        self.y = top + BAR_HEIGHT + BELOW_BAR;
        Ok(())
    }

    /// A sample, which `draw` draws around a place, and what it means.
    pub(super) fn sample(
        &mut self,
        words: &str,
        draw: impl FnOnce(&DrawingArea<B, Shift>, (i32, i32)) -> Result<(), String>,
    ) -> Result<(), String> {
        draw(self.area, ((LEFT + BAR_WIDTH / 2) * self.scale, self.y * self.scale))?;
        self.words(LEFT + BAR_WIDTH + 10, self.y, words)?;
        self.y += PITCH;
        Ok(())
    }

    fn words(&self, x: i32, y: i32, words: &str) -> Result<(), String> {
        let style = letters(LABEL_SIZE, self.scale, INK).pos(Pos::new(HPos::Left, VPos::Center));
        let text = Text::new(words, (x * self.scale, y * self.scale), style);
        self.area.draw(&text).map_err(reason)
    }
}
