//! `docs/protocol.md` and `tests/data/wire/vectors.json` say what the code does: what can be made from it is made here, and
//! compared. With `BLINDGRASP_BLESS=1` both are written anew; look at the difference then, because a vector that changes
//! is another interface version.
//!
//!     cargo test --release -p blindgrasp-tests --test science protocol -- --show-output

use blindgrasp::body::MAX_JOINTS;
use blindgrasp::model::HandModel;
use blindgrasp_shared::command::{Answer, Command, Grasp, Move, Refusal};
use blindgrasp_shared::control::{GAINS, Gain, LAWS, PerGain, PerSignal, SIGNALS, Signal};
use blindgrasp_shared::cycle::{Notice, Noticed};
use blindgrasp_shared::event::{Event, Events};
use blindgrasp_shared::fault::{Fault, Raised, Reaction};
use blindgrasp_shared::identity::{
    BrownOut, Clock, Crash, CrashKind, Identity, Image, ResetCause, Restored, UNITS,
};
use blindgrasp_shared::limit::{Limit, Limiting};
use blindgrasp_shared::link::message::{Packet, Reply, Request, Sample, Signals};
use blindgrasp_shared::link::{FrameError, InputRecord, Receiver, encode, most_bytes};
use blindgrasp_shared::parameters::{Bound, Each, Parameter, Setting};
use blindgrasp_shared::signals::Told;
use blindgrasp_shared::supervisor::{Event as ModeEvent, Mode, Outcome, outcome};
use blindgrasp_shared::telemetry::snapshot::{PART_BYTES, Part};
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, List, Record};
use blindgrasp_shared::tick::{Input, Params, State, tick};
use blindgrasp_tests::generated::{check, check_file, table};
use blindgrasp_tests::images::root;
use serde::ser::{Serialize, SerializeTuple, Serializer};
use serde_json::json;
use std::fmt::Write as _;
use std::fs;

const DOCUMENT: &str = "docs/protocol.md";
const VECTORS: &str = "tests/data/wire/vectors.json";

/// Capacity of everything here; the bytes do not depend on it.
const J: usize = 16;
/// Joints of the hand that the vectors are of.
const JOINTS: usize = 12;
/// Room for every payload here with its CRC.
const ROOM: usize = 1024;

type AnyRecord = Record<J>;

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Bytes as they are.
struct Raw<'a>(&'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

fn frame(message: &impl Serialize) -> Vec<u8> {
    let mut buffer = [0; most_bytes(ROOM)];
    encode(message, &mut buffer).expect("there is room").to_vec()
}

/// Nothing limits a joint.
const NOTHING: &[Limit] = &[];

/// Returns the payload that a receiver takes from a frame.
fn received(frame: &[u8]) -> Result<Vec<u8>, FrameError> {
    let mut receiver = Receiver::<ROOM>::new();
    let (last, before) = frame.split_last().expect("there are bytes");
    assert!(before.iter().all(|&byte| receiver.push(byte).is_none()));
    receiver.push(*last).expect("this is the end of a frame").map(<[u8]>::to_vec)
}

fn payload(frame: &[u8]) -> Vec<u8> {
    received(frame).expect("the frame is good")
}

// -------------------------------------------------------------------------------------------------- Examples of messages

fn counts(values: &[i32]) -> List<i32, J> {
    let mut items = [0; J];
    items[..values.len()].copy_from_slice(values);
    List::first_of(items, values.len())
}

fn torques(values: &[f32]) -> List<f32, J> {
    let mut items = [0.0; J];
    items[..values.len()].copy_from_slice(values);
    List::first_of(items, values.len())
}

fn limiting(values: &[&[Limit]]) -> List<Limiting, J> {
    let mut items = [Limiting::NONE; J];
    for (item, limits) in items.iter_mut().zip(values) {
        limits.iter().for_each(|&limit| item.insert(limit));
    }
    List::first_of(items, values.len())
}

