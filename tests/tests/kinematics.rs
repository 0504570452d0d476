//! Kinematics of the hand: against finite differences, against a second forward kinematics written straight from the
//! description, and in `f32` against `f64`.

use blindgrasp_shared::hand::{Fingertip, Hand, Joint, Link, Posture, Wrench};
use blindgrasp_shared::math::Real;
use blindgrasp_tests::description::{Description, axial};
use blindgrasp_tests::numeric::{Errors, derivative};
use blindgrasp_tests::random::Draw;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Five fingers of five joints and a trunk of five.
const JOINTS: usize = 30;
const FINGERS: usize = 5;

type RandomHand = Hand<f64, JOINTS, FINGERS>;

/// A number of random hands, with and without a trunk in turn.
fn random_hands(seed: u64, count: usize) -> impl Iterator<Item = (Draw, Description, RandomHand)> {
    let mut draw = Draw::new(seed);
    (0..count).map(move |k| {
        let description = draw.hand(k % 2 == 0);
        let hand = description.hand();
        (Draw::new(seed + 1 + k as u64), description, hand)
    })
}

fn posture<T: Real>(
    hand: &Hand<T, JOINTS, FINGERS>,
    angles_rad: &[T; JOINTS],
) -> Posture<T, JOINTS, FINGERS> {
    let mut posture = Posture::at_base();
    hand.forward_kinematics(angles_rad, &mut posture);
    posture
}

/// Eq. 11, column by column.
///
/// Tolerance: 1e-7, relative to the Frobenius norm of each Jacobian. The differences are better than that by far. Along
/// one joint a fingertip moves on a circle of radius `rho <= reach`, so that the truncation error is `rho step^4 / 480`
/// = 3e-14 rho at the step of 2^-9 rad; the rounding error is three times that of forward kinematics, about
/// 1e-15 reach, over the step: 1e-12 reach. The largest reach is 100 times the least Jacobian that occurs.
#[test]
fn jacobians_are_the_derivatives_of_forward_kinematics() {
    const STEP_RAD: f64 = 1.0 / 512.0;
    let (mut linear_errors, mut angular_errors) = (Errors::new(), Errors::new());
    for (mut draw, description, hand) in random_hands(1, 1000) {
        let angles = draw.joints::<JOINTS>(PI);
        let here = posture(&hand, &angles);
        for i in 0..hand.fingertip_count() {
            let (linear, angular) = hand.jacobians(&here, i);
            let moved = |k: usize, by: f64| {
                let mut angles = angles;
                angles[k] += by;
                posture(&hand, &angles)
            };
            let (mut linear_error, mut angular_error): (f64, f64) = (0.0, 0.0);
            for k in 0..JOINTS {
                if k >= description.joints.len() {
                    assert_eq!(linear.column(k).norm() + angular.column(k).norm(), 0.0, "unused column {k}");
                    continue;
                }
                let velocity = derivative(STEP_RAD, |by| moved(k, by).centres_m[i]);
                let turning =
                    derivative(STEP_RAD, |by| moved(k, by).attitudes[i]) * here.attitudes[i].transpose();
                linear_error += (linear.column(k) - velocity).norm_squared();
                // The whole matrix `dR R^T`, so that a part that is not skew counts too.
                angular_error +=
                    0.5 * (angular.column(k).into_owned().cross_matrix() - turning).norm_squared();
            }
            linear_errors.add(linear_error.square_root() / linear.norm());
            angular_errors.add(angular_error.square_root() / angular.norm());
        }
    }
    println!("relative error of J: {linear_errors}; of J_Omega: {angular_errors}");
    assert!(linear_errors.largest() < 1e-7);
    assert!(angular_errors.largest() < 1e-7);
}

/// The prepared frames differ from the description's, but what they place is the same.
///
/// Tolerance: 2e-14 (m; unit-free for directions; relative for inertias): each of at most ten joints in a chain adds
/// some ten roundings of 1.1e-16 in either computation, and they must add up, not multiply.
#[test]
fn prepared_frames_place_what_the_description_says() {
    let mut errors = Errors::new();
    for (mut draw, description, hand) in random_hands(2, 1000) {
        let angles = draw.joints::<JOINTS>(PI);
        let (here, expected) = (posture(&hand, &angles), description.placed(&angles));
        let (zero, expected_zero) = (posture(&hand, &[0.0; JOINTS]), description.placed(&[0.0; JOINTS]));
        for k in 0..hand.joint_count() {
            let (pose, link) = (here.link(k), hand.link(k));
            errors.add((pose.origin_m - expected.origins_m[k]).norm());
            errors.add((pose.axis() - expected.axes[k]).norm());
            errors.add((pose.point(&link.mass_centre_m) - expected.mass_centres_m[k]).norm());
            let inertia = pose.attitude * link.inertia_kg_m2 * pose.attitude.transpose();
            let scale = expected.inertias_kg_m2[k].norm().max(f64::MIN_POSITIVE);
            errors.add((inertia - expected.inertias_kg_m2[k]).norm() / scale);
            errors.add((pose.attitude.transpose() * pose.attitude - Matrix3::identity()).norm());
        }
        for (i, tip) in description.fingertips.iter().enumerate() {
            errors.add((here.centres_m[i] - expected.centres_m[i]).norm());
            // Frames may differ by a constant, turns may not.
            let turn = here.attitudes[i] * zero.attitudes[i].transpose();
            let expected = expected.attitudes[tip.link] * expected_zero.attitudes[tip.link].transpose();
            errors.add((turn - expected).norm());
        }
    }
    println!("prepared against described: {errors}");
    assert!(errors.largest() < 2e-14);
}

