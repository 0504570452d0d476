//! The firmware's double on the host: the same device with the same parameters, which is told the same.

use super::pil::{Peer, PilError};
use blindgrasp_body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_model::HandModel;
use blindgrasp_shared::device::{Device, Inputs};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::{Clock, Identity, Image};
use blindgrasp_shared::joints::Reading;
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::parameter::ParameterError;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_shared::telemetry::burst::Burst;
use blindgrasp_shared::tick::State;
use blindgrasp_wire::{Answer, Firmware, Packet, Sample, Turned};

/// A device on the host.
#[derive(Clone, Debug)]
pub struct Twin {
    device: Device<MAX_JOINTS, MAX_FINGERS>,
    burst: Box<Burst<MAX_JOINTS>>,
}

impl Twin {
    /// A device that has just started with the configuration of a hand, and a clock.
    ///
    /// # Errors
    /// The first parameter that the controller refuses.
    pub fn new(hand: &HandModel, clock: Clock) -> Result<Self, ParameterError> {
        // Its names do not matter: the firmware tells its own.
        let image = Image {
            interface_version: INTERFACE_VERSION,
            kind: "pil",
            hand: "twin",
            hand_hash: hand.hash(),
            firmware_version: env!("CARGO_PKG_VERSION"),
            build_hash: 0,
            joint_count: hand.hand.joint_count() as u8,
            fingertip_count: hand.hand.fingertip_count() as u8,
            period_us: hand.config.period_us,
        };
        let identity = Identity::of(image, clock);
        Ok(Self { device: Device::new(hand.params(&hand.config)?, identity), burst: Box::new(Burst::new()) })
    }

    /// One tick.
    pub fn tick(&mut self, packet: Option<&Packet>, sample: &Sample) -> Turned {
        let joint_count = self.device.params().hand().joint_count();
        let counts = sample.counts.as_slice();
        let whole = counts.len() == joint_count;
        let padded = std::array::from_fn(|k| counts.get(k).copied().unwrap_or(0));
        let reading = match sample.failed {
            Some(raised) if whole => Reading::Tested { raised, counts: padded },
            Some(raised) => Reading::Failed(raised),
            None if whole => Reading::Counts(padded),
            None => Reading::Failed(Raised::at(counts.len(), Fault::SampleMissing)),
        };
        let inputs = Inputs { late: sample.late, packet: packet.cloned(), ..Inputs::default() };
        let outputs = self.device.tick(&reading, &inputs, &mut self.burst);
        let answer = match outputs.reply {
            None | Some(Reply::Record(_) | Reply::Snapshot(_) | Reply::Input(_)) => None,
            Some(Reply::Identity { session, identity, .. }) => {
                Some(Answer::Identity { session, firmware: Firmware::from(&identity) })
            }
            Some(Reply::Answer { refused, .. }) => Some(refused.map_or(Answer::Done, Answer::Refused)),
            Some(Reply::Value { setting, .. }) => Some(Answer::Value(setting)),
            Some(Reply::Burst { count, record, .. }) => {
                Some(Answer::Burst { count, record: Box::new(record) })
            }
        };
        Turned { answer, record: outputs.record }
    }

    /// Returns the state of its tick.
    pub fn state(&self) -> &State<MAX_JOINTS, MAX_FINGERS> {
        self.device.state()
    }
}

impl Peer for Twin {
    fn turn(&mut self, packet: Option<&Packet>, sample: &Sample) -> Result<Turned, PilError> {
        Ok(self.tick(packet, sample))
    }

    fn motion_rad(&self) -> ([f32; MAX_JOINTS], [f32; MAX_JOINTS]) {
        (*self.state().angles_rad(), *self.state().speeds_rad_s())
    }
}