/// Every request, and some of them more than once.
fn packets() -> Vec<(&'static str, Packet<J>)> {
    let grasp = Grasp { gains: PerGain { grasp: [Some(3.5), None], ..PerGain::all(None) } };
    let mut earlier = Grasp::CONFIGURED;
    (earlier.gains.grasp, earlier.gains.integral) = ([None, Some(0.0)], [Some(0.25)]);
    let movement = Move {
        position_m: [0.0, 0.0, -0.015],
        turn_rad: [0.0, 0.0, 0.35],
        about_m: [0.0, 0.0, 0.025],
        time_ms: 800,
    };
    let at_rest: Vec<i32> = (0..JOINTS as i32).map(|k| 300 * k - 1500).collect();
    let command = Request::Command;
    let requests = [
        ("hello", Request::Hello { interface_version: INTERFACE_VERSION }),
        ("arm", command(Command::Arm)),
        ("disarm", command(Command::Disarm)),
        ("grasp as configured", command(Command::Grasp(Grasp::CONFIGURED))),
        ("grasp with 3.5 N", command(Command::Grasp(grasp))),
        ("grasp by the earlier law", command(Command::Grasp(earlier))),
        ("release", command(Command::Release)),
        ("stop", command(Command::Stop)),
        ("clear fault", command(Command::ClearFault)),
        ("aim a joint", command(Command::Aim { joint: 4, angle_rad: -0.5 })),
        ("posture 1, in the shortest time", command(Command::Posture { posture: Some(1), time_ms: 0 })),
        ("posture that is aimed at, in 1.5 s", command(Command::Posture { posture: None, time_ms: 1500 })),
        ("move 15 mm up and by 20 degrees", command(Command::Move(movement))),
        ("put down", command(Command::PutDown)),
        ("weigh", command(Command::Weigh)),
        ("heartbeat", Request::Heartbeat),
        (
            "set a torque limit",
            Request::SetParameter { parameter: Parameter::TORQUE_LIMIT, index: 3, value: 0.25 },
        ),
        (
            "get the heartbeat's time",
            Request::GetParameter { parameter: Parameter::HEARTBEAT_TIME, index: 0 },
        ),
        ("telemetry at full rate, everything", Request::Telemetry { decimation: 1, signals: Signals::FULL }),
        ("no telemetry", Request::Telemetry { decimation: 0, signals: Signals::NONE }),
        (
            "joints of the processor in the loop",
            Request::Joints(Sample { counts: counts(&at_rest), failed: None, late: false }),
        ),
        (
            "joints that can't be read",
            Request::Joints(Sample {
                counts: counts(&[]),
                failed: Some(Raised::at(2, Fault::SampleMissing)),
                late: true,
            }),
        ),
        ("a record of the burst", Request::Burst { index: 191 }),
        ("goodbye", Request::Goodbye),
        ("a rate", Request::Rate { baud: 3_000_000 }),
        ("the zero of a joint", Request::Zero { joint: Some(3) }),
        ("the zeros of all joints", Request::Zero { joint: None }),
        ("confirm", Request::Confirm),
        ("save", Request::Save),
        ("defaults", Request::Defaults),
    ];
    let packet =
        |k: usize, (name, request)| (name, Packet { session: 1, sequence: 0x1234 + k as u16, request });
    requests.into_iter().enumerate().map(|(k, named)| packet(k, named)).collect()
}

/// The place of each request in the enum. A new one is missed here by the compiler.
fn number(request: &Request<J>) -> usize {
    match request {
        Request::Hello { .. } => 0,
        Request::Command(_) => 1,
        Request::Heartbeat => 2,
        Request::SetParameter { .. } => 3,
        Request::GetParameter { .. } => 4,
        Request::Telemetry { .. } => 5,
        Request::Joints(_) => 6,
        Request::Burst { .. } => 7,
        Request::Goodbye => 8,
        Request::Rate { .. } => 9,
        Request::Zero { .. } => 10,
        Request::Confirm => 11,
        Request::Save => 12,
        Request::Defaults => 13,
    }
}

const IDENTITY: Identity<'static> = Identity {
    image: Image {
        interface_version: INTERFACE_VERSION,
        kind: "hand",
        hand: "three-finger",
        hand_hash: 0x2467_6c70,
        firmware_version: "0.1.0",
        build_hash: 0x25c4_2b05,
        joint_count: 12,
        fingertip_count: 3,
        period_us: 1000,
    },
    units: UNITS,
    clock: Clock::External,
    reset: ResetCause::PowerOn,
    crash: None,
    brown_out: BrownOut::Level3,
    clock_hz: 168_000_000,
    most_baud: 1_000_000,
    changed: 0,
    restored: Some(Restored { saved: 2, ignored: 1 }),
};

/// Values for the gains of two laws, and 0 for those of others.
fn of_laws(grasp: [f32; 2], integral: f32) -> PerGain<f32> {
    let mut values = PerGain::all(0.0);
    (values.grasp, values.integral) = (grasp, [integral]);
    values
}

/// A hand of three joints in a fault.
fn faulted() -> AnyRecord {
    Record {
        sequence: 300,
        tick: 70_000,
        mode: Mode::Fault,
        fault: Some(Raised::at(2, Fault::CountJump)),
        answer: Some(Answer { command: Command::ClearFault, refused: Some(Refusal::FaultPersists) }),
        notice: Some(Noticed::at(1, Notice::NeverTouched)),
        events: Events::NONE.with(Event::Late, true),
        reading_failed: Some(Raised::of_hand(Fault::SampleMissing)),
        gains: of_laws([5.0, 0.005], 0.375),
        potentials_j: of_laws([0.25, 0.125], 0.75),
        law_signals: PerSignal::all(0.0),
        work_j: -0.5,
        damped_j: 0.03125,
        weight_n: 0.75,
        cycles: 20_000,
        late_ticks: 2,
        dropped: 1,
        decimation: 300,
        counts: counts(&[0, -1, 21_600]),
        torques_nm: torques(&[0.5, -1.25, 0.0]),
        limiting: limiting(&[&[], &[Limit::Torque, Limit::UpperStop], &[]]),
        ..Record::BLANK
    }
}