/// `g` and `sum(J_i^T F_i + J_Omega i^T M_i)`, with Jacobians from finite differences of the second forward
/// kinematics and the weight of each link at its own mass centre.
///
/// Tolerance: 1e-10 of the largest torque that the loads could exert (`force * reach + moment`): the differences err by
/// 1e-12, see above.
#[test]
fn joint_torques_are_transposed_jacobians_times_wrenches() {
    const STEP_RAD: f64 = 1.0 / 512.0;
    let mut errors = Errors::new();
    for (mut draw, description, hand) in random_hands(3, 200) {
        let angles = draw.joints::<JOINTS>(PI);
        let gravity = draw.vector(9.81);
        let wrenches: [Wrench<f64>; FINGERS] =
            std::array::from_fn(|_| Wrench { force_n: draw.vector(5.0), moment_nm: draw.vector(0.2) });
        let here = posture(&hand, &angles);
        let torques = hand.fingertip_torques(&here, &wrenches);
        let weight = hand.gravity_torques(&here, &gravity);
        let placed = description.placed(&angles);
        let mut scale = 0.0;
        for (i, wrench) in wrenches.iter().enumerate().take(hand.fingertip_count()) {
            scale += wrench.force_n.norm() * description.reach_m(i) + wrench.moment_nm.norm();
        }
        let loads: f64 = description.joints.iter().map(|joint| joint.link.mass_kg).sum();
        scale += loads * gravity.norm();
        for k in 0..hand.joint_count() {
            let moved = |by: f64| {
                let mut angles = angles;
                angles[k] += by;
                description.placed(&angles)
            };
            let pushed = (0..hand.fingertip_count()).map(|i| {
                let link = description.fingertips[i].link;
                let velocity = derivative(STEP_RAD, |by| moved(by).centres_m[i]);
                let turning = axial(
                    &(derivative(STEP_RAD, |by| moved(by).attitudes[link])
                        * placed.attitudes[link].transpose()),
                );
                velocity.dot(&wrenches[i].force_n) + turning.dot(&wrenches[i].moment_nm)
            });
            let pushed: f64 = pushed.sum();
            let held = derivative(STEP_RAD, |by| description.weight_potential_j(&moved(by), &gravity));
            errors.add((torques[k] - pushed) / scale);
            errors.add((weight[k] - held) / scale);
        }
        assert!(
            [torques, weight].iter().flat_map(|all| &all[hand.joint_count()..]).all(|&torque| torque == 0.0),
            "joints that are not there"
        );
    }
    println!("joint torques, relative: {errors}");
    assert!(errors.largest() < 1e-10);
}

