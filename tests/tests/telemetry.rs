//! The share of the telemetry at full rate that gets through: the device, the queues of the firmware, and a line that
//! takes so many bytes a millisecond.
//!
//!     cargo test --release -p blindgrasp-tests --test science telemetry -- --show-output

use blindgrasp::body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp::model::{HandModel, Scene};
use blindgrasp::sim::Simulation;
use blindgrasp::sim::controller::{Controller, Stepped, Turn};
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::device::{Device, Inputs, Outputs, WAITING_MOST};
use blindgrasp_shared::fault::{Fault, FaultConfig, Raised};
use blindgrasp_shared::identity::{Clock, Identity, Image};
use blindgrasp_shared::joints::Reading;
use blindgrasp_shared::link::message::{Packet, Reply, Request, Signals};
use blindgrasp_shared::link::{InputRecord, Receiver, encode, most_bytes};
use blindgrasp_shared::math::Real;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::burst::Burst;
use blindgrasp_shared::telemetry::snapshot::Collector;
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, Record};
use blindgrasp_shared::tick::{Config, Params, Sensed};
use std::collections::VecDeque;
use std::convert::Infallible;

/// Room of the firmware's queue of answers.
const QUEUE: usize = 7;
/// Ticks from one heartbeat to the next.
const HEARTBEAT_TICKS: u64 = 50;

type Hand = Device<MAX_JOINTS, MAX_FINGERS>;

/// A device, its queues, its line, and who listens at the other end.
struct Line {
    device: Hand,
    burst: Box<Burst<MAX_JOINTS>>,
    answers: VecDeque<Reply<'static, MAX_JOINTS>>,
    telemetry: VecDeque<Reply<'static, MAX_JOINTS>>,
    dropped: u32,
    /// The frame that is being sent.
    frame: VecDeque<u8>,
    /// Bytes a tick.
    rate: f64,
    credit: f64,
    /// Bytes that were sent in each tick, and those that each tick's telemetry came to.
    sent: Vec<usize>,
    session: u16,
    sequence: u16,
    tick: u64,
    signals: Signals,
    receiver: Receiver<2048>,
    collector: Collector,
    /// The device's records since it was looked at, for comparison.
    computed: VecDeque<Record<MAX_JOINTS>>,
    heard: Heard,
}

/// The records at the other end.
#[derive(Default)]
struct Heard {
    full: u64,
    inputs: u64,
    longest_full: usize,
    longest_input: usize,
    missing: u64,
    snapshots: u64,
    /// Number of the last that was told, and what the last full record says was dropped.
    last: Option<u32>,
    dropped: u32,
}

impl Line {
    fn new(config: &Config<MAX_JOINTS>, baud: f64) -> Self {
        let scene = Scene::load("cube", &[]).expect("it is built in");
        let image = Image {
            interface_version: INTERFACE_VERSION,
            kind: "hand",
            hand: "three-finger",
            hand_hash: 0,
            firmware_version: "0",
            build_hash: 0,
            joint_count: 12,
            fingertip_count: 3,
            period_us: 1000,
        };
        let clock = Clock::External;
        let identity = Identity::of(image, clock);
        Self {
            device: Device::new(Params::new(scene.hand.cast(), config).expect("parameters"), identity),
            burst: Box::new(Burst::new()),
            answers: VecDeque::new(),
            telemetry: VecDeque::new(),
            dropped: 0,
            frame: VecDeque::new(),
            // Ten bits a byte.
            rate: baud / 10.0 / 1000.0,
            credit: 0.0,
            sent: Vec::new(),
            session: 0,
            sequence: 0,
            tick: 0,
            signals: Signals::FULL,
            receiver: Receiver::new(),
            collector: Collector::new(),
            computed: VecDeque::new(),
            heard: Heard::default(),
        }
    }

