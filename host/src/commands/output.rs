//! Files that are written, and not over others.

use anyhow::{Context, bail};
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

/// Creates a file; one that is there already is only overwritten by `force`.
pub(super) fn create(path: &Path, force: bool) -> anyhow::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true);
    let options = if force { options.create(true).truncate(true) } else { options.create_new(true) };
    match options.open(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            bail!(
                "{}: is there already; choose another with --out, or overwrite it with --force",
                path.display()
            )
        }
        opened => opened.with_context(|| format!("cannot write {}", path.display())),
    }
}

/// Writes a text to a file, as [`create`] does.
pub(super) fn write_new(path: &Path, text: &str, force: bool) -> anyhow::Result<()> {
    let mut file = create(path, force)?;
    file.write_all(text.as_bytes()).with_context(|| format!("cannot write {}", path.display()))
}
