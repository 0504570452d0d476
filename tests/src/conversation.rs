//! The host's end of a link to a firmware, frame by frame: requests go out when they like, answers and records come in
//! when they like.

use blindgrasp::body::MAX_JOINTS;
use blindgrasp::device::transport::{Transport, TransportError};
use blindgrasp::wire::{Packet, Record, Request};
use blindgrasp_shared::command::Refusal;
use blindgrasp_shared::link::{Counters, Receiver, encode, message, most_bytes};
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use serde::Serialize;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// A reply of a hand of any size.
pub type Reply<'a> = message::Reply<'a, MAX_JOINTS>;

/// Longest time that the firmware may take to start.
const START: Duration = Duration::from_secs(20);
/// Longest time that an answer may take. No answer takes a hundredth of this; but this machine may be busy.
const ANSWER: Duration = Duration::from_secs(20);
/// Time for which one hello waits while the firmware may still be starting.
const HELLO: Duration = Duration::from_millis(300);

/// The frame of a message.
pub fn frame(message: &impl Serialize) -> Vec<u8> {
    let mut buffer = [0; 4 * most_bytes(Packet::MOST_BYTES)];
    encode(message, &mut buffer).expect("the message fits").to_vec()
}

/// A message that was received.
#[derive(Clone, Debug, PartialEq)]
pub struct Heard(Vec<u8>);

impl Heard {
    /// Returns the reply.
    pub fn reply(&self) -> Reply<'_> {
        Reply::decode(&self.0).unwrap_or_else(|error| panic!("{error}: {:02x?}", self.0))
    }

    /// Number of the request that it answers; none for a record.
    pub fn sequence(&self) -> Option<u16> {
        match self.reply() {
            Reply::Identity { sequence, .. }
            | Reply::Answer { sequence, .. }
            | Reply::Value { sequence, .. }
            | Reply::Burst { sequence, .. } => Some(sequence),
            Reply::Record(_) | Reply::Snapshot(_) | Reply::Input(_) => None,
        }
    }

    /// Returns the reason for which the request was refused, if it was; `None`: done.
    pub fn refused(&self) -> Option<Refusal> {
        match self.reply() {
            Reply::Answer { refused, .. } => refused,
            other => panic!("{other:?}"),
        }
    }
}

/// A conversation.
pub struct Conversation<T> {
    /// The way to the firmware.
    pub transport: T,
    receiver: Receiver<{ Reply::MOST_BYTES + 4 }>,
    heard: VecDeque<Heard>,
    /// Number of the session, once there is one.
    pub session: u16,
    /// Number of the last request.
    pub sequence: u16,
    /// Records that came while something else was waited for.
    pub records: Vec<Record>,
}

impl<T: Transport> Conversation<T> {
    /// Before the first byte.
    pub fn new(transport: T) -> Self {
        Self {
            transport,
            receiver: Receiver::new(),
            heard: VecDeque::new(),
            session: 0,
            sequence: 0,
            records: Vec::new(),
        }
    }

    /// Frames received so far.
    pub fn counters(&self) -> Counters {
        self.receiver.counters()
    }

    /// Sends bytes.
    pub fn send(&mut self, bytes: &[u8]) {
        let sent = self.transport.send(bytes, Instant::now() + ANSWER);
        sent.unwrap_or_else(|error| panic!("{} bytes: {error}", bytes.len()));
    }

    /// The next message, records included; `None` if there is none in time.
    ///
    /// # Panics
    /// If the line is closed, or brings a damaged frame: it never should.
    pub fn hear(&mut self, patience: Duration) -> Option<Heard> {
        let deadline = Instant::now() + patience;
        loop {
            if let Some(heard) = self.heard.pop_front() {
                return Some(heard);
            }
            let mut buffer = [0; 4096];
            let count = match self.transport.receive(&mut buffer, deadline) {
                Ok(count) => count,
                Err(TransportError::TimedOut) => return None,
                Err(error) => panic!("{error}; {:?}", self.transport.trouble()),
            };
            for &byte in &buffer[..count] {
                match self.receiver.push(byte) {
                    None => {}
                    Some(Ok(payload)) => self.heard.push_back(Heard(payload.to_vec())),
                    Some(Err(error)) => panic!("a frame from the firmware: {error}"),
                }
            }
        }
    }

    /// The next answer; records are put aside.
    pub fn answer(&mut self) -> Heard {
        let deadline = Instant::now() + ANSWER;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let heard = self.hear(left).expect("an answer comes");
            match heard.reply() {
                Reply::Record(record) => self.records.push(record),
                _ => return heard,
            }
        }
    }

    /// The payloads of the next frames, as they are.
    pub fn payloads(&mut self, count: usize) -> Vec<Vec<u8>> {
        (0..count).map(|_| self.hear(ANSWER).expect("a frame comes").0).collect()
    }

    /// The next record, be it one that was put aside.
    pub fn record(&mut self) -> Record {
        if !self.records.is_empty() {
            return self.records.remove(0);
        }
        let heard = self.hear(ANSWER).expect("a record comes");
        match heard.reply() {
            Reply::Record(record) => record,
            other => panic!("{other:?}"),
        }
    }

    /// Numbers a request of this session.
    pub fn packet(&mut self, request: Request) -> Packet {
        self.sequence = self.sequence.wrapping_add(1);
        Packet { session: self.session, sequence: self.sequence, request }
    }

    /// The answer to any message, whose number it has to have.
    pub fn ask_as_is(&mut self, message: &impl Serialize, sequence: u16) -> Heard {
        self.send(&frame(message));
        let heard = self.answer();
        assert_eq!(heard.sequence(), Some(sequence), "{heard:?}");
        heard
    }

    /// The answer to the next request of this session.
    pub fn ask(&mut self, request: Request) -> Heard {
        let packet = self.packet(request);
        self.ask_as_is(&packet, packet.sequence)
    }

    /// Waits until the firmware answers at all. What is sent before its line is there, is lost; so the question, which is
    /// none that it could know, is repeated.
    pub fn knock(&mut self) {
        let deadline = Instant::now() + START;
        let mut knocks = 0_u16;
        while Instant::now() < deadline {
            knocks += 1;
            self.send(&[&[0], &frame(&(0_u16, knocks, 0x7f_u8))[..]].concat());
            while let Some(heard) = self.hear(HELLO) {
                // Nobody else has asked; but answers to knocks before this one may still come.
                if heard.sequence() == Some(knocks) {
                    return;
                }
            }
        }
        panic!("no firmware answers");
    }

    /// Begins a session.
    pub fn hello(&mut self) -> Heard {
        let heard = self.ask(Request::Hello { interface_version: INTERFACE_VERSION });
        match heard.reply() {
            Reply::Identity { session, .. } => self.session = session,
            other => panic!("{other:?}"),
        }
        heard
    }
}
