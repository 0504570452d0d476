//! Messages to frames, in one pass over the message and in place: each byte that postcard writes goes through the CRC
//! and the stuffing straight to where it stays.

use super::checksum::Checksum;
use super::{END, FULL};
use crate::bytes::BufferTooSmall;
use postcard::ser_flavors::Flavor;
use serde::Serialize;

/// Bytes of the longest frame of a payload of so many bytes, with the 0x00 at its end.
pub const fn most_bytes(payload: usize) -> usize {
    let stuffed = payload + Checksum::BYTES;
    let codes = stuffed.div_ceil(FULL as usize - 1);
    stuffed + codes + 1
}

/// Writes a message as a frame, with the 0x00 at its end, and returns the part of the buffer that it takes up.
///
/// # Errors
/// If the buffer is too small; [`most_bytes`] of the message's postcard bytes always suffice.
pub fn encode<'a, M: Serialize + ?Sized>(
    message: &M,
    buffer: &'a mut [u8],
) -> Result<&'a [u8], BufferTooSmall> {
    postcard::serialize_with_flavor(message, Writer::new(buffer)).map_err(|_| BufferTooSmall)
}

/// A frame that is being written.
struct Writer<'a> {
    buffer: &'a mut [u8],
    /// Where the code byte of the block in work belongs: it is written when the block is complete.
    code_at: usize,
    /// Where the next byte belongs.
    next_at: usize,
    checksum: Checksum,
}

impl<'a> Writer<'a> {
    fn new(buffer: &'a mut [u8]) -> Self {
        Self { buffer, code_at: 0, next_at: 1, checksum: Checksum::START }
    }

    /// Adds a byte of the payload.
    fn push(&mut self, byte: u8) -> postcard::Result<()> {
        self.checksum.advance(byte);
        self.stuff(byte)
    }

    /// Adds the CRC, and ends the frame.
    fn finish(mut self) -> postcard::Result<&'a [u8]> {
        self.checksum.bytes().into_iter().try_for_each(|byte| self.stuff(byte))?;
        self.close_block()?;
        self.put(self.next_at, END)?;
        let buffer: &'a [u8] = self.buffer;
        buffer.get(..=self.next_at).ok_or(postcard::Error::SerializeBufferFull)
    }

    fn put(&mut self, at: usize, byte: u8) -> postcard::Result<()> {
        *self.buffer.get_mut(at).ok_or(postcard::Error::SerializeBufferFull)? = byte;
        Ok(())
    }

    /// Completes the block in work.
    fn close_block(&mut self) -> postcard::Result<()> {
        // At most FULL, because `stuff` closes a full block before it adds to it.
        self.put(self.code_at, (self.next_at - self.code_at) as u8)
    }

    fn open_block(&mut self) {
        self.code_at = self.next_at;
        self.next_at += 1;
    }

    fn stuff(&mut self, byte: u8) -> postcard::Result<()> {
        // Only now and not as soon as it is full: if no byte follows, no block follows either.
        if self.next_at - self.code_at == FULL as usize {
            self.close_block()?;
            self.open_block();
        }
        if byte == 0 {
            self.close_block()?;
            self.open_block();
        } else {
            self.put(self.next_at, byte)?;
            self.next_at += 1;
        }
        Ok(())
    }
}

impl<'a> Flavor for Writer<'a> {
    type Output = &'a [u8];

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.push(byte)
    }

    fn finalize(self) -> postcard::Result<&'a [u8]> {
        self.finish()
    }
}
