//! The CRC of a payload: CRC-32/ISO-HDLC, the one of Ethernet and zlib, of the ten bytes `blindgrasp` and the payload.
//! The ten bytes are not sent. In Python it is `zlib.crc32(b"blindgrasp" + payload)`.
//!
//! Without them the register would start with all ones, and payloads that begin with zeros have damage that no such CRC
//! sees, although a line does it:
//!
//! - The CRC of nothing is 0, so `01 01 01 01 01` is a frame without payload. It stands in every frame with five zeros in
//!   a row; a flipped bit on either side makes the 0x00.
//! - A payload and its CRC leave the register as four zeros at the start do. So a whole frame can take the place of the
//!   zeros with which the next one begins: lose a frame's 0x00 and the five bytes after it, and the rest is one good frame.
//! - `ff ff ff ff` at the start makes the register 0, and zeros that follow leave it so: any number of them can be lost.
//!
//! With them the same happens to payloads that begin with certain four bytes, which say nothing in particular.

use crc::{CRC_32_ISO_HDLC, Crc, Table};

/// The bytes that are taken to precede the payload.
const LEAD: &[u8] = b"blindgrasp";

const ISO_HDLC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// The effect of each byte on the register: 1 KiB, 1 % of the flash, and 4 instructions a byte on a Cortex-M4, a word
/// at a time. Sixteen entries (64 bytes) take 8; no table, 40. The record of twelve joints that goes out with a tick
/// has some 140 bytes, so that this saves 560 and 5,000 instructions a tick.
static TABLE: [u32; 256] = ISO_HDLC.table()[0];

/// The register of a CRC in work. It is advanced by bytes, not by slices, so that each byte costs the same.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Checksum(u32);

impl Checksum {
    /// Before the payload.
    pub(crate) const START: Self = Self(ISO_HDLC.checksum(LEAD) ^ CRC_32_ISO_HDLC.xorout);

    /// Bytes of a CRC.
    pub(crate) const BYTES: usize = 4;

    /// The CRC of a payload, in the order of sending.
    #[inline(never)]
    pub(crate) fn of(payload: &[u8]) -> [u8; Self::BYTES] {
        let mut checksum = Self::START;
        let (words, rest) = payload.as_chunks();
        words.iter().for_each(|&word| checksum.advance_word(u32::from_le_bytes(word)));
        rest.iter().for_each(|&byte| checksum.advance(byte));
        checksum.bytes()
    }

    pub(crate) fn advance(&mut self, byte: u8) {
        self.0 ^= u32::from(byte);
        self.shift();
    }

    /// The four bytes of a word, low byte first.
    pub(crate) fn advance_word(&mut self, word: u32) {
        self.0 ^= word;
        (0..4).for_each(|_| self.shift());
    }

    /// Shifts a byte out of the register, and what it does into it.
    fn shift(&mut self) {
        let [low, ..] = self.0.to_le_bytes();
        self.0 = TABLE[usize::from(low)] ^ (self.0 >> 8);
    }

    /// The CRC of the payload, in the order of sending.
    pub(crate) fn bytes(self) -> [u8; Self::BYTES] {
        (self.0 ^ CRC_32_ISO_HDLC.xorout).to_le_bytes()
    }

    /// Returns `true` if what it was advanced by is a payload and its CRC. The register is then the same for all
    /// payloads, so that a receiver need not know where the payload ends before the frame has ended.
    pub(super) fn is_of_payload_and_crc(self) -> bool {
        self.0 == CRC_32_ISO_HDLC.residue
    }
}
