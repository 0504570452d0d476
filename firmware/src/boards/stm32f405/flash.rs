//! Flash for saved parameters: the last two sectors of the STM32F405RG, 10 and 11, of 128 KiB each (RM0090 3.3, table 5).
//!
//! There is one bank, so that the processor stands still whenever it reads flash during an operation (RM0090 3.6.3 and
//! 3.6.4): for 16 us a word, at most 100, and for 1 s a sector, at most 2 (DS8626, flash memory programming). Both are for
//! the widest parallelism without an external voltage, 32 bits, for a supply of 2.7 to 3.6 V (RM0090 3.6.2): this board
//! has 3.3 V, and is reset or switched off below 2.85 V (`supply.rs`).
//!
//! Each operation unlocks the control register, and locks it again. What is left of an operation that does not end in time
//! is not touched: writing to the register would stop the bus until it does (RM0090 3.6.1).
//!
//! **Not tried on a chip.** The tests run it against a model of the controller. To be confirmed on the first board: that a
//! word which is programmed is seen at once by a read (RM0090 3.6.4: the data cache follows a write, and only an erasure
//! leaves it behind), and that a word may be programmed to zero when it is not blank, which the store does to take a mark
//! back.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// Address of the first of the sectors. `memory.x` ends the image here.
pub const BEGIN: u32 = 0x080C_0000;
/// Bytes of both.
pub const BYTES: u32 = 2 * SECTOR_BYTES;
const SECTOR_BYTES: u32 = 128 << 10;
/// Number of the first one.
const FIRST_SECTOR: u32 = 10;

// Registers (RM0090 3.9).
const ACCESS: u32 = 0x4002_3C00;
const KEY: u32 = 0x4002_3C04;
const STATUS: u32 = 0x4002_3C0C;
const CONTROL: u32 = 0x4002_3C10;

/// In this order they unlock the control register (RM0090 3.6.1).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

/// `DCEN` and `DCRST` of `FLASH_ACR` (RM0090 3.9.1).
const DATA_CACHE: u32 = 1 << 10;
const DATA_CACHE_RESET: u32 = 1 << 12;

/// `BSY` of `FLASH_SR` (RM0090 3.9.5).
const BUSY: u32 = 1 << 16;
/// `PGSERR`, `PGPERR`, `PGAERR`, `WRPERR` and `OPERR`: each is cleared by writing a one.
const ERRORS: u32 = 1 << 7 | 1 << 6 | 1 << 5 | 1 << 4 | 1 << 1;

/// `PG`, `SER`, `SNB`, `PSIZE`, `STRT` and `LOCK` of `FLASH_CR` (RM0090 3.9.7).
const PROGRAM: u32 = 1 << 0;
const ERASE: u32 = 1 << 1;
const SECTOR_SHIFT: u32 = 3;
const BY_WORDS: u32 = 0b10 << 8;
const START: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;

/// The most looks at the flash until it has to be ready. A look takes at least 4 cycles, 24 ns: these are 0.4 ms for a
/// word and 3.5 s for a sector or more, and rather three times that.
const LOOKS_PER_WORD: u32 = 16_000;
const LOOKS_PER_SECTOR: u32 = 150_000_000;

/// The bus to registers and flash.
pub trait Bus {
    /// Reads a word.
    fn read(&self, address: u32) -> u32;
    /// Writes a word, and waits until it has arrived.
    fn write(&mut self, address: u32, word: u32);
}

/// A failure of the flash to do as it was told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// It can't: nothing was begun.
    Request(NorFlashErrorKind),
    /// It is busy for longer than any operation takes.
    Busy,
    /// It does not unlock: the keys came in another order since the reset.
    Locked,
    /// It says so: the flags of `FLASH_SR`.
    Failed(u32),
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Request(kind) => *kind,
            Self::Busy | Self::Locked | Self::Failed(_) => NorFlashErrorKind::Other,
        }
    }
}

/// The two sectors.
#[derive(Debug)]
pub struct Flash<B>(B);

impl<B: Bus> Flash<B> {
    /// Over a bus.
    pub fn new(bus: B) -> Self {
        Self(bus)
    }

