//! Two axes with their labels and grid: the frame of a chart.

use super::pens::{LABEL_SIZE, ink, letters, reason};
use blindgrasp_view::palette::{FAINT_INK, GRID, INK};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::prelude::{ChartBuilder, ChartContext, DrawingArea, DrawingBackend, LabelAreaPosition};
use std::ops::Range;

/// Between the edge of the picture and the rotated label, which Plotters sets flush.
const EDGE: i32 = 8;

/// A linear axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ruler {
    /// Its title, with its unit.
    pub(super) words: String,
    pub(super) range: Range<f64>,
    /// The places of its ticks, with their labels.
    pub(super) ticks: Vec<(f64, String)>,
}

impl Ruler {
    fn coordinate(&self) -> Ticked {
        Ticked { range: self.range.clone(), ticks: self.ticks.iter().map(|(at, _)| *at).collect() }
    }

    fn label(&self, at: f64) -> String {
        self.ticks.iter().find(|(tick, _)| *tick == at).map_or(String::new(), |(_, label)| label.clone())
    }
}

/// The frame of a chart, pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// From the left edge of the area to the chart, labels included.
    pub(super) left: i32,
    pub(super) right: i32,
    pub(super) top: i32,
    /// Below the labels of the horizontal axis.
    pub(super) bottom: i32,
    /// For the labels of the horizontal axis; none where there are none.
    pub(super) labels: i32,
}

/// A chart of these axes.
pub(super) type Chart<'a, B> = ChartContext<'a, B, Cartesian2d<Ticked, Ticked>>;

impl Frame {
    /// Draws both axes.
    pub(super) fn draw<'a, B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        axes: (&Ruler, &Ruler),
        scale: i32,
    ) -> Result<Chart<'a, B>, String> {
        self.draw_over(area, axes, scale, |_| Ok(()))
    }

    /// Draws both axes, over what `below` draws.
    pub(super) fn draw_over<'a, B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        (x, y): (&Ruler, &Ruler),
        scale: i32,
        below: impl FnOnce(&mut Chart<'a, B>) -> Result<(), String>,
    ) -> Result<Chart<'a, B>, String> {
        let mut chart = ChartBuilder::on(area)
            .margin_top(self.top * scale)
            .margin_bottom(self.bottom * scale)
            .margin_left(EDGE * scale)
            .margin_right(self.right * scale)
            .set_label_area_size(LabelAreaPosition::Left, (self.left - EDGE) * scale)
            .set_label_area_size(LabelAreaPosition::Bottom, self.labels * scale)
            .build_cartesian_2d(x.coordinate(), y.coordinate())
            .map_err(reason)?;
        below(&mut chart)?;
        chart
            .configure_mesh()
            .bold_line_style(ink(GRID, scale as u32))
            .light_line_style(ink(GRID, 0))
            .max_light_lines(0)
            .axis_style(ink(FAINT_INK, scale as u32))
            .label_style(letters(LABEL_SIZE, scale, INK))
            .axis_desc_style(letters(LABEL_SIZE, scale, INK))
            .x_label_formatter(&|at| x.label(*at))
            .y_label_formatter(&|at| y.label(*at))
            .x_desc(if self.labels > 0 { x.words.as_str() } else { "" })
            .y_desc(y.words.as_str())
            .draw()
            .map_err(reason)?;
        Ok(chart)
    }
}

/// An axis of Plotters with its ticks where we want them.
pub(super) struct Ticked {
    range: Range<f64>,
    ticks: Vec<f64>,
}

impl Ranged for Ticked {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let share = (value - self.range.start) / (self.range.end - self.range.start);
        from + (share * f64::from(to - from)).round() as i32
    }

    fn key_points<H: KeyPointHint>(&self, hint: H) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}
