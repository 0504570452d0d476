//! All that the tick remembers, as bytes: what a replay resumes from. And its way over the wire, in parts.
//!
//! The bytes are those of the numbers, the low byte first, in the order of [`State`](crate::tick::State), with as many
//! items as the hand has joints and fingertips. They belong to the interface version.

use super::List;
use crate::bytes::BufferTooSmall;
use serde::{Deserialize, Serialize};

/// Bytes of a part, at most.
pub const PART_BYTES: usize = 64;
/// Bytes of a snapshot for each joint of the capacity that suffice for every hand with no more fingertips than joints.
pub const BYTES_PER_JOINT: usize = 464;

/// A part of a snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// The state is that after this tick.
    pub tick: u32,
    /// The place of the bytes.
    pub offset: u16,
    /// Bytes of the whole snapshot.
    pub length: u16,
    /// The bytes.
    pub bytes: List<u8, PART_BYTES>,
}

/// The snapshot that a device sends.
#[derive(Clone, Debug)]
pub(crate) struct Outgoing<const J: usize> {
    bytes: [[u8; BYTES_PER_JOINT]; J],
    tick: u32,
    length: u16,
    sent: u16,
}

impl<const J: usize> Outgoing<J> {
    pub(crate) fn new() -> Self {
        Self { bytes: [[0; BYTES_PER_JOINT]; J], tick: 0, length: 0, sent: 0 }
    }

    /// Begins anew with what is written to the buffer; one that does not fit is none.
    pub(crate) fn begin<'b>(
        &'b mut self,
        tick: u32,
        save: impl FnOnce(&'b mut [u8]) -> Result<&'b mut [u8], BufferTooSmall>,
    ) {
        self.tick = tick;
        self.sent = 0;
        self.length = save(self.bytes.as_flattened_mut()).map_or(0, |bytes| bytes.len() as u16);
    }

    /// Forgets what is left.
    pub(crate) fn stop(&mut self) {
        self.sent = self.length;
    }

    /// Returns `true` if all of it was taken.
    pub(crate) fn is_over(&self) -> bool {
        self.sent >= self.length
    }

    /// The next part.
    pub(crate) fn next(&mut self) -> Option<Part> {
        let (offset, length) = (self.sent, self.length);
        let rest = self.bytes.as_flattened().get(usize::from(offset)..usize::from(length))?;
        if rest.is_empty() {
            return None;
        }
        let mut bytes = [0; PART_BYTES];
        bytes.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
        let count = rest.len().min(PART_BYTES);
        self.sent = offset.saturating_add(count as u16);
        Some(Part { tick: self.tick, offset, length, bytes: List::first_of(bytes, count) })
    }
}

/// Most bytes of a snapshot that is put together.
const MOST_COLLECTED: usize = 8192;

/// Puts parts together.
#[derive(Clone, Debug)]
pub struct Collector {
    bytes: [u8; MOST_COLLECTED],
    tick: u32,
    length: u16,
    /// So many bytes are there, from the beginning on.
    have: u16,
}

impl Collector {
    /// No part is there.
    pub const fn new() -> Self {
        Self { bytes: [0; MOST_COLLECTED], tick: 0, length: 0, have: 0 }
    }

    /// Takes a part; the tick and the bytes of the snapshot that it completes. Parts come in their order: when one is
    /// missing, or one of another snapshot comes, that snapshot is never whole.
    pub fn add(&mut self, part: &Part) -> Option<(u32, &[u8])> {
        let bytes = part.bytes.as_slice();
        if part.offset == 0 {
            (self.tick, self.length, self.have) = (part.tick, part.length, 0);
        }
        let belongs = (self.tick, self.length, self.have) == (part.tick, part.length, part.offset);
        let end = usize::from(part.offset).checked_add(bytes.len())?;
        let place = self.bytes.get_mut(usize::from(part.offset)..end);
        let (Some(place), true) = (place, belongs && !bytes.is_empty() && end <= usize::from(part.length))
        else {
            self.length = 0;
            return None;
        };
        place.copy_from_slice(bytes);
        self.have = end as u16;
        if self.have < self.length {
            return None;
        }
        Some((self.tick, self.bytes.get(..end)?))
    }
}

impl Default for Collector {
    fn default() -> Self {
        Self::new()
    }
}
