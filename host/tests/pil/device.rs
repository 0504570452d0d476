//! A firmware without a processor: the device of `blindgrasp-shared` behind a transport, in lockstep as in the image
//! `pil`; and what can be wrong with it and with the line.

use blindgrasp::body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp::device::client::Patience;
use blindgrasp::device::transport::{Transport, TransportError};
use blindgrasp::model::{HandModel, Scene};
use blindgrasp::wire::{Packet, Record, Request, Sample};
use blindgrasp_shared::command::Refusal;
use blindgrasp_shared::device::{Device, Inputs};
use blindgrasp_shared::identity::{Clock, Identity, Image};
use blindgrasp_shared::joints::Reading;
use blindgrasp_shared::link::message::{Reply, not_understood};
use blindgrasp_shared::link::{Receiver, encode, most_bytes};
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_shared::telemetry::burst::Burst;
use serde::Serialize;
use std::collections::VecDeque;
use std::thread;
use std::time::{Duration, Instant};

/// Short, because everything is in one process.
pub(crate) const PATIENCE: Patience =
    Patience { start: Duration::from_millis(600), answer: Duration::from_millis(200) };

const MOST_BYTES: usize = most_bytes(Reply::<MAX_JOINTS>::MOST_BYTES);

/// A fault of a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wrong {
    Nothing,
    /// It does not hear what comes before it has started.
    StartsLate(Duration),
    /// Nobody is there.
    Dead,
    /// It says nothing from this tick on.
    SilentFrom(u32),
    /// It hangs up in this tick.
    HangsUpAt(u32),
    /// A byte of this tick's answer is another.
    DamagedAt(u32),
    /// The request of this tick gets lost.
    RequestLostAt(u32),
    /// Bytes that nobody has sent are before every answer.
    Noise,
    /// Every byte is noise.
    Babble,
    /// It refuses this parameter.
    Refuses(Parameter),
    /// The last bit of this joint's torque is another in this tick.
    BitAt(u32, usize),
    /// Says that it is something else.
    Is(&'static str),
    /// It is for this hand.
    For(&'static str, u32),
    /// It speaks another interface, in which all but the beginning of its introduction is unknown.
    Speaks(u16),
    /// It has done ticks before.
    Used,
}

pub(crate) struct Firmware {
    device: Device<MAX_JOINTS, MAX_FINGERS>,
    burst: Box<Burst<MAX_JOINTS>>,
    joint_count: usize,
    wrong: Wrong,
    started: Instant,
    receiver: Receiver<512>,
    waiting: VecDeque<Packet>,
    outgoing: VecDeque<u8>,
    ticks: u32,
    has_hung_up: bool,
}

impl Firmware {
    /// The right one for a scene, but for what is wrong with it.
    pub(crate) fn new(scene: &Scene, wrong: Wrong) -> Self {
        let hand = HandModel::of(scene).expect("a hand");
        let mut image = Image {
            interface_version: INTERFACE_VERSION,
            kind: "pil",
            hand: Box::leak(hand.name.clone().into_boxed_str()),
            hand_hash: hand.hash(),
            firmware_version: "0.0.1",
            build_hash: 1,
            joint_count: hand.hand.joint_count() as u8,
            fingertip_count: hand.hand.fingertip_count() as u8,
            period_us: hand.config.period_us,
        };
        match wrong {
            Wrong::Is(kind) => image.kind = kind,
            Wrong::For(hand, hash) => (image.hand, image.hand_hash) = (hand, hash),
            _ => {}
        }
        let clock = Clock::Emulated;
        let identity = Identity::of(image, clock);
        let params = hand.params(&hand.config).expect("parameters");
        Self {
            device: Device::new(params, identity),
            burst: Box::new(Burst::new()),
            joint_count: hand.hand.joint_count(),
            wrong,
            started: Instant::now(),
            receiver: Receiver::new(),
            waiting: VecDeque::new(),
            outgoing: VecDeque::new(),
            ticks: if wrong == Wrong::Used { 7 } else { 0 },
            has_hung_up: false,
        }
    }

    fn take(&mut self, payload: &[u8]) {
        match Packet::decode(payload) {
            Err(_) => self.say(&not_understood::<MAX_JOINTS>(payload)),
            Ok(Packet { request: Request::Joints(sample), .. }) => self.tick(&sample),
            Ok(packet) => self.waiting.push_back(packet),
        }
    }

    fn tick(&mut self, sample: &Sample) {
        let mut packet = self.waiting.pop_front();
        match self.wrong {
            Wrong::RequestLostAt(tick) if tick == self.ticks => packet = None,
            Wrong::HangsUpAt(tick) if tick == self.ticks => self.has_hung_up = true,
            Wrong::SilentFrom(tick) if tick <= self.ticks => return,
            _ => {}
        }
        let counts = sample.counts.as_slice();
        assert!(sample.failed.is_some() || counts.len() == self.joint_count, "{} counts", counts.len());
        let reading = sample.failed.map_or_else(
            || Reading::Counts(std::array::from_fn(|k| counts.get(k).copied().unwrap_or(0))),
            Reading::Failed,
        );
        let asked = packet.clone();
        let inputs = Inputs { late: sample.late, cycles: 1234, packet, ..Inputs::default() };
        let outputs = self.device.tick(&reading, &inputs, &mut self.burst);
        let mut record = outputs.record;
        if self.wrong == Wrong::Used {
            record.tick += self.ticks;
        }
        if let Wrong::BitAt(tick, joint) = self.wrong
            && tick == self.ticks
        {
            flip(&mut record, joint);
        }
        let before = self.outgoing.len();
        match (self.wrong, asked, outputs.reply) {
            (
                Wrong::Refuses(refused),
                Some(Packet { sequence, request: Request::SetParameter { parameter, .. }, .. }),
                _,
            ) if parameter == refused => {
                let refused = Some(Refusal::OutOfRange);
                let answer: Reply<'_, MAX_JOINTS> = Reply::Answer { sequence, refused };
                self.say(&answer);
            }
            (Wrong::Speaks(version), Some(Packet { sequence, request: Request::Hello { .. }, .. }), _) => {
                self.say(&(0_u8, sequence, 1_u16, version, "and what comes then, nobody knows"));
            }
            (_, _, Some(reply)) => self.say(&reply),
            (_, _, None) => {}
        }
        self.say(&Reply::Record(record));
        if self.wrong == Wrong::DamagedAt(self.ticks) {
            let at = before + 10;
            self.outgoing[at] = if self.outgoing[at] == 1 { 2 } else { 1 };
        }
        self.ticks += 1;
    }

    fn say(&mut self, message: &impl Serialize) {
        if self.wrong == Wrong::Noise {
            self.outgoing.extend([0x17, 0x00, 0x02, 0x03, 0x00]);
        }
        let mut buffer = [0; MOST_BYTES];
        self.outgoing.extend(encode(message, &mut buffer).expect("room").iter());
    }
}

/// Changes the last bit of a torque.
fn flip(record: &mut Record, joint: usize) {
    let mut torques = [0.0; MAX_JOINTS];
    let told = record.torques_nm.as_slice();
    torques[..told.len()].copy_from_slice(told);
    torques[joint] = f32::from_bits(torques[joint].to_bits() ^ 1);
    record.torques_nm = blindgrasp_shared::telemetry::List::first_of(torques, told.len());
}

impl Transport for Firmware {
    fn send(&mut self, bytes: &[u8], _deadline: Instant) -> Result<(), TransportError> {
        if self.has_hung_up {
            return Err(TransportError::Closed);
        }
        match self.wrong {
            Wrong::Dead | Wrong::Babble => return Ok(()),
            Wrong::StartsLate(time) if self.started.elapsed() < time => return Ok(()),
            _ => {}
        }
        for &byte in bytes {
            let payload = match self.receiver.push(byte) {
                None => continue,
                Some(payload) => payload.expect("the host sends whole frames").to_vec(),
            };
            self.take(&payload);
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> Result<usize, TransportError> {
        if self.has_hung_up {
            return Err(TransportError::Closed);
        }
        if self.wrong == Wrong::Babble {
            buffer.iter_mut().enumerate().for_each(|(i, byte)| *byte = (i * i * 31 % 251) as u8);
            return Ok(buffer.len());
        }
        if self.outgoing.is_empty() {
            thread::sleep(deadline.saturating_duration_since(Instant::now()));
            return Err(TransportError::TimedOut);
        }
        // Not more than a few at once, so that frames are cut anywhere.
        let count = self.outgoing.len().min(buffer.len()).min(50);
        for (place, byte) in buffer.iter_mut().zip(self.outgoing.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }
}
