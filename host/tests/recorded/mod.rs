//! A device and its host, tick by tick, with a recording of what goes between them.

#![allow(dead_code, reason = "each test file uses its part")]
#![allow(clippy::unwrap_used, reason = "only tests use it")]

use blindgrasp::body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp::model::{HandFile, HandModel};
use blindgrasp::record::mcap::{About, Device as Recorded, Saved, Setting, Stamp, Writer};
use blindgrasp_shared::command::Command;
use blindgrasp_shared::device::{Device, Inputs};
use blindgrasp_shared::fault::Raised;
use blindgrasp_shared::identity::{Clock, Identity, Image, ResetCause, UNITS};
use blindgrasp_shared::joints::Reading;
use blindgrasp_shared::link::message::{Form, Packet, Reply, Request, Signals};
use blindgrasp_shared::link::{Receiver, encode, most_bytes};
use blindgrasp_shared::math::Real;
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::telemetry::burst::Burst;
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, Record};
use blindgrasp_shared::tick::{Config, Input, State, tick};
use std::f64::consts::TAU;
use std::path::Path;

pub(crate) type AnyRecord = Record<MAX_JOINTS>;
pub(crate) type AnyConfig = Config<MAX_JOINTS>;

/// Time of a tick, ns.
pub(crate) const TICK_NS: u64 = 1_000_000;
/// The beginning of recordings, ns since 1970.
pub(crate) const START_NS: u64 = 1_700_000_000_000_000_000;

/// The fate of a record that a device sends.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Fate {
    Arrives,
    IsLost,
    /// A bit of this torque's is another.
    Flipped {
        joint: usize,
        bit: u32,
    },
}

/// The hand, and its joints' way through the time.
pub(crate) struct Hand {
    pub(crate) file: HandFile,
    pub(crate) model: HandModel,
}

impl Hand {
    pub(crate) fn load(name: &str) -> Self {
        let mut file = HandFile::load(name).unwrap();
        // What swings as its counts say touches nothing: a grasp begins at once, and is no more than the law.
        let control = file.control.as_mut().expect("a built-in hand has gains");
        (control.closing_speed_m_s, control.gains.frame) = (0.0, [0.0; 2]);
        let model = HandModel::parse(&toml::to_string(&file).unwrap(), name).unwrap();
        Self { file, model }
    }

    /// Counts of a tick: each joint swings slowly, about the middle of its range.
    pub(crate) fn counts(&self, tick: u32) -> [i32; MAX_JOINTS] {
        std::array::from_fn(|k| {
            let Some(joint) = self.file.joints.get(k) else { return 0 };
            let [lower, upper] = joint.limits_rad;
            let frequency_hz = 0.11 + 0.013 * k as f64;
            let swing = 0.3 * (TAU * frequency_hz * f64::from(tick) * 1e-3 + k as f64).sine_cosine().0;
            let angle_rad = 0.5 * (lower + upper) + 0.5 * (upper - lower) * swing;
            (angle_rad / TAU * joint.encoder_counts_per_turn).floor() as i32
        })
    }
}

/// A device, its host, and the recording.
pub(crate) struct Session {
    pub(crate) hand: Hand,
    pub(crate) writer: Writer,
    recorded: Recorded,
    device: Device<MAX_JOINTS, MAX_FINGERS>,
    burst: Box<Burst<MAX_JOINTS>>,
    receiver: Receiver<1024>,
    buffer: Vec<u8>,
    session: u16,
    sequence: u16,
    /// Ticks of all the device's lives.
    pub(crate) time: u32,
    /// Ticks since its start.
    pub(crate) tick: u32,
    /// Records that the host could have taken down, and that it did.
    pub(crate) sent: u64,
    pub(crate) arrived: u64,
    pub(crate) dropped: u32,
    /// Returns the number of records that wait for the line in each tick.
    pub(crate) waiting: fn(u32) -> usize,
}

fn device(model: &HandModel) -> Device<MAX_JOINTS, MAX_FINGERS> {
    let image = Image {
        interface_version: INTERFACE_VERSION,
        kind: "hand",
        hand: "three-finger",
        hand_hash: model.hash(),
        firmware_version: "0.1.0",
        build_hash: 0x1234,
        joint_count: model.joint_names.len() as u8,
        fingertip_count: model.hand.fingertip_count() as u8,
        period_us: model.config.period_us,
    };
    let reset = ResetCause::PowerOn;
    let identity = Identity { reset, ..Identity::of(image, Clock::External) };
    Device::new(model.params(&model.config).unwrap(), identity)
}

