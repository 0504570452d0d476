//! The device: sessions, requests and settings around the tick.

use crate::common;

use blindgrasp_shared::command::{Command, Grasp, Refusal};
use blindgrasp_shared::control::{GAIN_COUNT, PerGain};
use blindgrasp_shared::device::{Device, Inputs, Outputs, WAITING_MOST};
use blindgrasp_shared::event::Event;
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::{Clock, Identity, Image, ResetCause};
use blindgrasp_shared::joints::Reading;
use blindgrasp_shared::link::message::{Form, Packet, Reply, Request, Sample, Signals, not_understood};
use blindgrasp_shared::link::{self, Receiver, most_bytes};
use blindgrasp_shared::parameters::{Bound, Parameter, Setting};
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::burst::{AFTER, BEFORE, Burst};
use blindgrasp_shared::telemetry::snapshot::{Collector, PART_BYTES};
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, List, Record};
use common::{JOINTS, config, facing_counts, params};
use proptest::prelude::*;

type Packet12 = Packet<12>;

fn identity(clock: Clock) -> Identity<'static> {
    let image = Image {
        interface_version: INTERFACE_VERSION,
        kind: "hand",
        hand: "test",
        hand_hash: 1,
        firmware_version: "0.1.0",
        build_hash: 2,
        joint_count: 12,
        fingertip_count: 3,
        period_us: 1000,
    };
    Identity { reset: ResetCause::PowerOn, ..Identity::of(image, clock) }
}

/// A device and a host that numbers its requests.
struct Bench {
    device: Device<12, 3>,
    burst: Box<Burst<12>>,
    dropped: u32,
    waiting: usize,
    session: u16,
    sequence: u16,
}

impl Bench {
    /// Nobody has said hello yet.
    fn silent(clock: Clock) -> Self {
        let mut config = config();
        config.faults.heartbeat_ms = Some(100);
        Self {
            device: Device::new(params(&config), identity(clock)),
            burst: Box::new(Burst::new()),
            dropped: 3,
            waiting: 0,
            session: 0,
            sequence: 0,
        }
    }

    /// In a session.
    fn new() -> Self {
        let mut bench = Self::silent(Clock::External);
        let reply = bench.ask(Request::Hello { interface_version: INTERFACE_VERSION });
        let Reply::Identity { session, .. } = reply else { panic!("{reply:?}") };
        bench.session = session;
        bench
    }

    fn tick(&mut self, packet: Option<Packet12>) -> Outputs<12> {
        let reading = Reading::Counts(facing_counts());
        self.tick_with(reading, self.dropped, packet)
    }

    fn tick_with(&mut self, reading: Reading<12>, dropped: u32, packet: Option<Packet12>) -> Outputs<12> {
        let inputs = Inputs { cycles: 7, dropped, waiting: self.waiting, packet, ..Inputs::default() };
        self.device.tick(&reading, &inputs, &mut self.burst)
    }

    fn packet(&mut self, request: Request<12>) -> Packet12 {
        self.sequence = self.sequence.wrapping_add(1);
        Packet { session: self.session, sequence: self.sequence, request }
    }

    fn ask(&mut self, request: Request<12>) -> Reply<'static, 12> {
        let packet = self.packet(request);
        self.tick(Some(packet)).reply.expect("every request is answered")
    }

    /// Returns the refusal of a request.
    #[track_caller]
    fn refused(&mut self, request: Request<12>) -> Option<Refusal> {
        match self.ask(request) {
            Reply::Answer { sequence, refused } => {
                assert_eq!(sequence, self.sequence);
                refused
            }
            reply => panic!("{reply:?}"),
        }
    }

    #[track_caller]
    fn done(&mut self, request: Request<12>) {
        assert_eq!(self.refused(request), None);
    }

    /// Led into a grasp.
    fn grasping() -> Self {
        let mut bench = Self::new();
        bench.done(Request::Heartbeat);
        bench.done(Request::Command(Command::Arm));
        bench.done(GRASP);
        bench
    }
}

const GRASP: Request<12> = Request::Command(Command::Grasp(Grasp::CONFIGURED));
const HELLO: Request<12> = Request::Hello { interface_version: INTERFACE_VERSION };
const ARM: Request<12> = Request::Command(Command::Arm);

