//! Writing a recording.

mod world;

pub use world::{Contact, World};

use super::about::{About, Setting};
use super::decoder::{Arrival, Decoded, Track};
use super::error::RecordingError;
use super::file::WholeFile;
use super::message::{Level, LinkStatus, write_event, write_tick};
use super::{
    CHANNELS, Device, FORMAT, Kind, LIBRARY, PROFILE, SIGNALS, Stamp, metadata_name, schema, seal, twin,
};
use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::{Attachment, Compression, WriteOptions};
use blindgrasp_files::NewFile;
use blindgrasp_shared::command::Answer;
use blindgrasp_shared::fault::Raised;
use blindgrasp_shared::link::most_bytes;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// A checkpoint is made when this much time has passed since the last one, ns, ...
const CHECKPOINT_NS: u64 = 500_000_000;
/// ... or when this much has come, bytes.
const CHECKPOINT_BYTES: usize = 1 << 20;
/// Bits of a byte on a serial line.
const BITS_A_BYTE: f64 = 10.0;

/// The contents of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Saved {
    /// Bytes.
    pub bytes: u64,
    /// Records of ticks.
    pub records: u64,
    /// From the first to the last entry, s.
    pub seconds: f64,
}

impl fmt::Display for Saved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} s, {} records, {} bytes", self.seconds, self.records, self.bytes)
    }
}

/// The moment from which the file has its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Named {
    AtTheFirstEntry,
    WhenFinished,
}

/// A failure that is final.
struct Failure {
    problem: String,
}

/// Writes a recording. One that is dropped and has its name is finished, as well as that can be done; another is removed.
pub struct Writer {
    path: PathBuf,
    file: WholeFile,
    named: Named,
    /// Taken at the end.
    mcap: Option<::mcap::Writer<Gathered>>,
    gathered: Gathered,
    devices: Vec<Recorded>,
    /// Messages a channel.
    counts: BTreeMap<u16, u32>,
    /// Channels of the ticks: a device's hand may change.
    extra_channels: u16,
    /// Schemas of ticks by name.
    schemas: Vec<(String, Vec<u8>)>,
    /// Bytes since the last checkpoint, and the time of the first of them.
    pending: usize,
    since: Option<Stamp>,
    /// All entries: records so far, first and last time.
    records: u64,
    span: Option<(Stamp, Stamp)>,
    saved: Saved,
    failure: Option<Failure>,
    buffer: Vec<u8>,
}

/// The writer's knowledge of a device.
struct Recorded {
    name: String,
    track: Track,
    /// Names of the joints, and the channel of their ticks.
    joint_names: Vec<String>,
    tick_channel: Option<u16>,
    baud: Option<u32>,
    announced: bool,
    mode: Option<Mode>,
    fault: Option<Raised>,
    dropped: Option<u32>,
    decimation: u16,
    /// Since the last status.
    status: LinkStatus,
    status_at: Option<Stamp>,
}

impl Writer {
    /// Begins a recording of what can't be done again. Its file has its name from the first checkpoint on that has an entry in
    /// it; what had that name before, which `force` allows, stays until then.
    ///
    /// # Errors
    /// The file is there already, without `force`, or can't be written.
    pub fn create(path: &Path, force: bool) -> Result<Self, RecordingError> {
        Self::new(path, force, Named::AtTheFirstEntry)
    }

