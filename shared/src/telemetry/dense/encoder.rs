//! Records to their dense form.

use super::{
    FULL_EVERY_TICKS, HAS_FAULT, HAS_LIMITING, HAS_READING_FAILED, HAS_TORQUES, MOST_NIBBLES, NIBBLE,
    NO_JOINT, TAG, WINDOW, check, digest, halves, law_bit, told_cycles,
};
use crate::link::message::Signals;
use crate::telemetry::{LAW, List, Record};
use half::f16;

/// What the encoder remembers of a record that was sent.
#[derive(Clone, Copy, Debug)]
struct Past {
    /// Largest change of a count to this record.
    change: u32,
    /// Which numbers of law and ledger are others than in the record before, as they are sent.
    law: u8,
    late_ticks: u32,
    dropped: u32,
}

/// What a dense form is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// Of each count.
    nibbles: u8,
    /// Law and ledger, as they are sent.
    law: [u16; LAW],
    /// Which of them are.
    sent: u8,
}

/// What a sender remembers of the records before.
#[derive(Clone, Debug)]
pub struct Encoder<const J: usize> {
    /// The last counts, and in which record they were.
    counts: List<i32, J>,
    counts_sequence: u32,
    /// The last numbers of law and ledger, as they are sent.
    law: [u16; LAW],
    past: [Past; WINDOW],
    /// Where the oldest is.
    oldest: usize,
    sequence: u32,
    decimation: u16,
    signals: Signals,
    /// Tick of the last full record.
    full_tick: Option<u32>,
    /// So many records are sent in full in any case.
    full_left: usize,
}

impl<const J: usize> Encoder<J> {
    /// Nothing was sent.
    pub const fn new() -> Self {
        let nothing = Past { change: 0, law: 0, late_ticks: 0, dropped: 0 };
        Self {
            counts: List::empty(0),
            counts_sequence: 0,
            law: [0; LAW],
            past: [nothing; WINDOW],
            oldest: 0,
            sequence: 0,
            decimation: 0,
            signals: Signals::NONE,
            full_tick: None,
            full_left: 0,
        }
    }

    /// Takes the next record that is sent: what its dense form is made of, or `None` where it has to be sent in full.
    pub(crate) fn next(&mut self, record: &Record<J>, signals: Signals) -> Option<Shape> {
        let law = halves(record);
        let Record { late_ticks, dropped, .. } = *record;
        if self.full_tick.is_none() {
            // Nobody knows anything of what was before the first.
            self.past = [Past { change: 0, law: 0, late_ticks, dropped }; WINDOW];
            self.law = law;
        }
        let most = u32::from(u8::MAX >> 4);
        let oldest = self.past.get(self.oldest).copied();
        let grows_slowly = oldest.is_some_and(|past| {
            late_ticks.wrapping_sub(past.late_ticks) <= most && dropped.wrapping_sub(past.dropped) <= most
        });
        // A receiver knows which lists there are from a full record: with other signals, none but full ones are sent until
        // it has one, or has lost too many.
        let parts = signals.without(Signals::DENSE).without(Signals::STATE);
        if self.full_tick.is_some() && parts != self.signals {
            self.full_left = WINDOW;
        }
        self.signals = parts;
        let is_near = |sequence: u32| record.sequence.wrapping_sub(sequence) as usize <= WINDOW;
        let (counts, before) = (record.counts.as_slice(), self.counts.as_slice());
        let dense = signals.contain(Signals::DENSE)
            && self.full_left == 0
            && record.answer.is_none()
            && record.decimation == self.decimation
            && is_near(self.sequence)
            && self.full_tick.is_some_and(|full| record.tick.wrapping_sub(full) < FULL_EVERY_TICKS)
            && (counts.is_empty() || counts.len() == before.len() && is_near(self.counts_sequence))
            && grows_slowly;

        let changes = counts.iter().zip(before).map(|(new, old)| new.wrapping_sub(*old).unsigned_abs());
        let change = changes.max().unwrap_or(0);
        let others = law.iter().zip(&self.law).enumerate().filter(|(_, (now, before))| now != before);
        let changed = others.fold(0, |changed, (k, _)| changed | law_bit(k));
        self.law = law;
        if let Some(past) = self.past.get_mut(self.oldest) {
            *past = Past { change, law: changed, late_ticks, dropped };
        }
        self.oldest = (self.oldest + 1) % WINDOW;
        self.sequence = record.sequence;
        self.decimation = record.decimation;
        if !counts.is_empty() {
            self.counts = record.counts;
            self.counts_sequence = record.sequence;
        }
        if !dense {
            self.full_tick = Some(record.tick);
            self.full_left = self.full_left.saturating_sub(1);
            return None;
        }
        // A receiver that knows any record of the window has missed at most what has changed in it.
        let sent = self.past.iter().fold(0, |sent, past| sent | past.law);
        if counts.is_empty() {
            return Some(Shape { nibbles: 0, law, sent });
        }
        let largest = self.past.iter().fold(0, |largest, past| past.change.max(largest));
        let most = largest.checked_mul(WINDOW as u32);
        let nibbles = most.and_then(|most| {
            // With a bit for the sign.
            (1..MOST_NIBBLES).find(|&n| most < 1 << (NIBBLE * u32::from(n) - 1))
        });
        Some(Shape { nibbles: nibbles.unwrap_or(MOST_NIBBLES), law, sent })
    }
}

