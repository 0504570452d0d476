//! The schemas of the decoded channels: protobuf descriptors made for a hand, JSON schemas, and the signal table.
//!
//! One table lists every signal with its number in the message, its type, unit, words and resolution; descriptors,
//! signal table and, by the numbers, the encoding follow from it.

use blindgrasp_shared::fault::Fault;
use blindgrasp_shared::supervisor::Mode;
use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet,
};
use serde_json::{Value, json};

/// Name of the schema of events.
pub(super) const LOG: &str = "foxglove.Log";
/// Name of the schema of the link's state.
pub(super) const LINK: &str = "blindgrasp.Link";

/// A signal: a field of a message.
pub(super) struct Signal {
    pub(super) number: u32,
    pub(super) name: &'static str,
    kind: Type,
    unit: &'static str,
    words: &'static str,
    resolution: &'static str,
}

macro_rules! signals {
    ($(#[$doc:meta])* $module:ident: $($constant:ident = $number:literal, $name:literal, $kind:ident, $unit:literal, $words:literal, $resolution:ident;)*) => {
        $(#[$doc])*
        pub(super) mod $module {
            use super::{Signal, Type};
            $(pub(in super::super) const $constant: u32 = $number;)*
            pub(in super::super) const ALL: &[Signal] = &[$(Signal {
                number: $constant, name: $name, kind: Type::$kind, unit: $unit, words: $words, resolution: super::$resolution,
            }),*];
        }
    };
}

const EXACT: &str = "exact";
const TICK: &str = "a tick";
const CYCLES: &str = "4 in dense records, 1 in full ones";
const FRACTION: &str = "a fraction of a count";
const ESTIMATOR: &str = "see shared/src/estimate.rs";
const NOTHING: &str = "";
const HALF: &str = "11 significant bits (IEEE 754 binary16) in dense records, exact in full ones";

#[rustfmt::skip]
signals! {
    /// Of a tick. Number 16 was that of a signal which is no more.
    tick:
    SEQUENCE            =  1, "sequence",             Uint32, "",       "Number of the record, one more from record to record, modulo 2^32", EXACT;
    TICK                =  2, "tick",                 Uint32, "",       "Number of the tick since the device's start, modulo 2^32", EXACT;
    TIME_S              =  3, "time_s",               Double, "s",      "Time of the tick since the device's start, on the device's clock", TICK;
    MODE                =  4, "mode",                 Enum,   "",       "Mode; its name is the word", EXACT;
    FAULT               =  5, "fault",                Enum,   "",       "The fault that the hand is in; its name is the word, its value the number", EXACT;
    FAULT_JOINT         =  6, "fault_joint",          String, "",       "The joint of the fault, if it is one's", EXACT;
    READING_FAILED      =  7, "reading_failed",       Enum,   "",       "Why there are no counts, where the joints could not be read", EXACT;
    READING_JOINT       =  8, "reading_failed_joint", String, "",       "The joint that could not be read", EXACT;
    HEARTBEAT           =  9, "heartbeat",            Bool,   "",       "Whether a heartbeat of the host came in this tick", EXACT;
    LATE                = 10, "late",                 Bool,   "",       "Whether the tick before was late", EXACT;
    FALLBACK_CLOCK      = 11, "fallback_clock",       Bool,   "",       "Whether the clock is not the crystal", EXACT;
    FORCE_N             = 12, "force_n",              Float,  "N",      "Force f_d that acts", HALF;
    STIFFNESS_NM        = 13, "attitude_stiffness_nm", Float, "N m",    "Attitude stiffness K_st that acts", HALF;
    APPROACH_J          = 14, "approach_potential_j", Float,  "J",      "Potential V_s of the approach", HALF;
    ATTITUDE_J          = 15, "attitude_potential_j", Float,  "J",      "Potential V_st of the attitudes, above its least value", HALF;
    CYCLES              = 17, "cycles",               Uint32, "cycles", "Processor cycles of reading and writing the joints in the tick before; 0 where nothing counts them", CYCLES;
    LATE_TICKS          = 18, "late_ticks",           Uint32, "",       "Ticks that were late since the start", EXACT;
    DROPPED             = 19, "dropped",              Uint32, "",       "Records and answers that the device lost since its start because a queue was full", EXACT;
    DECIMATION          = 20, "decimation",           Uint32, "ticks",  "Ticks from one sent record to the next", EXACT;
    LOST_BEFORE         = 21, "lost_before",          Uint64, "",       "Records missing between the one before and this one", EXACT;
    JOINTS              = 22, "joints",               Message, "",      "The joints by name", NOTHING;
    INTEGRAL_NM_RAD     = 23, "integral_gain_nm_rad", Float,  "N m/rad", "Gain K_I of the earlier law that acts", HALF;
    INTEGRAL_J          = 24, "integral_potential_j", Float,  "J",      "Potential V_I of the joints' turns since the grasp began", HALF;
    WORK_J              = 25, "work_j",               Float,  "J",      "Work of the motors since the last grasp began", HALF;
    DAMPED_J            = 26, "damped_j",             Float,  "J",      "What the law's damping has taken since the last grasp began", HALF;
    EXCESS_J            = 27, "excess_j",             Float,  "J",      "Work of the motors in the last second (fading) beyond the drop of the law's potentials", HALF;
}

#[rustfmt::skip]
signals! {
    /// Of a joint.
    joint:
    COUNT               =  1, "count",                Sint32, "counts", "Encoder count; absent where it is not known", EXACT;
    ANGLE_RAD           =  2, "angle_rad",            Float,  "rad",    "Angle as the controller's estimator sees it; NaN where it is not known", FRACTION;
    SPEED_RAD_S         =  3, "speed_rad_s",          Float,  "rad/s",  "Speed as the controller's estimator sees it; NaN where it is not known", ESTIMATOR;
    TORQUE_NM           =  4, "torque_nm",            Float,  "N m",    "Torque of the next tick; NaN where it is not known", HALF;
    BY_TORQUE           =  5, "limited_by_torque",    Bool,   "",       "Whether the torque limit acts", EXACT;
    BY_SLEW             =  6, "limited_by_slew",      Bool,   "",       "Whether the slew limit acts", EXACT;
    BY_LOWER_STOP       =  7, "limited_by_lower_stop", Bool,  "",       "Whether the lower end stop acts", EXACT;
    BY_UPPER_STOP       =  8, "limited_by_upper_stop", Bool,  "",       "Whether the upper end stop acts", EXACT;
}

#[rustfmt::skip]
signals! {
    /// Of the link.
    link:
    SECONDS             =  1, "seconds_s",            Double, "s",      "Time that this tells of", EXACT;
    BYTES               =  2, "bytes",                Uint64, "bytes",  "Bytes of the good frames that came", EXACT;
    FRAMES              =  3, "frames",               Uint64, "",       "Good frames that came", EXACT;
    DAMAGED             =  4, "damaged",              Uint64, "",       "Frames that came damaged, each of which may have been a record", EXACT;
    RECORDS             =  5, "records",              Uint64, "",       "Records that came and could be decoded", EXACT;
    MISSING             =  6, "missing",              Uint64, "",       "Records that are missing, by the numbers of those that came", EXACT;
    DROPPED             =  7, "dropped",              Uint64, "",       "Records and answers that the device lost because a queue was full", EXACT;
    UNUSABLE            =  8, "unusable",             Uint64, "",       "Frames that came whole and can't be decoded; of records, those until a full one comes (among the missing)", EXACT;
    RATE_HZ             =  9, "rate_hz",              Double, "1/s",    "Decoded records a second", EXACT;
    DECIMATION          = 10, "decimation",           Uint32, "ticks",  "Ticks from one sent record to the next, as the device told last", EXACT;
    SHARE               = 11, "share",                Double, "1",      "Share of the line's time that the frames took; NaN where its speed is not known", EXACT;
}

/// A name that protobuf takes for a field: letters, digits, underscores.
fn identifier(name: &str) -> String {
    let mut identifier: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if !identifier.starts_with(|c: char| c.is_ascii_alphabetic()) {
        identifier.insert_str(0, "joint_");
    }
    identifier
}

/// Names of the joints as fields: different ones, in the hand's order.
pub(super) fn joint_fields(names: &[String]) -> Vec<String> {
    let mut fields: Vec<String> = Vec::with_capacity(names.len());
    for name in names {
        let plain = identifier(name);
        let mut field = plain.clone();
        let mut k = 2;
        while fields.contains(&field) {
            field = format!("{plain}_{k}");
            k += 1;
        }
        fields.push(field);
    }
    fields
}

/// The schema of a hand's ticks: its name, and its descriptors.
pub(super) fn of_hand(hand: &str, joint_names: &[String]) -> (String, Vec<u8>) {
    let package = format!("blindgrasp.{}", identifier(hand).to_lowercase());
    let full = |name: &str| format!(".{package}.Tick.{name}");
    let mut tick_fields = fields(tick::ALL);
    for (name, kind) in
        [("mode", "Mode"), ("fault", "Fault"), ("reading_failed", "Fault"), ("joints", "Joints")]
    {
        for field in tick_fields.iter_mut().filter(|field| field.name() == name) {
            field.type_name = Some(full(kind));
        }
    }
    let joint_message = message("Joint", fields(joint::ALL));
    let of_joints = joint_fields(joint_names).into_iter().zip(1..);
    let joints = of_joints
        .map(|(name, number)| FieldDescriptorProto {
            type_name: Some(full("Joint")),
            ..field(&name, number, Type::Message)
        })
        .collect();
    let modes = Mode::ALL.iter().map(|mode| (mode.words().to_uppercase(), *mode as i32));
    let faults =
        Fault::ALL.iter().map(|fault| (upper_case(&format!("{fault:?}")), i32::from(fault.number())));
    let tick = DescriptorProto {
        nested_type: vec![joint_message, message("Joints", joints)],
        enum_type: vec![
            enumeration("Mode", modes),
            enumeration("Fault", std::iter::once(("NO_FAULT".into(), 0)).chain(faults)),
        ],
        ..message("Tick", tick_fields)
    };
    let file = file(&package, vec![tick]);
    (format!("{package}.Tick"), FileDescriptorSet { file: vec![file] }.encode_to_vec())
}

/// The schema of the link's state.
pub(super) fn of_link() -> Vec<u8> {
    let file = file("blindgrasp", vec![message("Link", fields(link::ALL))]);
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

/// The schema of events, which viewers know.
pub(super) fn of_log() -> Vec<u8> {
    let timestamp = FileDescriptorProto {
        name: Some("google/protobuf/timestamp.proto".into()),
        ..file(
            "google.protobuf",
            vec![message(
                "Timestamp",
                vec![field("seconds", 1, Type::Int64), field("nanos", 2, Type::Int32)],
            )],
        )
    };
    let levels = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];
    let typed = |field, name: &str| FieldDescriptorProto { type_name: Some(name.into()), ..field };
    let log = DescriptorProto {
        enum_type: vec![enumeration("Level", levels.iter().map(|&name| name.to_owned()).zip(0..))],
        ..message(
            "Log",
            vec![
                typed(field("timestamp", 1, Type::Message), ".google.protobuf.Timestamp"),
                typed(field("level", 2, Type::Enum), ".foxglove.Log.Level"),
                field("message", 3, Type::String),
                field("name", 4, Type::String),
                field("file", 5, Type::String),
                field("line", 6, Type::Fixed32),
            ],
        )
    };
    let log = FileDescriptorProto {
        name: Some("foxglove/Log.proto".into()),
        dependency: vec!["google/protobuf/timestamp.proto".into()],
        ..file("foxglove", vec![log])
    };
    FileDescriptorSet { file: vec![timestamp, log] }.encode_to_vec()
}

/// JSON schema of what a device is.
pub(super) fn of_about() -> Value {
    let text = |words: &str| json!({ "type": "string", "description": words });
    let maybe = |words: &str| json!({ "type": ["string", "null"], "description": words });
    let number = |words: &str| json!({ "type": "integer", "description": words });
    json!({
        "title": "blindgrasp.About",
        "type": "object",
        "properties": {
            "interface_version": number("Version of the interface that the device speaks"),
            "image": text("hand, pil, or sim"),
            "firmware_version": text("Release of the firmware"),
            "build_hash": text("CRC-32 of the firmware's sources"),
            "hand": text("Name of the hand"),
            "hand_hash": text("CRC-32 of the hand's model and default configuration"),
            "joint_count": number("Joints"),
            "fingertip_count": number("Fingertips"),
            "period_us": number("Time from one tick to the next, us"),
            "clock": text("What gives the device its time"),
            "reset": text("Why it started"),
            "crash": maybe("How it ended before, if that was not in order"),
            "units": text("Units on the wire"),
            "host_version": text("Release of the program that recorded"),
            "port": maybe("The port"),
            "baud": json!({ "type": ["integer", "null"], "description": "Speed of the port, bits a second" }),
            "joint_names": json!({ "type": "array", "items": { "type": "string" } }),
            "hand_file": maybe("The hand's whole file (TOML)"),
            "scene": maybe("The effective scene (TOML) of a simulation"),
        },
    })
}

/// JSON schema of parameters.
pub(super) fn of_parameters() -> Value {
    json!({
        "title": "blindgrasp.Parameters",
        "type": "object",
        "properties": { "values": { "type": "array", "items": {
            "type": "object",
            "properties": {
                "key": { "type": "string", "description": "Name of the parameter; units stand in it" },
                "index": { "type": "integer", "description": "Joint or axis, from 0" },
                "value": {
                    "type": ["number", "string", "null"],
                    "description": "An f32, exactly; null: what it belongs to is switched off",
                },
            },
        } } },
    })
}

/// The table of all signals.
pub(super) fn signal_table() -> Value {
    let rows = |signals: &[Signal], path: &str| -> Vec<Value> {
        let row = |signal: &Signal| {
            json!({
                "name": format!("{path}{}", signal.name),
                "unit": signal.unit,
                "words": signal.words,
                "resolution": signal.resolution,
            })
        };
        signals.iter().filter(|signal| signal.kind != Type::Message).map(row).collect()
    };
    let of_tick = [rows(tick::ALL, ""), rows(joint::ALL, "joints.<joint>.")].concat();
    json!({
        "tick": of_tick,
        "link": rows(link::ALL, ""),
    })
}

fn fields(signals: &[Signal]) -> Vec<FieldDescriptorProto> {
    signals.iter().map(|signal| field(signal.name, signal.number as i32, signal.kind)).collect()
}

fn field(name: &str, number: i32, kind: Type) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        ..FieldDescriptorProto::default()
    }
}