#[test]
fn a_session_begins_with_hello_and_everything_else_needs_one() {
    let mut bench = Bench::silent(Clock::External);
    assert_eq!(bench.refused(Request::Heartbeat), Some(Refusal::NoSession));
    assert_eq!(bench.refused(ARM), Some(Refusal::NoSession));
    let reply = bench.ask(Request::Hello { interface_version: INTERFACE_VERSION });
    let sequence = bench.sequence;
    let expected =
        Reply::Identity { sequence, session: 1, identity: identity(Clock::External), ends_another: false };
    assert_eq!(reply, expected);
    assert_eq!(bench.refused(Request::Heartbeat), Some(Refusal::NoSession), "still session 0");
    bench.session = 1;
    bench.done(Request::Heartbeat);
    // Another hello ends this session.
    bench.ask(HELLO);
    assert_eq!(bench.refused(Request::Heartbeat), Some(Refusal::SessionTaken));
    bench.session = 2;
    bench.done(Request::Heartbeat);
    // So does goodbye, and the records with it.
    bench.done(Request::Telemetry { decimation: 1, signals: Signals::ALL });
    assert!(bench.tick(None).telemetry.is_some());
    bench.done(Request::Goodbye);
    assert_eq!(bench.tick(None).telemetry, None);
    assert_eq!(bench.refused(Request::Heartbeat), Some(Refusal::NoSession));
}

#[test]
fn no_hello_is_given_session_0_nor_one_of_the_last_two() {
    let mut bench = Bench::silent(Clock::External);
    let mut before = [0, 0];
    for k in 0..65_600_u32 {
        // Nobody's wish for most, and every wish that there is, among them those that can't be had.
        bench.session = match k {
            0..65_550 => 0,
            _ => [0, before[0], before[1], u16::MAX, k as u16][k as usize % 5],
        };
        let Reply::Identity { session, .. } = bench.ask(HELLO) else { panic!("no identity") };
        assert!(session != 0 && !before.contains(&session), "hello {k}: {session} after {before:?}");
        before = [session, before[0]];
    }
    bench.session = before[0];
    bench.done(Request::Heartbeat);
}

#[test]
fn a_rate_is_changed_while_disarmed_if_the_line_has_it() {
    let rate = |baud| Request::Rate { baud };
    let mut bench = Bench::new();
    assert_eq!(bench.refused(rate(3_000_000)), Some(Refusal::NoSuchRate));
    bench.device = bench.device.with_faster_bauds(&[3_000_000]);
    let outputs = |bench: &mut Bench, request| {
        let packet = bench.packet(request);
        let outputs = bench.tick(Some(packet));
        let Some(Reply::Answer { refused, .. }) = outputs.reply else { panic!("{outputs:?}") };
        (refused, outputs.baud)
    };
    assert_eq!(outputs(&mut bench, rate(3_000_000)), (None, Some(3_000_000)));
    assert_eq!(outputs(&mut bench, Request::Heartbeat), (None, None));
    assert_eq!(outputs(&mut bench, rate(1_000_000)), (None, Some(1_000_000)));
    assert_eq!(outputs(&mut bench, rate(2_000_000)), (Some(Refusal::NoSuchRate), None));
    assert_eq!(outputs(&mut bench, ARM), (None, None));
    assert_eq!(outputs(&mut bench, rate(3_000_000)), (Some(Refusal::NotDisarmed), None));
    bench.done(Request::Command(Command::Disarm));
    assert_eq!(outputs(&mut bench, Request::Goodbye), (None, Some(1_000_000)));
}

#[test]
fn a_session_that_another_program_takes_is_told_to_both_and_told_apart_from_a_reset() {
    let begin = |bench: &mut Bench, wished| {
        bench.session = wished;
        let Reply::Identity { session, ends_another, .. } = bench.ask(HELLO) else { panic!("no identity") };
        (session, ends_another)
    };
    let heartbeat_of = |bench: &mut Bench, session| {
        bench.session = session;
        bench.refused(Request::Heartbeat)
    };
    let mut bench = Bench::silent(Clock::External);
    assert_eq!(begin(&mut bench, 500), (500, false));
    assert_eq!(heartbeat_of(&mut bench, 500), None);
    assert_eq!(begin(&mut bench, 900), (900, true));
    assert_eq!(heartbeat_of(&mut bench, 500), Some(Refusal::SessionTaken));
    assert_eq!(heartbeat_of(&mut bench, 900), None);
    // A hand that was reset knows of neither, also when it knows of somebody else.
    let mut bench = Bench::silent(Clock::External);
    assert_eq!(heartbeat_of(&mut bench, 900), Some(Refusal::NoSession));
    assert_eq!(begin(&mut bench, 77), (77, false));
    assert_eq!(heartbeat_of(&mut bench, 900), Some(Refusal::NoSession));
    // Nobody is told of a program that has ended, with or without a goodbye.
    bench.session = 77;
    bench.done(Request::Goodbye);
    assert_eq!(begin(&mut bench, 78), (78, false));
    for _ in 0..250 {
        bench.tick(None);
    }
    assert_eq!(begin(&mut bench, 79), (79, false));
}

