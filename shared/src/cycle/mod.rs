//! The cycle of a hand that picks something up and puts it down again, by joint angles alone: a posture, closing until all
//! fingertips touch, the grasp, carrying, putting down, letting go.
//!
//! Which of them there is, and what leads from one to the next, is the table of the [supervisor](crate::supervisor). Here is
//! what they do, and what they notice: every end of something is **told**, by a [`Notice`] in the record of its tick.

mod carry;
mod closing;
mod moving;
mod notice;
mod path;
mod posture;

pub use carry::CarryingConfig;
pub use closing::ClosingConfig;
pub use moving::MovingConfig;
pub use notice::{Notice, Noticed};
pub use posture::{NAME_BYTES, NamedPosture, OPEN, POSTURES_MOST, Postures};

pub(crate) use carry::{Carried, Carry};
pub(crate) use closing::{Closed, Closing, RETREAT_MS};
pub(crate) use moving::Moving;
pub(crate) use path::{PEAK, largest};

use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::control::Held;
use crate::parameter::ParameterError;
use crate::supervisor::Mode;

/// Numbers of the cycle, as a user gives them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CycleConfig<const J: usize> {
    /// Of joints that follow a path.
    pub moving: MovingConfig<J>,
    /// Of fingertips that close.
    pub closing: ClosingConfig,
    /// Of what is carried.
    pub carrying: CarryingConfig,
}

impl<const J: usize> CycleConfig<J> {
    /// No postures, a grasp that begins at once, and nothing is carried anywhere.
    pub const LEAST: Self = Self {
        moving: MovingConfig::LEAST,
        closing: ClosingConfig::AT_ONCE,
        carrying: CarryingConfig::LEAST,
    };

    /// Checks the numbers.
    ///
    /// # Errors
    /// The first that can't be used.
    pub(crate) fn check(&self, joint_count: usize) -> Result<(), ParameterError> {
        self.moving.check(joint_count)?;
        self.closing.check()?;
        self.carrying.check()
    }

    /// Returns `true` if fingertips close before a grasp, and open after it.
    pub fn closes(&self) -> bool {
        self.closing.speed_m_s > 0.0
    }

    /// Returns `true` if joints can follow a path.
    pub fn moves(&self) -> bool {
        self.moving.speed_rad_s > 0.0 && self.moving.bandwidth_rad_s > 0.0
    }
}

/// The energy of springs by which something follows a way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Followed {
    /// Their potential, J.
    pub(crate) potential_j: f32,
    /// Energy that the way brought in, in this tick, J.
    pub(crate) fed_j: f32,
}

impl Followed {
    pub(crate) const NOTHING: Self = Self { potential_j: 0.0, fed_j: 0.0 };
}

/// The memory of the cycle.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cycle<const J: usize, const F: usize> {
    /// The mode that the rest was begun for.
    pub(crate) begun: Mode,
    /// The posture that is to be moved to, and the time for the way, ms, until that has begun.
    pub(crate) asked: Option<(Option<u8>, u16)>,
    /// `true` while the closing forces fade and the grasp's grow.
    pub(crate) fades: bool,
    /// Fingertips go outwards again.
    pub(crate) retreats: bool,
    /// The posture that is aimed at, joint by joint, rad.
    pub(crate) aim_rad: [f32; J],
    pub(crate) moving: Moving<J>,
    pub(crate) closing: Closing<F>,
    pub(crate) carry: Carry<F>,
    /// The frame and its target as the laws see them; made anew in each tick.
    pub(crate) held: Held<f32, F>,
}

impl<const J: usize, const F: usize> Cycle<J, F> {
    pub(crate) fn new() -> Self {
        Self {
            begun: Mode::Disarmed,
            asked: None,
            fades: false,
            retreats: false,
            aim_rad: [0.0; J],
            moving: Moving::resting([0.0; J]),
            closing: Closing::new(),
            carry: Carry::new(),
            held: Held::nothing(),
        }
    }

    pub(crate) fn save(
        &self,
        joints: usize,
        fingertips: usize,
        to: &mut Saver<'_>,
    ) -> Result<(), BufferTooSmall> {
        to.u8(self.begun as u8)?;
        to.u8(u8::from(self.asked.is_some()))?;
        let (posture, time_ms) = self.asked.unwrap_or((None, 0));
        to.u8(posture.unwrap_or(u8::MAX))?;
        to.u32(time_ms.into())?;
        to.u8(u8::from(self.fades))?;
        to.u8(u8::from(self.retreats))?;
        to.f32s(&self.aim_rad, joints)?;
        self.moving.save(joints, to)?;
        self.closing.save(fingertips, to)?;
        self.carry.save(fingertips, to)
    }

    pub(crate) fn load(
        joints: usize,
        fingertips: usize,
        from: &mut Loader<'_>,
    ) -> Result<Self, SnapshotError> {
        let mut cycle = Self::new();
        cycle.begun = Mode::load(from)?;
        let (is_asked, posture, time_ms) = (from.flag()?, from.u8()?, from.u32()? as u16);
        cycle.asked = is_asked.then_some(((posture != u8::MAX).then_some(posture), time_ms));
        cycle.fades = from.flag()?;
        cycle.retreats = from.flag()?;
        from.f32s(&mut cycle.aim_rad, joints)?;
        cycle.moving = Moving::load(joints, from)?;
        cycle.closing = Closing::load(fingertips, from)?;
        cycle.carry = Carry::load(fingertips, from)?;
        Ok(cycle)
    }
}
