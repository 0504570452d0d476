//! Reading a recording, from the beginning to the end, in constant memory.

use super::about::{About, Setting};
use super::error::RecordingError;
use super::message::{Level, LinkStatus, read_event};
use super::salvage::{Piece, Pieces, string};
use super::writer::GAP;
use super::{CHANNELS, Device, FORMAT, Kind, PROFILE, Stamp, twin};
use ::mcap::records::op;
use blindgrasp_files as files;
use std::collections::{BTreeMap, HashMap, VecDeque};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::str::FromStr;

pub use super::salvage::{Damage, Place};

/// Most bytes of a summary.
const MOST_SUMMARY: u64 = 64 << 20;
/// Bytes of a footer with the magic behind it.
const FOOTER: u64 = 37;

/// Something that was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The device.
    pub device: usize,
    /// The time; of a tick, when it was, of all else, when it came or happened.
    pub at: Stamp,
    /// The content.
    pub what: What,
}

/// The content of an entry.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// A session begins: who the device is.
    About(Box<About>),
    /// Parameters in force: all, or those that changed.
    Parameters(Vec<Setting>),
    /// Payload of a frame that came.
    Received(Vec<u8>),
    /// Payload of a frame that was sent.
    Sent(Vec<u8>),
    /// Something happened.
    Event {
        /// Its severity.
        level: Level,
        /// The subject: `session`, `mode`, `fault`, `answer`, or `event`.
        about: String,
        /// The words.
        words: String,
    },
    /// The link was cut here.
    Gap {
        /// The reason.
        words: String,
    },
    /// The status of the link.
    Link(LinkStatus),
    /// The file is damaged: entries of the kind that follows are missing here. Not recorded, but found out.
    Hole {
        /// The number of records that are missing.
        lost: u64,
    },
    /// A tick, decoded by the program that recorded, as its protobuf message. Only where it is asked for.
    Tick(Vec<u8>),
}

/// A recording.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    library: String,
    channels: Channels,
    span: Option<(Stamp, Stamp)>,
    summary: Option<Summary>,
    ticks: bool,
}