    /// One operation, which writing a word begins, from what the control register is set to before, to its end.
    fn operate(&mut self, control: u32, address: u32, word: u32, most_looks: u32) -> Result<(), FlashError> {
        self.wait(most_looks)?;
        if self.0.read(CONTROL) & LOCK != 0 {
            KEYS.into_iter().for_each(|key| self.0.write(KEY, key));
        }
        if self.0.read(CONTROL) & LOCK != 0 {
            return Err(FlashError::Locked);
        }
        self.0.write(STATUS, ERRORS);
        self.0.write(CONTROL, control);
        self.0.write(address, word);
        self.wait(most_looks)?;
        self.0.write(CONTROL, LOCK);
        let errors = self.0.read(STATUS) & ERRORS;
        self.0.write(STATUS, errors);
        if errors == 0 { Ok(()) } else { Err(FlashError::Failed(errors)) }
    }

    fn wait(&self, most_looks: u32) -> Result<(), FlashError> {
        let is_ready = (0..most_looks).any(|_| self.0.read(STATUS) & BUSY == 0);
        if is_ready { Ok(()) } else { Err(FlashError::Busy) }
    }

    /// Empties the data cache, which must be off meanwhile (RM0090 3.6.3 and 3.9.1).
    fn forget_cached(&mut self) {
        let access = self.0.read(ACCESS);
        self.0.write(ACCESS, access & !DATA_CACHE);
        self.0.write(ACCESS, access & !DATA_CACHE | DATA_CACHE_RESET);
        self.0.write(ACCESS, access & !DATA_CACHE);
        self.0.write(ACCESS, access);
    }
}

impl<B> ErrorType for Flash<B> {
    type Error = FlashError;
}

impl<B: Bus> ReadNorFlash for Flash<B> {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Request)?;
        for (word, address) in bytes.as_chunks_mut().0.iter_mut().zip((BEGIN + offset..).step_by(4)) {
            *word = self.0.read(address).to_le_bytes();
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        BYTES as usize
    }
}

impl<B: Bus> NorFlash for Flash<B> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR_BYTES as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError::Request)?;
        for sector in FIRST_SECTOR + from / SECTOR_BYTES..FIRST_SECTOR + to / SECTOR_BYTES {
            let control = BY_WORDS | ERASE | sector << SECTOR_SHIFT;
            let erased = self.operate(control, CONTROL, control | START, LOOKS_PER_SECTOR);
            self.forget_cached();
            erased?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError::Request)?;
        for (word, address) in bytes.as_chunks().0.iter().zip((BEGIN + offset..).step_by(4)) {
            self.operate(BY_WORDS | PROGRAM, address, u32::from_le_bytes(*word), LOOKS_PER_WORD)?;
        }
        Ok(())
    }
}

#[cfg(target_os = "none")]
pub use mapped::Mapped;

#[cfg(target_os = "none")]
mod mapped {
    #![allow(unsafe_code)]

    use super::Bus;
    use core::ptr;
    use stm32f4xx_hal::pac::FLASH;

    /// The bus as the processor has it; who has it, has the controller.
    pub struct Mapped(
        #[allow(dead_code, reason = "owned, so that nobody else operates the flash")] pub FLASH,
    );

    impl Bus for Mapped {
        fn read(&self, address: u32) -> u32 {
            // SAFETY: the driver's addresses are those of the registers, which this owns, and of the two sectors: there, too,
            // reading changes nothing.
            unsafe { ptr::read_volatile(ptr::without_provenance(address as usize)) }
        }

