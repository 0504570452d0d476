//! Wavefront OBJ.
//!
//! `tobj` parses. It is given vertices and faces alone, line by line: so a missing material library is nothing to it, names
//! and comments may be in any encoding, groups do not matter, and where it stops is the line that it stopped at. Normals and
//! texture coordinates are not needed, and their indices would overflow it in a debug build. It would cut polygons into fans,
//! which is wrong where they are not convex; so it leaves them whole, and they are cut here.

use crate::limits::{COARSER, LONGEST_LINE, MAX_CORNERS, MAX_TRIANGLES, MOST_LOOKS};
use crate::polygon::triangles;
use crate::soup::{Problem, Soup};
use nalgebra::Vector3;
use std::io::{self, BufRead, Read};
use tobj::{LoadError, LoadOptions};

/// A file cannot use more vertices than its triangles have corners, if none is idle; some are.
const MAX_VERTICES: usize = 3 * MAX_TRIANGLES;

/// Reads a file.
pub(super) fn read(bytes: Vec<u8>) -> Result<Soup, Problem> {
    let bytes = joined(bytes);
    check_counts(&bytes)?;
    let mut lines = Lines { rest: &bytes, buffer: Vec::new(), at: 0, line: 0 };
    let materials = |_: &std::path::Path| Ok(Default::default());
    let loaded = tobj::load_obj_buf(&mut lines, &LoadOptions::default(), materials);
    let (models, _) = loaded.map_err(|error| match error {
        LoadError::FaceVertexOutOfBounds => beyond(&bytes),
        error => {
            let words = String::from_utf8_lossy(&lines.buffer);
            let words = super::excerpt(words.trim());
            let (problem, remedy) = match error {
                LoadError::PositionParseError => {
                    (format!("`{words}` is no vertex"), "has to be `v x y z`, in numbers")
                }
                LoadError::FaceParseError => {
                    (format!("`{words}` is no face"), "has to be `f` and the numbers of its vertices")
                }
                error => (error.to_string(), "export it again as triangles or polygons"),
            };
            Problem::new(format!("line {}: {problem}", lines.line), remedy)
        }
    })?;
    let mut soup = Soup::default();
    let mut face = 0;
    let mut looks = MOST_LOOKS;
    for mesh in models.into_iter().map(|model| model.mesh) {
        let corner = |index: &u32| Vector3::from_fn(|k, _| mesh.positions[3 * *index as usize + k]);
        let mut indices = mesh.indices.as_slice();
        // Without arities, all are triangles.
        let count = if mesh.face_arities.is_empty() { indices.len() / 3 } else { mesh.face_arities.len() };
        for k in 0..count {
            let arity = mesh.face_arities.get(k).map_or(3, |&arity| arity as usize);
            let (own, rest) = indices.split_at(arity.min(indices.len()));
            indices = rest;
            let corners: Vec<Vector3<f64>> = own.iter().map(corner).collect();
            if !corners.iter().all(|corner| corner.iter().all(|v| v.is_finite())) {
                return Err(Problem::new(
                    format!("face {} has a corner that is not a number", face + 1),
                    "export it again",
                ));
            }
            if corners.len() < 3 {
                return Err(Problem::new(
                    format!("face {} has {} corners", face + 1, corners.len()),
                    "export a surface: points and lines enclose no body",
                ));
            }
            let Some(cut) = triangles(&corners, &mut looks) else {
                return Err(Problem::new(
                    format!(
                        "face {}: its outline, and those before, wind too much to be cut into triangles",
                        face + 1
                    ),
                    "export triangles",
                ));
            };
            for [a, b, c] in cut {
                soup.push([corners[a], corners[b], corners[c]], face);
            }
            face += 1;
        }
    }
    if face == 0 {
        return Err(Problem::new("has no face", "export the surface of the body; is this an OBJ file?"));
    }
    Ok(soup)
}

/// A line that ends in a backslash goes on in the next. Where nothing else ends lines, `\r` does, as it once did.
fn joined(mut bytes: Vec<u8>) -> Vec<u8> {
    if !bytes.contains(&b'\n') {
        bytes.iter_mut().filter(|byte| **byte == b'\r').for_each(|byte| *byte = b'\n');
    }
    for k in 1..bytes.len() {
        let before = if bytes[k - 1] == b'\r' { k.checked_sub(2) } else { Some(k - 1) };
        if let Some(slash) = before
            && bytes[k] == b'\n'
            && bytes[slash] == b'\\'
        {
            // One line then, and one line less in what is said of those behind it.
            bytes[slash..=k].fill(b' ');
        }
    }
    bytes
}

