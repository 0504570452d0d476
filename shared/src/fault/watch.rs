//! The watch: where faults begin, and what it has seen so far.

use super::{Fault, Raised};
use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::estimate::{Estimator, Motion};
use crate::hand::Hand;
use crate::limit::{Limit, Limiting};
use crate::math::Real;
use crate::parameter::ParameterError;
use crate::period::Period;

/// Thresholds of the faults, as a user says; `None` leaves one out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultConfig<const J: usize> {
    /// Speed that each joint can't reach, rad/s: a count that changes faster is wrong. The motor's no-load speed over
    /// the gear, with room.
    pub possible_speed_rad_s: Option<[f32; J]>,
    /// Speed that each joint must not reach, rad/s. Not the difference of two counts but the filtered speed is meant.
    pub speed_limit_rad_s: Option<[f32; J]>,
    /// Largest angle of a joint beyond its range, rad.
    pub range_slack_rad: Option<f32>,
    /// Longest time for which a torque may stay at its limit, ms.
    pub saturated_ms: Option<u32>,
    /// Change of the torque since the last count that is too much for a joint that stands still, N m: well above its
    /// friction. A counter that stands still is not believed when this changes, and a neighbour turns, for the time below. A
    /// joint may stand still for hours; and in a grasp, a closed chain of rolling contacts, most of its torque limit may come
    /// and go without a count. What hardly ever happens is that its neighbours turn far, and its torque changes, and it does
    /// not move at all. Not never: the knee of a finger that is pushed to and fro stands still where its angle is at an
    /// extremum, and in a straight finger.
    pub frozen_torque_nm: Option<[f32; J]>,
    /// Turn of the joint before or after it since then, rad.
    pub frozen_neighbour_rad: Option<f32>,
    /// Shortest standstill that counts, ms.
    pub frozen_ms: Option<u32>,
    /// Longest time for which the host's heartbeat may be missing while the hand has torque, ms.
    pub heartbeat_ms: Option<u32>,
    /// Most ticks in a row that may be late; on average one in ten.
    pub late_ticks: Option<u32>,
    /// Work that the joints may do in a second beyond the drop of the law's potentials, J (the excess of the
    /// [`ledger`](crate::ledger), which fades: of what was done a second ago, 1/e counts).
    pub energy_j: Option<f32>,
}

impl<const J: usize> FaultConfig<J> {
    /// Only what can't be left out: missing samples and what is not finite.
    pub const LEAST: Self = Self {
        possible_speed_rad_s: None,
        speed_limit_rad_s: None,
        range_slack_rad: None,
        saturated_ms: None,
        frozen_torque_nm: None,
        frozen_neighbour_rad: None,
        frozen_ms: None,
        heartbeat_ms: None,
        late_ticks: None,
        energy_j: None,
    };