impl Recording {
    /// Opens a file and looks what it is.
    ///
    /// # Errors
    /// It is not a recording, or one of a newer format, or can't be read at all.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let unreadable = |source| RecordingError::Io { action: "read", path: path.into(), source };
        let mut file = files::open(path).map_err(unreadable)?;
        let mut magic = Vec::new();
        (&mut file).take(::mcap::MAGIC.len() as u64).read_to_end(&mut magic).map_err(unreadable)?;
        if magic != ::mcap::MAGIC {
            return Err(RecordingError::NotMcap { path: path.into() });
        }
        let mut pieces = Pieces::new(file).map_err(unreadable)?;
        let mut channels = Channels::default();
        let mut writer = None;
        let mut ours = false;
        while let Some(piece) = pieces.next().map_err(unreadable)? {
            match piece {
                Piece::Header { profile, library } => {
                    ours |= profile == PROFILE;
                    channels.fixed |= profile == PROFILE;
                    writer = Some(library);
                }
                Piece::Metadata(metadata) => {
                    (ours, channels.fixed) = (true, true);
                    channels.take_twin(&metadata);
                    let theirs = metadata.get("format").and_then(|format| format.parse().ok()).unwrap_or(0);
                    if theirs > FORMAT {
                        let version = metadata.get("host_version").map_or("?", String::as_str);
                        return Err(RecordingError::Newer {
                            path: path.into(),
                            theirs,
                            library: format!("blindgrasp {version}"),
                            ours: FORMAT,
                        });
                    }
                }
                Piece::Attachment(_) => {}
                // Who says clearly to be somebody else is.
                Piece::Chunk if writer.is_some() && !ours => break,
                Piece::Chunk => {
                    while let Some((kind, content)) = pieces.inner() {
                        if kind == op::CHANNEL {
                            channels.take(content);
                        }
                    }
                    if !channels.names.is_empty() {
                        ours = true;
                        break;
                    }
                }
            }
        }
        let library = writer.unwrap_or_default();
        if !ours {
            return Err(RecordingError::NotARecording { path: path.into(), library });
        }
        let mut file = files::open(path).map_err(unreadable)?;
        let summary = Summary::read(&mut file).map_err(unreadable)?;
        if let Some(summary) = &summary {
            summary.channels.iter().for_each(|channel| channels.take(channel));
        }
        let span = match summary.as_ref().and_then(|summary| summary.span) {
            Some(span) => Some(span),
            None => span_of_chunks(&mut file).map_err(unreadable)?,
        };
        channels.sort();
        Ok(Self { path: path.into(), library, channels, span, summary, ticks: false })
    }

    /// Names of the devices; [`Entry::device`] counts them.
    pub fn devices(&self) -> &[String] {
        &self.channels.names
    }

    /// Returns its file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn channels(&self) -> &Channels {
        &self.channels
    }

    /// Returns the library that wrote it.
    pub fn library(&self) -> &str {
        &self.library
    }

    /// From the first to the last entry, as the file says; where it is damaged, that may be wrong. `None` if nothing is in
    /// it.
    pub fn span(&self) -> Option<(Stamp, Stamp)> {
        self.span
    }

    /// Returns the number of payloads that were received from all devices, where the file says so: one that was
    /// finished does.
    pub fn received(&self) -> Option<u64> {
        let counts = &self.summary.as_ref()?.counts;
        let received = counts.iter().filter(|(channel, _)| {
            Kind::of_channel(**channel).is_some_and(|(_, kind)| kind == Kind::Received)
        });
        Some(received.map(|(_, count)| count).sum())
    }

    /// Returns `true` if it was finished: what was killed, or is still recorded, was not.
    pub fn is_finished(&self) -> bool {
        self.summary.is_some()
    }

    /// Gives the ticks as they were decoded while recording, too; they follow from what was received.
    #[must_use]
    pub fn with_ticks(self) -> Self {
        Self { ticks: true, ..self }
    }

    /// Everything, in the order in which it was recorded.
    ///
    /// # Errors
    /// The file can't be read any more.
    pub fn entries(&self) -> Result<Entries, RecordingError> {
        let unreadable = |source| RecordingError::Io { action: "read", path: self.path.clone(), source };
        let pieces = files::open(&self.path).and_then(Pieces::new).map_err(unreadable)?;
        Ok(Entries {
            path: self.path.clone(),
            pieces,
            channels: self.channels.clone(),
            expected: self.summary.as_ref().map(|summary| summary.counts.clone()),
            next: HashMap::new(),
            waiting: VecDeque::new(),
            ticks: self.ticks,
            state: State::Between,
        })
    }
}

/// The channels of a file.
#[derive(Clone, Debug, Default)]
pub(super) struct Channels {
    names: Vec<String>,
    by_name: HashMap<String, usize>,
    known: HashMap<u16, (usize, Kind)>,
    /// `true` if our own writer gave the numbers, so that a channel can be known by its number alone.
    fixed: bool,
}

impl Channels {
    /// Takes the record of a channel; what is none of ours is left out.
    pub(super) fn take(&mut self, record: &[u8]) {
        let _ = self.try_take(record);
    }

    fn try_take(&mut self, record: &[u8]) -> Option<()> {
        let (&[a, b, _, _], mut rest) = record.split_first_chunk()?;
        let (topic, encoding) = (string(&mut rest)?, string(&mut rest)?);
        let (name, kind) = Kind::of_topic(topic)?;
        if matches!(kind, Kind::Received | Kind::Sent) && encoding != PROFILE {
            return None;
        }
        let device = self.device(name);
        self.known.insert(u16::from_le_bytes([a, b]), (device, kind));
        Some(())
    }

