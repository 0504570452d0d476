//! Numbers as bytes, one after the other, the low byte first: how the parts of a [state](crate::tick::State) are saved.

use core::fmt;

/// The buffer is too small for what was to be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferTooSmall;

impl fmt::Display for BufferTooSmall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the buffer is too small")
    }
}

impl core::error::Error for BufferTooSmall {}

/// An error in the bytes of a snapshot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SnapshotError {
    /// It is of a hand with other numbers of joints and fingertips.
    OtherHand {
        /// Joints of its hand.
        joints: u8,
        /// Fingertips of its hand.
        fingertips: u8,
    },
    /// It ends too early.
    TooShort,
    /// There are bytes behind it.
    TrailingBytes,
    /// It holds something that no state holds.
    Malformed(&'static str),
}

impl fmt::Display for SnapshotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherHand { joints, fingertips } => {
                write!(f, "the snapshot is of a hand with {joints} joints and {fingertips} fingertips")
            }
            Self::TooShort => f.write_str("the snapshot is cut off"),
            Self::TrailingBytes => f.write_str("there are bytes behind the snapshot"),
            Self::Malformed(what) => write!(f, "the snapshot has no meaning: {what}"),
        }
    }
}

impl core::error::Error for SnapshotError {}

/// Writes numbers one after the other.
pub(crate) struct Saver<'b> {
    buffer: &'b mut [u8],
    length: usize,
}

impl<'b> Saver<'b> {
    pub(crate) fn new(buffer: &'b mut [u8]) -> Self {
        Self { buffer, length: 0 }
    }

    fn bytes<const N: usize>(&mut self, bytes: [u8; N]) -> Result<(), BufferTooSmall> {
        let place = self.buffer.get_mut(self.length..).and_then(<[u8]>::first_chunk_mut);
        *place.ok_or(BufferTooSmall)? = bytes;
        self.length += N;
        Ok(())
    }

    pub(crate) fn u8(&mut self, value: u8) -> Result<(), BufferTooSmall> {
        self.bytes([value])
    }

    pub(crate) fn u32(&mut self, value: u32) -> Result<(), BufferTooSmall> {
        self.bytes(value.to_le_bytes())
    }

    pub(crate) fn f32(&mut self, value: f32) -> Result<(), BufferTooSmall> {
        self.u32(value.to_bits())
    }

    /// The first numbers of a list. Not inlined: it would be unrolled for each joint.
    #[inline(never)]
    pub(crate) fn f32s(&mut self, values: &[f32], count: usize) -> Result<(), BufferTooSmall> {
        values.iter().take(count).try_for_each(|&value| self.f32(value))
    }

    pub(crate) fn finish(self) -> Result<&'b mut [u8], BufferTooSmall> {
        self.buffer.get_mut(..self.length).ok_or(BufferTooSmall)
    }
}

/// Reads what a [`Saver`] wrote.
pub(crate) struct Loader<'b>(&'b [u8]);

impl<'b> Loader<'b> {
    pub(crate) fn new(bytes: &'b [u8]) -> Self {
        Self(bytes)
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], SnapshotError> {
        let (bytes, rest) = self.0.split_first_chunk().ok_or(SnapshotError::TooShort)?;
        self.0 = rest;
        Ok(*bytes)
    }

    pub(crate) fn u8(&mut self) -> Result<u8, SnapshotError> {
        self.bytes().map(|[byte]| byte)
    }

    pub(crate) fn flag(&mut self) -> Result<bool, SnapshotError> {
        match self.u8()? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(SnapshotError::Malformed("a flag is neither 0 nor 1")),
        }
    }

    pub(crate) fn u32(&mut self) -> Result<u32, SnapshotError> {
        self.bytes().map(u32::from_le_bytes)
    }

    pub(crate) fn f32(&mut self) -> Result<f32, SnapshotError> {
        self.u32().map(f32::from_bits)
    }

    /// The first numbers of a list.
    pub(crate) fn f32s(&mut self, values: &mut [f32], count: usize) -> Result<(), SnapshotError> {
        values.iter_mut().take(count).try_for_each(|value| self.f32().map(|read| *value = read))
    }

    pub(crate) fn finish(self) -> Result<(), SnapshotError> {
        if self.0.is_empty() { Ok(()) } else { Err(SnapshotError::TrailingBytes) }
    }
}
