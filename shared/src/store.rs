//! Saved parameters: a log of sets in two sectors of NOR flash, of which the newest whole one counts.
//!
//! ```text
//! sector   | ready mark | set | set | cut write | set | blank | blank | ...       slots of 4 KiB, the mark in the first
//! set      | format | sequence | hand | count | count x (key, index, value) | CRC-32 | valid mark |      32-bit words
//! ```
//!
//! - **Old or new, never a mixture.** A set is written into blank flash behind the one that is valid, is read back, and
//!   becomes valid by its last word. A write that is cut leaves a slot that is skipped for good.
//! - **Only [`Store::prepare`] erases**, for it stops the processor for seconds. It erases the sector that the newest set
//!   is *not* in, when there is little room left: so a save finds a blank slot, and mostly older sets stay where they are.
//!   A sector is marked ready after it was erased and looked through, and the mark goes before it is erased again, so that
//!   an erasure that was cut, whatever it left, is done again.
//! - **A save only programs**, no word twice, at most [`MOST_WORDS`] a call: [`Store::begin`], [`Store::put`] for each
//!   entry, [`Store::finish`].
//! - **Every loop is bounded** by the number of slots and their size, whatever the flash holds.
//!
//! An entry names its parameter by a hash of its key, not by its place on the wire: another firmware takes what it knows
//! and can say what it left out.

use crate::link::checksum::Checksum;
use core::fmt;
use embedded_storage::nor_flash::{NorFlash, NorFlashError, NorFlashErrorKind};

/// Bytes of a slot: a set, or the mark of a sector, and nothing else.
pub const SLOT_BYTES: u32 = 4096;

/// Most entries of a set.
pub const MOST_ENTRIES: usize =
    (SLOT_BYTES / WORD - HEADER_WORDS - TRAILER_WORDS) as usize / ENTRY_WORDS as usize;

/// Most words that a call programs; [`Store::prepare`] apart.
pub const MOST_WORDS: usize = 4;

const WORD: u32 = 4;
const HEADER_WORDS: u32 = 4;
const ENTRY_WORDS: u32 = 3;
/// The CRC and the mark.
const TRAILER_WORDS: u32 = 2;

/// First word of a set: `BG` and the version of the format.
const FORMAT: u32 = 0x4247_0001;
/// First word of a sector that was erased to its end.
const READY: u32 = 0x5EAD_1E55;
/// Last word of a set that was read back.
const VALID: u32 = 0x600D_5E75;
const BLANK: u32 = u32::MAX;
/// The value that a word can be programmed to whatever it holds.
const CLEARED: u32 = 0;

/// Free slots below which a sector is erased: so many saves are possible after every start.
const FEW_SLOTS: u32 = 8;

/// A parameter that was saved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// The [hash](crate::parameters::Parameter::key_hash) of its key.
    pub key: u32,
    /// Of which joint or axis.
    pub index: u8,
    /// Its value.
    pub value: f32,
}

/// A set that is valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Set {
    /// Number of the save; it wraps.
    pub sequence: u32,
    /// Hash of the hand that it was saved for.
    pub hand_hash: u32,
    /// The number of its entries.
    pub entry_count: usize,
    /// Its beginning.
    at: u32,
}

impl Set {
    /// Returns `true` if it was saved after another: by the shorter way round, as sequence numbers wrap.
    fn is_newer_than(&self, other: &Self) -> bool {
        self.sequence.wrapping_sub(other.sequence).cast_signed() > 0
    }
}

/// The reason for which nothing is saved. What was valid stays so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError {
    /// The flash is not two sectors of at least two slots, or can't be written by words.
    Geometry,
    /// No slot is blank, and a sector can be erased only at the start.
    NoSpare,
    /// More entries than fit a set.
    TooManyEntries,
    /// Not as many entries as were announced, or none were.
    OutOfOrder,
    /// The words that were read back are not those that were written.
    ReadBack,
    /// The flash reports an error.
    Flash(NorFlashErrorKind),
}

impl fmt::Display for StoreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Geometry => write!(f, "the flash has other sectors than the store needs"),
            Self::NoSpare => write!(f, "no room is left until a sector is erased at the next start"),
            Self::TooManyEntries => write!(f, "more than {MOST_ENTRIES} entries don't fit a set"),
            Self::OutOfOrder => write!(f, "a set has as many entries as it was begun with"),
            Self::ReadBack => write!(f, "what was read back is not what was written"),
            Self::Flash(kind) => write!(f, "the flash: {kind}"),
        }
    }
}

impl core::error::Error for StoreError {}

type Result<T> = core::result::Result<T, StoreError>;

/// A set that is being written.
#[derive(Clone, Copy, Debug)]
struct Writing {
    set: Set,
    entries_left: usize,
    /// The place of the next word.
    next: u32,
    checksum: Checksum,
}

