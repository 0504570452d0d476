//! The decoded channels as protobuf. Ticks are written field by field, because their message is made for the hand and
//! comes a thousand times a second; what is rare goes through `prost`.

use super::decoder::Decoded;
use super::schema::JOINTS;
use blindgrasp_shared::limit::Limit;
use blindgrasp_shared::parameters::Each;
use blindgrasp_shared::signals::Value;

/// The severity of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum Level {
    /// Not told.
    Unknown = 0,
    /// For finding errors.
    Debug = 1,
    /// Good to know.
    Info = 2,
    /// Something may be wrong.
    Warning = 3,
    /// Something is wrong.
    Error = 4,
    /// Nothing goes on.
    Fatal = 5,
}

/// `foxglove.Log`.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct Log {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<prost_types::Timestamp>,
    #[prost(enumeration = "Level", tag = "2")]
    pub(super) level: i32,
    #[prost(string, tag = "3")]
    pub(super) message: String,
    #[prost(string, tag = "4")]
    pub(super) name: String,
}

/// The link in the last second.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub struct LinkStatus {
    /// Time that this tells of, s.
    #[prost(double, tag = "1")]
    pub seconds_s: f64,
    /// Bytes of the good frames that came.
    #[prost(uint64, tag = "2")]
    pub bytes: u64,
    /// Good frames that came.
    #[prost(uint64, tag = "3")]
    pub frames: u64,
    /// Frames that came damaged, each of which may have been a record.
    #[prost(uint64, tag = "4")]
    pub damaged: u64,
    /// Records that came and could be decoded, input records among them.
    #[prost(uint64, tag = "5")]
    pub records: u64,
    /// Records that are missing, by the numbers of those that came.
    #[prost(uint64, tag = "6")]
    pub missing: u64,
    /// Records and answers that the device lost because a queue was full.
    #[prost(uint64, tag = "7")]
    pub dropped: u64,
    /// Frames that came whole and can't be decoded.
    #[prost(uint64, tag = "8")]
    pub unusable: u64,
    /// Decoded records a second.
    #[prost(double, tag = "9")]
    pub rate_hz: f64,
    /// Ticks from one record that was asked for to the next, as the device told last; 1 with input records.
    #[prost(uint32, tag = "10")]
    pub decimation: u32,
    /// Share of the line's time that the frames took; NaN where its speed is not known.
    #[prost(double, tag = "11")]
    pub share: f64,
    /// Input records that came, of which a replay makes full ones.
    #[prost(uint64, tag = "12")]
    pub inputs: u64,
}

impl LinkStatus {
    /// Records that were lost on the way or by the host: those that are missing less what the device itself lost. Answers
    /// that it lost count as records here, so that this is the least there can be.
    pub fn lost_on_the_way(&self) -> u64 {
        self.missing.saturating_sub(self.dropped)
    }
}

/// Wire types of protobuf.
const VARINT: u32 = 0;
const EIGHT_BYTES: u32 = 1;
const LENGTH: u32 = 2;
const FOUR_BYTES: u32 = 5;

/// Writes a tick into a buffer, in the order and with the numbers of [`tick_signals`](super::schema::tick_signals).
/// `joint_names` are those that a fault names.
pub(super) fn write_tick(decoded: &Decoded, joint_names: &[String], buffer: &mut Vec<u8>) {
    let mut of_joints = Vec::with_capacity(4);
    let mut number = JOINTS;
    let mut next = || {
        number += 1;
        number
    };
    double(buffer, next(), decoded.time_s);
    whole(buffer, next(), decoded.lost_before);
    decoded.record.tell(|told| match told.each {
        Each::Joint => of_joints.push(told.value),
        Each::Hand | Each::Axis => write_value(buffer, next(), told.value, joint_names),
    });
    nested(buffer, JOINTS, |buffer| {
        for (k, _) in joint_names.iter().enumerate() {
            nested(buffer, k as u32 + 1, |buffer| write_joint(decoded, &of_joints, k, buffer));
        }
    });
}

fn write_joint(decoded: &Decoded, told: &[Value<'_>], k: usize, buffer: &mut Vec<u8>) {
    let known = |values: &[f32]| values.get(k).copied().unwrap_or(f32::NAN);
    float(buffer, 1, known(decoded.angles_rad.as_slice()));
    float(buffer, 2, known(decoded.speeds_rad_s.as_slice()));
    let mut number = 2;
    for value in told {
        number += 1;
        match (value.of_joint(k), value) {
            (Value::Missing, Value::Reals(_)) => float(buffer, number, f32::NAN),
            (Value::Limiting(limiting), _) => {
                for (limit, number) in Limit::ALL.into_iter().zip(number..) {
                    whole(buffer, number, limiting.contains(limit).into());
                }
                number += Limit::ALL.len() as u32 - 1;
            }
            (value, _) => write_value(buffer, number, value, &[]),
        }
    }
}

fn write_value(buffer: &mut Vec<u8>, number: u32, value: Value<'_>, joint_names: &[String]) {
    match value {
        Value::Missing | Value::Counts(_) | Value::Reals(_) | Value::Limits(_) => {}
        Value::Whole(value) => whole(buffer, number, value.into()),
        Value::Count(count) => {
            key(buffer, number, VARINT);
            // Small numbers of either sign in few bytes.
            varint(buffer, u64::from((count.wrapping_shl(1) ^ (count >> 31)) as u32));
        }
        Value::Real(value) => float(buffer, number, value),
        Value::Truth(value) => whole(buffer, number, value.into()),
        Value::Mode(mode) => whole(buffer, number, mode as u64),
        Value::Fault(fault) => whole(buffer, number, fault.number().into()),
        Value::Joint(joint) => {
            if let Some(name) = joint_names.get(usize::from(joint)) {
                text(buffer, number, name);
            }
        }
        Value::Answer(answer) => text(buffer, number, &answer.to_string()),
        Value::Limiting(limiting) => text(buffer, number, &limiting.to_string()),
    }
}

pub(super) fn text(buffer: &mut Vec<u8>, number: u32, text: &str) {
    key(buffer, number, LENGTH);
    varint(buffer, text.len() as u64);
    buffer.extend_from_slice(text.as_bytes());
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
        key(buffer, number, VARINT);
        varint(buffer, value);
    }
}

fn float(buffer: &mut Vec<u8>, number: u32, value: f32) {
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
