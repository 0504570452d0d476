//! The table of signals: everything that a tick tells.
//!
//! A row is a field of [`Record`]: its name, type, unit and words. From it follow the bytes on the wire and their most, the
//! form in which a [burst](crate::telemetry::burst) keeps it, and what [`Record::tell`] says of it to whoever makes tables,
//! schemas, comparisons or views. The gains and signals of the laws come from the list of [laws](crate::control).

use crate::bytes::BufferTooSmall;
use crate::command::{Answer, Command, Refusal};
use crate::control::{GAIN_COUNT, GAINS, PerGain, PerSignal, SIGNAL_COUNT, SIGNALS, Signal};
use crate::cycle::{Notice, Noticed};
use crate::event::{Event, Events};
use crate::fault::{Fault, Raised};
use crate::limit::Limiting;
use crate::list::List;
use crate::parameter::Each;
use crate::supervisor::Mode;
use core::fmt;
use serde::{Deserialize, Serialize};

/// Version of everything that goes over the wire. Two ends talk when theirs are equal; it has nothing to do with the
/// release's version.
pub const INTERFACE_VERSION: u16 = 6;

/// An error in the bytes of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecodeError {
    /// They end too early, or hold what no record holds.
    Malformed,
    /// There are more of them than the record has.
    TrailingBytes,
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Malformed => {
                write!(f, "the bytes are not a record of interface version {INTERFACE_VERSION}")
            }
            Self::TrailingBytes => write!(f, "there are bytes after the record"),
        }
    }
}

impl core::error::Error for DecodeError {}

/// The type of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A whole number, not negative.
    Whole,
    /// A whole number.
    Count,
    /// A real number.
    Real,
    /// True or false.
    Truth,
    /// A mode.
    Mode,
    /// A fault, by its number, or none.
    Fault,
    /// The number of a joint, or none.
    Joint,
    /// The result of a command, or none.
    Answer,
    /// The limit that acts on a torque.
    Limiting,
    /// A thing that was noticed, or none.
    Notice,
}

/// The value of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// There is none in this tick.
    Missing,
    /// A whole number, not negative.
    Whole(u32),
    /// A whole number.
    Count(i32),
    /// A real number.
    Real(f32),
    /// True or false.
    Truth(bool),
    /// A mode.
    Mode(Mode),
    /// A fault.
    Fault(Fault),
    /// The number of a joint.
    Joint(u8),
    /// The result of a command.
    Answer(Answer),
    /// The limit that acts on a torque.
    Limiting(Limiting),
    /// A thing that was noticed.
    Notice(Noticed),
    /// A count for each joint.
    Counts(&'a [i32]),
    /// A real number for each joint.
    Reals(&'a [f32]),
    /// The limit that acts on each joint's torque.
    Limits(&'a [Limiting]),
}

impl Value<'_> {
    /// Returns the value of one joint, of a signal that has one for each.
    pub fn of_joint(&self, joint: usize) -> Value<'static> {
        match *self {
            Self::Counts(values) => values.get(joint).map_or(Value::Missing, |&value| Value::Count(value)),
            Self::Reals(values) => values.get(joint).map_or(Value::Missing, |&value| Value::Real(value)),
            Self::Limits(values) => values.get(joint).map_or(Value::Missing, |&value| Value::Limiting(value)),
            _ => Value::Missing,
        }
    }
}

impl fmt::Display for Value<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => f.write_str("none"),
            Self::Whole(value) => value.fmt(f),
            Self::Count(value) => value.fmt(f),
            Self::Real(value) => value.fmt(f),
            Self::Truth(value) => value.fmt(f),
            Self::Mode(mode) => f.write_str(mode.words()),
            Self::Fault(fault) => write!(f, "{} ({})", fault.words(), fault.number()),
            Self::Joint(joint) => write!(f, "joint {joint}"),
            Self::Answer(answer) => answer.fmt(f),
            Self::Limiting(limiting) => limiting.fmt(f),
            Self::Notice(noticed) => noticed.fmt(f),
            Self::Counts(values) => fmt::Debug::fmt(values, f),
            Self::Reals(values) => fmt::Debug::fmt(values, f),
            Self::Limits(values) => fmt::Debug::fmt(values, f),
        }
    }
}

