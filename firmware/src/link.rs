//! Between the line and the control task: frames to packets, replies to frames. Runs when nothing else does.

use crate::model::JOINTS;
use crate::queue::{Answer, HandPacket, HandReply, LinkEnd};
use blindgrasp_shared::command::Refusal;
use blindgrasp_shared::link::message::{Packet, Reply, Request, not_understood};
use blindgrasp_shared::link::rate::{FIRST_BAUD, HandRate};
use blindgrasp_shared::link::ring::{ReceiveRing, SendRing};
use blindgrasp_shared::link::{Counters, Receiver, encode, most_bytes};
use heapless::Deque;

/// Bytes of the longest payload that is received, with its CRC.
pub const MOST_RECEIVED: usize = HandPacket::MOST_BYTES + 4;
/// Bytes of the longest frame that is sent.
pub const MOST_SENT: usize = most_bytes(HandReply::MOST_BYTES);

/// Bytes that were received: 1.7 ms of a busy line at 3 Mbaud, of which a tick keeps the reader away for 0.6.
pub type ReceivedBytes = ReceiveRing<512>;
/// Bytes to send: 0.85 ms of a line at 3 Mbaud. More would only keep answers behind records.
pub type SentBytes = SendRing<256>;

/// A line of bytes that never makes its user wait.
pub trait Port {
    /// The next byte, if one came.
    fn receive(&mut self) -> Option<u8>;
    /// Returns `true` if no byte waits.
    fn is_silent(&self) -> bool;
    /// Sends as many of the bytes as the line can take now, from the first on, and returns how many.
    fn send(&mut self, bytes: &[u8]) -> usize;
    /// Returns `true` if the last byte has left, with its stop bit.
    fn is_sent(&self) -> bool;
    /// Changes the rate, baud.
    fn set_baud(&mut self, baud: u32);
}

/// Refusals that can wait to be sent: more than there are frames in the bytes that can wait to be looked at.
const REFUSALS: usize = 64;

/// The content of a frame with a good CRC.
pub enum Received {
    /// A request.
    Packet(HandPacket),
    /// Something else; what stands where a request has its number.
    Unknown(u16),
}

/// Finds frames in whatever the port brings.
pub struct Frames(Receiver<MOST_RECEIVED>);

impl Frames {
    /// Before the first byte.
    pub const fn new() -> Self {
        Self(Receiver::new())
    }

    /// Takes a byte; returns what the frame held that it completes. Bad frames are counted.
    pub fn push(&mut self, byte: u8) -> Option<Received> {
        let payload = self.0.push(byte)?.ok()?;
        match (Packet::decode(payload), not_understood::<JOINTS>(payload)) {
            (Ok(packet), _) => Some(Received::Packet(packet)),
            (Err(_), Reply::Answer { sequence, .. }) => Some(Received::Unknown(sequence)),
            // It is an answer.
            (Err(_), _) => None,
        }
    }

    /// Frames good and bad.
    pub fn counters(&self) -> Counters {
        self.0.counters()
    }
}

impl Default for Frames {
    fn default() -> Self {
        Self::new()
    }
}

/// The link of the hand.
pub struct Link<'q, P> {
    port: P,
    frames: Frames,
    queues: LinkEnd<'q>,
    /// Requests that do not get to the control task: their numbers, and why not.
    refusals: Deque<(u16, Refusal), REFUSALS>,
    /// The frame that is being sent, what of it is sent, and its length.
    frame: [u8; MOST_SENT],
    sent: usize,
    length: usize,
    rate: HandRate,
    /// The rate that the port has, baud.
    baud: u32,
    /// The rate that it is to have once the frame has left.
    next_baud: Option<u32>,
}

impl<'q, P: Port> Link<'q, P> {
    /// A link over a port.
    pub fn new(port: P, queues: LinkEnd<'q>) -> Self {
        Self {
            port,
            frames: Frames::new(),
            queues,
            refusals: Deque::new(),
            frame: [0; MOST_SENT],
            sent: 0,
            length: 0,
            rate: HandRate::new(),
            baud: FIRST_BAUD,
            next_baud: None,
        }
    }