/// The controller computes in `f32` what the tests above prove in `f64`.
///
/// Bound, with `u` = 2^-24 (half the machine epsilon), `n` the number of joints to the fingertip and `L` its reach:
/// - Each planar chain adds an error to the attitude (Frobenius norm) of at most `sqrt(3) u` for the rounded constants of
///   its bend, `3 u` for adding the parent's angle to it, `6 u` for the two turns of the axes, `2 * 3.4 u` for sine and
///   cosine (their stated 2e-7 is 3.4 `u`) and `4 u` for turning the link: `22 u` in all. Each further joint of
///   the chain adds a rounding of the sum of angles: `8 u` up to four half turns (two joints), `16 u` up to ten (five),
///   in two axes `sqrt(2)` of that. That sums to at most `22 n u` for chains of up to five.
/// - An origin inherits `22 k u` of each bone before it and adds `7 u` of the bone for rounding and `u L` for the sum:
///   `(23 n + 7) u L` for a fingertip's centre.
/// - A column of `J` is an axis (error `22 n u`) times a lever (length up to `2 L`, an error of two positions): with
///   the rounding of the product `(44 n + 2 (23 n + 7) + 7) u L = (90 n + 21) u L`.
#[test]
fn single_precision_stays_within_its_bound() {
    let u = f64::from(f32::EPSILON) / 2.0;
    let (mut centres, mut attitudes, mut jacobians) = (Errors::new(), Errors::new(), Errors::new());
    let mut units = Errors::new();
    for (mut draw, description, hand) in random_hands(4, 1000) {
        let small = hand.cast::<f32>();
        // Angles that both precisions have exactly.
        let angles_f32: [f32; JOINTS] = draw.joints(2.0 * PI).map(|angle| angle as f32);
        let angles = angles_f32.map(f64::from);
        let (exact, rounded) = (posture(&hand, &angles), posture(&small, &angles_f32));
        for i in 0..hand.fingertip_count() {
            let (n, reach) = (description.chain_length(i) as f64, description.reach_m(i));
            let centre = (rounded.centres_m[i].map(f64::from) - exact.centres_m[i]).norm();
            let attitude = (rounded.attitudes[i].map(f64::from) - exact.attitudes[i]).norm();
            centres.add(centre / ((23.0 * n + 7.0) * u * reach));
            attitudes.add(attitude / (22.0 * n * u));
            units.add(centre / (u * n * reach));
            let ((linear, angular), (linear_f32, angular_f32)) =
                (hand.jacobians(&exact, i), small.jacobians(&rounded, i));
            for k in 0..hand.joint_count() {
                let linear = (linear_f32.column(k).map(f64::from) - linear.column(k)).norm();
                let angular = (angular_f32.column(k).map(f64::from) - angular.column(k)).norm();
                jacobians.add(linear / ((90.0 * n + 21.0) * u * reach));
                jacobians.add(angular / (22.0 * n * u));
            }
        }
    }
    println!("f32, shares of the bound: centres {centres}; attitudes {attitudes}; Jacobians {jacobians}");
    println!("f32 centres in units of u * chain * reach: {units}");
    assert!(centres.largest() < 1.0 && attitudes.largest() < 1.0 && jacobians.largest() < 1.0);
    // And it is `f32` that was measured.
    assert!(units.largest() > 0.1);
}

/// A joint whose axis is exactly, nearly or almost not its parent's: the special case of the preparation has no edge.
///
/// Tolerance: 1e-13 m: an axis that is its parent's to 1e-14 is taken as parallel, in up to ten joints, of a reach
/// below 1 m.
#[test]
fn axes_near_the_parents_are_no_special_case() {
    let mut draw = Draw::new(5);
    let mut errors = Errors::new();
    for exponent in 0..=18 {
        for sign in [1.0, -1.0] {
            let mut description = draw.hand(true);
            for k in 1..description.joints.len() {
                let Some(parent) = description.joints[k].parent else { continue };
                let tilt = draw.unit() * 10_f64.powi(-exponent);
                let joint = &mut description.joints[k];
                joint.attitude = Matrix3::identity();
                let axis: Vector3<f64> = description.joints[parent].axis * sign + tilt;
                description.joints[k].axis = axis.normalize();
            }
            let hand: RandomHand = description.hand();
            let angles = draw.joints::<JOINTS>(PI);
            let (here, expected) = (posture(&hand, &angles), description.placed(&angles));
            for i in 0..hand.fingertip_count() {
                errors.add((here.centres_m[i] - expected.centres_m[i]).norm());
            }
        }
    }
    println!("axes near the parent's: {errors}");
    assert!(errors.largest() < 1e-13);
}

/// The relations of joints to their parents in [`bundle`], with their numbers.
#[derive(Debug, Default)]
struct Kinds {
    parallel: usize,
    antiparallel: usize,
    /// Another joint already follows the parent.
    branching: usize,
    /// At its parent's origin.
    coincident: usize,
    /// Along the parent's axis.
    axial: usize,
}

