//! Figures of a run: plots, pictures of the grasp, and a short animation.
//!
//! [`write()`] leaves these files in a directory; the same run gives the same bytes.
//!
//! | file | shows |
//! |---|---|
//! | `joint-velocities.{png,svg}` | velocity of every joint, a panel for each finger |
//! | `object-velocities.{png,svg}` | velocity and angular velocity of the object |
//! | `contact-forces.{png,svg}` | normal force, the desired one of Eq. 57, tangential force, a panel for each finger |
//! | `residuals.{png,svg}` | lengths of the residuals `Delta lambda` of Eq. 38, over a logarithmic axis |
//! | `grasp-start.png`, `grasp-end.png` | hand, object and contact forces in three dimensions (bitmaps only) |
//! | `grasp.gif` | the run, in about six seconds |
//!
//! `plots` says what the plots show, `chart` draws them with Plotters; `scene3d` turns hand and object into triangles,
//! `camera` chooses where to look from, `raster` draws them, `picture` and `animation` add the words. `canvas` and
//! `text` are the bitmap under all of it. `sketch` draws a hand or an object alone, as SVG: [`hand_svg`], [`object_svg`].

mod animation;
mod camera;
pub mod canvas;
#[cfg(test)]
mod fixture;
mod input;
mod mesh;
pub mod palette;
mod palm;
mod picture;
mod quantise;
mod raster;
mod scene3d;
mod skeleton;
mod sketch;
#[cfg(feature = "strip")]
mod strip;
#[cfg(test)]
mod tests;
pub mod text;
pub mod units;

pub use input::Report;
pub use palette::{Rgb, of as colour};
pub use sketch::{hand_svg, object_svg};
#[cfg(feature = "strip")]
pub use strip::Strip;

use std::path::{Path, PathBuf};
use std::{fs, io};

/// A picture as a PNG file, and as an SVG file; or why it can't be drawn.
pub type Files = [Result<Vec<u8>, String>; 2];

/// The reason for which a report could not be written. The message has the cause in it, so that it reads whole on its
/// own.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The directory is missing and can't be made.
    #[error("cannot create the directory {}: {cause}", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
        /// The error of the system.
        cause: io::Error,
    },
    /// A file can't be written.
    #[error("cannot write {}: {cause}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        cause: io::Error,
    },
    /// A figure can't be drawn.
    #[error("cannot draw {}: {reason}", path.display())]
    Draw {
        /// The file that it was for.
        path: PathBuf,
        /// The error of the drawing library.
        reason: String,
    },
}

/// Writes a drawn file to `dir`; a file of the same name is replaced.
///
/// # Errors
/// It could not be drawn, or can't be written.
pub fn save(dir: &Path, name: &str, drawn: Result<Vec<u8>, String>) -> Result<(), ReportError> {
    let path = dir.join(name);
    match drawn {
        Ok(bytes) => fs::write(&path, bytes).map_err(|cause| ReportError::Write { path, cause }),
        Err(reason) => Err(ReportError::Draw { path, reason }),
    }
}

/// Makes the directory of a report, if need be.
///
/// # Errors
/// What the file system says.
pub fn create(dir: &Path) -> Result<(), ReportError> {
    fs::create_dir_all(dir).map_err(|cause| ReportError::Directory { path: dir.to_owned(), cause })
}

/// Draws the pictures and the animation of a run and writes them to `dir`, which is created if need be. Files of the same
/// names are replaced.
///
/// A run without samples gives a picture of the hand with all joints at zero.
///
/// # Errors
/// The first file that could not be drawn or written; those before it are there.
pub fn write(dir: &Path, report: &Report<'_>) -> Result<(), ReportError> {
    create(dir)?;
    let stage = scene3d::Stage::new(report);
    for moment in [picture::Moment::Start, picture::Moment::End] {
        save(
            dir,
            &format!("{}.png", moment.file_name()),
            picture::draw(report, &stage, moment).png().map_err(|e| e.to_string()),
        )?;
    }
    save(dir, "grasp.gif", animation::draw(report, &stage))
}