/// One of the two sectors.
#[derive(Clone, Copy, Debug)]
struct Sector {
    begin: u32,
    /// The slot behind the last one that is not blank; in a sector that is not ready, its end.
    free: u32,
}

/// Saved parameters in a flash that is theirs: two sectors of equal size.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    sectors: [Sector; 2],
    newest: Option<Set>,
    writing: Option<Writing>,
}

impl<F: NorFlash> Store<F> {
    /// Looks through the flash.
    ///
    /// # Errors
    /// The flash can't be read, or has other sectors.
    pub fn open(flash: F) -> Result<Self> {
        let bytes = u32::try_from(flash.capacity()).unwrap_or(0) / 2;
        let fits = WORD.is_multiple_of(F::WRITE_SIZE as u32)
            && WORD.is_multiple_of(F::READ_SIZE as u32)
            && bytes.is_multiple_of(F::ERASE_SIZE as u32)
            && bytes.is_multiple_of(SLOT_BYTES)
            && bytes >= 2 * SLOT_BYTES;
        if !fits {
            return Err(StoreError::Geometry);
        }
        let sectors = [0, bytes].map(|begin| Sector { begin, free: begin + bytes });
        let mut store = Self { flash, sectors, newest: None, writing: None };
        for which in 0..store.sectors.len() {
            store.look_through(which)?;
        }
        Ok(store)
    }

    /// The newest valid set.
    pub fn newest(&self) -> Option<&Set> {
        self.newest.as_ref()
    }

    /// An entry of the newest valid set.
    ///
    /// # Errors
    /// The flash can't be read.
    pub fn entry(&mut self, index: usize) -> Result<Option<Entry>> {
        match self.newest {
            Some(set) if index < set.entry_count => {
                let at = set.at + (HEADER_WORDS + ENTRY_WORDS * index as u32) * WORD;
                let [key, index, bits] = [self.word(at)?, self.word(at + WORD)?, self.word(at + 2 * WORD)?];
                Ok(Some(Entry { key, index: index as u8, value: f32::from_bits(bits) }))
            }
            _ => Ok(None),
        }
    }

    /// Saves that are possible before the next start.
    pub fn free_slots(&self) -> u32 {
        self.sectors.iter().map(|sector| (self.end(sector) - sector.free) / SLOT_BYTES).sum()
    }

    /// Erases the sector that the newest set is not in, if there is little room; tells whether it did. **Only at the start,
    /// with the outputs off and without a watchdog**: nothing else is done meanwhile.
    ///
    /// # Errors
    /// The flash reports an error, or is not blank afterwards.
    pub fn prepare(&mut self) -> Result<bool> {
        self.writing = None;
        if self.free_slots() >= FEW_SLOTS.min(self.sector_bytes() / SLOT_BYTES - 1) {
            return Ok(false);
        }
        let which = usize::from(self.newest.is_some_and(|set| set.at < self.sectors[1].begin));
        let Sector { begin, .. } = self.sectors[which];
        let end = begin + self.sector_bytes();
        self.sectors[which].free = end;
        self.program(begin, CLEARED)?;
        self.flash.erase(begin, end).map_err(|error| StoreError::Flash(error.kind()))?;
        if !self.is_blank(begin, end)? {
            return Err(StoreError::ReadBack);
        }
        self.program(begin, READY)?;
        if self.word(begin)? != READY {
            return Err(StoreError::ReadBack);
        }
        self.sectors[which].free = begin + SLOT_BYTES;
        Ok(true)
    }

    /// Begins a set; one that is not finished is given up.
    ///
    /// # Errors
    /// There is no room, or the flash reports an error.
    pub fn begin(&mut self, hand_hash: u32, entry_count: usize) -> Result<()> {
        self.writing = None;
        if entry_count > MOST_ENTRIES {
            return Err(StoreError::TooManyEntries);
        }
        // Behind the newest set while there is room, so that the older ones stay in the other sector.
        let first = usize::from(self.newest.is_some_and(|set| set.at >= self.sectors[1].begin));
        let Some(which) = [first, 1 - first].into_iter().find(|&which| {
            let sector = &self.sectors[which];
            sector.free < self.end(sector)
        }) else {
            return Err(StoreError::NoSpare);
        };
        let at = self.sectors[which].free;
        self.sectors[which].free += SLOT_BYTES;
        let sequence = self.newest.map_or(0, |set| set.sequence.wrapping_add(1));
        let set = Set { sequence, hand_hash, entry_count, at };
        let writing = Writing { set, entries_left: entry_count, next: at, checksum: Checksum::START };
        self.extend(writing, &[FORMAT, sequence, hand_hash, entry_count as u32])
    }

