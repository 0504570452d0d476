//! The records around a fault, at full rate, whatever the telemetry sends.

use super::{LAW, List, Record};
use crate::command::{Answer, Command, Grasp, Refusal};
use crate::event::Events;
use crate::fault::{Fault, Raised};
use crate::limit::Limiting;
use crate::supervisor::Mode;

/// Records before the tick that entered the fault, at most.
pub const BEFORE: usize = 192;
/// Records from that tick on.
pub const AFTER: usize = 64;

/// A ring of the last records, which stands still a little after a fault. A record of twelve joints takes some 200 bytes,
/// the ring of 256 some 50 KiB: too much for a stack, so that it is made where it stays.
#[derive(Clone, Debug)]
pub struct Burst<const J: usize> {
    ring: [Slot<J>; BEFORE + AFTER],
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
        /// How many there are.
        count: u16,
        /// The one that was asked for.
        record: Record<J>,
    },
}

/// A record, such that an empty one is all zeros: the ring is then no part of an image. With `Option`s it would be, for
/// what they have instead of a value is no zero.
#[derive(Clone, Debug)]
struct Slot<const J: usize> {
    tick: u32,
    mode: Mode,
    events: Events,
    fault: Mark,
    reading_failed: Mark,
    command: Command,
    answer: u8,
    law: [f32; LAW],
    cycles: u32,
    late_ticks: u32,
    dropped: u32,
    counts: List<i32, J>,
    torques_nm: List<f32, J>,
    limiting: List<Limiting, J>,
}

// What became of a command: nothing was asked, it was done, or refused for the reason of this number and those above.
const NO_ANSWER: u8 = 0;
const DONE: u8 = 1;
const REFUSED: u8 = 2;

impl<const J: usize> Slot<J> {
    const BLANK: Self = Self {
        tick: 0,
        mode: Mode::Disarmed,
        events: Events::NONE,
        fault: Mark::NONE,
        reading_failed: Mark::NONE,
        command: Command::Grasp(Grasp::CONFIGURED),
        answer: NO_ANSWER,
        law: [0.0; LAW],
        cycles: 0,
        late_ticks: 0,
        dropped: 0,
        counts: List::empty(0),
        torques_nm: List::empty(0.0),
        limiting: List::empty(Limiting::NONE),
    };

    fn keep(&mut self, record: &Record<J>) {
        *self = Self {
            tick: record.tick,
            mode: record.mode,
            events: record.events,
            fault: Mark::of(record.fault),
            reading_failed: Mark::of(record.reading_failed),
            command: record.answer.map_or(Self::BLANK.command, |answer| answer.command),
            answer: match record.answer {
                None => NO_ANSWER,
                Some(Answer { refused: None, .. }) => DONE,
                Some(Answer { refused: Some(refusal), .. }) => REFUSED + refusal as u8,
            },
            law: record.law(),
            cycles: record.cycles,
            late_ticks: record.late_ticks,
            dropped: record.dropped,
            counts: record.counts,
            torques_nm: record.torques_nm,
            limiting: record.limiting,
        };
    }

    /// Numbered by its tick: it is one of all of them.
    fn record(&self) -> Record<J> {
        let refused =
            self.answer.checked_sub(REFUSED).and_then(|k| Refusal::ALL.get(usize::from(k))).copied();
        Record {
            sequence: self.tick,
            tick: self.tick,
            mode: self.mode,
            fault: self.fault.raised(),
            answer: (self.answer != NO_ANSWER).then_some(Answer { command: self.command, refused }),
            events: self.events,
            reading_failed: self.reading_failed.raised(),
            cycles: self.cycles,
            late_ticks: self.late_ticks,
            dropped: self.dropped,
            decimation: 1,
            counts: self.counts,
            torques_nm: self.torques_nm,
            limiting: self.limiting,
            ..Record::BLANK
        }
        .with_law(self.law)
    }
}

/// A fault, or none.
#[derive(Clone, Copy, Debug)]
struct Mark {
    /// Number of the fault; none has 0.
    number: u8,
    has_joint: bool,
    joint: u8,
}

impl Mark {
    const NONE: Self = Self { number: 0, has_joint: false, joint: 0 };

    fn of(raised: Option<Raised>) -> Self {
        raised.map_or(Self::NONE, |Raised { fault, joint }| Self {
            number: fault.number(),
            has_joint: joint.is_some(),
            joint: joint.unwrap_or(0),
        })
    }

    fn raised(self) -> Option<Raised> {
        Fault::from_number(self.number)
            .map(|fault| Raised { fault, joint: self.has_joint.then_some(self.joint) })
    }
}

impl<const J: usize> Burst<J> {
    /// An empty ring.
    pub const fn new() -> Self {
        Self { ring: [const { Slot::BLANK }; BEFORE + AFTER], next: 0, count: 0, phase: Phase::Watching }
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
                force_n: 5.0,
                work_j: -1e-9,
                excess_j: 1e-3,
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