/// A hand of twelve joints that grasps: record `k` of a stream with one in `decimation` ticks, whose joints turn by so
/// many counts each. The numbers say nothing; they are made to be of the size that such numbers have.
fn grasping(k: u32, decimation: u16, step: i32) -> AnyRecord {
    let share = f32::from(k as u16) / 64.0;
    let count = |joint: i32| {
        (joint - 6).wrapping_mul(500).wrapping_add((k as i32).wrapping_mul(step * (joint % 5 - 2)))
    };
    Record {
        sequence: 1000_u32.wrapping_add(k),
        tick: 5000_u32.wrapping_add(k.wrapping_mul(u32::from(decimation))),
        mode: Mode::Grasping,
        fault: None,
        answer: None,
        events: Events::NONE.with(Event::Heartbeat, k % 50 == 3),
        reading_failed: None,
        gains: of_laws([5.0 * share, 0.005], 0.0),
        potentials_j: of_laws([0.2 - 0.1 * share, 0.001 * share], 0.0),
        law_signals: PerSignal::all(0.0),
        work_j: 0.002 + 0.003 * share,
        damped_j: 0.0005 * share,
        cycles: 11_603 + k,
        late_ticks: 0,
        dropped: 0,
        decimation,
        counts: counts(&(0..JOINTS as i32).map(count).collect::<Vec<_>>()),
        torques_nm: torques(&(0..JOINTS).map(|j| 0.3 * share - 0.01 * j as f32).collect::<Vec<_>>()),
        limiting: limiting(&[NOTHING; JOINTS]),
        ..Record::BLANK
    }
}

/// Every reply.
fn replies() -> Vec<(&'static str, Reply<'static, J>)> {
    let answer = |refused| Reply::Answer { sequence: 0x1235, refused };
    let crash = Crash {
        kind: CrashKind::HardFault,
        program_counter: 0x0800_1234,
        link_register: 0x0800_4321,
        line: 0,
        file_hash: 0,
    };
    let clock = Clock::Fallback;
    let after_a_crash = Identity { clock, reset: ResetCause::Software, crash: Some(crash), ..IDENTITY };
    let mut bytes = [0; 64];
    (0..).zip(&mut bytes).for_each(|(k, byte)| *byte = 3 * k);
    let part = Part { tick: 5000, offset: 896, length: 903, bytes: List::first_of(bytes, 7) };
    vec![
        (
            "identity",
            Reply::Identity { sequence: 0x1234, session: 1, identity: IDENTITY, ends_another: false },
        ),
        (
            "identity after a crash",
            Reply::Identity { sequence: 7, session: 2, identity: after_a_crash, ends_another: true },
        ),
        ("done", answer(None)),
        ("refused", answer(Some(Refusal::InFault))),
        (
            "value",
            Reply::Value {
                sequence: 0x123e,
                parameter: Parameter::HEARTBEAT_TIME,
                index: 0,
                setting: Setting { value: 200.0, file: 250.0 },
            },
        ),
        ("record of three joints in a fault", Reply::Record(faulted())),
        ("record of twelve joints", Reply::Record(grasping(64, 1, 20))),
        ("record of a burst", Reply::Burst { sequence: 0x1243, index: 191, count: 256, record: faulted() }),
        ("last part of a snapshot", Reply::Snapshot(part)),
        ("input record of three joints in a fault", Reply::Input(InputRecord::of(&faulted()))),
        ("input record of twelve joints", Reply::Input(InputRecord::of(&grasping(64, 1, 20)))),
    ]
}

// ------------------------------------------------------------------------------------------------------------ Vectors

fn messages() -> Vec<serde_json::Value> {
    let vector = |name: &str, from: &str, message: serde_json::Value, frame: &[u8]| {
        json!({
            "name": name, "from": from, "message": message, "payload": hex(&payload(frame)), "frame": hex(frame)
        })
    };
    let mut vectors = Vec::new();
    for (name, packet) in packets() {
        let frame = frame(&packet);
        assert_eq!(Packet::decode(&payload(&frame)), Ok(packet.clone()), "{name}");
        vectors.push(vector(name, "host", json!(packet), &frame));
    }
    for (name, reply) in replies() {
        let frame = frame(&reply);
        assert_eq!(Reply::decode(&payload(&frame)), Ok(reply.clone()), "{name}");
        vectors.push(vector(name, "device", json!(reply), &frame));
    }
    vectors
}

