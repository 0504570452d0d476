//! Curves and maps: of a run ([`write()`]), of a sweep ([`sweep`]), and of anything else ([`Figure`]).

mod axes;
mod backend;
mod chart;
mod drawing;
mod figure;
mod legend;
mod pens;
pub mod run;
mod series;
pub mod sweep;
#[cfg(test)]
mod tests;

pub use figure::{Along, Axis, Figure, Line, Panel};
pub use pens::Dash;

use blindgrasp_view::{Report, ReportError, create, save};
use std::path::Path;

/// Draws the curves of a run and writes them to `dir`, which is created if need be. Files of the same names are replaced.
///
/// A run without samples gives empty plots.
///
/// # Errors
/// The first file that could not be drawn or written; those before it are there.
pub fn write(dir: &Path, report: &Report<'_>) -> Result<(), ReportError> {
    create(dir)?;
    for plot in run::all(report.title, report.hand, report.joint_names, report.samples) {
        for (ending, drawn) in ["png", "svg"].into_iter().zip(plot.figure.files()) {
            save(dir, &format!("{}.{ending}", plot.name), drawn)?;
        }
    }
    Ok(())
}
