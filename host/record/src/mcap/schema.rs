//! The schemas of the decoded channels: protobuf descriptors made for a hand, JSON schemas, and the signal table.
//!
//! The fields of a tick are those of the tables of signals, in their order: [`tick_signals`] numbers them, for the
//! descriptors, the signal table and the encoding.

use crate::derived::Derived;
use blindgrasp_shared::control::Signal;
use blindgrasp_shared::fault::Fault;
use blindgrasp_shared::limit::Limit;
use blindgrasp_shared::parameters::Each;
use blindgrasp_shared::signals::Kind;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_wire::Record;
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

/// Number of the field of a tick that holds the joints.
pub(super) const JOINTS: u32 = 1;

/// A signal of a tick: a field of its message, or of a joint's.
pub(super) struct TickSignal {
    pub(super) number: u32,
    pub(super) name: String,
    pub(super) each: Each,
    pub(super) kind: FieldKind,
    unit: &'static str,
    words: &'static str,
}

/// The type of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FieldKind {
    /// Derived by the host.
    Derived(Derived),
    /// Told by the hand.
    Told(Kind),
    /// One of the limits of a torque.
    Limit(Limit),
}

impl FieldKind {
    const fn proto(self) -> Type {
        match self {
            Self::Derived(Derived::Time | Derived::HostTime) => Type::Double,
            Self::Derived(Derived::Session | Derived::LostBefore) => Type::Uint64,
            Self::Derived(Derived::Angle | Derived::Speed) | Self::Told(Kind::Real) => Type::Float,
            Self::Told(Kind::Whole) => Type::Uint32,
            Self::Told(Kind::Count) => Type::Sint32,
            Self::Told(Kind::Truth) | Self::Limit(_) => Type::Bool,
            Self::Told(Kind::Mode | Kind::Fault) => Type::Enum,
            Self::Told(Kind::Joint | Kind::Answer | Kind::Limiting) => Type::String,
        }
    }
}

/// The signals of a tick in the order in which they are written: the host's, and then the hand's. Those of a joint are
/// numbered by themselves. What a limit does has a field for each limit; a host's time has none, since every message has it, and
/// a session is where the channel `about` has a message.
pub(super) fn tick_signals() -> Vec<TickSignal> {
    let mut signals: Vec<TickSignal> = Vec::new();
    let mut next = [JOINTS + 1, 1];
    let mut add = |name: String, each: Each, kind, unit, words| {
        let next = &mut next[usize::from(each == Each::Joint)];
        signals.push(TickSignal { number: *next, name, each, kind, unit, words });
        *next += 1;
    };
    let is_told = |derived: &&Derived| !matches!(derived, Derived::HostTime | Derived::Session);
    for &derived in Derived::ALL.iter().filter(is_told) {
        let kind = FieldKind::Derived(derived);
        add(derived.key().into(), derived.each(), kind, derived.unit(), derived.words());
    }
    Record::BLANK.tell(|told| {
        let Signal { key, unit, words } = told.signal;
        if told.kind == Kind::Limiting {
            for limit in Limit::ALL {
                let name = format!("{key}_{}", limit.key());
                add(name, told.each, FieldKind::Limit(limit), unit, limit.words());
            }
        } else {
            add(key.into(), told.each, FieldKind::Told(told.kind), unit, words);
        }
    });
    signals
}

/// A signal of the link: a field of a message.
pub(super) struct LinkSignal {
    pub(super) number: u32,
    pub(super) name: &'static str,
    kind: Type,
    unit: &'static str,
    words: &'static str,
}