    /// A tick of the device, and a millisecond of the line.
    fn turn(&mut self, reading: Reading<MAX_JOINTS>, command: Option<Command>) -> Outputs<MAX_JOINTS> {
        let request = match (self.tick, command) {
            (0, _) => Some(Request::Hello { interface_version: INTERFACE_VERSION }),
            (1, _) => Some(Request::Telemetry { decimation: 1, signals: self.signals }),
            (_, Some(command)) => Some(Request::Command(command)),
            (tick, None) => tick.is_multiple_of(HEARTBEAT_TICKS).then_some(Request::Heartbeat),
        };
        self.tick += 1;
        let packet = request.map(|request| {
            self.sequence = self.sequence.wrapping_add(1);
            Packet { session: self.session, sequence: self.sequence, request }
        });
        let inputs = Inputs {
            cycles: 16_000,
            dropped: self.dropped,
            waiting: self.telemetry.len(),
            packet,
            ..Inputs::default()
        };
        let outputs = self.device.tick(&reading, &inputs, &mut self.burst);
        if let Some(reply) = &outputs.reply {
            if let Reply::Identity { session, .. } = reply {
                self.session = *session;
            }
            assert!(!matches!(reply, Reply::Answer { refused: Some(_), .. }), "{reply:?}");
            let full = self.answers.len() >= QUEUE;
            self.dropped += u32::from(full);
            if !full {
                self.answers.push_back(reply.clone());
            }
        }
        if let Some(form) = outputs.telemetry
            && self.tell(form.of(&outputs.record))
        {
            self.computed.push_back(outputs.record.clone());
        }
        if let Some(part) = outputs.part.clone() {
            self.tell(Reply::Snapshot(part));
        }
        self.send();
        outputs
    }

    /// Leaves something for the line, if there is room; tells if there was.
    fn tell(&mut self, reply: Reply<'static, MAX_JOINTS>) -> bool {
        let has_room = self.telemetry.len() < WAITING_MOST;
        if has_room {
            self.telemetry.push_back(reply);
        } else {
            self.dropped += 1;
        }
        has_room
    }

    fn send(&mut self) {
        self.credit += self.rate;
        let mut bytes = 0;
        while self.credit >= 1.0 {
            if self.frame.is_empty() {
                let Some(reply) = self.answers.pop_front().or_else(|| self.telemetry.pop_front()) else {
                    // What is not used is lost.
                    self.credit = 0.0;
                    break;
                };
                let mut buffer = [0; most_bytes(Reply::<MAX_JOINTS>::MOST_BYTES)];
                let frame = encode(&reply, &mut buffer).expect("room").to_vec();
                self.hear(&frame);
                self.frame = frame.into();
            }
            self.frame.pop_front();
            self.credit -= 1.0;
            bytes += 1;
        }
        self.sent.push(bytes);
    }

    /// The other end: nothing is lost on this line.
    fn hear(&mut self, frame: &[u8]) {
        let mut payload = None;
        for &byte in frame {
            if let Some(received) = self.receiver.push(byte) {
                payload = Some(received.expect("a good frame").to_vec());
            }
        }
        let payload = payload.expect("a whole frame");
        let reply = Reply::<MAX_JOINTS>::decode(&payload).expect("a reply");
        if let Reply::Snapshot(part) = &reply {
            self.heard.snapshots += u64::from(self.collector.add(part).is_some());
        }
        if !matches!(reply, Reply::Record(_) | Reply::Input(_)) {
            return;
        }
        let was = self.computed.pop_front().expect("it was computed");
        let heard = &mut self.heard;
        let (count, longest) = match reply {
            Reply::Record(record) => {
                assert_eq!(record, was);
                heard.dropped = record.dropped;
                (&mut heard.full, &mut heard.longest_full)
            }
            reply => {
                assert_eq!(reply, Reply::Input(InputRecord::of(&was)));
                (&mut heard.inputs, &mut heard.longest_input)
            }
        };
        *count += 1;
        *longest = frame.len().max(*longest);
        heard.missing += u64::from(was.sequence - heard.last.unwrap_or(was.sequence.wrapping_sub(1)) - 1);
        heard.last = Some(was.sequence);
    }

    fn print(&self, what: &str) {
        let (bytes, ticks) = (self.sent.iter().sum::<usize>(), self.sent.len());
        let heard = &self.heard;
        println!(
            "{what}: {ticks} ticks, {:.2} bytes a tick on the line ({:.1} % of it); {} full records of at most {} bytes, \
             {} input records of at most {}; {} snapshots; {} dropped",
            bytes as f64 / ticks as f64,
            100.0 * bytes as f64 / ticks as f64 / self.rate,
            heard.full,
            heard.longest_full,
            heard.inputs,
            heard.longest_input,
            heard.snapshots,
            self.dropped,
        );
    }

