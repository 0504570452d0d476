//! The joints: readings in, torques out, once a tick.
//!
//! A driver is a [`Joints`]; the controller around it is [`Device::turn`](crate::device::Device::turn). What belongs to the
//! joint and not to its driver is the controller's: sign and zero of its reading, and the sign of its motor.

use crate::estimate::{Encoder, EstimatorConfig};
use crate::fault::Raised;

/// A reading of all joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading<const J: usize> {
    /// Encoder counts.
    Counts([i32; J]),
    /// Angles and speeds, from drives that measure them themselves. Sign and zero are yet to be applied.
    Motion {
        /// Angles, rad.
        angles_rad: [f32; J],
        /// Speeds, rad/s.
        speeds_rad_s: [f32; J],
    },
    /// Joints that could not be read or driven.
    Failed(Raised),
    /// Joints that failed and have passed their self-test since. A fault that is cleared brings them back.
    Tested {
        /// The failure.
        raised: Raised,
        /// Encoder counts that they would begin with now.
        counts: [i32; J],
    },
}

/// A driver of all joints of a hand.
pub trait Joints<const J: usize> {
    /// Begins a reading, on a bus where the answers take their time: what is to be done meanwhile is done before
    /// [`collect`](Self::collect).
    fn start(&mut self) {}

    /// Returns the reading that was begun, or does it now.
    fn collect(&mut self) -> Reading<J>;

    /// Sets the torques of all motors, N m at the joint, and whether the amplifiers have power. A torque that is not a finite
    /// number sets 0 N m. Returns what went wrong.
    fn write(&mut self, torques_nm: &[f32; J], powered: bool) -> Option<Raised>;

    /// Lets joints that have passed their self-test try to work again, because the user has cleared the fault. The next
    /// [`collect`](Self::collect) tells if they do.
    fn recover(&mut self) {}
}

/// The motors of all joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorConfig<const J: usize> {
    /// Motors that push their joint in its negative direction at a positive torque.
    pub reversed: [bool; J],
}

impl<const J: usize> MotorConfig<J> {
    /// Every motor pushes its joint the way that it is told.
    pub const FORWARD: Self = Self { reversed: [false; J] };

    /// Turns torques of joints into those of their motors, N m, and back.
    pub fn turn(&self, torques_nm: &mut [f32; J]) {
        for (torque_nm, _) in torques_nm.iter_mut().zip(&self.reversed).filter(|(_, reversed)| **reversed) {
            *torque_nm = -*torque_nm;
        }
    }
}

impl<const J: usize> EstimatorConfig<J> {
    /// Returns the angles and speeds of the joints, by those that their drives measure, rad and rad/s.
    pub(crate) fn motion(&self, angles_rad: &[f32; J], speeds_rad_s: &[f32; J]) -> ([f32; J], [f32; J]) {
        let mut motion = (*angles_rad, *speeds_rad_s);
        apply(&self.encoders, &mut motion.0, &mut motion.1);
        motion
    }

    /// Returns the counts that joints stand at, with those of joints whose drives measure angles, rad; `None` if they could
    /// not be read.
    pub(crate) fn counts(&self, reading: &Reading<J>) -> Option<[i32; J]> {
        match reading {
            Reading::Counts(counts) => Some(*counts),
            Reading::Motion { angles_rad, .. } => {
                let mut counts = [0; J];
                count(&self.encoders, angles_rad, &mut counts);
                Some(counts)
            }
            Reading::Failed(_) | Reading::Tested { .. } => None,
        }
    }
}

// Slices, so that the compiler does not write these loops out for every hand.
#[cold]
#[inline(never)]
fn apply(encoders: &[Encoder], angles_rad: &mut [f32], speeds_rad_s: &mut [f32]) {
    for ((angle_rad, speed_rad_s), encoder) in angles_rad.iter_mut().zip(speeds_rad_s).zip(encoders) {
        let zero_rad = encoder.zero_count as f32 * encoder.rad_per_count;
        *angle_rad = encoder.sign() * (*angle_rad - zero_rad);
        *speed_rad_s *= encoder.sign();
    }
}

#[cold]
#[inline(never)]
fn count(encoders: &[Encoder], angles_rad: &[f32], counts: &mut [i32]) {
    for ((count, angle_rad), encoder) in counts.iter_mut().zip(angles_rad).zip(encoders) {
        let exact = angle_rad / encoder.rad_per_count;
        // The conversion rounds towards zero and saturates; it makes 0 of what is not a number.
        *count = (if exact < 0.0 { exact - 0.5 } else { exact + 0.5 }) as i32;
    }
}