    /// Writes an entry of the set that was begun.
    ///
    /// # Errors
    /// It is one too many, or the flash reports an error: the set has to be begun again.
    pub fn put(&mut self, entry: &Entry) -> Result<()> {
        match self.writing.take() {
            Some(writing @ Writing { entries_left: 1.., .. }) => {
                let entries_left = writing.entries_left - 1;
                let words = [entry.key, u32::from(entry.index), entry.value.to_bits()];
                self.extend(Writing { entries_left, ..writing }, &words)
            }
            _ => Err(StoreError::OutOfOrder),
        }
    }

    /// Reads back the set that was begun, and makes it the valid one.
    ///
    /// # Errors
    /// Entries are missing, what was read back is something else, or the flash reports an error: the set before stays the
    /// valid one.
    pub fn finish(&mut self) -> Result<()> {
        let Some(Writing { set, entries_left: 0, next, checksum }) = self.writing.take() else {
            return Err(StoreError::OutOfOrder);
        };
        self.program(next, u32::from_le_bytes(checksum.bytes()))?;
        if self.read_set(set.at)? != Some((set, next + WORD)) {
            return Err(StoreError::ReadBack);
        }
        self.program(next + WORD, VALID)?;
        if self.word(next + WORD)? != VALID {
            return Err(StoreError::ReadBack);
        }
        self.newest = Some(set);
        Ok(())
    }

    /// The flash.
    pub fn flash(&self) -> &F {
        &self.flash
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// Finds the newest set of a sector, and where it is blank.
    fn look_through(&mut self, which: usize) -> Result<()> {
        let Sector { begin, .. } = self.sectors[which];
        let end = begin + self.sector_bytes();
        let mut free = begin + SLOT_BYTES;
        for at in (free..end).step_by(SLOT_BYTES as usize) {
            if self.is_blank(at, at + SLOT_BYTES)? {
                continue;
            }
            free = at + SLOT_BYTES;
            if let Some((set, mark_at)) = self.read_set(at)?
                && self.word(mark_at)? == VALID
                && self.newest.is_none_or(|newest| set.is_newer_than(&newest))
            {
                self.newest = Some(set);
            }
        }
        let is_ready = self.word(begin)? == READY && self.is_blank(begin + WORD, begin + SLOT_BYTES)?;
        self.sectors[which].free = if is_ready { free } else { end };
        Ok(())
    }

    /// A set that is whole, and where its mark is.
    fn read_set(&mut self, at: u32) -> Result<Option<(Set, u32)>> {
        let mut checksum = Checksum::START;
        let mut header = [0; HEADER_WORDS as usize];
        for (word, at) in header.iter_mut().zip((at..).step_by(WORD as usize)) {
            *word = self.word(at)?;
            checksum.advance_word(*word);
        }
        let [FORMAT, sequence, hand_hash, entry_count] = header else { return Ok(None) };
        let entry_count = entry_count as usize;
        if entry_count > MOST_ENTRIES {
            return Ok(None);
        }
        let set = Set { sequence, hand_hash, entry_count, at };
        let begin = at + HEADER_WORDS * WORD;
        let crc_at = begin + ENTRY_WORDS * entry_count as u32 * WORD;
        for at in (begin..crc_at).step_by(WORD as usize) {
            checksum.advance_word(self.word(at)?);
        }
        let is_whole = self.word(crc_at)? == u32::from_le_bytes(checksum.bytes());
        Ok(is_whole.then_some((set, crc_at + WORD)))
    }

    /// Writes the next words of a set.
    #[inline(never)]
    fn extend(&mut self, mut writing: Writing, words: &[u32]) -> Result<()> {
        for &word in words {
            self.program(writing.next, word)?;
            writing.checksum.advance_word(word);
            writing.next += WORD;
        }
        self.writing = Some(writing);
        Ok(())
    }

    fn sector_bytes(&self) -> u32 {
        self.sectors[1].begin
    }

    fn end(&self, sector: &Sector) -> u32 {
        sector.begin + self.sector_bytes()
    }

    #[inline(never)]
    fn program(&mut self, at: u32, word: u32) -> Result<()> {
        self.flash.write(at, &word.to_le_bytes()).map_err(|error| StoreError::Flash(error.kind()))
    }

    #[inline(never)]
    fn word(&mut self, at: u32) -> Result<u32> {
        let mut bytes = [0; WORD as usize];
        self.flash.read(at, &mut bytes).map_err(|error| StoreError::Flash(error.kind()))?;
        Ok(u32::from_le_bytes(bytes))
    }

    fn is_blank(&mut self, begin: u32, end: u32) -> Result<bool> {
        for at in (begin..end).step_by(WORD as usize) {
            if self.word(at)? != BLANK {
                return Ok(false);
            }
        }
        Ok(true)
    }
}