/// Payloads whose stuffing is at one of its edges.
fn stuffed() -> Vec<serde_json::Value> {
    let run = |bytes: usize| (0..bytes).map(|k| (k % 255) as u8 + 1).collect::<Vec<u8>>();
    let mut payloads = vec![
        ("no payload".to_owned(), vec![]),
        ("a zero".to_owned(), vec![0]),
        ("zeros".to_owned(), vec![0; 5]),
        ("a zero at each end".to_owned(), vec![0, 1, 2, 0]),
        ("zeros in the middle".to_owned(), vec![7, 0, 0, 0, 0, 8]),
        ("ff ff ff ff and zeros".to_owned(), [[0xff; 4], [0; 4]].concat()),
        ("300 zeros".to_owned(), vec![0; 300]),
    ];
    // With the CRC, blocks of 254 bytes end with them, before them, and after them.
    for bytes in [249, 250, 251, 253, 254, 255, 504, 508, 509] {
        payloads.push((format!("{bytes} bytes without a zero"), run(bytes)));
    }
    for bytes in [253, 254, 255] {
        payloads.push((format!("{bytes} bytes and a zero"), [run(bytes), vec![0]].concat()));
        payloads.push((format!("a zero and {bytes} bytes"), [vec![0], run(bytes)].concat()));
    }
    let vector = |(name, bytes): (String, Vec<u8>)| {
        let frame = frame(&Raw(&bytes));
        assert_eq!(payload(&frame), bytes, "{name}");
        json!({ "name": name, "payload": hex(&bytes), "frame": hex(&frame) })
    };
    payloads.into_iter().map(vector).collect()
}

/// Frames that are taken although [`encode`] writes them otherwise.
fn also_good() -> Vec<serde_json::Value> {
    // A payload that makes, with its CRC, one block of 254 bytes.
    let bytes = (1..=u8::MAX).cycle().take(250).collect::<Vec<u8>>();
    let mut with_empty_block = frame(&Raw(&bytes));
    assert_eq!(with_empty_block.len(), 256, "no zero is in the CRC");
    with_empty_block.insert(255, 1);
    assert_eq!(payload(&with_empty_block), bytes);
    vec![json!({
        "name": "an empty last block after a full one", "payload": hex(&bytes), "frame": hex(&with_empty_block)
    })]
}

fn damaged() -> Vec<serde_json::Value> {
    let good = frame(&packets()[1].1);
    let changed = |at: usize, to: u8| {
        let mut frame = good.clone();
        assert!(frame[at] != to && to != 0);
        frame[at] = to;
        frame
    };
    let without = |at: usize| {
        let mut frame = good.clone();
        frame.remove(at);
        frame
    };
    let plain_crc = {
        // That of zlib without the ten bytes: of nothing it is 0.
        vec![1, 1, 1, 1, 1, 0]
    };
    let zeros = frame(&Raw(&[0; 5]));
    let frames = [
        ("a flipped bit in the payload", changed(2, good[2] ^ 0x10), FrameError::BadCrc),
        ("a flipped bit in the CRC", changed(good.len() - 2, good[good.len() - 2] ^ 1), FrameError::BadCrc),
        ("a byte too few", without(2), FrameError::BadCode),
        ("a code that is too large", changed(0, 200), FrameError::BadCode),
        ("a code that is too small", changed(0, good[0] - 1), FrameError::BadCrc),
        ("the beginning of a frame", [&good[..4], &[0]].concat(), FrameError::BadCode),
        ("three bytes", vec![4, 1, 2, 3, 0], FrameError::TooShort),
        ("a code alone", vec![1, 0], FrameError::TooShort),
        ("zeros with the CRC of zlib", plain_crc, FrameError::BadCrc),
        ("a lost zero", zeros[1..].to_vec(), FrameError::BadCrc),
        (
            "two frames without a 0x00 between them",
            [&good[..good.len() - 1], &good].concat(),
            FrameError::BadCrc,
        ),
    ];
    let vector = |(name, frame, why): (&str, Vec<u8>, FrameError)| {
        let seen = received(&frame);
        assert_eq!(seen, Err(why), "{name}");
        json!({ "name": name, "frame": hex(&frame), "why": format!("{why:?}") })
    };
    frames.into_iter().map(vector).collect()
}

