//! What the tick tells the world: one [`Record`] a tick, and its bytes.
//!
//! - The **encoding** is postcard: fields in their order, without names; counts and numbers as variable-length
//!   integers, `f32` as four bytes. It is positional, so that any change of [`Record`] or of a type in it is another
//!   **interface version**.
//! - Lists carry their run-time count: the bytes of a hand do not depend on the capacity it was built with, and a host
//!   of large capacity reads what a microcontroller of exact size wrote.
//! - With its parameters, the counts and the commands (which the answers repeat), a record has all that a replay needs
//!   to compute everything else again, to the bit.

pub mod burst;
pub mod dense;
mod list;
pub mod snapshot;

pub use list::List;

use crate::bytes::BufferTooSmall;
use crate::command::{Answer, Command};
use crate::event::Events;
use crate::fault::Raised;
use crate::limit::Limiting;
use crate::supervisor::Mode;
use core::fmt;
use serde::{Deserialize, Serialize};

/// Version of everything that goes over the wire. Two ends talk when theirs are equal; it has nothing to do with the
/// release's version.
pub const INTERFACE_VERSION: u16 = 4;

/// How many numbers of a record are what the law and the ledger tell.
pub(crate) const LAW: usize = 9;

/// What one tick took in, decided and put out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record<const J: usize> {
    /// Number of the record, one more from record to record, wrapping: what is missing was lost. The tick gives every
    /// tick a number; who sends fewer records numbers them anew.
    pub sequence: u32,
    /// Number of the tick since the start, wrapping.
    pub tick: u32,
    /// Mode in this tick.
    pub mode: Mode,
    /// The fault that the hand is in.
    pub fault: Option<Raised>,
    /// What became of the command of this tick.
    pub answer: Option<Answer>,
    /// What else came from outside in this tick.
    pub events: Events,
    /// Why there are no counts, where the joints could not be read.
    pub reading_failed: Option<Raised>,
    /// The force `f_d` that acts in this tick, N.
    pub force_n: f32,
    /// The attitude stiffness `K_st` that acts in this tick, N m.
    pub attitude_stiffness_nm: f32,
    /// The gain `K_I` of the earlier law that acts in this tick, N m/rad.
    pub integral_gain_nm_rad: f32,
    /// Potential `V_s` of the approach, J.
    pub approach_potential_j: f32,
    /// Potential `V_st` of the attitudes, above its least value, J.
    pub attitude_potential_j: f32,
    /// Potential `V_I` of the joints' turns since the grasp began, J.
    pub integral_potential_j: f32,
    /// Work of the motors since the last grasp began, J.
    pub work_j: f32,
    /// What the law's damping has taken in the same time, J.
    pub damped_j: f32,
    /// Work of the motors beyond the drop of the law's potentials in the last second (fading), J.
    pub excess_j: f32,
    /// How long the tick before took with reading and writing the joints, processor cycles; 0 where there is no counter.
    pub cycles: u32,
    /// Ticks that were late since the start.
    pub late_ticks: u32,
    /// Records and answers that were lost since the start because a queue was full.
    pub dropped: u32,
    /// Ticks from one record that is sent to the next, as it is now; 1 where none are sent.
    pub decimation: u16,
    /// Encoder counts, one a joint; empty where angles came from elsewhere, or not at all.
    pub counts: List<i32, J>,
    /// Torques of the next tick, N m, one a joint.
    pub torques_nm: List<f32, J>,
    /// What limits each joint's torque.
    pub limiting: List<Limiting, J>,
}

/// Why bytes are not a record.
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

impl<const J: usize> Record<J> {
    /// A record of nothing.
    pub const BLANK: Self = Self {
        sequence: 0,
        tick: 0,
        mode: Mode::Disarmed,
        fault: None,
        answer: None,
        events: Events::NONE,
        reading_failed: None,
        force_n: 0.0,
        attitude_stiffness_nm: 0.0,
        integral_gain_nm_rad: 0.0,
        approach_potential_j: 0.0,
        attitude_potential_j: 0.0,
        integral_potential_j: 0.0,
        work_j: 0.0,
        damped_j: 0.0,
        excess_j: 0.0,
        cycles: 0,
        late_ticks: 0,
        dropped: 0,
        decimation: 0,
        counts: List::empty(0),
        torques_nm: List::empty(0.0),
        limiting: List::empty(Limiting::NONE),
    };

    /// Bytes that suffice for every record of up to `J` joints (`J` below 16,384).
    pub const MOST_BYTES: usize = {
        let (number, option, float) = (5, 1, 4);
        let fault = option + 1 + option + 1;
        let answer = option + Command::MOST_BYTES + option + 1;
        let (mode, events, decimation) = (1, 1, 3);
        let list = 2;
        5 * number
            + decimation
            + mode
            + 2 * fault
            + answer
            + events
            + LAW * float
            + 3 * list
            + J * (number + float + 1)
    };

    /// What the law and the ledger tell, in this order: gains, potentials, work.
    pub(crate) const fn law(&self) -> [f32; LAW] {
        [
            self.force_n,
            self.attitude_stiffness_nm,
            self.integral_gain_nm_rad,
            self.approach_potential_j,
            self.attitude_potential_j,
            self.integral_potential_j,
            self.work_j,
            self.damped_j,
            self.excess_j,
        ]
    }

