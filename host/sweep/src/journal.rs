//! The journal of a sweep: what is done, beside the file that the sweep will write, so that a sweep that is stopped or killed
//! goes on from there.
//!
//! It is a magic word and frames: a length, a checksum, and the postcard bytes of the [`Identity`] (the first frame) or of a
//! [`Row`]. A row is appended in one piece once its run is done. What is not whole at the end is dropped, and run again. This
//! holds against programs that are killed, not against a power failure: nothing is forced to the disk.

use super::identity::{Identity, checksum};
use super::run::Row;
use serde::{Serialize, de::DeserializeOwned};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use thiserror::Error;

const MAGIC: &[u8; 8] = b"BGSWEEP2";

/// A journal that is being written.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    end: Mutex<End>,
}

/// The file, and how long it is as far as it is whole, bytes.
#[derive(Debug)]
struct End {
    file: File,
    length: u64,
}

/// The content of a journal.
#[derive(Debug, Default)]
pub struct Found {
    /// The runs that are done, in the order in which they were.
    pub rows: Vec<Row>,
    /// Bytes at its end that were not whole, and were dropped.
    pub dropped: u64,
}

/// The reason for which a sweep can't have its journal.
#[derive(Debug, Error)]
pub enum JournalError {
    /// It is another's, and what differs.
    #[error("{}: belongs to another sweep: {} differs; run that one again, choose another --out, or start anew with --force", .0.display(), .1)]
    Another(PathBuf, String),
    /// It is something else, or its beginning is damaged.
    #[error("{}: is not a journal of a sweep; choose another --out, or overwrite it with --force", .0.display())]
    NoJournal(PathBuf),
    /// Somebody writes it.
    #[error("{}: another sweep is writing it; wait for it, or choose another --out", .0.display())]
    Busy(PathBuf),
    /// The file system said no.
    #[error("cannot write {}", .0.display())]
    Io(PathBuf, #[source] io::Error),
}

impl Journal {
    /// Opens a journal, or begins one if there is none; with `force`, in any case. Gives what is done already.
    ///
    /// # Errors
    /// It is that of another sweep or no journal, without `force`; somebody else writes it; or what the file system says.
    pub fn open(path: &Path, identity: &Identity, force: bool) -> Result<(Self, Found), JournalError> {
        let failed = |source| JournalError::Io(path.to_owned(), source);
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path).map_err(failed)?;
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => JournalError::Busy(path.to_owned()),
            TryLockError::Error(source) => failed(source),
        })?;
        let mut bytes = Vec::new();
        if !force {
            file.read_to_end(&mut bytes).map_err(failed)?;
        }
        let opening = frame(identity).map_err(failed)?;
        let mut found = Found::default();
        let whole = match begun(&bytes) {
            Begun::Not => 0,
            Begun::Otherwise => return Err(JournalError::NoJournal(path.to_owned())),
            Begun::By(another, rest) => {
                if let Some(difference) = identity.difference(&another) {
                    return Err(JournalError::Another(path.to_owned(), difference.to_owned()));
                }
                let mut rest = rest;
                while let Some((row, behind)) = next(rest) {
                    found.rows.push(row);
                    rest = behind;
                }
                found.dropped = rest.len() as u64;
                (bytes.len() - rest.len()) as u64
            }
        };
        let journal = Self { path: path.to_owned(), end: Mutex::new(End { file, length: whole }) };
        journal.cut()?;
        if whole == 0 {
            journal.put(&[MAGIC, &opening[..]].concat())?;
        }
        Ok((journal, found))
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Keeps a row.
    ///
    /// # Errors
    /// What the file system says. What was kept before stays.
    pub fn keep(&self, row: &Row) -> Result<(), JournalError> {
        let bytes = frame(row).map_err(|source| self.failed(source))?;
        self.put(&bytes)
    }

    /// Removes it: everything is in the sweep's file.
    ///
    /// # Errors
    /// What the file system says.
    pub fn remove(self) -> Result<(), JournalError> {
        std::fs::remove_file(&self.path).map_err(|source| self.failed(source))
    }

    /// Appends bytes, all or none.
    fn put(&self, bytes: &[u8]) -> Result<(), JournalError> {
        let mut end = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        match end.file.write_all(bytes) {
            Ok(()) => end.length += bytes.len() as u64,
            Err(source) => {
                // What comes later must not follow half a row. If this fails as well, what comes later is lost; nothing else is.
                let _ = end.file.set_len(end.length);
                return Err(self.failed(source));
            }
        }
        Ok(())
    }

    /// Cuts off what is not whole.
    fn cut(&self) -> Result<(), JournalError> {
        let end = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        end.file.set_len(end.length).map_err(|source| self.failed(source))
    }

    fn failed(&self, source: io::Error) -> JournalError {
        JournalError::Io(self.path.clone(), source)
    }
}

/// The beginning of a file.
enum Begun<'a> {
    /// As a journal that was not even begun: nothing is in it.
    Not,
    /// As something else.
    Otherwise,
    /// As the journal of a sweep; and what follows.
    By(Identity, &'a [u8]),
}

fn begun(bytes: &[u8]) -> Begun<'_> {
    match bytes.strip_prefix(MAGIC) {
        Some(rest) => match next(rest) {
            Some((identity, rest)) => Begun::By(identity, rest),
            // Killed in its first moment, or damaged.
            None if payload(rest).is_none() => Begun::Not,
            None => Begun::Otherwise,
        },
        None if MAGIC.starts_with(bytes) => Begun::Not,
        None => Begun::Otherwise,
    }
}

/// A value with its length and checksum.
fn frame(value: &impl Serialize) -> io::Result<Vec<u8>> {
    let payload = postcard::to_stdvec(value).map_err(io::Error::other)?;
    let length = u32::try_from(payload.len()).map_err(io::Error::other)?;
    Ok([&length.to_le_bytes()[..], &checksum(&payload).to_le_bytes(), &payload].concat())
}

/// Checksum and payload of the first frame, and what is behind it, if it is there to its end.
fn payload(bytes: &[u8]) -> Option<(u64, &[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    let (sum, rest) = rest.split_first_chunk()?;
    let (payload, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    Some((u64::from_le_bytes(*sum), payload, rest))
}

/// The first value, and what is behind it, if it is whole.
fn next<T: DeserializeOwned>(bytes: &[u8]) -> Option<(T, &[u8])> {
    let (sum, payload, rest) = payload(bytes)?;
    if checksum(payload) != sum {
        return None;
    }
    match postcard::take_from_bytes(payload) {
        Ok((value, [])) => Some((value, rest)),
        _ => None,
    }
}
