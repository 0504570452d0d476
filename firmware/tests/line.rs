//! The bytes that leave the line when the processor is charged for all that it does: the link's own code, under a clock
//! that leaves it only the time that the control task does not take.
//!
//! The emulator has no time on its SPI buses, no DMA and no baud rate; here all three are, as arithmetic:
//!
//! - **SPI**: the bits of a tick at the clocks of the two buses, as `board.rs` reckons them. The processor waits meanwhile.
//! - **Instructions**: those of the tick, of an input record and of a full record's encoding as counted in the emulator
//!   (`tests/data/firmware-instructions.toml`), the last by the byte, the others by the joint, and an estimate of the rest of
//!   the link's. Each is charged [`CYCLES_PER_INSTRUCTION`].
//! - **The line**: ten bit times a byte; a transmitter with one byte in work and one waiting, or transfers from the ring.
//!
//! The hand is the one that the firmware is built for: 12 joints, and 16 with
//! `HAND=models/hands/allegro-like.toml cargo test --release -p blindgrasp-firmware --test tasks line -- --show-output`.

use blindgrasp_firmware::control::{Control, HandBurst};
use blindgrasp_firmware::link::{Link, Port, SentBytes};
use blindgrasp_firmware::model::{IMAGE_HAND, JOINTS, params};
use blindgrasp_firmware::queue::{HandReply, Queues, Telemetry};
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::device::{Device, Inputs, WAITING_MOST};
use blindgrasp_shared::fault::Raised;
use blindgrasp_shared::identity::{Clock, Identity, Image};
use blindgrasp_shared::joints::{Joints, Reading};
use blindgrasp_shared::link::Receiver;
use blindgrasp_shared::link::message::{Form, Packet, Reply, Request, Signals};
use blindgrasp_shared::link::ring::Transfers;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::sync::atomic::Ordering;

/// Cycles of the processor in a millisecond.
const MS: u64 = 168_000;
/// The Cortex-M4F takes 1 cycle for most instructions, 2 for a load or a store, 2 to 4 for a branch that is taken, 14 for a
/// division or a root, and waits now and then for the flash (5 wait states, of which the accelerator hides most). Not
/// measured: nothing has run on a board. The README assumes 1.5; this is on the safe side.
const CYCLES_PER_INSTRUCTION: u64 = 2;
/// Instructions of a poll of the link that finds nothing to do, and of a byte that goes to the line besides.
const POLL: u64 = 60;
const BYTE: u64 = 8;
/// Bytes of the full record, framed, whose encoding was counted.
const COUNTED_BYTES: u64 = 140;
const COUNTED_JOINTS: u64 = 12;
/// The first byte of an input record's payload.
const INPUT: u8 = 6;

/// Cycles that a tick waits for its buses: 56 bits for each counter at 2.625 MHz, and 32 for the settings of one; 24 bits
/// at 5.25 MHz for each output, for each chip of four, and four times to read one back.
fn spi_cycles() -> u64 {
    let joints = JOINTS as u64;
    let counter_bits = 56 * joints + 32;
    let output_bits = 24 * (joints + joints.div_ceil(4) + 4);
    counter_bits * 64 + output_bits * 32
}

/// A number of instructions, as it is written down.
fn counted(name: &str) -> u64 {
    let text = include_str!("../../tests/data/firmware-instructions.toml");
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.trim().strip_prefix("= "));
    line.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{name} is not written down"))
}

/// The way in which bytes leave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Polling,
    Dma,
}

/// The line and the processor's time.
struct Wire {
    way: Way,
    cycles_per_byte: u64,
    encoding_per_byte: u64,
    encoding_of_input: u64,
    now: u64,
    /// The time at which the byte in work is sent, and the bytes behind it that need no processor.
    done_at: Option<u64>,
    behind: VecDeque<u8>,
    transfers: Transfers,
    ring: SentBytes,
    /// Bytes of the frame in work that the link has still to give.
    rest: usize,
    sent: Vec<u8>,
}

