//! The wire format of protobuf: the fields of a message, written one after the other, and read back.

use serde::Deserialize;

const VARINT: u32 = 0;
const EIGHT_BYTES: u32 = 1;
const LENGTH: u32 = 2;
const FOUR_BYTES: u32 = 5;

/// A text; an empty one is not written, as is the rule.
pub(super) fn text(buffer: &mut Vec<u8>, number: u32, text: &str) {
    if !text.is_empty() {
        key(buffer, number, LENGTH);
        varint(buffer, text.len() as u64);
        buffer.extend_from_slice(text.as_bytes());
    }
}

/// A message in a message. Its length stands before it: a byte if it is short, as a joint's always is; otherwise the
/// message moves up.
pub(super) fn nested(buffer: &mut Vec<u8>, number: u32, fill: impl FnOnce(&mut Vec<u8>)) {
    key(buffer, number, LENGTH);
    let at = buffer.len();
    buffer.push(0);
    fill(buffer);
    let length = buffer.len() - at - 1;
    if length < 0x80 {
        buffer[at] = length as u8;
    } else {
        let mut bytes = Vec::with_capacity(4);
        varint(&mut bytes, length as u64);
        buffer.splice(at..=at, bytes);
    }
}

/// A whole number or a truth value; zero is not written, as is the rule.
pub(super) fn whole(buffer: &mut Vec<u8>, number: u32, value: u64) {
    if value != 0 {
        present_whole(buffer, number, value);
    }
}

/// A whole number that could be absent: zero is written, too.
pub(super) fn present_whole(buffer: &mut Vec<u8>, number: u32, value: u64) {
    key(buffer, number, VARINT);
    varint(buffer, value);
}

/// A whole number of either sign, which is written even if it is zero: small ones in few bytes.
pub(super) fn signed(buffer: &mut Vec<u8>, number: u32, value: i32) {
    present_whole(buffer, number, u64::from((value.wrapping_shl(1) ^ (value >> 31)) as u32));
}

pub(super) fn float(buffer: &mut Vec<u8>, number: u32, value: f32) {
    if value.to_bits() != 0 {
        key(buffer, number, FOUR_BYTES);
        buffer.extend_from_slice(&value.to_le_bytes());
    }
}

pub(super) fn double(buffer: &mut Vec<u8>, number: u32, value: f64) {
    if value.to_bits() != 0 {
        present_double(buffer, number, value);
    }
}

/// A number that could be absent: zero is written, too.
pub(super) fn present_double(buffer: &mut Vec<u8>, number: u32, value: f64) {
    key(buffer, number, EIGHT_BYTES);
    buffer.extend_from_slice(&value.to_le_bytes());
}

fn key(buffer: &mut Vec<u8>, number: u32, wire_type: u32) {
    varint(buffer, u64::from(number << 3 | wire_type));
}

fn varint(buffer: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        buffer.push(value as u8 | 0x80);
        value >>= 7;
    }
    buffer.push(value as u8);
}

/// The value of a field, as what it is; of four bytes, nothing is kept.
#[derive(Default)]
pub(super) struct Value<'a> {
    pub(super) whole: Option<u64>,
    pub(super) double: Option<f64>,
    pub(super) text: Option<&'a str>,
}

/// Returns the number and the value of each field of a message; `None` if its bytes are damaged.
pub(super) fn read(mut bytes: &[u8]) -> Option<Vec<(u32, Value<'_>)>> {
    let mut fields = Vec::new();
    while !bytes.is_empty() {
        let key = u32::try_from(next::<u64>(&mut bytes)?).ok()?;
        let mut value = Value::default();
        match key & 7 {
            // No field has the number 0.
            _ if key < 8 => return None,
            VARINT => value.whole = Some(next(&mut bytes)?),
            EIGHT_BYTES => value.double = Some(next(&mut bytes)?),
            LENGTH => value.text = std::str::from_utf8(next(&mut bytes)?).ok(),
            FOUR_BYTES => drop(next::<f32>(&mut bytes)?),
            _ => return None,
        }
        fields.push((key >> 3, value));
    }
    Some(fields)
}

/// The next value: postcard has the same ones, without keys.
fn next<'a, T: Deserialize<'a>>(bytes: &mut &'a [u8]) -> Option<T> {
    let (value, rest) = postcard::take_from_bytes(bytes).ok()?;
    *bytes = rest;
    Some(value)
}

#[cfg(test)]
mod tests;
