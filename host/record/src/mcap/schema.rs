//! The schemas of the decoded channels: protobuf descriptors made for a hand, JSON schemas, and the signal table.
//!
//! The fields of a tick are those of the tables of signals, in their order: [`tick_signals`] numbers them, for the
//! descriptors, the signal table and the encoding.

use super::message::{Level, LinkStatus};
use super::protobuf::{nested, present_whole, text, whole};
use crate::derived::Derived;
use blindgrasp_shared::control::Signal;
use blindgrasp_shared::fault::Fault;
use blindgrasp_shared::limit::Limit;
use blindgrasp_shared::parameters::Each;
use blindgrasp_shared::signals::Kind;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_wire::Record;
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
            Self::Told(Kind::Joint | Kind::Answer | Kind::Notice | Kind::Limiting) => Type::String,
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
    let described = |signal: &TickSignal| Field {
        type_name: match signal.kind {
            FieldKind::Told(Kind::Mode) => full("Mode"),
            FieldKind::Told(Kind::Fault) => full("Fault"),
            _ => String::new(),
        },
        // It is missing where angles came from elsewhere.
        optional: signal.kind == FieldKind::Told(Kind::Count),
        ..field(&signal.name, signal.number, signal.kind.proto())
    };
    let signals = tick_signals();
    let of = |each| signals.iter().filter(move |signal| signal.each == each).map(described).collect();
    let mut tick_fields: Vec<Field> = of(Each::Hand);
    tick_fields.push(typed("joints", JOINTS, Type::Message, full("Joints")));
    let joints = joint_fields(joint_names).into_iter().zip(1..);
    let joints = joints.map(|(name, number)| typed(&name, number, Type::Message, full("Joint")));
    let modes = Mode::ALL.iter().map(|mode| (upper_case(&format!("{mode:?}")), *mode as u64));
    let faults =
        Fault::ALL.iter().map(|fault| (upper_case(&format!("{fault:?}")), u64::from(fault.number())));
    let tick = Message {
        nested: vec![message("Joint", of(Each::Joint)), message("Joints", joints.collect())],
        enums: vec![
            ("Mode", modes.collect()),
            ("Fault", std::iter::once(("NO_FAULT".into(), 0)).chain(faults).collect()),
        ],
        ..message("Tick", tick_fields)
    };
    (format!("{package}.Tick"), file(&package, &package, "", &[tick]))
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
    let fields = LinkStatus::SIGNALS.iter().map(|&(number, name, kind, ..)| field(name, number, kind));
    file("blindgrasp", "blindgrasp", "", &[message("Link", fields.collect())])
}

/// The schema of events, which viewers know.
fn of_log() -> Vec<u8> {
    let fields = vec![
        time(),
        typed("level", 2, Type::Enum, ".foxglove.Log.Level".into()),
        field("message", 3, Type::String),
        field("name", 4, Type::String),
        field("file", 5, Type::String),
        field("line", 6, Type::Fixed32),
    ];
    let levels = Level::ALL.map(|level| (upper_case(&format!("{level:?}")), level as u64));
    timed(LOG, &[Message { enums: vec![("Level", levels.into())], ..message("Log", fields) }])
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
    let of_link = LinkStatus::SIGNALS.iter().map(|(_, name, _, unit, words)| row(name, unit, words));
    json!({ "tick": of_tick.collect::<Vec<_>>(), "link": of_link.collect::<Vec<_>>() })
}

/// A type of a field, with the number that it has in descriptors.
#[derive(Clone, Copy)]
pub(super) enum Type {
    Double = 1,
    Float = 2,
    Int64 = 3,
    Uint64 = 4,
    Int32 = 5,
    Fixed32 = 7,
    Bool = 8,
    String = 9,
    Message = 11,
    Uint32 = 13,
    Enum = 14,
    Sint32 = 17,
}

/// A field of a message.
pub(super) struct Field {
    pub(super) name: String,
    pub(super) number: u32,
    pub(super) kind: Type,
    /// Name of the message or enumeration, if it is one.
    pub(super) type_name: String,
    pub(super) repeated: bool,
    pub(super) optional: bool,
}

/// A message, with the messages and the enumerations in it.
pub(super) struct Message {
    name: String,
    fields: Vec<Field>,
    nested: Vec<Message>,
    enums: Vec<(&'static str, Vec<(String, u64)>)>,
}

pub(super) fn field(name: &str, number: u32, kind: Type) -> Field {
    typed(name, number, kind, String::new())
}

/// A field that is a message or an enumeration of this name.
pub(super) fn typed(name: &str, number: u32, kind: Type, type_name: String) -> Field {
    Field { name: name.into(), number, kind, type_name, repeated: false, optional: false }
}

/// The first field of every message that has a time.
pub(super) fn time() -> Field {
    typed("timestamp", 1, Type::Message, ".google.protobuf.Timestamp".into())
}

pub(super) fn message(name: &str, fields: Vec<Field>) -> Message {
    Message { name: name.into(), fields, nested: Vec::new(), enums: Vec::new() }
}

impl Message {
    /// Writes its descriptor. A field that can be absent takes, in this syntax, a choice with one member.
    fn write(&self, buffer: &mut Vec<u8>, number: u32) {
        nested(buffer, number, |buffer| {
            text(buffer, 1, &self.name);
            let mut choices = Vec::new();
            for field in &self.fields {
                nested(buffer, 2, |buffer| {
                    text(buffer, 1, &field.name);
                    whole(buffer, 3, field.number.into());
                    whole(buffer, 4, if field.repeated { 3 } else { 1 });
                    whole(buffer, 5, field.kind as u64);
                    text(buffer, 6, &field.type_name);
                    if field.optional {
                        present_whole(buffer, 9, choices.len() as u64);
                        whole(buffer, 17, 1);
                        choices.push(format!("_{}", field.name));
                    }
                });
            }
            self.nested.iter().for_each(|message| message.write(buffer, 3));
            for (name, values) in &self.enums {
                nested(buffer, 4, |buffer| {
                    text(buffer, 1, name);
                    for (name, number) in values {
                        nested(buffer, 2, |buffer| {
                            text(buffer, 1, name);
                            present_whole(buffer, 2, *number);
                        });
                    }
                });
            }
            choices.iter().for_each(|name| nested(buffer, 8, |buffer| text(buffer, 1, name)));
        });
    }
}

/// A set with one file of descriptors, whose path is made of a dotted name.
fn file(name: &str, package: &str, dependency: &str, messages: &[Message]) -> Vec<u8> {
    let mut set = Vec::new();
    nested(&mut set, 1, |buffer| {
        text(buffer, 1, &format!("{}.proto", name.replace('.', "/")));
        text(buffer, 2, package);
        text(buffer, 3, dependency);
        messages.iter().for_each(|message| message.write(buffer, 4));
        text(buffer, 12, "proto3");
    });
    set
}

/// A set with the file of a schema that needs protobuf's own times, behind the file of these.
pub(super) fn timed(schema: &str, messages: &[Message]) -> Vec<u8> {
    let fields = vec![field("seconds", 1, Type::Int64), field("nanos", 2, Type::Int32)];
    let times = file("google.protobuf.timestamp", "google.protobuf", "", &[message("Timestamp", fields)]);
    let package = schema.split('.').next().unwrap_or_default();
    [times, file(schema, package, "google/protobuf/timestamp.proto", messages)].concat()
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
