//! Files: what is read is a file, and what is written has its name only when it is whole.
//!
//! - [`open`] and [`read`] refuse what is no file, and remember what was read.
//! - [`NewFile`] and [`NewFolder`] are written beside, as `NAME.partial`, and renamed once everything is on the disk. Until then
//!   nothing happens to what had the name before: a command that fails, is interrupted or is killed leaves it as it was. What
//!   was read is never replaced, whatever name it has ([`protect_inputs`]). `NAME.partial` is locked while it is written; one that nobody has
//!   locked was left by a program that was killed, and the next that writes the same removes it and says so.
//! - [`abandon`] removes what is not whole when the user interrupts.

mod input;
mod output;

pub use input::{open, protect_inputs, read};
pub use output::{NewFile, NewFolder, OutputError, abandon, check, is_being_written, write};

use std::fs;
use std::io;
use std::path::Path;

/// Returns `true` if two paths name one file: the same, through a symbolic link, or as a hard link.
fn is_same(one: &Path, other: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let identity = |path| fs::metadata(path).map(|of: fs::Metadata| (of.dev(), of.ino())).ok();
        identity(one).is_some_and(|identity_of_one| Some(identity_of_one) == identity(other))
    }
    #[cfg(not(unix))]
    {
        let whole = |path| fs::canonicalize(path).ok();
        whole(one).is_some_and(|one| Some(one) == whole(other))
    }
}

/// An error that says in words what stands where a file should.
fn no_file(metadata: &fs::Metadata) -> io::Error {
    #[cfg(unix)]
    let is_pipe = std::os::unix::fs::FileTypeExt::is_fifo(&metadata.file_type());
    #[cfg(not(unix))]
    let is_pipe = false;
    let words = match () {
        () if metadata.is_dir() => "it is a folder, not a file",
        () if is_pipe => "it is a pipe, not a file: write what comes out of it to a file first",
        () => "it is a device or a socket, not a file",
    };
    io::Error::new(io::ErrorKind::InvalidInput, words)
}
