//! A flash in memory, whose power is cut at any byte.

#![allow(dead_code, reason = "each test file uses its part")]

use super::random::Random;
use blindgrasp_shared::store::SLOT_BYTES;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// NOR flash of two sectors, as microcontrollers have it: bits are erased to ones, a sector at a time,
/// and programmed to zeros, a word at a time; a word is programmed once, or once more to zero.
pub(crate) struct Memory {
    pub(crate) bytes: Vec<u8>,
    pub(crate) random: Random,
    /// Bytes that are still programmed or erased before the power is cut.
    pub(crate) power: usize,
    pub(crate) erasures: usize,
    pub(crate) words: usize,
}

impl Memory {
    pub(crate) fn blank(slots_a_sector: usize) -> Self {
        Self::holding(vec![0xff; 2 * slots_a_sector * SLOT_BYTES as usize])
    }

    pub(crate) fn holding(bytes: Vec<u8>) -> Self {
        Self { bytes, random: Random::new(1), power: usize::MAX, erasures: 0, words: 0 }
    }

    pub(crate) fn sector_bytes(&self) -> usize {
        self.bytes.len() / 2
    }

    /// As many bytes as the power lasts for, of so many.
    fn use_power(&mut self, bytes: usize) -> usize {
        let done = bytes.min(self.power);
        self.power = self.power.saturating_sub(bytes);
        done
    }
}

impl ErrorType for Memory {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Memory {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Memory {
    const WRITE_SIZE: usize = 4;
    // As the smallest sectors of these tests; the store erases whole ones, whatever they are.
    const ERASE_SIZE: usize = 2 * SLOT_BYTES as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        let (from, to) = (from as usize, to as usize);
        assert!((from == 0) != (to == self.bytes.len()) && to - from == self.sector_bytes(), "{from}..{to}");
        self.erasures += 1;
        // It takes as long as programming a few thousand words.
        if self.use_power(to - from) == to - from {
            self.bytes[from..to].fill(0xff);
            return Ok(());
        }
        for word in self.bytes[from..to].chunks_exact_mut(4) {
            match self.random.below(4) {
                0 => word.fill(0xff),
                1 => word.copy_from_slice(&(self.random.next() as u32).to_le_bytes()),
                2 => word[self.random.below(4)] |= self.random.byte(),
                _ => {}
            }
        }
        Err(NorFlashErrorKind::Other)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (index, new) in bytes.chunks_exact(4).enumerate() {
            let at = offset as usize + 4 * index;
            let old = &self.bytes[at..at + 4];
            assert!(old == [0xff; 4] || new == [0; 4], "{at:#x} holds {old:02x?} and is to be {new:02x?}");
            self.words += 1;
            let whole = self.use_power(4);
            for (byte, &new) in self.bytes[at..at + 4].iter_mut().zip(new).take(whole) {
                *byte &= new;
            }
            if whole < 4 {
                // What was being programmed has some of its bits.
                self.bytes[at + whole] &= new[whole] | self.random.byte();
                return Err(NorFlashErrorKind::Other);
            }
        }
        Ok(())
    }
}