    /// Checks the parameters and prepares the watch for a hand.
    ///
    /// # Errors
    /// The first parameter that is out of its range.
    pub fn prepare<const F: usize>(
        &self,
        hand: &Hand<f32, J, F>,
        estimator: &Estimator<J>,
        period: Period,
    ) -> Result<Watch<J>, ParameterError> {
        let joint_count = hand.joint_count().min(J);
        let mut joints = [JointWatch::OFF; J];
        if self.frozen_neighbour_rad.is_some_and(|turn| !(turn > 0.0 && turn.is_finite())) {
            let reason = "has to be positive";
            return Err(ParameterError {
                parameter: "faults.frozen_neighbour_rad".into(),
                joint: None,
                reason,
            });
        }
        if self.range_slack_rad.is_some_and(|slack| !(slack >= 0.0 && slack.is_finite())) {
            let reason = "has to be zero or positive";
            return Err(ParameterError { parameter: "faults.range_slack_rad".into(), joint: None, reason });
        }
        for (k, joint) in joints.iter_mut().enumerate().take(joint_count) {
            let positive = |parameter: &'static str, v: f32| {
                let reason = "has to be positive";
                if v > 0.0 && v.is_finite() {
                    Ok(v)
                } else {
                    Err(ParameterError { parameter: parameter.into(), joint: Some(k), reason })
                }
            };
            if let Some(speeds) = self.possible_speed_rad_s {
                let speed = positive("faults.possible_speed_rad_s", speeds[k])?;
                // A count more, because both ends of the tick are rounded to whole counts.
                joint.change = speed / estimator.rad_s(k) + 1.0;
            }
            if let Some(speeds) = self.speed_limit_rad_s {
                joint.speed_rad_s = positive("faults.speed_limit_rad_s", speeds[k])?;
            }
            if let Some(torques) = &self.frozen_torque_nm {
                joint.frozen_nm = positive("faults.frozen_torque_nm", torques[k])?;
            }
            if let Some(slack) = self.range_slack_rad {
                let (lower, upper) = hand.range_rad(k);
                (joint.lower_rad, joint.upper_rad) = (lower - slack, upper + slack);
            }
        }
        if self.energy_j.is_some_and(|energy| !(energy > 0.0 && energy.is_finite())) {
            let reason = "has to be positive";
            return Err(ParameterError { parameter: "faults.energy_j".into(), joint: None, reason });
        }
        if self.late_ticks.is_some_and(|ticks| ticks > LATE_TICKS_MOST) {
            let reason = "has to be at most 1000";
            return Err(ParameterError { parameter: "faults.late_ticks".into(), joint: None, reason });
        }
        for k in 0..joint_count {
            let parent = hand.parent(k);
            if let (Some(joint), Some(parent)) = (joints.get_mut(k), parent) {
                joint.before = parent;
            }
            if let Some(joint) = parent.and_then(|parent| joints.get_mut(parent)) {
                joint.after = k;
            }
        }
        let ticks = |time: Option<u32>, parameter| match time {
            Some(time) => period.ticks(time, parameter).map(Some),
            None => Ok(None),
        };
        Ok(Watch {
            joint_count,
            joints,
            saturated_ticks: ticks(self.saturated_ms, "faults.saturated_ms")?,
            frozen_ticks: ticks(self.frozen_ms, "faults.frozen_ms")?,
            heartbeat_ticks: ticks(self.heartbeat_ms, "faults.heartbeat_ms")?,
            late_most: self.late_ticks.map(|ticks| ticks * LATE_WEIGHT),
            neighbour_rad: self.frozen_neighbour_rad.unwrap_or(f32::INFINITY),
            energy_j: self.energy_j,
        })
    }
}

/// Weight of a late tick; one in time takes one off.
const LATE_WEIGHT: u32 = 10;
/// Most late ticks in a row that can be allowed.
const LATE_TICKS_MOST: u32 = 1000;

/// The watch, prepared for the joints of one hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Watch<const J: usize> {
    joint_count: usize,
    joints: [JointWatch; J],
    saturated_ticks: Option<u32>,
    frozen_ticks: Option<u32>,
    heartbeat_ticks: Option<u32>,
    neighbour_rad: f32,
    late_most: Option<u32>,
    energy_j: Option<f32>,
}

/// The watch's memory from tick to tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Watched<const J: usize> {
    /// For how many ticks each joint has been at its torque limit.
    saturated: [u32; J],
    standstills: [Standstill; J],
    /// Ticks since the last heartbeat; at first there was none for ever.
    silent: u32,
    /// Late ticks, by weight.
    late: u32,
    /// Late ticks since the start.
    late_ticks: u32,
}

/// The origin of a tick's torques, as far as a counter that stands still is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Driven {
    /// Not the grasp law: what the joints do is not its doing.
    Otherwise,
    /// The law while its force grows or falls: torques change with it, whether joints move or not, and say nothing.
    Ramp,
    /// The law at its force: torques change where joints move.
    Steadily,
}