    /// Begins a recording whose file has its name once it is finished.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub fn create_whole(path: &Path, force: bool) -> Result<Self, RecordingError> {
        Self::new(path, force, Named::WhenFinished)
    }

    fn new(path: &Path, force: bool, named: Named) -> Result<Self, RecordingError> {
        let file = WholeFile::new(NewFile::create(path, force)?);
        let gathered = Gathered::default();
        let mcap = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .profile(PROFILE)
            .library(LIBRARY)
            // Chunks end at checkpoints.
            .chunk_size(None)
            // Chunks are put together in memory: nothing that was written is touched again.
            .disable_seeking(true)
            .create(gathered.clone())?;
        let mut writer = Self {
            path: path.into(),
            file,
            named,
            mcap: Some(mcap),
            gathered,
            devices: Vec::new(),
            counts: BTreeMap::new(),
            extra_channels: 0,
            schemas: Vec::new(),
            pending: 0,
            since: None,
            records: 0,
            span: None,
            saved: Saved::default(),
            failure: None,
            buffer: Vec::new(),
        };
        writer.preamble()?;
        Ok(writer)
    }

    /// Writes the records that make the file describe itself.
    fn preamble(&mut self) -> Result<(), RecordingError> {
        let metadata = BTreeMap::from([
            ("format".to_owned(), FORMAT.to_string()),
            ("interface_version".to_owned(), INTERFACE_VERSION.to_string()),
            ("host_version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ]);
        let signals = serde_json::to_vec_pretty(&schema::signal_table()).unwrap_or_default();
        self.describe(metadata)?;
        self.mcap()?.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: SIGNALS.into(),
            media_type: "application/json".into(),
            data: Cow::Owned(signals),
        })?;
        self.checkpoint()
    }

    /// Adds a device. Its name is the first part of its topics: letters, digits, `-` and `_`.
    pub fn add_device(&mut self, name: &str) -> Device {
        self.devices.push(Recorded {
            name: name.into(),
            track: Track::new(self.devices.len()),
            joint_names: Vec::new(),
            tick_channel: None,
            baud: None,
            announced: false,
            mode: None,
            fault: None,
            dropped: None,
            decimation: 0,
            status: LinkStatus::default(),
            status_at: None,
        });
        Device(self.devices.len() - 1)
    }

    /// A session of a device begins.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn about(&mut self, device: Device, at: Stamp, about: &About) -> Result<(), RecordingError> {
        let json = serde_json::to_string(about).unwrap_or_default();
        self.write_twice(device, Kind::About, at, json)?;
        let joint_names: Vec<String> = (0..about.joints())
            .map(|k| about.joint_names.get(k).cloned().unwrap_or_else(|| format!("joint{}", k + 1)))
            .collect();
        let name = self.devices[device.0].name.clone();
        let channel = self.tick_channel(device, &name, &about.hand, &joint_names)?;
        let recorded = &mut self.devices[device.0];
        recorded.track.about(about);
        recorded.joint_names = joint_names;
        recorded.tick_channel = Some(channel);
        recorded.baud = about.baud;
        (recorded.mode, recorded.fault) = (None, None);
        let words = format!(
            "session: blindgrasp {} ({:08x}), image `{}` for the hand `{}` ({:08x}), interface {}{}",
            about.firmware_version,
            about.build_hash,
            about.image,
            about.hand,
            about.hand_hash,
            about.interface_version,
            about.port.as_ref().map_or(String::new(), |port| format!(", port {port}")),
        );
        self.log(device, at, Level::Info, "session", &words)?;
        if let Some(crash) = &about.crash {
            self.log(device, at, Level::Error, "session", &format!("the device crashed before: {crash}"))?;
        }
        self.settle(at)
    }

    /// The parameters in force: all of them at the beginning of a session, changed ones later.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn parameters(
        &mut self,
        device: Device,
        at: Stamp,
        values: &[Setting],
    ) -> Result<(), RecordingError> {
        self.write_twice(device, Kind::Parameters, at, Setting::to_json(values).to_string())?;
        self.devices[device.0].track.parameters(values);
        self.settle(at)
    }

    /// The payload of a frame that was sent.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn sent(&mut self, device: Device, at: Stamp, payload: &[u8]) -> Result<(), RecordingError> {
        self.write(device, Kind::Sent, at, payload)?;
        self.settle(at)
    }

    /// The payload of a good frame that came. A record is written decoded, too; so is, as an event, what it tells of mode,
    /// fault and commands.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn received(&mut self, device: Device, at: Stamp, payload: &[u8]) -> Result<Arrival, RecordingError> {
        self.write(device, Kind::Received, at, payload)?;
        let recorded = &mut self.devices[device.0];
        let arrival = recorded.track.hear(payload, at);
        recorded.status.frames += 1;
        // Blocks of 254 bytes; nearly every payload is shorter than one.
        recorded.status.bytes += most_bytes(payload.len()) as u64;
        match &arrival {
            Arrival::Record(decoded) => self.tick(device, decoded)?,
            &Arrival::Input { lost_before, at, answer } => {
                self.records += 1;
                recorded.status.records += 1;
                recorded.status.inputs += 1;
                recorded.status.missing += lost_before;
                self.answer(device, at, answer)?;
            }
            Arrival::Reply => {}
            Arrival::Unusable => recorded.status.unusable += 1,
        }
        self.settle(at)?;
        Ok(arrival)
    }

    fn tick(&mut self, device: Device, decoded: &Decoded) -> Result<(), RecordingError> {
        self.records += 1;
        let recorded = &mut self.devices[device.0];
        let record = &decoded.record;
        recorded.status.records += 1;
        recorded.status.missing += decoded.lost_before;
        let before = recorded.dropped.replace(record.dropped).unwrap_or(record.dropped);
        // A counter that is smaller than before has started anew with its device.
        let dropped = record.dropped.checked_sub(before).unwrap_or(record.dropped);
        recorded.status.dropped += u64::from(dropped);
        recorded.decimation = decoded.decimation();
        if let Some(channel) = recorded.tick_channel {
            let mut buffer = std::mem::take(&mut self.buffer);
            buffer.clear();
            write_tick(decoded, &self.devices[device.0].joint_names, &mut buffer);
            let written = self.write_to(channel, decoded.at, &buffer);
            self.buffer = buffer;
            written?;
        }
        let recorded = &mut self.devices[device.0];
        let mode = recorded.mode.replace(record.mode);
        let fault = std::mem::replace(&mut recorded.fault, record.fault);
        if mode != Some(record.mode) {
            self.log(device, decoded.at, Level::Info, "mode", &format!("mode: {}", record.mode.words()))?;
        }
        if fault != record.fault {
            match record.fault {
                Some(raised) => {
                    let words = self.in_words(device, raised);
                    self.log(device, decoded.at, Level::Error, "fault", &words)?;
                }
                None => self.log(device, decoded.at, Level::Info, "fault", "the fault is cleared")?,
            }
        }
        self.answer(device, decoded.at, record.answer)
    }

    /// Tells what became of a tick's command.
    fn answer(&mut self, device: Device, at: Stamp, answer: Option<Answer>) -> Result<(), RecordingError> {
        let Some(answer) = answer else { return Ok(()) };
        let level = if answer.refused.is_some() { Level::Warning } else { Level::Info };
        self.log(device, at, level, "answer", &answer.to_string())
    }

    fn in_words(&self, device: Device, raised: Raised) -> String {
        let names = &self.devices[device.0].joint_names;
        let joint = raised.joint.and_then(|joint| names.get(usize::from(joint)));
        let joint = joint.map_or(String::new(), |name| format!("joint `{name}`: "));
        let fault = raised.fault;
        format!("fault {}: {joint}{}: {}", fault.number(), fault.words(), fault.remedy())
    }

    /// Frames came damaged.
    pub fn damaged(&mut self, device: Device, frames: u64) {
        self.devices[device.0].status.damaged += frames;
    }

    /// Something happened that neither records nor sessions tell.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn event(
        &mut self,
        device: Device,
        at: Stamp,
        level: Level,
        words: &str,
    ) -> Result<(), RecordingError> {
        self.log(device, at, level, "event", words)?;
        self.settle(at)
    }

    /// The link was cut. What comes after has no connexion with what came before.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn gap(&mut self, device: Device, at: Stamp, words: &str) -> Result<(), RecordingError> {
        let recorded = &mut self.devices[device.0];
        recorded.track.restart();
        (recorded.mode, recorded.fault) = (None, None);
        self.log(device, at, Level::Warning, GAP, words)?;
        self.settle(at)
    }

    /// Writes and returns what became of the link since the last time; meant for every second.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn link(&mut self, device: Device, at: Stamp) -> Result<LinkStatus, RecordingError> {
        let recorded = &mut self.devices[device.0];
        let mut status = std::mem::take(&mut recorded.status);
        let since = recorded.status_at.replace(at).unwrap_or(at);
        status.seconds_s = at.0.saturating_sub(since.0) as f64 / 1e9;
        status.decimation = recorded.decimation.into();
        status.rate_hz = if status.seconds_s > 0.0 { status.records as f64 / status.seconds_s } else { 0.0 };
        status.share = match recorded.baud {
            Some(baud) if status.seconds_s > 0.0 => {
                BITS_A_BYTE * status.bytes as f64 / (f64::from(baud) * status.seconds_s)
            }
            _ => f64::NAN,
        };
        self.write(device, Kind::Link, at, &status.write())?;
        self.settle(at)?;
        Ok(status)
    }

    /// Puts everything into the file, which is whole then. It is done by itself every half a second of entries; where
    /// none come, somebody has to call this.
    ///
    /// # Errors
    /// The recording has stopped, or stops now.
    pub fn checkpoint(&mut self) -> Result<(), RecordingError> {
        self.mcap()?.flush()?;
        let mut bytes = self.gathered.take();
        if !bytes.is_empty() {
            let added = self.file.add(&mut bytes);
            self.gathered.give_back(bytes);
            added.map_err(|error| self.stop(&error))?;
            if self.named == Named::AtTheFirstEntry && self.span.is_some() {
                self.publish()?;
            }
            self.saved = self.reached();
        }
        (self.pending, self.since) = (0, None);
        Ok(())
    }

    /// Returns `true` if nothing was recorded so far.
    pub fn is_empty(&self) -> bool {
        self.span.is_none()
    }

    /// Returns the contents of the file; of one that has no name yet, nothing.
    pub fn saved(&self) -> Saved {
        self.saved
    }

    /// Ends the recording with a summary and an index, by which viewers find their way at once.
    ///
    /// # Errors
    /// The recording has stopped, or there is no room for the index.
    pub fn finish(mut self) -> Result<Saved, RecordingError> {
        self.end()?;
        Ok(self.saved)
    }

    fn end(&mut self) -> Result<(), RecordingError> {
        self.checkpoint()?;
        let Some(mut mcap) = self.mcap.take() else { return Ok(()) };
        mcap.finish()?;
        let bytes = self.gathered.take();
        self.file.end(&bytes).and_then(|()| self.file.sync()).map_err(|error| self.stop(&error))?;
        self.publish()?;
        self.saved = self.reached();
        Ok(())
    }

    fn publish(&mut self) -> Result<(), RecordingError> {
        if self.file.is_published() {
            return Ok(());
        }
        self.file.publish().inspect_err(|error| {
            self.failure = Some(Failure { problem: error.to_string() });
        })?;
        Ok(())
    }

    /// Returns the contents of the file, if all that was gathered is in it.
    fn reached(&self) -> Saved {
        let seconds = self.span.map_or(0.0, |(first, last)| last.0.saturating_sub(first.0) as f64 / 1e9);
        let bytes = if self.file.is_published() { self.file.length() } else { 0 };
        Saved { bytes, records: self.records, seconds }
    }

    fn stop(&mut self, error: &io::Error) -> RecordingError {
        let failure = Failure { problem: error.to_string() };
        let told = self.stopped(&failure);
        self.failure = Some(failure);
        told
    }

    fn stopped(&self, failure: &Failure) -> RecordingError {
        let problem = failure.problem.clone();
        RecordingError::Stopped { path: self.path.clone(), problem, saved: self.saved }
    }

    fn mcap(&mut self) -> Result<&mut ::mcap::Writer<Gathered>, RecordingError> {
        if let Some(failure) = &self.failure {
            return Err(self.stopped(failure));
        }
        self.mcap.as_mut().ok_or(RecordingError::Format(::mcap::McapError::AttemptedWriteAfterFailure))
    }

    fn log(
        &mut self,
        device: Device,
        at: Stamp,
        level: Level,
        name: &str,
        words: &str,
    ) -> Result<(), RecordingError> {
        self.write(device, Kind::Event, at, &write_event(at, level, name, words))
    }

    /// Adds metadata, with its checksum.
    fn describe(&mut self, mut metadata: BTreeMap<String, String>) -> Result<(), RecordingError> {
        let seal = seal(&metadata);
        metadata.insert("crc".into(), seal);
        let name = metadata_name(&metadata);
        Ok(self.mcap()?.write_metadata(&Metadata { name, metadata })?)
    }

    /// Adds a message that everything after it hangs on: also as metadata, which ends the chunk before.
    fn write_twice(
        &mut self,
        device: Device,
        kind: Kind,
        at: Stamp,
        json: String,
    ) -> Result<(), RecordingError> {
        let channel = kind.channel(device);
        self.describe(BTreeMap::from([
            (twin::DEVICE.to_owned(), self.devices[device.0].name.clone()),
            (twin::CHANNEL.to_owned(), channel.to_string()),
            (twin::SEQUENCE.to_owned(), self.counts.get(&channel).copied().unwrap_or(0).to_string()),
            (twin::TIME_NS.to_owned(), at.0.to_string()),
            (twin::JSON.to_owned(), json.clone()),
        ]))?;
        self.write(device, kind, at, json.as_bytes())
    }

    /// Adds a message to one of a device's own channels.
    fn write(&mut self, device: Device, kind: Kind, at: Stamp, data: &[u8]) -> Result<(), RecordingError> {
        if !self.devices[device.0].announced {
            self.announce()?;
        }
        self.write_to(kind.channel(device), at, data)
    }

    /// Makes a checkpoint if it is time: between entries, never within what belongs together.
    fn settle(&mut self, at: Stamp) -> Result<(), RecordingError> {
        let since = self.since.get_or_insert(at);
        if at.0.saturating_sub(since.0) >= CHECKPOINT_NS || self.pending >= CHECKPOINT_BYTES {
            self.checkpoint()?;
        }
        Ok(())
    }

    fn write_to(&mut self, channel_id: u16, at: Stamp, data: &[u8]) -> Result<(), RecordingError> {
        let sequence = self.counts.entry(channel_id).or_insert(0);
        let header = MessageHeader { channel_id, sequence: *sequence, log_time: at.0, publish_time: at.0 };
        *sequence = sequence.wrapping_add(1);
        self.mcap()?.write_to_known_channel(&header, data)?;
        self.pending += data.len();
        self.span = Some(match self.span {
            None => (at, at),
            Some((first, last)) => (first.min(at), last.max(at)),
        });
        Ok(())
    }

    /// Writes the channels of all devices that have none yet.
    fn announce(&mut self) -> Result<(), RecordingError> {
        for k in 0..self.devices.len() {
            if std::mem::replace(&mut self.devices[k].announced, true) {
                continue;
            }
            let name = self.devices[k].name.clone();
            let mcap = self.mcap()?;
            for kind in CHANNELS.into_iter().filter(|&kind| kind != Kind::Tick) {
                let (schema, encoding) = match schema::of_kind(kind) {
                    None => (0, PROFILE),
                    Some((name, encoding, data)) => {
                        (mcap.add_schema(&name, encoding, &data)?, schema::encoding(encoding))
                    }
                };
                let topic = kind.topic(&name);
                mcap.add_channel_with_id(
                    kind.channel(Device(k)),
                    schema,
                    &topic,
                    encoding,
                    &BTreeMap::new(),
                )?;
            }
        }
        Ok(())
    }

    /// The channel of a hand's ticks.
    fn tick_channel(
        &mut self,
        device: Device,
        name: &str,
        hand: &str,
        joint_names: &[String],
    ) -> Result<u16, RecordingError> {
        let (schema_name, data) = schema::of_hand(hand, joint_names);
        // Two hands of one name and different joints: viewers know a schema by its name.
        let same = self.schemas.iter().filter(|(other, _)| *other == schema_name).collect::<Vec<_>>();
        let known = same.iter().position(|(_, other)| *other == data);
        let (schema_name, data) = match known.unwrap_or(same.len()) {
            0 => (schema_name, data),
            k => schema::of_hand(&format!("{hand}_{}", k + 1), joint_names),
        };
        if known.is_none() {
            self.schemas.push(schema::of_hand(hand, joint_names));
        }
        let extra = self.extra_channels;
        let mcap = self.mcap()?;
        let schema = mcap.add_schema(&schema_name, "protobuf", &data)?;
        let topic = Kind::Tick.topic(name);
        let wanted = Kind::Tick.channel(device);
        let none = BTreeMap::new();
        match mcap.add_channel_with_id(wanted, schema, &topic, "protobuf", &none) {
            // The device had another hand before.
            Err(::mcap::McapError::ConflictingChannels(_)) => {
                let channel =
                    mcap.add_channel_with_id(u16::MAX - extra, schema, &topic, "protobuf", &none)?;
                self.extra_channels += 1;
                Ok(channel)
            }
            channel => Ok(channel?),
        }
    }
}

/// Name of the events that are gaps.
pub(super) const GAP: &str = "gap";

impl Drop for Writer {
    fn drop(&mut self) {
        // Whoever wants to know calls `finish`. What is not to be seen before its end is not finished by chance.
        if self.failure.is_none() && self.file.is_published() {
            let _ = self.end();
        }
    }
}

/// The bytes that MCAP's writer wrote and the file has not got yet.
#[derive(Clone, Default)]
struct Gathered {
    bytes: Arc<Mutex<Vec<u8>>>,
    position: u64,
}

impl Gathered {
    fn take(&self) -> Vec<u8> {
        std::mem::take(&mut *self.bytes.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// A buffer for the next time.
    fn give_back(&self, mut bytes: Vec<u8>) {
        bytes.clear();
        *self.bytes.lock().unwrap_or_else(PoisonError::into_inner) = bytes;
    }
}

impl Write for Gathered {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        self.position += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Only to ask where it is.
impl Seek for Gathered {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Current(0) => Ok(self.position),
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}