/// Returns the description that the device of a hand gives of itself.
pub(crate) fn about(hand: &Hand) -> About {
    let model = &hand.model;
    About {
        interface_version: INTERFACE_VERSION,
        image: "hand".into(),
        firmware_version: "0.1.0".into(),
        build_hash: 0x1234,
        hand: model.name.clone(),
        hand_hash: model.hash(),
        joint_count: model.joint_names.len() as u8,
        fingertip_count: model.hand.fingertip_count() as u8,
        period_us: model.config.period_us,
        clock: "crystal".into(),
        reset: "power on".into(),
        crash: None,
        brown_out: "unknown".into(),
        clock_hz: 0,
        units: UNITS.into(),
        host_version: "0.1.0".into(),
        port: None,
        baud: None,
        joint_names: model.joint_names.clone(),
        hand_file: None,
        scene: None,
    }
    .with_hand(&hand.file)
}

impl Session {
    /// A recording that begins with nobody's session.
    pub(crate) fn new(path: &Path) -> Self {
        let hand = Hand::load("three-finger");
        let mut writer = Writer::create(path, false).unwrap();
        let recorded = writer.add_device("hand");
        Self {
            device: device(&hand.model),
            hand,
            writer,
            recorded,
            burst: Box::new(Burst::new()),
            receiver: Receiver::new(),
            buffer: vec![0; most_bytes(Reply::<MAX_JOINTS>::MOST_BYTES)],
            session: 0,
            sequence: 0,
            time: 0,
            tick: 0,
            sent: 0,
            arrived: 0,
            dropped: 0,
            waiting: |_| 0,
        }
    }

    /// Returns the time of the present tick.
    pub(crate) fn now(&self) -> Stamp {
        Stamp(START_NS + u64::from(self.time) * TICK_NS)
    }

    /// A tick in which nothing happens.
    pub(crate) fn pass(&mut self) -> AnyRecord {
        self.turn(None, Fate::Arrives)
    }

    /// Ticks with a heartbeat now and then.
    pub(crate) fn run(&mut self, ticks: u32) {
        for k in 0..ticks {
            match k % 100 {
                0 => self.turn(Some(Request::Heartbeat), Fate::Arrives),
                _ => self.pass(),
            };
        }
    }

    pub(crate) fn command(&mut self, command: Command) -> AnyRecord {
        self.turn(Some(Request::Command(command)), Fate::Arrives)
    }

    pub(crate) fn turn(&mut self, request: Option<Request<MAX_JOINTS>>, fate: Fate) -> AnyRecord {
        let reading = Reading::Counts(self.hand.counts(self.time));
        self.turn_with(request, fate, reading, false)
    }

    pub(crate) fn fail(&mut self, raised: Raised) -> AnyRecord {
        self.turn_with(None, Fate::Arrives, Reading::Failed(raised), false)
    }

    pub(crate) fn turn_with(
        &mut self,
        request: Option<Request<MAX_JOINTS>>,
        fate: Fate,
        reading: Reading<MAX_JOINTS>,
        late: bool,
    ) -> AnyRecord {
        let packet = request.map(|request| {
            self.sequence = self.sequence.wrapping_add(1);
            Packet { session: self.session, sequence: self.sequence, request }
        });
        if let Some(packet) = &packet {
            let payload = postcard::to_slice(packet, &mut self.buffer).unwrap().to_vec();
            self.writer.sent(self.recorded, self.now(), &payload).unwrap();
        }
        let inputs = Inputs {
            late,
            cycles: 10_003 + self.tick % 7,
            dropped: self.dropped,
            waiting: (self.waiting)(self.time),
            packet,
            ..Inputs::default()
        };
        let mut outputs = self.device.tick(&reading, &inputs, &mut self.burst);
        if let Some(reply) = outputs.reply.take() {
            if let Reply::Identity { session, .. } = reply {
                self.session = session;
            }
            let frame = encode(&reply, &mut self.buffer).unwrap().to_vec();
            self.arrive(&frame);
        }
        if let Some(form) = outputs.telemetry {
            self.sent += 1;
            let mut record = outputs.record.clone();
            if let Fate::Flipped { joint, bit } = fate {
                let mut torques = [0.0; MAX_JOINTS];
                let told = record.torques_nm.as_slice();
                torques[..told.len()].copy_from_slice(told);
                torques[joint] = f32::from_bits(torques[joint].to_bits() ^ 1 << bit);
                record.torques_nm = blindgrasp_shared::telemetry::List::first_of(torques, told.len());
            }
            let frame = encode(&form.of(&record), &mut self.buffer).unwrap().to_vec();
            if fate != Fate::IsLost {
                self.arrived += 1;
                self.arrive(&frame);
            }
        }
        if let Some(part) = outputs.part {
            let frame = encode(&Reply::<MAX_JOINTS>::Snapshot(part), &mut self.buffer).unwrap().to_vec();
            self.arrive(&frame);
        }
        self.time += 1;
        self.tick += 1;
        outputs.record
    }

