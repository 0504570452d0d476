//! The part of a recording that concerns a replay, heard from the raw payloads.

use crate::mcap::{About, Entry, Setting, Stamp, What};
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_shared::command::Refusal;
use blindgrasp_shared::link::InputRecord;
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::telemetry::snapshot::Part;
use blindgrasp_wire::{Packet, Record, Request};

/// Something that a replay follows. Nearly all of them are records, which need no box.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)]
pub enum Item {
    /// A session began.
    Session(Box<About>),
    /// The parameters in force.
    Parameters(Vec<Setting>),
    /// The host asked for a change of a parameter.
    Asked {
        /// Number of the request.
        sequence: u16,
        /// The value that it is to have; `None` if the device itself finds out.
        setting: Option<Setting>,
    },
    /// A request was answered.
    Answered {
        /// Number of the request.
        sequence: u16,
        /// `None`: done.
        refused: Option<Refusal>,
    },
    /// The record of a tick.
    Record(Told),
    /// A part of a snapshot.
    Part(Part),
    /// The link was cut.
    Cut(String),
}

/// A record, as it was told.
#[derive(Clone, Debug)]
pub struct Told {
    /// The time of its arrival, since the beginning of the recording, s.
    pub time_s: f64,
    /// The record.
    pub record: Record,
    /// Of an input record, the digest of what it leaves out: all that the tick computed.
    pub digest: Option<u32>,
}

/// Turns entries of one device into items.
pub struct Hearing {
    start_ns: u64,
}

impl Hearing {
    /// Of a recording that begins at this time.
    pub fn new(start_ns: u64) -> Self {
        Self { start_ns }
    }

    /// Time since the beginning of the recording, s.
    pub fn seconds(&self, at: Stamp) -> f64 {
        at.0.saturating_sub(self.start_ns) as f64 * 1e-9
    }

    /// Takes the next entry. What is lost shows by the ticks that are missing.
    pub fn take(&self, entry: Entry) -> Option<Item> {
        let time_s = self.seconds(entry.at);
        match entry.what {
            What::About(about) => Some(Item::Session(about)),
            What::Parameters(settings) => Some(Item::Parameters(settings)),
            What::Sent(payload) => asked(&payload),
            What::Received(payload) => heard(time_s, &payload),
            What::Gap { words } => Some(Item::Cut(words)),
            What::Hole { .. } | What::Event { .. } | What::Link(_) | What::Tick(_) => None,
        }
    }
}

fn heard(time_s: f64, payload: &[u8]) -> Option<Item> {
    match Reply::<MAX_JOINTS>::decode(payload).ok()? {
        Reply::Record(record) => Some(Item::Record(Told { time_s, record, digest: None })),
        Reply::Input(InputRecord { sequence, tick, answer, events, reading_failed, counts, digest }) => {
            let record = Record {
                sequence,
                tick,
                answer,
                events,
                reading_failed,
                counts,
                decimation: 1,
                ..Record::BLANK
            };
            Some(Item::Record(Told { time_s, record, digest: Some(digest) }))
        }
        Reply::Snapshot(part) => Some(Item::Part(part)),
        Reply::Answer { sequence, refused } => Some(Item::Answered { sequence, refused }),
        _ => None,
    }
}

/// The change of a parameter that a request asks for.
fn asked(payload: &[u8]) -> Option<Item> {
    let Packet { sequence, request, .. } = Packet::decode(payload).ok()?;
    let setting = match request {
        Request::SetParameter { parameter, index, value } => {
            Some(Setting { parameter, index, value: Some(value) })
        }
        Request::Zero { .. } | Request::Defaults => None,
        _ => return None,
    };
    Some(Item::Asked { sequence, setting })
}