/// For how long a counter has stood still.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Standstill {
    ticks: u32,
    /// Torque when it last moved, or when the force last changed, N m.
    torque_nm: f32,
    /// The neighbours' angles at that time, rad.
    before_rad: f32,
    after_rad: f32,
}

/// Thresholds of the faults of one joint. What is left out begins beyond all finite numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
struct JointWatch {
    /// Change of the count in a tick.
    change: f32,
    speed_rad_s: f32,
    lower_rad: f32,
    upper_rad: f32,
    /// Change of torque that is too much for a joint that stands still, N m.
    frozen_nm: f32,
    /// The joint that carries it, or [`NO_JOINT`].
    before: usize,
    /// A joint that it carries; of several, the last; or [`NO_JOINT`].
    after: usize,
}

/// No hand has a joint of this number.
const NO_JOINT: usize = usize::MAX;

impl<const J: usize> Watched<J> {
    /// Nothing has happened yet.
    pub fn new() -> Self {
        Self {
            saturated: [0; J],
            standstills: [Standstill { ticks: 0, torque_nm: 0.0, before_rad: 0.0, after_rad: 0.0 }; J],
            silent: u32::MAX,
            late: 0,
            late_ticks: 0,
        }
    }

    /// Ticks that were late since the start.
    pub fn late_ticks(&self) -> u32 {
        self.late_ticks
    }
}

impl<const J: usize> Watched<J> {
    pub(crate) fn save(&self, joints: usize, to: &mut Saver<'_>) -> Result<(), BufferTooSmall> {
        for (&saturated, standstill) in self.saturated.iter().zip(&self.standstills).take(joints) {
            to.u32(saturated)?;
            to.u32(standstill.ticks)?;
            to.f32(standstill.torque_nm)?;
            to.f32(standstill.before_rad)?;
            to.f32(standstill.after_rad)?;
        }
        to.u32(self.silent)?;
        to.u32(self.late)?;
        to.u32(self.late_ticks)
    }

    pub(crate) fn load(joints: usize, from: &mut Loader<'_>) -> Result<Self, SnapshotError> {
        let mut watched = Self::new();
        for (saturated, standstill) in watched.saturated.iter_mut().zip(&mut watched.standstills).take(joints)
        {
            *saturated = from.u32()?;
            *standstill = Standstill {
                ticks: from.u32()?,
                torque_nm: from.f32()?,
                before_rad: from.f32()?,
                after_rad: from.f32()?,
            };
        }
        watched.silent = from.u32()?;
        watched.late = from.u32()?;
        watched.late_ticks = from.u32()?;
        Ok(watched)
    }
}

impl<const J: usize> Default for Watched<J> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const J: usize> Watch<J> {
    /// The first joint whose motion is at fault, with the first of its faults.
    pub fn motion(&self, motion: &Motion<J>) -> Option<Raised> {
        for k in 0..self.joint_count.min(J) {
            let fault =
                self.joints[k].motion(motion.angles_rad[k], motion.speeds_rad_s[k], motion.count_changes[k]);
            if let Some(fault) = fault {
                return Some(Raised::at(k, fault));
            }
        }
        None
    }

    /// The first joint whose torque is not a finite number.
    pub fn torques(&self, torques_nm: &[f32; J]) -> Option<Raised> {
        // Zero times what is not finite is not a number, and then the sum is none: one comparison for all.
        if torques_nm.iter().fold(0.0, |sum, torque| sum + 0.0 * torque) == 0.0 {
            return None;
        }
        let joint = torques_nm.iter().take(self.joint_count).position(|torque| !torque.is_finite())?;
        Some(Raised::at(joint, Fault::NotFinite))
    }