    /// The same record, of which the law and the ledger tell this.
    #[must_use]
    pub(crate) fn with_law(self, law: [f32; LAW]) -> Self {
        let [
            force_n,
            attitude_stiffness_nm,
            integral_gain_nm_rad,
            potentials_j @ ..,
            work_j,
            damped_j,
            excess_j,
        ] = law;
        let [approach_potential_j, attitude_potential_j, integral_potential_j] = potentials_j;
        Self {
            force_n,
            attitude_stiffness_nm,
            integral_gain_nm_rad,
            approach_potential_j,
            attitude_potential_j,
            integral_potential_j,
            work_j,
            damped_j,
            excess_j,
            ..self
        }
    }

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
    use crate::command::{Command, Grasp, Refusal};
    use crate::event::Event;
    use crate::fault::Fault;
    use crate::limit::Limit;
    use proptest::prelude::*;
    use std::format;
    use std::string::String;
    use std::vec::Vec;

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
            events: Events::NONE.with(Event::Late, true),
            reading_failed: Some(Raised::at(2, Fault::SampleMissing)),
            force_n: 5.0,
            attitude_stiffness_nm: 0.005,
            integral_gain_nm_rad: 0.375,
            approach_potential_j: 0.25,
            attitude_potential_j: 0.125,
            integral_potential_j: 0.75,
            work_j: -0.5,
            damped_j: 0.03125,
            excess_j: 0.0625,
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

    /// The bytes of interface version 4. If this fails, the interface has changed: raise [`INTERFACE_VERSION`], and
    /// only then replace the bytes.
    #[test]
    fn golden_bytes() {
        let golden = concat!(
            "ac02",                       // sequence
            "f0a204",                     // tick
            "04",                         // mode
            "01030102",                   // fault
            "01050106",                   // answer
            "02",                         // events
            "01010102",                   // why there are no counts
            "0000a040",                   // force
            "0ad7a33b",                   // attitude stiffness
            "0000c03e",                   // integral gain
            "0000803e",                   // approach potential
            "0000003e",                   // attitude potential
            "0000403f",                   // integral potential
            "000000bf",                   // work
            "0000003d",                   // damped
            "0000803d",                   // excess
            "a09c01",                     // cycles
            "02",                         // late ticks
            "01",                         // dropped
            "ac02",                       // decimation
            "030001c0d102",               // counts
            "030000003f0000a0bf00000000", // torques
            "03000900",                   // limiting
        );
        let mut buffer = [0; Record::<3>::MOST_BYTES];
        assert_eq!(INTERFACE_VERSION, 4);
        assert_eq!(hex(example::<3>().encode(&mut buffer).unwrap()), golden);
        let mut buffer = [0; Record::<32>::MOST_BYTES];
        assert_eq!(hex(example::<32>().encode(&mut buffer).unwrap()), golden, "depends on the capacity");
    }

    #[test]
    fn every_mode_command_refusal_and_fault_keeps_its_byte() {
        let bytes = |values: Vec<Vec<u8>>| hex(&values.concat());
        let mut buffer = [0; 8];
        let mut modes = Vec::new();
        for mode in Mode::ALL {
            modes.push(postcard::to_slice(&mode, &mut buffer).unwrap().to_vec());
        }
        assert_eq!(bytes(modes), "0001020304");
        let mut commands = Vec::new();
        for command in Command::ALL {
            commands.push(postcard::to_slice(&command, &mut buffer).unwrap().to_vec());
        }
        assert_eq!(bytes(commands), "000102000000030405");
        let mut refusals = Vec::new();
        for refusal in Refusal::ALL {
            refusals.push(postcard::to_slice(refusal, &mut buffer).unwrap().to_vec());
        }
        assert_eq!(bytes(refusals), "000102030405060708090a0b0c0d0e0f101112131415");
        let mut faults = Vec::new();
        for fault in Fault::ALL {
            faults.push(postcard::to_slice(fault, &mut buffer).unwrap().to_vec());
        }
        assert_eq!(bytes(faults), "0102030405060708090a0b0c");
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
                command: Command::Grasp(Grasp {
                    force_n: Some(0.0),
                    attitude_stiffness_nm: Some(0.0),
                    integral_gain_nm_rad: Some(0.0),
                }),
                refused: Some(Refusal::Busy),
            }),
            counts: List::first_of([i32::MIN; 12], 12),
            torques_nm: List::first_of([f32::MIN; 12], 12),
            limiting: List::first_of([Limiting::NONE; 12], 12),
            ..example()
        };
        let mut buffer = [0; Record::<12>::MOST_BYTES];
        let length = record.encode(&mut buffer).unwrap().len();
        // The three counts of the lists take one byte each, not two.
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
        let grasp =
            any::<[Option<f32>; 3]>().prop_map(|[force_n, attitude_stiffness_nm, integral_gain_nm_rad]| {
                Command::Grasp(Grasp { force_n, attitude_stiffness_nm, integral_gain_nm_rad })
            });
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
            law in any::<[f32; LAW]>(),
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
                events: Events::NONE.with(Event::Late, late).with(Event::Heartbeat, heartbeat),
                reading_failed: fault.map(|(fault, joint)| Raised { fault, joint }),
                cycles,
                late_ticks,
                dropped,
                decimation,
                counts: List::first_of(counts, count),
                torques_nm: List::first_of(torques, count),
                limiting: List::first_of(limiting, count),
                ..Record::BLANK
            }
            .with_law(law)
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
