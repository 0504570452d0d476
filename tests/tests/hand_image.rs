//! The image `hand` in QEMU, over its serial line: boot, identity, the fault of a board without joints, refusals, 1 kHz, and
//! a line that damages what it carries.
//!
//!     cargo test --release -p blindgrasp-tests --features firmware --test hand_image -- --show-output
//!
//! QEMU has the SPI controllers, but nothing is connected to them: no counter answers.
#![cfg(unix)]

use blindgrasp::body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp::model::HandModel;
use blindgrasp::wire::{Packet, Request};
use blindgrasp_shared::command::{Command, Grasp, Refusal};
use blindgrasp_shared::control::PerGain;
use blindgrasp_shared::event::Event;
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::{Clock, ResetCause, UNITS};
use blindgrasp_shared::link::InputRecord;
use blindgrasp_shared::link::message::{self, Sample, Signals, not_understood};
use blindgrasp_shared::parameters::{Parameter, Setting};
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::burst::AFTER;
use blindgrasp_shared::telemetry::snapshot::Collector;
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, List};
use blindgrasp_shared::tick::{Input, Params, State, tick as tick_of};
use blindgrasp_tests::board::{Board, Pace};
use blindgrasp_tests::conversation::{Conversation, Heard, Reply, frame};
use blindgrasp_tests::damage::{JOINTS, NO_SESSION, Stretches};
use blindgrasp_tests::images::{DEFAULT_HAND, kept_image};
use std::time::Instant;

/// 16 ns an instruction: 2.7 cycles at 168 MHz, more than a Cortex-M4 takes for this code on average.
const USUAL: Pace = Pace::Instructions { each_ns: 16 };
/// 128 ns an instruction: so slow that the control task still has its time, but a record is not sent within a tick.
const SLOW: Pace = Pace::Instructions { each_ns: 128 };
/// The fault of a board without counters.
const NO_COUNTER: Raised = Raised { fault: Fault::SampleMissing, joint: Some(0) };

/// A board that answers.
fn board(pace: Pace) -> Conversation<Board> {
    let mut host = Conversation::new(Board::start(&kept_image("hand", DEFAULT_HAND), pace));
    host.knock();
    host
}

fn telemetry(decimation: u16, signals: Signals) -> Request {
    Request::Telemetry { decimation, signals }
}

fn set(parameter: Parameter, index: u8, value: f32) -> Request {
    Request::SetParameter { parameter, index, value }
}

fn get(parameter: Parameter, index: u8) -> Request {
    Request::GetParameter { parameter, index }
}

/// Requests of every kind but `Hello` and `Stop`.
fn requests() -> Vec<Request> {
    let commands = Command::ALL.into_iter().filter(|command| *command != Command::Stop).map(Request::Command);
    let others = [
        Request::Heartbeat,
        set(Parameter::gain(0), 0, 1.0),
        get(Parameter::gain(0), 0),
        telemetry(1, Signals::ALL),
        Request::Joints(Sample { counts: List::default(), failed: None, late: false }),
    ];
    commands.chain(others).collect()
}

#[test]
fn it_says_who_it_is() {
    let mut host = board(USUAL);
    let heard = host.hello();
    let Reply::Identity { session, identity, .. } = heard.reply() else { panic!("{heard:?}") };
    println!("{}; clock {}, reset {}", identity.image, identity.clock.words(), identity.reset.words());
    let model = HandModel::load("three-finger").expect("it is built in");
    let image = identity.image;
    assert_eq!(session, 1);
    assert_eq!((image.interface_version, image.kind), (INTERFACE_VERSION, "hand"));
    assert_eq!((image.hand, image.hand_hash), (model.name.as_str(), model.hash()));
    assert_eq!((image.joint_count, image.fingertip_count, image.period_us), (12, 3, 1000));
    assert_eq!(image.firmware_version, env!("CARGO_PKG_VERSION"));
    assert_eq!((identity.units, identity.clock), (UNITS, Clock::Emulated));
    assert_eq!((identity.reset, identity.crash), (ResetCause::Unknown, None));
}