        fn write(&mut self, address: u32, word: u32) {
            // SAFETY: as above; the two sectors hold nothing that the image refers to.
            unsafe { ptr::write_volatile(ptr::without_provenance_mut(address as usize), word) };
            // Flash is normal memory, and the status is looked at next.
            cortex_m::asm::dsb();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::store::{Entry, Store};
    use core::cell::{Cell, RefCell};
    use std::collections::BTreeMap;
    use std::vec;
    use std::vec::Vec;

    const WORDS: usize = (BYTES / 4) as usize;

    /// The controller and its sectors, as RM0090 describes them; what it forbids ends the test.
    struct Model {
        words: Vec<u32>,
        /// The contents of the data cache: it follows what is programmed, but not what is erased.
        cache: RefCell<BTreeMap<u32, u32>>,
        access: u32,
        status: u32,
        control: u32,
        keys: usize,
        /// Looks for which it stays busy, from the beginning of an operation on.
        takes: u32,
        busy: Cell<u32>,
        /// Flags that the next operation ends with, without effect.
        fails: u32,
        operations: usize,
    }

    impl Model {
        fn new() -> Self {
            // Any junk, and the error of a debugger.
            let words = (0..WORDS as u32).map(|word| word.wrapping_mul(2_654_435_761)).collect();
            Self {
                words,
                cache: RefCell::default(),
                access: DATA_CACHE | 0x305,
                status: 1 << 7,
                control: LOCK,
                keys: 0,
                takes: 3,
                busy: Cell::new(0),
                fails: 0,
                operations: 0,
            }
        }

        fn index(address: u32) -> Option<usize> {
            let offset = address.checked_sub(BEGIN)?;
            assert!(offset < BYTES && offset.is_multiple_of(4), "{address:#x}");
            Some((offset / 4) as usize)
        }

        fn begin(&mut self) -> bool {
            assert_eq!(self.control & 0b11 << 8, BY_WORDS, "parallelism");
            assert_eq!(self.status & ERRORS, 0, "an error of another operation");
            self.operations += 1;
            self.busy.set(self.takes);
            let fails = core::mem::take(&mut self.fails);
            self.status |= fails;
            fails == 0
        }
    }

    impl Bus for Model {
        fn read(&self, address: u32) -> u32 {
            match address {
                0x4002_3C00 => self.access,
                0x4002_3C0C => {
                    let busy = self.busy.get();
                    self.busy.set(busy.saturating_sub(1));
                    self.status | if busy > 0 { BUSY } else { 0 }
                }
                0x4002_3C10 => self.control,
                _ => {
                    assert_eq!(self.busy.get(), 0, "the processor would stand still");
                    let word = self.words[Self::index(address).expect("an address of the driver's")];
                    if self.access & DATA_CACHE == 0 {
                        return word;
                    }
                    *self.cache.borrow_mut().entry(address).or_insert(word)
                }
            }
        }

        fn write(&mut self, address: u32, word: u32) {
            match address {
                0x4002_3C00 => {
                    if word & DATA_CACHE_RESET != 0 {
                        assert_eq!((self.access | word) & DATA_CACHE, 0, "emptied while it is on");
                        self.cache.borrow_mut().clear();
                    }
                    self.access = word;
                }
                0x4002_3C04 => {
                    assert_eq!(
                        Some(&word),
                        [0x4567_0123, 0xCDEF_89AB].get(self.keys),
                        "locked until the next reset"
                    );
                    self.keys = (self.keys + 1) % 2;
                    self.control &= if self.keys == 0 { !LOCK } else { u32::MAX };
                }
                0x4002_3C0C => self.status &= !word,
                0x4002_3C10 => {
                    assert_eq!(self.busy.get(), 0, "the bus would stop");
                    assert_eq!(self.control & LOCK, 0, "it is locked");
                    assert_eq!(word & 1 << 2, 0, "all of the flash would be erased");
                    self.control = word & !START;
                    if word & START != 0 {
                        assert_eq!(word & 0b11, 0b10, "a sector is erased");
                        let sector = word >> 3 & 0xF;
                        assert!((10..12).contains(&sector), "the image would be erased: {sector}");
                        if self.begin() {
                            let half = WORDS / 2;
                            self.words[(sector as usize - 10) * half..][..half].fill(u32::MAX);
                        }
                    }
                }
                _ => {
                    let index = Self::index(address).expect("an address of the driver's");
                    assert_eq!(self.control & 0b11, 0b01, "a word is programmed");
                    if self.begin() {
                        self.words[index] &= word;
                        if let Some(cached) = self.cache.borrow_mut().get_mut(&address) {
                            *cached &= word;
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn sectors_are_erased_and_words_programmed_and_it_is_locked_before_and_after() {
        let mut flash = Flash::new(Model::new());
        let mut bytes = [0; 8];
        // Into the cache, too.
        flash.read(SECTOR_BYTES - 4, &mut bytes).unwrap();
        assert_ne!(bytes, [0xff; 8]);
        flash.erase(SECTOR_BYTES, BYTES).unwrap();
        flash.read(SECTOR_BYTES - 4, &mut bytes).unwrap();
        assert_eq!((bytes[..4] == [0xff; 4], &bytes[4..]), (false, &[0xff; 4][..]));
        flash.erase(0, BYTES).unwrap();
        assert!(flash.0.words.iter().all(|&word| word == u32::MAX));
        flash.write(SECTOR_BYTES - 4, &[1, 2, 3, 4, 5, 6, 7, 8]).unwrap();
        flash.read(SECTOR_BYTES - 4, &mut bytes).unwrap();
        assert_eq!(bytes, [1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!((flash.0.operations, flash.0.control, flash.0.access), (5, LOCK, DATA_CACHE | 0x305));
    }

    #[test]
    fn what_it_cannot_do_is_not_begun() {
        let mut flash = Flash::new(Model::new());
        let (aligned, bounds) = (NorFlashErrorKind::NotAligned, NorFlashErrorKind::OutOfBounds);
        let kind = |done: Result<(), FlashError>| done.unwrap_err().kind();
        assert_eq!(kind(flash.erase(0, 4096)), aligned);
        assert_eq!(kind(flash.erase(0, 2 * BYTES)), bounds);
        assert_eq!(kind(flash.erase(BYTES, 0)), bounds);
        assert_eq!(kind(flash.write(2, &[0; 4])), aligned);
        assert_eq!(kind(flash.write(0, &[0; 3])), aligned);
        assert_eq!(kind(flash.write(BYTES, &[0; 4])), bounds);
        assert_eq!(kind(flash.read(u32::MAX - 3, &mut [0; 8])), bounds);
        assert_eq!(kind(flash.read(1, &mut [0; 4])), aligned);
        assert_eq!(flash.0.operations, 0);
    }

    #[test]
    fn an_error_is_told_and_taken_back() {
        let mut flash = Flash::new(Model::new());
        for flag in [1, 4, 5, 6, 7] {
            flash.0.fails = 1 << flag;
            assert_eq!(flash.erase(0, SECTOR_BYTES), Err(FlashError::Failed(1 << flag)));
            flash.0.fails = 1 << flag;
            assert_eq!(flash.write(0, &[0; 4]), Err(FlashError::Failed(1 << flag)));
            assert_eq!(flash.0.control, LOCK);
            flash.write(0, &[0; 4]).unwrap();
        }
    }

    #[test]
    fn a_flash_that_stays_busy_is_waited_for_in_bounds_and_works_when_it_is_ready() {
        let mut flash = Flash::new(Model::new());
        flash.0.takes = 3 * LOOKS_PER_WORD - 1;
        assert_eq!(flash.write(0, &[0; 4]), Err(FlashError::Busy));
        // Nothing is begun meanwhile.
        assert_eq!(flash.write(0, &[0; 4]), Err(FlashError::Busy));
        assert_eq!(flash.0.operations, 1);
        flash.0.takes = LOOKS_PER_WORD - 1;
        flash.write(0, &[0; 4]).unwrap();
        flash.write(0, &[0; 4]).unwrap();
        assert_eq!((flash.0.operations, flash.0.control), (3, LOCK));
        flash.0.takes = u32::MAX;
        assert_eq!(flash.erase(0, SECTOR_BYTES), Err(FlashError::Busy));
    }

    #[test]
    fn one_that_does_not_unlock_is_told() {
        struct Stuck;
        impl Bus for Stuck {
            fn read(&self, address: u32) -> u32 {
                if address == CONTROL { LOCK } else { 0 }
            }
            fn write(&mut self, address: u32, _: u32) {
                assert_eq!(address, KEY);
            }
        }
        assert_eq!(Flash::new(Stuck).write(0, &[0; 4]), Err(FlashError::Locked));
    }

    #[test]
    fn a_store_in_it_keeps_what_was_saved() {
        let mut store = Store::open(Flash::new(Model::new())).unwrap();
        assert_eq!((store.prepare(), store.newest(), store.free_slots()), (Ok(true), None, 31));
        let entry = |index| Entry { key: 7, index, value: 0.5 + f32::from(index) };
        for sequence in 0..40 {
            store.begin(0x0123_4567, 2).unwrap();
            store.put(&entry(sequence)).unwrap();
            store.put(&entry(1)).unwrap();
            store.finish().unwrap();
            // A start.
            store = Store::open(store.into_flash()).unwrap();
            store.prepare().unwrap();
            assert_eq!(store.newest().map(|set| set.sequence), Some(sequence.into()));
            assert_eq!(store.entry(0), Ok(Some(entry(sequence))));
        }
    }

    /// The image ends where the sectors begin, and carries where they are.
    #[test]
    fn memory_x_keeps_the_sectors_free() {
        let text = include_str!("../../../../memory.x");
        let expected = vec![
            std::format!("FLASH : ORIGIN = 0x08000000, LENGTH = {}K", (BEGIN - 0x0800_0000) >> 10),
            std::format!("SAVED : ORIGIN = 0x{BEGIN:08X}, LENGTH = {}K", BYTES >> 10),
        ];
        let lines: Vec<&str> = text.lines().map(str::trim).collect();
        for line in expected {
            assert!(lines.contains(&line.as_str()), "no `{line}` in memory.x");
        }
    }
}