    /// A frame comes to the host.
    fn arrive(&mut self, frame: &[u8]) {
        let at = self.now();
        let mut payload = None;
        for &byte in frame {
            if let Some(received) = self.receiver.push(byte) {
                payload = Some(received.unwrap().to_vec());
            }
        }
        self.writer.received(self.recorded, at, &payload.unwrap()).unwrap();
    }

    /// Says hello, and takes down who answers and its parameters.
    pub(crate) fn hello(&mut self) {
        self.turn(Some(Request::Hello { interface_version: INTERFACE_VERSION }), Fate::Arrives);
        let about = about(&self.hand);
        self.writer.about(self.recorded, self.now(), &about).unwrap();
        let settings = Setting::all(self.device.params());
        self.writer.parameters(self.recorded, self.now(), &settings).unwrap();
    }

    /// Asks for every record, with everything.
    pub(crate) fn telemetry(&mut self, decimation: u16, signals: Signals) {
        self.turn(Some(Request::Telemetry { decimation, signals }), Fate::Arrives);
    }

    /// Sets a parameter, and takes it down if that was done.
    pub(crate) fn set(&mut self, parameter: Parameter, index: u8, value: f32) {
        self.turn(Some(Request::SetParameter { parameter, index, value }), Fate::Arrives);
        let now = self.device.params().get(parameter, index).unwrap();
        let setting = Setting { parameter, index, value: Some(now.value) };
        self.writer.parameters(self.recorded, self.now(), &[setting]).unwrap();
    }

    /// The link is cut.
    pub(crate) fn cut(&mut self) {
        let (now, words) = (self.now(), "the port is gone");
        self.writer.gap(self.recorded, now, words).unwrap();
    }

    /// The device starts anew, and says nothing for a while.
    pub(crate) fn restart(&mut self, ticks: u32) {
        self.cut();
        self.device = device(&self.hand.model);
        (self.session, self.tick) = (0, 0);
        for _ in 0..ticks {
            self.pass();
        }
    }

    pub(crate) fn finish(self) -> Saved {
        self.writer.finish().unwrap()
    }
}

/// A recording of a controller alone, from its first tick on, as a simulation makes it. `each` gives the input of a tick
/// and may change what is told of it; the last tick has been when it gives none.
pub(crate) fn simulation(
    path: &Path,
    hand: &Hand,
    config: &AnyConfig,
    signals: Signals,
    mut input: impl FnMut(u32) -> Option<(Told, Option<Command>)>,
) -> Vec<AnyRecord> {
    let params = hand.model.params(config).unwrap();
    let mut state = State::new();
    let mut writer = Writer::create(path, false).unwrap();
    let device = writer.add_device("hand");
    let about = about(hand);
    let at = |tick: u32| Stamp(START_NS + u64::from(tick) * TICK_NS);
    writer.about(device, at(0), &about).unwrap();
    writer.parameters(device, at(0), &Setting::all(&params)).unwrap();
    let mut buffer = vec![0; most_bytes(Reply::<MAX_JOINTS>::MOST_BYTES)];
    let mut records = Vec::new();
    for k in 0.. {
        let Some((told, command)) = input(k) else { break };
        let (angles, speeds) = ([0.1; MAX_JOINTS], [0.0; MAX_JOINTS]);
        let input = match &told {
            Told::Counts(counts) => Input::counts(counts, command),
            Told::Ideal => Input::ideal(&angles, &speeds, command),
        };
        let record = tick(&params, &mut state, &input).record;
        let frame = encode(&Form::Full(signals).of(&record), &mut buffer).unwrap().to_vec();
        let mut receiver = Receiver::<1024>::new();
        for byte in frame {
            if let Some(payload) = receiver.push(byte) {
                writer.received(device, at(k), payload.unwrap()).unwrap();
            }
        }
        records.push(record);
    }
    writer.finish().unwrap();
    records
}

/// The readings that a controller gets of its joints.
pub(crate) enum Told {
    Counts([i32; MAX_JOINTS]),
    Ideal,
}
