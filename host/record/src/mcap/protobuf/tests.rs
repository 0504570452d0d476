//! `prost` as an independent reader and writer.

use crate::mcap::message::{Level, LinkStatus, read_event, write_event};
use crate::mcap::schema::{self, FieldKind};
use crate::mcap::{Stamp, Writer};
use blindgrasp_shared::fault::Fault;
use blindgrasp_shared::parameters::Each;
use blindgrasp_shared::signals::Kind;
use blindgrasp_shared::supervisor::Mode;
use prost::Message as _;
use prost_types::field_descriptor_proto::Label;
use prost_types::{DescriptorProto, FileDescriptorSet};

/// The messages as `prost` has them.
mod theirs {
    #[derive(Clone, PartialEq, prost::Message)]
    pub(super) struct Log {
        #[prost(message, optional, tag = "1")]
        pub(super) timestamp: Option<prost_types::Timestamp>,
        #[prost(int32, tag = "2")]
        pub(super) level: i32,
        #[prost(string, tag = "3")]
        pub(super) message: String,
        #[prost(string, tag = "4")]
        pub(super) name: String,
    }

    #[derive(Clone, Copy, PartialEq, prost::Message)]
    pub(super) struct LinkStatus {
        #[prost(double, tag = "1")]
        pub(super) seconds_s: f64,
        #[prost(uint64, tag = "2")]
        pub(super) bytes: u64,
        #[prost(uint64, tag = "3")]
        pub(super) frames: u64,
        #[prost(uint64, tag = "4")]
        pub(super) damaged: u64,
        #[prost(uint64, tag = "5")]
        pub(super) records: u64,
        #[prost(uint64, tag = "6")]
        pub(super) missing: u64,
        #[prost(uint64, tag = "7")]
        pub(super) dropped: u64,
        #[prost(uint64, tag = "8")]
        pub(super) unusable: u64,
        #[prost(double, tag = "9")]
        pub(super) rate_hz: f64,
        #[prost(uint32, tag = "10")]
        pub(super) decimation: u32,
        #[prost(double, tag = "11")]
        pub(super) share: f64,
        #[prost(uint64, tag = "12")]
        pub(super) inputs: u64,
    }

    /// Fields that a later version may have.
    #[derive(Clone, PartialEq, prost::Message)]
    pub(super) struct Later {
        #[prost(float, tag = "13")]
        pub(super) float: f32,
        #[prost(fixed64, tag = "14")]
        pub(super) fixed: u64,
        #[prost(sint64, tag = "536870911")]
        pub(super) signed: i64,
        #[prost(string, tag = "15")]
        pub(super) text: String,
    }
}

/// Numbers of every length, zero among them.
fn number(random: &mut fastrand::Rng) -> u64 {
    random.u64(..).checked_shr(random.u32(0..=64)).unwrap_or(0)
}

/// Bytes that were cut, changed, or grew.
fn damage(bytes: &mut Vec<u8>, random: &mut fastrand::Rng) {
    for _ in 0..random.usize(1..4) {
        match random.u8(0..3) {
            0 => bytes.truncate(random.usize(0..=bytes.len())),
            1 => bytes.insert(random.usize(0..=bytes.len()), random.u8(..)),
            _ => bytes.iter_mut().skip(random.usize(0..40)).take(1).for_each(|byte| *byte = random.u8(..)),
        }
    }
}