#[test]
fn without_counters_it_is_in_fault_1_and_stays_there() {
    let mut host = board(USUAL);
    host.hello();
    assert_eq!(host.ask(telemetry(1, Signals::ALL)).refused(), None);
    let check = |host: &mut Conversation<Board>| {
        let record = host.record();
        let fault = record.fault.expect("a fault");
        assert_eq!((record.mode, fault, record.reading_failed), (Mode::Fault, NO_COUNTER, Some(NO_COUNTER)));
        assert_eq!(fault.to_string(), "fault 1: joint 0: encoder gave no sample");
        assert!(record.counts.as_slice().is_empty(), "there are none");
        assert_eq!(record.torques_nm.as_slice(), [0.0; JOINTS]);
    };
    check(&mut host);
    let grasp = Grasp { gains: PerGain { grasp: [Some(f32::NAN), None], ..PerGain::all(None) } };
    for (command, refusal) in [
        (Command::Arm, Some(Refusal::InFault)),
        (Command::Disarm, Some(Refusal::InFault)),
        (Command::Grasp(Grasp::CONFIGURED), Some(Refusal::InFault)),
        (Command::Grasp(grasp), Some(Refusal::InFault)),
        (Command::Release, Some(Refusal::InFault)),
        (Command::ClearFault, Some(Refusal::FaultPersists)),
        (Command::Stop, None),
        // Clearing the fault makes the joints try again; they fail again.
        (Command::ClearFault, Some(Refusal::FaultPersists)),
        (Command::Arm, Some(Refusal::InFault)),
    ] {
        assert_eq!(host.ask(Request::Heartbeat).refused(), None);
        assert_eq!(host.ask(Request::Command(command)).refused(), refusal, "{command:?}");
        host.records.clear();
        check(&mut host);
    }
}

#[test]
fn what_it_does_not_take_it_refuses_by_name() {
    let mut host = board(USUAL);
    // Before hello.
    for session in [0, 1, 7] {
        for request in requests() {
            let packet = Packet { session, sequence: 40, request };
            assert_eq!(host.ask_as_is(&packet, 40).refused(), Some(Refusal::NoSession), "{packet:?}");
        }
    }
    let stop = |session, sequence| Packet { session, sequence, request: Request::Command(Command::Stop) };
    assert_eq!(host.ask_as_is(&stop(3, 9), 9).refused(), None);

    // With another interface.
    let hello = Request::Hello { interface_version: INTERFACE_VERSION + 1 };
    let heard = host.ask_as_is(&Packet { session: 0, sequence: 1, request: hello }, 1);
    let Reply::Identity { session, identity, .. } = heard.reply() else { panic!("{heard:?}") };
    assert_eq!((session, identity.image.interface_version), (1, INTERFACE_VERSION));
    for (request, sequence) in requests().into_iter().zip(2..) {
        let heard = host.ask_as_is(&Packet { session, sequence, request }, sequence);
        assert_eq!(heard.refused(), Some(Refusal::OtherInterface));
    }
    assert_eq!(host.ask_as_is(&stop(session, 0), 0).refused(), None);

    // Replayed, out of order, and of the session before.
    host.sequence = 100;
    host.hello();
    assert_eq!(host.session, 2);
    for request in requests() {
        for behind in [0, 1, 50, 1 << 15] {
            let sequence = host.sequence.wrapping_sub(behind);
            let packet = Packet { session: 2, sequence, request: request.clone() };
            assert_eq!(host.ask_as_is(&packet, sequence).refused(), Some(Refusal::OutOfOrder), "{packet:?}");
        }
        let old = Packet { session: 1, sequence: 200, request };
        assert_eq!(host.ask_as_is(&old, 200).refused(), Some(Refusal::SessionTaken));
        assert_eq!(host.ask(Request::Heartbeat).refused(), None);
    }
    assert_eq!(host.ask_as_is(&stop(77, 0), 0).refused(), None);

    // In the session.
    let sample = Sample { counts: List::first_of([5; 24], 12), failed: None, late: false };
    for (request, refusal) in [
        (Request::Joints(sample), Refusal::JointsAreReal),
        (get(Parameter::gain(0), 1), Refusal::NoSuchParameter),
        (get(Parameter::TORQUE_LIMIT, 12), Refusal::NoSuchParameter),
        (get(Parameter::GRAVITY, 3), Refusal::NoSuchParameter),
        // A hand in a fault is not disarmed.
        (set(Parameter::gain(0), 0, 1.0), Refusal::NotDisarmed),
        (set(Parameter::gain(0), 0, f32::NAN), Refusal::NotDisarmed),
    ] {
        assert_eq!(host.ask(request.clone()).refused(), Some(refusal), "{request:?}");
    }
    match host.ask(get(Parameter::TORQUE_LIMIT, 11)).reply() {
        Reply::Value { parameter: Parameter::TORQUE_LIMIT, index: 11, setting, .. } => {
            assert_eq!(setting.value, 1.3878)
        }
        other => panic!("{other:?}"),
    }

    // What is no request, with a CRC as it should be: signals, a request, a command and a parameter that there are none
    // of, a list that is too long, bytes behind, and hardly any bytes.
    host.sequence += 1;
    let sequence = host.sequence;
    let heard = host.ask_as_is(&(2_u16, sequence, 5_u8, 1_u16, 0xff_u8), sequence);
    assert_eq!(heard.refused(), Some(Refusal::OutOfRange));
    for sequence in [3_u16, 300, 65_535] {
        for heard in [
            host.ask_as_is(&(2_u16, sequence, 0x7f_u8), sequence),
            host.ask_as_is(&(2_u16, sequence, 1_u8, 6_u8), sequence),
            host.ask_as_is(&(2_u16, sequence, 4_u8, 200_u8, 0_u8), sequence),
            host.ask_as_is(&(2_u16, sequence, 6_u8, 13_u8, [1_u8; 13], 0_u8, 0_u8), sequence),
            host.ask_as_is(&(2_u16, sequence, 2_u8, 0_u8), sequence),
            host.ask_as_is(&(2_u16, sequence), sequence),
            host.ask_as_is(&[0xff_u8, 0xff], 0),
        ] {
            assert_eq!(heard.refused(), Some(Refusal::NotUnderstood));
        }
    }
    assert_eq!(host.ask(Request::Heartbeat).refused(), None, "none of it has cost the session");
}