/// A hand of parallel, antiparallel and other joints in every combination: joints at one point or shifted along the axis,
/// chains of one, branches from the middle of a chain, and fingertips in the middle of a chain.
fn bundle(draw: &mut Draw, kinds: &mut Kinds) -> Description {
    let mut hand = Description::default();
    for k in 0..draw.count(4..=20) {
        let leaves = (0..k).filter(|&j| hand.joints.iter().all(|joint| joint.parent != Some(j))).count();
        let parent = match k.checked_sub(1) {
            Some(last) if leaves < FINGERS - 1 && draw.chance(0.2) => Some(draw.count(0..=last)),
            last => last,
        };
        let taken = parent.is_some_and(|p| hand.joints.iter().any(|joint| joint.parent == Some(p)));
        kinds.branching += usize::from(taken);
        let attitude = if draw.chance(0.5) { Matrix3::identity() } else { draw.rotation() };
        let below = parent.map_or(Vector3::z(), |parent| hand.joints[parent].axis);
        let axis: Vector3<f64> = match draw.count(0..=9) {
            0..6 => {
                kinds.parallel += 1;
                attitude.transpose() * below
            }
            6 => {
                kinds.antiparallel += 1;
                attitude.transpose() * -below
            }
            _ => draw.unit(),
        };
        let offset_m = match draw.count(0..=3) {
            0 => {
                kinds.coincident += 1;
                Vector3::zeros()
            }
            1 => {
                kinds.axial += 1;
                below * draw.within(-0.1, 0.1)
            }
            _ => draw.vector(0.1),
        };
        let mass_kg = if draw.chance(0.3) { 0.0 } else { draw.within(0.01, 0.3) };
        hand.joints.push(Joint {
            parent,
            offset_m,
            attitude,
            axis: axis.normalize(),
            lower_rad: -PI,
            upper_rad: PI,
            link: Link {
                mass_kg,
                mass_centre_m: draw.vector(0.05),
                inertia_kg_m2: draw.inertia(mass_kg, 0.1),
            },
        });
    }
    let leaves = (0..hand.joints.len()).filter(|&j| hand.joints.iter().all(|joint| joint.parent != Some(j)));
    let mut links: Vec<usize> = leaves.collect();
    while links.len() < 2 || (links.len() < FINGERS && draw.chance(0.3)) {
        links.push(draw.count(0..=hand.joints.len() - 1));
    }
    for link in links {
        let tip = Fingertip { link, offset_m: draw.vector(0.05), radius_m: 0.01 };
        hand.fingertips.push(tip);
    }
    hand
}

/// Places and torques of hands of planar chains, against the second forward kinematics and against moments about
/// each joint's axis, summed up over everything that the joint moves.
///
/// Tolerance: 1e-13 m and 1e-13 of the loads: chains of up to twenty joints, with some ten roundings each.
#[test]
fn planar_chains_are_no_special_case() {
    let (mut places, mut torques) = (Errors::new(), Errors::new());
    let mut kinds = Kinds::default();
    let mut draw = Draw::new(6);
    for _ in 0..1000 {
        let description = bundle(&mut draw, &mut kinds);
        let hand: RandomHand = description.hand();
        let angles = draw.joints::<JOINTS>(PI);
        let gravity = draw.vector(9.81);
        let wrenches: [Wrench<f64>; FINGERS] =
            std::array::from_fn(|_| Wrench { force_n: draw.vector(5.0), moment_nm: draw.vector(0.2) });
        let (here, expected) = (posture(&hand, &angles), description.placed(&angles));
        let (zero, expected_zero) = (posture(&hand, &[0.0; JOINTS]), description.placed(&[0.0; JOINTS]));
        let pushed = hand.fingertip_torques(&here, &wrenches);
        let held = hand.gravity_torques(&here, &gravity);
        for (i, tip) in description.fingertips.iter().enumerate() {
            places.add((here.centres_m[i] - expected.centres_m[i]).norm());
            let turn = here.attitudes[i] * zero.attitudes[i].transpose();
            let expected = expected.attitudes[tip.link] * expected_zero.attitudes[tip.link].transpose();
            places.add((turn - expected).norm());
        }
        for k in 0..description.joints.len() {
            let (pose, axis, origin) = (here.link(k), expected.axes[k], expected.origins_m[k]);
            places.add((pose.origin_m - origin).norm());
            places.add((pose.axis() - axis).norm());
            let moves = |link: usize| description.chain(link).any(|below| below == k);
            let (mut push, mut hold, mut scale) = (0.0, 0.0, 0.0);
            for (tip, (centre, wrench)) in
                description.fingertips.iter().zip(expected.centres_m.iter().zip(&wrenches))
            {
                if moves(tip.link) {
                    push += axis.dot(&(wrench.moment_nm + (centre - origin).cross(&wrench.force_n)));
                }
                scale += wrench.moment_nm.norm() + wrench.force_n.norm();
            }
            for (link, (joint, centre)) in description.joints.iter().zip(&expected.mass_centres_m).enumerate()
            {
                if moves(link) {
                    hold -= axis.dot(&(centre - origin).cross(&(gravity * joint.link.mass_kg)));
                }
                scale += joint.link.mass_kg * gravity.norm();
            }
            torques.add((pushed[k] - push) / scale);
            torques.add((held[k] - hold) / scale);
        }
    }
    println!("planar chains: places {places}; torques, relative {torques}; {kinds:?}");
    assert!(places.largest() < 1e-13 && torques.largest() < 1e-13);
    let Kinds { parallel, antiparallel, branching, coincident, axial } = kinds;
    assert!([parallel, antiparallel, branching, coincident, axial].into_iter().all(|count| count > 500));
}
