//! Messages to a firmware whose joints are at the host's end of the link (the image `pil`), and its answers.
//!
//! The firmware and the host go in lockstep: requests wait in the firmware until it is sent the joints of a tick; the tick
//! takes the oldest request, and is answered by the reply to it and by its record. So the host always knows in which tick
//! a request was taken. Nothing is ever sent twice, because a tick that may have been done can't be done again; a line
//! that loses something ends the run. Only before the first request, when the firmware may still be starting, is there
//! something to repeat: [`Client::knock`].

use super::transport::{Transport, TransportError};
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::link::{FrameError, Receiver, encode, most_bytes};
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_wire::{Answer, Firmware, Packet, Request, Sample, Turned, in_words, other_interface};
use serde::Serialize;
use std::fmt;
use std::time::{Duration, Instant};

/// Bytes of the CRC-32 behind a payload.
const CRC_BYTES: usize = 4;
/// Most payload and CRC of a reply.
const MOST_RECEIVED: usize = Reply::<MAX_JOINTS>::MOST_BYTES + CRC_BYTES;
/// Most bytes of a request on the wire.
const MOST_SENT: usize = most_bytes(Packet::MOST_BYTES);
/// Time for which one knock waits.
const KNOCK: Duration = Duration::from_millis(250);
/// The number of a request that no hand knows.
const NO_REQUEST: u8 = 0x7f;

/// Times to wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// For the firmware to start.
    pub start: Duration,
    /// For an answer.
    pub answer: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self { start: Duration::from_secs(10), answer: Duration::from_secs(5) }
    }
}

/// Counts of the traffic on the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Traffic {
    /// Frames sent.
    pub frames_sent: u64,
    /// Bytes sent.
    pub bytes_sent: u64,
    /// Whole frames received.
    pub frames_received: u64,
    /// Bytes received.
    pub bytes_received: u64,
    /// Frames received with damage.
    pub frames_damaged: u64,
    /// Whole frames received that nobody had asked for.
    pub frames_unexpected: u64,
    /// Longest time from a request to its answer, ms.
    pub slowest_answer_ms: f64,
}

impl fmt::Display for Traffic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} frames ({} bytes) sent, {} received ({} bytes), {} of them damaged, {} unexpected",
            self.frames_sent,
            self.bytes_sent,
            self.frames_received + self.frames_damaged,
            self.bytes_received,
            self.frames_damaged,
            self.frames_unexpected
        )
    }
}

/// The reason for which there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// Nothing answers at all.
    #[error("no firmware answers within {} s (so far {traffic}){}", .waited.as_secs_f64(), because(.trouble))]
    NobodyThere {
        /// Time that it was waited for.
        waited: Duration,
        /// The traffic on the line.
        traffic: Traffic,
        /// The known trouble of the other end.
        trouble: Option<String>,
    },
    /// It does not answer any more.
    #[error("no answer of the firmware to {request} within {} s (so far {traffic}){}; whether it did the tick is not known, so the run can't go on", .waited.as_secs_f64(), because(.trouble))]
    Silence {
        /// The request.
        request: String,
        /// Time that it was waited for.
        waited: Duration,
        /// The traffic on the line.
        traffic: Traffic,
        /// The known trouble of the other end.
        trouble: Option<String>,
    },
    /// A tick was done without the request that it should have taken.
    #[error("the firmware did the tick without {request}, which was lost on the way (so far {traffic})")]
    RequestLost {
        /// The request.
        request: String,
        /// The traffic on the line.
        traffic: Traffic,
    },
    /// The line failed.
    #[error("the line to the firmware failed{}", because(.trouble))]
    Line {
        /// The cause.
        source: TransportError,
        /// The known trouble of the other end.
        trouble: Option<String>,
    },
    /// It speaks another version of the interface.
    #[error(
        "the firmware has interface version {theirs}, this program {INTERFACE_VERSION}: build and load the firmware that belongs to this program"
    )]
    OtherInterface {
        /// Its version.
        theirs: u16,
    },
    /// It is not the image `pil`.
    #[error("this is {0}: its joints are real; a simulation needs the image `pil`")]
    OtherImage(String),
}

