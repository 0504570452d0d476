//! Fingertips that close until all of them touch, by joint angles alone.
//!
//! Each fingertip follows a reference that goes from where it was straight towards the centroid, at a speed `v`, by a spring `K`
//! that is cut at a force `F`, and a damper `D` on the difference of the velocities. So a free fingertip moves at the reference's speed,
//! and one that is held presses with `F`, or while it comes to rest with no more than `F + D v`.
//!
//! **Touch**: the spring is at nine tenths of `F`, *and* the fingertip made less than a quarter of its reference's way in the last
//! 40 ms. No estimated speed is looked at, which a little noise of the counts keeps off zero for ever. The grasp begins when that
//! holds for **all** fingertips at once, for some time: one that touches alone pushes the object, or is pushed away by it.

use super::Followed;
use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::hand::frame::dot;
use crate::hand::{Hand, Posture, Wrench};
use crate::math::{Real, norm};
use crate::parameter::ParameterError;
use crate::period::Period;
use nalgebra::Vector3;

/// Numbers of closing, as a user gives them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosingConfig {
    /// Speed `v` of a fingertip, m/s; 0 where a grasp begins at once, from touch.
    pub speed_m_s: f32,
    /// Stiffness `K` with which a fingertip follows its reference, N/m.
    pub stiffness_n_m: f32,
    /// Force `F` at which that is cut, N.
    pub force_n: f32,
    /// Damping `D` of a fingertip against its reference, N s/m.
    pub damping_n_s_m: f32,
}

impl ClosingConfig {
    /// A grasp that begins at once.
    pub const AT_ONCE: Self = Self { speed_m_s: 0.0, stiffness_n_m: 0.0, force_n: 0.0, damping_n_s_m: 0.0 };

    pub(super) fn check(&self) -> Result<(), ParameterError> {
        let Self { speed_m_s, stiffness_n_m, force_n, damping_n_s_m } = *self;
        let values = [
            ("closing.speed_m_s", speed_m_s),
            ("closing.stiffness_n_m", stiffness_n_m),
            ("closing.force_n", force_n),
            ("closing.damping_n_s_m", damping_n_s_m),
        ];
        let closes = speed_m_s > 0.0;
        for (parameter, value) in values {
            let is_good = value >= 0.0 && value.is_finite() && (value > 0.0 || !closes);
            if !is_good {
                let reason = "has to be positive; a speed of 0 lets a grasp begin at once";
                return Err(ParameterError { parameter: parameter.into(), joint: None, reason });
            }
        }
        Ok(())
    }
}

/// Places that are remembered of each fingertip's way.
const MARKS: usize = 5;
/// Time from the oldest of them to now, ms.
const LOOK_BACK_MS: u32 = 40;
/// Time for which all have to touch, ms.
const TOUCH_MS: u32 = 10;
/// Share of the force at which a fingertip may be held.
const HELD_SHARE: f32 = 0.9;
/// Share of the reference's way that one which is held does not make.
const STILL_SHARE: f32 = 0.25;
/// Room between two fingertips in which there is no object, m.
pub(super) const NO_OBJECT_M: f32 = 3e-3;
/// Time that is left to fingertips when all references are at the centroid, ms.
const LAST_MS: u32 = 300;
/// Time for which fingertips go outwards again after a grasp, ms.
pub(crate) const RETREAT_MS: u32 = 300;

/// The result of a tick of closing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Closed {
    /// It goes on.
    NotYet,
    /// All fingertips touch.
    Touched,
    /// There is nothing between them.
    Empty,
    /// A fingertip does not touch, but others do.
    Never {
        /// The fingertip.
        finger: u8,
    },
}

/// Fingertips on their way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closing<const F: usize> {
    origins_m: [Vector3<f32>; F],
    /// Unit vectors.
    directions: [Vector3<f32>; F],
    lengths_m: [f32; F],
    /// Way of each along its direction, some ticks apart; the oldest is overwritten next.
    marks_m: [[f32; MARKS]; F],
    /// Way of the references, m, and whether they still move.
    way_m: f32,
    is_stopped: bool,
    age: u32,
    /// Ticks for which all have touched.
    touched: u32,
    /// Ticks since all references are at their end.
    waited: u32,
}

