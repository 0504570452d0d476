//! Meshes: files of triangles (STL, OBJ), read, repaired and searched. Which file it is, and what is said of it, is the
//! model's business; here are bytes and numbers.
//!
//! ```text
//! file (.stl, .obj) -> triangles, each for itself -> metres -> vertices welded -> repaired -> vertices, triangles -> faces
//! ```
//!
//! The last step is [`Polyhedron::mesh`](blindgrasp_body::polyhedron::Polyhedron::mesh); it is the same for triangles that
//! stand in the file of an object. What is repaired, and what is not:
//!
//! | what | how |
//! |---|---|
//! | vertices within 1e-6 of the body's diagonal of another | welded; a notice, if they were not the same to the bit |
//! | triangles without area, or there twice | left out; a notice |
//! | triangles turned against their neighbours, or a body inside out | turned over; a notice |
//! | cracks: open edges whose vertices are within 1e-4 of the diagonal | welded; a notice |
//! | open edges with a neighbour's vertex in their middle | cut there; a notice |
//! | slivers | kept: they take the face beside them |
//! | other open edges; edges of three triangles; several parts; one-sided surfaces; no volume | refused, with the place |
//! | a surface that cuts through itself | read; `object check` finds it |
//!
//! Tolerances are lengths in comparison with the diagonal of the box around the body; nothing else hangs on exact
//! arithmetic: that a surface is closed and which way it is turned follows from the numbers of its vertices alone. Everything
//! is bounded before room is made for it (`limits`), and takes `n log n` steps.

use std::ffi::OsStr;
use std::path::Path;

mod boxes;
mod cracks;
mod crossing;
pub mod limits;
mod obj;
mod polygon;
mod repair;
mod soup;
mod stl;
#[cfg(test)]
mod tests;
mod unit;
mod weld;

pub use boxes::Boxes;
pub use crossing::{Crossings, crossings};
pub use repair::Repaired;
pub use soup::{Problem, Soup};
pub use unit::Unit;

/// No body has a vertex farther than this from the origin, m.
const FARTHEST_M: f64 = 1e6;

/// The most that is quoted of a file in a problem, characters.
const LONGEST_EXCERPT: usize = 60;

/// A format of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Stereolithography, as text or as bytes.
    Stl,
    /// Wavefront.
    Obj,
}

impl Format {
    /// Returns the format that a file's name ends in, if it is that of a mesh.
    pub fn of(name: &OsStr) -> Option<Self> {
        match Path::new(name).extension()?.to_string_lossy().to_ascii_lowercase().as_str() {
            "stl" => Some(Self::Stl),
            "obj" => Some(Self::Obj),
            _ => None,
        }
    }
}

/// Reads the triangles of a file, each for itself, in its own unit.
///
/// # Errors
/// The fault of the file, with its place.
pub fn parse(format: Format, bytes: Vec<u8>) -> Result<Soup, Problem> {
    match format {
        Format::Stl => stl::read(bytes),
        Format::Obj => obj::read(bytes),
    }
}

/// Returns the closed surface in metres that the triangles of a file enclose.
///
/// # Errors
/// The first fault that keeps them from enclosing one body.
pub fn body(mut soup: Soup, unit: Unit, scale: f64) -> Result<Repaired, Problem> {
    soup.scale(|length| unit.metres(length * scale));
    let is_far = |corner: &nalgebra::Vector3<f64>| !(corner.amax() <= FARTHEST_M);
    if let Some(k) = soup.triangles.iter().position(|corners| corners.iter().any(is_far)) {
        let number = soup.numbers[k] + 1;
        let what = format!("triangle {number} has a corner more than {FARTHEST_M:e} m from the origin");
        return Err(Problem::new(what, "check its unit and its scale, or export it again"));
    }
    repair::repair(soup).map_err(|fault| Problem::new(fault.to_string(), fault.remedy()))
}

/// As much of a file's text as an error quotes.
fn excerpt(text: &str) -> String {
    match text.char_indices().nth(LONGEST_EXCERPT) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.into(),
    }
}