/// Payloads that came as they were sent, and are no messages.
fn malformed() -> Vec<serde_json::Value> {
    let heartbeat = payload(&frame(&packets()[8].1));
    let identity = payload(&frame(&replies()[0].1));
    let from_host = [
        ("nothing", vec![]),
        ("a request of a later version", vec![1, 1, 0x7f]),
        ("a session above 65535", vec![0xff, 0xff, 0x04, 1, 2]),
        ("a number that does not end", vec![0xff, 0xff, 0xff, 0xff, 2]),
        ("a byte too many", [&heartbeat[..], &[0]].concat()),
        ("no request", heartbeat[..heartbeat.len() - 1].to_vec()),
        ("a command of a later version", vec![1, 1, 1, 11]),
        ("an option that is neither", vec![1, 1, 1, 2, 2, 0]),
        ("a bool that is neither", vec![1, 1, 6, 0, 0, 2]),
        ("a fault of a later version", vec![1, 1, 6, 0, 1, 200, 0, 0]),
    ];
    let mut not_text = identity.clone();
    not_text[5] = 0xff;
    let from_device = [
        ("a reply of a later version", vec![0x7f, 1, 0]),
        ("a refusal of a later version", vec![1, 1, 1, 0x7f]),
        ("a text that is not UTF-8", not_text),
        ("an identity that ends too early", identity[..identity.len() - 1].to_vec()),
    ];
    let mut vectors = Vec::new();
    for (name, payload) in from_host {
        assert!(Packet::<J>::decode(&payload).is_err(), "{name}");
        vectors.push(json!({ "name": name, "from": "host", "payload": hex(&payload) }));
    }
    for (name, payload) in from_device {
        assert!(Reply::<J>::decode(&payload).is_err(), "{name}");
        vectors.push(json!({ "name": name, "from": "device", "payload": hex(&payload) }));
    }
    vectors
}

#[test]
fn every_message_is_among_the_vectors() {
    let mut requests: Vec<usize> = packets().iter().map(|(_, packet)| number(&packet.request)).collect();
    requests.dedup();
    assert_eq!(requests, (0..14).collect::<Vec<_>>());
    let mut numbers: Vec<u8> = replies().iter().map(|(_, reply)| payload(&frame(reply))[0]).collect();
    numbers.dedup();
    assert_eq!(numbers, (0..7).collect::<Vec<_>>());
}

#[test]
fn the_vectors_are_those_of_the_code() {
    let parts = [
        ("messages", messages()),
        ("frames", stuffed()),
        ("also_good", also_good()),
        ("damaged_frames", damaged()),
        ("malformed", malformed()),
    ];
    let mut text = format!("{{\n\"interface_version\": {INTERFACE_VERSION}");
    for (name, vectors) in &parts {
        // A line each, so that a difference is seen as what it is.
        let lines: Vec<String> = vectors.iter().map(ToString::to_string).collect();
        let _ = write!(text, ",\n\"{name}\": [\n{}\n]", lines.join(",\n"));
    }
    text += "\n}\n";
    let path = root().join(VECTORS);
    if std::env::var("BLINDGRASP_BLESS").is_ok_and(|bless| bless == "1") {
        fs::write(&path, &text).unwrap_or_else(|error| panic!("{VECTORS}: {error}"));
    }
    let there = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{VECTORS}: {error}"));
    let differ = text.lines().zip(there.lines()).find(|(new, old)| new != old);
    assert!(
        text == there,
        "{VECTORS} is not what the code does:\n{differ:#?}\nthis is another interface version: raise it, and then run this \
         test with BLINDGRASP_BLESS=1"
    );
}

// ----------------------------------------------------------------------------------------------------------- Document

/// Returns the names of unit variants, with their numbers.
fn numbered<T: std::fmt::Debug>(values: &[T], words: impl Fn(&T) -> &'static str) -> Vec<[String; 3]> {
    let row = |(k, value): (usize, &T)| [k.to_string(), format!("`{value:?}`"), words(value).to_owned()];
    values.iter().enumerate().map(row).collect()
}

/// The unit variants of an enum in a sentence, each with its number.
fn listed<T: std::fmt::Debug>(values: &[T], words: impl Fn(&T) -> &'static str) -> String {
    let items = numbered(values, words).into_iter().map(|[number, name, words]| {
        let is_known = name.to_lowercase() == format!("`{words}`");
        if is_known { format!("{number} {name}") } else { format!("{number} {name} ({words})") }
    });
    items.collect::<Vec<_>>().join(", ") + ".\n"
}

