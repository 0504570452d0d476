//! A figure: panels above one another over one time axis, each with its legend at its side.

use super::palette::Rgb;
use super::pens::Dash;
use std::ops::Range;

/// One signal.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub(super) name: String,
    pub(super) colour: Rgb,
    pub(super) dash: Dash,
    /// One value for each time of the figure, in the panel's unit; what is not finite is left out.
    pub(super) values: Vec<f64>,
}

/// How values are laid out along the vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Axis {
    /// Over this range, in the panel's unit.
    Linear(Range<f64>),
    /// Over these powers of ten; smaller values sit on the lower edge. `None` where no value is above zero.
    Decades(Option<Range<f64>>),
}

/// One coordinate system.
#[derive(Clone, Debug)]
pub(super) struct Panel {
    /// Over the legend.
    pub(super) heading: String,
    /// What is drawn: the axis label without the unit.
    pub(super) quantity: &'static str,
    /// SI unit without prefix.
    pub(super) unit: &'static str,
    pub(super) axis: Axis,
    pub(super) lines: Vec<Line>,
}

/// A whole figure.
#[derive(Clone, Debug)]
pub(super) struct Figure {
    pub(super) title: String,
    /// s
    pub(super) times: Vec<f64>,
    pub(super) panels: Vec<Panel>,
}
