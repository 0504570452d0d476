//! Replies and records to frames, on the device's side.

use super::frame::{Writer, encode};
use super::message::{Reply, Signals};
use crate::bytes::BufferTooSmall;
use crate::telemetry::Record;
use crate::telemetry::dense::{self, Encoder};

/// Makes frames, and remembers of the records that were sent what dense ones go on from.
#[derive(Clone, Debug)]
pub struct Sender<const J: usize> {
    encoder: Encoder<J>,
}

impl<const J: usize> Sender<J> {
    /// Nothing was sent.
    pub const fn new() -> Self {
        Self { encoder: Encoder::new() }
    }

    /// A frame of anything but a record of the telemetry; returns the part of the buffer that it takes up.
    ///
    /// # Errors
    /// If the buffer is too small; [`most_bytes`](super::most_bytes) of [`Reply::MOST_BYTES`] always suffice.
    pub fn reply<'b>(
        &mut self,
        reply: &Reply<'_, J>,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], BufferTooSmall> {
        encode(reply, buffer)
    }

    /// A frame of a record with these signals, dense where they say so and what was sent before allows it.
    ///
    /// # Errors
    /// As [`Self::reply`].
    pub fn record<'b>(
        &mut self,
        record: &Record<J>,
        signals: Signals,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], BufferTooSmall> {
        let mut record = record.clone();
        record.keep(signals);
        match self.encoder.next(&record, signals) {
            None => encode(&Reply::Record(record), buffer),
            Some(shape) => {
                let mut writer = Writer::new(buffer);
                dense::write(&record, shape, |byte| writer.push(byte)).map_err(|_| BufferTooSmall)?;
                writer.finish().map_err(|_| BufferTooSmall)
            }
        }
    }
}

impl<const J: usize> Default for Sender<J> {
    fn default() -> Self {
        Self::new()
    }
}
