//! Messages to frames, in place: postcard writes the payload one byte into the buffer, where it stays. Stuffing puts the
//! code bytes before it and in place of its zeros; only behind 254 bytes without a zero the rest makes room for one more.

use super::checksum::Checksum;
use super::{END, FULL};
use crate::bytes::BufferTooSmall;
use serde::Serialize;

/// Bytes of the longest frame of a payload of so many bytes, with the 0x00 at its end.
pub const fn most_bytes(payload: usize) -> usize {
    let stuffed = payload + Checksum::BYTES;
    let codes = stuffed.div_ceil(FULL as usize - 1);
    stuffed + codes + 1
}

/// Writes a message as a frame, with the 0x00 at its end, and returns the part of the buffer that it takes up.
///
/// # Errors
/// If the buffer is too small; [`most_bytes`] of the message's postcard bytes always suffice.
// Not inlined: one for all places of a program.
#[inline(never)]
pub fn encode<'a, M: Serialize + ?Sized>(
    message: &M,
    buffer: &'a mut [u8],
) -> Result<&'a [u8], BufferTooSmall> {
    let place = buffer.get_mut(1..).ok_or(BufferTooSmall)?;
    let length = postcard::to_slice(message, place).map_err(|_| BufferTooSmall)?.len();
    let (payload, rest) = place.split_at_mut_checked(length).ok_or(BufferTooSmall)?;
    *rest.first_chunk_mut().ok_or(BufferTooSmall)? = Checksum::of(payload);
    stuff(buffer, 1 + length + Checksum::BYTES)
}

/// Makes a frame of what lies in the buffer from its second byte on, up to an end.
#[inline(never)]
fn stuff(buffer: &mut [u8], mut end: usize) -> Result<&[u8], BufferTooSmall> {
    let mut code_at = 0;
    loop {
        // A code, and as many bytes as it can count. Every zero among them becomes the code of those behind it.
        let window_end = end.min(code_at + usize::from(FULL));
        let mut rest = buffer.get_mut(code_at..window_end).ok_or(BufferTooSmall)?;
        let length = loop {
            let (code, bytes) = rest.split_first_mut().ok_or(BufferTooSmall)?;
            let Some(zero) = bytes.iter().position(|byte| *byte == 0) else {
                *code = bytes.len() as u8 + 1;
                break *code;
            };
            *code = zero as u8 + 1;
            rest = &mut bytes[zero..];
        };
        if window_end == end {
            // A full block at the end has no other behind it.
            break;
        }
        if length < FULL {
            code_at = window_end - usize::from(length);
            continue;
        }
        if end >= buffer.len() {
            return Err(BufferTooSmall);
        }
        buffer.copy_within(window_end..end, window_end + 1);
        (code_at, end) = (window_end, end + 1);
    }
    *buffer.get_mut(end).ok_or(BufferTooSmall)? = END;
    buffer.get(..=end).ok_or(BufferTooSmall)
}