#[test]
fn another_interface_version_is_told_who_is_there_and_nothing_else() {
    let mut bench = Bench::silent(Clock::External);
    let reply = bench.ask(Request::Hello { interface_version: INTERFACE_VERSION + 1 });
    assert!(matches!(reply, Reply::Identity { session: 1, .. }));
    bench.session = 1;
    assert_eq!(bench.refused(Request::Heartbeat), Some(Refusal::OtherInterface));
    assert_eq!(bench.refused(ARM), Some(Refusal::OtherInterface));
    bench.done(Request::Command(Command::Stop));
}

#[test]
fn replayed_and_late_requests_are_refused_by_name() {
    let mut bench = Bench::new();
    bench.done(Request::Heartbeat);
    let arm = bench.packet(ARM);
    let heartbeat = bench.packet(Request::Heartbeat);
    let refusal = |outputs: Outputs<12>| match outputs.reply {
        Some(Reply::Answer { refused, .. }) => refused,
        reply => panic!("{reply:?}"),
    };
    assert_eq!(refusal(bench.tick(Some(heartbeat.clone()))), None);
    assert_eq!(refusal(bench.tick(Some(arm.clone()))), Some(Refusal::OutOfOrder));
    assert_eq!(refusal(bench.tick(Some(heartbeat))), Some(Refusal::OutOfOrder));
    assert_eq!(bench.device.state().mode(), Mode::Disarmed);
    // The numbers may wrap, and some may be missing.
    for _ in 0..70 {
        bench.sequence = bench.sequence.wrapping_add(1_000);
        bench.done(Request::Heartbeat);
    }
    bench.done(ARM);
    assert_eq!(refusal(bench.tick(Some(arm))), Some(Refusal::OutOfOrder));
}

#[test]
fn stop_is_taken_from_whoever_it_comes() {
    for session in [0, 1, 77] {
        let mut bench = Bench::grasping();
        let packet = Packet { session, sequence: 0, request: Request::Command(Command::Stop) };
        let outputs = bench.tick(Some(packet));
        assert_eq!(outputs.reply, Some(Reply::Answer { sequence: 0, refused: None }));
        assert_eq!((outputs.record.mode, outputs.torques_nm), (Mode::Disarmed, [0.0; 12]));
    }
}

#[test]
fn arming_needs_a_heartbeat_and_the_crystal() {
    let mut bench = Bench::new();
    assert_eq!(bench.refused(ARM), Some(Refusal::NoHeartbeat));
    bench.done(Request::Heartbeat);
    bench.done(ARM);
    for (clock, refused) in
        [(Clock::Fallback, Some(Refusal::FallbackClock)), (Clock::Emulated, None), (Clock::External, None)]
    {
        let mut bench = Bench::silent(clock);
        bench.ask(Request::Hello { interface_version: INTERFACE_VERSION });
        bench.session = 1;
        bench.done(Request::Heartbeat);
        assert_eq!(bench.refused(ARM), refused);
    }
}

#[test]
fn a_heartbeat_keeps_the_grasp_and_nothing_else_does() {
    let mut bench = Bench::grasping();
    let about_telemetry = Request::GetParameter { parameter: Parameter::gain(0), index: 0 };
    for tick in 0..1000 {
        let request = if tick % 100 == 0 { Request::Heartbeat } else { about_telemetry.clone() };
        bench.ask(request);
        assert_eq!(bench.device.state().mode(), Mode::Grasping);
    }
    // The last heartbeat is 99 ticks ago.
    bench.ask(about_telemetry.clone());
    let packet = bench.packet(about_telemetry);
    let record = bench.tick(Some(packet)).record;
    assert_eq!(record.fault, Some(Raised::of_hand(Fault::LinkLost)));
    assert_eq!(record.mode, Mode::Releasing);
}

