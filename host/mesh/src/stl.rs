//! STL, binary and ASCII.
//!
//! `stl_io` parses. It tells the two kinds apart by the file's first word alone, takes the number of triangles in a binary
//! header at its word, does not look whether a number is finite, and stops behind the first of several solids. So here the
//! kind is chosen, and what it reads is put into the one form in which it has no choice left:
//!
//! - A file is **binary** if its length is the one that the number of triangles in its header asks for, whatever the header
//!   says; many programs write `solid` there.
//! - Otherwise it is **ASCII** if it begins with `solid` and there is no zero byte in the header's place. Keywords may be in capitals, lines may end in any way, names of
//!   solids may be missing; several solids are read as one.
//! - What is neither is a binary file that was cut off, or no STL file.

use crate::limits::{COARSER, LONGEST_LINE, MAX_TRIANGLES};
use crate::soup::{Problem, Soup};
use nalgebra::Vector3;
use std::io::Cursor;

/// Bytes before the number of triangles of a binary file; and those of number and header.
const HEADER: usize = 80;
const PREFIX: usize = HEADER + 4;
/// Bytes of a triangle.
const TRIANGLE: usize = 50;

/// Reads a file.
pub(super) fn read(bytes: Vec<u8>) -> Result<Soup, Problem> {
    let declared = bytes
        .get(HEADER..PREFIX)
        .and_then(|count| count.try_into().ok())
        .map(|count| u32::from_le_bytes(count) as usize);
    let expected = declared.and_then(|count| count.checked_mul(TRIANGLE)?.checked_add(PREFIX));
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes).trim_ascii_start();
    let is_text = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        && !text[..text.len().min(PREFIX)].contains(&0);
    match (declared, expected) {
        (Some(count), Some(expected)) if expected == bytes.len() => binary(bytes, count),
        _ if is_text => ascii(text),
        // Some programs append something of their own.
        (Some(count), Some(expected)) if expected < bytes.len() && count > 0 => binary(bytes, count),
        (Some(count), _) => {
            let fitting = (bytes.len() - PREFIX) / TRIANGLE;
            Err(Problem::new(
                format!("its header says {count} triangles, but there is room for {fitting}"),
                "it was cut off, or is no STL file: export it again",
            ))
        }
        (None, _) => Err(Problem::new("is too short for an STL file", "export it again")),
    }
}

fn binary(mut bytes: Vec<u8>, count: usize) -> Result<Soup, Problem> {
    too_many(count)?;
    // A header that looks like text would be taken for it.
    bytes[..HEADER].fill(0);
    gather(bytes, count, |_| None)
}

fn ascii(text: &[u8]) -> Result<Soup, Problem> {
    let mut clean = b"solid x\n".to_vec();
    // Where each triangle begins, lines from 1.
    let mut lines_of = Vec::new();
    // Without its end the last triangles are missing.
    let mut ended = false;
    for (line, words) in lines(text) {
        let words = words.trim_ascii();
        if words.len() > LONGEST_LINE {
            return Err(Problem::new(
                format!("line {line} has {} bytes", words.len()),
                "export it again: a line holds a vertex",
            ));
        }
        let first = words.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        let is = |keyword: &[u8]| first.eq_ignore_ascii_case(keyword);
        if is(b"solid") || is(b"endsolid") {
            ended = is(b"endsolid");
            continue;
        }
        let coordinates = words.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).skip(1);
        if is(b"vertex")
            && let Some(word) = coordinates.map(String::from_utf8_lossy).find(|word| !is_finite(word))
        {
            let word = super::excerpt(&word);
            return Err(Problem::new(
                format!("line {line}: `{word}` is not a finite number"),
                "export it again",
            ));
        }
        if is(b"facet") {
            lines_of.push(line);
            too_many(lines_of.len())?;
        }
        clean.extend(words.iter().map(u8::to_ascii_lowercase));
        clean.push(b'\n');
    }
    if !ended {
        return Err(Problem::new("ends without `endsolid`", "it was cut off: export it again"));
    }
    clean.extend(b"endsolid x\n");
    gather(clean, lines_of.len(), |triangle| lines_of.get(triangle).copied())
}

/// Returns `true` if a word is a number that a binary file could hold.
fn is_finite(word: &str) -> bool {
    word.parse::<f32>().is_ok_and(f32::is_finite)
}

fn too_many(count: usize) -> Result<(), Problem> {
    if count <= MAX_TRIANGLES {
        return Ok(());
    }
    Err(Problem::new(format!("has {count} triangles: at most {MAX_TRIANGLES} are read"), COARSER))
}

/// Lines with their numbers from 1. Where nothing else ends them, `\r` does, as it once did.
fn lines(text: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let end = if text.contains(&b'\n') { b'\n' } else { b'\r' };
    text.split(move |&byte| byte == end).enumerate().map(|(index, line)| (index + 1, line))
}

/// Lets the library read what is known to be one solid of so many triangles.
fn gather(bytes: Vec<u8>, count: usize, line_of: impl Fn(usize) -> Option<usize>) -> Result<Soup, Problem> {
    let mut soup = Soup::with_capacity(count);
    let place = |triangle: usize| match line_of(triangle) {
        Some(line) => format!("triangle {} (line {line})", triangle + 1),
        None => format!("triangle {}", triangle + 1),
    };
    let unreadable = |triangle: usize, error: std::io::Error| {
        Problem::new(format!("{}: {error}", place(triangle)), "export it again")
    };
    let mut cursor = Cursor::new(bytes);
    let reader = stl_io::create_stl_reader(&mut cursor).map_err(|error| unreadable(0, error))?;
    for (triangle, read) in reader.enumerate() {
        let read = read.map_err(|error| unreadable(triangle, error))?;
        let corners = read.vertices.map(|vertex| Vector3::from(vertex.0.map(f64::from)));
        if !corners.iter().all(|corner| corner.iter().all(|v| v.is_finite())) {
            return Err(Problem::new(
                format!("{} has a corner that is not a number", place(triangle)),
                "export it again",
            ));
        }
        soup.push(corners, triangle);
    }
    Ok(soup)
}
