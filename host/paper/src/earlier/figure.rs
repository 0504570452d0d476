//! The figure of where the grasp comes to rest, over the gain of each law, a line for each way.

use super::{Comparison, Final, GAINS, PATHS};
use crate::figures::{Drawing, Drawn};
use crate::laws::Law::{self, Attitudes, Integral};
use blindgrasp_plots::{Along, Axis, Figure, Line, Panel};

const TITLE: &str = "Where the cube comes to rest, and with which force, by the way it took";

/// A quantity of the end of a way.
struct Quantity {
    words: &'static str,
    unit: &'static str,
    of: fn(&Final) -> f64,
    is_wide: bool,
}

const QUANTITIES: [Quantity; 4] = [
    Quantity { words: "moved along y", unit: "m", of: |end| end.moved_m[1], is_wide: false },
    Quantity { words: "turned by", unit: "rad", of: Final::turn_rad, is_wide: false },
    Quantity {
        words: "force, finger 1",
        unit: "N",
        of: |end| end.normal_force_n.first().copied().unwrap_or(f64::NAN),
        is_wide: false,
    },
    Quantity { words: "share off Eq. 57", unit: "", of: Final::off_equation_57, is_wide: true },
];

impl Comparison {
    /// The figure.
    pub(crate) fn drawn(&self) -> Drawn {
        let panels = QUANTITIES.iter().flat_map(|quantity| {
            // Both laws over the same range.
            let lines = [Attitudes, Integral].map(|law| (law, self.lines(law, quantity.of)));
            let values = || {
                lines.iter().flat_map(|(_, lines)| lines.iter().flat_map(|line| line.values.iter().copied()))
            };
            let axis = if quantity.is_wide { Axis::decades(values()) } else { Axis::linear(values()) };
            let panel = |(law, lines): &(Law, Vec<Line>)| Panel {
                heading: format!("{}: {}", term(*law), quantity.words),
                quantity: quantity.words,
                unit: quantity.unit,
                axis: axis.clone(),
                lines: lines.clone(),
            };
            lines.iter().map(panel).collect::<Vec<_>>()
        });
        let figure = Figure {
            title: TITLE.to_owned(),
            along: Along::Decades { words: "K_st, N m; K_I, N m/rad", values: GAINS.to_vec() },
            panels: panels.collect(),
        };
        Drawn {
            number: "new",
            file: "fig-earlier-law",
            title: TITLE.to_owned(),
            caption: format!(
                "The cube in the paper's model, under the paper's law and under the one before it, at the end of 14 s. On its way it is \
                 pushed with half a newton from 2 s to 3 s, or not. Lines that lie on one another: the end does not depend on the way. \
                 What has no line was lost; what is far off Eq. 57 under u_s + u_st still moves. Without a gain every grasp is lost{}. Damping is ten times that of Table VII, so that the end is seen; f_d = \
                 5 N; law every ms; no joint friction.",
                if self.ends(Law::NormalOnly, 0.0).any(Final::held) { " but some" } else { "" }
            ),
            drawing: Drawing::Chart(figure),
        }
    }

    /// A line for each way, over the gains.
    fn lines(&self, law: Law, of: fn(&Final) -> f64) -> Vec<Line> {
        let value = |gain: f64, path: &str| {
            self.ends(law, gain).find(|end| end.path == path && end.held()).map_or(f64::NAN, of)
        };
        PATHS
            .iter()
            .enumerate()
            .map(|(k, path)| {
                Line::nth(k, path.name, GAINS.iter().map(|&gain| value(gain, path.name)).collect())
            })
            .collect()
    }
}

/// Returns the term that a law has beside `u_s`: its name where there is little room.
fn term(law: Law) -> &'static str {
    match law {
        Law::NormalOnly => "u_s",
        Attitudes => "u_st",
        Integral => "u_I",
    }
}