/// Bits in a sentence, each with its meaning.
fn bits<const N: usize>(bits: [(u8, &'static str); N]) -> String {
    bits.map(|(bit, words)| format!("{bit} {words}")).join(", ") + ".\n"
}

#[test]
fn the_tables_of_the_document_are_those_of_the_code() {
    let three = ["number", "name", "meaning"];
    let commands: Vec<String> = (0..)
        .zip(Command::ALL)
        .map(|(k, command): (usize, _)| {
            assert_eq!(payload(&frame(&command))[0], k as u8);
            let words = command.words();
            match command {
                Command::Grasp(_) => {
                    let gains = GAINS.map(|gain| format!("`{}`", gain.key)).join(", ");
                    format!("{k} {words} (of {gains} an option of f32 each)")
                }
                Command::Aim { .. } => format!("{k} {words} (`joint: u8`, `angle_rad: f32`)"),
                Command::Posture { .. } => format!("{k} {words} (`posture: option u8`, `time_ms: u16`)"),
                Command::Move(_) => {
                    format!("{k} {words} (`position_m`, `turn_rad`, `about_m`: 3 `f32` each, `time_ms: u16`)")
                }
                _ => format!("{k} {words}"),
            }
        })
        .collect();
    check(DOCUMENT, "commands", &(commands.join(", ") + ".\n"));
    check(DOCUMENT, "refusals", &table(three, &numbered(Refusal::ALL, |refusal| refusal.words())));
    let notices = numbered(Notice::ALL, |notice| notice.words());
    check(DOCUMENT, "notices", &table(three, &notices));
    check(DOCUMENT, "modes", &listed(&Mode::ALL, |mode| mode.words()));
    let faults: Vec<[String; 4]> = Fault::ALL
        .iter()
        .map(|fault| {
            let done = match fault.reaction() {
                Reaction::TorqueOff => "torque off",
                Reaction::Release => "lets go, then torque off",
            };
            [fault.number().to_string(), format!("`{fault:?}`"), fault.words().into(), done.into()]
        })
        .collect();
    check(DOCUMENT, "faults", &table(["number", "name", "what is wrong", "what is done"], &faults));
    let parameters = Parameter::ALL.map(|parameter| {
        let each = match parameter.each() {
            Each::Hand => "0",
            Each::Joint => "joint",
            Each::Axis => "axis: x, y, z",
        };
        let bound = match parameter.bound() {
            Bound::Free => "",
            Bound::AtMost => "most",
            Bound::AtLeast => "least",
        };
        let (key, words) = (format!("`{}`", parameter.key()), parameter.words().to_string());
        [parameter.number().to_string(), key, each.into(), parameter.unit().into(), bound.into(), words]
    });
    let head = ["number", "key", "index", "unit", "the file's is the", "meaning"];
    check(DOCUMENT, "parameters", &table(head, &parameters));
    let mut signals = Vec::new();
    AnyRecord::BLANK.tell(|told: Told<'_>| {
        let Signal { key, unit, words } = told.signal;
        // Events and gains have their words above.
        if Event::ALL.iter().all(|event| event.key() != key) && GAINS.iter().all(|gain| gain.key != key) {
            let each = if told.each == Each::Joint { " (each joint)" } else { "" };
            signals.push([format!("`{key}`{each}"), unit.into(), words.into()]);
        }
    });
    let record: Vec<[String; 2]> = AnyRecord::FIELDS
        .iter()
        .map(|(name, kind)| {
            let kind = match *kind {
                "Mode" => "mode",
                "Option<Raised>" => "`option raised`",
                "Option<Answer>" => "option of `command` and `refused: option refusal`",
                "Option<Noticed>" => "`option noticed`",
                "Events" => "events",
                "PerGain<f32>" => "`f32` for each gain of each law, without their number",
                "PerSignal<f32>" => "`f32` for each other signal of each law, without their number",
                "List<i32, J>" => "`list i32`: a joint each, or none",
                "List<f32, J>" => "`list f32`: a joint each, or none",
                "List<Limiting, J>" => "`list u8`: limits, a joint each, or none",
                number => return [format!("`{name}`"), format!("`{number}`")],
            };
            [format!("`{name}`"), kind.to_owned()]
        })
        .collect();
    check(DOCUMENT, "record", &table(["field", "type"], &record));
    let gains: Vec<[String; 4]> = (GAINS.iter().zip(PerGain::LAW.iter()))
        .map(|(gain, &law)| {
            let law = LAWS[usize::from(law)].0;
            let (key, potential) = (format!("`{}`", gain.key), format!("`{}`", gain.potential.key));
            [format!("`{law}`"), key, gain.unit.into(), potential]
        })
        .collect();
    check(DOCUMENT, "gains", &table(["law", "gain", "unit", "potential"], &gains));
    check(DOCUMENT, "signals", &table(["signal", "unit", "meaning"], &signals));
    check(DOCUMENT, "limits", &bits(Limit::ALL.map(|limit| (limit as u8, limit.words()))));
    check(DOCUMENT, "events", &bits(Event::ALL.map(|event| (event as u8, event.words()))));
    let clocks = [Clock::External, Clock::Fallback, Clock::Emulated];
    check(DOCUMENT, "clocks", &listed(&clocks, |clock| clock.words()));
    let causes = [
        ResetCause::PowerOn,
        ResetCause::BrownOut,
        ResetCause::Pin,
        ResetCause::Software,
        ResetCause::IndependentWatchdog,
        ResetCause::WindowWatchdog,
        ResetCause::LowPower,
        ResetCause::Unknown,
    ];
    check(DOCUMENT, "resets", &listed(&causes, |cause| cause.words()));
    let levels = [BrownOut::Level3, BrownOut::Level2, BrownOut::Level1, BrownOut::Off, BrownOut::Unknown];
    check(DOCUMENT, "brown-out levels", &listed(&levels, |level| level.words()));
}

/// The tables of the Python client, written from those of the code.
#[test]
fn the_tables_of_the_client_are_those_of_the_code() {
    let text = |words: &str| json!(words).to_string();
    let list = |names: &[&str]| names.iter().map(|name| text(name)).collect::<Vec<_>>().join(", ");
    let mut module = String::from(
        "\"\"\"Vocabulary of the wire, written by tests/tests/protocol.rs from the tables of the firmware.\"\"\"\n\n",
    );
    let _ = writeln!(module, "INTERFACE_VERSION = {INTERFACE_VERSION}");
    let mut dictionary = |name: &str, rows: Vec<(String, String)>| {
        let _ = writeln!(module, "{name} = {{");
        for (key, value) in rows {
            let _ = writeln!(module, "    {key}: {value},");
        }
        let _ = writeln!(module, "}}");
    };
    dictionary(
        "FAULTS",
        Fault::ALL.iter().map(|fault| (fault.number().to_string(), text(fault.words()))).collect(),
    );
    dictionary("REFUSALS", Refusal::ALL.iter().map(|r| (text(&format!("{r:?}")), text(r.words()))).collect());
    let notices = Notice::ALL.iter().map(|n| (text(&format!("{n:?}")), text(n.words())));
    dictionary("NOTICES", notices.collect());
    dictionary("EVENTS", Event::ALL.map(|event| (text(event.key()), (event as u8).to_string())).into());
    dictionary("LIMITS", Limit::ALL.map(|limit| (text(limit.key()), (limit as u8).to_string())).into());
    let per_law = |keys: &[(u8, &str)]| {
        let of = |law: u8| keys.iter().filter(|(of, _)| *of == law).map(|(_, key)| *key).collect::<Vec<_>>();
        let row = |(law, (name, _)): (u8, &(&str, &str))| (text(name), format!("[{}]", list(&of(law))));
        (0..).zip(LAWS).map(row).collect::<Vec<_>>()
    };
    let gains = |key: fn(&Gain) -> &'static str| {
        PerGain::LAW.iter().copied().zip(GAINS.iter().map(key)).collect::<Vec<_>>()
    };
    dictionary("GAINS", per_law(&gains(|gain| gain.key)));
    dictionary("POTENTIALS", per_law(&gains(|gain| gain.potential.key)));
    dictionary(
        "LAW_SIGNALS",
        per_law(&PerSignal::LAW.iter().copied().zip(SIGNALS.iter().map(|s| s.key)).collect::<Vec<_>>()),
    );
    let modes = Mode::ALL.map(|mode| format!("{mode:?}"));
    let modes = modes.iter().map(String::as_str).collect::<Vec<_>>();
    let _ = writeln!(module, "MODES = [{}]", list(&modes));
    let _ = writeln!(module, "# By their numbers.\nPARAMETERS = [");
    for parameter in Parameter::ALL {
        let _ = writeln!(module, "    {},", text(&parameter.to_string()));
    }
    let _ = writeln!(
        module,
        "]\n# Names and types of a record's fields, in the order of their bytes.\nRECORD_FIELDS = ["
    );
    for (name, kind) in AnyRecord::FIELDS {
        let _ = writeln!(module, "    ({}, {}),", text(name), text(kind));
    }
    module += "]\n";
    check_file("examples/python/blindgrasp_tables.py", &module);
}

