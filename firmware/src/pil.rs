//! Processor in the loop: the firmware with its joints at the other end of the link, in lockstep with a simulated
//! plant.
//!
//! One [`Request::Joints`] is one tick. Other requests wait; a tick takes the oldest of them. So a host that sends
//! its requests and then the joints knows in which tick each was taken, and the run is the same to the bit every
//! time. A tick is answered by the reply to the request that it took, if it took one, and then by its whole record,
//! which is the end of it.
//!
//! Nothing here knows of time: the simulation may be faster or slower than the world.

use crate::control::Control;
use crate::link::{Frames, MOST_SENT, Received, refused};
use crate::model::JOINTS;
use crate::queue::{HandPacket, HandReply};
use blindgrasp_shared::command::Refusal;
use blindgrasp_shared::device::Inputs;
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::joints::{Joints, Reading};
use blindgrasp_shared::link::encode;
use blindgrasp_shared::link::message::{Reply, Request, Sample};
use heapless::Deque;

/// Requests that wait for a tick.
const WAITING: usize = 8;

/// A way to the host that waits until it can do what it is asked to.
pub trait Way {
    /// The next byte; `None` when the host has hung up.
    fn receive(&mut self) -> Option<u8>;
    /// Sends bytes; `None` when the host has hung up.
    fn send(&mut self, bytes: &[u8]) -> Option<()>;
}

/// The joints of one sample.
struct Remote<'s>(&'s Sample<JOINTS>);

impl Joints<JOINTS> for Remote<'_> {
    fn collect(&mut self) -> Reading<JOINTS> {
        let Sample { counts, failed, .. } = self.0;
        match (failed, counts.as_slice().try_into()) {
            (Some(raised), Ok(counts)) => Reading::Tested { raised: *raised, counts },
            (Some(raised), Err(_)) => Reading::Failed(*raised),
            (None, Ok(counts)) => Reading::Counts(counts),
            (None, Err(_)) => Reading::Failed(Raised::at(counts.iter().count(), Fault::SampleMissing)),
        }
    }

    /// The torques are in the record.
    fn write(&mut self, _torques_nm: &[f32; JOINTS], _powered: bool) -> Option<Raised> {
        None
    }
}

/// A lockstep run.
pub struct Lockstep<'c, W> {
    way: W,
    control: &'c mut Control,
    frames: Frames,
    waiting: Deque<HandPacket, WAITING>,
    /// Measures a tick: what ran before it began is taken from what it returns.
    cycle_count: fn() -> u32,
    /// Cycles of the last tick.
    cycles: u32,
}

impl<'c, W: Way> Lockstep<'c, W> {
    /// Before the first byte. `cycle_count` reads a free-running counter of processor cycles.
    pub fn new(way: W, control: &'c mut Control, cycle_count: fn() -> u32) -> Self {
        Self { way, control, frames: Frames::new(), waiting: Deque::new(), cycle_count, cycles: 0 }
    }

    /// Runs until the host hangs up.
    pub fn run(&mut self) {
        while self.turn().is_some() {}
    }

    /// Takes a byte, and does what it completes. `None` when the host has hung up.
    fn turn(&mut self) -> Option<()> {
        let byte = self.way.receive()?;
        match self.frames.push(byte) {
            None => Some(()),
            Some(Received::Unknown(sequence)) => self.send(&[&refused(sequence, Refusal::NotUnderstood)]),
            Some(Received::Packet(HandPacket { request: Request::Joints(sample), .. })) => self.tick(&sample),
            Some(Received::Packet(packet)) => match self.waiting.push_back(packet) {
                Ok(()) => Some(()),
                Err(packet) => self.send(&[&refused(packet.sequence, Refusal::Busy)]),
            },
        }
    }

    fn tick(&mut self, sample: &Sample<JOINTS>) -> Option<()> {
        let packet = self.waiting.pop_front();
        let inputs = Inputs { late: sample.late, cycles: self.cycles, packet, ..Inputs::default() };
        let began = (self.cycle_count)();
        let outputs = self.control.turn(&mut Remote(sample), &inputs);
        self.cycles = (self.cycle_count)().wrapping_sub(began);
        let record = Reply::Record(outputs.record.clone());
        match outputs.reply.take() {
            Some(reply) => self.send(&[&reply, &record]),
            None => self.send(&[&record]),
        }
    }

    /// Sends one or two replies at once.
    fn send(&mut self, replies: &[&HandReply]) -> Option<()> {
        let mut bytes = [0; 2 * MOST_SENT];
        let mut length = 0;
        for reply in replies {
            // There is room for two of the longest, so this can't fail.
            length += encode(*reply, bytes.get_mut(length..)?).map_or(0, <[u8]>::len);
        }
        self.way.send(bytes.get(..length)?)
    }
}
