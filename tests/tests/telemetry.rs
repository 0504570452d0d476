//! Whether the telemetry at full rate fits the line: the device, the sender and the queues of the firmware, and a line
//! that takes so many bytes a millisecond.
//!
//!     cargo test --release -p blindgrasp-tests --test telemetry -- --show-output

use blindgrasp::scene::{HandModel, Scene};
use blindgrasp::sim::Simulation;
use blindgrasp::sim::controller::{Controller, Stepped, Turn};
use blindgrasp::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::device::{Device, Inputs, Outputs, Reading};
use blindgrasp_shared::fault::{Fault, FaultConfig, Raised};
use blindgrasp_shared::identity::{Clock, Identity, Image};
use blindgrasp_shared::link::message::{Packet, Reply, Request, Signals};
use blindgrasp_shared::link::{Listener, Receiver, Sender, most_bytes};
use blindgrasp_shared::math::Real;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::burst::Burst;
use blindgrasp_shared::telemetry::dense::{digest, quantised};
use blindgrasp_shared::telemetry::snapshot::{Collector, Part};
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, Record};
use blindgrasp_shared::tick::{Config, Params, Sensed};
use std::collections::VecDeque;
use std::convert::Infallible;

/// Room of a queue of the firmware.
const QUEUE: usize = 7;
/// Ticks from one heartbeat to the next.
const HEARTBEAT_TICKS: u64 = 50;

type Hand = Device<MAX_JOINTS, MAX_FINGERS>;

enum Telemetry {
    Record(Box<Record<MAX_JOINTS>>, Signals),
    Part(Part),
}

/// A device, its queues, its line, and who listens at the other end.
struct Line {
    device: Hand,
    burst: Box<Burst<MAX_JOINTS>>,
    sender: Sender<MAX_JOINTS>,
    answers: VecDeque<Reply<'static, MAX_JOINTS>>,
    telemetry: VecDeque<Telemetry>,
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
    receiver: Receiver<2048>,
    listener: Listener<MAX_JOINTS>,
    collector: Collector,
    /// What the device did since it was looked at, for comparison.
    computed: VecDeque<Record<MAX_JOINTS>>,
    heard: Heard,
}