#[test]
fn the_table_of_modes_is_that_of_the_code() {
    let cells = |mode: Mode, events: &[ModeEvent]| {
        let cell = |&event: &ModeEvent| match outcome(mode, event) {
            Outcome::Enter(next) if next == mode => "stays".to_owned(),
            Outcome::Enter(next) => format!("**{}**", next.words()),
            Outcome::Refuse(refusal) => format!("`{refusal:?}`"),
        };
        std::iter::once(mode.words().to_owned()).chain(events.iter().map(cell)).collect::<Vec<_>>()
    };
    let commands = Command::ALL.map(ModeEvent::Command);
    let rows = Mode::ALL.map(|mode| <[String; 12]>::try_from(cells(mode, &commands)).expect("a cell each"));
    let words = Command::ALL.map(Command::words);
    let head: Vec<&str> = std::iter::once("mode").chain(words).collect();
    let head = <[&str; 12]>::try_from(head).expect("a column each");
    check(DOCUMENT, "table of modes", &table(head, &rows));
    let events = [
        (ModeEvent::Fault, "fault"),
        (ModeEvent::Released, "release over"),
        (ModeEvent::Opened, "release over, and there is a posture `open`"),
        (ModeEvent::Touched, "all fingertips touch"),
        (ModeEvent::Missed, "empty, or lost"),
        (ModeEvent::Firm, "force at its full, and there is a virtual frame"),
        (ModeEvent::Down, "put down"),
    ];
    let of_events = events.map(|(event, _)| event);
    let rows = Mode::ALL.map(|mode| <[String; 8]>::try_from(cells(mode, &of_events)).expect("a cell each"));
    let head: Vec<&str> = std::iter::once("mode").chain(events.map(|(_, words)| words)).collect();
    let head = <[&str; 8]>::try_from(head).expect("a column each");
    check(DOCUMENT, "table of events", &table(head, &rows));
}

