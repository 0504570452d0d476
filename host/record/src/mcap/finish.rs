//! Finishing a recording that its program did not finish: a copy, chunk by chunk, that ends with a summary.

use super::about::About;
use super::error::RecordingError;
use super::reader::{Channels, Recording};
use super::salvage::{Damage, Piece, Pieces};
use super::{Kind, PROFILE, metadata_name, schema, twin};
use ::mcap::records::{Metadata, Record, op};
use ::mcap::{Compression, WriteOptions, parse_record};
use blindgrasp_files::{self as files, NewFile, OutputError};
use std::collections::{BTreeMap, HashMap};
use std::io::{BufWriter, Write as _};
use std::path::Path;

/// The outcome for a recording that was to be finished.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Finished {
    /// Everything is in the file.
    Whole {
        /// Its length.
        bytes: u64,
    },
    /// Everything that could be read is in the file.
    Damaged {
        /// Its length.
        bytes: u64,
        /// The part that could not.
        damage: Damage,
    },
    /// It would have been replaced by one that has less in it, and is left as it is.
    Kept {
        /// The part that can't be read.
        damage: Damage,
    },
}

type Writer = ::mcap::Writer<BufWriter<NewFile>>;

/// Finishes a recording: to another file, which `force` allows to overwrite, or in its place.
///
/// # Errors
/// It is still being written; it can't be read; or what is written can't be.
pub fn finish(recording: &Recording, out: Option<&Path>, force: bool) -> Result<Finished, RecordingError> {
    let path = recording.path();
    if files::is_being_written(path) {
        return Err(OutputError::Busy(path.to_owned()).into());
    }
    let file = match out {
        Some(out) => NewFile::create(out, force)?,
        None => NewFile::in_place_of(path)?,
    };
    let unreadable = |source| RecordingError::Io { action: "read", path: path.to_owned(), source };
    let mut pieces = files::open(path).and_then(Pieces::new).map_err(unreadable)?;
    let writer = WriteOptions::new()
        .compression(Some(Compression::Lz4))
        .profile(PROFILE)
        .library(recording.library())
        .chunk_size(None)
        .disable_seeking(true)
        .create(BufWriter::new(file))?;
    let mut copy = Copy { writer, channels: recording.channels().clone(), abouts: HashMap::new() };
    while let Some(piece) = pieces.next().map_err(unreadable)? {
        match piece {
            Piece::Header { .. } => {}
            Piece::Metadata(metadata) => copy.describe(metadata)?,
            Piece::Attachment(attachment) => copy.writer.attach(&attachment)?,
            Piece::Chunk => {
                while let Some((kind, content)) = pieces.inner() {
                    copy.take(kind, content)?;
                }
                copy.writer.flush()?;
            }
        }
    }
    let damage = pieces.damage().clone();
    let is_whole = damage.places.iter().all(|place| place.until == pieces.position().1);
    if !is_whole && out.is_none() {
        return Ok(Finished::Kept { damage });
    }
    copy.writer.finish()?;
    let failed = |source| OutputError::Io { path: out.unwrap_or(path).to_owned(), source };
    let mut file = copy.writer.into_inner();
    file.flush().map_err(failed)?;
    let file = file.into_inner().map_err(|error| failed(error.into_error()))?;
    let bytes = file.file().metadata().map_err(failed)?.len();
    file.finish()?;
    Ok(if is_whole { Finished::Whole { bytes } } else { Finished::Damaged { bytes, damage } })
}

/// A copy under way.
struct Copy {
    writer: Writer,
    channels: Channels,
    /// Who the devices are, by their names.
    abouts: HashMap<String, About>,
}

impl Copy {
    fn describe(&mut self, metadata: BTreeMap<String, String>) -> Result<(), RecordingError> {
        if let (Some(device), Some(json)) = (metadata.get(twin::DEVICE), metadata.get(twin::JSON))
            && let Ok(about) = serde_json::from_slice(json.as_bytes())
        {
            self.abouts.insert(device.clone(), about);
        }
        self.channels.take_twin(&metadata);
        let name = metadata_name(&metadata);
        Ok(self.writer.write_metadata(&Metadata { name, metadata })?)
    }

    fn take(&mut self, kind: u8, content: &[u8]) -> Result<(), RecordingError> {
        if !matches!(kind, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return Ok(());
        }
        match parse_record(kind, content)? {
            Record::Schema { header, data } => {
                self.writer.add_schema_with_id(header.id, &header.name, &header.encoding, &data)?;
            }
            Record::Channel(channel) => {
                self.channels.take(content);
                self.writer.add_channel_with_id(
                    channel.id,
                    channel.schema_id,
                    &channel.topic,
                    &channel.message_encoding,
                    &channel.metadata,
                )?;
            }
            Record::Message { header, data } => match self.writer.write_to_known_channel(&header, &data) {
                Err(::mcap::McapError::UnknownChannel(..)) if self.introduce(header.channel_id)? => {
                    self.writer.write_to_known_channel(&header, &data)?;
                }
                Err(::mcap::McapError::UnknownChannel(..)) => {}
                written => written?,
            },
            _ => {}
        }
        Ok(())
    }

    /// Introduces a channel whose introduction is lost; says whether it is one of ours.
    fn introduce(&mut self, channel: u16) -> Result<bool, RecordingError> {
        let Some((device, kind)) = self.channels.of(channel) else { return Ok(false) };
        let Some(name) = self.channels.name(device).map(str::to_owned) else { return Ok(false) };
        let schema = match (kind, self.abouts.get(&name)) {
            (Kind::Tick, None) => return Ok(false),
            (Kind::Tick, Some(about)) => {
                let (name, data) = schema::of_hand(&about.hand, &about.joint_names);
                Some((name, "protobuf", data))
            }
            _ => schema::of_kind(kind),
        };
        let (schema, encoding) = match &schema {
            None => (0, PROFILE),
            Some((name, encoding, data)) => {
                (self.writer.add_schema(name, encoding, data)?, schema::encoding(encoding))
            }
        };
        let topic = kind.topic(&name);
        self.writer.add_channel_with_id(channel, schema, &topic, encoding, &BTreeMap::new())?;
        Ok(true)
    }
}