/// A message. Its field `count` can be absent, which in this syntax takes a choice with one member.
fn message(name: &str, mut fields: Vec<FieldDescriptorProto>) -> DescriptorProto {
    let mut choices = Vec::new();
    for field in fields.iter_mut().filter(|field| field.name() == "count" && name == "Joint") {
        field.proto3_optional = Some(true);
        field.oneof_index = Some(choices.len() as i32);
        choices.push(prost_types::OneofDescriptorProto { name: Some("_count".into()), options: None });
    }
    DescriptorProto {
        name: Some(name.into()),
        field: fields,
        oneof_decl: choices,
        ..DescriptorProto::default()
    }
}

fn enumeration(name: &str, values: impl Iterator<Item = (String, i32)>) -> EnumDescriptorProto {
    EnumDescriptorProto {
        name: Some(name.into()),
        value: values
            .map(|(name, number)| EnumValueDescriptorProto {
                name: Some(name),
                number: Some(number),
                options: None,
            })
            .collect(),
        ..EnumDescriptorProto::default()
    }
}

fn file(package: &str, messages: Vec<DescriptorProto>) -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some(format!("{}.proto", package.replace('.', "/"))),
        package: Some(package.into()),
        message_type: messages,
        syntax: Some("proto3".into()),
        ..FileDescriptorProto::default()
    }
}

/// `CountJump` to `COUNT_JUMP`.
fn upper_case(name: &str) -> String {
    let mut upper = String::with_capacity(name.len() + 4);
    for (k, c) in name.char_indices() {
        if k > 0 && c.is_ascii_uppercase() {
            upper.push('_');
        }
        upper.push(c.to_ascii_uppercase());
    }
    upper
}
