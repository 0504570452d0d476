//! The results of the runs over one variable: when they came to rest or were lost, and the friction that they asked
//! for.

use super::super::axes::{Chart, Frame, Ruler};
use super::super::drawing::{self, Drawing, PANEL_HEIGHT as ALONE_HEIGHT, PANEL_WIDTH, TITLE_HEIGHT, WIDTH};
use super::super::pens::{ink, pen, reason};
use super::super::series;
use super::Mark;
use super::key::{self, Key};
use super::variable::{Along, Spread, Variable, round_powers};
use blindgrasp_view::Files;
use blindgrasp_view::palette::{BLUE, FAINT_INK, Rgb, VERMILLION, WHITE, mix};
use plotters::coord::Shift;
use plotters::prelude::{
    Circle, DrawingArea, DrawingBackend, EmptyElement, LineSeries, PathElement, Rectangle,
};

const LEFT: i32 = 74;
const RIGHT: i32 = 10;
const LABELS_HEIGHT: i32 = 44;
const PANEL_HEIGHT: i32 = 250;
/// Half of a mark, pixels.
const MARK: i32 = 5;

/// A plot over one variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Over it.
    pub title: String,
    /// The variable.
    pub x: Variable,
    /// The results of the runs.
    pub dots: Vec<Dot>,
}

/// The result of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// The number of its value.
    pub value: usize,
    /// The outcome.
    pub mark: Mark,
    /// The friction coefficient that the grasp asked for.
    pub friction: f64,
}

/// The sign that is drawn at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sign {
    Full(Rgb),
    Hollow(Rgb),
    Cross,
}

/// A panel: its axis, its signs, and what joins them.
struct Panel {
    y: Ruler,
    signs: Vec<((f64, f64), Sign)>,
    line: Vec<(f64, f64)>,
}

impl Curve {
    /// Draws it.
    pub fn files(&self) -> Files {
        [self.png(), self.svg()]
    }

    /// The times alone as an SVG file, without title and key.
    ///
    /// # Errors
    /// What the drawing library says.
    pub fn panel_svg(&self) -> Result<Vec<u8>, String> {
        Alone(self).svg()
    }

    /// Times: at rest, still moving, or lost.
    fn times(&self, places: &[f64]) -> Panel {
        let signs = self.dots.iter().filter_map(|dot| {
            let (t_s, sign) = match dot.mark {
                Mark::Rested(t_s) => (t_s, Sign::Full(BLUE)),
                Mark::Moving(t_s) => (t_s, Sign::Hollow(FAINT_INK)),
                Mark::Lost(t_s) => (t_s, Sign::Cross),
                Mark::Refused => return None,
            };
            Some(((places[dot.value], t_s), sign))
        });
        let signs: Vec<_> = signs.collect();
        let range = series::linear_range(signs.iter().map(|((_, t_s), _)| *t_s));
        let ticks = series::ticks(&range, 6);
        let ticks = ticks.iter().map(|&tick| (tick, series::label(tick, &ticks))).collect();
        Panel { y: Ruler { words: "time, s".into(), range, ticks }, line: joined(&signs), signs }
    }

    /// The friction that the grasps asked for that held.
    fn friction(&self, places: &[f64]) -> Panel {
        let held = self.dots.iter().filter(|dot| matches!(dot.mark, Mark::Rested(_) | Mark::Moving(_)));
        let frictions = || held.clone().map(|dot| dot.friction).filter(|friction| *friction > 0.0);
        let (low, high) = series::extremes(frictions()).unwrap_or((0.0, 1.0));
        let is_wide = low > 0.0 && high > 30.0 * low;
        let to = |friction: f64| if is_wide { friction.max(low).log10() } else { friction };
        let (range, ticks) = if is_wide {
            let range = low.log10().floor()..high.log10().ceil();
            (range.clone(), round_powers(&range))
        } else {
            let range = series::linear_range(frictions());
            let ticks = series::ticks(&range, 6);
            (range, ticks.iter().map(|&tick| (tick, series::label(tick, &ticks))).collect())
        };
        let sign = |dot: &Dot| {
            if matches!(dot.mark, Mark::Moving(_)) { Sign::Hollow(FAINT_INK) } else { Sign::Full(BLUE) }
        };
        let signs: Vec<_> = held.map(|dot| ((places[dot.value], to(dot.friction)), sign(dot))).collect();
        Panel { y: Ruler { words: "friction needed, max".into(), range, ticks }, line: joined(&signs), signs }
    }

