//! Moving what is held by keys: a step a key, along or about an axis of the base frame.

use blindgrasp_shared::command::Move;
use blindgrasp_shared::hand::Turn;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_wire::{Record, held, rotation_vector_rad};

/// Way of a step, m, and its turn, rad.
const STEP_M: f32 = 1e-3;
const STEP_RAD: f32 = std::f32::consts::PI / 180.0;

/// A step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The axis: 0 to 2 along x, y and z, 3 to 5 about them.
    pub axis: usize,
    /// `true` if it is in the negative direction.
    pub is_back: bool,
}

impl Step {
    /// Returns the step that a key stands for: `x`, `y`, `z` along the axes, `u`, `v`, `w` about them; capitals go back.
    pub fn of(key: char) -> Option<Self> {
        let axis = "xyzuvw".chars().position(|known| known == key.to_ascii_lowercase())?;
        Some(Self { axis, is_back: key.is_ascii_uppercase() })
    }

    /// Returns a target, one step further.
    pub fn from(self, target: &Move) -> Move {
        let mut to = *target;
        let sign = if self.is_back { -1.0 } else { 1.0 };
        match self.axis {
            axis @ 0..3 => to.position_m[axis] += sign * STEP_M,
            axis => {
                let mut step_rad = [0.0; 3];
                step_rad[axis - 3] = sign * STEP_RAD;
                let turned = Turn::by(&to.turn_rad.into()).then(&Turn::by(&step_rad.into()));
                to.turn_rad = rotation_vector_rad(turned.v.into());
            }
        }
        to
    }
}

/// The target of what is held, as far as keys have moved it.
#[derive(Clone, Debug, Default)]
pub struct Jog {
    /// The target that was asked for last; none where the hand has gone another way since.
    asked: Option<Move>,
    /// The one that was taken last.
    taken: Option<Move>,
}

impl Jog {
    /// Sees the newest record: a grasp begins at its beginning, and what is put down has gone by itself.
    pub fn see(&mut self, record: &Record) {
        match record.mode {
            Mode::Carrying => {}
            Mode::PuttingDown => *self = Self::default(),
            _ => *self = Self { asked: Some(Move::default()), taken: Some(Move::default()) },
        }
    }

    /// Returns the next target; the first from where the newest record says that it is, if that is not known.
    pub fn step(&mut self, step: Step, record: &Record) -> Move {
        let to = step.from(&self.asked.unwrap_or_else(|| held(record)));
        self.asked = Some(to);
        to
    }

    /// A target was taken, or refused; then the next step is made from the last one that was taken.
    pub fn answered(&mut self, to: Move, is_taken: bool) {
        match is_taken {
            true => self.taken = Some(to),
            false => self.asked = self.taken,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::math::Real as _;

    fn record(mode: Mode, z_m: f32) -> Record {
        let mut record = Record { mode, ..Record::BLANK };
        record.law_signals.frame[2] = z_m;
        record
    }

    fn step(key: char) -> Step {
        Step::of(key).expect("a key")
    }

    #[test]
    fn steps_add_up_and_go_back() {
        let mut target = Move::default();
        for key in
            "xxXzu".chars().chain("w".repeat(20).chars()).chain("W".repeat(20).chars()).chain("U".chars())
        {
            target = step(key).from(&target);
        }
        assert!((target.position_m[0] - 1e-3).abs() < 1e-9 && (target.position_m[2] - 1e-3).abs() < 1e-9);
        assert!(target.turn_rad.iter().all(|rad| rad.abs() < 1e-5), "{target:?}");
        // A step about an axis of the base, whatever the turn so far.
        for _ in 0..90 {
            target = step('w').from(&target);
        }
        target = step('u').from(&target);
        let angle_deg = target.turn_rad.iter().map(|v| v * v).sum::<f32>().square_root().to_degrees();
        assert!((angle_deg - 90.0).abs() < 0.02, "{angle_deg}");
        assert!(target.turn_rad[0] > 0.0 && target.turn_rad[1] < 0.0, "{target:?}");
        assert_eq!((Step::of('q'), Step::of('1')), (None, None));
    }

    #[test]
    fn what_is_refused_is_taken_back_and_what_was_put_down_begins_where_it_is() {
        let mut jog = Jog::default();
        jog.see(&record(Mode::Grasping, 0.0));
        let here = record(Mode::Carrying, -1.4e-3);
        jog.see(&here);
        let first = jog.step(step('Z'), &here);
        assert_eq!(first.position_m[2], -1e-3, "from the target, not from where it hangs");
        jog.answered(first, true);
        let second = jog.step(step('Z'), &here);
        jog.answered(second, false);
        assert_eq!(jog.step(step('Z'), &here), second);
        jog.see(&record(Mode::PuttingDown, 0.0));
        assert!((jog.step(step('Z'), &here).position_m[2] + 2.4e-3).abs() < 1e-9);
    }
}