impl Wire {
    fn new(way: Way, baud: f64) -> Self {
        Self {
            way,
            cycles_per_byte: (10.0 * 168e6 / baud).round() as u64,
            encoding_per_byte: counted("encode_full").div_ceil(COUNTED_BYTES) * CYCLES_PER_INSTRUCTION,
            encoding_of_input: counted("encode_input") * JOINTS as u64 / COUNTED_JOINTS
                * CYCLES_PER_INSTRUCTION,
            now: 0,
            done_at: None,
            behind: VecDeque::new(),
            transfers: Transfers::new(),
            ring: SentBytes::new(),
            rest: 0,
            sent: Vec::new(),
        }
    }

    /// The interrupt at the end of a transfer.
    fn transfer_ended(&mut self) {
        if let Some(piece) = self.transfers.next(&self.ring, 0) {
            self.behind.extend(piece.iter().map(|byte| byte.load(Ordering::Relaxed)));
        }
    }

    /// Lets the line run up to now.
    fn advance(&mut self) {
        while let Some(done_at) = self.done_at.filter(|&done_at| done_at <= self.now) {
            self.done_at = None;
            self.begin(done_at);
        }
    }

    /// Begins to send a byte, if one is there.
    fn begin(&mut self, at: u64) {
        if self.done_at.is_none()
            && let Some(byte) = self.behind.pop_front()
        {
            self.sent.push(byte);
            self.done_at = Some(at + self.cycles_per_byte);
            if self.behind.is_empty() && self.way == Way::Dma {
                self.transfer_ended();
            }
        }
    }
}

/// The link's end of it.
struct End<'w>(&'w RefCell<Wire>);

impl Port for End<'_> {
    fn receive(&mut self) -> Option<u8> {
        None
    }

    fn is_silent(&self) -> bool {
        true
    }

    fn is_sent(&self) -> bool {
        true
    }

    // The hand's rate is not changed here: it is what the wire has.
    fn set_baud(&mut self, _baud: u32) {}

    fn send(&mut self, bytes: &[u8]) -> usize {
        let mut wire = self.0.borrow_mut();
        if wire.rest == 0 {
            // Encoded just now.
            wire.now += match bytes.get(1) {
                Some(&INPUT) => wire.encoding_of_input,
                _ => bytes.len() as u64 * wire.encoding_per_byte,
            };
        }
        wire.advance();
        let count = match wire.way {
            Way::Polling => {
                let count = bytes.len().min(1 - wire.behind.len());
                wire.behind.extend(&bytes[..count]);
                count
            }
            Way::Dma => {
                let count = wire.ring.write(bytes);
                if wire.behind.is_empty() {
                    wire.transfer_ended();
                }
                count
            }
        };
        wire.rest = bytes.len() - count;
        let now = wire.now;
        wire.begin(now);
        wire.now += count as u64 * BYTE * CYCLES_PER_INSTRUCTION;
        count
    }
}

/// Joints that move to and fro in the middle of their ranges, with counts of three bytes.
struct Swinging {
    tick: i32,
}

impl Joints<JOINTS> for Swinging {
    fn collect(&mut self) -> Reading<JOINTS> {
        self.tick += 1;
        let params = params();
        let encoders = params.config().estimator.encoders;
        Reading::Counts(core::array::from_fn(|joint| {
            let (lower, upper) = params.hand().range_rad(joint);
            let phase = (self.tick + 5 * joint as i32) % 64;
            let triangle = if phase < 32 { phase } else { 64 - phase };
            let angle_rad = 0.5 * (lower + upper) + (triangle as f32 / 32.0 - 0.5) * 0.02;
            let encoder = encoders[joint];
            let turned = (angle_rad / encoder.rad_per_count) as i32;
            encoder.zero_count + if encoder.reversed { -turned } else { turned }
        }))
    }

    fn write(&mut self, _torques_nm: &[f32; JOINTS], _powered: bool) -> Option<Raised> {
        None
    }
}

