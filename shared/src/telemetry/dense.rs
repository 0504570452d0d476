//! The dense form of a record: what changes from record to record in few bits, for a line that is not fast.
//!
//! Numbers that grow, and counts, are sent by their low bits: the receiver has the record before. What is computed from
//! them (law and torques) is sent as half-precision floats (IEEE 754 binary16), and a replay that computes it again can
//! tell by the [`digest`] that it has the very bits. Everything else is whole.
//!
//! **A wrong value is never presented.** The encoder takes so many bits that a receiver whose last record is one of the
//! last [`WINDOW`] that were sent gets every value exactly, whatever was lost in between; a receiver that has lost more
//! waits for a full record, which comes at least every [`FULL_EVERY_TICKS`]. That numbers, ticks and the check of each
//! record agree is looked at besides.

use super::{DecodeError, List, Record};
use crate::event::Events;
use crate::fault::{Fault, Raised};
use crate::limit::Limiting;
use crate::link::message::Signals;
use crate::supervisor::Mode;
use half::f16;

/// First byte of the payload; the replies of postcard have lower ones.
pub const TAG: u8 = 6;

/// Ticks after which a record is sent in full again, at most.
pub const FULL_EVERY_TICKS: u32 = 100;

/// Of so many records in a row, a receiver can do without all but the last.
pub const WINDOW: usize = 8;

/// Bits of the last flags: what follows.
const HAS_FAULT: u8 = 1 << 4;
const HAS_READING_FAILED: u8 = 1 << 5;
const HAS_TORQUES: u8 = 1 << 6;
const HAS_LIMITING: u8 = 1 << 7;
/// On the wire, a fault of the whole hand.
const NO_JOINT: u8 = u8::MAX;
/// Bits of a count for each `n`.
const NIBBLE: u32 = 4;
/// Nibbles of a count, at most.
const MOST_NIBBLES: u8 = 8;

/// A hash that costs three instructions a word.
#[derive(Clone, Copy)]
struct Hash(u32);

impl Hash {
    const START: Self = Self(0);

    fn add(&mut self, word: u32) {
        self.0 = (self.0.rotate_left(5) ^ word).wrapping_mul(0x9E37_79B9);
    }
}

/// What the law and the limits computed, to the bit: 16 bits of a hash of the five quantities of the law and all torques.
pub fn digest<const J: usize>(record: &Record<f32, J>) -> u16 {
    let mut hash = Hash::START;
    law(record).into_iter().chain(record.torques_nm.iter().copied()).for_each(|v| hash.add(v.to_bits()));
    (hash.0 >> 16) as u16
}

/// Whether numbers and counts were put together rightly: 8 bits of a hash of them.
fn check<const J: usize>(record: &Record<f32, J>) -> u8 {
    let mut hash = Hash::START;
    let numbers =
        [record.sequence, record.tick, record.late_ticks, record.dropped, u32::from(record.decimation)];
    numbers.into_iter().for_each(|number| hash.add(number));
    record.counts.iter().for_each(|&count| hash.add(count as u32));
    (hash.0 >> 24) as u8
}

/// What the law tells, in the order of the wire.
fn law<const J: usize>(record: &Record<f32, J>) -> [f32; 5] {
    [
        record.force_n,
        record.attitude_stiffness_nm,
        record.approach_potential_j,
        record.attitude_potential_j,
        record.energy_j,
    ]
}

fn half(value: f32) -> f32 {
    f16::from_f32_const(value).to_f32_const()
}

/// Cycles are told by the four.
fn told_cycles(cycles: u32) -> u16 {
    u16::try_from(cycles / 4).unwrap_or(u16::MAX)
}

/// What the dense form of a record tells of it. A record with an answer has no dense form: here it loses it.
pub fn quantised<const J: usize>(record: &Record<f32, J>) -> Record<f32, J> {
    let joint = |raised: Raised| Raised { joint: raised.joint.filter(|&joint| joint != NO_JOINT), ..raised };
    let mut torques_nm = record.torques_nm;
    torques_nm.iter_mut().for_each(|torque| *torque = half(*torque));
    Record {
        fault: record.fault.map(joint),
        reading_failed: record.reading_failed.map(joint),
        answer: None,
        force_n: half(record.force_n),
        attitude_stiffness_nm: half(record.attitude_stiffness_nm),
        approach_potential_j: half(record.approach_potential_j),
        attitude_potential_j: half(record.attitude_potential_j),
        energy_j: half(record.energy_j),
        cycles: 4 * u32::from(told_cycles(record.cycles)),
        torques_nm,
        ..record.clone()
    }
}

