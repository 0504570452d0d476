//! The messages of the link: requests of the host, replies of the device.
//!
//! - A **session** begins with `Hello`, whose answer carries its number; everything else carries that number, and a
//!   sequence number that grows (modulo 2^16). What is replayed, or comes out of order, is refused. `Stop` is
//!   taken from whoever it comes.
//! - Every request is answered: by what it asks for, or by done, or by a [`Refusal`]. Answers carry the request's
//!   sequence number.
//! - Records come by themselves, as `Telemetry` asked for.

use super::encode;
use super::input::InputRecord;
use crate::bytes::BufferTooSmall;
use crate::command::{Command, Refusal};
use crate::fault::Raised;
use crate::identity::Identity;
use crate::parameters::{Parameter, Setting};
use crate::telemetry::snapshot::Part;
use crate::telemetry::{DecodeError, List, Record};
use core::fmt;
use serde::{Deserialize, Serialize};

/// A request, with whom it comes from and when.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Packet<const J: usize> {
    /// Number of the session. For `Hello` the number that is wished for, best by chance, or 0; for `Stop` whatever it likes.
    pub session: u16,
    /// Number of the request.
    pub sequence: u16,
    /// The request.
    pub request: Request<J>,
}

/// A request of the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request<const J: usize> {
    /// Begin a session: who are you? Stays the first for ever.
    Hello {
        /// [`INTERFACE_VERSION`](crate::telemetry::INTERFACE_VERSION) of the host.
        interface_version: u16,
    },
    /// Do something with the hand.
    Command(Command),
    /// I am still there.
    Heartbeat,
    /// Set a parameter, while the hand is disarmed.
    SetParameter {
        /// The parameter.
        parameter: Parameter,
        /// Of which joint or axis.
        index: u8,
        /// To what.
        value: f32,
    },
    /// Tell a parameter.
    GetParameter {
        /// The parameter.
        parameter: Parameter,
        /// Of which joint or axis.
        index: u8,
    },
    /// Send records from now on.
    Telemetry {
        /// One in so many ticks; 0 for none.
        decimation: u16,
        /// The signals in them.
        signals: Signals,
    },
    /// The joints of a hand that is elsewhere: do one tick with them. Only the image `pil` does.
    Joints(Sample<J>),
    /// A record of the burst around the last fault.
    Burst {
        /// The number of the record; 0 is the oldest.
        index: u16,
    },
    /// End the session, and send no more records. The line has its first rate once the answer has left.
    Goodbye,
    /// Give the line another rate, once the answer has left; or: are you heard at this one? While the hand is disarmed.
    Rate {
        /// The rate.
        baud: u32,
    },
    /// The joints stand at angle zero: set their zeros so, while the hand is disarmed.
    Zero {
        /// The joint; `None` for all.
        joint: Option<u8>,
    },
    /// The readings with the signs and zeros that were set are right: the hand may be armed.
    Confirm,
    /// Save the parameters that differ from the hand's file, while the hand is disarmed.
    Save,
    /// Forget what was saved: the hand's file holds again, from now on. While the hand is disarmed.
    Defaults,
}

impl<const J: usize> Request<J> {
    /// Returns `true` if it has to wait until a save is over: it would change what is saved, or move the hand
    /// meanwhile.
    pub fn is_to_wait_for_a_save(&self) -> bool {
        matches!(
            self,
            Self::SetParameter { .. }
                | Self::Zero { .. }
                | Self::Save
                | Self::Defaults
                | Self::Command(Command::Arm)
        )
    }
}

/// Joints over the link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample<const J: usize> {
    /// Encoder counts.
    pub counts: List<i32, J>,
    /// The failure of the joints, which could not be read or driven; with counts, they have passed their self-test
    /// since.
    pub failed: Option<Raised>,
    /// `true` if the tick before is to count as late.
    pub late: bool,
}

/// The parts of the telemetry that are sent: a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Signals(u8);

impl Signals {
    /// None of them: mode, faults, answers, law and timing alone.
    pub const NONE: Self = Self(0);
    /// Encoder counts.
    pub const COUNTS: Self = Self(1);
    /// Torques.
    pub const TORQUES: Self = Self(1 << 1);
    /// The limit that acts on each joint.
    pub const LIMITING: Self = Self(1 << 2);
    /// Every part of a record.
    pub const ALL: Self = Self(0b111);
    /// An input record of each tick that has no full one.
    pub const INPUTS: Self = Self(1 << 3);
    /// Snapshots of the state.
    pub const STATE: Self = Self(1 << 4);
    /// Everything: what a recording needs.
    pub const FULL: Self = Self(0b1_1111);

    /// These and others.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Returns `true` if all of some others are among them.
    pub const fn contain(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Returns `true` if there is a meaning to every bit.
    pub const fn are_known(self) -> bool {
        Self::FULL.contain(self)
    }
}

impl<const J: usize> Record<J> {
    /// Leaves out what is not among the signals.
    pub fn keep(&mut self, signals: Signals) {
        if !signals.contain(Signals::COUNTS) {
            self.counts = List::default();
        }
        if !signals.contain(Signals::TORQUES) {
            self.torques_nm = List::default();
        }
        if !signals.contain(Signals::LIMITING) {
            self.limiting = List::default();
        }
    }
}

/// The form in which a tick is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// By its record, with these signals.
    Full(Signals),
    /// By its input record.
    Input,
}

