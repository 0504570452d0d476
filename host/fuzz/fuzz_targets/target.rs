//! Any bytes through the readers of files: one target for each.
//!
//! `tests/fuzz` runs them: `urdf`, `hand`, `stl`, `obj`, `object` and `scene`.
//!
//! What is checked is in `tests/broken/property.rs`, and is checked for a bounded number of inputs by `cargo test` too.

#[path = "../../tests/broken/property.rs"]
mod property;

pub(crate) use property::Reader;
use std::cell::OnceCell;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

thread_local! {
    /// A folder with the files that an input may refer to.
    static FOLDER: OnceCell<TempDir> = const { OnceCell::new() };
}

/// Gives a reader an input.
pub(crate) fn check(reader: Reader, bytes: &[u8]) {
    FOLDER.with(|folder| reader.check(bytes, folder.get_or_init(copy_of_corpus).path()));
}

fn copy_of_corpus() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/broken");
    for entry in fs::read_dir(corpus).expect("the corpus") {
        let entry = entry.expect("a file");
        fs::copy(entry.path(), folder.path().join(entry.file_name())).expect("a copy");
    }
    folder
}
