//! One turn of the control task: a packet in, joints read, the tick, joints written, replies out.
//!
//! Nothing is decided here: what the hand does is in [`Device`], the same code on the host.

use crate::boards::Board;
use crate::model::{FINGERS, JOINTS};
use crate::queue::{self, ControlEnd, Telemetry};
use crate::schedule::Turn;
use blindgrasp_shared::device::{Device, Inputs, Outputs};
use blindgrasp_shared::joints::Joints;
use blindgrasp_shared::telemetry::burst::Burst;

/// The records around a fault.
pub type HandBurst = Burst<JOINTS>;

/// Timing of the turn before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// It missed its deadline.
    pub late: bool,
    /// Processor cycles that it took; zero where they can't be counted.
    pub cycles: u32,
}

/// Does one start of the control task: a turn, and its answers to the queues.
pub fn task<B: Board>(
    control: &mut Control,
    joints: &mut B::Joints,
    queues: &mut ControlEnd<'_>,
    last: Timing,
) -> Timing {
    let turn = Turn::begin::<B>();
    joints.start();
    let inputs = Inputs {
        late: last.late,
        supply_low: B::take_supply_low(),
        cycles: last.cycles,
        dropped: queues.dropped(),
        waiting: queues.waiting(),
        packet: queues.take(),
        no_room: queues.room() == 0,
        stored: queues.stored(),
    };
    let outputs = control.turn(joints, &inputs);
    if let Some(reply) = outputs.reply.take() {
        queues.answer(queue::Answer { reply, baud: outputs.baud });
    }
    if let Some(form) = outputs.telemetry {
        queues.tell(Telemetry::Record(outputs.record.clone(), form));
    }
    if let Some(part) = outputs.part.take() {
        queues.tell(Telemetry::Part(part));
    }
    if let Some(order) = outputs.order {
        queues.order(order);
    }
    turn.end::<B>()
}

/// The hand, and what one turn leaves for the next.
pub struct Control {
    device: Device<JOINTS, FINGERS>,
    /// Too large for a stack.
    burst: &'static mut HandBurst,
    outputs: Outputs<JOINTS>,
}

impl Control {
    /// Before the first turn.
    pub fn new(device: Device<JOINTS, FINGERS>, burst: &'static mut HandBurst) -> Self {
        Self { device, burst, outputs: Outputs::none() }
    }

    /// The hand.
    pub fn device(&self) -> &Device<JOINTS, FINGERS> {
        &self.device
    }

    /// One turn, as [`Device::turn`] does it.
    pub fn turn(
        &mut self,
        joints: &mut impl Joints<JOINTS>,
        inputs: &Inputs<JOINTS>,
    ) -> &mut Outputs<JOINTS> {
        self.device.turn(joints, inputs, self.burst, &mut self.outputs);
        &mut self.outputs
    }
}
