//! Errors in writing and reading recordings.

use super::writer::Saved;
use blindgrasp_files::OutputError;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use std::io;
use std::path::{Path, PathBuf};

/// The reason for which a recording can't be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file can't be made, or get its name.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The file system says no.
    #[error("cannot {action} {}", .path.display())]
    Io {
        /// The action that failed.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// Nothing can be added any more.
    #[error("the recording has stopped: {problem}; {}", remains(.path, .saved))]
    Stopped {
        /// The file.
        path: PathBuf,
        /// The words of the file system; a full disk among others.
        problem: String,
        /// The contents of the file; nothing if there is none.
        saved: Saved,
    },
    /// Something that MCAP can't hold.
    #[error("the recording can't hold this")]
    Format(#[from] ::mcap::McapError),
    /// It does not begin as an MCAP file does.
    #[error("{}: not an MCAP file; recordings are made by `blindgrasp record`, or by `sim --out`", .path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// An MCAP file of something else.
    #[error("{}: an MCAP file{}, but not a recording of a hand; those are made by `blindgrasp record`, or by `sim --out`", .path.display(), of(.library))]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// The library that wrote it.
        library: String,
    },
    /// A recording that a later program made.
    #[error("{}: a recording of format {theirs}, written by {library}; this program knows formats up to {ours}: use that program", .path.display())]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its format.
        theirs: u32,
        /// The library that wrote it.
        library: String,
        /// The newest that is known.
        ours: u32,
    },
    /// Records of another interface version.
    #[error(
        "device `{device}` was recorded with interface version {theirs}, and this program has {INTERFACE_VERSION}: its raw records can't be decoded; the decoded signals in the file can still be read with MCAP tools, or use the program that recorded it ({program})"
    )]
    OtherInterface {
        /// The device.
        device: String,
        /// Its version.
        theirs: u16,
        /// The program that recorded it.
        program: String,
    },
}

fn remains(path: &Path, saved: &Saved) -> String {
    let path = path.display();
    if saved.bytes == 0 {
        format!("nothing is written to {path}")
    } else {
        format!(
            "{path} is whole and holds what came before: {saved}; once there is room, `blindgrasp recording finish` gives it the end that other tools want"
        )
    }
}

fn of(library: &str) -> String {
    if library.is_empty() { String::new() } else { format!(" (by {library})") }
}
