//! One turn of the control task: a packet in, joints read, the tick, joints written, replies out.
//!
//! Nothing is decided here: what the hand does is in [`Device`], the same code on the host.

use crate::joints::Joints;
use crate::model::{FINGERS, JOINTS};
use crate::queue::HandPacket;
#[cfg(target_os = "none")]
use crate::{
    board::supply,
    queue::{self, ControlEnd, Telemetry},
    schedule::Turn,
};
use blindgrasp_shared::command::{Answer, Command};
use blindgrasp_shared::device::{Device, Inputs, Outputs, Reading};
use blindgrasp_shared::fault::Raised;
use blindgrasp_shared::telemetry::burst::Burst;

/// A fault that was cleared.
const CLEARED: Answer = Answer { command: Command::ClearFault, refused: None };

/// The records around a fault.
pub type HandBurst = Burst<JOINTS>;

/// What the turn before told about itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// It missed its deadline.
    pub late: bool,
    /// The supply was too low at some time since it began.
    pub supply_low: bool,
    /// Processor cycles that it took; zero where they can't be counted.
    pub cycles: u32,
}

/// What the control task does each time that it starts: a turn, and its answers to the queues.
#[cfg(target_os = "none")]
pub fn task(
    control: &mut Control,
    joints: &mut impl Joints<JOINTS>,
    queues: &mut ControlEnd<'_>,
    last: Timing,
) -> Timing {
    let turn = Turn::begin();
    let packet = queues.take();
    let last = Timing { supply_low: supply::take(), ..last };
    let outputs = control.turn(joints, packet, last, queues.dropped(), queues.waiting());
    if let Some(reply) = outputs.reply {
        queues.answer(queue::Answer { reply, baud: outputs.baud });
    }
    if let Some(form) = outputs.telemetry {
        queues.tell(Telemetry::Record(outputs.record, form));
    }
    if let Some(part) = outputs.part {
        queues.tell(Telemetry::Part(part));
    }
    turn.end()
}

/// The hand, and what one turn leaves for the next.
pub struct Control {
    device: Device<JOINTS, FINGERS>,
    /// Too large for a stack.
    burst: &'static mut HandBurst,
    /// What went wrong when the joints were last written.
    failed: Option<Raised>,
}

impl Control {
    /// Before the first turn.
    pub fn new(device: Device<JOINTS, FINGERS>, burst: &'static mut HandBurst) -> Self {
        Self { device, burst, failed: None }
    }

    /// The hand.
    pub fn device(&self) -> &Device<JOINTS, FINGERS> {
        &self.device
    }

    /// One turn. Torques that could not be written are a failed reading in the next. Joints that failed work again when
    /// the tick has taken the user's command to clear the fault, and not before.
    pub fn turn(
        &mut self,
        joints: &mut impl Joints<JOINTS>,
        packet: Option<HandPacket>,
        last: Timing,
        dropped: u32,
        waiting: usize,
    ) -> Outputs<JOINTS> {
        let read = joints.read();
        let reading = self.failed.take().map_or(read, Reading::Failed);
        let Timing { late, supply_low, cycles } = last;
        let inputs = Inputs { reading, late, supply_low, cycles, dropped, waiting, packet };
        let outputs = self.device.tick(&inputs, self.burst);
        if outputs.record.answer == Some(CLEARED) {
            joints.recover();
        }
        self.failed = joints.write(&outputs.torques_nm, outputs.powered);
        outputs
    }
}