impl<const F: usize> Closing<F> {
    pub(crate) const fn new() -> Self {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        Self {
            origins_m: [zero; F],
            directions: [zero; F],
            lengths_m: [0.0; F],
            marks_m: [[0.0; MARKS]; F],
            way_m: 0.0,
            is_stopped: false,
            age: 0,
            touched: 0,
            waited: 0,
        }
    }

    /// Begins to close towards the centroid of the fingertips.
    pub(crate) fn begin<const J: usize>(&mut self, hand: &Hand<f32, J, F>, posture: &Posture<f32, J, F>) {
        let centroid = centroid_m(hand, posture);
        *self = Self { origins_m: posture.centres_m, ..Self::new() };
        for i in 0..hand.fingertip_count().min(F) {
            let towards = centroid - posture.centres_m[i];
            let length = norm(&towards);
            self.lengths_m[i] = length;
            if length > 0.0 {
                self.directions[i] = towards * (1.0 / length);
            }
        }
    }

    /// Begins to go outwards, from the centroid away.
    pub(crate) fn begin_retreat<const J: usize>(
        &mut self,
        hand: &Hand<f32, J, F>,
        posture: &Posture<f32, J, F>,
    ) {
        self.begin(hand, posture);
        for (direction, length) in self.directions.iter_mut().zip(&mut self.lengths_m) {
            *direction = -*direction;
            *length = 1.0;
        }
    }

    /// Stops the references where they are.
    pub(crate) fn stop(&mut self) {
        self.is_stopped = true;
    }

    /// Goes on by a tick, and looks where the fingertips are.
    pub(crate) fn advance<const J: usize>(
        &mut self,
        config: &ClosingConfig,
        period: Period,
        hand: &Hand<f32, J, F>,
        posture: &Posture<f32, J, F>,
    ) -> Closed {
        let count = hand.fingertip_count().min(F);
        let ticks = |time_ms: u32| (time_ms * 1000 / period.microseconds()).max(1);
        let every = ticks(LOOK_BACK_MS / MARKS as u32);
        if !self.is_stopped {
            self.way_m += config.speed_m_s * period.seconds();
        }
        let slot = (self.age / every) as usize % MARKS;
        let looked_back = every * (MARKS as u32 - 1) + self.age % every;
        let most = STILL_SHARE * config.speed_m_s * period.seconds() * looked_back as f32;
        let is_old_enough = self.age >= every * MARKS as u32;
        let (mut held, mut first_free, mut is_over) = (0, None, true);
        for i in 0..count {
            let way = dot(&(posture.centres_m[i] - self.origins_m[i]), &self.directions[i]);
            let oldest = self.marks_m[i][(slot + 1) % MARKS];
            if self.age.is_multiple_of(every) {
                self.marks_m[i][slot] = way;
            }
            let reference = self.way_m.limited(0.0, self.lengths_m[i]);
            let pressed = config.stiffness_n_m * (reference - way) >= HELD_SHARE * config.force_n;
            if pressed && is_old_enough && way - oldest < most {
                held += 1;
            } else {
                first_free = first_free.or(Some(i as u8));
            }
            is_over &= self.way_m >= self.lengths_m[i];
        }
        self.age = self.age.saturating_add(1);
        self.touched = if held == count { self.touched.saturating_add(1) } else { 0 };
        self.waited = if is_over { self.waited.saturating_add(1) } else { 0 };
        if are_close(hand, posture) {
            Closed::Empty
        } else if self.touched >= ticks(TOUCH_MS) {
            Closed::Touched
        } else if self.waited >= ticks(LAST_MS) {
            match first_free {
                Some(finger) if held > 0 => Closed::Never { finger },
                _ => Closed::Empty,
            }
        } else {
            Closed::NotYet
        }
    }