/// What the encoder remembers of a record that was sent.
#[derive(Clone, Copy, Debug)]
struct Past {
    /// Largest change of a count to this record.
    change: u32,
    late_ticks: u32,
    dropped: u32,
}

/// What a sender remembers of the records before.
#[derive(Clone, Debug)]
pub struct Encoder<const J: usize> {
    /// The last counts, and in which record they were.
    counts: List<i32, J>,
    counts_sequence: u32,
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
        let nothing = Past { change: 0, late_ticks: 0, dropped: 0 };
        Self {
            counts: List::empty(0),
            counts_sequence: 0,
            past: [nothing; WINDOW],
            oldest: 0,
            sequence: 0,
            decimation: 0,
            signals: Signals::NONE,
            full_tick: None,
            full_left: 0,
        }
    }

    /// Takes the next record that is sent: the nibbles of each count in its dense form, or `None` where it has to be
    /// sent in full.
    pub(crate) fn next(&mut self, record: &Record<f32, J>, signals: Signals) -> Option<u8> {
        let most = u32::from(u8::MAX >> 4);
        let oldest = self.past.get(self.oldest).copied();
        let grows_slowly = oldest.is_some_and(|past| {
            record.late_ticks.wrapping_sub(past.late_ticks) <= most
                && record.dropped.wrapping_sub(past.dropped) <= most
        });
        // A receiver knows which lists there are from a full record: with other signals, none but full ones are sent until
        // it has one, or has lost too many.
        let parts = signals.without(Signals::DENSE);
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
        if let Some(past) = self.past.get_mut(self.oldest) {
            *past = Past { change, late_ticks: record.late_ticks, dropped: record.dropped };
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
        if counts.is_empty() {
            return Some(0);
        }
        // A receiver that knows any record of the window has missed at most as many changes as there are in it.
        let largest = self.past.iter().fold(0, |largest, past| past.change.max(largest));
        let most = largest.checked_mul(WINDOW as u32);
        let nibbles = most.and_then(|most| {
            // With a bit for the sign.
            (1..MOST_NIBBLES).find(|&n| most < 1 << (NIBBLE * u32::from(n) - 1))
        });
        Some(nibbles.unwrap_or(MOST_NIBBLES))
    }
}

/// Writes the dense form of a record, a byte at a time.
///
/// # Errors
/// Those of `put`.
pub(crate) fn write<E, const J: usize>(
    record: &Record<f32, J>,
    nibbles: u8,
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
    let mut put_half = |value| f16::from_f32_const(value).to_le_bytes().into_iter().try_for_each(&mut put);
    law(record).into_iter().try_for_each(&mut put_half)?;
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
    put(check(record))?;
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

/// Why there is no record in a dense form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Undecoded {
    /// The bytes are no dense record of this hand.
    Bytes(DecodeError),
    /// What it goes on from is not known.
    Lost,
}

/// The last counts that a receiver knows.
#[derive(Clone, Debug)]
pub(crate) struct Counts<const J: usize> {
    counts: List<i32, J>,
    /// In which record they were.
    sequence: u32,
}

impl<const J: usize> Counts<J> {
    /// None are known.
    pub(crate) const fn new() -> Self {
        Self { counts: List::empty(0), sequence: 0 }
    }

    /// Takes those of a record, if it has some.
    pub(crate) fn take(&mut self, record: &Record<f32, J>) {
        if !record.counts.is_empty() {
            *self = Self { counts: record.counts, sequence: record.sequence };
        }
    }
}

