//! Draws a figure with Plotters, once as a bitmap and once as SVG.

use super::backend::Pen;
use super::canvas::Canvas;
use super::figure::{Axis, Figure, Line, Panel};
use super::palette::{FAINT_INK, GRID, INK};
use super::pens::{LABEL_SIZE, ink, letters, pen, reason};
use super::{legend, series, text};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::prelude::{
    ChartBuilder, ChartContext, Circle, DrawingArea, DrawingBackend, IntoDrawingArea, LabelAreaPosition,
    LineSeries, PathElement, SVGBackend, Text, WHITE,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;

/// Sizes below are in pixels of the finished picture. Bitmaps are drawn this much larger and averaged down; SVG files,
/// in which Plotters rounds to whole units, count in fractions of a pixel.
const BITMAP_SCALE: i32 = 3;
const SVG_SCALE: i32 = 4;

const WIDTH: i32 = 960;
const TITLE_HEIGHT: i32 = 46;
const TIME_LABELS_HEIGHT: i32 = 42;
const VALUE_LABELS_WIDTH: i32 = 74;
/// Left of the rotated label, which Plotters sets flush.
const VALUE_MARGIN: i32 = 8;
const TITLE_SIZE: i32 = 21;
/// Of a panel alone.
const PANEL_WIDTH: i32 = 460;
const PANEL_HEIGHT: i32 = 190;

impl Figure {
    /// One panel alone as an SVG element, without title and legend: for a page that has its own, and that is read on a
    /// telephone too. `None` if there is no such panel.
    ///
    /// # Errors
    /// What the drawing library says.
    pub fn panel_svg(&self, k: usize) -> Option<Result<String, String>> {
        self.panels.get(k).map(|panel| {
            let (width, height) = (PANEL_WIDTH, PANEL_HEIGHT + TIME_LABELS_HEIGHT);
            svg_of((width, height), |root| {
                text::register_with_plotters();
                root.fill(&WHITE).map_err(reason)?;
                self.draw_panel(panel, root, true, width, SVG_SCALE)?;
                root.present().map_err(reason)
            })
        })
    }

    /// The figure as a PNG file.
    ///
    /// # Errors
    /// What the drawing library says.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        let (width, height) = self.size(BITMAP_SCALE);
        let mut canvas = Canvas::new(width as usize, height as usize);
        let root = Pen(&mut canvas).into_drawing_area();
        self.draw(&root, BITMAP_SCALE)?;
        drop(root);
        canvas.reduced(BITMAP_SCALE as usize).png().map_err(reason)
    }

    /// The figure as an SVG file.
    ///
    /// # Errors
    /// What the drawing library says.
    pub fn svg(&self) -> Result<Vec<u8>, String> {
        let (width, height) = self.size(1);
        svg_of((width as i32, height as i32), |root| self.draw(root, SVG_SCALE)).map(String::into_bytes)
    }

    /// Width and height.
    pub(super) fn size(&self, scale: i32) -> (u32, u32) {
        let panels: i32 = (0..self.panels.len()).map(|k| self.panel_height(k)).sum();
        ((WIDTH * scale) as u32, ((TITLE_HEIGHT + panels + TIME_LABELS_HEIGHT) * scale) as u32)
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

    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, scale: i32) -> Result<(), String> {
        text::register_with_plotters();
        root.fill(&WHITE).map_err(reason)?;
        let title = letters(TITLE_SIZE, scale, INK).pos(Pos::new(HPos::Left, VPos::Center));
        let corner = (VALUE_LABELS_WIDTH * scale, TITLE_HEIGHT / 2 * scale);
        root.draw(&Text::new(text::shortened(&self.title, 72), corner, title)).map_err(reason)?;
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

    fn draw_panel<B: DrawingBackend>(
        &self,
        panel: &Panel,
        area: &DrawingArea<B, Shift>,
        last: bool,
        width: i32,
        scale: i32,
    ) -> Result<(), String> {
        let time = series::to_next_tick(series::time_range(&self.times), 8);
        let time_ticks = series::ticks(&time, 8);
        let (range, ticks, prefix, factor) = match &panel.axis {
            Axis::Linear(range) => {
                let (prefix, factor) = series::prefix(range.start.abs().max(range.end.abs()));
                let range = range.start * factor..range.end * factor;
                let ticks = series::ticks(&range, 6);
                (range, ticks, prefix, factor)
            }
            Axis::Decades(range) => {
                let range = range.as_ref().unwrap_or(&(-3.0..0.0));
                let ticks = series::ticks(range, 5).into_iter().filter(|tick| tick.fract() == 0.0).collect();
                (range.start - 0.1..range.end + 0.1, ticks, "", 1.0)
            }
        };
        let mut chart = ChartBuilder::on(area)
            .margin_top(7 * scale)
            .margin_bottom(if last { 2 * scale } else { 7 * scale })
            .margin_left(VALUE_MARGIN * scale)
            .margin_right(14 * scale)
            .set_label_area_size(LabelAreaPosition::Left, (VALUE_LABELS_WIDTH - VALUE_MARGIN) * scale)
            .set_label_area_size(
                LabelAreaPosition::Bottom,
                if last { (TIME_LABELS_HEIGHT - 2) * scale } else { 0 },
            )
            .build_cartesian_2d(
                Ticked { range: time.clone(), ticks: time_ticks.clone() },
                Ticked { range: range.clone(), ticks: ticks.clone() },
            )
            .map_err(reason)?;
        let decades = matches!(panel.axis, Axis::Decades(_));
        let value_label = |tick: &f64| match decades {
            true => series::power_label(*tick),
            false => series::label(*tick, &ticks),
        };
        chart
            .configure_mesh()
            .bold_line_style(ink(GRID, scale as u32))
            .light_line_style(ink(GRID, 0))
            .max_light_lines(0)
            .axis_style(ink(FAINT_INK, scale as u32))
            .label_style(letters(LABEL_SIZE, scale, INK))
            .axis_desc_style(letters(LABEL_SIZE, scale, INK))
            .x_label_formatter(&|tick| series::label(*tick, &time_ticks))
            .y_label_formatter(&value_label)
            .x_desc(if last { "time, s" } else { "" })
            .y_desc(format!("{}, {prefix}{}", panel.quantity, panel.unit))
            .draw()
            .map_err(reason)?;
        if !decades {
            let zero = PathElement::new([(time.start, 0.0), (time.end, 0.0)], ink(FAINT_INK, scale as u32));
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
            for points in series::thinned(&self.times, &values, columns) {
                draw_line(&mut chart, points, line, scale)?;
            }
        }
        Ok(())
    }
}

/// An SVG file of a width and a height.
fn svg_of(
    (width, height): (i32, i32),
    draw: impl FnOnce(&DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), String>,
) -> Result<String, String> {
    let (fine_width, fine_height) = (width * SVG_SCALE, height * SVG_SCALE);
    let mut file = String::new();
    let root =
        SVGBackend::with_string(&mut file, (fine_width as u32, fine_height as u32)).into_drawing_area();
    draw(&root)?;
    drop(root);
    // The size in which a viewer shows it; the view box keeps the fine units.
    let fine = format!("width=\"{fine_width}\" height=\"{fine_height}\" viewBox");
    Ok(file.replacen(&fine, &format!("width=\"{width}\" height=\"{height}\" viewBox"), 1))
}

/// A linear axis with its ticks where we want them.
struct Ticked {
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

/// Draws one unbroken stretch of a signal.
fn draw_line<B: DrawingBackend>(
    chart: &mut ChartContext<'_, B, Cartesian2d<Ticked, Ticked>>,
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
