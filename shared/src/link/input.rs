//! The input record of a tick: all that the tick took in, and a digest of what it computed from that.
//!
//! It is what a line gets that is too slow for every record in full. A host that knows the state of the controller computes
//! the rest as the controller did, and the digest says that every bit of it is the same. Each stands for itself: nothing has
//! to be known of others to read it.

use super::checksum::Checksum;
use crate::command::Answer;
use crate::event::Events;
use crate::fault::Raised;
use crate::telemetry::{List, Record};
use serde::{Deserialize, Serialize};

/// The inputs of a tick, and the [`digest`](Record::digest) of its record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputRecord<const J: usize> {
    /// Number of the record, in one row with full ones.
    pub sequence: u32,
    /// Number of the tick since the start, wrapping.
    pub tick: u32,
    /// The command of this tick, and what became of it.
    pub answer: Option<Answer>,
    /// The other events from outside in this tick.
    pub events: Events,
    /// The failure of the joints, in place of counts.
    pub reading_failed: Option<Raised>,
    /// Encoder counts, one a joint.
    pub counts: List<i32, J>,
    /// Of everything that the tick computed.
    pub digest: u32,
}

impl<const J: usize> InputRecord<J> {
    /// Returns that of a tick's record.
    pub fn of(record: &Record<J>) -> Self {
        let &Record { sequence, tick, answer, events, reading_failed, counts, .. } = record;
        Self { sequence, tick, answer, events, reading_failed, counts, digest: record.digest() }
    }

    /// Returns the same, and uses the record up.
    pub(super) fn take(record: &mut Record<J>) -> Self {
        let sequence = record.sequence;
        let digest = record.forget_untold();
        let &mut Record { tick, answer, events, reading_failed, counts, .. } = record;
        Self { sequence, tick, answer, events, reading_failed, counts, digest }
    }
}

impl<const J: usize> Record<J> {
    /// Returns the CRC-32 of the record's bytes (that of the frames), with 0 for all that the tick does not compute:
    /// `sequence`, `cycles`, `dropped` and `decimation`.
    pub fn digest(&self) -> u32 {
        self.clone().forget_untold()
    }

    /// Returns the same, and leaves the record as it was digested.
    fn forget_untold(&mut self) -> u32 {
        const { assert!(Self::MOST_BYTES <= ROOM) };
        (self.sequence, self.cycles, self.dropped, self.decimation) = (0, 0, 0, 0);
        // There is room, so this can't fail.
        let mut room = [0; ROOM];
        postcard::to_slice(self, &mut room).map_or(0, |bytes| u32::from_le_bytes(Checksum::of(bytes)))
    }
}

/// Bytes of the largest record of any hand that there is, and some more.
const ROOM: usize = 512;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;
    use crate::limit::{Limit, Limiting};
    use crate::link::encode;
    use crate::link::message::{Form, Reply, Signals};
    use crate::supervisor::Mode;

    fn record() -> Record<3> {
        Record {
            tick: 70_000,
            counts: List::first_of([0, -1, 21_600], 3),
            torques_nm: List::first_of([0.5, -1.25, 0.0], 3),
            limiting: List::first_of([Limiting::NONE; 3], 3),
            ..Record::BLANK
        }
    }

    /// The digest tells a host every bit that it computes otherwise than the hand; what only the sender knows is not in
    /// it.
    #[test]
    fn every_bit_that_a_tick_computes_is_in_the_digest() {
        let whole = record();
        let mut limited = Limiting::NONE;
        limited.insert(Limit::Slew);
        for computed in [
            Record { tick: 70_001, ..record() },
            Record { mode: Mode::Armed, ..record() },
            Record { fault: Some(Raised::of_hand(Fault::LinkLost)), ..record() },
            Record { work_j: f32::from_bits(1), ..record() },
            Record { damped_j: -0.0, ..record() },
            Record { late_ticks: 1, ..record() },
            Record { counts: List::first_of([0, -1, 21_601], 3), ..record() },
            Record { torques_nm: List::first_of([0.5, -1.25, -0.0], 3), ..record() },
            Record { limiting: List::first_of([Limiting::NONE, limited, Limiting::NONE], 3), ..record() },
        ] {
            assert_ne!(computed.digest(), whole.digest(), "{computed:?}");
        }
        let sent = Record { sequence: 9, cycles: 9, dropped: 9, decimation: 9, ..record() };
        assert_eq!(sent.digest(), whole.digest());
    }

    #[test]
    fn a_record_that_is_used_up_gives_the_same_frame() {
        for form in [Form::Input, Form::Full(Signals::ALL), Form::Full(Signals::COUNTS)] {
            let record = Record { sequence: 9, cycles: 8, dropped: 7, decimation: 6, ..record() };
            let (mut buffer, mut other) = ([0; 256], [0; 256]);
            let expected = encode(&form.of(&record), &mut buffer).unwrap();
            assert_eq!(form.frame(&mut record.clone(), &mut other).unwrap(), expected, "{form:?}");
        }
    }

    #[test]
    fn each_stands_for_itself() {
        let mut buffer = [0; 64];
        let reply = Form::Input.of(&record());
        let bytes = postcard::to_slice(&reply, &mut buffer).unwrap();
        assert_eq!(Reply::decode(bytes), Ok(reply));
    }
}