    fn device(&mut self, name: &str) -> usize {
        if let Some(&device) = self.by_name.get(name) {
            return device;
        }
        self.by_name.insert(name.to_owned(), self.names.len());
        self.names.push(name.to_owned());
        self.names.len() - 1
    }

    /// Brings the devices into the order of their channels: that in which they were named, whichever answered first.
    fn sort(&mut self) {
        let mut lowest = vec![u16::MAX; self.names.len()];
        for (&number, &(device, _)) in &self.known {
            lowest[device] = lowest[device].min(number);
        }
        let mut order: Vec<usize> = (0..self.names.len()).collect();
        order.sort_by_key(|&device| lowest[device]);
        let mut place = vec![0; order.len()];
        for (now, &before) in order.iter().enumerate() {
            place[before] = now;
        }
        self.names = order.iter().map(|&device| self.names[device].clone()).collect();
        self.by_name = self.names.iter().cloned().zip(0..).collect();
        self.known.values_mut().for_each(|(device, _)| *device = place[*device]);
    }

    /// Takes the channels of the device that a message's twin is about, and gives the message.
    pub(super) fn take_twin(&mut self, metadata: &BTreeMap<String, String>) -> Option<Numbered> {
        fn number<T: FromStr>(metadata: &BTreeMap<String, String>, key: &str) -> Option<T> {
            metadata.get(key)?.parse().ok()
        }
        let channel = number(metadata, twin::CHANNEL)?;
        let (numbered, kind) = Kind::of_channel(channel)?;
        let device = self.device(metadata.get(twin::DEVICE)?);
        for kind in CHANNELS {
            self.known.entry(kind.channel(Device(numbered))).or_insert((device, kind));
        }
        let what = what(kind, metadata.get(twin::JSON)?.as_bytes(), false);
        let (sequence, at) = (number(metadata, twin::SEQUENCE)?, Stamp(number(metadata, twin::TIME_NS)?));
        Some(Numbered { channel, sequence, device, kind, at, what })
    }

    /// Name of a device.
    pub(super) fn name(&self, device: usize) -> Option<&str> {
        self.names.get(device).map(String::as_str)
    }