    /// Counts for how many ticks each joint has been at its torque limit; the first that was for too long.
    pub fn saturation(&self, watched: &mut Watched<J>, limiting: &[Limiting; J]) -> Option<Raised> {
        let longest = self.saturated_ticks.unwrap_or(u32::MAX);
        let mut saturated = None;
        let joints = watched.saturated.iter_mut().zip(limiting).take(self.joint_count);
        for (k, (ticks, limiting)) in joints.enumerate() {
            *ticks = if limiting.contains(Limit::Torque) { ticks.saturating_add(1) } else { 0 };
            if *ticks > longest {
                saturated = saturated.or(Some(Raised::at(k, Fault::SaturatedTooLong)));
            }
        }
        saturated
    }

    /// Counts the ticks since the last heartbeat; whether it fails.
    pub fn heartbeat(&self, watched: &mut Watched<J>, heard: bool) -> bool {
        watched.silent = if heard { 0 } else { watched.silent.saturating_add(1) };
        self.silent(watched)
    }

    /// Returns `true` if the heartbeat fails.
    pub fn silent(&self, watched: &Watched<J>) -> bool {
        self.heartbeat_ticks.is_some_and(|longest| watched.silent > longest)
    }

    /// Counts late ticks; whether there were too many.
    pub fn lateness(&self, watched: &mut Watched<J>, late: bool) -> Option<Raised> {
        watched.late_ticks = watched.late_ticks.saturating_add(u32::from(late));
        let most = self.late_most?;
        watched.late = if late {
            // Twice the limit is enough to be forgotten again in bounded time.
            watched.late.saturating_add(LATE_WEIGHT).min(2 * most + LATE_WEIGHT)
        } else {
            watched.late.saturating_sub(1)
        };
        (watched.late > most).then_some(Raised::of_hand(Fault::TickLate))
    }

    /// Returns the fault of a ledger whose excess is more than it may be.
    pub fn energy(&self, energy_j: f32) -> Option<Raised> {
        let most = self.energy_j?;
        (!(energy_j <= most)).then_some(Raised::of_hand(Fault::TooMuchEnergy))
    }

    /// Looks for counters that stand still although their torque and a neighbour changed since they last moved.
    pub fn standstill(
        &self,
        watched: &mut Watched<J>,
        motion: &Motion<J>,
        torques_nm: &[f32; J],
        driven: Driven,
    ) -> Option<Raised> {
        let longest = self.frozen_ticks?;
        let mut frozen = None;
        for k in 0..self.joint_count.min(J) {
            let (joint, standstill) = (&self.joints[k], &mut watched.standstills[k]);
            let angle_of = |neighbour: usize| motion.angles_rad.get(neighbour).copied().unwrap_or(0.0);
            let (torque_nm, before_rad, after_rad) =
                (torques_nm[k], angle_of(joint.before), angle_of(joint.after));
            if motion.count_changes[k] != 0 || driven == Driven::Otherwise {
                *standstill = Standstill { ticks: 0, torque_nm, before_rad, after_rad };
                continue;
            }
            standstill.ticks = standstill.ticks.saturating_add(1);
            if driven == Driven::Ramp {
                standstill.torque_nm = torque_nm;
            }
            let changed = (torque_nm - standstill.torque_nm).magnitude() > joint.frozen_nm;
            let dragged = (before_rad - standstill.before_rad).magnitude() > self.neighbour_rad
                || (after_rad - standstill.after_rad).magnitude() > self.neighbour_rad;
            if changed && dragged && standstill.ticks > longest {
                frozen = frozen.or(Some(Raised::at(k, Fault::CounterFrozen)));
            }
        }
        frozen
    }
}

impl JointWatch {
    /// Everything is left out.
    const OFF: Self = Self {
        change: f32::MAX,
        speed_rad_s: f32::MAX,
        lower_rad: f32::MIN,
        upper_rad: f32::MAX,
        frozen_nm: f32::INFINITY,
        before: NO_JOINT,
        after: NO_JOINT,
    };