fn because(trouble: &Option<String>) -> String {
    trouble.as_ref().map_or(String::new(), |trouble| format!("; {trouble}"))
}

/// The host's end of the link.
pub struct Client<T> {
    transport: T,
    patience: Patience,
    receiver: Receiver<MOST_RECEIVED>,
    /// Received, but not yet looked at.
    bytes: Vec<u8>,
    /// The number that was seen.
    seen: usize,
    /// Payload of the last whole frame.
    payload: Vec<u8>,
    traffic: Traffic,
}

impl<T: Transport> Client<T> {
    /// Before the first byte.
    pub fn new(transport: T, patience: Patience) -> Self {
        Self {
            transport,
            patience,
            receiver: Receiver::new(),
            bytes: Vec::new(),
            seen: 0,
            payload: Vec::new(),
            traffic: Traffic::default(),
        }
    }

    /// Returns the traffic on the line so far.
    pub fn traffic(&self) -> &Traffic {
        &self.traffic
    }

    /// Finds out whether there is a firmware, without asking it for anything: what is no request is answered at once,
    /// and changes nothing. A firmware that still starts does not hear the first knocks.
    ///
    /// # Errors
    /// If nothing answers for too long.
    pub fn knock(&mut self) -> Result<(), ClientError> {
        let end = Instant::now() + self.patience.start;
        for sequence in 1.. {
            // Whatever was on the line before ends here.
            let mut bytes = vec![0];
            self.encode(&mut bytes, &(0_u16, sequence, NO_REQUEST));
            let deadline = end.min(Instant::now() + KNOCK);
            let heard = self.send(&bytes, end).and_then(|()| self.hear_knock(sequence, deadline));
            match heard {
                Ok(()) => return Ok(()),
                Err(TransportError::TimedOut) if Instant::now() < end => {}
                Err(TransportError::TimedOut) => break,
                Err(source) => return Err(self.line(source)),
            }
        }
        let trouble = self.transport.trouble();
        Err(ClientError::NobodyThere { waited: self.patience.start, traffic: self.traffic, trouble })
    }

    /// Waits for the answer to one knock; answers to earlier ones may come first.
    fn hear_knock(&mut self, knock: u16, deadline: Instant) -> Result<(), TransportError> {
        loop {
            self.receive(deadline)?;
            match Reply::<MAX_JOINTS>::decode(&self.payload) {
                Ok(Reply::Answer { sequence, .. }) if sequence != knock => {}
                // A firmware of another interface may say it in another way.
                Ok(Reply::Answer { .. }) | Err(_) => return Ok(()),
                Ok(_) => self.traffic.frames_unexpected += 1,
            }
        }
    }

    /// One tick: a request, if there is one, and the joints, sent at once; the answer to the request, and the record.
    ///
    /// # Errors
    /// If they do not come.
    pub fn turn(&mut self, packet: Option<&Packet>, sample: &Sample) -> Result<Turned, ClientError> {
        let mut bytes = Vec::with_capacity(2 * MOST_SENT);
        if let Some(packet) = packet {
            self.encode(&mut bytes, packet);
        }
        self.encode(
            &mut bytes,
            &Packet { session: 0, sequence: 0, request: Request::Joints(sample.clone()) },
        );
        let begun = Instant::now();
        let deadline = begun + self.patience.answer;
        let turned = match self.send(&bytes, deadline) {
            Ok(()) => self.hear(packet, deadline)?,
            Err(source) => return Err(self.silence(packet, source)),
        };
        let answer_ms = 1e3 * begun.elapsed().as_secs_f64();
        self.traffic.slowest_answer_ms = self.traffic.slowest_answer_ms.max(answer_ms);
        Ok(turned)
    }