    /// Returns the stretches in which the grasp is lost, with one run at least: from the middle between a value and its
    /// neighbour to the next.
    fn lost(&self, places: &[f64], x: &Ruler) -> Vec<(f64, f64)> {
        let is_lost = |dot: &Dot| (places[dot.value], matches!(dot.mark, Mark::Lost(_)));
        let mut verdicts: Vec<(f64, bool)> = self.dots.iter().map(is_lost).collect();
        verdicts.sort_by(|a, b| a.0.total_cmp(&b.0));
        verdicts.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            kept.1 |= is_same && next.1;
            is_same
        });
        let middle = |k: usize| 0.5 * (verdicts[k].0 + verdicts[k + 1].0);
        let from = |k: usize| if k == 0 { x.range.start } else { middle(k - 1) };
        let to = |k: usize| if k + 1 == verdicts.len() { x.range.end } else { middle(k) };
        (0..verdicts.len()).filter(|&k| verdicts[k].1).map(|k| (from(k), to(k))).collect()
    }
}

/// The full signs from left to right, if there is one at each place.
fn joined(signs: &[((f64, f64), Sign)]) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> =
        signs.iter().filter(|(_, sign)| matches!(sign, Sign::Full(_))).map(|(at, _)| *at).collect();
    line.sort_by(|a, b| a.0.total_cmp(&b.0));
    if line.windows(2).any(|pair| pair[0].0 == pair[1].0) { Vec::new() } else { line }
}

impl Drawing for Curve {
    fn size(&self) -> (i32, i32) {
        (WIDTH, TITLE_HEIGHT + 2 * PANEL_HEIGHT + LABELS_HEIGHT)
    }

    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, scale: i32) -> Result<(), String> {
        let places = self.x.places();
        let x = self.ruler(&places, WIDTH - key::WIDTH);
        drawing::begin(root, &self.title, LEFT, scale)?;
        let (_, below) = root.split_vertically(TITLE_HEIGHT * scale);
        let (times, friction) = below.split_vertically(PANEL_HEIGHT * scale);
        let (times, side) = times.split_horizontally((WIDTH - key::WIDTH) * scale);
        let (friction, _) = friction.split_horizontally((WIDTH - key::WIDTH) * scale);
        self.draw_times(&times, &places, &x, 0, scale)?;
        self.explain(&side, scale)?;
        self.draw_panel(&self.friction(&places), &friction, (&places, &x), LABELS_HEIGHT - 2, scale)?;
        root.present().map_err(reason)
    }
}

/// The panel of times without title and key: for a page that has its own, and that is read on a telephone too.
struct Alone<'a>(&'a Curve);

impl Drawing for Alone<'_> {
    fn size(&self) -> (i32, i32) {
        (PANEL_WIDTH, ALONE_HEIGHT + LABELS_HEIGHT)
    }

    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, scale: i32) -> Result<(), String> {
        let Self(curve) = self;
        let places = curve.x.places();
        drawing::paper(root)?;
        curve.draw_times(root, &places, &curve.ruler(&places, PANEL_WIDTH), LABELS_HEIGHT - 2, scale)?;
        root.present().map_err(reason)
    }
}

/// Returns the colour of stretches in which the grasp is lost.
fn pale() -> Rgb {
    mix(VERMILLION, WHITE, 0.13)
}

impl Curve {
    /// The horizontal axis of a panel of some width, pixels.
    fn ruler(&self, places: &[f64], width: i32) -> Ruler {
        let (low, high) = series::extremes(places.iter().copied()).unwrap_or((0.0, 0.0));
        let air = match &self.x.spread {
            Spread::Listed => 0.5,
            _ if high > low => 0.03 * (high - low),
            _ => 0.5,
        };
        self.x.ruler(air, Along::Horizontal, width - LEFT - RIGHT)
    }

