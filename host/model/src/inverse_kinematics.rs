//! The posture at the start: fingertip centres where the contacts want them, by inverse kinematics.
//!
//! Every finger is solved for itself, over the joints that move it alone; joints that move several fingertips (a
//! trunk) stay where they are. A step is the damped least-squares step (Levenberg) towards the target, plus a pull
//! towards the nominal posture in the null space of the Jacobian, so that of all postures that reach the target the one
//! near the nominal comes out. Joints that would leave their limits are held there for the step.

use blindgrasp_body::{Hand, MAX_JOINTS, Posture};
use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, SMatrix, Vector3};

/// A fingertip counts as placed when its centre is this close to its target, m.
const REACHED_M: f64 = 1e-12;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;
    use blindgrasp_shared::hand::{Fingertip, Joint, Link};

    /// A sequence of numbers in [0, 1) that is the same everywhere.
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    fn centres(hand: &Hand, angles: &[f64]) -> Vec<Vector3<f64>> {
        let mut padded = [0.0; MAX_JOINTS];
        padded[..angles.len()].copy_from_slice(angles);
        let mut posture = Posture::at_base();
        hand.forward_kinematics(&padded, &mut posture);
        posture.centres_m[..hand.fingertip_count()].to_vec()
    }

    fn three_finger() -> (Hand, Vec<f64>) {
        let scene = Scene::load("prism", &[]).unwrap();
        let nominal = scene.file.hand.joints.iter().map(|joint| joint.nominal_rad).collect();
        (scene.hand, nominal)
    }

    #[test]
    fn reaches_wherever_some_posture_reaches() {
        let (hand, nominal) = three_finger();
        let mut numbers = Numbers(7);
        for _ in 0..300 {
            let angles: Vec<f64> = (0..12)
                .map(|k| {
                    let (lower, upper) = hand.range_rad(k);
                    lower + (upper - lower) * numbers.next()
                })
                .collect();
            let targets = centres(&hand, &angles);
            let found = place(&hand, &targets, &nominal).unwrap_or_else(|miss| panic!("{miss:?} {angles:?}"));
            for (target, centre) in targets.iter().zip(centres(&hand, &found)) {
                assert!((target - centre).norm() <= REACHED_M);
            }
            for (k, angle) in found.iter().enumerate() {
                let (lower, upper) = hand.range_rad(k);
                assert!((lower..=upper).contains(angle));
            }
        }
    }

    #[test]
    fn of_all_postures_the_nearest_to_the_nominal_is_found() {
        let (hand, nominal) = three_finger();
        let targets = centres(&hand, &nominal);
        let found = place(&hand, &targets, &nominal).unwrap();
        for (a, b) in found.iter().zip(&nominal) {
            assert!((a - b).abs() < 1e-12);
        }
        // Near it, no motion in the null space brings the posture nearer: what is left to the nominal is in the row space.
        let targets: Vec<_> =
            targets.iter().map(|target| target + Vector3::new(0.01, -0.005, 0.01)).collect();
        let found = place(&hand, &targets, &nominal).unwrap();
        let mut padded = [0.0; MAX_JOINTS];
        padded[..12].copy_from_slice(&found);
        for fingertip in 0..3 {
            let (_, jacobian) = error(&hand, fingertip, &targets[fingertip], &padded);
            let own = own_joints(&hand, fingertip);
            let rows = nalgebra::SMatrix::<f64, 3, 4>::from_fn(|r, c| jacobian[(r, own[c])]);
            let rest = nalgebra::SVector::<f64, 4>::from_fn(|r, _| nominal[own[r]] - found[own[r]]);
            let square: Matrix3<f64> = rows * rows.transpose();
            let left = rest - rows.transpose() * (square.try_inverse().unwrap() * (rows * rest));
            assert!(left.norm() < 1e-9, "{left}");
        }
    }

    #[test]
    fn says_how_far_an_unreachable_target_is() {
        let (hand, nominal) = three_finger();
        let mut stretched = nominal.clone();
        stretched[4..8].copy_from_slice(&[0.0; 4]);
        let mut targets = centres(&hand, &nominal);
        // 50 mm beyond the stretched finger 2.
        targets[1] = centres(&hand, &stretched)[1] + Vector3::z() * 0.05;
        let miss = place(&hand, &targets, &nominal).unwrap_err();
        assert_eq!(miss.fingertip, 1);
        assert!((miss.distance_m - 0.05).abs() < 1e-6, "{miss:?}");
        targets[0] = Vector3::repeat(f64::NAN);
        assert!(place(&hand, &targets, &nominal).is_err());
    }

    #[test]
    fn a_trunk_stays_where_it_is() {
        let joint = |parent, offset_m, axis| Joint {
            parent,
            offset_m,
            attitude: Matrix3::identity(),
            axis,
            lower_rad: -2.0,
            upper_rad: 2.0,
            link: Link {
                mass_kg: 0.1,
                mass_centre_m: Vector3::zeros(),
                inertia_kg_m2: Matrix3::identity() * 1e-5,
            },
        };
        let (out, up) = (Vector3::x() * 0.1, Vector3::z() * 0.1);
        let mut joints = vec![joint(None, Vector3::zeros(), Vector3::z()), joint(Some(0), up, Vector3::y())];
        let mut fingertips = Vec::new();
        for side in [1.0, -1.0] {
            let base = joints.len();
            joints.push(joint(Some(1), out * side, Vector3::x()));
            joints.push(joint(Some(base), up, Vector3::y()));
            joints.push(joint(Some(base + 1), up, Vector3::y()));
            fingertips.push(Fingertip { link: base + 2, offset_m: up, radius_m: 0.01 });
        }
        let hand = Hand::new(&joints, &fingertips).unwrap();
        assert_eq!((0..8).filter(|&k| is_trunk(&hand, k)).collect::<Vec<_>>(), [0, 1]);
        let angles = [0.3, -0.4, 0.1, 0.2, 0.9, -0.1, -0.2, -0.8];
        let nominal = [0.3, -0.4, 0.0, 0.3, 0.5, 0.0, -0.3, -0.5];
        let found = place(&hand, &centres(&hand, &angles), &nominal).unwrap();
        for (a, b) in found.iter().zip(angles) {
            assert!((a - b).abs() < 1e-9, "{found:?}");
        }
    }
}