/// A signal with its value in a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told<'a> {
    /// Its name, unit and words.
    pub signal: Signal,
    /// Its type; of what is told for each joint, that of a joint.
    pub kind: Kind,
    /// The thing that has a value of its own: the hand, or each joint.
    pub each: Each,
    /// Its value.
    pub value: Value<'a>,
}

/// The type of a field: how it is kept, and what it says.
trait Field: Sized {
    /// Nothing.
    const BLANK: Self;
    /// Bytes that suffice on the wire.
    const MOST_BYTES: usize;
    /// The form in which it is kept in memory that is zero at first: its blank is all zeros, which that of an `Option` is
    /// not.
    type Kept: Copy;
    /// Nothing, kept.
    const KEPT: Self::Kept;

    /// Keeps it.
    fn keep(&self, to: &mut Self::Kept);
    /// Gives back what was kept.
    fn kept(kept: &Self::Kept) -> Self;
    /// Tells each signal of it; `named` is the signal of a number.
    fn tell<'a>(&'a self, named: fn(usize) -> Signal, to: &mut impl FnMut(Told<'a>));
}

/// Bytes of a `u32` as a variable-length integer.
const NUMBER: usize = 5;
const REAL: usize = 4;
/// A byte that says whether there is something, and a byte for how many there are.
const OPTION: usize = 1;
/// The length of a list of fewer than 16,384.
const LENGTH: usize = 2;

/// Types that are kept as they are, with one signal for the hand.
macro_rules! plain {
    ($($type:ty: $blank:expr, $most:expr, $kind:ident, $value:expr;)*) => {$(
        impl Field for $type {
            const BLANK: Self = $blank;
            const MOST_BYTES: usize = $most;
            type Kept = Self;
            const KEPT: Self = $blank;

            fn keep(&self, to: &mut Self::Kept) {
                *to = *self;
            }

            fn kept(kept: &Self) -> Self {
                *kept
            }

            fn tell<'a>(&'a self, named: fn(usize) -> Signal, to: &mut impl FnMut(Told<'a>)) {
                let value: fn(&Self) -> Value<'a> = $value;
                to(Told { signal: named(0), kind: Kind::$kind, each: Each::Hand, value: value(self) });
            }
        }
    )*};
}

plain! {
    u32: 0, NUMBER, Whole, |&value| Value::Whole(value);
    u16: 0, 3, Whole, |&value| Value::Whole(value.into());
    f32: 0.0, REAL, Real, |&value| Value::Real(value);
    Mode: Mode::Disarmed, 1, Mode, |&mode| Value::Mode(mode);
}

/// Lists with an item for each joint.
macro_rules! lists {
    ($($type:ty: $blank:expr, $most:expr, $kind:ident, $value:ident;)*) => {$(
        impl<const J: usize> Field for List<$type, J> {
            const BLANK: Self = List::empty($blank);
            const MOST_BYTES: usize = LENGTH + J * $most;
            type Kept = Self;
            const KEPT: Self = List::empty($blank);

            fn keep(&self, to: &mut Self::Kept) {
                *to = *self;
            }

            fn kept(kept: &Self) -> Self {
                *kept
            }

            fn tell<'a>(&'a self, named: fn(usize) -> Signal, to: &mut impl FnMut(Told<'a>)) {
                let value = Value::$value(self.as_slice());
                to(Told { signal: named(0), kind: Kind::$kind, each: Each::Joint, value });
            }
        }
    )*};
}

lists! {
    i32: 0, NUMBER, Count, Counts;
    f32: 0.0, REAL, Real, Reals;
    Limiting: Limiting::NONE, 1, Limiting, Limits;
}

/// Real numbers, one for each gain or signal of the laws.
macro_rules! reals {
    ($($type:ident: $count:expr;)*) => {$(
        impl Field for $type<f32> {
            const BLANK: Self = $type::all(0.0);
            const MOST_BYTES: usize = $count * REAL;
            type Kept = Self;
            const KEPT: Self = $type::all(0.0);

            fn keep(&self, to: &mut Self::Kept) {
                *to = *self;
            }

            fn kept(kept: &Self) -> Self {
                *kept
            }

            fn tell<'a>(&'a self, named: fn(usize) -> Signal, to: &mut impl FnMut(Told<'a>)) {
                for (k, &value) in self.iter().enumerate() {
                    let value = Value::Real(value);
                    to(Told { signal: named(k), kind: Kind::Real, each: Each::Hand, value });
                }
            }
        }
    )*};
}

reals! {
    PerGain: GAIN_COUNT;
    PerSignal: SIGNAL_COUNT;
}

impl Field for Events {
    const BLANK: Self = Events::NONE;
    const MOST_BYTES: usize = 1;
    type Kept = Self;
    const KEPT: Self = Events::NONE;

