//! The decoded channels as protobuf.

use super::Stamp;
use super::decoder::Decoded;
use super::protobuf::{double, float, nested, read, signed, text, whole};
use super::schema::{JOINTS, Type};
use blindgrasp_shared::limit::Limit;
use blindgrasp_shared::parameters::Each;
use blindgrasp_shared::signals::Value;

/// The severity of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Not told.
    Unknown,
    /// For finding errors.
    Debug,
    /// Good to know.
    Info,
    /// Something may be wrong.
    Warning,
    /// Something is wrong.
    Error,
    /// Nothing goes on.
    Fatal,
}

impl Level {
    /// All, in the order of their numbers.
    pub(super) const ALL: [Self; 6] =
        [Self::Unknown, Self::Debug, Self::Info, Self::Warning, Self::Error, Self::Fatal];
}

/// Returns an event as a `foxglove.Log`.
pub(super) fn write_event(at: Stamp, level: Level, about: &str, words: &str) -> Vec<u8> {
    let mut buffer = Vec::new();
    write_time(&mut buffer, at);
    whole(&mut buffer, 2, level as u64);
    text(&mut buffer, 3, words);
    text(&mut buffer, 4, about);
    buffer
}

/// Returns the level, the subject and the words of an event; `None` if its bytes are damaged.
pub(super) fn read_event(bytes: &[u8]) -> Option<(Level, &str, &str)> {
    let mut event = (Level::Unknown, "", "");
    for (number, value) in read(bytes)? {
        match number {
            2 => event.0 = *Level::ALL.get(value.whole? as usize).unwrap_or(&Level::Unknown),
            3 => event.2 = value.text?,
            4 => event.1 = value.text?,
            _ => {}
        }
    }
    Some(event)
}

/// A time, which is the first field of every message that has one.
pub(super) fn write_time(buffer: &mut Vec<u8>, at: Stamp) {
    nested(buffer, 1, |buffer| {
        whole(buffer, 1, at.0 / 1_000_000_000);
        whole(buffer, 2, at.0 % 1_000_000_000);
    });
}

macro_rules! link_status {
    ($($number:literal, $name:ident, $type:ty, $write:ident, $kind:ident, $unit:literal, $words:literal;)*) => {
        /// The link in the last second.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct LinkStatus {
            $(#[doc = concat!($words, ".")] pub $name: $type,)*
        }

        impl LinkStatus {
            /// Number, name and type of each field, its unit, and what it is in words.
            pub(super) const SIGNALS: &[(u32, &str, Type, &str, &str)] =
                &[$(($number, stringify!($name), Type::$kind, $unit, $words)),*];

            pub(super) fn write(&self) -> Vec<u8> {
                let mut buffer = Vec::new();
                $($write(&mut buffer, $number, self.$name.into());)*
                buffer
            }

            /// Reads what [`Self::write`] wrote; `None` if the bytes are damaged.
            pub(super) fn read(bytes: &[u8]) -> Option<Self> {
                let mut status = Self::default();
                for (number, value) in read(bytes)? {
                    match number {
                        $($number => status.$name = value.$write? as $type,)*
                        _ => {}
                    }
                }
                Some(status)
            }
        }
    };
}

#[rustfmt::skip]
link_status! {
     1, seconds_s,  f64, double, Double, "s",     "Time that this tells of";
     2, bytes,      u64, whole,  Uint64, "bytes", "Bytes of the good frames that came";
     3, frames,     u64, whole,  Uint64, "",      "Good frames that came";
     4, damaged,    u64, whole,  Uint64, "",      "Frames that came damaged, each of which may have been a record";
     5, records,    u64, whole,  Uint64, "",      "Records that came and could be decoded, input records among them";
     6, missing,    u64, whole,  Uint64, "",      "Records that are missing, by the numbers of those that came";
     7, dropped,    u64, whole,  Uint64, "",      "Records and answers that the device lost because a queue was full";
     8, unusable,   u64, whole,  Uint64, "",      "Frames that came whole and can't be decoded";
     9, rate_hz,    f64, double, Double, "1/s",   "Decoded records a second";
    10, decimation, u32, whole,  Uint32, "ticks", "Ticks from one record that was asked for to the next; 1 where input records tell of the ticks between, as the device told last";
    11, share,      f64, double, Double, "1",     "Share of the line's time that the frames took; NaN where its speed is not known";
    12, inputs,     u64, whole,  Uint64, "",      "Input records that came, of which a replay makes full ones";
}

impl LinkStatus {
    /// Records that were lost on the way or by the host: those that are missing less what the device itself lost. Answers
    /// that it lost count as records here, so that this is the least there can be.
    pub fn lost_on_the_way(&self) -> u64 {
        self.missing.saturating_sub(self.dropped)
    }
}

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
        Value::Count(count) => signed(buffer, number, count),
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
        Value::Notice(noticed) => text(buffer, number, &noticed.to_string()),
        Value::Limiting(limiting) => text(buffer, number, &limiting.to_string()),
    }
}