#[test]
fn the_link_is_written_and_read_as_prost_does() {
    let mut random = fastrand::Rng::with_seed(1);
    let (mut readable, mut unreadable) = (0, 0);
    for _ in 0..20_000 {
        let mut real = || match random.u8(0..4) {
            0 => 0.0,
            1 => f64::NAN,
            2 => random.f64(),
            _ => f64::from_bits(random.u64(1..1 << 63)),
        };
        let (seconds_s, rate_hz, share) = (real(), real(), real());
        let [bytes, frames, damaged, records, missing, dropped, unusable, inputs] =
            std::array::from_fn(|_| number(&mut random));
        let decimation = number(&mut random) as u32;
        macro_rules! status {
            ($($path:ident)::+) => {
                $($path)::+ {
                    seconds_s, bytes, frames, damaged, records, missing, dropped, unusable, rate_hz, decimation, share, inputs,
                }
            };
        }
        let (ours, theirs) = (status!(LinkStatus), status!(theirs::LinkStatus));
        let mut written = ours.write();
        assert_eq!(written, theirs.encode_to_vec(), "{ours:?}");
        let later = theirs::Later {
            float: random.f32(),
            fixed: number(&mut random),
            signed: number(&mut random) as i64,
            text: "x".repeat(random.usize(0..200)),
        };
        written.extend(later.encode_to_vec());
        assert_eq!(LinkStatus::read(&written).unwrap().write(), theirs.encode_to_vec(), "{ours:?}");

        damage(&mut written, &mut random);
        match LinkStatus::read(&written) {
            Some(ours) => {
                let theirs = theirs::LinkStatus::decode(&*written).unwrap();
                // Compares what is no number, too.
                assert_eq!(format!("{ours:?}"), format!("{theirs:?}"), "{written:02x?}");
                readable += 1;
            }
            None => unreadable += 1,
        }
    }
    assert!(readable > 1000 && unreadable > 1000, "{readable} {unreadable}");
}

#[test]
fn events_are_written_and_read_as_prost_does() {
    let mut random = fastrand::Rng::with_seed(2);
    let (mut readable, mut unreadable) = (0, 0);
    for _ in 0..20_000 {
        let mut words = || (0..random.usize(0..150)).map(|_| random.char(' '..='ÿ')).collect::<String>();
        let (about, words) = (words(), words());
        let level = random.choice(Level::ALL).unwrap();
        let at = Stamp(number(&mut random));
        let mut written = write_event(at, level, &about, &words);
        let (seconds, nanos) = ((at.0 / 1_000_000_000) as i64, (at.0 % 1_000_000_000) as i32);
        let theirs = theirs::Log {
            timestamp: Some(prost_types::Timestamp { seconds, nanos }),
            level: level as i32,
            message: words.clone(),
            name: about.clone(),
        };
        assert_eq!(written, theirs.encode_to_vec());
        assert_eq!(read_event(&written), Some((level, &*about, &*words)));

        damage(&mut written, &mut random);
        match (read_event(&written), theirs::Log::decode(&*written)) {
            (Some((level, about, words)), Ok(theirs)) => {
                assert_eq!((about, words), (&*theirs.name, &*theirs.message), "{written:02x?}");
                // One that is not known is told as that.
                let known = Level::ALL.into_iter().find(|level| *level as i32 == theirs.level);
                assert_eq!(level, known.unwrap_or(Level::Unknown), "{written:02x?}");
                readable += 1;
            }
            // The time of an event is that of its message, and not looked at.
            (Some(_), Err(_)) => {}
            (None, _) => unreadable += 1,
        }
    }
    assert!(readable > 300 && unreadable > 300, "{readable} {unreadable}");
}

#[test]
fn every_field_whose_bytes_end_or_are_none_is_damage() {
    for bytes in [
        &[0x10][..],                                                         // a key alone
        &[0x10, 0x80],                                                       // a number cut off
        &[0x10, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x02], // one of 65 bits
        &[0x80, 0x80, 0x80, 0x80, 0x10, 0x00],                               // a key of more than 32 bits
        &[0x09, 0, 0, 0, 0, 0, 0, 0],                                        // seven bytes of eight
        &[0x6d, 0, 0, 0],                                                    // three of four
        &[0x6a, 0x02, 0x00],                                                 // one byte of two
        &[0x6a, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01], // none of very many
        &[0x00, 0x00],                                                       // field 0
        &[0x0f, 0x00],                                                       // a wire type that there is not
        &[0x08, 0x01],                                                       // a whole number as `seconds_s`
        &[0x11, 0, 0, 0, 0, 0, 0, 0, 0],                                     // a real one as `bytes`
    ] {
        assert_eq!(LinkStatus::read(bytes), None, "{bytes:02x?}");
        assert!(theirs::LinkStatus::decode(bytes).is_err(), "{bytes:02x?}");
    }
    assert_eq!(read_event(&[0x1a, 0x01, 0xff]), None, "no UTF-8");
    assert_eq!(LinkStatus::read(&[]), Some(LinkStatus::default()));
}