/// What came at the other end.
#[derive(Default)]
struct Heard {
    records: u64,
    dense: u64,
    dense_bytes: u64,
    longest_dense: usize,
    longest: usize,
    missing: u64,
    snapshots: u64,
    last: Option<Record<MAX_JOINTS>>,
    decimations: Vec<u16>,
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
            sender: Sender::new(),
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
            receiver: Receiver::new(),
            listener: Listener::new(),
            collector: Collector::new(),
            computed: VecDeque::new(),
            heard: Heard::default(),
        }
    }

    /// A tick of the device, and a millisecond of the line.
    fn turn(&mut self, reading: Reading<MAX_JOINTS>, command: Option<Command>) -> Outputs<MAX_JOINTS> {
        let request = match (self.tick, command) {
            (0, _) => Some(Request::Hello { interface_version: INTERFACE_VERSION }),
            (1, _) => Some(Request::Telemetry { decimation: 1, signals: Signals::FULL }),
            (_, Some(command)) => Some(Request::Command(command)),
            (tick, None) => tick.is_multiple_of(HEARTBEAT_TICKS).then_some(Request::Heartbeat),
        };
        self.tick += 1;
        let packet = request.map(|request| {
            self.sequence = self.sequence.wrapping_add(1);
            Packet { session: self.session, sequence: self.sequence, request }
        });
        let inputs =
            Inputs { reading, late: false, supply_low: false, cycles: 16_000, dropped: self.dropped, packet };
        let outputs = self.device.tick(&inputs, &mut self.burst);
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
        if let Some(signals) = outputs.telemetry {
            self.tell(Telemetry::Record(Box::new(outputs.record.clone()), signals));
        }
        if let Some(part) = outputs.part.clone() {
            self.tell(Telemetry::Part(part));
        }
        self.send();
        outputs
    }

    fn tell(&mut self, telemetry: Telemetry) {
        if self.telemetry.len() < QUEUE {
            if let Telemetry::Record(record, _) = &telemetry {
                self.computed.push_back((**record).clone());
            }
            self.telemetry.push_back(telemetry);
        } else {
            self.dropped += 1;
        }
    }

    fn send(&mut self) {
        self.credit += self.rate;
        let mut bytes = 0;
        while self.credit >= 1.0 {
            if self.frame.is_empty() {
                let mut buffer = [0; most_bytes(Reply::<MAX_JOINTS>::MOST_BYTES)];
                let frame = match (self.answers.pop_front(), &self.telemetry.front()) {
                    (Some(reply), _) => self.sender.reply(&reply, &mut buffer),
                    (None, Some(Telemetry::Record(record, signals))) => {
                        self.sender.record(record, *signals, &mut buffer)
                    }
                    (None, Some(Telemetry::Part(part))) => {
                        self.sender.reply(&Reply::Snapshot(part.clone()), &mut buffer)
                    }
                    (None, None) => {
                        // What is not used is lost.
                        self.credit = 0.0;
                        break;
                    }
                };
                let frame = frame.expect("room").to_vec();
                let is_answer = frame.get(1).is_some_and(|&index| index < 3);
                if !is_answer {
                    self.telemetry.pop_front();
                }
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
        let heard = self.listener.hear(&payload).expect("nothing is lost on the line");
        match heard.reply {
            Reply::Record(record) => {
                let was = self.computed.pop_front().expect("it was computed");
                match heard.digest {
                    None => assert_eq!(record, was),
                    Some(told) => {
                        assert_eq!(record, quantised(&was));
                        assert_eq!(told, digest(&was));
                        self.heard.dense += 1;
                        self.heard.dense_bytes += frame.len() as u64;
                        self.heard.longest_dense = self.heard.longest_dense.max(frame.len());
                    }
                }
                self.heard.records += 1;
                self.heard.longest = self.heard.longest.max(frame.len());
                if let Some(last) = &self.heard.last {
                    self.heard.missing += u64::from(record.sequence - last.sequence - 1);
                }
                if self.heard.decimations.last() != Some(&record.decimation) {
                    self.heard.decimations.push(record.decimation);
                }
                self.heard.last = Some(record);
            }
            Reply::Snapshot(part) => {
                self.heard.snapshots += u64::from(self.collector.add(&part).is_some());
            }
            _ => {}
        }
    }

    fn print(&self, what: &str) {
        let (bytes, ticks) = (self.sent.iter().sum::<usize>(), self.sent.len());
        let heard = &self.heard;
        println!(
            "{what}: {ticks} ticks, {:.2} bytes a tick on the line ({:.1} % of it); {} records, {} of them dense with \
             {:.2} bytes (at most {}), full at most {}; {} snapshots; {} dropped; one in {:?}",
            bytes as f64 / ticks as f64,
            100.0 * bytes as f64 / ticks as f64 / self.rate,
            heard.records,
            heard.dense,
            heard.dense_bytes as f64 / heard.dense.max(1) as f64,
            heard.longest_dense,
            heard.longest,
            heard.snapshots,
            self.dropped,
            heard.decimations,
        );
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
        })
    }
}

/// How hard the fingers are shaken, N m: five times as much loses the cube.
const SHAKE_NM: f32 = 0.004;

fn hand_config() -> Config<MAX_JOINTS> {
    let scene = Scene::load("cube", &[]).expect("it is built in");
    HandModel::of(&scene).expect("it has a firmware").config
}