/// Writes the dense form of a record, a byte at a time.
///
/// # Errors
/// Those of `put`.
pub(crate) fn write<E, const J: usize>(
    record: &Record<J>,
    Shape { nibbles, law, sent }: Shape,
    mut put: impl FnMut(u8) -> Result<(), E>,
) -> Result<(), E> {
    let limited = record.limiting.iter().any(|limiting| !limiting.is_empty());
    let has = |there: bool, flag: u8| if there { flag } else { 0 };
    let flags = nibbles
        | has(record.fault.is_some(), HAS_FAULT)
        | has(record.reading_failed.is_some(), HAS_READING_FAILED)
        | has(!record.torques_nm.as_slice().is_empty(), HAS_TORQUES)
        | has(limited, HAS_LIMITING);
    put(TAG)?;
    put(record.sequence as u8)?;
    (record.tick as u16).to_le_bytes().into_iter().try_for_each(&mut put)?;
    put(record.mode as u8 | record.events.bits() << 3)?;
    put(flags)?;
    told_cycles(record.cycles).to_le_bytes().into_iter().try_for_each(&mut put)?;
    put(record.late_ticks as u8 & 0xf | (record.dropped as u8) << 4)?;
    put(sent)?;
    for (k, half) in law.iter().enumerate() {
        if sent & law_bit(k) != 0 {
            half.to_le_bytes().into_iter().try_for_each(&mut put)?;
        }
    }
    for raised in [record.fault, record.reading_failed].into_iter().flatten() {
        put(raised.fault.number())?;
        put(raised.joint.unwrap_or(NO_JOINT))?;
    }
    let mut packed = Packed { waiting: None };
    for &count in &record.counts {
        let mut rest = count as u32;
        for _ in 0..nibbles {
            packed.add(rest as u8 & 0xf, &mut put)?;
            rest >>= NIBBLE;
        }
    }
    packed.end(&mut put)?;
    for &torque in &record.torques_nm {
        f16::from_f32_const(torque).to_le_bytes().into_iter().try_for_each(&mut put)?;
    }
    if limited {
        let mut packed = Packed { waiting: None };
        record.limiting.iter().try_for_each(|limiting| packed.add(limiting.bits() & 0xf, &mut put))?;
        packed.end(&mut put)?;
    }
    put(check(record, &law))?;
    digest(record).to_le_bytes().into_iter().try_for_each(&mut put)
}

/// Half bytes to bytes, the low one first.
struct Packed {
    waiting: Option<u8>,
}

impl Packed {
    fn add<E>(&mut self, nibble: u8, put: impl FnOnce(u8) -> Result<(), E>) -> Result<(), E> {
        match self.waiting.take() {
            None => {
                self.waiting = Some(nibble);
                Ok(())
            }
            Some(low) => put(low | nibble << 4),
        }
    }

    fn end<E>(self, put: impl FnOnce(u8) -> Result<(), E>) -> Result<(), E> {
        self.waiting.map_or(Ok(()), put)
    }
}

impl<const J: usize> Default for Encoder<J> {
    fn default() -> Self {
        Self::new()
    }
}
