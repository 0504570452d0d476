//! The part between the tick and the line in the firmware (`firmware/src/queue.rs`, `link.rs`), for a hand that is
//! simulated: the same queues with the same room, in the same order, and a line of the same speed. So what a real line
//! has no time for is dropped here, too, and counted in the same place.

use blindgrasp_body::MAX_JOINTS;
use blindgrasp_shared::command::{Command, Refusal};
use blindgrasp_shared::device::{Outputs, WAITING_MOST};
use blindgrasp_shared::link::message::{self, Request, not_understood};
use blindgrasp_shared::link::{Receiver, encode, may_take, most_bytes};
use blindgrasp_wire::Packet;
use std::collections::VecDeque;
use std::time::Duration;

type Reply = message::Reply<'static, MAX_JOINTS>;

/// Room of the firmware's queues.
const STOPS: usize = 1;
const PACKETS: usize = 7;
const ANSWERS: usize = 7;
const REFUSALS: usize = 64;
/// Bits of a byte on the line: one to start, one to stop.
const BITS: f64 = 10.0;

/// The firmware's end of a line.
pub struct Line {
    receiver: Receiver<{ Packet::MOST_BYTES + 4 }>,
    stops: VecDeque<Packet>,
    packets: VecDeque<Packet>,
    /// Requests that do not get to the tick.
    refusals: VecDeque<Reply>,
    answers: VecDeque<Reply>,
    /// Records and parts of snapshots.
    records: VecDeque<Reply>,
    dropped: u32,
    /// Bytes in a second; infinite if the line is as fast as one likes.
    bytes_per_s: f64,
    /// Bytes that the line has had time for, and was not given yet.
    credit_bytes: f64,
    /// The frame that is being sent, and how much of it was.
    frame: Vec<u8>,
    sent: usize,
}

impl Line {
    /// A line of so many baud; 0 if it is as fast as one likes.
    pub fn new(baud: u32) -> Self {
        Self {
            receiver: Receiver::new(),
            stops: VecDeque::new(),
            packets: VecDeque::new(),
            refusals: VecDeque::new(),
            answers: VecDeque::new(),
            records: VecDeque::new(),
            dropped: 0,
            bytes_per_s: if baud == 0 { f64::INFINITY } else { f64::from(baud) / BITS },
            credit_bytes: 0.0,
            frame: Vec::new(),
            sent: 0,
        }
    }

    /// Returns `true` if there is room for the refusal of whatever may come. Where not, bytes wait where they are.
    pub fn listens(&self) -> bool {
        self.refusals.len() < REFUSALS
    }