#[test]
fn a_minute_of_a_shaken_grasp_fits_a_line_of_one_megabaud() {
    let settings = ["duration_s=60".to_owned()];
    let scene = Scene::load("cube", &settings).expect("the scene");
    let config = hand_config();
    let mut simulation = Simulation::with_controller(&scene, Line::new(&config, 1e6)).expect("a plant");
    let Ok(run) = simulation.try_run(|_| {});
    let line = simulation.controller();
    line.print("1 Mbaud, a grasp that is shaken");
    assert!(run.summary.grasp_held && run.summary.fault.is_none(), "{:?}", run.summary);
    assert_eq!((line.dropped, line.heard.missing), (0, 0));
    assert_eq!(line.heard.decimations, [1]);
    assert!(line.heard.records >= 60_000 && line.heard.snapshots >= 60);
    // A fifth of the line is free.
    let mean = line.sent.iter().sum::<usize>() as f64 / line.sent.len() as f64;
    assert!(mean <= 80.0, "{mean}");
    assert!(line.heard.longest_dense <= 80, "{}", line.heard.longest_dense);
}

/// Counts of joints that swing to and fro at up to so many rad/s, each at its own pace.
fn swinging(config: &Config<MAX_JOINTS>, tick: u64, speed_rad_s: f64) -> Reading<MAX_JOINTS> {
    Reading::Counts(std::array::from_fn(|k| {
        let rate_1_s = 100.0 + 31.0 * k as f64;
        let angle_rad = speed_rad_s / rate_1_s * (rate_1_s * tick as f64 / 1000.0).sine_cosine().0;
        (angle_rad / f64::from(config.estimator.encoders[k.min(11)].rad_per_count)) as i32
    }))
}

/// Faster than the hand: every joint at the no-load speed of its motor, for a minute. Up to 70 rad/s a fifth of the line is
/// free, even with the terms of both laws at once.
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
        let mean = line.sent.iter().sum::<usize>() as f64 / line.sent.len() as f64;
        assert!(speed_rad_s > 70.0 || mean <= 80.0, "{mean}");
        assert_eq!((line.dropped, line.heard.missing), (0, 0));
        assert!(line.heard.snapshots >= 59, "{}", line.heard.snapshots);
    }
}

#[test]
fn a_slower_line_gets_fewer_records_is_told_so_and_then_loses_nothing() {
    let mut config = hand_config();
    config.faults = FaultConfig { heartbeat_ms: config.faults.heartbeat_ms, ..FaultConfig::LEAST };
    for baud in [115_200.0, 230_400.0, 460_800.0] {
        let mut line = Line::new(&config, baud);
        let mut dropped = Vec::new();
        for tick in 0..20_000 {
            line.turn(swinging(&config, tick, 20.0), (tick == 60).then_some(Command::Arm));
            dropped.push(line.dropped);
        }
        line.print(&format!("{baud} baud"));
        let last = dropped.iter().position(|&count| count == line.dropped).expect("the last");
        println!("  the last was dropped in tick {last}");
        assert!(line.dropped > 0 && last < 3000, "{last}");
        let told = line.heard.last.as_ref().expect("records");
        assert_eq!(told.dropped, line.dropped, "all of it is told");
        assert_eq!(line.heard.decimations.last(), Some(&told.decimation));
        assert!(line.heard.missing <= u64::from(line.dropped));
        // What was lost is records or parts, each is counted: and the line is well used.
        let settled = &line.sent[5000..];
        let share = settled.iter().sum::<usize>() as f64 / settled.len() as f64 / line.rate;
        println!("  {:.0} % of the line is used", 100.0 * share);
        assert!(share > 0.3, "{share}");
        assert!(line.heard.snapshots > 2);
    }
}

/// What is read out after a fault is whole, whatever the line carried meanwhile.
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
        let inputs = Inputs {
            reading: still,
            late: false,
            supply_low: false,
            cycles: 0,
            dropped: line.dropped,
            packet,
        };
        match line.device.tick(&inputs, &mut line.burst).reply {
            Some(Reply::Burst { record, .. }) => ticks.push(record.tick),
            other => panic!("{other:?}"),
        }
    }
    assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 1));
    assert_eq!(ticks.len(), total);
}
