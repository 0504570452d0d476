//! The strength of the motors at the nominal posture: the largest force of each fingertip, and what the weight of the
//! links and the law ask of each joint.

use super::reach::random_angles;
use super::specimen::Specimen;
use crate::posture;
use blindgrasp_body::{MAX_JOINTS, Posture};
use blindgrasp_shared::hand::Wrench;
use nalgebra::Vector3;

/// Along z of the base, m/s^2; the palm looks up.
pub(super) const GRAVITY_M_S2: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);
/// Postures that the greatest weight is looked for in.
const SAMPLES: usize = 512;

/// The largest force of a fingertip, held statically against the weight of the links.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Force {
    pub(super) force_n: f64,
    /// The joint whose torque limit ends it.
    pub(super) limited_by: usize,
}

/// The largest force of a fingertip towards the middle of all of them. The trunk is left out: the forces of a grasp
/// balance, and it feels none. `None` where nothing pushes that way.
pub(super) fn grasping_force(specimen: &Specimen, fingertip: usize) -> Option<Force> {
    let way = specimen.middle_m(&specimen.posture) - specimen.posture.centres_m[fingertip];
    let way = way.try_normalize(1e-6 * specimen.mean_radius_m())?;
    let weight = specimen.hand.gravity_torques(&specimen.posture, &GRAVITY_M_S2);
    let force = |k: usize| {
        let torque_per_n = column(specimen, fingertip, k).dot(&way);
        let limit = specimen.file.joints[k].torque_limit_nm;
        // What the weight leaves in this sense.
        let left = limit - weight[k] * torque_per_n.signum();
        (torque_per_n.abs() > 1e-9 * specimen.span_m()).then(|| left.max(0.0) / torque_per_n.abs())
    };
    least(&specimen.own[fingertip], force)
}

/// The largest force of a fingertip in whatever direction it is weakest.
pub(super) fn least_force(specimen: &Specimen, fingertip: usize) -> Option<Force> {
    let weight = specimen.hand.gravity_torques(&specimen.posture, &GRAVITY_M_S2);
    let force = |k: usize| {
        let lever = column(specimen, fingertip, k).norm();
        let left = specimen.file.joints[k].torque_limit_nm - weight[k].abs();
        (lever > 1e-9 * specimen.span_m()).then(|| left.max(0.0) / lever)
    };
    least(&specimen.own[fingertip], force)
}

fn least(joints: &[usize], force: impl Fn(usize) -> Option<f64>) -> Option<Force> {
    let forces = joints.iter().filter_map(|&k| Some(Force { force_n: force(k)?, limited_by: k }));
    forces.min_by(|a, b| a.force_n.total_cmp(&b.force_n))
}

/// A column of the fingertip's Jacobian at the nominal posture, m: its velocity when this joint turns at unit speed.
fn column(specimen: &Specimen, fingertip: usize, joint: usize) -> Vector3<f64> {
    column_at(&specimen.posture, fingertip, joint)
}

/// The same at a posture.
fn column_at(posture: &Posture, fingertip: usize, joint: usize) -> Vector3<f64> {
    let pose = posture.link(joint);
    pose.axis().cross(&(posture.centres_m[fingertip] - pose.origin_m))
}

/// Returns the force towards the middle of all from which a fingertip moves at all, N: `1 / max(|J_k . t| / tau_k)`, with the Coulomb
/// friction `tau_k` of its own joints. `None` where no joint moves it that way.
pub(super) fn moving_force_n(specimen: &Specimen, posture: &Posture, fingertip: usize) -> Option<f64> {
    let way = specimen.middle_m(posture) - posture.centres_m[fingertip];
    let way = way.try_normalize(1e-6 * specimen.mean_radius_m())?;
    let force_n = |&k: &usize| {
        let lever_m = column_at(posture, fingertip, k).dot(&way).abs();
        let friction_nm = specimen.file.joints[k].coulomb_friction_nm;
        (lever_m > 1e-9 * specimen.span_m()).then(|| friction_nm / lever_m)
    };
    specimen.own[fingertip].iter().filter_map(force_n).min_by(f64::total_cmp)
}

/// Returns the distance of a fingertip from the axis of a joint at the nominal posture, m.
pub(super) fn lever_m(specimen: &Specimen, fingertip: usize, joint: usize) -> f64 {
    column(specimen, fingertip, joint).norm()
}

/// The torques that hold the weight of the links at the nominal posture, N m.
pub(super) fn weight_nm(specimen: &Specimen) -> [f64; MAX_JOINTS] {
    specimen.hand.gravity_torques(&specimen.posture, &GRAVITY_M_S2)
}

/// The greatest torque that holds the weight at any of many postures, for each joint, N m.
pub(super) fn greatest_weight_nm(specimen: &Specimen) -> [f64; MAX_JOINTS] {
    let joints: Vec<usize> = (0..specimen.joints()).collect();
    let mut random = fastrand::Rng::with_seed(1);
    let mut greatest = weight_nm(specimen).map(f64::abs);
    for _ in 0..SAMPLES {
        let posture: Posture = posture(&specimen.hand, &random_angles(specimen, &joints, &mut random));
        let torques = specimen.hand.gravity_torques(&posture, &GRAVITY_M_S2);
        for (greatest, torque) in greatest.iter_mut().zip(torques) {
            *greatest = greatest.max(torque.abs());
        }
    }
    greatest
}

