//! The posture at the start: fingertip centres where the contacts want them, by inverse kinematics.
//!
//! Every finger is solved for itself, over the joints that move it alone; joints that move several fingertips (a
//! trunk) stay where they are. A step is the damped least-squares step (Levenberg) towards the target, plus a pull
//! towards the nominal posture in the null space of the Jacobian, so that of all postures that reach the target the one
//! near the nominal comes out. Joints that would leave their limits are held there for the step.

use crate::{Hand, MAX_JOINTS, Posture};
use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, SMatrix, Vector3};

/// A fingertip counts as placed when its centre is this close to its target, m.
pub const REACHED_M: f64 = 1e-12;
/// Steps for one start. Quadratic convergence takes about ten once the limits are settled.
const STEPS: usize = 300;

/// A fingertip that can't get where it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unreachable {
    /// Index of the fingertip.
    pub fingertip: usize,
    /// Distance of the centre from its target in the nearest posture found, m.
    pub distance_m: f64,
    /// The joint that is at its limit there, if one is.
    pub limited_by: Option<usize>,
}

/// Joint angles that put the centre of each fingertip at its target (base frame, m).
///
/// `nominal_rad` is what the search starts from and stays near; joints that move several fingertips keep those angles.
///
/// # Errors
/// The first fingertip that can't be placed.
pub fn place(hand: &Hand, targets_m: &[Vector3<f64>], nominal_rad: &[f64]) -> Result<Vec<f64>, Unreachable> {
    let mut angles = [0.0; MAX_JOINTS];
    for (angle, nominal) in angles.iter_mut().zip(nominal_rad) {
        *angle = *nominal;
    }
    for (fingertip, target) in targets_m.iter().enumerate() {
        let own = own_joints(hand, fingertip);
        let mut nearest: Option<(f64, [f64; MAX_JOINTS])> = None;
        for start in starts(hand, &own, &angles) {
            let (distance, solution) = solve(hand, fingertip, target, &own, &angles, start);
            if nearest.as_ref().is_none_or(|(least, _)| distance < *least) {
                nearest = Some((distance, solution));
            }
            if distance <= REACHED_M {
                break;
            }
        }
        match nearest {
            Some((distance, solution)) if distance <= REACHED_M => angles = solution,
            Some((distance_m, solution)) => {
                let limited_by = own.iter().copied().find(|&k| {
                    let (lower, upper) = hand.range_rad(k);
                    solution[k] <= lower || solution[k] >= upper
                });
                return Err(Unreachable { fingertip, distance_m, limited_by });
            }
            None => {}
        }
    }
    Ok(angles[..hand.joint_count()].to_vec())
}

/// Returns `true` if a joint moves more than one fingertip.
pub fn is_trunk(hand: &Hand, joint: usize) -> bool {
    (0..hand.fingertip_count()).filter(|&fingertip| hand.moves(joint, fingertip)).count() > 1
}

/// The joints that move this fingertip and no other.
pub fn own_joints(hand: &Hand, fingertip: usize) -> Vec<usize> {
    let mut own: Vec<usize> = hand.joints_to(fingertip).filter(|&joint| !is_trunk(hand, joint)).collect();
    own.sort_unstable();
    own
}

/// The nominal posture; then postures spread over the joints' ranges.
fn starts(
    hand: &Hand,
    own: &[usize],
    nominal: &[f64; MAX_JOINTS],
) -> impl Iterator<Item = [f64; MAX_JOINTS]> {
    // Where in its range a joint starts: fractions of the golden ratio's powers cover the box evenly for few joints.
    const SPREAD: [f64; 4] = [0.618_034, 0.381_966, 0.763_932, 0.145_898];
    (0..=12).map(move |turn| {
        let mut start = *nominal;
        for (place, &joint) in own.iter().enumerate() {
            let (lower, upper) = hand.range_rad(joint);
            if turn > 0 {
                let fraction = (0.5 + turn as f64 * SPREAD[place % SPREAD.len()]) % 1.0;
                start[joint] = lower + (upper - lower) * fraction;
            }
            start[joint] = start[joint].limited(lower, upper);
        }
        start
    })
}

