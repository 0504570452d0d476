//! Draws a figure of panels over time, or over something else.

use super::axes::{Chart, Frame, Ruler};
use super::drawing::{self, Drawing, PANEL_HEIGHT, PANEL_WIDTH, TITLE_HEIGHT, WIDTH};
use super::figure::{Along, Axis, Figure, Line, Panel};
use super::pens::{LABEL_SIZE, ink, letters, pen, reason};
use super::{legend, series};
use blindgrasp_view::Files;
use blindgrasp_view::palette::FAINT_INK;
use plotters::coord::Shift;
use plotters::prelude::{Circle, DrawingArea, DrawingBackend, LineSeries, PathElement, Text};
use std::ops::Range;

const TIME_LABELS_HEIGHT: i32 = 42;
const VALUE_LABELS_WIDTH: i32 = 74;

/// A panel without title and legend: for a page that has its own, and that is read on a telephone too.
struct Alone<'a>(&'a Figure, &'a Panel);

impl Drawing for Alone<'_> {
    fn size(&self) -> (i32, i32) {
        (PANEL_WIDTH, PANEL_HEIGHT + TIME_LABELS_HEIGHT)
    }

    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, scale: i32) -> Result<(), String> {
        let Self(figure, panel) = self;
        drawing::paper(root)?;
        figure.draw_panel(panel, root, true, PANEL_WIDTH, scale)?;
        root.present().map_err(reason)
    }
}

impl Drawing for Figure {
    fn size(&self) -> (i32, i32) {
        let panels: i32 = (0..self.panels.len()).map(|k| self.panel_height(k)).sum();
        (WIDTH, TITLE_HEIGHT + panels + TIME_LABELS_HEIGHT)
    }

    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, scale: i32) -> Result<(), String> {
        drawing::begin(root, &self.title, VALUE_LABELS_WIDTH, scale)?;
        let mut top = TITLE_HEIGHT;
        for (k, panel) in self.panels.iter().enumerate() {
            let last = k + 1 == self.panels.len();
            let height = self.panel_height(k) + if last { TIME_LABELS_HEIGHT } else { 0 };
            let (_, below) = root.split_vertically(top * scale);
            let (area, _) = below.split_vertically(height * scale);
            let (chart, legend) = area.split_horizontally((WIDTH - legend::WIDTH) * scale);
            self.draw_panel(panel, &chart, last, WIDTH - legend::WIDTH, scale)?;
            legend::draw(panel, &legend, scale)?;
            top += height;
        }
        root.present().map_err(reason)
    }
}

impl Figure {
    /// Draws it.
    pub fn files(&self) -> Files {
        [self.png(), self.svg()]
    }

    /// One panel alone as an SVG file, without title and legend. `None` if there is no such panel.
    ///
    /// # Errors
    /// What the drawing library says.
    pub fn panel_svg(&self, k: usize) -> Option<Result<Vec<u8>, String>> {
        self.panels.get(k).map(|panel| Alone(self, panel).svg())
    }

    fn panel_height(&self, k: usize) -> i32 {
        let usual = match self.panels.len() {
            0..=2 => 260,
            3 => 205,
            _ => 175,
        };
        let lines = self.panels.get(k).map_or(0, |panel| panel.lines.len() as i32);
        usual.max((lines + 2) * legend::PITCH)
    }

