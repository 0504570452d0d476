//! Damaged copies of the broken inputs, and of what is shipped, hold what [`property`](super::property) says; the fuzz
//! targets go on from here.

use super::copy_of_corpus;
use super::property::Reader;
use std::fs;
use std::path::{Path, PathBuf};

/// Copies for each reader.
const COPIES: usize = 500;

/// The files that each reader starts from: the corpus's files for it, and shipped ones.
const READERS: [(Reader, &str, &str, &str); 6] = [
    (Reader::Urdf, "urdf-", ".urdf", ""),
    (Reader::Stl, "stl-", ".stl", "objects"),
    (Reader::Obj, "obj-", ".obj", "objects"),
    (Reader::Object, "object-", ".toml", "objects"),
    (Reader::Hand, "hand-", ".toml", "hands"),
    (Reader::Scene, "scene-", ".toml", "scenes"),
];

/// The pieces that may stand in the place of something else.
const PIECES: [&[u8]; 16] = [
    b"0",
    b"-1",
    b"1e-40",
    b"1e308",
    b"nan",
    b"-inf",
    b"4294967296",
    b"\"",
    b"\n",
    b"\r\n",
    b"\0",
    b"\xff",
    b"[",
    b"<",
    b"/>",
    b"= ",
];

#[test]
fn damaged_copies_are_refused_in_one_line_or_can_be_written_and_read_again() {
    for (reader, prefix, ending, shipped) in READERS {
        let folder = copy_of_corpus();
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(shipped);
        let mut seeds = files(folder.path(), prefix, ending);
        assert!(!seeds.is_empty());
        if !shipped.is_empty() {
            seeds.extend(files(&models, "", ending));
        }
        let seeds: Vec<Vec<u8>> = seeds.iter().map(|path| fs::read(path).unwrap()).collect();
        let good: Vec<Vec<u8>> =
            seeds.iter().filter(|seed| reader.check(seed, folder.path())).cloned().collect();
        let mut accepted = 0;
        for copy in 0..COPIES {
            let mut random = fastrand::Rng::with_seed(copy as u64);
            // Of every second nothing was wrong.
            let originals = if copy % 2 == 0 { &good } else { &seeds };
            let mut bytes = originals[random.usize(..originals.len())].clone();
            for _ in 0..random.usize(1..=if copy % 2 == 0 { 1 } else { 3 }) {
                damage(&mut bytes, &seeds, &mut random);
            }
            accepted += usize::from(reader.check(&bytes, folder.path()));
        }
        println!(
            "{reader:?}: {} seeds, {} of them good; {accepted} of {COPIES} damaged copies accepted",
            seeds.len(),
            good.len()
        );
        assert!(accepted > COPIES / 100 && accepted < COPIES);
    }
}

/// The files of a folder by the ends of their names, in an order that does not depend on the file system.
fn files(folder: &Path, prefix: &str, ending: &str) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            let name = path.file_name().unwrap().to_str().unwrap();
            name.starts_with(prefix) && name.ends_with(ending)
        })
        .collect();
    files.sort();
    files
}

/// One change.
fn damage(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], random: &mut fastrand::Rng) {
    let at = random.usize(..=bytes.len());
    let until = (at + random.usize(..20)).min(bytes.len());
    match random.u8(..7) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..until)),
        2 => {
            let other = &seeds[random.usize(..seeds.len())];
            let from = random.usize(..=other.len());
            let part = &other[from..(from + random.usize(..400)).min(other.len())];
            drop(bytes.splice(at..at, part.iter().copied()));
        }
        3 if until > at => bytes[at] ^= 1 << random.u8(..8),
        _ => {
            // A whole word, where there is one: numbers become other numbers.
            let is_end = |byte: &u8| byte.is_ascii_whitespace() || b"\"<>=,[]".contains(byte);
            let end = at + bytes[at..].iter().position(is_end).unwrap_or(0);
            let piece = PIECES[random.usize(..PIECES.len())];
            drop(bytes.splice(at..end, piece.iter().copied()));
        }
    }
}