impl Form {
    /// Returns the reply that tells of a tick.
    pub fn of<const J: usize>(self, record: &Record<J>) -> Reply<'static, J> {
        match self {
            Self::Full(signals) => {
                let mut record = record.clone();
                record.keep(signals);
                Reply::Record(record)
            }
            Self::Input => Reply::Input(InputRecord::of(record)),
        }
    }

    /// Writes the frame of that reply, and uses the record up: it need not be moved for that.
    ///
    /// # Errors
    /// The buffer is too small; [`most_bytes`](super::most_bytes) of a reply always suffice.
    pub fn frame<'b, const J: usize>(
        self,
        record: &mut Record<J>,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], BufferTooSmall> {
        match self {
            Self::Full(signals) => {
                record.keep(signals);
                encode(&(Reply::<J>::RECORD, &*record), buffer)
            }
            Self::Input => encode(&(Reply::<J>::INPUT, InputRecord::take(record)), buffer),
        }
    }
}

/// A reply of the device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply<'a, const J: usize> {
    /// To `Hello`.
    Identity {
        /// Number of the request.
        sequence: u16,
        /// Number of the session that begins.
        session: u16,
        /// The identity of the device.
        #[serde(borrow)]
        identity: Identity<'a>,
        /// `true` if this ends another session in which something was asked for a moment ago.
        ends_another: bool,
    },
    /// Done, or why not.
    Answer {
        /// Number of the request.
        sequence: u16,
        /// `None`: done.
        refused: Option<Refusal>,
    },
    /// To `GetParameter`.
    Value {
        /// Number of the request.
        sequence: u16,
        /// The parameter.
        parameter: Parameter,
        /// Of which joint or axis.
        index: u8,
        /// Its value, and that of the hand's file.
        setting: Setting,
    },
    /// The record of a tick.
    Record(Record<J>),
    /// To `Burst`.
    Burst {
        /// Number of the request.
        sequence: u16,
        /// The number of the record.
        index: u16,
        /// The number of records.
        count: u16,
        /// The record; it is numbered by its tick.
        record: Record<J>,
    },
    /// A part of a snapshot.
    Snapshot(Part),
    /// The inputs of a tick.
    Input(InputRecord<J>),
}

impl<const J: usize> Packet<J> {
    /// Bytes that suffice for every packet of up to `J` joints: a header, and joints.
    pub const MOST_BYTES: usize = {
        let (header, tag, list, failed, late) = (6, 1, 2, 5, 1);
        let joints = list + 5 * J + failed + late;
        let others = Command::MOST_BYTES;
        header + tag + if joints > others { joints } else { others }
    };

    /// Reads a packet that takes up all the bytes.
    ///
    /// # Errors
    /// If they are anything else.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        match postcard::take_from_bytes(bytes) {
            Ok((packet, [])) => Ok(packet),
            Ok(_) => Err(DecodeError::TrailingBytes),
            Err(_) => Err(DecodeError::Malformed),
        }
    }
}

/// The answer to bytes that are no packet: refused, with the sequence number if they have one.
pub fn not_understood<const J: usize>(bytes: &[u8]) -> Reply<'static, J> {
    let sequence = postcard::take_from_bytes::<(u16, u16)>(bytes).map_or(0, |((_, sequence), _)| sequence);
    Reply::Answer { sequence, refused: Some(Refusal::NotUnderstood) }
}

impl<'a, const J: usize> Reply<'a, J> {
    /// The number of [`Self::Record`], and that of [`Self::Input`].
    const RECORD: u8 = 3;
    const INPUT: u8 = 6;

    /// Most bytes of the names in an [`Identity`].
    const NAMES: usize = 160;

    /// Bytes that suffice for every reply of up to `J` joints.
    pub const MOST_BYTES: usize = {
        let identity = 6 + Self::NAMES + 61;
        // Of a burst: with three numbers before it. A snapshot's part is shorter than an identity.
        let record = 9 + Record::<J>::MOST_BYTES;
        1 + if record > identity { record } else { identity }
    };

    /// Reads a reply that takes up all the bytes.
    ///
    /// # Errors
    /// If they are anything else.
    pub fn decode(bytes: &'a [u8]) -> Result<Self, DecodeError> {
        match postcard::take_from_bytes(bytes) {
            Ok((reply, [])) => Ok(reply),
            Ok(_) => Err(DecodeError::TrailingBytes),
            Err(_) => Err(DecodeError::Malformed),
        }
    }
}

impl fmt::Display for Signals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = [
            (Self::COUNTS, "counts"),
            (Self::TORQUES, "torques"),
            (Self::LIMITING, "limiting"),
            (Self::INPUTS, "inputs"),
            (Self::STATE, "state"),
        ];
        let mut separator = "";
        for (_, name) in names.into_iter().filter(|&(signal, _)| self.contain(signal)) {
            write!(f, "{separator}{name}")?;
            separator = ", ";
        }
        Ok(())
    }
}