/// Records, input records, snapshots and the burst, as a recording takes them.
#[test]
fn records_snapshots_and_the_burst_come_from_the_board() {
    let mut host = board(USUAL);
    host.hello();
    // The hand is in a fault from its first tick on; so the burst is there, as soon as it is over.
    let burst = |host: &mut Conversation<Board>, index| host.ask(Request::Burst { index });
    let mut heard = burst(&mut host, 0);
    for _ in 0..200 {
        if let Reply::Answer { refused, .. } = heard.reply() {
            assert_eq!(refused, Some(Refusal::BurstNotOver));
            heard = burst(&mut host, 0);
        }
    }
    for asked in 0..AFTER as u16 {
        let heard = burst(&mut host, asked);
        let Reply::Burst { index, count, record, .. } = heard.reply() else { panic!("{heard:?}") };
        assert_eq!((index, usize::from(count)), (asked, AFTER), "nothing was before it");
        assert_eq!((record.tick, record.sequence), (u32::from(asked), u32::from(asked)));
        assert_eq!((record.mode, record.fault), (Mode::Fault, Some(NO_COUNTER)));
    }
    assert_eq!(burst(&mut host, AFTER as u16).refused(), Some(Refusal::OutOfRange));

    assert_eq!(host.ask(telemetry(1, Signals::FULL)).refused(), None);
    let model = HandModel::load("three-finger").expect("it is built in");
    let params = Params::<MAX_JOINTS, MAX_FINGERS>::new(model.hand.cast(), &model.config);
    let params = params.expect("its own configuration");
    let mut collector = Collector::new();
    let (mut told, mut inputs, mut snapshots) = (Vec::<InputRecord<MAX_JOINTS>>::new(), 0, Vec::new());
    for payload in host.payloads(3000) {
        let tick = match Reply::decode(&payload).unwrap_or_else(|error| panic!("{error}: {payload:02x?}")) {
            Reply::Record(record) => {
                assert_eq!((record.fault, record.reading_failed), (Some(NO_COUNTER), Some(NO_COUNTER)));
                assert_eq!((record.dropped, record.decimation), (0, 1));
                InputRecord::of(&record)
            }
            Reply::Input(input) => {
                inputs += 1;
                input
            }
            Reply::Snapshot(part) => {
                let whole = collector.add(&part).map(|(tick, bytes)| (tick, bytes.to_vec()));
                snapshots.extend(whole);
                continue;
            }
            other => panic!("{other:?}"),
        };
        if let Some(last) = told.last() {
            assert_eq!((tick.tick, tick.sequence), (last.tick + 1, last.sequence + 1));
        }
        told.push(tick);
    }
    println!("{} ticks, {inputs} of them by input records; {} snapshots", told.len(), snapshots.len());
    assert!(told.len() > 2 * inputs, "the emulator's line is fast");
    assert!(snapshots.len() >= 2);
    for (tick, bytes) in snapshots {
        println!("snapshot after tick {tick}: {} bytes", bytes.len());
        let mut state = State::load(&params, &bytes).expect("the board's state");
        // The ticks that follow are those of the board, to the bit.
        for told in told.iter().filter(|told| told.tick > tick) {
            let input = Input::failed(NO_COUNTER, None).with(told.events);
            let computed = tick_of(&params, &mut state, &input).record;
            assert_eq!((computed.tick, computed.digest()), (told.tick, told.digest));
        }
    }
}

