//! The picture of a sweep: over one variable a curve, over two a map.

use super::axis::{Axis, Scale};
use super::plan::Plan;
use super::run::{Outcome, Row};
use blindgrasp_plots::sweep::{Curve, Dot, Map, Mark, Spread, Variable};
use blindgrasp_view::Files;

/// Listed numbers that are further apart than this lie by their logarithms.
const MOST_LINEAR: f64 = 50.0;

/// Returns `true` if a sweep has a picture: if one or two keys are varied.
pub(super) fn is_drawn(plan: &Plan) -> bool {
    (1..=2).contains(&plan.axes().len())
}

/// The picture of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub enum Picture {
    /// Over one key.
    Curve(Curve),
    /// Over two.
    Map(Map),
}

/// The picture of a sweep: over one key a curve, over two a map; none over more.
pub fn picture(plan: &Plan, rows: &[Row]) -> Option<Picture> {
    match plan.axes() {
        [x] => Some(Picture::Curve(curve(plan, rows, x))),
        [x, y] => Some(Picture::Map(map(plan, rows, x, y))),
        _ => None,
    }
}

/// The [`picture`] of a sweep, as a PNG file and as an SVG file.
pub fn draw(plan: &Plan, rows: &[Row]) -> Option<Files> {
    picture(plan, rows).map(|picture| match picture {
        Picture::Curve(curve) => curve.files(),
        Picture::Map(map) => map.files(),
    })
}

fn curve(plan: &Plan, rows: &[Row], x: &Axis) -> Curve {
    let dot = |row: &Row| Dot {
        value: plan.place(row.run)[0],
        mark: mark(row),
        friction: row.summary().map_or(0.0, |summary| summary.friction_demand_max),
    };
    Curve {
        title: format!("{} over {}", plan.name(), x.key),
        x: variable(x, curve_spread(x)),
        dots: rows.iter().map(dot).collect(),
    }
}

/// Of several seeds, the map shows the worst.
fn map(plan: &Plan, rows: &[Row], x: &Axis, y: &Axis) -> Map {
    let mut marks = vec![vec![None; x.values.len()]; y.values.len()];
    for row in rows {
        let place = plan.place(row.run);
        let field = &mut marks[place[1]][place[0]];
        let mark = mark(row);
        *field = Some(field.map_or(mark, |other| worse(other, mark)));
    }
    let seeds =
        if plan.seeds() > 1 { format!(", the worst of {} seeds", plan.seeds()) } else { String::new() };
    let title = format!("{} over {} and {}{seeds}", plan.name(), x.key, y.key);
    Map { title, x: variable(x, spread(x)), y: variable(y, spread(y)), marks }
}

fn mark(row: &Row) -> Mark {
    match &row.outcome {
        Outcome::Refused(_) => Mark::Refused,
        Outcome::Ran(summary) => match (summary.lost_at_s, summary.settle_time_s) {
            (Some(t_s), _) => Mark::Lost(t_s),
            (None, Some(t_s)) => Mark::Rested(t_s),
            (None, None) => Mark::Moving(summary.duration_s),
        },
    }
}

/// The worse of two: the one that is lost, or lost sooner; the one that still moves; the one that comes to rest later.
fn worse(a: Mark, b: Mark) -> Mark {
    let badness = |mark| match mark {
        Mark::Rested(t_s) => (0, t_s),
        Mark::Moving(t_s) => (1, t_s),
        Mark::Refused => (2, 0.0),
        Mark::Lost(t_s) => (3, -t_s),
    };
    if badness(b) > badness(a) { b } else { a }
}

fn variable(axis: &Axis, spread: Spread) -> Variable {
    let values = axis.values.iter().map(|value| value.text.clone()).collect();
    Variable { name: axis.key.clone(), unit: axis.unit().to_owned(), spread, values }
}

fn spread(axis: &Axis) -> Spread {
    match axis.scale {
        Scale::Linear => Spread::Linear(numbers(axis)),
        Scale::Logarithmic => Spread::Logarithmic(numbers(axis)),
        Scale::Listed => Spread::Listed,
    }
}

/// A curve needs no even steps: in it, listed numbers lie where they belong.
fn curve_spread(axis: &Axis) -> Spread {
    let numbers = numbers(axis);
    let positive = || numbers.iter().copied().filter(|number| *number > 0.0);
    let is_wide = positive().fold(0.0, f64::max) > MOST_LINEAR * positive().fold(f64::INFINITY, f64::min);
    match axis.scale {
        Scale::Listed if !axis.is_numeric() => Spread::Listed,
        Scale::Listed if is_wide && numbers.iter().all(|number| *number >= 0.0) => {
            Spread::Logarithmic(numbers)
        }
        Scale::Listed => Spread::Linear(numbers),
        _ => spread(axis),
    }
}

fn numbers(axis: &Axis) -> Vec<f64> {
    axis.values.iter().filter_map(|value| value.number).collect()
}
