//! Files that are read.

use super::{is_same, no_file};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// All files that this process has read, if it [protects](protect_inputs) them. A command names a few, and those name others
/// (the URDF of a hand, the mesh of an object): each is remembered where it is opened, so that no command has to know them all.
static READ: Mutex<Option<BTreeSet<PathBuf>>> = Mutex::new(None);

/// From now on, nothing is written over what was read. For a process that does one thing and ends.
pub fn protect_inputs() {
    read_so_far().get_or_insert_default();
}

fn read_so_far() -> MutexGuard<'static, Option<BTreeSet<PathBuf>>> {
    READ.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Opens a file to be read.
///
/// # Errors
/// It is a folder, or a pipe, from which somebody might wait for ever; or what the file system says.
pub fn open(path: &Path) -> io::Result<File> {
    let metadata = fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(no_file(&metadata));
    }
    let file = File::open(path)?;
    if let Some(read) = &mut *read_so_far() {
        read.insert(path.to_owned());
    }
    Ok(file)
}

/// Returns a file's bytes.
///
/// # Errors
/// As [`open`].
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The file that was read, under the name by which it was, if this path names it as well.
pub(super) fn that_is(path: &Path) -> Option<PathBuf> {
    let read = read_so_far();
    read.iter().flatten().find(|input| is_same(input, path)).cloned()
}
