//! The results of the runs over two variables: a map of coloured fields.

use super::super::axes::{Chart, Frame, Ruler};
use super::super::drawing::{self, Drawing, PANEL_WIDTH, TITLE_HEIGHT, WIDTH};
use super::super::pens::{ink, reason};
use super::Mark;
use super::key::{self, Key};
use super::ramp::Ramp;
use super::variable::{Along, Variable, widest};
use blindgrasp_view::Files;
use blindgrasp_view::palette::{FAINT_INK, INK, Rgb};
use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, DrawingBackend, EmptyElement, PathElement, Rectangle};
use std::ops::Range;

/// Held, and not at rest.
const MOVING: Rgb = [186, 191, 199];
const LABELS_HEIGHT: i32 = 44;
/// The chart's height, pixels, and that of a field where there are few.
const LEAST_HEIGHT: i32 = 300;
const MOST_HEIGHT: i32 = 620;
const FIELD_HEIGHT: i32 = 56;
/// Half of the cross in a field that was refused, and of a sample in the key.
const CROSS: i32 = 6;
const SAMPLE: i32 = 8;

/// A map.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Over it.
    pub title: String,
    /// From left to right.
    pub x: Variable,
    /// From the bottom to the top.
    pub y: Variable,
    /// The results of the runs: for each value of `y`, one for each of `x`; none where it is not known.
    pub marks: Vec<Vec<Option<Mark>>>,
}

impl Map {
    /// Draws it.
    pub fn files(&self) -> Files {
        [self.png(), self.svg()]
    }

    /// The fields alone, and the key, as SVG files.
    ///
    /// # Errors
    /// What the drawing library says.
    pub fn panel_svgs(&self) -> Result<[Vec<u8>; 2], String> {
        Ok([Fields(self).svg()?, Explained(self).svg()?])
    }

    fn all(&self) -> impl Iterator<Item = Mark> {
        self.marks.iter().flatten().filter_map(|mark| *mark)
    }

    fn has(&self, is: impl Fn(&Mark) -> bool) -> bool {
        self.all().any(|mark| is(&mark))
    }

    /// Of the chart: so many pixels that its key has place beside it.
    fn height(&self) -> i32 {
        let key = self.key_height() - LABELS_HEIGHT;
        (FIELD_HEIGHT * self.marks.len() as i32).clamp(LEAST_HEIGHT.max(key), MOST_HEIGHT)
    }

    /// Pixels.
    fn key_height(&self) -> i32 {
        let count = |kinds: [bool; 2]| kinds.into_iter().filter(|is_there| *is_there).count();
        let ramps = [
            self.has(|mark| matches!(mark, Mark::Rested(_))),
            self.has(|mark| matches!(mark, Mark::Lost(_))),
        ];
        let samples =
            [self.has(|mark| matches!(mark, Mark::Moving(_))), self.has(|mark| *mark == Mark::Refused)];
        key::height(count(ramps), count(samples))
    }
}

/// Half of the distance between neighbours: fields touch.
fn half(places: &[f64]) -> f64 {
    match places {
        [first, .., last] => 0.5 * (last - first).abs() / (places.len() - 1) as f64,
        _ => 0.5,
    }
}

impl Drawing for Map {
    fn size(&self) -> (i32, i32) {
        (WIDTH, TITLE_HEIGHT + self.height() + LABELS_HEIGHT + 12)
    }

    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, scale: i32) -> Result<(), String> {
        let vertical = self.vertical(self.height());
        drawing::begin(root, &self.title, left(&vertical), scale)?;
        let (_, below) = root.split_vertically(TITLE_HEIGHT * scale);
        let (area, side) = below.split_horizontally((WIDTH - key::WIDTH) * scale);
        self.draw_fields(&area, &vertical, WIDTH - key::WIDTH, scale)?;
        Colours::new(self).explain(&side, self, scale)?;
        root.present().map_err(reason)
    }
}

/// The fields without title and key, and the key: for a page that is read on a telephone too.
struct Fields<'a>(&'a Map);
struct Explained<'a>(&'a Map);

impl Drawing for Fields<'_> {
    fn size(&self) -> (i32, i32) {
        (PANEL_WIDTH, LEAST_HEIGHT + LABELS_HEIGHT + 12)
    }

    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, scale: i32) -> Result<(), String> {
        drawing::paper(root)?;
        self.0.draw_fields(root, &self.0.vertical(LEAST_HEIGHT), PANEL_WIDTH, scale)?;
        root.present().map_err(reason)
    }
}

impl Drawing for Explained<'_> {
    fn size(&self) -> (i32, i32) {
        (key::WIDTH, self.0.key_height())
    }

    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, scale: i32) -> Result<(), String> {
        drawing::paper(root)?;
        Colours::new(self.0).explain(root, self.0, scale)?;
        root.present().map_err(reason)
    }
}

/// Pixels to the left of the chart, for the labels of its vertical axis.
fn left(vertical: &Ruler) -> i32 {
    46 + (widest(vertical) as i32).clamp(24, 140)
}

impl Map {
    fn vertical(&self, pixels: i32) -> Ruler {
        self.y.ruler(half(&self.y.places()), Along::Vertical, pixels)
    }