#[test]
fn commands_are_answered_by_the_tick() {
    let mut bench = Bench::new();
    assert_eq!(bench.refused(GRASP), Some(Refusal::NotArmed));
    bench.done(Request::Heartbeat);
    bench.done(ARM);
    let firm = |force_n| {
        Request::Command(Command::Grasp(Grasp {
            gains: PerGain { grasp: [force_n, None], ..PerGain::all(None) },
        }))
    };
    assert_eq!(bench.refused(firm(Some(f32::NAN))), Some(Refusal::NotFinite));
    assert_eq!(bench.refused(firm(Some(1e9))), Some(Refusal::OutOfRange));
    bench.done(firm(Some(1.0)));
    assert_eq!(bench.refused(Request::Command(Command::Arm)), Some(Refusal::Grasping));
    bench.done(Request::Command(Command::Release));
    assert_eq!(bench.refused(GRASP), Some(Refusal::Releasing));
}

#[test]
fn every_parameter_can_be_read_and_set_back() {
    let mut bench = Bench::new();
    for parameter in Parameter::ALL {
        let count = parameter.count(JOINTS);
        for index in 0..count {
            let Reply::Value { setting: Setting { value, file }, .. } =
                bench.ask(Request::GetParameter { parameter, index })
            else {
                panic!("{parameter}");
            };
            assert_eq!(value, file, "{parameter}");
            bench.done(Request::SetParameter { parameter, index, value });
            let before = *bench.device.params().config();
            // Something else that can be used: tighter than the file, where there is a limit.
            let share = if parameter.bound() == Bound::AtLeast { 1.25 } else { 0.75 };
            let other = match parameter {
                Parameter::LATE_TICKS => 2.0,
                _ if parameter.key().to_string().starts_with("laws.") => 0.0,
                _ => share * value,
            };
            let other = if value.fract() == 0.0 && value > 4.0 { other.round() } else { other };
            match bench.refused(Request::SetParameter { parameter, index, value: other }) {
                None if other != value => assert_ne!(*bench.device.params().config(), before, "{parameter}"),
                None => {}
                Some(refusal) => panic!("{parameter} = {other}: {refusal:?}"),
            }
            bench.done(Request::SetParameter { parameter, index, value });
            assert_eq!(*bench.device.params().config(), before, "{parameter}");
            for bad in [f32::NAN, f32::INFINITY] {
                let refused = bench.refused(Request::SetParameter { parameter, index, value: bad });
                assert_eq!(refused, Some(Refusal::NotFinite));
            }
            let refused = |value| Request::SetParameter { parameter, index, value };
            let negative = match parameter.bound() {
                // A zero may be below zero as well as above.
                _ if [Parameter::GRAVITY, Parameter::ENCODER_ZERO].contains(&parameter) => None,
                Bound::AtLeast => Some(Refusal::BeyondFile),
                Bound::Free | Bound::AtMost => Some(Refusal::OutOfRange),
            };
            if negative.is_some() {
                assert_eq!(bench.refused(refused(-1.0)), negative, "{parameter}");
            }
            match parameter.bound() {
                Bound::Free => {}
                Bound::AtMost => {
                    let looser = (1.001 * value).max(value + 1e-6).ceil();
                    assert_eq!(bench.refused(refused(looser)), Some(Refusal::BeyondFile), "{parameter}");
                }
                Bound::AtLeast => {
                    let looser = (0.99 * value).min(value - 1e-6);
                    assert_eq!(bench.refused(refused(looser)), Some(Refusal::BeyondFile), "{parameter}");
                }
            }
            assert_eq!(*bench.device.params().config(), before, "refused, {parameter} changes nothing");
        }
        let request = Request::GetParameter { parameter, index: count };
        assert_eq!(bench.refused(request), Some(Refusal::NoSuchParameter));
    }
    assert_eq!(
        bench.refused(Request::SetParameter { parameter: Parameter::RELEASE_TIME, index: 0, value: 0.5 }),
        Some(Refusal::OutOfRange),
        "not whole"
    );
}

