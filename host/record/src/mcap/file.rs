//! A file that is a whole MCAP file whenever nobody is writing to it, and nearly so while somebody is.
//!
//! What was added since the last time goes to the end together with a **tail**: an end of the data, a footer that says
//! that there is no summary, and the closing magic. The next addition begins over that tail. It is written in two
//! pieces: first all but what falls on the old tail, then that in one small write. A program that is killed between them,
//! or in the first, leaves the old file with something behind its end; readers stop at the end. If a piece can't be
//! written (the disk is full), the old tail, whose blocks the file has, is put back.

use blindgrasp_files::{NewFile, OutputError};
use std::io::{self, Write};

/// End of the data without a checksum, footer without a summary, magic.
pub(super) const TAIL: [u8; 50] = {
    let mut tail = [0; 50];
    // Each record is a byte of kind, eight of length, and its content.
    tail[0] = ::mcap::records::op::DATA_END;
    tail[1] = 4;
    tail[13] = ::mcap::records::op::FOOTER;
    tail[14] = 20;
    let mut k = 0;
    while k < 8 {
        tail[42 + k] = ::mcap::MAGIC[k];
        k += 1;
    }
    tail
};

/// A file that grows by pieces.
#[derive(Debug)]
pub(super) struct WholeFile {
    file: NewFile,
    /// Bytes before the tail.
    length: u64,
}

impl WholeFile {
    /// Begins in an empty file.
    pub(super) fn new(file: NewFile) -> Self {
        Self { file, length: 0 }
    }

    /// Returns `true` if the file has its name.
    pub(super) fn is_published(&self) -> bool {
        self.file.is_published()
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// As [`NewFile::publish`].
    pub(super) fn publish(&mut self) -> Result<(), OutputError> {
        self.file.publish()
    }

    /// Bytes that are safe, without the tail.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// Adds something, and the tail.
    ///
    /// # Errors
    /// What the file system says. The file is then what it was before.
    pub(super) fn add(&mut self, bytes: &mut Vec<u8>) -> io::Result<()> {
        let length = bytes.len();
        bytes.extend_from_slice(&TAIL);
        self.put(bytes)?;
        self.length += length as u64;
        Ok(())
    }

    /// Adds the end that replaces the tail for good.
    ///
    /// # Errors
    /// As [`Self::add`].
    pub(super) fn end(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.put(bytes)?;
        self.length += bytes.len() as u64;
        Ok(())
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        let before = if self.length == 0 { 0 } else { TAIL.len().min(bytes.len()) };
        let (over_tail, behind) = bytes.split_at(before);
        let put = self
            .write_at(behind, self.length + before as u64)
            .and_then(|()| self.write_at(over_tail, self.length));
        if put.is_err() && self.length > 0 {
            // Nothing more can be done than to try; the first error is the one to tell.
            let _ = self.write_at(&TAIL, self.length);
            let _ = self.file.file().set_len(self.length + TAIL.len() as u64);
        }
        put
    }

    #[cfg(unix)]
    fn write_at(&mut self, bytes: &[u8], at: u64) -> io::Result<()> {
        std::os::unix::fs::FileExt::write_all_at(self.file.file(), bytes, at)
    }

    #[cfg(not(unix))]
    fn write_at(&mut self, bytes: &[u8], at: u64) -> io::Result<()> {
        use std::io::{Seek, SeekFrom};
        let mut file = self.file.file();
        file.seek(SeekFrom::Start(at))?;
        file.write_all(bytes)
    }

    /// Hands everything to the disk.
    pub(super) fn sync(&mut self) -> io::Result<()> {
        self.file.flush()?;
        self.file.file().sync_data()
    }
}