/// The error of a posture: what is left to the target, with the Jacobian.
fn error(
    hand: &Hand,
    fingertip: usize,
    target: &Vector3<f64>,
    angles: &[f64; MAX_JOINTS],
) -> (Vector3<f64>, SMatrix<f64, 3, MAX_JOINTS>) {
    let mut posture = Posture::at_base();
    hand.forward_kinematics(angles, &mut posture);
    let (linear, _) = hand.jacobians(&posture, fingertip);
    (target - posture.centres_m[fingertip], linear)
}

/// From one start: how close it comes, m, and where.
fn solve(
    hand: &Hand,
    fingertip: usize,
    target: &Vector3<f64>,
    own: &[usize],
    nominal: &[f64; MAX_JOINTS],
    start: [f64; MAX_JOINTS],
) -> (f64, [f64; MAX_JOINTS]) {
    let mut angles = start;
    let (mut left, mut jacobian) = error(hand, fingertip, target, &angles);
    // Levenberg's damping, in units of the squared size of the Jacobian.
    let mut damping = 1e-3;
    // How much of the way to the nominal posture a step goes in the null space.
    let mut pull = 0.5;
    for _ in 0..STEPS {
        let distance = left.norm();
        let step = step(hand, own, &angles, (nominal, pull), &left, &jacobian, damping);
        // The pull in the null space costs accuracy at second order, which has no business in the last digits.
        let settled = own.iter().all(|&k| step[k].abs() < 1e-12);
        if distance <= REACHED_M && settled {
            break;
        }
        let mut next = angles;
        for &k in own {
            let (lower, upper) = hand.range_rad(k);
            next[k] = (angles[k] + step[k].limited(-0.3, 0.3)).limited(lower, upper);
        }
        let (next_left, next_jacobian) = error(hand, fingertip, target, &next);
        // Near the target the pull may cost a little; the next step brings it back.
        if next_left.norm() <= distance.max(1e-4) {
            (angles, left, jacobian) = (next, next_left, next_jacobian);
            (damping, pull) = ((damping * 0.2).max(1e-18), (pull * 2.0).min(0.5));
        } else if damping > 1e6 {
            break;
        } else {
            (damping, pull) = ((damping * 10.0).max(1e-6), pull * 0.1);
        }
    }
    // Home in without the pull.
    for _ in 0..20 {
        if left.norm() <= REACHED_M * 1e-2 {
            break;
        }
        let step = step(hand, own, &angles, (nominal, 0.0), &left, &jacobian, 1e-15);
        let mut next = angles;
        for &k in own {
            let (lower, upper) = hand.range_rad(k);
            next[k] = (angles[k] + step[k]).limited(lower, upper);
        }
        let (next_left, next_jacobian) = error(hand, fingertip, target, &next);
        if !(next_left.norm() < left.norm()) {
            break;
        }
        (angles, left, jacobian) = (next, next_left, next_jacobian);
    }
    (left.norm(), angles)
}

/// `J^T (J J^T + mu)^-1 e` plus a share of the way to the nominal angles in the null space; joints that would leave
/// their limits don't take part.
fn step(
    hand: &Hand,
    own: &[usize],
    angles: &[f64; MAX_JOINTS],
    (nominal, pull): (&[f64; MAX_JOINTS], f64),
    left: &Vector3<f64>,
    jacobian: &SMatrix<f64, 3, MAX_JOINTS>,
    damping: f64,
) -> [f64; MAX_JOINTS] {
    let mut free: Vec<usize> = own.to_vec();
    loop {
        let mut step = [0.0; MAX_JOINTS];
        let mut square = Matrix3::zeros();
        let mut pulled = Vector3::zeros();
        for &k in &free {
            let column = jacobian.column(k);
            square += column * column.transpose();
            pulled += column * (pull * (nominal[k] - angles[k]));
        }
        square += Matrix3::identity() * (damping * square.trace()).max(f64::MIN_POSITIVE);
        let Some(inverse) = square.try_inverse() else { return step };
        let force = inverse * (left - pulled);
        for &k in &free {
            step[k] = pull * (nominal[k] - angles[k]) + jacobian.column(k).dot(&force);
        }
        let count = free.len();
        free.retain(|&k| {
            let (lower, upper) = hand.range_rad(k);
            !((angles[k] <= lower && step[k] < 0.0) || (angles[k] >= upper && step[k] > 0.0))
        });
        if free.len() == count {
            return step;
        }
    }
}
