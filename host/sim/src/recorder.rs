//! A simulation recorded as a hand would be: the payloads that its device would send, a full record each tick, and
//! a snapshot of the controller's state in the first and every thousandth; and beside it the true state of the world.
//!
//! There is no link: nothing is sent, nothing is lost, every number is exact, and times count from the start of the run.

use super::Step;
use super::controller::Alone;
use super::sample::{ContactSample, Sample};
use blindgrasp_body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_model::{HandFile, Scene};
use blindgrasp_plant::OtherContact;
use blindgrasp_record::mcap::{About, Contact, Device, RecordingError, Saved, Setting, Stamp, World, Writer};
use blindgrasp_shared::identity::{Clock, Identity, Image};
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::telemetry::snapshot::{BYTES_PER_JOINT, PART_BYTES, Part};
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, List};
use nalgebra::Vector3;
use std::path::Path;

/// Ticks from one snapshot to the next.
const SNAPSHOT_TICKS: u64 = 1000;
/// Bytes that suffice for every snapshot.
const MOST_SNAPSHOT: usize =
    BYTES_PER_JOINT * if MAX_JOINTS > MAX_FINGERS { MAX_JOINTS } else { MAX_FINGERS };

/// Records a simulation, until something goes wrong.
pub struct Recorder {
    writer: Writer,
    device: Device,
    period_ns: u64,
    tick: u64,
    gravity_m_s2: Option<Vector3<f32>>,
    buffer: Vec<u8>,
    failure: Option<RecordingError>,
}

impl Recorder {
    /// Makes the file, and writes who the hand is.
    ///
    /// # Errors
    /// The file can't be made.
    pub fn create(
        path: &Path,
        force: bool,
        scene: &Scene,
        controller: &Alone,
    ) -> Result<Self, RecordingError> {
        // The gains are the scene's, as they were its controller's.
        let hand = HandFile { control: Some(scene.control.clone()), ..scene.file.hand.clone() };
        let mut about = About::of(&Identity::of(
            Image {
                interface_version: INTERFACE_VERSION,
                kind: "sim",
                hand: &hand.name,
                hand_hash: 0,
                firmware_version: env!("CARGO_PKG_VERSION"),
                build_hash: 0,
                joint_count: u8::try_from(hand.joints.len()).unwrap_or(u8::MAX),
                fingertip_count: u8::try_from(hand.fingertips.len()).unwrap_or(u8::MAX),
                period_us: controller.params().period().microseconds(),
            },
            Clock::Emulated,
        ))
        .with_hand(&hand);
        about.hand_hash = about.hand_model().map_or(0, |model| model.hash());
        about.scene = Some(scene.effective_toml());
        let mut writer = Writer::create_whole(path, force)?;
        writer.add_world(&hand.to_urdf(), &scene.object.to_obj())?;
        let device = writer.add_device("hand");
        writer.about(device, Stamp(0), &about)?;
        writer.parameters(device, Stamp(0), &Setting::all(controller.params()))?;
        let period_ns = u64::from(about.period_us) * 1000;
        let gravity_m_s2 = controller.params().laws().config().hold.gravity_m_s2;
        Ok(Self { writer, device, period_ns, tick: 0, gravity_m_s2, buffer: Vec::new(), failure: None })
    }

    /// Takes the next step of the run. What can't be written ends the recording, and is told at its end.
    pub fn see(&mut self, step: &Step<'_, Alone>) {
        if self.failure.is_none() {
            let at = Stamp(self.tick * self.period_ns);
            let written =
                self.say_parameters(at, step.controller).and_then(|()| self.say_tick(at, step.controller));
            self.failure =
                written.and_then(|()| step.sample.map_or(Ok(()), |sample| self.show(at, sample))).err();
            self.tick += 1;
        }
    }

    fn show(&mut self, at: Stamp, sample: &Sample) -> Result<(), RecordingError> {
        let contact = |of: &ContactSample| Contact {
            point_m: of.point_m.into(),
            force_n: of.force_on_object_n().into(),
            friction_used: of.friction.map(|friction| friction.used),
            slipped_m: of.friction.map(|friction| friction.slipped_m),
        };
        let other = |of: &OtherContact| Contact {
            point_m: of.point_m.into(),
            force_n: of.force_n.into(),
            friction_used: Some(of.used),
            slipped_m: None,
        };
        let contacts: Vec<_> = sample.contacts.iter().map(contact).collect();
        let others: Vec<_> = sample.others.iter().map(other).collect();
        let world = World {
            position_m: sample.position_m.into(),
            attitude: sample.attitude.coords.into(),
            angles_rad: &sample.angles_rad,
            speeds_rad_s: &sample.speeds_rad_s,
            torques_nm: &sample.torques_nm,
            contacts: &contacts,
            others: &others,
        };
        self.writer.world(self.device, at, &world)
    }

    /// Gravity is all that changes while the hand grasps.
    fn say_parameters(&mut self, at: Stamp, controller: &Alone) -> Result<(), RecordingError> {
        let gravity_m_s2 = controller.params().laws().config().hold.gravity_m_s2;
        if std::mem::replace(&mut self.gravity_m_s2, gravity_m_s2) == gravity_m_s2 {
            return Ok(());
        }
        self.writer.parameters(self.device, at, &Setting::all(controller.params()))
    }

    fn say_tick(&mut self, at: Stamp, controller: &Alone) -> Result<(), RecordingError> {
        let Some(record) = controller.record() else { return Ok(()) };
        self.say(at, &Reply::Record(record.clone()))?;
        if self.tick.is_multiple_of(SNAPSHOT_TICKS) {
            let mut snapshot = [0; MOST_SNAPSHOT];
            let whole = controller.state().save(controller.params(), &mut snapshot).unwrap_or_default();
            let length = u16::try_from(whole.len()).unwrap_or(u16::MAX);
            for (k, piece) in whole.chunks(PART_BYTES).enumerate() {
                let mut bytes = [0; PART_BYTES];
                bytes[..piece.len()].copy_from_slice(piece);
                self.say(
                    at,
                    &Reply::Snapshot(Part {
                        tick: record.tick,
                        offset: (k * PART_BYTES) as u16,
                        length,
                        bytes: List::first_of(bytes, piece.len()),
                    }),
                )?;
            }
        }
        Ok(())
    }

    fn say(&mut self, at: Stamp, reply: &Reply<'_, MAX_JOINTS>) -> Result<(), RecordingError> {
        self.buffer.resize(Reply::<MAX_JOINTS>::MOST_BYTES, 0);
        // The buffer is as large as the largest reply.
        let payload = postcard::to_slice(reply, &mut self.buffer).map_or(&[][..], |payload| payload);
        self.writer.received(self.device, at, payload).map(|_| ())
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// What went wrong since its beginning.
    pub fn finish(self) -> Result<Saved, RecordingError> {
        match self.failure {
            Some(failure) => Err(failure),
            None => self.writer.finish(),
        }
    }
}
