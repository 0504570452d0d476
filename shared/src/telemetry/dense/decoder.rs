//! The dense form to records.

use super::{
    HAS_FAULT, HAS_LIMITING, HAS_READING_FAILED, HAS_TORQUES, MOST_NIBBLES, NIBBLE, NO_JOINT, TAG, WINDOW,
    check, half, halves, law_bit,
};
use crate::event::Events;
use crate::fault::{Fault, Raised};
use crate::limit::Limiting;
use crate::supervisor::Mode;
use crate::telemetry::{DecodeError, List, Record};
use half::f16;

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
    pub(crate) fn take(&mut self, record: &Record<J>) {
        if !record.counts.is_empty() {
            *self = Self { counts: record.counts, sequence: record.sequence };
        }
    }
}

/// Reads the dense form of the record that follows another, which need not be the one just before it. Returns the
/// record and its digest.
pub(crate) fn read<const J: usize>(
    bytes: &[u8],
    before: &Record<J>,
    counts_before: &Counts<J>,
) -> Result<(Record<J>, u16), Undecoded> {
    let mut body = Body(bytes);
    if body.byte()? != TAG {
        return Err(Undecoded::Bytes(DecodeError::Malformed));
    }
    let sequence = body.byte()?;
    let tick = body.u16()?;
    let passed = u32::from(sequence.wrapping_sub(before.sequence as u8));
    let ticks = u32::from(tick.wrapping_sub(before.tick as u16));
    // 0 ahead is the same frame twice.
    if passed == 0 || passed as usize > WINDOW || ticks != (passed * u32::from(before.decimation)) & 0xffff {
        return Err(Undecoded::Lost);
    }
    let sequence = before.sequence.wrapping_add(passed);
    let [mode_events, flags] = body.array()?;
    let cycles = 4 * u32::from(body.u16()?);
    let grown = body.byte()?;
    let sent = body.byte()?;
    let mut law = before.law();
    for (k, number) in law.iter_mut().enumerate() {
        // What is not sent has not changed, as it is sent.
        *number = if sent & law_bit(k) == 0 { half(*number) } else { body.half()? };
    }
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
        cycles,
        late_ticks: grown_by(grown, before.late_ticks),
        dropped: grown_by(grown >> 4, before.dropped),
        decimation: before.decimation,
        counts,
        torques_nm,
        limiting,
        ..Record::BLANK
    }
    .with_law(law);
    if check(&record, &halves(&record)) == told_check {
        Ok((record, told_digest))
    } else {
        Err(Undecoded::Lost)
    }
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