    /// Takes bytes that came.
    pub fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            let Some(Ok(payload)) = self.receiver.push(byte) else { continue };
            match Packet::decode(payload) {
                Ok(packet) => self.put(packet),
                Err(_) => self.refusals.push_back(not_understood(payload)),
            }
        }
    }

    fn put(&mut self, packet: Packet) {
        let (queue, room) = match packet.request {
            Request::Command(Command::Stop) => (&mut self.stops, STOPS),
            _ => (&mut self.packets, PACKETS),
        };
        if queue.len() < room {
            queue.push_back(packet);
        } else {
            let Packet { sequence, .. } = packet;
            self.refusals.push_back(Reply::Answer { sequence, refused: Some(Refusal::Busy) });
        }
    }

    /// The request for this tick, for whose answer there is room. A stop overtakes whatever waits.
    pub fn packet(&mut self) -> Option<Packet> {
        let room = ANSWERS.saturating_sub(self.answers.len());
        let stop = may_take(true, room).then(|| self.stops.pop_front()).flatten();
        stop.or_else(|| may_take(false, room).then(|| self.packets.pop_front()).flatten())
    }

    /// Leaves what a tick gave for the line: the answer, for which there is room, and telemetry, if there is. What is dropped
    /// is counted.
    pub fn post(&mut self, outputs: Outputs<MAX_JOINTS>) {
        self.answers.extend(outputs.reply);
        let record = outputs.telemetry.map(|form| form.of(&outputs.record));
        for telemetry in record.into_iter().chain(outputs.part.map(Reply::Snapshot)) {
            if self.records.len() < WAITING_MOST {
                self.records.push_back(telemetry);
            } else {
                self.dropped = self.dropped.saturating_add(1);
            }
        }
    }

    /// Records and parts of snapshots that wait.
    pub fn waiting(&self) -> usize {
        self.records.len()
    }

    /// Returns the number of records that were dropped so far.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Sends what the line has time for.
    pub fn send(&mut self, time: Duration, to: &mut Vec<u8>) {
        self.credit_bytes += self.bytes_per_s * time.as_secs_f64();
        while self.credit_bytes >= 1.0 {
            if self.sent == self.frame.len() && !self.load() {
                // A line that has nothing to send does not save the time up.
                self.credit_bytes = 0.0;
                return;
            }
            let rest = &self.frame[self.sent..];
            let count = rest.len().min(self.credit_bytes as usize);
            to.extend_from_slice(&rest[..count]);
            self.sent += count;
            self.credit_bytes -= count as f64;
        }
    }

    /// Makes the next frame, if there is something to send: answers, then refusals, then telemetry.
    fn load(&mut self) -> bool {
        let next = self.refusals.pop_front().or_else(|| self.answers.pop_front());
        let Some(reply) = next.or_else(|| self.records.pop_front()) else { return false };
        let mut buffer = [0; most_bytes(Reply::MOST_BYTES)];
        let frame = encode(&reply, &mut buffer);
        // The buffer has room for the longest reply.
        self.frame.clear();
        self.frame.extend_from_slice(frame.unwrap_or_default());
        self.sent = 0;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::link::encode;
    use proptest::prelude::*;

    fn frame(sequence: u16, request: Request<MAX_JOINTS>) -> Vec<u8> {
        let mut buffer = [0; most_bytes(Packet::MOST_BYTES)];
        encode(&Packet { session: 1, sequence, request }, &mut buffer).expect("room").to_vec()
    }

    proptest! {
        /// As in the firmware (`firmware/src/link.rs`): each request is answered once, and one that was taken is done.
        #[test]
        fn every_request_is_answered_once_over_a_line_that_is_full(
            baud in 9600..200_000_u32,
            steps in proptest::collection::vec(proptest::collection::vec(any::<bool>(), 0..12), 1..60),
        ) {
            let (mut line, mut sent) = (Line::new(baud), Vec::new());
            let (mut sequence, mut taken) = (0_u16, Vec::new());
            let mut incoming = VecDeque::new();
            for requests in steps.into_iter().chain(std::iter::repeat_n(Vec::new(), 20_000)) {
                for is_stop in requests {
                    let request = if is_stop { Request::Command(Command::Stop) } else { Request::Heartbeat };
                    incoming.extend(frame(sequence, request));
                    sequence += 1;
                }
                while line.listens() && let Some(byte) = incoming.pop_front() {
                    line.take(&[byte]);
                }
                if let Some(packet) = line.packet() {
                    taken.push(packet.sequence);
                    line.answers.push_back(Reply::Answer { sequence: packet.sequence, refused: None });
                    prop_assert!(line.answers.len() <= ANSWERS);
                }
                line.send(Duration::from_millis(1), &mut sent);
            }
            prop_assert!(incoming.is_empty());
            let mut receiver = Receiver::<256>::new();
            let (mut answered, mut done) = (Vec::new(), Vec::new());
            for &byte in &sent {
                let Some(payload) = receiver.push(byte) else { continue };
                let reply = message::Reply::<MAX_JOINTS>::decode(payload.expect("no damage")).expect("a reply");
                let message::Reply::Answer { sequence, refused } = reply else { panic!("{reply:?}") };
                answered.push(sequence);
                if refused.is_none() {
                    done.push(sequence);
                }
            }
            for numbers in [&mut answered, &mut done, &mut taken] {
                numbers.sort_unstable();
            }
            prop_assert!(answered.into_iter().eq(0..sequence));
            prop_assert_eq!(done, taken);
        }
    }
}