#[test]
fn the_examples_of_the_document_are_those_of_the_code() {
    let find = |name: &str| {
        let named = messages().into_iter().find(|vector| vector["name"] == name);
        named.unwrap_or_else(|| panic!("there is no vector {name}"))
    };
    let mut text = String::new();
    for name in ["hello", "arm", "grasp with 3.5 N", "move 15 mm up and by 20 degrees"] {
        let vector = find(name);
        let words = |key: &str| vector[key].as_str().expect("a text").to_owned();
        let _ = write!(
            text,
            "\n*{name}*\n\n```text\nmessage  {}\npayload  {}\nframe    {}\n```\n",
            vector["message"],
            words("payload"),
            words("frame")
        );
    }
    check(DOCUMENT, "examples", &text);
}

/// Bytes on the wire of the parts of a snapshot of the paper's hand, while it grasps.
fn snapshot_frames() -> Vec<usize> {
    let model = HandModel::load("three-finger").expect("it is built in");
    let params = Params::new(model.hand.cast(), &model.config).expect("it is a hand");
    let mut state = State::new();
    for command in [Command::Arm, Command::Grasp(Grasp::CONFIGURED)] {
        let input = Input::counts(&[0; MAX_JOINTS], Some(command));
        let output = tick(&params, &mut state, &input.with(Events::NONE.with(Event::Heartbeat, true)));
        assert_eq!(output.record.answer, Some(Answer { command, refused: None }));
    }
    let mut buffer = [0; 8192];
    let saved = state.save(&params, &mut buffer).expect("there is room");
    let length = saved.len() as u16;
    let part = |(k, bytes): (usize, &[u8])| {
        let mut items = [0; PART_BYTES];
        items[..bytes.len()].copy_from_slice(bytes);
        let offset = (k * PART_BYTES) as u16;
        // A tick that takes as many bytes as it ever does.
        let part = Part { tick: u32::MAX, offset, length, bytes: List::first_of(items, bytes.len()) };
        frame(&Reply::<J>::Snapshot(part)).len()
    };
    saved.chunks(PART_BYTES).enumerate().map(part).collect()
}

#[test]
fn the_budget_of_the_document_is_that_of_the_code() {
    // Counts of three bytes: more than four turns of a joint from the zero.
    let turned = |joints: usize| {
        let record = grasping(64, 1, 20);
        let mut counts = [0; J];
        (0..).zip(&mut counts).for_each(|(k, count)| *count = 100_000 - 13_000 * k);
        let mut torques = [0.0; J];
        (0..).zip(&mut torques).for_each(|(k, torque)| *torque = 0.3 - 0.01 * f32::from(k as u8));
        let far = 1_000_000_000;
        Record {
            sequence: far,
            tick: far,
            counts: List::first_of(counts, joints),
            torques_nm: List::first_of(torques, joints),
            limiting: List::first_of([Limiting::NONE; J], joints),
            ..record
        }
    };
    let [input_12, input_16] =
        [12, 16].map(|joints| frame(&Reply::Input(InputRecord::of(&turned(joints)))).len());
    let [full_12, full_16] = [12, 16].map(|joints| frame(&Reply::Record(turned(joints))).len());
    assert!(input_12 <= 75 && input_16 <= 95, "{input_12}, {input_16}");
    assert!(full_16 <= 240, "{full_16}");
    let snapshot = snapshot_frames();
    let words =
        format!("snapshots of a grasp, a tick on average: {} frames every 1000 ticks", snapshot.len());
    let snapshots = snapshot.iter().sum::<usize>() as f64 / 1000.0;
    let rows = [
        ["input record".to_owned(), input_12.to_string(), input_16.to_string()],
        ["full record".to_owned(), full_12.to_string(), full_16.to_string()],
        [words, format!("{snapshots:.1}"), String::new()],
    ];
    check(DOCUMENT, "budget", &table(["bytes", "12 joints", "16 joints"], &rows));
}
