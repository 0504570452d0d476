//! A figure: panels above one another over one time axis, each with its legend at its side.

use super::palette::Rgb;
use super::pens::Dash;
use std::ops::Range;

/// One signal.
#[derive(Clone, Debug)]
pub struct Line {
    /// In the legend.
    pub name: String,
    /// Its colour.
    pub colour: Rgb,
    /// Solid or broken.
    pub dash: Dash,
    /// One value for each time of the figure, in the panel's unit; what is not finite is left out.
    pub values: Vec<f64>,
}

/// How values are laid out along the vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Axis {
    /// Over this range, in the panel's unit.
    Linear(Range<f64>),
    /// Over these powers of ten; smaller values sit on the lower edge. `None` where no value is above zero.
    Decades(Option<Range<f64>>),
}

/// One coordinate system.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Over the legend.
    pub heading: String,
    /// What is drawn: the axis label without the unit.
    pub quantity: &'static str,
    /// SI unit without prefix.
    pub unit: &'static str,
    /// Its vertical axis.
    pub axis: Axis,
    /// The signals.
    pub lines: Vec<Line>,
}

/// A whole figure.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Over it all.
    pub title: String,
    /// Times of the values, s.
    pub times: Vec<f64>,
    /// From the top.
    pub panels: Vec<Panel>,
}