#[test]
fn parameters_are_set_while_disarmed_and_a_limit_that_is_off_stays_off() {
    let mut bench = Bench::grasping();
    let set = Request::SetParameter { parameter: Parameter::gain(0), index: 0, value: 1.0 };
    assert_eq!(bench.refused(set), Some(Refusal::NotDisarmed));
    let mut config = config::<12>();
    config.limits.slew_nm_s = None;
    let mut bench = Bench { device: Device::new(params(&config), identity(Clock::External)), ..Bench::new() };
    bench.ask(Request::Hello { interface_version: INTERFACE_VERSION });
    let set = Request::SetParameter { parameter: Parameter::SLEW_LIMIT, index: 0, value: 1.0 };
    assert_eq!(bench.refused(set), Some(Refusal::SwitchedOff));
}

#[test]
fn the_amplifiers_are_given_at_least_the_time_of_the_hands_file() {
    let mut config = config::<12>();
    config.supervisor.amplifier_start_ms = 20;
    let mut bench = Bench { device: Device::new(params(&config), identity(Clock::External)), ..Bench::new() };
    bench.ask(Request::Hello { interface_version: INTERFACE_VERSION });
    let parameter = Parameter::AMPLIFIER_START_TIME;
    for (value, refused, left) in [
        (30.0, None, 30.0),
        (19.0, Some(Refusal::BeyondFile), 30.0),
        (0.0, Some(Refusal::BeyondFile), 30.0),
        (20.0, None, 20.0),
    ] {
        assert_eq!(bench.refused(Request::SetParameter { parameter, index: 0, value }), refused);
        assert_eq!(bench.device.params().get(parameter, 0).map(|setting| setting.value), Ok(left));
    }
}

#[test]
fn records_come_as_asked_for() {
    let mut bench = Bench::new();
    assert!((0..10).all(|_| bench.tick(None).telemetry.is_none()));
    let unknown: Signals = postcard_byte(0x80);
    assert_eq!(
        bench.refused(Request::Telemetry { decimation: 1, signals: unknown }),
        Some(Refusal::OutOfRange)
    );
    for decimation in [1, 3, 10] {
        bench.done(Request::Telemetry { decimation: 0, signals: Signals::NONE });
        let first = bench.packet(Request::Telemetry { decimation, signals: Signals::COUNTS });
        let mut sequences = Vec::new();
        let mut packet = Some(first);
        for tick in 0..60 {
            let outputs = bench.tick(packet.take());
            let due = tick % usize::from(decimation) == 0;
            assert_eq!(outputs.telemetry, due.then_some(Form::Full(Signals::COUNTS)), "{decimation} {tick}");
            assert_eq!((outputs.record.cycles, outputs.record.dropped), (7, 3));
            if due {
                sequences.push(outputs.record.sequence);
            }
        }
        assert!(sequences.windows(2).all(|pair| pair[1] == pair[0] + 1), "{sequences:?}");
    }
    let mut record = bench.tick(None).record;
    record.keep(Signals::COUNTS);
    assert_eq!((record.counts.as_slice().len(), record.torques_nm.as_slice().len()), (12, 0));
    assert_eq!(record.limiting.as_slice().len(), 0);
}

/// No record that is told later holds what was noticed.
#[test]
fn a_tick_that_has_noticed_something_is_told_in_full_whatever_waits() {
    for signals in [Signals::ALL, Signals::FULL] {
        for (decimation, waiting) in [(0, 0), (1, 7), (1000, 0), (1000, 7)] {
            let mut bench = Bench::grasping();
            bench.done(Request::Telemetry { decimation, signals });
            bench.waiting = waiting;
            bench.done(Request::Command(Command::Release));
            let outputs: Vec<_> = (0..500)
                .map(|tick| {
                    let heartbeat = (tick % 50 == 0).then(|| bench.packet(Request::Heartbeat));
                    bench.tick(heartbeat)
                })
                .collect();
            let noticed: Vec<_> = outputs.iter().filter(|outputs| outputs.record.notice.is_some()).collect();
            assert!(!noticed.is_empty());
            for outputs in noticed {
                let told = (decimation > 0).then_some(Form::Full(signals));
                assert_eq!(outputs.telemetry, told, "{decimation}, {waiting}");
            }
        }
    }
}

/// A value that postcard writes as one byte.
fn postcard_byte<T: serde::de::DeserializeOwned>(byte: u8) -> T {
    postcard::from_bytes(&[byte]).expect("a byte")
}

