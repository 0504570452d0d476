//! Frames to payloads, a byte at a time.
//!
//! Made for an interrupt: what a byte costs does not depend on the bytes before it, the end of a frame included. Blocks
//! are unstuffed and the CRC is advanced as the bytes come, so that the end has nothing left to compute.

use super::checksum::Checksum;
use super::{END, FULL};
use core::fmt;
use core::mem;

/// An error in the bytes up to a 0x00.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The frame is shorter than its CRC.
    TooShort,
    /// The frame is longer than any that the receiver expects.
    TooLong,
    /// The frame ends inside a block of bytes.
    BadCode,
    /// The frame does not have the CRC that it carries.
    BadCrc,
}

impl FrameError {
    /// Every reason.
    pub const ALL: [Self; 4] = [Self::TooShort, Self::TooLong, Self::BadCode, Self::BadCrc];
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooShort => "the frame is shorter than its CRC",
            Self::TooLong => "the frame is longer than any that the receiver expects",
            Self::BadCode => "the frame ends inside a block of bytes",
            Self::BadCrc => "the frame does not have the CRC that it carries",
        })
    }
}

impl core::error::Error for FrameError {}

/// Frames since the start; a count that has reached its largest value stays there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Frames received.
    pub good: u32,
    /// [`FrameError::TooShort`].
    pub too_short: u32,
    /// [`FrameError::TooLong`].
    pub too_long: u32,
    /// [`FrameError::BadCode`].
    pub bad_code: u32,
    /// [`FrameError::BadCrc`].
    pub bad_crc: u32,
}

impl Counters {
    /// None yet.
    pub const ZERO: Self = Self { good: 0, too_short: 0, too_long: 0, bad_code: 0, bad_crc: 0 };

    /// Frames refused for one reason.
    pub const fn refused_as(&self, reason: FrameError) -> u32 {
        match reason {
            FrameError::TooShort => self.too_short,
            FrameError::TooLong => self.too_long,
            FrameError::BadCode => self.bad_code,
            FrameError::BadCrc => self.bad_crc,
        }
    }

    /// Frames refused for whatever reason.
    pub fn refused(&self) -> u32 {
        FrameError::ALL.iter().fold(0, |sum, reason| sum.saturating_add(self.refused_as(*reason)))
    }

    fn count<T>(&mut self, frame: Result<T, FrameError>) {
        let counter = match frame {
            Ok(_) => &mut self.good,
            Err(FrameError::TooShort) => &mut self.too_short,
            Err(FrameError::TooLong) => &mut self.too_long,
            Err(FrameError::BadCode) => &mut self.bad_code,
            Err(FrameError::BadCrc) => &mut self.bad_crc,
        };
        *counter = counter.saturating_add(1);
    }
}

/// Receives frames whose payload and CRC have at most `N` bytes.
///
/// It takes an empty last block after a full one, which [`encode`](super::encode) does not write and other encoders of
/// COBS do.
pub struct Receiver<const N: usize> {
    /// Payload and CRC as far as received; of a frame that is too long, its beginning.
    bytes: [u8; N],
    /// Bytes of payload and CRC so far, also those that found no place.
    length: usize,
    /// Code of the block in work; [`END`], which is no code, if no byte of the frame has come.
    code: u8,
    /// Bytes that are still to come in the block.
    left: u8,
    /// Of payload and CRC so far.
    checksum: Checksum,
    counters: Counters,
}

impl<const N: usize> Receiver<N> {
    /// A receiver that takes the next byte for the first of a frame.
    pub const fn new() -> Self {
        Self {
            bytes: [0; N],
            length: 0,
            code: END,
            left: 0,
            checksum: Checksum::START,
            counters: Counters::ZERO,
        }
    }

    /// Takes a byte. At the end of a frame it returns the payload, or the reason why there is none.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], FrameError>> {
        if byte == END {
            return self.end();
        }
        if self.left > 0 {
            self.put(byte);
            self.left -= 1;
        } else {
            // The zero that the block before stands for, if there is a block before and it is not full.
            if self.code != END && self.code != FULL {
                self.put(0);
            }
            self.code = byte;
            self.left = byte - 1;
        }
        None
    }

    /// Frames so far.
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    fn put(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
        }
        self.length = self.length.saturating_add(1);
        self.checksum.advance(byte);
    }

    /// Judges the frame that ends here, and is ready for the next.
    fn end(&mut self) -> Option<Result<&[u8], FrameError>> {
        let length = mem::take(&mut self.length);
        let code = mem::replace(&mut self.code, END);
        let left = mem::take(&mut self.left);
        let checksum = mem::replace(&mut self.checksum, Checksum::START);
        if code == END {
            return None;
        }
        let payload = if length > N {
            Err(FrameError::TooLong)
        } else if left > 0 {
            Err(FrameError::BadCode)
        } else if length < Checksum::BYTES {
            Err(FrameError::TooShort)
        } else if !checksum.is_of_payload_and_crc() {
            Err(FrameError::BadCrc)
        } else {
            self.bytes.get(..length - Checksum::BYTES).ok_or(FrameError::TooLong)
        };
        self.counters.count(payload);
        Some(payload)
    }
}

impl<const N: usize> Default for Receiver<N> {
    fn default() -> Self {
        Self::new()
    }
}