    /// Does a small piece of what there is to do: the line's rate, all bytes that came, and as many to send as the line
    /// takes. Time is counted in ticks of about a millisecond.
    ///
    /// While there is no room for another refusal, bytes wait where they are: every request is answered.
    pub fn poll(&mut self, now_ms: u32) {
        if self.sent == self.length
            && self.port.is_sent()
            && let Some(baud) = self.next_baud.take()
        {
            self.rate.answered(baud, now_ms);
        }
        let baud = self.rate.turn(now_ms);
        if baud != self.baud {
            self.port.set_baud(baud);
            self.baud = baud;
        }
        while !self.refusals.is_full()
            && let Some(byte) = self.port.receive()
        {
            let refusal = match self.frames.push(byte) {
                None => continue,
                Some(Received::Packet(packet)) => {
                    self.rate.heard(matches!(packet.request, Request::Rate { .. }), now_ms);
                    match self.queues.put(packet) {
                        Ok(()) => continue,
                        Err(packet) => (packet.sequence, Refusal::Busy),
                    }
                }
                Some(Received::Unknown(sequence)) => (sequence, Refusal::NotUnderstood),
            };
            // There is room, so this can't fail.
            let _ = self.refusals.push_back(refusal);
        }
        if self.sent == self.length && self.next_baud.is_none() {
            // Who waits for an answer has done his part; a refusal can wait; telemetry goes last.
            let refusal =
                || self.refusals.pop_front().map(|(sequence, reason)| refused(sequence, reason).into());
            let next = self.queues.answer().or_else(refusal);
            // The buffer has room for the longest reply, so this can't fail.
            let frame = if let Some(Answer { reply, baud }) = next {
                self.next_baud = baud;
                Some(encode(&reply, &mut self.frame))
            } else {
                self.queues.telemetry().map(|telemetry| telemetry.frame(&mut self.frame))
            };
            if let Some(frame) = frame {
                (self.sent, self.length) = (0, frame.map_or(0, <[u8]>::len));
            }
        }
        if let Some(rest) = self.frame.get(self.sent..self.length) {
            self.sent += self.port.send(rest);
        }
    }

    /// Returns `true` if there is nothing to do until an interrupt.
    pub fn is_idle(&self) -> bool {
        self.sent == self.length
            && self.next_baud.is_none()
            && self.refusals.is_empty()
            && self.queues.is_empty()
            && self.port.is_silent()
    }

    /// Frames good and bad.
    pub fn counters(&self) -> Counters {
        self.frames.counters()
    }
}