#[test]
fn joints_over_the_link_are_for_another_image_and_real_ones_may_fail() {
    let mut bench = Bench::new();
    let sample = Sample { counts: List::first_of([0; 12], 12), failed: None, late: false };
    assert_eq!(bench.refused(Request::Joints(sample)), Some(Refusal::JointsAreReal));
    let raised = Raised::at(4, Fault::CounterReset);
    let inputs = Inputs { late: true, ..Inputs::default() };
    let record = bench.device.tick(&Reading::Failed(raised), &inputs, &mut bench.burst).record;
    assert_eq!((record.mode, record.fault, record.reading_failed), (Mode::Fault, Some(raised), Some(raised)));
    assert!(record.events.contains(Event::Late));
    bench.done(Request::Command(Command::ClearFault));
}

#[test]
fn what_is_no_packet_is_answered() {
    let packet = Packet12 { session: 9, sequence: 300, request: Request::Heartbeat };
    let mut buffer = [0; Packet12::MOST_BYTES];
    let bytes = postcard_bytes(&packet, &mut buffer);
    let (tag, _) = bytes.split_last_mut().expect("not empty");
    *tag = 99;
    assert!(Packet12::decode(bytes).is_err());
    let refused = Some(Refusal::NotUnderstood);
    assert_eq!(not_understood::<12>(bytes), Reply::Answer { sequence: 300, refused });
    assert_eq!(not_understood::<12>(&[]), Reply::Answer { sequence: 0, refused });
}

fn postcard_bytes<'a, T: serde::Serialize>(value: &T, buffer: &'a mut [u8]) -> &'a mut [u8] {
    postcard::to_slice(value, buffer).expect("it fits")
}

#[test]
fn the_longest_messages_fit() {
    let mut buffer = [0; 1024];
    let all = List::first_of([i32::MIN; 24], 24);
    let sample = Sample { counts: all, failed: Some(Raised::at(255, Fault::OutputFailed)), late: true };
    let packet = Packet::<24> { session: u16::MAX, sequence: u16::MAX, request: Request::Joints(sample) };
    assert!(postcard_bytes(&packet, &mut buffer).len() <= Packet::<24>::MOST_BYTES);
    let most = Grasp { gains: PerGain::all(Some(1.0)) };
    let packet = Packet::<1> {
        session: u16::MAX,
        sequence: u16::MAX,
        request: Request::Command(Command::Grasp(most)),
    };
    assert!(postcard_bytes(&packet, &mut buffer).len() <= Packet::<1>::MOST_BYTES);
    let mut identity = identity(Clock::Fallback);
    identity.image.hand = "a-hand-with-a-name-of-sixty-four-bytes-which-is-what-is-allowed!";
    let reply: Reply<'_, 1> =
        Reply::Identity { sequence: u16::MAX, session: u16::MAX, identity, ends_another: true };
    let length = postcard_bytes(&reply, &mut buffer).len();
    assert!(length <= Reply::<1>::MOST_BYTES, "{length} {}", Reply::<1>::MOST_BYTES);
    const { assert!(Record::<24>::MOST_BYTES < Reply::<24>::MOST_BYTES) };
}