    fn hear(&mut self, packet: Option<&Packet>, deadline: Instant) -> Result<Turned, ClientError> {
        let asked = packet.map(|packet| packet.sequence);
        let mut answer = None;
        loop {
            if let Err(source) = self.receive(deadline) {
                return Err(self.silence(packet, source));
            }
            let (sequence, told) = match Reply::<MAX_JOINTS>::decode(&self.payload) {
                Ok(Reply::Record(record)) => match (asked, &answer) {
                    (Some(_), None) => {
                        let (request, traffic) = (in_words(packet), self.traffic);
                        return Err(ClientError::RequestLost { request, traffic });
                    }
                    _ => return Ok(Turned { answer, record }),
                },
                Ok(Reply::Identity { sequence, session, identity, .. }) => {
                    let firmware = Firmware::from(&identity);
                    if identity.image.interface_version != INTERFACE_VERSION {
                        let theirs = identity.image.interface_version;
                        return Err(ClientError::OtherInterface { theirs });
                    }
                    if firmware.kind != "pil" {
                        return Err(ClientError::OtherImage(firmware.words));
                    }
                    (sequence, Answer::Identity { session, firmware })
                }
                Ok(Reply::Answer { sequence, refused }) => {
                    (sequence, refused.map_or(Answer::Done, Answer::Refused))
                }
                Ok(Reply::Value { sequence, setting, .. }) => (sequence, Answer::Value(setting)),
                Ok(Reply::Burst { sequence, count, record, .. }) => {
                    (sequence, Answer::Burst { count, record: Box::new(record) })
                }
                // The image for processor in the loop sends none.
                Ok(Reply::Snapshot(_) | Reply::Input(_)) => {
                    self.traffic.frames_unexpected += 1;
                    continue;
                }
                Err(_) => match other_interface(&self.payload) {
                    Some(theirs) => return Err(ClientError::OtherInterface { theirs }),
                    None => {
                        self.traffic.frames_unexpected += 1;
                        continue;
                    }
                },
            };
            if Some(sequence) == asked && answer.is_none() {
                answer = Some(told);
            } else {
                self.traffic.frames_unexpected += 1;
            }
        }
    }

    fn encode(&mut self, bytes: &mut Vec<u8>, message: &impl Serialize) {
        let mut buffer = [0; MOST_SENT];
        // The buffer is as large as the largest request.
        if let Ok(frame) = encode(message, &mut buffer) {
            bytes.extend_from_slice(frame);
            self.traffic.frames_sent += 1;
        }
    }

    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), TransportError> {
        self.transport.send(bytes, deadline)?;
        self.traffic.bytes_sent += bytes.len() as u64;
        Ok(())
    }

    /// Waits for the next whole frame. Damaged ones are counted.
    fn receive(&mut self, deadline: Instant) -> Result<(), TransportError> {
        loop {
            while let Some(&byte) = self.bytes.get(self.seen) {
                self.seen += 1;
                match self.receiver.push(byte) {
                    None => {}
                    Some(Ok(payload)) => {
                        self.traffic.frames_received += 1;
                        self.payload.clear();
                        self.payload.extend_from_slice(payload);
                        return Ok(());
                    }
                    Some(Err(
                        FrameError::TooShort | FrameError::TooLong | FrameError::BadCode | FrameError::BadCrc,
                    )) => self.traffic.frames_damaged += 1,
                }
            }
            // A line that never rests would keep this busy past the deadline.
            if Instant::now() >= deadline {
                return Err(TransportError::TimedOut);
            }
            self.bytes.resize(4096, 0);
            let received = self.transport.receive(&mut self.bytes, deadline);
            self.seen = 0;
            self.bytes.truncate(*received.as_ref().unwrap_or(&0));
            self.traffic.bytes_received += received? as u64;
        }
    }

    /// Returns the error that a missing answer means.
    fn silence(&mut self, packet: Option<&Packet>, source: TransportError) -> ClientError {
        match source {
            TransportError::TimedOut => ClientError::Silence {
                request: in_words(packet),
                waited: self.patience.answer,
                traffic: self.traffic,
                trouble: self.transport.trouble(),
            },
            source => self.line(source),
        }
    }

    fn line(&mut self, source: TransportError) -> ClientError {
        ClientError::Line { source, trouble: self.transport.trouble() }
    }
}