    /// Every tick is told of, by full or input records, and so is the state; what is left of the line is full records.
    fn tells_everything(&self) {
        let (heard, ticks) = (&self.heard, self.sent.len() as u64);
        assert_eq!((self.dropped, heard.missing), (0, 0));
        assert!(heard.full + heard.inputs >= ticks - 10);
        assert!(heard.snapshots >= 59, "{}", heard.snapshots);
        assert!(heard.full > ticks / 10, "{}", heard.full);
        assert!(heard.longest_input <= 75, "{}", heard.longest_input);
    }
}

impl Controller for Line {
    type Error = Infallible;

    fn step(&mut self, turn: &Turn<'_>) -> Result<Stepped, Infallible> {
        let Sensed::Counts(counts) = turn.sensed else { panic!("the scene has encoders") };
        // Hello, telemetry and a heartbeat before the hand is armed.
        if turn.command == Some(Command::Arm) {
            for _ in 0..=HEARTBEAT_TICKS {
                self.turn(Reading::Counts(*counts), None);
            }
        }
        let outputs = self.turn(Reading::Counts(*counts), turn.command);
        let state = self.device.state();
        let mut torques_nm = outputs.torques_nm;
        // Somebody shakes the fingers, each joint at its own pace.
        for (k, torque) in torques_nm.iter_mut().enumerate().take(12) {
            let phase = self.tick as f32 * (0.02 + 0.011 * k as f32);
            *torque += SHAKE_NM * phase.sine_cosine().0;
        }
        Ok(Stepped {
            torques_nm,
            angles_rad: *state.angles_rad(),
            speeds_rad_s: *state.speeds_rad_s(),
            force_n: outputs.record.gains.grasp[0],
            mode: outputs.record.mode,
            fault: outputs.record.fault,
            noticed: outputs.record.notice,
            refused: outputs.record.answer.and_then(|answer| answer.refused),
        })
    }
}

/// Torque by which the fingers are shaken, N m: five times as much loses the cube.
const SHAKE_NM: f32 = 0.004;

fn hand_config() -> Config<MAX_JOINTS> {
    let scene = Scene::load("cube", &[]).expect("it is built in");
    let mut config = HandModel::of(&scene).expect("it has a firmware").config;
    // Nothing is between fingertips that only swing: a grasp begins at once, and is no more than the law.
    config.cycle.closing.speed_m_s = 0.0;
    config.laws.gains.frame = [0.0; 2];
    config
}

#[test]
fn every_tick_of_a_shaken_grasp_is_told_of_at_one_megabaud() {
    let settings = ["duration_s=60".to_owned()];
    let scene = Scene::load("cube", &settings).expect("the scene");
    let config = hand_config();
    let mut simulation = Simulation::with_controller(&scene, Line::new(&config, 1e6)).expect("a plant");
    let Ok(run) = simulation.try_run();
    let line = simulation.controller();
    line.print("1 Mbaud, a grasp that is shaken");
    assert!(run.summary.grasp_held && run.summary.fault.is_none(), "{:?}", run.summary);
    line.tells_everything();
}

/// Counts of joints that swing to and fro at up to so many rad/s, each at its own pace.
fn swinging(config: &Config<MAX_JOINTS>, tick: u64, speed_rad_s: f64) -> Reading<MAX_JOINTS> {
    Reading::Counts(std::array::from_fn(|k| {
        let rate_1_s = 100.0 + 31.0 * k as f64;
        let angle_rad = speed_rad_s / rate_1_s * (rate_1_s * tick as f64 / 1000.0).sine_cosine().0;
        (angle_rad / f64::from(config.estimator.encoders[k.min(11)].rad_per_count)) as i32
    }))
}