/// The bytes that came out of the line.
#[derive(Debug, Default)]
struct Outcome {
    bytes_per_ms: f64,
    records: u32,
    inputs: u32,
    /// Ticks that are not told of.
    missing: u32,
    longest_record: usize,
    longest_input: usize,
    dropped: u32,
    /// Of the time that the control task leaves, what the link did not need.
    idle_share: f64,
}

/// The records that are to be sent.
#[derive(Clone, Copy, PartialEq)]
enum Load {
    /// A full record a tick, whether or not the line takes it.
    Everything,
    /// Those that the hand decides to send to one who asked for every record, and for its state.
    Asked,
}

/// Runs the hand for so many ticks in a grasp.
fn run(way: Way, baud: f64, ticks: u32, load: Load) -> Outcome {
    let wire = RefCell::new(Wire::new(way, baud));
    let image = Image::decode(&IMAGE_HAND).expect("the build wrote it");
    let device = Device::new(params(), Identity::of(image, Clock::External));
    let mut control = Control::new(device, Box::leak(Box::new(HandBurst::new())));
    let mut queues = Queues::new();
    let (mut control_end, link_end, _) = queues.split();
    let mut link = Link::new(End(&wire), link_end);
    let mut joints = Swinging { tick: 0 };
    let instructions = counted("tick") * JOINTS as u64 / COUNTED_JOINTS;
    let busy = spi_cycles() + instructions * CYCLES_PER_INSTRUCTION;
    let (mut session, mut spare) = (0, 0);
    for tick in 0..ticks {
        // The control task: its time, then what it leaves.
        let began = u64::from(tick) * MS;
        wire.borrow_mut().now = began + busy;
        let request = match tick {
            0 => Some(Request::Hello { interface_version: INTERFACE_VERSION }),
            1 if load == Load::Asked => Some(Request::Telemetry { decimation: 1, signals: Signals::FULL }),
            5 => Some(Request::Command(Command::Arm)),
            10 => Some(Request::Command(Command::Grasp(Grasp::CONFIGURED))),
            _ if tick % 20 == 0 => Some(Request::Heartbeat),
            _ => None,
        };
        let packet = request.map(|request| Packet { session, sequence: tick as u16, request });
        let (dropped, waiting) = (control_end.dropped(), control_end.waiting());
        let outputs = control.turn(&mut joints, &Inputs { packet, dropped, waiting, ..Inputs::default() });
        if let Some(reply) = outputs.reply.take() {
            if let Reply::Identity { session: given, .. } = reply {
                session = given;
            }
            control_end.answer(reply.into());
        }
        match load {
            Load::Everything => {
                control_end.tell(Telemetry::Record(outputs.record.clone(), Form::Full(Signals::ALL)))
            }
            Load::Asked => {
                if let Some(form) = outputs.telemetry {
                    control_end.tell(Telemetry::Record(outputs.record.clone(), form));
                }
                if let Some(part) = outputs.part.take() {
                    control_end.tell(Telemetry::Part(part));
                }
            }
        }
        // The idle task: until the next start, or until it sleeps.
        while wire.borrow().now < began + MS {
            if link.is_idle() {
                spare += began + MS - wire.borrow().now;
                break;
            }
            wire.borrow_mut().now += POLL * CYCLES_PER_INSTRUCTION;
            link.poll(tick);
        }
        let mut wire = wire.borrow_mut();
        wire.now = began + MS;
        wire.advance();
    }
    let dropped = control_end.dropped();
    let wire = wire.into_inner();
    let mut outcome = Outcome {
        bytes_per_ms: wire.sent.len() as f64 / f64::from(ticks),
        dropped,
        idle_share: spare as f64 / (f64::from(ticks) * (MS - busy) as f64),
        ..Outcome::default()
    };
    let mut receiver = Receiver::<{ HandReply::MOST_BYTES + 4 }>::new();
    let (mut length, mut next) = (0, None);
    for byte in wire.sent {
        length += 1;
        let Some(payload) = receiver.push(byte) else { continue };
        let payload = payload.expect("the line damages nothing");
        let (tick, count, longest) = match Reply::<JOINTS>::decode(payload).expect("a reply") {
            Reply::Record(record) => (record.tick, &mut outcome.records, &mut outcome.longest_record),
            Reply::Input(input) => (input.tick, &mut outcome.inputs, &mut outcome.longest_input),
            _ => {
                length = 0;
                continue;
            }
        };
        *count += 1;
        *longest = length.max(*longest);
        outcome.missing += tick - next.unwrap_or(tick);
        next = Some(tick + 1);
        length = 0;
    }
    outcome
}