/// The answer to a request that does not get to the control task.
pub fn refused(sequence: u16, reason: Refusal) -> HandReply {
    Reply::Answer { sequence, refused: Some(reason) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::queue::{Queues, Telemetry};
    use blindgrasp_shared::command::Command;
    use blindgrasp_shared::link::encode;
    use blindgrasp_shared::link::rate::TRIAL_MS;
    use blindgrasp_shared::telemetry::List;
    use blindgrasp_shared::telemetry::snapshot::Part;
    use proptest::prelude::*;
    use std::cell::{Cell, RefCell};
    use std::collections::VecDeque;
    use std::vec::Vec;

    /// A line with the bytes that come and those that were sent; the line takes a byte only at every so many tries, at
    /// every other at best.
    #[derive(Default)]
    struct Wire {
        incoming: VecDeque<u8>,
        sent: Vec<u8>,
        every: usize,
        tries: usize,
        /// A byte is on its way out.
        leaving: Cell<bool>,
        /// Rates that it got, and after how many bytes.
        bauds: Vec<(u32, usize)>,
    }

    impl Port for &RefCell<Wire> {
        fn receive(&mut self) -> Option<u8> {
            (&mut *self.borrow_mut()).receive()
        }

        fn is_silent(&self) -> bool {
            self.borrow().incoming.is_empty()
        }

        fn send(&mut self, bytes: &[u8]) -> usize {
            (&mut *self.borrow_mut()).send(bytes)
        }

        fn is_sent(&self) -> bool {
            !self.borrow().leaving.replace(false)
        }

        fn set_baud(&mut self, baud: u32) {
            (&mut *self.borrow_mut()).set_baud(baud);
        }
    }

    impl Port for &mut Wire {
        fn receive(&mut self) -> Option<u8> {
            self.incoming.pop_front()
        }

        fn is_silent(&self) -> bool {
            self.incoming.is_empty()
        }

        fn send(&mut self, bytes: &[u8]) -> usize {
            self.tries += 1;
            let is_free = self.tries.is_multiple_of(self.every.max(2));
            let taken = bytes.len().min(is_free.into());
            self.sent.extend(&bytes[..taken]);
            self.leaving.set(self.leaving.get() || taken > 0);
            taken
        }

        /// The last byte leaves a while after the line has taken it.
        fn is_sent(&self) -> bool {
            !self.leaving.replace(false)
        }

        fn set_baud(&mut self, baud: u32) {
            assert!(!self.leaving.get(), "a byte is cut");
            self.bauds.push((baud, self.sent.len()));
        }
    }

    impl Wire {
        fn say(&mut self, sequence: u16, request: Request<{ crate::model::JOINTS }>) {
            let mut buffer = [0; most_bytes(HandPacket::MOST_BYTES)];
            let packet = Packet { session: 1, sequence, request };
            self.incoming.extend(encode(&packet, &mut buffer).unwrap());
        }

        fn say_nonsense(&mut self, sequence: u16) {
            let mut buffer = [0; 32];
            self.incoming.extend(encode(&(1_u16, sequence, 200_u8), &mut buffer).unwrap());
        }

        /// Answers that were sent: their sequence numbers and refusals.
        fn answers(&self) -> Vec<(u16, Option<Refusal>)> {
            let mut receiver = Receiver::<{ HandReply::MOST_BYTES + 4 }>::new();
            let mut answers = Vec::new();
            for &byte in &self.sent {
                let Some(payload) = receiver.push(byte) else { continue };
                match Reply::<{ crate::model::JOINTS }>::decode(payload.unwrap()).unwrap() {
                    Reply::Answer { sequence, refused } => answers.push((sequence, refused)),
                    Reply::Snapshot(_) => {}
                    other => panic!("{other:?}"),
                }
            }
            answers
        }
    }

    /// Polls until there is nothing left to do.
    fn settle(link: &mut Link<'_, &mut Wire>) {
        for _ in 0..100_000 {
            link.poll(0);
            if link.is_idle() {
                return;
            }
        }
        panic!("the link does not come to rest");
    }

    #[test]
    fn every_request_of_a_burst_is_answered() {
        let mut wire = Wire::default();
        for sequence in 0..1000 {
            wire.say(sequence, Request::Heartbeat);
        }
        let mut queues = Queues::new();
        let (mut control, end, _) = queues.split();
        settle(&mut Link::new(&mut wire, end));
        let taken: Vec<u16> = core::iter::from_fn(|| control.take()).map(|packet| packet.sequence).collect();
        let busy: Vec<_> =
            (taken.len() as u16..1000).map(|sequence| (sequence, Some(Refusal::Busy))).collect();
        assert_eq!(taken, [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(wire.answers(), busy);
    }

    proptest! {
        /// Whatever comes, over a line that is full of it: each request is answered once, and one that was taken is not
        /// answered with a refusal, nor with nothing.
        #[test]
        fn every_request_is_answered_once_over_a_line_that_is_full(
            every in 1..30_usize,
            steps in proptest::collection::vec(
                (proptest::collection::vec(0..4_u8, 0..12), 0..400_usize, 0..6_usize),
                1..60,
            ),
        ) {
            let wire = RefCell::new(Wire { every, ..Wire::default() });
            let mut queues = Queues::new();
            let (mut control, end, _) = queues.split();
            let mut link = Link::new(&wire, end);
            let (mut sequence, mut taken) = (0_u16, Vec::new());
            let mut tick = || match control.take() {
                Some(packet) => {
                    taken.push(packet.sequence);
                    control.answer(Reply::Answer { sequence: packet.sequence, refused: None }.into());
                    true
                }
                None => {
                    // What there may be of telemetry takes no answer's place.
                    control.tell(Telemetry::Part(Part { tick: 0, offset: 0, length: 64, bytes: List::first_of([1; 64], 64) }));
                    false
                }
            };
            for (requests, polls, ticks) in steps {
                for kind in requests {
                    let mut wire = wire.borrow_mut();
                    match kind {
                        0 => wire.say(sequence, Request::Command(Command::Stop)),
                        1 => wire.say_nonsense(sequence),
                        _ => wire.say(sequence, Request::Heartbeat),
                    }
                    sequence += 1;
                }
                for _ in 0..polls {
                    link.poll(0);
                }
                for _ in 0..ticks {
                    tick();
                }
            }
            while !link.is_idle() || tick() {
                (0..1000).for_each(|_| link.poll(0));
            }
            let mut answers = wire.borrow().answers();
            answers.sort_unstable_by_key(|answer| answer.0);
            prop_assert!(answers.iter().map(|answer| answer.0).eq(0..sequence));
            let mut done: Vec<u16> =
                answers.iter().filter(|(_, refused)| refused.is_none()).map(|answer| answer.0).collect();
            taken.sort_unstable();
            done.sort_unstable();
            prop_assert_eq!(done, taken);
        }
    }

    #[test]
    fn requests_without_room_are_answered_so_and_a_stop_has_room() {
        let mut wire = Wire::default();
        for sequence in 0..9 {
            wire.say(sequence, Request::Heartbeat);
        }
        wire.say(9, Request::Command(Command::Stop));
        let mut queues = Queues::new();
        let (mut control, end, _) = queues.split();
        settle(&mut Link::new(&mut wire, end));
        assert_eq!(wire.answers(), [(7, Some(Refusal::Busy)), (8, Some(Refusal::Busy))]);
        assert_eq!(control.take().map(|packet| packet.sequence), Some(9));
        assert_eq!(control.take().map(|packet| packet.sequence), Some(0));
    }

    #[test]
    fn replies_are_sent_whole_and_in_order() {
        let mut wire = Wire::default();
        let mut queues = Queues::new();
        let (mut control, end, _) = queues.split();
        for sequence in 0..5 {
            control.answer(Reply::Answer { sequence, refused: None }.into());
        }
        settle(&mut Link::new(&mut wire, end));
        let expected: Vec<_> = (0..5).map(|sequence| (sequence, None)).collect();
        assert_eq!(wire.answers(), expected);
    }

    #[test]
    fn the_rate_changes_once_the_answer_has_left_and_comes_back_by_itself() {
        let mut wire = Wire { every: 5, ..Wire::default() };
        let mut queues = Queues::new();
        let (mut control, end, _) = queues.split();
        for (sequence, baud) in [(1, None), (2, Some(3_000_000)), (3, None)] {
            control.answer(Answer { reply: Reply::Answer { sequence, refused: None }, baud });
        }
        let mut link = Link::new(&mut wire, end);
        settle(&mut link);
        (0..TRIAL_MS).for_each(|now_ms| link.poll(now_ms));
        assert_eq!((link.baud, link.port.bauds.len()), (3_000_000, 1));
        link.poll(TRIAL_MS);
        // Behind the second of three answers of the same length.
        let length = wire.sent.len() / 3;
        assert_eq!(wire.bauds, [(3_000_000, 2 * length), (FIRST_BAUD, 3 * length)]);
    }

    #[test]
    fn what_is_no_request_is_refused_and_damage_is_counted() {
        let mut wire = Wire::default();
        wire.say_nonsense(77);
        let mut damaged = wire.incoming.clone();
        damaged[2] ^= 1;
        wire.incoming.extend(damaged);
        wire.say(78, Request::Heartbeat);
        let mut queues = Queues::new();
        let (mut control, end, _) = queues.split();
        let mut link = Link::new(&mut wire, end);
        settle(&mut link);
        assert_eq!((link.counters().good, link.counters().refused()), (2, 1));
        assert_eq!(wire.answers(), [(77, Some(Refusal::NotUnderstood))]);
        assert_eq!(control.take().map(|packet| packet.sequence), Some(78));
    }
}