macro_rules! signals {
    ($(#[$doc:meta])* $module:ident: $($constant:ident = $number:literal, $name:literal, $kind:ident, $unit:literal, $words:literal;)*) => {
        $(#[$doc])*
        pub(super) mod $module {
            use super::{LinkSignal, Type};
            $(pub(in super::super) const $constant: u32 = $number;)*
            pub(in super::super) const ALL: &[LinkSignal] = &[$(LinkSignal {
                number: $constant, name: $name, kind: Type::$kind, unit: $unit, words: $words,
            }),*];
        }
    };
}

#[rustfmt::skip]
signals! {
    /// Of the link.
    link:
    SECONDS             =  1, "seconds_s",            Double, "s",      "Time that this tells of";
    BYTES               =  2, "bytes",                Uint64, "bytes",  "Bytes of the good frames that came";
    FRAMES              =  3, "frames",               Uint64, "",       "Good frames that came";
    DAMAGED             =  4, "damaged",              Uint64, "",       "Frames that came damaged, each of which may have been a record";
    RECORDS             =  5, "records",              Uint64, "",       "Records that came and could be decoded, input records among them";
    MISSING             =  6, "missing",              Uint64, "",       "Records that are missing, by the numbers of those that came";
    DROPPED             =  7, "dropped",              Uint64, "",       "Records and answers that the device lost because a queue was full";
    UNUSABLE            =  8, "unusable",             Uint64, "",       "Frames that came whole and can't be decoded";
    RATE_HZ             =  9, "rate_hz",              Double, "1/s",    "Decoded records a second";
    DECIMATION          = 10, "decimation",           Uint32, "ticks",  "Ticks from one record that was asked for to the next; 1 where input records tell of the ticks between, as the device told last";
    SHARE               = 11, "share",                Double, "1",      "Share of the line's time that the frames took; NaN where its speed is not known";
    INPUTS              = 12, "inputs",               Uint64, "",       "Input records that came, of which a replay makes full ones";
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
    let typed = |signal: &TickSignal| {
        let name = match signal.kind {
            FieldKind::Told(Kind::Mode) => Some("Mode"),
            FieldKind::Told(Kind::Fault) => Some("Fault"),
            _ => None,
        };
        let field = field(&signal.name, signal.number as i32, signal.kind.proto());
        FieldDescriptorProto { type_name: name.map(full), ..field }
    };
    let signals = tick_signals();
    let of = |each| signals.iter().filter(move |signal| signal.each == each).map(typed).collect::<Vec<_>>();
    let mut tick_fields = of(Each::Hand);
    tick_fields.push(FieldDescriptorProto {
        type_name: Some(full("Joints")),
        ..field("joints", JOINTS as i32, Type::Message)
    });
    let joint_message = message("Joint", of(Each::Joint));
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

/// Name, encoding and bytes of the schema of a channel that is the same for every hand; none of what has none.
pub(super) fn of_kind(channel: super::Kind) -> Option<(String, &'static str, Vec<u8>)> {
    use super::Kind;
    let json = |schema: Value| schema.to_string().into_bytes();
    let (name, encoding, data) = match channel {
        Kind::Received | Kind::Sent | Kind::Tick => return None,
        Kind::Event => (LOG, "protobuf", of_log()),
        Kind::Link => (LINK, "protobuf", of_link()),
        Kind::About => ("blindgrasp.About", "jsonschema", json(of_about())),
        Kind::Parameters => ("blindgrasp.Parameters", "jsonschema", json(of_parameters())),
    };
    Some((name.to_owned(), encoding, data))
}

/// Returns the encoding of a schema's messages.
pub(super) fn encoding(of_schema: &str) -> &'static str {
    if of_schema == "jsonschema" { "json" } else { "protobuf" }
}

/// The schema of the link's state.
fn of_link() -> Vec<u8> {
    let file = file("blindgrasp", vec![message("Link", fields(link::ALL))]);
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

/// The schema of events, which viewers know.
fn of_log() -> Vec<u8> {
    let levels = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];
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
        dependency: vec![TIMESTAMP.into()],
        ..file("foxglove", vec![log])
    };
    FileDescriptorSet { file: vec![timestamp(), log] }.encode_to_vec()
}

/// JSON schema of what a device is.
fn of_about() -> Value {
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
            "brown_out": text("Level of the microcontroller's brown-out reset"),
            "clock_hz": number("Frequency of the clock that cycles are counted in, Hz; 0 where nothing counts them"),
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
fn of_parameters() -> Value {
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
    let row = |name: &str, unit: &str, words: &str| json!({ "name": name, "unit": unit, "words": words });
    let signals = tick_signals();
    let of_tick = signals.iter().map(|signal| {
        let path = if signal.each == Each::Joint { "joints.<joint>." } else { "" };
        row(&format!("{path}{}", signal.name), signal.unit, signal.words)
    });
    let of_link = link::ALL.iter().map(|signal| row(signal.name, signal.unit, signal.words));
    json!({ "tick": of_tick.collect::<Vec<_>>(), "link": of_link.collect::<Vec<_>>() })
}

fn fields(signals: &[LinkSignal]) -> Vec<FieldDescriptorProto> {
    signals.iter().map(|signal| field(signal.name, signal.number as i32, signal.kind)).collect()
}

/// The file of protobuf's own times.
pub(super) const TIMESTAMP: &str = "google/protobuf/timestamp.proto";

/// Protobuf's own times.
pub(super) fn timestamp() -> FileDescriptorProto {
    let fields = vec![field("seconds", 1, Type::Int64), field("nanos", 2, Type::Int32)];
    FileDescriptorProto {
        name: Some(TIMESTAMP.into()),
        ..file("google.protobuf", vec![message("Timestamp", fields)])
    }
}

/// A field that is a message or an enumeration of this name.
pub(super) fn typed(field: FieldDescriptorProto, name: &str) -> FieldDescriptorProto {
    FieldDescriptorProto { type_name: Some(name.into()), ..field }
}

pub(super) fn field(name: &str, number: i32, kind: Type) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        ..FieldDescriptorProto::default()
    }
}

/// A message. A field that can be absent takes, in this syntax, a choice with one member; so can the `count` of a joint.
pub(super) fn message(name: &str, mut fields: Vec<FieldDescriptorProto>) -> DescriptorProto {
    let mut choices = Vec::new();
    let is_count = |field: &FieldDescriptorProto| field.name() == "count" && name == "Joint";
    for field in fields.iter_mut().filter(|field| field.proto3_optional() || is_count(field)) {
        field.proto3_optional = Some(true);
        field.oneof_index = Some(choices.len() as i32);
        let name = Some(format!("_{}", field.name()));
        choices.push(prost_types::OneofDescriptorProto { name, options: None });
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

pub(super) fn file(package: &str, messages: Vec<DescriptorProto>) -> FileDescriptorProto {
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
