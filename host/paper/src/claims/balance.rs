//! The holder of the sum of Eq. 35 at an instant at which hardly anything accelerates.
//!
//! The paper concludes from rest that `sum(J^T R R_C dl_1 + J_Omega^T R R_C dl_2)` vanishes at every joint. Where it does not,
//! something else in Eq. 35 makes up for it: the torsional viscosity of the fingertips or the damping of the law, which let go in
//! time; or the friction of a real joint, which is not in the paper's equation and never lets go.

use super::{joint_torques, largest};
use crate::evidence::Done;
use blindgrasp_body::dynamics::JointVector;
use blindgrasp_shared::hand::Wrench;
use blindgrasp_sim::sample::Sample;
use nalgebra::Vector3;

/// By how much what is left may exceed the Coulomb friction of its joint: a joint that is about to slide is still moving.
const FRICTION_SLACK: f64 = 1.05;
/// Largest share of the sum that acceleration may have.
const INERTIA: f64 = 0.05;

/// The holder of the sum of Eq. 35.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Holder {
    /// Joints that stick: the largest share of a joint's Coulomb friction.
    Friction(f64),
    /// Torsional viscosity and damping: what of the sum they leave.
    Viscosity(f64),
    /// Neither: things accelerate.
    Nothing,
}

impl Holder {
    /// Returns the holder in a sample of a run.
    pub(super) fn of(done: &Done, sample: &Sample) -> Self {
        let (sum_nm, left_nm) = sums(done, sample);
        let joints = done.scene.joints.iter();
        let coulomb: Vec<f64> = joints.map(|joint| joint.friction.coulomb_nm).collect();
        if coulomb.iter().all(|torque| *torque > 0.0) {
            let share = largest(left_nm.iter().zip(&coulomb).map(|(left, most)| left.abs() / most));
            return if share <= FRICTION_SLACK { Self::Friction(share) } else { Self::Nothing };
        }
        let size = |torques: &JointVector| largest(torques.iter().map(|torque| torque.abs()));
        let share = size(&left_nm) / size(&sum_nm);
        if share <= INERTIA { Self::Viscosity(share) } else { Self::Nothing }
    }

    /// Returns `true` if something is known to hold it.
    pub(super) fn is_known(self) -> bool {
        self != Self::Nothing
    }
}

/// The sum over the fingertips at each joint, N m; and what viscosity and damping leave of it.
fn sums(done: &Done, sample: &Sample) -> (JointVector, JointVector) {
    let hand = &done.scene.hand;
    let posture = sample.posture(hand);
    let (mut sum_nm, mut left_nm): (JointVector, JointVector) = Default::default();
    for (finger, contact) in sample.contacts.iter().enumerate() {
        let wrench = |torsion_nm: f64| Wrench {
            force_n: contact.frame * contact.force_residual_n,
            moment_nm: contact.frame * (contact.moment_residual_nm + Vector3::y() * torsion_nm),
        };
        let add = |to: &mut JointVector, torsion_nm: f64| {
            for (sum, torque) in to.iter_mut().zip(joint_torques(hand, &posture, finger, &wrench(torsion_nm)))
            {
                *sum += torque;
            }
        };
        add(&mut sum_nm, 0.0);
        add(&mut left_nm, contact.torsion_nm);
    }
    let damping =
        done.scene.joints.iter().map(|joint| joint.damping_gain_nm_s_rad + joint.friction.viscous_nm_s);
    for ((left, damping), speed) in left_nm.iter_mut().zip(damping).zip(&sample.speeds_rad_s) {
        *left += damping * speed;
    }
    (sum_nm, left_nm)
}

/// Returns the time that the torsional viscosity takes to let go, `b / K_st`, s: the longest of the fingertips; none
/// without `u_st`.
pub(super) fn torsion_time_s(done: &Done, sample: &Sample) -> Option<f64> {
    let stiffness_nm = done.scene.control.attitude_stiffness_nm();
    let tips = done.scene.fingertips.iter().zip(&sample.contacts);
    let viscosity = tips.map(|(tip, contact)| {
        let pressed_m = contact.indentation_m;
        tip.torsion_n_s_m * std::f64::consts::PI * (2.0 * tip.radius_m - pressed_m) * pressed_m
    });
    (stiffness_nm > 0.0).then(|| largest(viscosity) / stiffness_nm)
}