    fn draw_times<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        places: &[f64],
        x: &Ruler,
        labels: i32,
        scale: i32,
    ) -> Result<(), String> {
        let panel = self.times(places);
        let mut chart = self.draw_panel(&panel, area, (places, x), labels, scale)?;
        self.refused(&mut chart, places, panel.y.range.start, scale)
    }

    /// Draws a panel, with so many pixels for the labels of its horizontal axis; none if it has none.
    fn draw_panel<'a, B: DrawingBackend>(
        &self,
        panel: &Panel,
        area: &DrawingArea<B, Shift>,
        (places, x): (&[f64], &Ruler),
        labels: i32,
        scale: i32,
    ) -> Result<Chart<'a, B>, String> {
        let bottom = if labels > 0 { 2 } else { 7 };
        let frame = Frame { left: LEFT, right: RIGHT, top: 7, bottom, labels };
        let mut chart = frame.draw_over(area, (x, &panel.y), scale, |chart| {
            let Ruler { range, .. } = &panel.y;
            let bands = self.lost(places, x).into_iter().map(|(from, to)| {
                Rectangle::new([(from, range.start), (to, range.end)], ink(pale(), 0).filled())
            });
            chart.draw_series(bands).map(|_| ()).map_err(reason)
        })?;
        if self.x.spread != Spread::Listed {
            let line = LineSeries::new(panel.line.clone(), pen(mix(BLUE, WHITE, 0.6), scale));
            chart.draw_series(line).map_err(reason)?;
        }
        for (at, sign) in &panel.signs {
            sign.draw(&mut chart, *at, scale)?;
        }
        Ok(chart)
    }

    /// A stroke on the axis at each value that was refused.
    fn refused<B: DrawingBackend>(
        &self,
        chart: &mut Chart<'_, B>,
        places: &[f64],
        bottom: f64,
        scale: i32,
    ) -> Result<(), String> {
        let refused = self.dots.iter().filter(|dot| dot.mark == Mark::Refused);
        let stroke = |dot: &Dot| {
            let up = PathElement::new([(0, 0), (0, -3 * MARK * scale)], ink(FAINT_INK, (2 * scale) as u32));
            EmptyElement::at((places[dot.value], bottom)) + up
        };
        chart.draw_series(refused.map(stroke)).map(|_| ()).map_err(reason)
    }

    fn explain<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>, scale: i32) -> Result<(), String> {
        let mut key = Key::new(area, scale);
        let has = |is: fn(&Mark) -> bool| self.dots.iter().any(|dot| is(&dot.mark));
        for (words, sign, is) in [
            (
                "held, at rest from",
                Sign::Full(BLUE),
                (|mark| matches!(mark, Mark::Rested(_))) as fn(&Mark) -> bool,
            ),
            ("held, still moving", Sign::Hollow(FAINT_INK), |mark| matches!(mark, Mark::Moving(_))),
            ("lost at", Sign::Cross, |mark| matches!(mark, Mark::Lost(_))),
        ] {
            if has(is) {
                key.sample(words, |area, at| sign.draw_at(area, at, scale))?;
            }
        }
        if has(|mark| matches!(mark, Mark::Lost(_))) {
            key.sample("grasp lost", |area, (x, y)| {
                let half = 8 * scale;
                let corners = [(x - half, y - half), (x + half, y + half)];
                area.draw(&Rectangle::new(corners, ink(pale(), 0).filled())).map_err(reason)
            })?;
        }
        if has(|mark| *mark == Mark::Refused) {
            key.sample("refused", |area, (x, y)| {
                let ends = [(x, y - 2 * MARK * scale / 2), (x, y + 2 * MARK * scale / 2)];
                area.draw(&PathElement::new(ends, ink(FAINT_INK, (2 * scale) as u32))).map_err(reason)
            })?;
        }
        Ok(())
    }
}

impl Sign {
    fn draw<B: DrawingBackend>(
        self,
        chart: &mut Chart<'_, B>,
        at: (f64, f64),
        scale: i32,
    ) -> Result<(), String> {
        let area = chart.plotting_area().strip_coord_spec();
        let (left, top) = area.get_base_pixel();
        let (x, y) = chart.backend_coord(&at);
        self.draw_at(&area, (x - left, y - top), scale)
    }

    /// Around a pixel.
    fn draw_at<B: DrawingBackend>(
        self,
        area: &DrawingArea<B, Shift>,
        (x, y): (i32, i32),
        scale: i32,
    ) -> Result<(), String> {
        let half = MARK * scale;
        match self {
            Self::Full(colour) => {
                area.draw(&Circle::new((x, y), half - scale / 2, ink(colour, 0).filled())).map_err(reason)
            }
            Self::Hollow(colour) => {
                area.draw(&Circle::new((x, y), half - scale / 2, ink(colour, 0).filled())).map_err(reason)?;
                area.draw(&Circle::new((x, y), half - 2 * scale, ink(WHITE, 0).filled())).map_err(reason)
            }
            Self::Cross => {
                let pen = ink(VERMILLION, (2 * scale) as u32);
                area.draw(&PathElement::new([(x - half, y - half), (x + half, y + half)], pen))
                    .map_err(reason)?;
                area.draw(&PathElement::new([(x - half, y + half), (x + half, y - half)], pen))
                    .map_err(reason)
            }
        }
    }
}