/// Returns `v` or `f` for a line that describes a vertex or a face.
fn kind(line: &[u8]) -> Option<u8> {
    match line.trim_ascii_start() {
        [kind @ (b'v' | b'f'), next, ..] if next.is_ascii_whitespace() => Some(*kind),
        _ => None,
    }
}

/// A vertex without its colour: where only some have one, the library counts colours and vertices as one.
fn without_colour(line: &[u8]) -> &[u8] {
    let is_start =
        |k: &usize| !line[*k].is_ascii_whitespace() && (*k == 0 || line[k - 1].is_ascii_whitespace());
    let mut words = (0..line.len()).filter(is_start);
    // The keyword, three coordinates, three shares.
    let colour = words.nth(4);
    match (colour, words.nth(1)) {
        (Some(colour), Some(_)) => &line[..colour],
        _ => line,
    }
}

/// Before anything is kept: there may be billions.
fn check_counts(bytes: &[u8]) -> Result<(), Problem> {
    let fail = |what: String| Err(Problem::new(what, COARSER));
    let (mut vertices, mut triangles) = (0, 0_usize);
    for (line, words) in bytes.split(|&byte| byte == b'\n').enumerate() {
        match kind(words) {
            Some(b'v') if words.len() > LONGEST_LINE => {
                return fail(format!("line {} has {} bytes", line + 1, words.len()));
            }
            Some(b'v') => vertices += 1,
            Some(_) => {
                let corners =
                    words.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).count() - 1;
                if corners > MAX_CORNERS {
                    let what = format!(
                        "line {}: a face with {corners} corners: at most {MAX_CORNERS} are read",
                        line + 1
                    );
                    return fail(what);
                }
                triangles += corners.saturating_sub(2).max(1);
            }
            None => {}
        }
    }
    if triangles > MAX_TRIANGLES {
        return fail(format!("has {triangles} triangles: at most {MAX_TRIANGLES} are read"));
    }
    if vertices > MAX_VERTICES {
        return fail(format!("has {vertices} vertices: at most {MAX_VERTICES} are read"));
    }
    Ok(())
}

/// The first face that names a vertex that there is not. Looked for only when it is known that there is one.
fn beyond(bytes: &[u8]) -> Problem {
    let count = bytes.split(|&byte| byte == b'\n').filter(|line| kind(line) == Some(b'v')).count();
    let mut before = 0;
    for (line, words) in bytes.split(|&byte| byte == b'\n').enumerate() {
        match kind(words) {
            Some(b'v') => before += 1,
            Some(_) => {
                for word in words.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).skip(1) {
                    let number = word.split(|&byte| byte == b'/').next().unwrap_or_default();
                    let number =
                        std::str::from_utf8(number).ok().and_then(|number| number.parse::<i64>().ok());
                    let there = match number {
                        Some(number) if number > 0 => number as u64 <= count as u64,
                        Some(number) => number < 0 && number.unsigned_abs() <= before,
                        None => false,
                    };
                    if !there {
                        let named =
                            number.map_or("no vertex".to_owned(), |number| format!("vertex {number}"));
                        return Problem::new(
                            format!("line {}: {named}, but there are {count} vertices", line + 1),
                            "export it again",
                        );
                    }
                }
            }
            None => {}
        }
    }
    Problem::new("a face names a vertex that there is not", "export it again")
}

/// Gives out the lines that matter one by one, and knows which was the last.
struct Lines<'a> {
    rest: &'a [u8],
    buffer: Vec<u8>,
    at: usize,
    /// The last line given out, from 1.
    line: usize,
}

impl BufRead for Lines<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.at >= self.buffer.len() && !self.rest.is_empty() {
            let end = self.rest.iter().position(|&byte| byte == b'\n').unwrap_or(self.rest.len());
            let line = &self.rest[..end];
            self.rest = self.rest.get(end + 1..).unwrap_or_default();
            self.line += 1;
            if let Some(kind) = kind(line) {
                self.buffer = if kind == b'v' { without_colour(line) } else { line }.to_vec();
                self.buffer.push(b'\n');
                self.at = 0;
            }
        }
        Ok(&self.buffer[self.at.min(self.buffer.len())..])
    }

    fn consume(&mut self, count: usize) {
        self.at += count;
    }
}

impl Read for Lines<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(out)?;
        self.consume(count);
        Ok(count)
    }
}