/// The most bytes that can leave, at every rate, by polling and by DMA.
#[test]
fn bytes_a_millisecond() {
    let busy_us = (spi_cycles() as f64 + (counted("tick") * 2 * JOINTS as u64 / 12) as f64) / 168.0;
    println!(
        "{JOINTS} joints: {:.0} us of SPI, {busy_us:.0} us of control task",
        spi_cycles() as f64 / 168.0
    );
    for way in [Way::Polling, Way::Dma] {
        for mbaud in [1.0, 2.0, 3.0] {
            let Outcome { bytes_per_ms, longest_record, records, .. } =
                run(way, 1e6 * mbaud, 2000, Load::Everything);
            println!(
                "{JOINTS} joints, {mbaud} Mbaud, {way:?}: {bytes_per_ms:.1} bytes/ms, {records} of 2000 records of {longest_record} bytes"
            );
            let most = 100.0 * mbaud;
            assert!(longest_record <= 240, "a full record has {longest_record} bytes");
            assert!(bytes_per_ms <= most);
            if way == Way::Dma {
                // All of the line, or all that there is to send.
                let all = bytes_per_ms > 0.98 * most || records > 1990;
                assert!(all, "{mbaud} Mbaud: {bytes_per_ms} bytes/ms");
            }
        }
    }
}

/// Every tick as a full record, snapshots of the state, answers: for a minute, on a line of 3 Mbaud less what is to spare.
#[test]
fn at_3_mbaud_no_record_is_lost_and_a_fifth_is_to_spare() {
    // With a fifth to spare, and no less than if each record had the 240 bytes that it may come to have.
    let longest = run(Way::Dma, 3e6, 1000, Load::Asked).longest_record;
    let share = f64::min(0.8, longest as f64 / 240.0);
    let outcome = run(Way::Dma, share * 3e6, 60_000, Load::Asked);
    println!("{JOINTS} joints, {:.0} % of 3 Mbaud, 60 s: {outcome:?}", 100.0 * share);
    assert_eq!((outcome.missing, outcome.dropped), (0, 0));
    // While a snapshot of 16 joints leaves, some ticks are told of by their inputs.
    let allowed = 0..=if JOINTS > 12 { 600 } else { 0 };
    assert!(allowed.contains(&outcome.inputs), "{} inputs", outcome.inputs);
    assert!(outcome.records + outcome.inputs >= 60_000 - 5);
    assert!(outcome.idle_share > 0.2, "the link's time: {}", outcome.idle_share);
}

/// A line that is too slow for that: a minute in which every tick is told of, by an input record or a full one.
#[test]
fn at_1_mbaud_every_tick_is_told_of() {
    for (way, ticks) in [(Way::Dma, 60_000), (Way::Polling, 1000)] {
        let outcome = run(way, 1e6, ticks, Load::Asked);
        println!("{JOINTS} joints, 1 Mbaud, {way:?}, {ticks} ticks: {outcome:?}");
        assert!(outcome.longest_input <= if JOINTS > 12 { 95 } else { 75 });
        if way == Way::Dma {
            assert_eq!((outcome.missing, outcome.dropped), (0, 0));
            // But for the first, before they were asked for, and those that wait in queue, frame and ring at the end.
            assert!(outcome.records + outcome.inputs >= ticks - 1 - WAITING_MOST as u32 - 4);
            assert!(outcome.records > ticks / 20, "full records as there is room");
        }
    }
}
