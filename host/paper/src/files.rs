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
use blindgrasp_files::{NewFolder, OutputError};
use blindgrasp_sim::csv;
use blindgrasp_sweep::{self as sweep, Output};
use std::io;

/// Runs whose traces are written.
const TRACES: [&str; 5] = ["hand-arm", "hand-arm-consistent", "prism", "cube", "cube-continuous"];

/// The reason for which a report can't be written.
#[derive(Debug, thiserror::Error)]
pub enum FilesError {
    /// A folder or a file.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A sweep.
    #[error(transparent)]
    Sweep(#[from] sweep::OutputError),
    /// A figure.
    #[error("cannot draw {file}: {reason}")]
    Draw {
        /// Its name.
        file: String,
        /// The error of the drawing library.
        reason: String,
    },
}

/// Writes all files into a folder.
///
/// # Errors
/// The first that can't be written.
pub fn write(folder: &NewFolder, paper: &Paper) -> Result<(), FilesError> {
    let json = format!("{:#}\n", paper.json());
    folder.write("claims.json", |file| file.write_all(json.as_bytes()))?;
    folder.below("figures")?;
    for drawn in &paper.figures {
        let failed = |reason| FilesError::Draw { file: drawn.file.to_owned(), reason };
        for (ending, drawing) in ["png", "svg"].into_iter().zip(drawn.files()) {
            let bytes = drawing.map_err(failed)?;
            folder.write(&format!("figures/{}.{ending}", drawn.file), |file| file.write_all(&bytes))?;
        }
    }
    let page =
        page::page(paper).map_err(|reason| FilesError::Draw { file: "paper.html".to_owned(), reason })?;
    folder.write("paper.html", |file| file.write_all(page.as_bytes()))?;
    let sweeps = folder.below("sweeps")?;
    for sweep in &paper.sweeps {
        Output::choose(&sweeps.join(format!("{}.csv", sweep.varied.name)))?
            .write(&sweep.plan, &sweep.rows)?;
    }
    folder.below("traces")?;
    for done in paper.evidence.runs.iter().filter(|done| TRACES.contains(&done.name.as_str())) {
        let fill = |file: &mut dyn io::Write| csv::write(file, &done.run.samples);
        folder.write(&format!("traces/{}.csv", done.name), fill)?;
    }
    Ok(())
}