    fn keep(&self, to: &mut Self::Kept) {
        *to = *self;
    }

    fn kept(kept: &Self) -> Self {
        *kept
    }

    fn tell<'a>(&'a self, _: fn(usize) -> Signal, to: &mut impl FnMut(Told<'a>)) {
        for event in Event::ALL {
            let signal = Signal { key: event.key(), unit: "", words: event.words() };
            let value = Value::Truth(self.contains(event));
            to(Told { signal, kind: Kind::Truth, each: Each::Hand, value });
        }
    }
}

/// A fault with its joint: first the fault, then the joint. Kept as number, whether there is a joint, and which.
impl Field for Option<Raised> {
    const BLANK: Self = None;
    const MOST_BYTES: usize = OPTION + 1 + OPTION + 1;
    type Kept = (u8, bool, u8);
    const KEPT: (u8, bool, u8) = (0, false, 0);

    fn keep(&self, to: &mut Self::Kept) {
        *to = self.map_or(Self::KEPT, |Raised { fault, joint }| {
            (fault.number(), joint.is_some(), joint.unwrap_or(0))
        });
    }

    fn kept(&(number, has_joint, joint): &Self::Kept) -> Self {
        Fault::from_number(number).map(|fault| Raised { fault, joint: has_joint.then_some(joint) })
    }

    fn tell<'a>(&'a self, named: fn(usize) -> Signal, to: &mut impl FnMut(Told<'a>)) {
        let (fault, joint) = match self {
            Some(raised) => (Value::Fault(raised.fault), raised.joint.map_or(Value::Missing, Value::Joint)),
            None => (Value::Missing, Value::Missing),
        };
        to(Told { signal: named(0), kind: Kind::Fault, each: Each::Hand, value: fault });
        to(Told { signal: named(1), kind: Kind::Joint, each: Each::Hand, value: joint });
    }
}

/// A notice with its fingertip. Kept as its number from 1 on, whether there is a fingertip,
/// and which.
impl Field for Option<Noticed> {
    const BLANK: Self = None;
    const MOST_BYTES: usize = OPTION + 1 + OPTION + 1;
    type Kept = (u8, bool, u8);
    const KEPT: (u8, bool, u8) = (0, false, 0);

    fn keep(&self, to: &mut Self::Kept) {
        *to = self.map_or(Self::KEPT, |Noticed { notice, fingertip }| {
            (notice as u8 + 1, fingertip.is_some(), fingertip.unwrap_or(0))
        });
    }

    fn kept(&(number, has_fingertip, fingertip): &Self::Kept) -> Self {
        let notice = Notice::ALL.get(usize::from(number).checked_sub(1)?).copied()?;
        Some(Noticed { notice, fingertip: has_fingertip.then_some(fingertip) })
    }

    fn tell<'a>(&'a self, named: fn(usize) -> Signal, to: &mut impl FnMut(Told<'a>)) {
        let value = self.map_or(Value::Missing, Value::Notice);
        to(Told { signal: named(0), kind: Kind::Notice, each: Each::Hand, value });
    }
}

/// Kept with 0 for no answer, 1 for done, and from 2 on the refusals.
impl Field for Option<Answer> {
    const BLANK: Self = None;
    const MOST_BYTES: usize = OPTION + Command::MOST_BYTES + OPTION + 1;
    type Kept = (Command, u8);
    const KEPT: (Command, u8) = (Command::Arm, 0);

    // Without an answer the command stays as it is: it takes long to move.
    fn keep(&self, to: &mut Self::Kept) {
        match self {
            None => to.1 = 0,
            Some(Answer { command, refused }) => {
                *to = (*command, refused.map_or(1, |refusal| 2 + refusal as u8));
            }
        }
    }