    /// Adds the torques, N m, of a share of the forces. Returns the energy of what follows.
    pub(crate) fn torques<const J: usize>(
        &self,
        config: &ClosingConfig,
        (hand, posture): (&Hand<f32, J, F>, &Posture<f32, J, F>),
        speeds_rad_s: &[f32; J],
        share: f32,
        period: Period,
        torques_nm: &mut [f32; J],
    ) -> Followed {
        let mut followed = Followed::NOTHING;
        let velocities_m_s = hand.fingertip_velocities(posture, speeds_rad_s);
        let fingertips = hand.prepared_fingertips().iter().zip(&posture.centres_m).zip(&velocities_m_s);
        let ways = self.origins_m.iter().zip(&self.directions).zip(&self.lengths_m);
        for (((fingertip, centre), velocity), ((origin, direction), &length)) in fingertips.zip(ways) {
            let reference = self.way_m.limited(0.0, length);
            let moves = !self.is_stopped && self.way_m < length;
            let off = origin + direction * reference - centre;
            let mut pull = off * config.stiffness_n_m;
            let force = norm(&pull);
            let lag = config.force_n / config.stiffness_n_m;
            if force > config.force_n {
                pull *= config.force_n / force;
                followed.potential_j += force * lag - 0.5 * config.force_n * lag;
            } else {
                followed.potential_j += 0.5 * force * force / config.stiffness_n_m;
            }
            let speed = if moves { config.speed_m_s } else { 0.0 };
            let slow = direction * speed - velocity;
            let force_n = (pull + slow * config.damping_n_s_m) * share;
            followed.fed_j += dot(&force_n, direction) * (speed * period.seconds());
            let wrench = Wrench { force_n, moment_nm: Vector3::zeros() };
            hand.push(posture, fingertip.link, centre, &wrench, torques_nm);
        }
        followed.potential_j *= share;
        followed
    }

    pub(crate) fn save(&self, fingertips: usize, to: &mut Saver<'_>) -> Result<(), BufferTooSmall> {
        for i in 0..fingertips.min(F) {
            to.f32s(self.origins_m[i].as_slice(), 3)?;
            to.f32s(self.directions[i].as_slice(), 3)?;
            to.f32(self.lengths_m[i])?;
            to.f32s(&self.marks_m[i], MARKS)?;
        }
        to.f32(self.way_m)?;
        to.u8(u8::from(self.is_stopped))?;
        [self.age, self.touched, self.waited].into_iter().try_for_each(|ticks| to.u32(ticks))
    }

    pub(crate) fn load(fingertips: usize, from: &mut Loader<'_>) -> Result<Self, SnapshotError> {
        let mut closing = Self::new();
        for i in 0..fingertips.min(F) {
            from.f32s(closing.origins_m[i].as_mut_slice(), 3)?;
            from.f32s(closing.directions[i].as_mut_slice(), 3)?;
            closing.lengths_m[i] = from.f32()?;
            from.f32s(&mut closing.marks_m[i], MARKS)?;
        }
        closing.way_m = from.f32()?;
        closing.is_stopped = from.flag()?;
        (closing.age, closing.touched, closing.waited) = (from.u32()?, from.u32()?, from.u32()?);
        Ok(closing)
    }
}

/// Returns the mean of the fingertips' centres, m.
fn centroid_m<const J: usize, const F: usize>(
    hand: &Hand<f32, J, F>,
    posture: &Posture<f32, J, F>,
) -> Vector3<f32> {
    let count = hand.fingertip_count();
    let sum = posture.centres_m.iter().take(count).fold(Vector3::zeros(), |sum, centre| sum + centre);
    sum * (1.0 / count as f32)
}

/// Returns `true` if two fingertips have no room for an object between them. Neighbours on the same side of what is held may be as close.
pub(super) fn are_close<const J: usize, const F: usize>(
    hand: &Hand<f32, J, F>,
    posture: &Posture<f32, J, F>,
) -> bool {
    let fingertips = hand.prepared_fingertips();
    fingertips.iter().zip(&posture.centres_m).enumerate().any(|(i, (one, centre))| {
        fingertips.iter().zip(&posture.centres_m).take(i).any(|(other, neighbour)| {
            let between = centre - neighbour;
            let least = one.radius_m + other.radius_m + NO_OBJECT_M;
            dot(&between, &between) < least * least && {
                let middle = centroid_m(hand, posture);
                dot(&(centre - middle), &(neighbour - middle)) < 0.0
            }
        })
    })
}