    fn motion(&self, angle_rad: f32, speed_rad_s: f32, count_change: u32) -> Option<Fault> {
        let change = count_change as f32;
        let in_range = angle_rad >= self.lower_rad && angle_rad <= self.upper_rad;
        // What is not finite is not within limits that are.
        if change <= self.change && in_range && speed_rad_s.magnitude() <= self.speed_rad_s {
            return None;
        }
        Some(if !(angle_rad.is_finite() && speed_rad_s.is_finite()) {
            Fault::NotFinite
        } else if change > self.change {
            Fault::CountJump
        } else if !in_range {
            Fault::BeyondRange
        } else {
            Fault::Overspeed
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A watch over two joints in which everything is switched off.
    const BLIND: Watch<2> = Watch {
        joint_count: 2,
        joints: [JointWatch::OFF; 2],
        saturated_ticks: None,
        frozen_ticks: None,
        neighbour_rad: 0.0,
        heartbeat_ticks: None,
        late_most: None,
        energy_j: None,
    };

    #[test]
    fn each_fault_of_the_motion_begins_where_it_is_set() {
        let watch = JointWatch {
            change: 600.0,
            speed_rad_s: 20.0,
            lower_rad: -1.0,
            upper_rad: 2.0,
            ..JointWatch::OFF
        };
        assert_eq!(watch.motion(2.0, 20.0, 600), None);
        assert_eq!(watch.motion(-1.0, -20.0, 0), None);
        assert_eq!(watch.motion(0.0, 0.0, 601), Some(Fault::CountJump));
        assert_eq!(watch.motion(0.0, 0.0, u32::MAX), Some(Fault::CountJump));
        assert_eq!(watch.motion(2.001, 0.0, 0), Some(Fault::BeyondRange));
        assert_eq!(watch.motion(-1.001, 0.0, 0), Some(Fault::BeyondRange));
        assert_eq!(watch.motion(0.0, 20.001, 0), Some(Fault::Overspeed));
        assert_eq!(watch.motion(0.0, -20.001, 0), Some(Fault::Overspeed));
        for bad in [f32::NAN, f32::INFINITY] {
            assert_eq!(watch.motion(bad, 0.0, 0), Some(Fault::NotFinite));
            assert_eq!(watch.motion(0.0, bad, 0), Some(Fault::NotFinite));
        }
        assert_eq!(JointWatch::OFF.motion(1e9, 1e9, u32::MAX), None);
    }

    #[test]
    fn saturation_is_a_fault_after_its_time_without_a_break() {
        let watch = Watch { saturated_ticks: Some(10), ..BLIND };
        let mut at_limit = Limiting::NONE;
        at_limit.insert(Limit::Torque);
        let mut watched = Watched::new();
        for _ in 0..10 {
            assert_eq!(watch.saturation(&mut watched, &[Limiting::NONE, at_limit]), None);
        }
        let mut interrupted = watched.clone();
        assert_eq!(watch.saturation(&mut interrupted, &[Limiting::NONE; 2]), None);
        assert_eq!(watch.saturation(&mut interrupted, &[Limiting::NONE, at_limit]), None);
        let raised = watch.saturation(&mut watched, &[Limiting::NONE, at_limit]);
        assert_eq!(raised, Some(Raised::at(1, Fault::SaturatedTooLong)));
    }

    #[test]
    fn a_heartbeat_fails_after_its_time_and_before_the_first() {
        let watch = Watch { heartbeat_ticks: Some(5), ..BLIND };
        let mut watched = Watched::new();
        assert!(watch.heartbeat(&mut watched, false));
        assert!(!watch.heartbeat(&mut watched, true));
        for _ in 0..5 {
            assert!(!watch.heartbeat(&mut watched, false));
        }
        assert!(watch.heartbeat(&mut watched, false));
        assert!(!watch.heartbeat(&mut watched, true));
        assert!(!BLIND.heartbeat(&mut Watched::new(), false));
    }

    #[test]
    fn late_ticks_are_a_fault_in_a_row_or_too_often() {
        let watch = Watch { late_most: Some(3 * LATE_WEIGHT), ..BLIND };
        let found = |every: usize| {
            let mut watched = Watched::new();
            (0..10_000).find(|tick| watch.lateness(&mut watched, tick % every == 0).is_some())
        };
        assert_eq!(found(1), Some(3), "the fourth in a row");
        assert_eq!(found(9), Some(99), "2 more in every 9 ticks");
        assert_eq!(found(11), None);
        // However long it lasted, it is over in bounded time.
        let mut watched = Watched::new();
        for _ in 0..10_000 {
            watch.lateness(&mut watched, true);
        }
        let over = (0..10_000).find(|_| watch.lateness(&mut watched, false).is_none());
        assert!(over.is_some_and(|ticks| ticks <= 40), "{over:?}");
        assert_eq!(BLIND.lateness(&mut watched, true), None);
    }

    #[test]
    fn too_much_energy_is_above_its_limit_or_no_number() {
        let watch = Watch { energy_j: Some(0.5), ..BLIND };
        let found = Some(Raised::of_hand(Fault::TooMuchEnergy));
        assert_eq!([-9.0, 0.5].map(|energy_j| watch.energy(energy_j)), [None; 2]);
        assert_eq!([0.501, f32::NAN].map(|energy_j| watch.energy(energy_j)), [found; 2]);
        assert_eq!(BLIND.energy(1e9), None);
    }

    #[test]
    fn a_counter_is_frozen_when_torque_and_neighbour_change_and_it_does_not() {
        use Driven::{Otherwise, Ramp, Steadily};
        let joints = [
            JointWatch { frozen_nm: 0.1, after: 1, ..JointWatch::OFF },
            JointWatch { frozen_nm: 0.1, before: 0, ..JointWatch::OFF },
        ];
        let watch = Watch { joints, frozen_ticks: Some(20), neighbour_rad: 0.03, ..BLIND };
        let mut watched = Watched::new();
        // Joint 1 and its neighbour's angle.
        let mut look = |moves: bool, torque, neighbour_rad, driven| {
            let motion = Motion {
                angles_rad: [neighbour_rad, 0.0],
                count_changes: [1, u32::from(moves)],
                ..Motion::still()
            };
            watch.standstill(&mut watched, &motion, &[0.0, torque], driven)
        };
        let frozen = Some(Raised::at(1, Fault::CounterFrozen));
        assert_eq!(look(true, 0.5, 0.0, Steadily), None);
        // Either alone is no reason to move, for however long.
        for _ in 0..1000 {
            assert_eq!(look(false, 0.9, 0.029, Steadily), None);
        }
        for _ in 0..1000 {
            assert_eq!(look(false, 0.599, -0.5, Steadily), None);
        }
        assert_eq!(look(false, 0.601, 0.031, Steadily), frozen);
        assert_eq!(look(false, 0.399, -0.031, Steadily), frozen);
        // A single count clears it; then it takes the time again.
        assert_eq!(look(true, 0.5, 0.0, Steadily), None);
        for _ in 0..20 {
            assert_eq!(look(false, 0.7, 0.1, Steadily), None);
        }
        assert_eq!(look(false, 0.7, 0.1, Steadily), frozen);
        assert_eq!(look(false, 0.7, 0.1, Otherwise), None);
        assert_eq!(look(false, 0.7, 0.1, Steadily), None);
        // What a ramp puts on is no reason either; what comes on top of it is.
        assert_eq!(look(true, 0.0, 0.0, Ramp), None);
        for k in 0..1000 {
            assert_eq!(look(false, 1e-3 * k as f32, 0.1, Ramp), None);
        }
        assert_eq!(look(false, 1.098, 0.1, Steadily), None);
        assert_eq!(look(false, 1.1, 0.1, Steadily), frozen);
    }
}