    fn draw_panel<B: DrawingBackend>(
        &self,
        panel: &Panel,
        area: &DrawingArea<B, Shift>,
        last: bool,
        width: i32,
        scale: i32,
    ) -> Result<(), String> {
        let labelled = |ticks: Vec<f64>, label: &dyn Fn(f64, &[f64]) -> String| {
            ticks.iter().map(|&tick| (tick, label(tick, &ticks))).collect()
        };
        let powers = |range: &Range<f64>| {
            let whole = series::ticks(range, 5).into_iter().filter(|tick| tick.fract() == 0.0);
            labelled(whole.collect(), &|tick, _| series::power_label(tick))
        };
        let (time, places) = match &self.along {
            Along::Times(times) => {
                let range = series::to_next_tick(series::time_range(times), 8);
                let ticks = labelled(series::ticks(&range, 8), &series::label);
                (Ruler { words: "time, s".into(), ticks, range }, times.clone())
            }
            Along::Decades { words, values } => {
                let places: Vec<f64> = values.iter().map(|value| value.log10()).collect();
                let range = series::time_range(&places);
                let air = 0.03 * (range.end - range.start);
                let range = range.start - air..range.end + air;
                (Ruler { words: (*words).into(), ticks: powers(&range), range }, places)
            }
        };
        let (range, ticks, prefix, factor) = match &panel.axis {
            Axis::Linear(range) => {
                let (prefix, factor) = blindgrasp_view::units::prefix(range.start.abs().max(range.end.abs()));
                let range = range.start * factor..range.end * factor;
                let ticks = labelled(series::ticks(&range, 6), &series::label);
                (range, ticks, prefix, factor)
            }
            Axis::Decades(range) => {
                let range = range.as_ref().unwrap_or(&(-3.0..0.0));
                (range.start - 0.1..range.end + 0.1, powers(range), "", 1.0)
            }
        };
        let words = match panel.unit {
            "" => panel.quantity.to_owned(),
            unit => format!("{}, {prefix}{unit}", panel.quantity),
        };
        let values = Ruler { words, range: range.clone(), ticks };
        let frame = Frame {
            left: VALUE_LABELS_WIDTH,
            right: 14,
            top: 7,
            bottom: if last { 2 } else { 7 },
            labels: if last { TIME_LABELS_HEIGHT - 2 } else { 0 },
        };
        let mut chart = frame.draw(area, (&time, &values), scale)?;
        let decades = matches!(panel.axis, Axis::Decades(_));
        if !decades {
            let zero = PathElement::new(
                [(time.range.start, 0.0), (time.range.end, 0.0)],
                ink(FAINT_INK, scale as u32),
            );
            chart.draw_series([zero]).map_err(reason)?;
        }
        if panel.axis == Axis::Decades(None) {
            let (_, height) = chart.plotting_area().dim_in_pixel();
            let at = ((VALUE_LABELS_WIDTH + 12) * scale, height as i32 / 2);
            let style = letters(LABEL_SIZE, scale, FAINT_INK);
            return area.draw(&Text::new("no values above zero", at, style)).map_err(reason);
        }
        // Columns of the bitmap as it is shown: finer ones can't be told apart.
        let columns = (width - VALUE_LABELS_WIDTH) as usize;
        for line in &panel.lines {
            let values: Vec<f64> = match decades {
                // Zero has no logarithm; it sits on the lower edge with all that is too small.
                true => line.values.iter().map(|v| v.max(0.0).log10().max(range.start) + 0.0 * v).collect(),
                false => line.values.iter().map(|v| v * factor).collect(),
            };
            for points in series::thinned(&places, &values, columns) {
                draw_line(&mut chart, points, line, scale)?;
            }
        }
        Ok(())
    }
}

/// Draws one unbroken stretch of a signal.
fn draw_line<B: DrawingBackend>(
    chart: &mut Chart<'_, B>,
    points: Vec<(f64, f64)>,
    line: &Line,
    scale: i32,
) -> Result<(), String> {
    let style = pen(line.colour, scale);
    if let [single] = points.as_slice() {
        return chart
            .draw_series([Circle::new(*single, 2 * scale, style.filled())])
            .map(|_| ())
            .map_err(reason);
    }
    let (width, height) = chart.plotting_area().dim_in_pixel();
    let (times, values) = (chart.x_range(), chart.y_range());
    let shown = |pixels: u32| f64::from(pixels) / f64::from(scale);
    let pixels = (shown(width) / (times.end - times.start), shown(height) / (values.end - values.start));
    line.dash
        .cut(points, pixels)
        .into_iter()
        .try_for_each(|part| chart.draw_series(LineSeries::new(part, style)).map(|_| ()).map_err(reason))
}
