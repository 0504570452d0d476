//! A figure: panels above one another over one axis, mostly time, each with its legend at its side.

use super::pens::Dash;
use super::series;
use blindgrasp_view::palette::{self, Rgb};
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
    /// One value for each place along the figure, in the panel's unit; what is not finite is left out.
    pub values: Vec<f64>,
}

impl Line {
    /// The one after so many others of its panel: which says its colour, and whether it is broken.
    pub fn nth(k: usize, name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), colour: palette::of(k), dash: Dash::of(k), values }
    }
}

/// The vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Axis {
    /// Over this range, in the panel's unit.
    Linear(Range<f64>),
    /// Over these powers of ten; smaller values sit on the lower edge. `None` where no value is above zero.
    Decades(Option<Range<f64>>),
}

impl Axis {
    /// Linear, with room for values and zero.
    pub fn linear(values: impl Iterator<Item = f64>) -> Self {
        Self::Linear(series::linear_range(values))
    }

    /// Powers of ten, with room for values.
    pub fn decades(values: impl Iterator<Item = f64>) -> Self {
        Self::Decades(series::decades(values))
    }
}

/// The horizontal axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Along {
    /// Time, in seconds from the start.
    Times(Vec<f64>),
    /// Numbers above zero, over their powers of ten.
    Decades {
        /// The title, with the unit.
        words: &'static str,
        /// The numbers, from small to large.
        values: Vec<f64>,
    },
}

impl Along {
    /// The values.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::Times(values) | Self::Decades { values, .. } => values,
        }
    }

    /// The largest value, in words.
    pub fn end(&self) -> String {
        let last = self.values().last().copied().unwrap_or(0.0);
        match self {
            Self::Times(_) => format!("{last:.0} s"),
            Self::Decades { words, .. } => format!("{words}, up to {last}"),
        }
    }
}

/// One coordinate system.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Over the legend.
    pub heading: String,
    /// The quantity that is drawn: the axis label without the unit.
    pub quantity: &'static str,
    /// SI unit without prefix; empty for a pure number.
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
    /// The horizontal axis.
    pub along: Along,
    /// From the top.
    pub panels: Vec<Panel>,
}