/// Requests of every kind, most with values that can't be used.
fn requests() -> impl Strategy<Value = Request<12>> {
    let parameter = proptest::sample::select(Parameter::ALL.to_vec());
    let grasp = any::<[Option<f32>; GAIN_COUNT]>()
        .prop_map(|gains| Command::Grasp(Grasp { gains: PerGain::of(gains) }));
    prop_oneof![
        any::<u16>().prop_map(|interface_version| Request::Hello { interface_version }),
        proptest::sample::select(&Command::ALL[..]).prop_map(Request::Command),
        grasp.prop_map(Request::Command),
        Just(Request::Heartbeat),
        (parameter.clone(), any::<u8>(), any::<f32>())
            .prop_map(|(parameter, index, value)| Request::SetParameter { parameter, index, value }),
        (parameter, 0..14_u8, 0.0..100.0_f32).prop_map(|(parameter, index, value)| Request::SetParameter {
            parameter,
            index,
            value
        }),
        any::<u16>().prop_map(|decimation| Request::Telemetry { decimation, signals: Signals::ALL }),
        any::<u16>().prop_map(|decimation| Request::Telemetry { decimation, signals: Signals::FULL }),
        (0..300_u16).prop_map(|index| Request::Burst { index }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// Whatever is asked in whatever order and number: it is answered, torques are within their limits, and none without
    /// a session, a heartbeat and an order.
    #[test]
    fn whatever_is_asked_is_answered(requests in proptest::collection::vec((requests(), 0..3_u16, 0..4_u16), 1..300)) {
        let mut bench = Bench::new();
        for (request, session, step) in requests {
            bench.sequence = bench.sequence.wrapping_add(step);
            let packet = Packet { session, sequence: bench.sequence, request };
            // Through the wire and back.
            let mut buffer = [0; most_bytes(Packet12::MOST_BYTES)];
            let frame = link::encode(&packet, &mut buffer).unwrap();
            let mut receiver = Receiver::<{ Packet12::MOST_BYTES + 4 }>::new();
            let mut received = None;
            for &byte in frame {
                if let Some(payload) = receiver.push(byte) {
                    received = Some(Packet12::decode(payload.unwrap()).unwrap());
                }
            }
            let outputs = bench.tick(received);
            prop_assert!(outputs.reply.is_some());
            let torque_limits = bench.device.params().config().limits.torque_nm.unwrap();
            for (torque, limit) in outputs.torques_nm.iter().zip(torque_limits) {
                prop_assert!(torque.abs() <= limit);
            }
            if !matches!(outputs.record.mode, Mode::Armed | Mode::Grasping | Mode::Releasing) {
                prop_assert_eq!(outputs.torques_nm, [0.0; 12]);
            }
        }
    }
}

/// Asks for full records, and takes the answer.
fn full(bench: &mut Bench, decimation: u16) {
    bench.done(Request::Telemetry { decimation, signals: Signals::FULL });
}

#[test]
fn the_burst_holds_what_was_around_the_fault_until_the_hand_is_armed() {
    let mut bench = Bench::grasping();
    assert_eq!(bench.refused(Request::Burst { index: 0 }), Some(Refusal::NoBurst));
    for _ in 0..300 {
        bench.ask(Request::Heartbeat);
    }
    let raised = Raised::at(4, Fault::CounterReset);
    let first = bench.tick_with(Reading::Failed(raised), 3, None).record;
    assert_eq!(first.mode, Mode::Fault);
    assert_eq!(bench.refused(Request::Burst { index: 0 }), Some(Refusal::BurstNotOver));
    for _ in 0..AFTER {
        bench.tick(None);
    }
    let total = (BEFORE + AFTER) as u16;
    for again in 0..2 {
        for asked in 0..total {
            let reply = bench.ask(Request::Burst { index: asked });
            let Reply::Burst { index, count, record, .. } = reply else { panic!("{reply:?}") };
            assert_eq!((index, count), (asked, total));
            // One a tick, and the fault is where it should be.
            let tick = first.tick - BEFORE as u32 + u32::from(asked);
            assert_eq!((record.tick, record.sequence), (tick, tick));
            let mode = if usize::from(asked) < BEFORE { Mode::Grasping } else { Mode::Fault };
            assert_eq!(record.mode, mode, "{asked}, for the time {again}");
            assert_eq!(record.reading_failed, (record.tick == first.tick).then_some(raised));
            assert_eq!(record.torques_nm.as_slice().len(), 12);
        }
    }
    assert_eq!(bench.refused(Request::Burst { index: total }), Some(Refusal::OutOfRange));
    // Clearing the fault does not lose it; arming does.
    bench.ask(Request::Heartbeat);
    bench.done(Request::Command(Command::ClearFault));
    assert!(matches!(bench.ask(Request::Burst { index: 0 }), Reply::Burst { .. }));
    bench.done(Request::Command(Command::Arm));
    assert_eq!(bench.refused(Request::Burst { index: 0 }), Some(Refusal::NoBurst));
    // A fault soon after: what was before it is less.
    bench.tick_with(Reading::Failed(raised), 3, None);
    for _ in 0..AFTER {
        bench.tick(None);
    }
    let reply = bench.ask(Request::Burst { index: 0 });
    let Reply::Burst { count, .. } = reply else { panic!("{reply:?}") };
    assert_eq!(usize::from(count), AFTER + 2, "since the tick that armed it");
}

#[test]
fn where_records_wait_for_the_line_input_records_stand_in_for_full_ones() {
    let mut bench = Bench::new();
    full(&mut bench, 1);
    let forms = |bench: &mut Bench, waiting: usize, ticks: usize| {
        bench.waiting = waiting;
        let told = (0..ticks).map(|_| bench.tick(None)).collect::<Vec<_>>();
        assert!(told.iter().all(|outputs| outputs.record.decimation == 1), "every tick is told of");
        let is_full = |outputs: &&Outputs<12>| outputs.telemetry == Some(Form::Full(Signals::FULL));
        let full = told.iter().filter(is_full).count();
        let inputs = told.iter().filter(|outputs| outputs.telemetry == Some(Form::Input)).count();
        (full, inputs, told.iter().filter(|outputs| outputs.part.is_some()).count())
    };
    forms(&mut bench, 0, 200);
    assert_eq!(forms(&mut bench, 0, 90), (90, 0, 0), "the snapshot is over");
    assert_eq!(forms(&mut bench, 1, 90), (90, 0, 0));
    assert_eq!(forms(&mut bench, 2, 90), (0, 90, 0));
    assert_eq!(forms(&mut bench, 0, 90), (90, 0, 0), "and back at once");
    // The next snapshot begins.
    assert_eq!(forms(&mut bench, 4, 1000).2, 0);
    assert!(forms(&mut bench, 3, 80).2 >= 10);
    // A line that is too slow for all input records gets a full one now and then; where there is no room, not even that.
    assert_eq!(forms(&mut bench, WAITING_MOST - 1, 1000).0, 10);
    assert_eq!(forms(&mut bench, WAITING_MOST, 1000).0, 0);
    // Nothing stands in where it was not asked for.
    bench.done(Request::Telemetry { decimation: 3, signals: Signals::ALL });
    bench.waiting = 2;
    assert!((0..90).all(|_| bench.tick(None).telemetry.is_none()));
    bench.waiting = 0;
    let told = (0..90).map(|_| bench.tick(None)).filter(|outputs| outputs.telemetry.is_some());
    assert_eq!(told.map(|outputs| outputs.record.decimation).collect::<Vec<_>>(), [3; 30]);
    bench.done(Request::Telemetry { decimation: 0, signals: Signals::NONE });
    assert_eq!(bench.tick(None).record.decimation, 1, "where nothing is sent");
}

#[test]
fn snapshots_come_in_parts_and_are_the_state_after_their_tick() {
    let mut bench = Bench::grasping();
    let begun = bench.packet(Request::Telemetry { decimation: 1, signals: Signals::FULL });
    let mut packet = Some(begun);
    let mut collector = Collector::new();
    let (mut saved, mut whole, mut last_part) = (Vec::new(), Vec::new(), 0);
    let mut buffer = [0; 2048];
    for tick in 0..2500_u32 {
        let outputs = bench.tick(packet.take());
        let state = bench.device.state().save(bench.device.params(), &mut buffer).unwrap();
        saved.push((outputs.record.tick, state.to_vec()));
        if let Some(part) = outputs.part {
            assert!(whole.is_empty() || tick - last_part >= 4, "one in four ticks");
            last_part = tick;
            assert!(part.bytes.len() <= PART_BYTES);
            if let Some((tick, bytes)) = collector.add(&part) {
                whole.push((tick, bytes.to_vec()));
            }
        }
    }
    let first = saved[0].0;
    assert_eq!(whole.iter().map(|(tick, _)| tick - first).collect::<Vec<_>>(), [0, 1000, 2000]);
    println!("{} bytes in {} parts", whole[0].1.len(), whole[0].1.len().div_ceil(PART_BYTES));
    for snapshot in whole {
        assert!(saved.contains(&snapshot));
    }
}

#[test]
fn a_snapshot_with_a_part_missing_is_never_whole() {
    for missing in 0..5 {
        let mut bench = Bench::grasping();
        full(&mut bench, 1);
        let mut collector = Collector::new();
        let mut parts = 0;
        for _ in 0..900 {
            if let Some(part) = bench.tick(None).part {
                parts += 1;
                assert!(parts - 1 == missing || collector.add(&part).is_none(), "without part {missing}");
            }
        }
        assert!(parts > 5, "{parts}");
        let whole =
            (0..1000).filter_map(|_| bench.tick(None).part).any(|part| collector.add(&part).is_some());
        assert!(whole, "the next is whole again");
    }
}
