//! The files of a report.
//!
//! | file | what |
//! |---|---|
//! | `paper.html` | everything on one page, with nothing outside it |
//! | `claims.json` | the same in numbers, as `--json` prints it |
//! | `figures/*.png`, `figures/*.svg` | each figure |
//! | `sweeps/*.csv`, `sweeps/*.png`, `sweeps/*.svg` | each sweep: a row a run, and its curve or map, as `blindgrasp sweep` writes them |
//! | `traces/*.csv` | a row a millisecond, of the runs that the figures show |

use super::page;
use super::report::Paper;
use blindgrasp_sim::csv;
use blindgrasp_sim::run_dir::{RunDir, RunDirError};
use blindgrasp_sweep::{Output, OutputError};
use std::io;

/// Runs whose traces are written.
const TRACES: [&str; 5] = ["hand-arm", "hand-arm-consistent", "prism", "cube", "cube-continuous"];

/// The reason for which a report can't be written.
#[derive(Debug, thiserror::Error)]
pub enum FilesError {
    /// A directory or a file.
    #[error(transparent)]
    Directory(#[from] RunDirError),
    /// A sweep.
    #[error(transparent)]
    Sweep(#[from] OutputError),
    /// A figure.
    #[error("cannot draw {file}: {reason}")]
    Draw {
        /// Its name.
        file: String,
        /// The error of the drawing library.
        reason: String,
    },
}

/// Writes all files.
///
/// # Errors
/// The first that can't be written; those before it are there.
pub fn write(directory: &RunDir, paper: &Paper) -> Result<(), FilesError> {
    directory.create()?;
    let json = format!("{:#}\n", paper.json());
    directory.write("claims.json", |file| file.write_all(json.as_bytes()))?;
    let figures = directory.below("figures");
    figures.create()?;
    for drawn in &paper.figures {
        let failed = |reason| FilesError::Draw { file: drawn.file.to_owned(), reason };
        for (ending, drawing) in ["png", "svg"].into_iter().zip(drawn.files()) {
            let bytes = drawing.map_err(failed)?;
            figures.write(&format!("{}.{ending}", drawn.file), |file| file.write_all(&bytes))?;
        }
    }
    let page =
        page::page(paper).map_err(|reason| FilesError::Draw { file: "paper.html".to_owned(), reason })?;
    directory.write("paper.html", |file| file.write_all(page.as_bytes()))?;
    let sweeps = directory.below("sweeps");
    sweeps.create()?;
    for sweep in &paper.sweeps {
        let path = sweeps.path().join(format!("{}.csv", sweep.varied.name));
        Output::choose(&path)?.write(&sweep.plan, &sweep.rows)?;
    }
    let traces = directory.below("traces");
    traces.create()?;
    for done in paper.evidence.runs.iter().filter(|done| TRACES.contains(&done.name.as_str())) {
        let fill = |file: &mut dyn io::Write| csv::write(file, &done.run.samples);
        traces.write(&format!("{}.csv", done.name), fill)?;
    }
    Ok(())
}