/// Reads the dense form of the record that follows another, which need not be the one just before it. Returns the
/// record and its digest.
pub(crate) fn read<const J: usize>(
    bytes: &[u8],
    before: &Record<f32, J>,
    counts_before: &Counts<J>,
) -> Result<(Record<f32, J>, u16), Undecoded> {
    let mut body = Body(bytes);
    if body.byte()? != TAG {
        return Err(Undecoded::Bytes(DecodeError::Malformed));
    }
    let sequence = body.byte()?;
    let tick = body.u16()?;
    let passed = u32::from(sequence.wrapping_sub(before.sequence as u8));
    let ticks = u32::from(tick.wrapping_sub(before.tick as u16));
    if !(1..=WINDOW).contains(&(passed as usize)) || ticks != (passed * u32::from(before.decimation)) & 0xffff
    {
        return Err(Undecoded::Lost);
    }
    let sequence = before.sequence.wrapping_add(passed);
    let [mode_events, flags] = body.array()?;
    let cycles = 4 * u32::from(body.u16()?);
    let grown = body.byte()?;
    let [force_n, attitude_stiffness_nm, approach_potential_j, attitude_potential_j, energy_j] =
        [body.half()?, body.half()?, body.half()?, body.half()?, body.half()?];
    let fault = if flags & HAS_FAULT != 0 { Some(body.raised()?) } else { None };
    let reading_failed = if flags & HAS_READING_FAILED != 0 { Some(body.raised()?) } else { None };
    let malformed = Undecoded::Bytes(DecodeError::Malformed);
    let mode = Mode::ALL.get(usize::from(mode_events & 0b111)).copied().ok_or(malformed)?;
    let events = Events::from_bits(mode_events >> 3).ok_or(malformed)?;

    let nibbles = flags & 0xf;
    if nibbles > MOST_NIBBLES {
        return Err(malformed);
    }
    let mut counts = List::default();
    if nibbles > 0 {
        if sequence.wrapping_sub(counts_before.sequence) as usize > WINDOW {
            return Err(Undecoded::Lost);
        }
        counts = counts_before.counts;
        let bits = NIBBLE * u32::from(nibbles);
        let mut packed = Unpacked { body: &mut body, waiting: None };
        for count in counts.iter_mut() {
            let mut low = 0;
            for k in 0..u32::from(nibbles) {
                low |= u32::from(packed.next()?) << (NIBBLE * k);
            }
            // The change, with its sign, from as many bits.
            let change = (low.wrapping_sub(*count as u32) << (u32::BITS - bits)) as i32 >> (u32::BITS - bits);
            *count = count.wrapping_add(change);
        }
    }
    let mut torques_nm = List::default();
    if flags & HAS_TORQUES != 0 {
        torques_nm = List::first_of([0.0; J], before.torques_nm.len());
        for torque in torques_nm.iter_mut() {
            *torque = body.half()?;
        }
    }
    let mut limiting = List::first_of([Limiting::NONE; J], before.limiting.len());
    if flags & HAS_LIMITING != 0 {
        let mut packed = Unpacked { body: &mut body, waiting: None };
        for limiting in limiting.iter_mut() {
            *limiting = Limiting::from_bits(packed.next()?);
        }
    }
    let told_check = body.byte()?;
    let told_digest = body.u16()?;
    if !body.0.is_empty() {
        return Err(Undecoded::Bytes(DecodeError::TrailingBytes));
    }

    let grown_by =
        |low: u8, before: u32| before.wrapping_add(u32::from(low.wrapping_sub(before as u8) & 0xf));
    let record = Record {
        sequence,
        tick: before.tick.wrapping_add(passed * u32::from(before.decimation)),
        mode,
        fault,
        answer: None,
        events,
        reading_failed,
        force_n,
        attitude_stiffness_nm,
        approach_potential_j,
        attitude_potential_j,
        energy_j,
        cycles,
        late_ticks: grown_by(grown, before.late_ticks),
        dropped: grown_by(grown >> 4, before.dropped),
        decimation: before.decimation,
        counts,
        torques_nm,
        limiting,
    };
    if check(&record) == told_check { Ok((record, told_digest)) } else { Err(Undecoded::Lost) }
}

/// Bytes that are still to be read.
struct Body<'b>(&'b [u8]);

impl Body<'_> {
    fn array<const N: usize>(&mut self) -> Result<[u8; N], Undecoded> {
        let (array, rest) = self.0.split_first_chunk().ok_or(Undecoded::Bytes(DecodeError::Malformed))?;
        self.0 = rest;
        Ok(*array)
    }

    fn byte(&mut self) -> Result<u8, Undecoded> {
        self.array().map(|[byte]| byte)
    }

    fn u16(&mut self) -> Result<u16, Undecoded> {
        self.array().map(u16::from_le_bytes)
    }

    fn half(&mut self) -> Result<f32, Undecoded> {
        self.array().map(|bytes| f16::from_le_bytes(bytes).to_f32_const())
    }

    fn raised(&mut self) -> Result<Raised, Undecoded> {
        let [number, joint] = self.array()?;
        let fault = Fault::from_number(number).ok_or(Undecoded::Bytes(DecodeError::Malformed))?;
        Ok(Raised { fault, joint: (joint != NO_JOINT).then_some(joint) })
    }
}

/// Bytes to half bytes, the low one first.
struct Unpacked<'u, 'b> {
    body: &'u mut Body<'b>,
    waiting: Option<u8>,
}

impl Unpacked<'_, '_> {
    fn next(&mut self) -> Result<u8, Undecoded> {
        if let Some(high) = self.waiting.take() {
            return Ok(high);
        }
        let byte = self.body.byte()?;
        self.waiting = Some(byte >> 4);
        Ok(byte & 0xf)
    }
}

impl<const J: usize> Default for Encoder<J> {
    fn default() -> Self {
        Self::new()
    }
}