/// Faster than the hand: every joint at the no-load speed of its motor, for a minute.
#[test]
fn a_minute_at_the_speed_of_the_motors_loses_nothing() {
    let mut config = hand_config();
    config.faults = FaultConfig { heartbeat_ms: config.faults.heartbeat_ms, ..FaultConfig::LEAST };
    for (speed_rad_s, integral) in [(20.0, 0.0), (70.0, 0.0), (70.0, 0.02), (185.0, 0.0)] {
        config.laws.gains.integral[0] = integral;
        config.limits.gains.integral[0] = Some(integral);
        let mut line = Line::new(&config, 1e6);
        for tick in 0..60_000 {
            let command = match tick {
                60 => Some(Command::Arm),
                70 => Some(Command::Grasp(Grasp::CONFIGURED)),
                _ => None,
            };
            let reading = swinging(&config, tick, speed_rad_s);
            let record = line.turn(reading, command).record;
            assert!(tick <= 70 || record.mode == Mode::Grasping, "{record:?}");
        }
        line.print(&format!("1 Mbaud, {speed_rad_s} rad/s, K_I {integral} N m/rad"));
        line.tells_everything();
    }
}

/// A line that has no time even for the input records: what is lost is counted and told, and full records still come.
/// Without input records none is lost: there are fewer.
#[test]
fn a_slower_line_gets_fewer_records_and_is_told_so() {
    let mut config = hand_config();
    config.faults = FaultConfig { heartbeat_ms: config.faults.heartbeat_ms, ..FaultConfig::LEAST };
    for (baud, signals) in [115_200.0, 230_400.0, 460_800.0]
        .into_iter()
        .flat_map(|baud| [(baud, Signals::FULL), (baud, Signals::ALL.and(Signals::STATE))])
    {
        let mut line = Line::new(&config, baud);
        line.signals = signals;
        for tick in 0..20_000 {
            line.turn(swinging(&config, tick, 20.0), (tick == 60).then_some(Command::Arm));
        }
        line.print(&format!("{baud} baud, {signals}"));
        let share = line.sent.iter().sum::<usize>() as f64 / line.sent.len() as f64 / line.rate;
        assert!(share > 0.9, "{share}");
        assert!(line.heard.missing <= u64::from(line.dropped));
        if signals.contain(Signals::INPUTS) {
            assert!(line.heard.dropped > 0 && line.heard.full > 100, "{}", line.heard.full);
        } else {
            assert_eq!(line.dropped, 0);
            assert!(line.heard.full > 1000 && line.heard.snapshots > 2);
        }
    }
}

/// After an overload there are as many full records as before.
#[test]
fn the_rate_of_records_goes_up_again() {
    let mut line = Line::new(&hand_config(), 3e6);
    let still = Reading::Counts([0; MAX_JOINTS]);
    let full_in = |line: &mut Line, ticks: u64| {
        let before = line.heard.full;
        for _ in 0..ticks {
            line.turn(still, None);
        }
        line.heard.full - before
    };
    full_in(&mut line, 10);
    assert_eq!(full_in(&mut line, 1000), 1000);
    line.rate = 80.0;
    assert!((1..500).contains(&full_in(&mut line, 1000)));
    line.rate = 300.0;
    full_in(&mut line, 10);
    assert_eq!(full_in(&mut line, 1000), 1000);
    assert_eq!((line.dropped, line.heard.missing), (0, 0));
}

/// The records that are read out after a fault are whole, whatever the line carried meanwhile.
#[test]
fn the_burst_is_at_full_rate_whatever_the_decimation() {
    let mut line = Line::new(&hand_config(), 115_200.0);
    let still = Reading::Counts([0; MAX_JOINTS]);
    for _ in 0..3000 {
        line.turn(still, None);
    }
    let raised = Raised::at(3, Fault::SampleMissing);
    line.turn(Reading::Failed(raised), None);
    for _ in 0..200 {
        line.turn(still, None);
    }
    let total = blindgrasp_shared::telemetry::burst::BEFORE + blindgrasp_shared::telemetry::burst::AFTER;
    let mut ticks = Vec::new();
    for index in 0..total as u16 {
        line.sequence += 1;
        let packet =
            Packet { session: line.session, sequence: line.sequence, request: Request::Burst { index } };
        let packet = Some(packet);
        let inputs = Inputs { dropped: line.dropped, packet, ..Inputs::default() };
        match line.device.tick(&still, &inputs, &mut line.burst).reply {
            Some(Reply::Burst { record, .. }) => ticks.push(record.tick),
            other => panic!("{other:?}"),
        }
    }
    assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 1));
    assert_eq!(ticks.len(), total);
}
