//! The records around a fault, at full rate, whatever the telemetry sends.

use super::Record;
use crate::supervisor::Mode;

/// Records before the tick that entered the fault, at most.
pub const BEFORE: usize = 192;
/// Records from that tick on.
pub const AFTER: usize = 64;

/// A ring of the last records, which stands still a little after a fault. A record of twelve joints takes some 200 bytes,
/// the ring of 256 some 50 KiB: too much for a stack, so that it is made where it stays.
#[derive(Clone, Debug)]
pub struct Burst<const J: usize> {
    ring: [Record<f32, J>; BEFORE + AFTER],
    /// Where the next record goes; the oldest is there too, once the ring is full.
    next: usize,
    /// Records in the ring.
    count: usize,
    phase: Phase,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// No fault.
    Watching,
    /// There was one: so many records are still to come.
    Caught { left: usize },
    /// Over: it stays until the hand is armed.
    Kept,
}

/// Whether a burst can be read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Caught<'b, const J: usize> {
    /// No fault was caught since the hand was last armed.
    Nothing,
    /// The records after the fault are still being taken.
    NotOver,
    /// There are fewer records.
    NoSuchRecord,
    /// A record.
    Record {
        /// How many there are.
        count: u16,
        /// The one that was asked for.
        record: &'b Record<f32, J>,
    },
}

impl<const J: usize> Burst<J> {
    /// An empty ring.
    pub const fn new() -> Self {
        Self { ring: [const { Record::BLANK }; BEFORE + AFTER], next: 0, count: 0, phase: Phase::Watching }
    }

    /// Takes the record of a tick: one copy, at most.
    pub fn take(&mut self, record: &Record<f32, J>) {
        if self.phase == Phase::Kept {
            if matches!(record.mode, Mode::Disarmed | Mode::Fault) {
                return;
            }
            self.phase = Phase::Watching;
            self.next = 0;
            self.count = 0;
        }
        if self.phase == Phase::Watching && record.mode == Mode::Fault {
            self.phase = Phase::Caught { left: AFTER };
        }
        if let Some(place) = self.ring.get_mut(self.next) {
            place.clone_from(record);
        }
        self.next = (self.next + 1) % self.ring.len();
        self.count = (self.count + 1).min(self.ring.len());
        if let Phase::Caught { left } = &mut self.phase {
            *left = left.saturating_sub(1);
            if *left == 0 {
                self.phase = Phase::Kept;
            }
        }
    }

    /// A record of what was caught; 0 is the oldest.
    pub fn get(&self, index: u16) -> Caught<'_, J> {
        match self.phase {
            Phase::Watching => return Caught::Nothing,
            Phase::Caught { .. } => return Caught::NotOver,
            Phase::Kept => {}
        }
        let index = usize::from(index);
        if index >= self.count {
            return Caught::NoSuchRecord;
        }
        let oldest = if self.count < self.ring.len() { 0 } else { self.next };
        match self.ring.get((oldest + index) % self.ring.len()) {
            Some(record) => Caught::Record { count: self.count as u16, record },
            None => Caught::NoSuchRecord,
        }
    }
}

impl<const J: usize> Default for Burst<J> {
    fn default() -> Self {
        Self::new()
    }
}