    pub(super) fn of(&self, number: u16) -> Option<(usize, Kind)> {
        self.known.get(&number).copied().or_else(|| {
            Kind::of_channel(number).filter(|&(device, _)| self.fixed && device < self.names.len().max(1))
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Between,
    InChunk,
    Ended,
}

/// The entries of a recording. Where the file is damaged they go on behind the damage; an error ends them.
pub struct Entries {
    path: PathBuf,
    pieces: Pieces,
    channels: Channels,
    /// Messages a channel has, as the summary says, if there is one.
    expected: Option<HashMap<u16, u64>>,
    /// Number of each channel's next message.
    next: HashMap<u16, u32>,
    waiting: VecDeque<Entry>,
    ticks: bool,
    state: State,
}

impl Entries {
    /// Returns the damage of the file up to here; all of it when they have ended.
    pub fn damage(&self) -> &Damage {
        self.pieces.damage()
    }

    /// Returns the position in the file, bytes, and its length.
    pub fn position(&self) -> (u64, u64) {
        self.pieces.position()
    }

    /// The next entry.
    fn step(&mut self) -> io::Result<Option<Entry>> {
        loop {
            if let Some(entry) = self.waiting.pop_front() {
                return Ok(Some(entry));
            }
            match self.state {
                State::Ended => return Ok(None),
                State::Between => match self.pieces.next()? {
                    Some(Piece::Chunk) => self.state = State::InChunk,
                    Some(Piece::Metadata(metadata)) => {
                        let message = self.channels.take_twin(&metadata);
                        self.take(message);
                    }
                    Some(Piece::Header { .. } | Piece::Attachment(_)) => {}
                    None => {
                        self.count_end();
                        self.state = State::Ended;
                    }
                },
                State::InChunk => match self.pieces.inner() {
                    None => self.state = State::Between,
                    Some((op::CHANNEL, content)) => self.channels.take(content),
                    Some((op::MESSAGE, content)) => {
                        let message = message(content, &self.channels, self.ticks);
                        self.take(message);
                    }
                    Some(_) => {}
                },
            }
        }
    }

    fn take(&mut self, message: Option<Numbered>) {
        let Some(Numbered { channel, sequence, device, kind, at, what }) = message else { return };
        let next = self.next.entry(channel).or_insert(0);
        let ahead = sequence.wrapping_sub(*next);
        let damage = self.pieces.damage_mut();
        if ahead >= 1 << 31 {
            // What stands twice is there twice.
            damage.repeated += u64::from(!matches!(kind, Kind::About | Kind::Parameters));
            return;
        }
        *next = sequence.wrapping_add(1);
        if kind == Kind::Tick && !self.ticks {
            return;
        }
        if ahead > 0 {
            damage.lost += u64::from(ahead);
            self.waiting.push_back(Entry { device, at, what: What::Hole { lost: ahead.into() } });
        }
        match what {
            Some(what) => self.waiting.push_back(Entry { device, at, what }),
            None => damage.unreadable += 1,
        }
    }

    /// Counts what is missing at the end, where the summary tells how much there was.
    fn count_end(&mut self) {
        let Some(expected) = &self.expected else {
            self.pieces.damage_mut().unfinished = true;
            return;
        };
        for (&channel, &expected) in expected {
            let is_told = |(_, kind)| kind != Kind::Tick || self.ticks;
            if self.channels.of(channel).is_some_and(is_told) {
                let came = self.next.get(&channel).copied().unwrap_or(0);
                // The numbers wrap, the sum does not.
                let missing = (expected as u32).wrapping_sub(came);
                if missing < 1 << 31 {
                    self.pieces.damage_mut().lost += u64::from(missing);
                }
            }
        }
    }
}

impl Iterator for Entries {
    type Item = Result<Entry, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        match self.step() {
            Ok(entry) => entry.map(Ok),
            Err(source) => {
                self.state = State::Ended;
                self.waiting.clear();
                Some(Err(RecordingError::Io { action: "read", path: self.path.clone(), source }))
            }
        }
    }
}

/// A message of a channel of ours.
pub(super) struct Numbered {
    channel: u16,
    sequence: u32,
    device: usize,
    kind: Kind,
    at: Stamp,
    /// `None`: it can't be read.
    what: Option<What>,
}

fn message(content: &[u8], channels: &Channels, ticks: bool) -> Option<Numbered> {
    let (&[c, d], rest) = content.split_first_chunk()?;
    let (&sequence, rest) = rest.split_first_chunk()?;
    let (&at, rest) = rest.split_first_chunk()?;
    let (_, data) = rest.split_first_chunk::<8>()?;
    let channel = u16::from_le_bytes([c, d]);
    let (device, kind) = channels.of(channel)?;
    let what = what(kind, data, ticks);
    let (sequence, at) = (u32::from_le_bytes(sequence), Stamp(u64::from_le_bytes(at)));
    Some(Numbered { channel, sequence, device, kind, at, what })
}

/// A message's content; none if it can't be read.
fn what(kind: Kind, data: &[u8], ticks: bool) -> Option<What> {
    match kind {
        Kind::Received => Some(What::Received(data.to_vec())),
        Kind::Sent => Some(What::Sent(data.to_vec())),
        Kind::Tick => Some(What::Tick(if ticks { data.to_vec() } else { Vec::new() })),
        Kind::Event => read_event(data).map(|(level, about, words)| match about {
            GAP => What::Gap { words: words.into() },
            _ => What::Event { level, about: about.into(), words: words.into() },
        }),
        Kind::Link => LinkStatus::read(data).map(What::Link),
        Kind::About => serde_json::from_slice(data).ok().map(|about| What::About(Box::new(about))),
        Kind::Parameters => Setting::from_json(data).map(What::Parameters),
    }
}

/// The summary at the end of a file that was finished.
#[derive(Debug)]
struct Summary {
    channels: Vec<Vec<u8>>,
    counts: HashMap<u16, u64>,
    span: Option<(Stamp, Stamp)>,
}

impl Summary {
    /// Reads it, if there is one and its checksum is right.
    fn read(file: &mut File) -> io::Result<Option<Self>> {
        let length = file.seek(SeekFrom::End(0))?;
        let Some(footer_at) = length.checked_sub(FOOTER) else { return Ok(None) };
        file.seek(SeekFrom::Start(footer_at))?;
        let mut footer = [0; FOOTER as usize];
        file.read_exact(&mut footer)?;
        let number = |at: usize| footer[at..at + 8].try_into().map_or(0, u64::from_le_bytes);
        let start = number(9);
        let is_there = footer[0] == op::FOOTER
            && number(1) == 20
            && footer[29..] == *::mcap::MAGIC
            && (1..=footer_at).contains(&start)
            && footer_at - start <= MOST_SUMMARY;
        if !is_there {
            return Ok(None);
        }
        file.seek(SeekFrom::Start(start))?;
        let mut bytes = Vec::new();
        // The checksum covers the footer up to where itself stands.
        file.take(footer_at - start + 25).read_to_end(&mut bytes)?;
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes);
        if crc.to_le_bytes() != footer[25..29] {
            return Ok(None);
        }
        Ok(Self::parse(&bytes))
    }

    fn parse(mut bytes: &[u8]) -> Option<Self> {
        let mut summary = Self { channels: Vec::new(), counts: HashMap::new(), span: None };
        while bytes.first() != Some(&op::FOOTER) {
            let (&kind, rest) = bytes.split_first()?;
            let (&length, rest) = rest.split_first_chunk()?;
            let (content, rest) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(length)).ok()?)?;
            bytes = rest;
            match kind {
                op::CHANNEL => summary.channels.push(content.to_vec()),
                op::STATISTICS => {
                    let number = |at: usize| content.get(at..at + 8)?.try_into().ok().map(u64::from_le_bytes);
                    // Messages, schemas, channels, attachments, metadata, chunks; then the times, and a map's length.
                    let (messages, first, last) = (number(0)?, number(26)?, number(34)?);
                    summary.span = (messages > 0).then_some((Stamp(first), Stamp(last)));
                    for pair in content.get(46..)?.chunks_exact(10) {
                        let (channel, count) = pair.split_first_chunk()?;
                        let count = count.try_into().ok().map(u64::from_le_bytes)?;
                        summary.counts.insert(u16::from_le_bytes(*channel), count);
                    }
                }
                _ => {}
            }
        }
        Some(summary)
    }
}

/// First and last time, from the heads of the chunks, as far as they can be followed.
fn span_of_chunks(file: &mut File) -> io::Result<Option<(Stamp, Stamp)>> {
    let length = file.seek(SeekFrom::End(0))?;
    let mut at = ::mcap::MAGIC.len() as u64;
    let mut span: Option<(Stamp, Stamp)> = None;
    let mut head = [0; 25];
    while length.saturating_sub(at) >= head.len() as u64 {
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut head)?;
        let number = |at: usize| head[at..at + 8].try_into().map_or(0, u64::from_le_bytes);
        if !(1..op::DATA_END).contains(&head[0]) {
            break;
        }
        if head[0] == op::CHUNK && number(1) <= length - at {
            let (first, last) = (Stamp(number(9)), Stamp(number(17)));
            span = Some(span.map_or((first, last), |(a, b)| (a.min(first), b.max(last))));
        }
        at = at.saturating_add(9).saturating_add(number(1));
    }
    Ok(span)
}