/// The record of every tick over five seconds of the board's time.
#[test]
fn no_tick_is_late_and_no_record_is_missing() {
    let mut host = board(USUAL);
    host.hello();
    assert_eq!(host.ask(telemetry(1, Signals::ALL)).refused(), None);
    let mut last = host.record();
    for number in 0..5000 {
        if number % 100 == 0 {
            assert_eq!(host.ask(Request::Heartbeat).refused(), None, "it answers meanwhile");
        }
        let record = host.record();
        assert_eq!((record.tick, record.sequence), (last.tick + 1, last.sequence + 1), "none is missing");
        assert_eq!(record.dropped, 0);
        assert!(!record.events.contains(Event::Late), "{record:?}");
        last = record;
    }
}

/// A line that is slower than the telemetry that was asked for: the control task keeps its time, there are as many records
/// as there is room for, none is lost, and the answers still come, every one.
///
/// The turns of the control task are counted against a clock that the firmware does not use (TIM2), read from outside
/// while the board stands still. Here the processor never sleeps, because there is always something to send; and so the
/// board's clock advances with its instructions alone, and the count is exact. (Where it sleeps, QEMU 7.2 with
/// `sleep=off` at times lets two periods pass at once, and with `sleep=on` as many as this machine is late.) A look may
/// come anywhere between two starts, and after a start was called for and before it: that is one period each.
#[test]
fn it_keeps_1_khz_and_answers_though_its_line_is_too_slow() {
    let mut host = board(SLOW);
    host.hello();
    assert_eq!(host.ask(telemetry(1, Signals::ALL)).refused(), None);
    let first = host.record();
    let began = host.transport.instants();
    let (mut before, mut elapsed_ns, mut asked) = (began, 0_u64, 0);
    let mut last = first.clone();
    let (mut missing, mut records) = (0, 0);
    while elapsed_ns < 5_000_000_000 {
        for _ in 0..20 {
            let heard = host.ask(get(Parameter::gain(0), 0));
            assert!(
                matches!(heard.reply(), Reply::Value { setting: Setting { value: 5.0, .. }, .. }),
                "{heard:?}"
            );
            asked += 1;
        }
        for record in std::mem::take(&mut host.records) {
            assert!(!record.events.contains(Event::Late), "{record:?}");
            let numbers = record.sequence - last.sequence;
            assert!(record.tick - last.tick >= numbers, "at most one in a tick");
            missing += numbers - 1;
            records += 1;
            last = record;
        }
        let now = host.transport.instants();
        elapsed_ns += u64::from(now.nanoseconds.wrapping_sub(before.nanoseconds));
        before = now;
    }
    let ticks = before.ticks - began.ticks;
    let off_ns = elapsed_ns.abs_diff(1_000_000 * u64::from(ticks));
    let dropped = last.dropped - first.dropped;
    println!("{ticks} ticks in {elapsed_ns} ns of the board's time: {off_ns} ns off");
    println!("{asked} requests were answered; {records} records, {missing} missing, {dropped} dropped");
    assert!(off_ns <= 2_000_000, "{off_ns}");
    assert!(
        last.tick.abs_diff(before.ticks) < 60,
        "{} is the last record of {} turns",
        last.tick,
        before.ticks
    );
    assert_eq!((missing, dropped), (0, 0));
    assert!(10 * records < 9 * ticks, "there is no room for all");
}

