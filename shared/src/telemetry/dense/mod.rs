//! The dense form of a record: what changes from record to record in few bits, for a line that is not fast.
//!
//! Numbers that grow, and counts, are sent by their low bits: the receiver has the record before. What is computed from
//! them (law, ledger and torques) is sent as half-precision floats (IEEE 754 binary16), and a replay that computes it again
//! can tell by the [`digest`] that it has the very bits. Of the law's and the ledger's numbers only those are sent that
//! have changed of late. Everything else is whole.
//!
//! **A wrong value is never presented.** The encoder takes so many bits, and so many numbers, that a receiver whose last record is one of the
//! last [`WINDOW`] that were sent gets every value exactly, whatever was lost in between; a receiver that has lost more
//! waits for a full record, which comes at least every [`FULL_EVERY_TICKS`]. That numbers, ticks and the check of each
//! record agree is looked at besides.

mod decoder;
mod encoder;

pub use encoder::Encoder;

pub(crate) use decoder::{Counts, Undecoded, read};
pub(crate) use encoder::write;

use super::{LAW, Record};
use crate::fault::Raised;
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

/// What the law, the ledger and the limits computed, to the bit: 16 bits of a hash of their nine numbers and all torques.
pub fn digest<const J: usize>(record: &Record<J>) -> u16 {
    let mut hash = Hash::START;
    record.law().into_iter().chain(record.torques_nm.iter().copied()).for_each(|v| hash.add(v.to_bits()));
    (hash.0 >> 16) as u16
}

/// Whether the record was put together rightly: 8 bits of a hash of numbers, of law and ledger as they are sent, and of
/// counts.
fn check<const J: usize>(record: &Record<J>, law: &[u16; LAW]) -> u8 {
    let mut hash = Hash::START;
    let numbers =
        [record.sequence, record.tick, record.late_ticks, record.dropped, u32::from(record.decimation)];
    numbers.into_iter().for_each(|number| hash.add(number));
    law.iter().for_each(|&half| hash.add(half.into()));
    record.counts.iter().for_each(|&count| hash.add(count as u32));
    (hash.0 >> 24) as u8
}

/// What law and ledger tell, as it is sent.
fn halves<const J: usize>(record: &Record<J>) -> [u16; LAW] {
    record.law().map(|number| f16::from_f32_const(number).to_bits())
}

/// Which bit says that a number of law and ledger is sent. The attitudes' stiffness and the integral's gain, which change
/// together if at all, share one.
const fn law_bit(k: usize) -> u8 {
    1 << if k < 2 { k } else { k - 1 }
}

fn half(value: f32) -> f32 {
    f16::from_f32_const(value).to_f32_const()
}

/// Cycles are told by the four.
fn told_cycles(cycles: u32) -> u16 {
    u16::try_from(cycles / 4).unwrap_or(u16::MAX)
}

/// What the dense form of a record tells of it. A record with an answer has no dense form: here it loses it.
pub fn quantised<const J: usize>(record: &Record<J>) -> Record<J> {
    let joint = |raised: Raised| Raised { joint: raised.joint.filter(|&joint| joint != NO_JOINT), ..raised };
    let mut torques_nm = record.torques_nm;
    torques_nm.iter_mut().for_each(|torque| *torque = half(*torque));
    Record {
        fault: record.fault.map(joint),
        reading_failed: record.reading_failed.map(joint),
        answer: None,
        cycles: 4 * u32::from(told_cycles(record.cycles)),
        torques_nm,
        ..record.clone()
    }
    .with_law(record.law().map(half))
}