/// The torques of `u_s` at the nominal posture with all fingertips held still, N m: the approach of Eq. 30 at a force `f_d`,
/// without the weight.
pub(super) fn approach_nm(specimen: &Specimen, force_n: f64) -> [f64; MAX_JOINTS] {
    let posture = &specimen.posture;
    let middle = specimen.middle_m(posture);
    let radii: f64 = (0..specimen.fingers()).map(|i| specimen.hand.radius_m(i)).sum();
    let mut wrenches = [Wrench::zero(); blindgrasp_body::MAX_FINGERS];
    for (i, wrench) in wrenches.iter_mut().enumerate().take(specimen.fingers()) {
        wrench.force_n = (middle - posture.centres_m[i]) * (force_n / radii);
    }
    specimen.hand.fingertip_torques(posture, &wrenches)
}

/// The largest `K_st` of Eq. 49 at the nominal posture, where the attitudes are the latched ones, N m:
/// `f_d sum(|x_i - x_j|^2) / (12 N^2 sum(r))`.
pub(super) fn stiffness_bound_nm(specimen: &Specimen, force_n: f64) -> f64 {
    let tips = &specimen.posture.centres_m[..specimen.fingers()];
    let spread: f64 = tips.iter().flat_map(|a| tips.iter().map(move |b| (a - b).norm_squared())).sum();
    let radii: f64 = (0..specimen.fingers()).map(|i| specimen.hand.radius_m(i)).sum();
    let count = specimen.fingers() as f64;
    force_n * spread / (12.0 * count * count * radii)
}

#[cfg(test)]
mod tests {
    use super::super::tests::specimen;
    use super::*;

    /// The force found is exactly the one at which a joint is at its limit, and no joint beyond.
    #[test]
    fn the_largest_force_uses_up_one_joint() {
        let hand = specimen("three-finger");
        for i in 0..3 {
            let force = grasping_force(&hand, i).unwrap();
            let tips = &hand.posture.centres_m;
            let middle = (tips[0] + tips[1] + tips[2]) / 3.0;
            let (jacobian, _) = hand.hand.jacobians(&hand.posture, i);
            let push = (middle - tips[i]).normalize() * force.force_n;
            let torques = jacobian.transpose() * push;
            let weight = weight_nm(&hand);
            let share = |k: usize| (torques[k] + weight[k]).abs() / hand.file.joints[k].torque_limit_nm;
            assert!((share(force.limited_by) - 1.0).abs() < 1e-12);
            assert!(hand.own[i].iter().all(|&k| share(k) < 1.0 + 1e-12));
            // In no direction does it take less than the least force.
            let least = least_force(&hand, i).unwrap().force_n;
            let mut random = fastrand::Rng::with_seed(3);
            for _ in 0..1000 {
                let way = Vector3::from_fn(|_, _| random.f64() - 0.5).normalize() * least;
                let torques = jacobian.transpose() * way;
                let within = |&k: &usize| (torques[k] + weight[k]).abs() <= 1.3878 * (1.0 + 1e-12);
                assert!(hand.own[i].iter().all(within));
            }
        }
    }

    /// From the force found on, the joint that gives way first has its friction's torque, and no other has more than its own.
    #[test]
    fn a_finger_moves_from_the_force_found_on() {
        let mut hand = specimen("three-finger");
        for (k, joint) in hand.file.joints.iter_mut().enumerate() {
            joint.coulomb_friction_nm *= 1.0 + 0.1 * k as f64;
        }
        let preshape = hand.closing_posture().1;
        for i in 0..3 {
            let force_n = moving_force_n(&hand, &preshape, i).unwrap();
            let way = (hand.middle_m(&preshape) - preshape.centres_m[i]).normalize();
            let torques_nm = hand.hand.jacobians(&preshape, i).0.tr_mul(&(way * force_n));
            let used =
                hand.own[i].iter().map(|&k| torques_nm[k].abs() / hand.file.joints[k].coulomb_friction_nm);
            assert!((used.fold(0.0, f64::max) - 1.0).abs() < 1e-12, "fingertip {i}: {force_n} N");
        }
    }

    /// Eq. 49 with the law's own potential: where `V_s` is three times `K_st N`, the two parts of the energy balance.
    #[test]
    fn the_bound_of_eq_49() {
        let hand = specimen("two-finger");
        let tips = &hand.posture.centres_m;
        let apart = (tips[0] - tips[1]).norm_squared();
        // N = 2, alpha = 0: f_d 2 d^2 / (8 * 2 r * 6).
        let expected = 5.0 * 2.0 * apart / (8.0 * 0.03 * 6.0);
        assert!((stiffness_bound_nm(&hand, 5.0) / expected - 1.0).abs() < 1e-12);
    }
}
