//! Recordings: MCAP files of what a hand, or several, said and were told.
//!
//! For each device, by its name (`hand`, or `hand1`, `hand2`, ...):
//!
//! | topic | encoding | what |
//! |---|---|---|
//! | `/NAME/received` | raw | payload of every good frame that came, as it was; its time is when it came |
//! | `/NAME/sent` | raw | payload of every frame that was sent |
//! | `/NAME/tick` | protobuf | each record, decoded, with angles and speeds; its time is the tick's on the host's clock |
//! | `/NAME/event` | protobuf, `foxglove.Log` | sessions, modes, faults, answers, gaps, in words |
//! | `/NAME/link` | protobuf | each second, what became of the link |
//! | `/NAME/about` | JSON | at the beginning of each session, who the device is, with the whole hand's file where it is known |
//! | `/NAME/parameters` | JSON | the parameters in force, and each that changes |
//!
//! A simulation tells, at each tick, the true state of its world as well, as tools know it, in protobuf:
//!
//! | topic | schema | what |
//! |---|---|---|
//! | `/truth/object` | `foxglove.FrameTransform` | pose of the frame `object`, whose origin is the centre of mass, in the hand's `base` |
//! | `/truth/joints` | `foxglove.JointStates` | true angle and speed of each joint, and the torque on it |
//! | `/truth/contacts` | `blindgrasp.Contacts` | for each finger the contact point and the force on the object, in `base`, the used share of friction and the way slipped; what tables carry |
//!
//! and has its shapes as attachments: `hand.urdf`, and `object.obj`, in metres and in the frame `object`.
//!
//! Raw payloads are what counts: what is decoded follows from them, here and in whoever reads. Decoded channels are for
//! the tools that people have.
//!
//! - A **session** begins where a device says who it is. A **gap** is where the link was cut.
//! - The file is whole at every checkpoint, at most half a second apart (`file`).
//! - **What everything hangs on** stands twice, so that damage costs no more than its own records: what a device and its
//!   parameters are is also metadata, before the chunk of its message.
//! - **Numbers**: messages of a channel are numbered without holes, so that what a damaged file has lost can be told
//!   exactly; channels have fixed numbers, so that a chunk can be read without the one that introduced its channels.

mod about;
mod clock;
mod decoder;
mod error;
mod file;
mod finish;
mod message;
mod protobuf;
mod reader;
mod salvage;
mod schema;
mod writer;

pub use about::{About, Setting};
pub use decoder::{Arrival, Decoded, Decoder, Record};
pub use error::RecordingError;
pub use finish::{Finished, finish};
pub use message::{Level, LinkStatus};
pub use reader::{Damage, Entries, Entry, Place, Recording, What};
pub use writer::{Contact, Saved, World, Writer};

use std::collections::BTreeMap;

/// Version of the format.
const FORMAT: u32 = 1;
/// Profile of the files, and encoding of the raw channels.
const PROFILE: &str = "blindgrasp";
/// The library that writes them.
const LIBRARY: &str = concat!("blindgrasp ", env!("CARGO_PKG_VERSION"));
/// Name of the metadata.
const METADATA: &str = "blindgrasp";
/// Name of the attachment with the signal table.
const SIGNALS: &str = "signals.json";

/// Nanoseconds since 1970 on the host's clock; in a simulation, since the start of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stamp(pub u64);

impl Stamp {
    /// Now.
    pub fn now() -> Self {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        Self(since.map_or(0, |since| since.as_nanos() as u64))
    }
}

/// A device of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Device(usize);

/// The content of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Received,
    Sent,
    Tick,
    Event,
    Link,
    About,
    Parameters,
}

const CHANNELS: [Kind; 7] =
    [Kind::Received, Kind::Sent, Kind::Tick, Kind::Event, Kind::Link, Kind::About, Kind::Parameters];

/// Numbers of channels that a device has.
const CHANNELS_A_DEVICE: usize = 8;

impl Kind {
    fn word(self) -> &'static str {
        match self {
            Self::Received => "received",
            Self::Sent => "sent",
            Self::Tick => "tick",
            Self::Event => "event",
            Self::Link => "link",
            Self::About => "about",
            Self::Parameters => "parameters",
        }
    }

    fn topic(self, device: &str) -> String {
        format!("/{device}/{}", self.word())
    }

    /// The number of a device's channel of this kind.
    fn channel(self, device: Device) -> u16 {
        (1 + CHANNELS_A_DEVICE * device.0 + self as usize) as u16
    }

    /// Device and kind of a number.
    fn of_channel(channel: u16) -> Option<(usize, Self)> {
        let number = usize::from(channel).checked_sub(1)?;
        Some((number / CHANNELS_A_DEVICE, *CHANNELS.get(number % CHANNELS_A_DEVICE)?))
    }

    /// Device and kind of a topic.
    fn of_topic(topic: &str) -> Option<(&str, Self)> {
        let (device, word) = topic.strip_prefix('/')?.split_once('/')?;
        Some((device, CHANNELS.into_iter().find(|kind| kind.word() == word)?))
    }
}

/// Keys of metadata that hold a message a second time.
mod twin {
    /// The device's name.
    pub(super) const DEVICE: &str = "device";
    /// Channel and number of the message, and its time, ns.
    pub(super) const CHANNEL: &str = "channel";
    pub(super) const SEQUENCE: &str = "sequence";
    pub(super) const TIME_NS: &str = "time_ns";
    /// The message, which is JSON.
    pub(super) const JSON: &str = "json";
}

/// Name of metadata, by what is in it: other tools want each to be another.
fn metadata_name(metadata: &BTreeMap<String, String>) -> String {
    let of = |key: &str| metadata.get(key).map_or("", String::as_str);
    match metadata.contains_key(twin::JSON) {
        true => format!("{METADATA}.{}.{}.{}", of(twin::DEVICE), of(twin::CHANNEL), of(twin::SEQUENCE)),
        false => METADATA.to_owned(),
    }
}

/// CRC-32 of metadata: MCAP has none for it.
fn seal(metadata: &BTreeMap<String, String>) -> String {
    let text: String = metadata
        .iter()
        .filter(|(key, _)| *key != "crc")
        .map(|(key, value)| format!("{key}={value}\n"))
        .collect();
    format!("{:08x}", crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(text.as_bytes()))
}
