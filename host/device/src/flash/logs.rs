//! Logs of a firmware: defmt frames, decoded with the table in its ELF file.

use anyhow::{Context, anyhow};
use blindgrasp_wire::printable;
use defmt_decoder::{DecodeError, Locations, StreamDecoder, Table};
use std::fmt;
use std::path::Path;

/// The tables that decode the logs of one build.
pub struct Logs {
    table: Table,
    locations: Locations,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// Time that the firmware gives it.
    pub timestamp: Option<String>,
    /// `trace`, `debug`, `info`, `warn` or `error`; nothing for what is only printed.
    pub level: Option<&'static str>,
    /// File and line of the source.
    pub location: Option<String>,
    /// The message.
    pub message: String,
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(timestamp) = &self.timestamp {
            write!(f, "{} ", printable(timestamp))?;
        }
        write!(f, "{:<5} ", self.level.unwrap_or("print"))?;
        if let Some(location) = &self.location {
            write!(f, "{location}: ")?;
        }
        f.write_str(&printable(&self.message))
    }
}

impl Logs {
    /// Reads the table of an ELF file.
    ///
    /// # Errors
    /// If it has none.
    pub fn parse(elf: &[u8]) -> anyhow::Result<Self> {
        let told = |error: anyhow::Error| {
            let reason = format!("{error:#}").replace('\n', "; ");
            anyhow!("the defmt logs of this image cannot be decoded: {reason}")
        };
        let table = Table::parse(elf)
            .map_err(told)?
            .context("this image has no defmt logs; build it with them, or leave out --monitor")?;
        // Without debug information there are none: lines are then shown without.
        let locations = table.get_locations(elf).unwrap_or_default();
        Ok(Self { table, locations })
    }

    /// A decoder at the start of a stream.
    pub fn decoder(&self) -> Decoder<'_> {
        Decoder { logs: self, stream: self.table.new_stream_decoder(), damaged_frames: 0 }
    }
}

/// Decodes a stream of frames.
pub struct Decoder<'a> {
    logs: &'a Logs,
    stream: Box<dyn StreamDecoder + Send + Sync + 'a>,
    damaged_frames: u64,
}

impl Decoder<'_> {
    /// Takes bytes as they come, and hands out the lines that they complete. Frames that are damaged, as when the firmware
    /// logs faster than the probe reads, are left out and counted.
    pub fn push(&mut self, bytes: &[u8], mut show: impl FnMut(Line)) {
        self.stream.received(bytes);
        loop {
            match self.stream.decode() {
                Ok(frame) => show(Line {
                    timestamp: frame.display_timestamp().map(|timestamp| timestamp.to_string()),
                    level: frame.level().map(|level| level.as_str()),
                    location: self
                        .logs
                        .locations
                        .get(&frame.index())
                        .map(|place| format!("{}:{}", short(&place.file), place.line)),
                    message: frame.display_message().to_string(),
                }),
                Err(DecodeError::UnexpectedEof) => return,
                Err(DecodeError::Malformed) => {
                    self.damaged_frames += 1;
                    if !self.logs.table.encoding().can_recover() {
                        // Where the next frame starts cannot be known: wait for what comes next.
                        self.stream = self.logs.table.new_stream_decoder();
                        return;
                    }
                }
            }
        }
    }

    /// Frames that could not be decoded.
    pub fn damaged_frames(&self) -> u64 {
        self.damaged_frames
    }
}

/// A source file, without the path of the repository.
fn short(file: &Path) -> String {
    let here = std::env::current_dir().ok();
    here.and_then(|here| file.strip_prefix(here).ok()).unwrap_or(file).display().to_string()
}