    fn draw_fields<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        vertical: &Ruler,
        width: i32,
        scale: i32,
    ) -> Result<(), String> {
        let (x, y) = (self.x.places(), self.y.places());
        let frame = Frame { left: left(vertical), right: 10, top: 4, bottom: 4, labels: LABELS_HEIGHT };
        let horizontal = self.x.ruler(half(&x), Along::Horizontal, width - frame.left - frame.right);
        let mut chart = frame.draw(area, (&horizontal, vertical), scale)?;
        let colours = Colours::new(self);
        for (row, at) in self.marks.iter().zip(&y) {
            for (mark, across) in row.iter().zip(&x) {
                if let Some(mark) = mark {
                    let field = Field { x: *across, y: *at, half: (half(&x), half(&y)) };
                    field.draw(&mut chart, colours.of(*mark), scale)?;
                }
            }
        }
        self.border(&mut chart, (&x, &y), scale)
    }

    /// A line between fields where the grasp is held and fields where it is lost.
    fn border<B: DrawingBackend>(
        &self,
        chart: &mut Chart<'_, B>,
        (x, y): (&[f64], &[f64]),
        scale: i32,
    ) -> Result<(), String> {
        let held = |column: usize, row: usize| match self.marks.get(row)?.get(column)?.as_ref()? {
            Mark::Rested(_) | Mark::Moving(_) => Some(true),
            Mark::Lost(_) => Some(false),
            Mark::Refused => None,
        };
        let differ = |a: Option<bool>, b: Option<bool>| a.zip(b).is_some_and(|(a, b)| a != b);
        let (dx, dy) = (half(x), half(y));
        let mut lines = Vec::new();
        for (row, at) in y.iter().enumerate() {
            for (column, across) in x.iter().enumerate() {
                let here = held(column, row);
                if differ(here, held(column + 1, row)) {
                    let right = 0.5 * (across + x[column + 1]);
                    lines.push([(right, at - dy), (right, at + dy)]);
                }
                if differ(here, held(column, row + 1)) {
                    let above = 0.5 * (at + y[row + 1]);
                    lines.push([(across - dx, above), (across + dx, above)]);
                }
            }
        }
        let pen = ink(INK, (2 * scale) as u32);
        chart
            .draw_series(lines.into_iter().map(|line| PathElement::new(line, pen)))
            .map(|_| ())
            .map_err(reason)
    }
}

/// The filling of a field.
enum Fill {
    Plain(Rgb),
    Crossed,
}

struct Field {
    x: f64,
    y: f64,
    half: (f64, f64),
}

impl Field {
    fn draw<B: DrawingBackend>(
        &self,
        chart: &mut Chart<'_, B>,
        fill: Fill,
        scale: i32,
    ) -> Result<(), String> {
        let Self { x, y, half: (dx, dy) } = *self;
        let (low, high) = ((x - dx, y - dy), (x + dx, y + dy));
        match fill {
            Fill::Plain(colour) => {
                let field = Rectangle::new([low, high], ink(colour, 0).filled());
                chart.draw_series([field]).map(|_| ()).map_err(reason)
            }
            Fill::Crossed => {
                // As large as in the key, or as the field has place for.
                let (width, height) = chart.plotting_area().dim_in_pixel();
                let (across, up) = (chart.x_range(), chart.y_range());
                let pixels = |half: f64, all: u32, range: Range<f64>| {
                    half * f64::from(all) / (range.end - range.start)
                };
                let place = pixels(dx, width, across).min(pixels(dy, height, up));
                let half = (0.7 * place).min(f64::from(CROSS * scale)) as i32;
                let pen = ink(FAINT_INK, scale as u32);
                let stroke = |rise: i32| PathElement::new([(-half, rise), (half, -rise)], pen);
                let cross = EmptyElement::at((x, y)) + stroke(half) + stroke(-half);
                chart.draw_series([cross]).map(|_| ()).map_err(reason)
            }
        }
    }
}

/// The colours of a map.
struct Colours {
    rested: Option<Ramp>,
    lost: Option<Ramp>,
}

impl Colours {
    fn new(map: &Map) -> Self {
        let rested = map.all().filter_map(|mark| if let Mark::Rested(t_s) = mark { Some(t_s) } else { None });
        let lost = map.all().filter_map(|mark| if let Mark::Lost(t_s) = mark { Some(t_s) } else { None });
        Self { rested: Ramp::rested(rested), lost: Ramp::lost(lost) }
    }

    fn of(&self, mark: Mark) -> Fill {
        match (mark, &self.rested, &self.lost) {
            (Mark::Rested(t_s), Some(ramp), _) | (Mark::Lost(t_s), _, Some(ramp)) => {
                Fill::Plain(ramp.colour(t_s))
            }
            (Mark::Refused, ..) => Fill::Crossed,
            _ => Fill::Plain(MOVING),
        }
    }

    fn explain<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        map: &Map,
        scale: i32,
    ) -> Result<(), String> {
        let mut key = Key::new(area, scale);
        if let Some(ramp) = &self.rested {
            key.ramp("held, at rest from", ramp)?;
        }
        if let Some(ramp) = &self.lost {
            key.ramp("lost at", ramp)?;
        }
        let corners = |(x, y): (i32, i32), half: i32| {
            let half = half * scale;
            [(x - half, y - half), (x + half, y + half)]
        };
        if map.has(|mark| matches!(mark, Mark::Moving(_))) {
            key.sample("held, still moving", |area, at| {
                area.draw(&Rectangle::new(corners(at, SAMPLE), ink(MOVING, 0).filled())).map_err(reason)
            })?;
        }
        if map.has(|mark| *mark == Mark::Refused) {
            key.sample("refused", |area, at| {
                let [low, high] = corners(at, CROSS);
                let pen = ink(FAINT_INK, scale as u32);
                area.draw(&PathElement::new([low, high], pen)).map_err(reason)?;
                area.draw(&PathElement::new([(low.0, high.1), (high.0, low.1)], pen)).map_err(reason)
            })?;
        }
        Ok(())
    }
}
