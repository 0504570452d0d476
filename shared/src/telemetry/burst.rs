//! The records around a fault, at full rate, whatever the telemetry sends.

use super::Record;
use crate::signals::Kept;
use crate::supervisor::Mode;

/// Records before the tick that entered the fault, at most.
pub const BEFORE: usize = 120;
/// Records from that tick on.
pub const AFTER: usize = 64;

/// A ring of the last records, which stands still a little after a fault. A record of twelve joints takes some 300 bytes,
/// the ring of 184 some 55 KiB: too much for a stack, so that it is made where it stays.
#[derive(Clone, Debug)]
pub struct Burst<const J: usize> {
    ring: [Kept<J>; BEFORE + AFTER],
    /// The place of the next record; the oldest is there too, once the ring is full.
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

/// A burst, as far as it can be read.
#[derive(Clone, Debug, PartialEq)]
pub enum Caught<const J: usize> {
    /// No fault was caught since the hand was last armed.
    Nothing,
    /// The records after the fault are still being taken.
    NotOver,
    /// There are fewer records.
    NoSuchRecord,
    /// A record.
    Record {
        /// The number of records.
        count: u16,
        /// The one that was asked for.
        record: Record<J>,
    },
}

impl<const J: usize> Burst<J> {
    /// An empty ring.
    pub const fn new() -> Self {
        Self { ring: [const { Kept::BLANK }; BEFORE + AFTER], next: 0, count: 0, phase: Phase::Watching }
    }

    /// Takes the record of a tick: one copy, at most.
    pub fn take(&mut self, record: &Record<J>) {
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
            place.keep(record);
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
    pub fn get(&self, index: u16) -> Caught<J> {
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
            Some(slot) => Caught::Record { count: self.count as u16, record: slot.record() },
            None => Caught::NoSuchRecord,
        }
    }
}

impl<const J: usize> Default for Burst<J> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{Answer, Command, Refusal};
    use crate::control::PerGain;
    use crate::fault::{Fault, Raised};
    use crate::list::List;
    use std::boxed::Box;

    #[test]
    fn what_is_kept_is_the_record() {
        let mut burst = Box::new(Burst::<3>::new());
        let answers = Refusal::ALL.iter().map(|&refusal| Some(refusal)).chain([None]);
        let answers =
            answers.flat_map(|refused| Command::ALL.map(|command| Some(Answer { command, refused })));
        let records: std::vec::Vec<_> = answers
            .chain([None])
            .cycle()
            .zip(0..)
            .take(AFTER)
            .map(|(answer, tick)| Record {
                sequence: tick,
                tick,
                mode: Mode::Fault,
                answer,
                fault: Fault::ALL.get(tick as usize % 20).map(|&fault| Raised::at(tick as usize % 3, fault)),
                reading_failed: (tick % 2 == 0).then_some(Raised::of_hand(Fault::OutputFailed)),
                gains: PerGain::all(5.0),
                work_j: -1e-9,
                cycles: 123,
                late_ticks: 4,
                dropped: 5,
                decimation: 1,
                counts: List::first_of([1, -2, i32::MIN], 3),
                torques_nm: List::first_of([0.5, -0.0, f32::INFINITY], 3),
                ..Record::BLANK
            })
            .collect();
        records.iter().for_each(|record| burst.take(record));
        for (record, index) in records.into_iter().zip(0..) {
            assert_eq!(burst.get(index), Caught::Record { count: AFTER as u16, record });
        }
        assert_eq!(burst.get(AFTER as u16), Caught::NoSuchRecord);
    }
}
