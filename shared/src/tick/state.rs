//! The state of the tick, and its bytes.

use super::Params;
use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::control::{Held, Latch, PerGain};
use crate::cycle::Cycle;
use crate::estimate::{Motion, Tracks};
use crate::fault::{Raised, Watched};
use crate::hand::Posture;
use crate::ledger::Ledger;
use crate::supervisor::{Mode, Supervisor};

/// Everything that the tick remembers.
#[derive(Clone, Debug, PartialEq)]
pub struct State<const J: usize, const F: usize> {
    pub(super) ticks: u32,
    pub(super) tracks: Tracks<J>,
    pub(super) motion: Motion<J>,
    pub(super) supervisor: Supervisor,
    pub(super) watched: Watched<J>,
    /// The gains of this grasp at its full force.
    pub(super) grasp: PerGain<f32>,
    /// The laws' memory of the beginning of the grasp, while there is one.
    pub(super) latch: Option<Latch<f32, J, F>>,
    /// The posture in the last tick with torque.
    pub(super) posture: Posture<f32, J, F>,
    /// Torques of the last tick, N m.
    pub(super) torques_nm: [f32; J],
    pub(super) ledger: Ledger<J>,
    /// The stages before the grasp and after it, and what is held.
    pub(super) cycle: Cycle<J, F>,
}

impl<const J: usize, const F: usize> State<J, F> {
    /// Disarmed, before the first tick.
    pub fn new() -> Self {
        Self {
            ticks: 0,
            tracks: Tracks::new(),
            motion: Motion::still(),
            supervisor: Supervisor::new(),
            watched: Watched::new(),
            grasp: PerGain::all(0.0),
            latch: None,
            posture: Posture::at_base(),
            torques_nm: [0.0; J],
            ledger: Ledger::new(),
            cycle: Cycle::new(),
        }
    }

    /// Joint angles as the last tick saw them, rad.
    pub fn angles_rad(&self) -> &[f32; J] {
        &self.motion.angles_rad
    }

    /// Joint speeds as the last tick saw them, rad/s.
    pub fn speeds_rad_s(&self) -> &[f32; J] {
        &self.motion.speeds_rad_s
    }

    /// Torques of the next tick, N m.
    pub fn torques_nm(&self) -> &[f32; J] {
        &self.torques_nm
    }

    /// The mode.
    pub fn mode(&self) -> Mode {
        self.supervisor.mode()
    }

    /// The fault that the hand is in, or that lets the object go.
    pub fn fault(&self) -> Option<Raised> {
        self.supervisor.fault()
    }

    /// Returns the frame of the fingertips and its target, as the laws saw them in the last tick of a grasp.
    pub fn held(&self) -> &Held<f32, F> {
        &self.cycle.held
    }

    /// Returns the laws' memory of the beginning of the grasp, while there is one.
    pub fn latch(&self) -> Option<&Latch<f32, J, F>> {
        self.latch.as_ref()
    }
}

impl<const J: usize, const F: usize> State<J, F> {
    /// Writes all that the ticks to come depend on, and returns the part of the buffer that it takes up.
    ///
    /// # Errors
    /// If the buffer is too small; [`BYTES_PER_JOINT`](crate::telemetry::snapshot::BYTES_PER_JOINT) for each joint
    /// always suffice.
    pub fn save<'b>(
        &self,
        params: &Params<J, F>,
        buffer: &'b mut [u8],
    ) -> Result<&'b mut [u8], BufferTooSmall> {
        let (joints, fingertips) = (params.hand.joint_count(), params.hand.fingertip_count());
        let mut to = Saver::new(buffer);
        to.u8(joints as u8)?;
        to.u8(fingertips as u8)?;
        to.u32(self.ticks)?;
        self.supervisor.save(&mut to)?;
        self.grasp.iter().try_for_each(|&gain| to.f32(gain))?;
        self.watched.save(joints, &mut to)?;
        self.tracks.save(joints, &mut to)?;
        self.motion.save(joints, &mut to)?;
        to.f32s(&self.torques_nm, joints)?;
        to.u8(u8::from(self.latch.is_some()))?;
        if let Some(latch) = &self.latch {
            latch.save(joints, fingertips, &mut to)?;
        }
        self.ledger.save(joints, &mut to)?;
        self.cycle.save(joints, fingertips, &mut to)?;
        to.finish()
    }

    /// Reads what [`Self::save`] wrote. The ticks that follow are those that followed there, to the bit.
    ///
    /// # Errors
    /// What is wrong with the bytes.
    pub fn load(params: &Params<J, F>, bytes: &[u8]) -> Result<Self, SnapshotError> {
        let mut from = Loader::new(bytes);
        let (joints, fingertips) = (from.u8()?, from.u8()?);
        let here = (params.hand.joint_count(), params.hand.fingertip_count());
        if (usize::from(joints), usize::from(fingertips)) != here {
            return Err(SnapshotError::OtherHand { joints, fingertips });
        }
        let (joints, fingertips) = here;
        let mut state = Self::new();
        state.ticks = from.u32()?;
        state.supervisor = Supervisor::load(&mut from)?;
        state.grasp.iter_mut().try_for_each(|gain| from.f32().map(|read| *gain = read))?;
        state.watched = Watched::load(joints, &mut from)?;
        state.tracks = Tracks::load(joints, &mut from)?;
        state.motion = Motion::load(joints, &mut from)?;
        from.f32s(&mut state.torques_nm, joints)?;
        if from.flag()? {
            state.latch = Some(Latch::load(joints, fingertips, &mut from)?);
        }
        state.ledger = Ledger::load(joints, &mut from)?;
        state.cycle = Cycle::load(joints, fingertips, &mut from)?;
        from.finish()?;
        Ok(state)
    }
}

impl<const J: usize, const F: usize> Default for State<J, F> {
    fn default() -> Self {
        Self::new()
    }
}