    fn kept(&(command, number): &Self::Kept) -> Self {
        let refused = number.checked_sub(2).and_then(|k| Refusal::ALL.get(usize::from(k))).copied();
        (number != 0).then_some(Answer { command, refused })
    }

    fn tell<'a>(&'a self, named: fn(usize) -> Signal, to: &mut impl FnMut(Told<'a>)) {
        let value = self.map_or(Value::Missing, Value::Answer);
        to(Told { signal: named(0), kind: Kind::Answer, each: Each::Hand, value });
    }
}

/// Writes the record, and all that follows from it, from one line a field.
macro_rules! signals {
    ($($field:ident: $type:ty = $named:expr;)*) => {
        /// The record of one tick: all that it took in, decided and put out. Its fields are the rows of the table of
        /// [signals](self).
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[allow(missing_docs)]
        pub struct Record<const J: usize> {
            $(pub $field: $type,)*
        }

        /// A record, kept in memory that is zero at first.
        #[derive(Clone, Copy, Debug)]
        pub(crate) struct Kept<const J: usize> {
            $($field: <$type as Field>::Kept,)*
        }

        impl<const J: usize> Record<J> {
            /// A record of nothing.
            pub const BLANK: Self = Self { $($field: <$type as Field>::BLANK,)* };

            /// Bytes that suffice for every record of up to `J` joints (`J` below 16,384).
            pub const MOST_BYTES: usize = 0 $(+ <$type as Field>::MOST_BYTES)*;

            /// Names and types of the fields, in the order of their bytes.
            pub const FIELDS: &[(&str, &str)] = &[$((stringify!($field), stringify!($type))),*];

            /// Tells each signal with its value, in the order of the table.
            pub fn tell<'a>(&'a self, mut to: impl FnMut(Told<'a>)) {
                $(self.$field.tell($named, &mut to);)*
            }
        }

        impl<const J: usize> Kept<J> {
            pub(crate) const BLANK: Self = Self { $($field: <$type as Field>::KEPT,)* };

            pub(crate) fn keep(&mut self, record: &Record<J>) {
                $(record.$field.keep(&mut self.$field);)*
            }

            pub(crate) fn record(&self) -> Record<J> {
                Record { $($field: <$type as Field>::kept(&self.$field),)* }
            }
        }
    };
}

/// The same signal whatever the number.
macro_rules! one {
    ($key:literal, $unit:literal, $words:literal) => {
        |_| Signal { key: $key, unit: $unit, words: $words }
    };
}

/// A fault, and its joint.
macro_rules! fault {
    ($key:literal, $words:literal) => {
        |k| match k {
            0 => Signal { key: $key, unit: "", words: $words },
            _ => {
                Signal { key: concat!($key, "_joint"), unit: "", words: "Joint of the fault, if it is one's" }
            }
        }
    };
}

#[rustfmt::skip]
signals! {
    sequence: u32                   = one!("sequence", "", "Number of the record, one more from record to record, modulo 2^32: what is missing was lost. The tick gives every tick a number; who sends fewer records numbers them anew");
    tick: u32                       = one!("tick", "", "Number of the tick since the device's start, modulo 2^32");
    mode: Mode                      = one!("mode", "", "Mode");
    fault: Option<Raised>           = fault!("fault", "Fault that the hand is in");
    answer: Option<Answer>          = one!("answer", "", "Command of this tick, done or refused");
    notice: Option<Noticed>         = one!("notice", "", "What the tick noticed by itself");
    events: Events                  = |_| Signal { key: "", unit: "", words: "" };
    reading_failed: Option<Raised>  = fault!("reading_failed", "Fault for which the joints could not be read or driven; with counts, they have passed their self-test since");
    gains: PerGain<f32>             = |k| GAINS[k].signal();
    potentials_j: PerGain<f32>      = |k| GAINS[k].potential;
    law_signals: PerSignal<f32>     = |k| SIGNALS[k];
    work_j: f32                     = one!("work_j", "J", "Work of the motors since the last grasp began");
    damped_j: f32                   = one!("damped_j", "J", "Energy that the damping has taken since the last grasp began");
    excess_j: f32                   = one!("excess_j", "J", "Work of the motors in the last second (fading) beyond the drop of the laws' potentials");
    weight_n: f32                   = one!("weight_n", "N", "Weight that was weighed last");
    cycles: u32                     = one!("cycles", "cycles", "Processor cycles of the tick before, with reading and writing the joints; 0 where nothing counts them");
    late_ticks: u32                 = one!("late_ticks", "", "Ticks that were late since the start");
    dropped: u32                    = one!("dropped", "", "Records and parts of snapshots that the device lost since its start because a queue was full");
    decimation: u16                 = one!("decimation", "ticks", "Ticks from one sent record to the next; 1 where none are sent");
    counts: List<i32, J>            = one!("count", "counts", "Encoder count; missing where angles came from elsewhere, or not at all");
    torques_nm: List<f32, J>        = one!("torque_nm", "N m", "Torque of the next tick");
    limiting: List<Limiting, J>     = one!("limited_by", "", "Limits of the torque that act");
}

impl<const J: usize> Record<J> {
    /// Writes the record into a buffer and returns the part that was written.
    ///
    /// # Errors
    /// If the buffer is too small; [`Self::MOST_BYTES`] always suffice.
    pub fn encode<'a>(&self, buffer: &'a mut [u8]) -> Result<&'a mut [u8], BufferTooSmall> {
        postcard::to_slice(self, buffer).map_err(|_| BufferTooSmall)
    }

    /// Reads a record that takes up all the bytes.
    ///
    /// # Errors
    /// If they are anything else.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        match postcard::take_from_bytes(bytes) {
            Ok((record, [])) => Ok(record),
            Ok(_) => Err(DecodeError::TrailingBytes),
            Err(_) => Err(DecodeError::Malformed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{Command, Grasp, Move, Refusal};
    use crate::event::Event;
    use crate::fault::Fault;
    use crate::limit::Limit;
    use crate::parameters::Parameter;
    use proptest::prelude::*;
    use std::format;
    use std::string::String;
    use std::vec::Vec;

    /// Values for the gains of two laws, and 0 for those of others.
    fn of_laws(grasp: [f32; 2], integral: f32) -> PerGain<f32> {
        let mut values = PerGain::all(0.0);
        (values.grasp, values.integral) = (grasp, [integral]);
        values
    }

    fn example<const J: usize>() -> Record<J> {
        let mut limiting = [Limiting::NONE; J];
        limiting[1].insert(Limit::Torque);
        limiting[1].insert(Limit::UpperStop);
        let (mut counts, mut torques) = ([0; J], [0.0; J]);
        counts[..3].copy_from_slice(&[0, -1, 21_600]);
        torques[..3].copy_from_slice(&[0.5, -1.25, 0.0]);
        Record {
            sequence: 300,
            tick: 70_000,
            mode: Mode::Fault,
            fault: Some(Raised::at(2, Fault::CountJump)),
            answer: Some(Answer { command: Command::ClearFault, refused: Some(Refusal::FaultPersists) }),
            notice: Some(Noticed::at(1, Notice::NeverTouched)),
            events: Events::NONE.with(Event::Late, true),
            reading_failed: Some(Raised::at(2, Fault::SampleMissing)),
            gains: of_laws([5.0, 0.005], 0.375),
            potentials_j: of_laws([0.25, 0.125], 0.75),
            law_signals: PerSignal::all(0.0),
            work_j: -0.5,
            damped_j: 0.03125,
            excess_j: 0.0625,
            weight_n: 0.75,
            cycles: 20_000,
            late_ticks: 2,
            dropped: 1,
            decimation: 300,
            counts: List::first_of(counts, 3),
            torques_nm: List::first_of(torques, 3),
            limiting: List::first_of(limiting, 3),
        }
    }

    fn hex(bytes: &[u8]) -> String {
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The bytes of interface version 6. If this fails, the interface has changed: raise [`INTERFACE_VERSION`], and
    /// only then replace the bytes.
    #[test]
    fn golden_bytes() {
        let golden = concat!(
            "ac02",                       // sequence
            "f0a204",                     // tick
            "08",                         // mode
            "01030102",                   // fault
            "01050106",                   // answer
            "01030101",                   // notice
            "02",                         // events
            "01010102",                   // why there are no counts
            "0000a040",                   // force
            "0ad7a33b",                   // attitude stiffness
            "0000c03e",                   // integral gain
            "0000000000000000",           // gains of the virtual frame
            "0000803e",                   // approach potential
            "0000003e",                   // attitude potential
            "0000403f",                   // integral potential
            "0000000000000000",           // potentials of the virtual frame
            "000000000000000000000000",   // way of what is held
            "000000000000000000000000",   // its turn
            "000000bf",                   // work
            "0000003d",                   // damped
            "0000803d",                   // excess
            "0000403f",                   // weight
            "a09c01",                     // cycles
            "02",                         // late ticks
            "01",                         // dropped
            "ac02",                       // decimation
            "030001c0d102",               // counts
            "030000003f0000a0bf00000000", // torques
            "03000900",                   // limiting
        );
        let mut buffer = [0; Record::<3>::MOST_BYTES];
        assert_eq!(INTERFACE_VERSION, 6);
        assert_eq!(hex(example::<3>().encode(&mut buffer).unwrap()), golden);
        let mut buffer = [0; Record::<32>::MOST_BYTES];
        assert_eq!(hex(example::<32>().encode(&mut buffer).unwrap()), golden, "depends on the capacity");
    }

    #[test]
    fn every_mode_command_refusal_and_fault_keeps_its_byte() {
        let bytes = |values: Vec<Vec<u8>>| hex(&values.concat());
        let mut buffer = [0; 64];
        let mut modes = Vec::new();
        for mode in Mode::ALL {
            modes.push(postcard::to_slice(&mode, &mut buffer).unwrap().to_vec());
        }
        assert_eq!(bytes(modes), "000102030405060708");
        let mut commands = Vec::new();
        for command in Command::ALL {
            commands.push(postcard::to_slice(&command, &mut buffer).unwrap().to_vec());
        }
        assert_eq!(
            bytes(commands),
            "00010200000000000304050600000000000700000800000000000000000000000000000000000000000000000000000000000000000000000000090a"
        );
        let mut refusals = Vec::new();
        for refusal in Refusal::ALL {
            refusals.push(postcard::to_slice(refusal, &mut buffer).unwrap().to_vec());
        }
        assert_eq!(
            bytes(refusals),
            "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f202122232425262728292a"
        );
        let mut faults = Vec::new();
        for fault in Fault::ALL {
            faults.push(postcard::to_slice(fault, &mut buffer).unwrap().to_vec());
        }
        assert_eq!(bytes(faults), "0102030405060708090a0b0c0d");
        // Their numbers are bytes on the wire: a row that is added moves those behind it.
        let names = Parameter::ALL
            .iter()
            .fold(0_u32, |digest, parameter| digest.rotate_left(5) ^ parameter.key().hash());
        assert_eq!(names, 4183648953, "the numbers of parameters: another interface version");
    }

    #[test]
    fn the_largest_record_fits() {
        let record = Record::<12> {
            sequence: u32::MAX,
            tick: u32::MAX,
            cycles: u32::MAX,
            late_ticks: u32::MAX,
            dropped: u32::MAX,
            decimation: u16::MAX,
            answer: Some(Answer {
                command: Command::Move(Move { time_ms: u16::MAX, ..Move::default() }),
                refused: Some(Refusal::Busy),
            }),
            counts: List::first_of([i32::MIN; 12], 12),
            torques_nm: List::first_of([f32::MIN; 12], 12),
            limiting: List::first_of([Limiting::NONE; 12], 12),
            ..example()
        };
        let mut buffer = [0; Record::<12>::MOST_BYTES];
        let length = record.encode(&mut buffer).unwrap().len();
        // The three counts of the lists take one byte each, not two; an answer's tag two for a time, not three.
        assert_eq!(length + 3, Record::<12>::MOST_BYTES);
        assert_eq!(record.encode(&mut [0; 100]), Err(BufferTooSmall));
    }

    #[test]
    fn what_is_no_record_is_refused() {
        let mut buffer = [0; Record::<3>::MOST_BYTES];
        let bytes = example::<3>().encode(&mut buffer).unwrap().to_vec();
        for length in 0..bytes.len() {
            assert_eq!(Record::<3>::decode(&bytes[..length]), Err(DecodeError::Malformed));
        }
        let longer = [&bytes[..], &[0]].concat();
        assert_eq!(Record::<3>::decode(&longer), Err(DecodeError::TrailingBytes));
        assert_eq!(Record::<2>::decode(&bytes), Err(DecodeError::Malformed), "more joints than capacity");
        let mut unknown_fault = bytes;
        unknown_fault[7] = 99;
        assert_eq!(Record::<3>::decode(&unknown_fault), Err(DecodeError::Malformed));
    }

    fn answers() -> impl Strategy<Value = Option<Answer>> {
        let grasp = any::<[Option<f32>; GAIN_COUNT]>()
            .prop_map(|gains| Command::Grasp(Grasp { gains: PerGain::of(gains) }));
        let command = prop_oneof![proptest::sample::select(&Command::ALL[..]), grasp];
        let refused = proptest::option::of(proptest::sample::select(Refusal::ALL));
        proptest::option::of((command, refused).prop_map(|(command, refused)| Answer { command, refused }))
    }

    prop_compose! {
        fn records()(
            (sequence, tick) in any::<(u32, u32)>(),
            mode in proptest::sample::select(&Mode::ALL[..]),
            fault in proptest::option::of((proptest::sample::select(Fault::ALL), any::<Option<u8>>())),
            (late, heartbeat) in any::<(bool, bool)>(),
            (cycles, late_ticks, dropped, decimation) in any::<(u32, u32, u32, u16)>(),
            answer in answers(),
            notice in proptest::option::of((proptest::sample::select(Notice::ALL), any::<Option<u8>>())),
            weight_n in any::<f32>(),
            gains in any::<[f32; GAIN_COUNT]>(),
            potentials_j in any::<[f32; GAIN_COUNT]>(),
            (work_j, damped_j, excess_j) in any::<(f32, f32, f32)>(),
            count in 0..=12_usize,
            counts in any::<[i32; 12]>(),
            torques in any::<[f32; 12]>(),
            limits in any::<[[bool; 4]; 12]>(),
        ) -> Record<12> {
            let limiting = limits.map(|bits| {
                let mut limiting = Limiting::NONE;
                Limit::ALL.into_iter().zip(bits).filter(|(_, on)| *on).for_each(|(limit, _)| limiting.insert(limit));
                limiting
            });
            Record {
                sequence,
                tick,
                mode,
                fault: fault.map(|(fault, joint)| Raised { fault, joint }),
                answer,
                notice: notice.map(|(notice, fingertip)| Noticed { notice, fingertip }),
                weight_n,
                events: Events::NONE.with(Event::Late, late).with(Event::Heartbeat, heartbeat),
                reading_failed: fault.map(|(fault, joint)| Raised { fault, joint }),
                cycles,
                late_ticks,
                dropped,
                decimation,
                counts: List::first_of(counts, count),
                torques_nm: List::first_of(torques, count),
                limiting: List::first_of(limiting, count),
                gains: PerGain::of(gains),
                potentials_j: PerGain::of(potentials_j),
                law_signals: PerSignal::all(0.0),
                work_j,
                damped_j,
                excess_j,
            }
        }
    }

    proptest! {
        #[test]
        fn records_come_back_as_they_were_sent(record in records()) {
            let mut buffer = [0; Record::<12>::MOST_BYTES];
            let bytes = record.encode(&mut buffer).unwrap().to_vec();
            let decoded = Record::<12>::decode(&bytes).unwrap();
            prop_assert_eq!(&decoded, &record);
            let mut again = [0; Record::<12>::MOST_BYTES];
            prop_assert_eq!(decoded.encode(&mut again).unwrap(), &bytes[..]);
        }

        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            // What decodes encodes to a record that is the same: NaN compares by its bits.
            if let Ok(record) = Record::<12>::decode(&bytes) {
                let mut buffer = [0; Record::<12>::MOST_BYTES];
                let encoded = record.encode(&mut buffer).unwrap().to_vec();
                let again = Record::<12>::decode(&encoded).unwrap();
                let mut buffer = [0; Record::<12>::MOST_BYTES];
                prop_assert_eq!(again.encode(&mut buffer).unwrap(), &encoded[..]);
            }
        }

        #[test]
        fn damaged_records_decode_or_are_refused(record in records(), at in 0..100_usize, bits in 1..=255_u8) {
            let mut buffer = [0; Record::<12>::MOST_BYTES];
            let bytes = record.encode(&mut buffer).unwrap();
            let at = at % bytes.len();
            bytes[at] ^= bits;
            let _ = Record::<12>::decode(bytes);
        }
    }
}