/// A message as in a `.proto` file.
fn source(message: &DescriptorProto, lines: &mut Vec<String>) {
    let values = message.enum_type.iter().flat_map(|kind| &kind.value).map(|value| value.name());
    for name in message.field.iter().map(|field| field.name()).chain(values).chain([message.name()]) {
        // Readers refuse a schema in which one name is none.
        let of_a_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        assert!(name.chars().all(of_a_name) && !name.starts_with(|c: char| c.is_ascii_digit()), "{name:?}");
    }
    lines.push(format!("message {}", message.name()));
    for field in &message.field {
        let label = match (field.label(), field.proto3_optional()) {
            (Label::Repeated, false) => "repeated ",
            (Label::Optional, true) => {
                let choice = &message.oneof_decl[field.oneof_index() as usize];
                assert_eq!(choice.name(), format!("_{}", field.name()));
                "optional "
            }
            (Label::Optional, false) => "",
            other => panic!("{other:?} {}", field.name()),
        };
        let kind = match field.type_name() {
            "" => format!("{:?}", field.r#type()).to_lowercase(),
            // Whether it is one, or the other.
            name => format!("{:?} {name}", field.r#type()),
        };
        lines.push(format!("{label}{kind} {} = {}", field.name(), field.number()));
    }
    assert_eq!(
        message.oneof_decl.len(),
        message.field.iter().filter(|field| field.proto3_optional()).count()
    );
    message.nested_type.iter().for_each(|message| source(message, lines));
    for kind in &message.enum_type {
        let values = kind.value.iter().map(|value| format!(" {} = {}", value.name(), value.number()));
        lines.push(format!("enum {}{}", kind.name(), values.collect::<String>()));
    }
}

/// The files of a set, which is written as `prost` writes it, as the lines of their sources.
fn sources(set: &[u8]) -> Vec<String> {
    let files = FileDescriptorSet::decode(set).unwrap();
    assert_eq!(files.encode_to_vec(), set);
    let mut lines = Vec::new();
    for file in files.file {
        lines.push(format!("{} {} package {}", file.name(), file.syntax(), file.package()));
        lines.extend(file.dependency.iter().map(|path| format!("import {path}")));
        file.message_type.iter().for_each(|message| source(message, &mut lines));
    }
    lines
}

const TIMES: &str = "google/protobuf/timestamp.proto proto3 package google.protobuf
message Timestamp
int64 seconds = 1
int32 nanos = 2";

const VECTOR: &str = "message Vector3
double x = 1
double y = 2
double z = 3";

#[test]
fn schemas_in_a_recording_say_what_is_meant() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut writer = Writer::create(&path, false).unwrap();
    let hand = writer.add_device("hand");
    writer.add_world("", "").unwrap();
    writer.link(hand, Stamp(1)).unwrap();
    writer.finish().unwrap();
    let file = std::fs::read(&path).unwrap();
    let schemas = mcap::Summary::read(&file).unwrap().unwrap().schemas;
    let mut sets: Vec<String> = schemas
        .values()
        .filter(|schema| schema.encoding == "protobuf")
        .map(|schema| format!("schema {}\n{}\n", schema.name, sources(&schema.data).join("\n")))
        .collect();
    sets.sort_unstable();
    let time = "Message .google.protobuf.Timestamp timestamp = 1";
    let expected = format!(
        "schema blindgrasp.Contacts
{TIMES}
blindgrasp/Contacts.proto proto3 package blindgrasp
import google/protobuf/timestamp.proto
{VECTOR}
message Contact
Message .blindgrasp.Vector3 point_m = 1
Message .blindgrasp.Vector3 force_n = 2
optional double friction_used = 3
optional double slipped_m = 4
message Contacts
{time}
repeated Message .blindgrasp.Contact contacts = 2
repeated Message .blindgrasp.Contact others = 3
schema blindgrasp.Link
blindgrasp.proto proto3 package blindgrasp
message Link
double seconds_s = 1
uint64 bytes = 2
uint64 frames = 3
uint64 damaged = 4
uint64 records = 5
uint64 missing = 6
uint64 dropped = 7
uint64 unusable = 8
double rate_hz = 9
uint32 decimation = 10
double share = 11
uint64 inputs = 12
schema foxglove.FrameTransform
{TIMES}
foxglove/FrameTransform.proto proto3 package foxglove
import google/protobuf/timestamp.proto
{VECTOR}
message Quaternion
double x = 1
double y = 2
double z = 3
double w = 4
message FrameTransform
{time}
string parent_frame_id = 2
string child_frame_id = 3
Message .foxglove.Vector3 translation = 4
Message .foxglove.Quaternion rotation = 5
schema foxglove.JointStates
{TIMES}
foxglove/JointStates.proto proto3 package foxglove
import google/protobuf/timestamp.proto
message JointState
string name = 1
optional double position = 2
optional double velocity = 3
optional double acceleration = 4
optional double effort = 5
message JointStates
{time}
repeated Message .foxglove.JointState joints = 2
schema foxglove.Log
{TIMES}
foxglove/Log.proto proto3 package foxglove
import google/protobuf/timestamp.proto
message Log
{time}
Enum .foxglove.Log.Level level = 2
string message = 3
string name = 4
string file = 5
fixed32 line = 6
enum Level UNKNOWN = 0 DEBUG = 1 INFO = 2 WARNING = 3 ERROR = 4 FATAL = 5
"
    );
    assert_eq!(sets.concat(), expected);
}

#[test]
fn the_schema_of_a_hand_has_its_joints_and_every_signal() {
    let names = ["thumb/base", "1", "thumb_base"].map(str::to_owned);
    let (name, set) = schema::of_hand("My hand", &names);
    assert_eq!(name, "blindgrasp.my_hand.Tick");
    let mut lines = sources(&set).into_iter();
    let mut expect = |line: &str| assert_eq!(lines.next().as_deref(), Some(line));
    let signals = schema::tick_signals();
    let expect_signals = |each, expect: &mut dyn FnMut(&str)| {
        for signal in signals.iter().filter(|signal| signal.each == each) {
            let kind = match signal.kind {
                FieldKind::Limit(_) => "bool",
                FieldKind::Derived(_) if signal.name == "time_s" => "double",
                FieldKind::Derived(_) if signal.name == "lost_before" => "uint64",
                FieldKind::Derived(_) | FieldKind::Told(Kind::Real) => "float",
                FieldKind::Told(Kind::Whole) => "uint32",
                FieldKind::Told(Kind::Count) => "optional sint32",
                FieldKind::Told(Kind::Truth) => "bool",
                FieldKind::Told(Kind::Mode) => "Enum .blindgrasp.my_hand.Tick.Mode",
                FieldKind::Told(Kind::Fault) => "Enum .blindgrasp.my_hand.Tick.Fault",
                FieldKind::Told(Kind::Joint | Kind::Answer | Kind::Notice | Kind::Limiting) => "string",
            };
            expect(&format!("{kind} {} = {}", signal.name, signal.number));
        }
    };
    expect("blindgrasp/my_hand.proto proto3 package blindgrasp.my_hand");
    expect("message Tick");
    expect_signals(Each::Hand, &mut expect);
    expect("Message .blindgrasp.my_hand.Tick.Joints joints = 1");
    expect("message Joint");
    expect_signals(Each::Joint, &mut expect);
    expect("message Joints");
    for (name, number) in ["thumb_base", "joint_1", "thumb_base_2"].iter().zip(1..) {
        expect(&format!("Message .blindgrasp.my_hand.Tick.Joint {name} = {number}"));
    }
    let modes =
        Mode::ALL.map(|mode| format!(" {} = {}", mode.words().to_uppercase().replace(' ', "_"), mode as u8));
    expect(&format!("enum Mode{}", modes.concat()));
    let faults: String = Fault::ALL.iter().map(|fault| format!(" {fault:?} = {}", fault.number())).collect();
    let told = lines.next().unwrap();
    assert_eq!(
        told.replace("_", "").to_lowercase(),
        format!("enum Fault NoFault = 0{faults}").to_lowercase()
    );
    assert_eq!(lines.next(), None);
}