/// Many requests at once, at the pace of the world: each is answered, and those that are taken begin with the first. QEMU
/// brings the bytes of a line one by one, hardly faster than the control task takes requests; so they may all be done. How
/// the link is busy is tested on the host, and with the image `pil` through a pipe.
#[test]
fn a_burst_of_requests_is_answered_one_by_one() {
    let mut host = board(Pace::World);
    host.hello();
    for burst in [7, 8, 40, 200, 1000] {
        let first = host.sequence + 1;
        let packets: Vec<Packet> = (0..burst).map(|_| host.packet(Request::Heartbeat)).collect();
        let bytes: Vec<u8> = packets.iter().flat_map(frame).collect();
        host.send(&bytes);
        let mut answers: Vec<(u16, Option<Refusal>)> = (0..burst)
            .map(|_| host.answer())
            .map(|heard| (heard.sequence().expect("an answer"), heard.refused()))
            .collect();
        answers.sort_by_key(|(sequence, _)| *sequence);
        let sequences: Vec<u16> = answers.iter().map(|(sequence, _)| *sequence).collect();
        assert_eq!(sequences, (first..first + burst).collect::<Vec<_>>());
        let done = answers.iter().filter(|(_, refused)| refused.is_none()).count();
        println!("{burst} requests at once: {done} done, {} busy", answers.len() - done);
        assert!(answers.iter().all(|(_, refused)| refused.is_none_or(|refusal| refusal == Refusal::Busy)));
        assert!(done >= 7 && answers[..7].iter().all(|(_, refused)| refused.is_none()));
        // It has come to rest: nothing more is said.
        assert_eq!(host.ask(Request::Heartbeat).refused(), None);
    }
}

/// Returns the answer of a board to a payload that it should not have got: of a session that never was, or no request
/// at all.
fn answer_to(payload: &[u8]) -> (u16, Refusal) {
    match message::Packet::<JOINTS>::decode(payload) {
        Ok(packet) => {
            assert_eq!(packet.session, NO_SESSION);
            (packet.sequence, Refusal::NoSession)
        }
        Err(_) => match not_understood::<JOINTS>(payload) {
            message::Reply::Answer { sequence, refused: Some(refusal) } => (sequence, refusal),
            other => panic!("{other:?}"),
        },
    }
}

/// Through the real driver: damaged frames, and after each a good request. What is answered is every good request, what
/// came through unharmed, and nothing else.
fn damaged_frames_cost_those_and_no_other(frames: usize) {
    /// Damaged frames that are sent before answers are looked at.
    const AT_ONCE: usize = 12;
    let mut host = board(USUAL);
    host.hello();
    let mut stretches = Stretches::new(405);
    let (mut damaged, mut survived, begun) = (0, 0, Instant::now());
    while damaged < frames {
        let (mut bytes, mut expected) = (Vec::new(), Vec::new());
        for number in 0..AT_ONCE {
            let stretch = stretches.next_stretch();
            bytes.extend(&stretch.bytes);
            let answers = stretch.survivors.iter().map(|payload| answer_to(payload));
            expected.extend(answers.map(|(sequence, refusal)| (sequence, Some(refusal))));
            survived += stretch.survivors.len();
            // Most good ones are answered by the link alone, some by the control task, which takes one a tick.
            if number % 4 == 0 {
                let packet = host.packet(Request::Heartbeat);
                expected.push((packet.sequence, None));
                bytes.extend(frame(&packet));
            } else {
                host.sequence = host.sequence.wrapping_add(1);
                expected.push((host.sequence, Some(Refusal::NotUnderstood)));
                bytes.extend(frame(&(host.session, host.sequence, 0x7f_u8)));
            }
        }
        damaged += AT_ONCE;
        host.send(&bytes);
        let heard: Vec<Heard> = expected.iter().map(|_| host.answer()).collect();
        // The link answers before the control task does.
        let mut heard: Vec<_> =
            heard.iter().map(|h| (h.sequence().expect("an answer"), h.refused())).collect();
        let order = |answer: &(u16, Option<Refusal>)| (answer.0, answer.1.map(|refusal| refusal as u8));
        heard.sort_by_key(order);
        expected.sort_by_key(order);
        assert_eq!(heard, expected, "after {damaged} damaged frames");
    }
    assert_eq!(host.ask(Request::Heartbeat).refused(), None, "nothing else was said");
    println!(
        "{damaged} damaged frames over the serial driver in {:.0} s, as many good ones all answered; {} pieces refused, {survived} came through unharmed",
        begun.elapsed().as_secs_f64(),
        stretches.refused()
    );
}

#[test]
fn a_line_that_damages_frames_costs_those_and_no_other() {
    damaged_frames_cost_those_and_no_other(600);
}

#[test]
#[ignore = "the large form, for tests/run all"]
fn at_large_a_line_that_damages_frames_costs_those_and_no_other() {
    damaged_frames_cost_those_and_no_other(3000);
}
