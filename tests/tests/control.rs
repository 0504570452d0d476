//! The grasp law against the paper's formulas as they are printed: Eqs. 30-34 and 59 for the torques, Eqs. 43 and 44
//! for the potentials.

use blindgrasp_shared::control::{AttitudeError, Held, Latch, LawsConfig, Stance};
use blindgrasp_shared::hand::Wrench;
use blindgrasp_tests::cases::{Case, JOINTS, K_ST_NM, RandomHand, cases, law};
use blindgrasp_tests::numeric::{Errors, derivative};
use blindgrasp_tests::random::Draw;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Eq. 30 is the gradient of Eq. 43, with damping and the weight of the links beside it.
///
/// Tolerance: 1e-10 of the largest torque that it could be: the differences err by 1e-12, see [`Case::gradient`].
#[test]
fn the_approach_is_the_negative_gradient_of_its_potential() {
    let (mut errors, mut potentials) = (Errors::new(), Errors::new());
    for case in cases(1000, 300) {
        let gradient = case.gradient(|placed| case.approach_potential(placed));
        let torques = case.torques(&case.speeds, (1.0, 0.0));
        let weight = case.gradient(|placed| case.description.weight_potential_j(placed, &case.gravity));
        let scale = case.approach_scale() + case.weight_scale();
        for k in 0..case.hand.joint_count() {
            errors.add((torques[k] + gradient[k] + case.damping[k] * case.speeds[k] - weight[k]) / scale);
        }
        let monitor = case.monitor();
        let potential = case.approach_potential(&case.description.placed(&case.angles));
        potentials.add((monitor.potentials_j.grasp[0] - potential) / case.approach_scale());
    }
    println!("u_s against the gradient of Eq. 43: {errors}; V_s: {potentials}");
    assert!(errors.largest() < 1e-10);
    // The same sum in two orders, of at most 25 terms.
    assert!(potentials.largest() < 1e-14);
}

/// Eq. 32 is the gradient of Eq. 44, in fingertip frames that the law does not know.
///
/// Tolerance: 1e-10 of `2 N K_st`: the differences err by 1e-12, see [`Case::gradient`].
#[test]
fn the_relative_attitudes_are_the_negative_gradient_of_their_potential() {
    let (mut errors, mut potentials) = (Errors::new(), Errors::new());
    for mut case in cases(2000, 300) {
        let n = case.hand.fingertip_count() as f64;
        let offsets = case.offsets();
        let then = case.tip_frames(&offsets, &case.latched);
        let gradient =
            case.gradient(|placed| case.attitude_potential(&case.frames_of(&offsets, placed), &then));
        let still = [0.0; JOINTS];
        let (with, without) = (case.torques(&still, (0.0, 1.0)), case.torques(&still, (0.0, 0.0)));
        for k in 0..case.hand.joint_count() {
            errors.add((with[k] - without[k] + gradient[k]) / (2.0 * n * K_ST_NM));
        }
        let monitor = case.monitor();
        // The law's has the constant that makes it zero at the latch.
        let expected =
            case.attitude_potential(&case.tip_frames(&offsets, &case.angles), &then) + 3.0 * n * K_ST_NM;
        potentials.add((monitor.potentials_j.grasp[1] - expected) / (3.0 * n * K_ST_NM));
        assert!(monitor.potentials_j.grasp[1] >= 0.0);
    }
    println!("u_st against the gradient of Eq. 44: {errors}; V_st: {potentials}");
    assert!(errors.largest() < 1e-10);
    // Traces of products of rotations after chains of ten joints.
    assert!(potentials.largest() < 1e-13);
}

/// The form of the attitude error that takes half of the angle is the gradient of `8 K_st (1 - cos(a/2))` for each pair of
/// neighbours, in fingertip frames that the law does not know.
///
/// Tolerance: 1e-10 of `2 N K_st`, as above: along one joint, the scalar part of a unit quaternion is first-degree in the
/// sine and cosine of half the angle. Where it changes its sign, the potential has a kink: these cases are left out.
#[test]
fn half_angles_are_the_negative_gradient_of_their_potential() {
    let (mut errors, mut potentials) = (Errors::new(), Errors::new());
    let mut wide = 0;
    for mut case in cases(2100, 600).map(|case| case.with_attitude_error(AttitudeError::HalfAngle)) {
        let n = case.hand.fingertip_count() as f64;
        let offsets = case.offsets();
        let then = case.tip_frames(&offsets, &case.latched);
        let now = case.tip_frames(&offsets, &case.angles);
        let cosines = Case::half_angle_cosines(&now, &then);
        if cosines.iter().any(|&cosine| cosine < 0.02) {
            continue;
        }
        // Turns beyond 90 degrees.
        wide += usize::from(cosines.iter().any(|&cosine| cosine < 0.7));
        let gradient =
            case.gradient(|placed| Case::half_angle_potential(&case.frames_of(&offsets, placed), &then));
        let still = [0.0; JOINTS];
        let (with, without) = (case.torques(&still, (0.0, 1.0)), case.torques(&still, (0.0, 0.0)));
        for k in 0..case.hand.joint_count() {
            errors.add((with[k] - without[k] + gradient[k]) / (2.0 * n * K_ST_NM));
        }
        let potential = case.monitor().potentials_j.grasp[1];
        potentials.add((potential - Case::half_angle_potential(&now, &then)) / (n * K_ST_NM));
        assert!(potential >= 0.0);
    }
    println!(
        "half angles against the gradient: {errors}; their potential: {potentials}; {wide} beyond 90 degrees"
    );
    assert!(errors.largest() < 1e-10);
    assert!(potentials.largest() < 1e-12);
    assert!(wide > 50);
}

/// A hand of two fingers, of which the first joint of the first turns one fingertip against the other; and that joint's
/// axis.
fn one_turns(seed: u64) -> Case {
    let mut draw = Draw::new(seed);
    let description = loop {
        let hand = draw.hand(false);
        if hand.fingertips.len() == 2 {
            break hand;
        }
    };
    let mut case = Case::of(description, draw);
    case.angles = case.latched;
    case
}

/// Both forms of the attitude error over all angles up to half a turn, in a pair that is neighbours twice: the moment is
/// `2 K_st` times `2 sin a` or `4 sin(a/2)`, about the axis of the turn; it is the slope of the potential, also within a
/// degree of half a turn; at no angle the two differ to first order; the half angle's grows to twice the most of the sine's.
///
/// Tolerances: 2e-11 of `K_st` for moments: the trace is right to 1e-15 after chains of ten joints, `1 + trace` is 4e-4 where
/// `cos(a/2)` is 0.01, and the moment eight; 1e-7 for the slope, whose rounding is 1e-15 over a step of 1e-3, and more near
/// half a turn.
#[test]
fn half_angles_hold_up_to_half_a_turn() {
    // The least cos(a/2) that is divided by: sin of half of what is left to half a turn.
    const LEAST: f64 = 0.01;
    let form = |case: &Case, by: f64| {
        let mut angles = case.latched;
        angles[0] += by;
        let posture = case.posture(&angles);
        let latch = case.latch();
        let wrenches = case.attitude_wrenches(&posture, &latch);
        assert!((wrenches[0].moment_nm + wrenches[1].moment_nm).norm() < 1e-15);
        let about = -wrenches[0].moment_nm.dot(&posture.link(0).axis());
        assert!((wrenches[0].moment_nm + posture.link(0).axis() * about).norm() < 1e-12 * K_ST_NM);
        let grip = case.law.grip(&latch);
        let (_, account) = case.with_grip(&angles, &case.speeds, Some(&grip));
        (about / K_ST_NM, account.potentials_j.grasp[1] / K_ST_NM)
    };
    let sine = one_turns(4000);
    let half = one_turns(4000).with_attitude_error(AttitudeError::HalfAngle);
    let (mut errors, mut slopes) = (Errors::new(), Errors::new());
    let (mut before, mut largest_of_sine) = (0.0, 0.0_f64);
    for k in 1..=1800 {
        let a = PI * f64::from(k) / 1800.0;
        let (moment, _) = form(&half, a);
        let (sine_a, cosine_a) = blindgrasp_shared::math::Real::sine_cosine(0.5 * a);
        errors.add(moment - 8.0 * sine_a * (cosine_a / LEAST).min(1.0));
        let slope = derivative(1e-3, |by| form(&half, a + by).1);
        // The bound, in an angle; at half a turn the potential is symmetric.
        let bound = PI - 2.0 * LEAST;
        if (a - bound).abs() > 2e-3 && a < PI - 2e-3 {
            slopes.add(moment - slope);
        }
        assert!(moment > before || a > bound - 2e-3, "{a}");
        before = moment;
        let (moment, _) = form(&sine, a);
        errors.add(moment - 8.0 * sine_a * cosine_a);
        largest_of_sine = largest_of_sine.max(moment);
    }
    let (most, _) = form(&half, PI - 2.001 * LEAST);
    println!(
        "moments of both forms: {errors}; against the slope of the potential: {slopes}; {most} at the most"
    );
    assert!(errors.largest() < 2e-11);
    assert!(slopes.largest() < 1e-7);
    assert!((most / largest_of_sine - 2.0).abs() < 1e-3);
    // 1 / cos(a/2) is 1 + a^2 / 8.
    let a = 1e-3;
    let ratio = form(&half, a).0 / form(&sine, a).0;
    assert!((ratio - 1.0 - 0.125 * a * a).abs() < 1e-11, "{ratio}");
}

/// `B_sti` of Eqs. 32 and 38 as printed: three cross products of the columns of `R_fi` with those of
/// `R_fi,(i-1)d + R_fi,(i+1)d`, where `R_fi,jd = R_fj R_fj,ini^T R_fi,ini` (Eqs. 34 and 59).
fn printed_moments(now: &[Matrix3<f64>], then: &[Matrix3<f64>]) -> Vec<Vector3<f64>> {
    let n = now.len();
    (0..n)
        .map(|i| {
            let desired = |j: usize| now[j] * (then[j].transpose() * then[i]);
            let sum = desired((i + n - 1) % n) + desired((i + 1) % n);
            (0..3).map(|c| now[i].column(c).cross(&sum.column(c))).sum()
        })
        .collect()
}

/// The law's shortcut through turns since the latch is Eq. 32 as it is printed, in any fingertip frames: two fingers,
/// who are neighbours twice, included.
///
/// Tolerance: 1e-14 of `K_st` for a moment in the same frames: it is a sum of 18 products of numbers below one, of
/// matrices that are rounded once; 1e-13 for frames of a second forward kinematics, which differ after chains of ten
/// joints.
#[test]
fn moments_are_those_of_the_print() {
    let (mut same, mut other) = (Errors::new(), Errors::new());
    let mut pairs = 0;
    for mut case in cases(3000, 1000) {
        let moments = case.attitude_wrenches(&case.posture(&case.angles), &case.latch());
        let (now, then) = (case.posture(&case.angles), case.posture(&case.latched));
        let n = case.hand.fingertip_count();
        pairs += usize::from(n == 2);
        for (wrench, printed) in
            moments.iter().zip(printed_moments(&now.attitudes[..n], &then.attitudes[..n]))
        {
            assert_eq!(wrench.force_n, Vector3::zeros());
            same.add((wrench.moment_nm / K_ST_NM - printed).norm());
        }
        let offsets = case.offsets();
        let (now, then) = (case.tip_frames(&offsets, &case.angles), case.tip_frames(&offsets, &case.latched));
        for (wrench, printed) in moments.iter().zip(printed_moments(&now, &then)) {
            other.add((wrench.moment_nm / K_ST_NM - printed).norm());
        }
    }
    println!(
        "B_st as printed, in the law's frames: {same}; in others: {other}; {pairs} hands of two fingers"
    );
    assert!(same.largest() < 1e-14);
    assert!(other.largest() < 1e-13);
    assert!(pairs > 100);
}

/// Two fingers have each other as both neighbours, and Eq. 32 counts them twice: the moment that aligns finger 1 with
/// finger 2 is `2 K_st` times the sum of three cross products, `4 K_st sin(a)` for a relative turn by `a`.
#[test]
fn two_fingers_are_neighbours_twice() {
    let mut case = one_turns(4000);
    // Only the first joint of the first finger has moved: the turn is by its angle about its axis.
    case.angles[0] += 0.4;
    let posture = case.posture(&case.angles);
    let wrenches = case.attitude_wrenches(&posture, &case.latch());
    let expected =
        posture.link(0).axis() * (-4.0 * K_ST_NM * blindgrasp_shared::math::Real::sine_cosine(0.4).0);
    // A few roundings of numbers of the size of `4 K_st`.
    assert!((wrenches[0].moment_nm - expected).norm() < 1e-14, "{} {expected}", wrenches[0].moment_nm);
    assert!((wrenches[1].moment_nm + expected).norm() < 1e-14);
}

/// The potential energy of the links' weight is, but for a constant, that of their centres of mass.
///
/// Tolerance: 1e-14 of the weight at the end of the reach: sums of up to thirty links.
#[test]
fn the_weight_that_is_held_is_that_of_the_links() {
    let mut errors = Errors::new();
    for mut case in cases(2500, 300) {
        let both = [case.angles, case.latched].map(|angles| {
            case.angles = angles;
            let placed = case.description.placed(&angles);
            (case.monitor().weight_potential_j, case.description.weight_potential_j(&placed, &case.gravity))
        });
        let [(held, weight), (held_before, weight_before)] = both;
        errors.add(((held - held_before) - (weight - weight_before)) / case.weight_scale());
    }
    println!("potential energy of the weight: {errors}");
    assert!(errors.largest() < 1e-14);
}

/// The forces and moments of each term on the fingertips sum to zero, about any point; so joints that carry all
/// fingertips feel only their damping and the weight of the links.
///
/// Tolerance: 1e-14 of the sum of the magnitudes, for sums of up to five terms; the trunk's torques, through chains
/// of ten joints, 1e-13 of the largest torque that they could be.
#[test]
fn a_trunk_feels_neither_term() {
    let (mut forces, mut moments, mut trunks) = (Errors::new(), Errors::new(), Errors::new());
    for mut case in cases(5000, 500) {
        let (posture, latch) = (case.posture(&case.angles), case.latch());
        let n = case.hand.fingertip_count();
        let about = case.draw.vector(0.5);
        let config = LawsConfig { attitude_error: AttitudeError::HalfAngle, ..*case.law.config() };
        let half_angle = config.prepare(&case.hand).expect("the gains are good").grasp;
        let halves = half_angle.attitude_wrenches(&case.hand, &posture, &latch.grasp, K_ST_NM);
        for wrenches in [case.approach_wrenches(&posture), case.attitude_wrenches(&posture, &latch), halves] {
            let moment_of = |i: usize, wrench: &Wrench<f64>| {
                wrench.moment_nm + (posture.centres_m[i] - about).cross(&wrench.force_n)
            };
            let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
            let (mut force_scale, mut moment_scale) = (0.0, 0.0);
            for (i, wrench) in wrenches.iter().enumerate() {
                assert!(i < n || *wrench == Wrench::zero(), "a fingertip that is not there");
                force += wrench.force_n;
                moment += moment_of(i, wrench);
                force_scale += wrench.force_n.norm();
                moment_scale +=
                    wrench.moment_nm.norm() + (posture.centres_m[i] - about).norm() * wrench.force_n.norm();
            }
            forces.add(force.norm() / force_scale.max(f64::MIN_POSITIVE));
            moments.add(moment.norm() / moment_scale);
        }
        let torques = case.torques(&case.speeds, (1.0, 1.0));
        let weight = case.hand.gravity_torques(&posture, &case.gravity);
        let scale = case.approach_scale() + case.weight_scale() + 2.0 * n as f64 * K_ST_NM;
        for k in (0..case.hand.joint_count()).filter(|&k| (0..n).all(|i| case.hand.moves(k, i))) {
            trunks.add((torques[k] - (weight[k] - case.damping[k] * case.speeds[k])) / scale);
        }
    }
    println!("sum of forces {forces}; of moments {moments}; trunk joints {trunks}");
    assert!(forces.largest() < 1e-14 && moments.largest() < 1e-14);
    assert!(trunks.largest() < 1e-13);
}

/// The law does not care where the hand stands: on a base that is turned and shifted (with gravity turned too) the same
/// joint angles give the same torques.
///
/// Tolerance: 1e-12 of the largest torque that they could be: the shift, of up to a metre, is added to every position
/// and taken from it again, which costs digits.
#[test]
fn torques_are_the_same_wherever_the_hand_stands() {
    let mut errors = Errors::new();
    for mut here in cases(6000, 300) {
        let (turn, shift) = (here.draw.rotation(), here.draw.vector(1.0));
        let description = here.description.moved(&turn, &shift);
        let hand: RandomHand = description.hand();
        let gravity = turn * here.gravity;
        let law = law(&hand, K_ST_NM, &here.damping, &gravity);
        let there = Case { law, hand, gravity, description, draw: Draw::new(0), ..here };
        let scale = here.approach_scale() + here.weight_scale() + K_ST_NM;
        let (a, b) = (here.torques(&here.speeds, (1.0, 1.0)), there.torques(&there.speeds, (1.0, 1.0)));
        for k in 0..here.hand.joint_count() {
            errors.add((a[k] - b[k]) / scale);
        }
    }
    println!("torques on a moved base, relative: {errors}");
    assert!(errors.largest() < 1e-12);
}

/// At the latch `u_st` and its potential are zero.
///
/// Tolerances, in `K_st`: 1e-15 for the moments, because `R R^T` comes out symmetric, so that its deviation from one
/// has no axial part; 1e-13 for the potential, because at the end of a chain of ten joints `R R^T` is one to about
/// 1e-15 only, and fifteen diagonal entries are summed.
#[test]
fn nothing_pulls_at_the_attitudes_at_the_latch() {
    let (mut moments, mut potentials) = (Errors::new(), Errors::new());
    for mut case in cases(7000, 300) {
        case.angles = case.latched;
        let (posture, latch) = (case.posture(&case.angles), case.latch());
        for wrench in case.attitude_wrenches(&posture, &latch) {
            moments.add(wrench.moment_nm.norm() / K_ST_NM);
        }
        let monitor = case.monitor();
        potentials.add(monitor.potentials_j.grasp[1] / K_ST_NM);
    }
    println!("at the latch: B_st {moments}; V_st {potentials}");
    assert!(moments.largest() < 1e-15);
    assert!(potentials.largest() < 1e-13);
}

/// Without `K_st` the law is `u_s` alone, to the last bit, whatever the latch; without a grip it only damps and
/// carries.
#[test]
fn normal_only_knows_no_latch() {
    for mut case in cases(8000, 100) {
        let normal_only = law(&case.hand, 0.0, &case.damping, &case.gravity);
        let posture = case.posture(&case.angles);
        let latches = [case.latch(), Latch::of(&case.hand, &posture, &case.angles)];
        let (speeds, rest, held) = (case.speeds, [0.0; JOINTS], Held::nothing());
        let (hand, angles_rad) = (&case.hand, &case.angles);
        let stance = Stance { hand, posture: &posture, angles_rad, speeds_rad_s: &speeds, held: &held };
        let approach = case.torques(&case.speeds, (1.0, 0.0));
        for latch in &latches {
            let grip = normal_only.grip(latch);
            let (torques, monitor) = normal_only.torques(&stance, Some(&grip));
            assert_eq!(torques, approach);
            assert_eq!(monitor.potentials_j.grasp[1], 0.0);
        }
        let weight = case.hand.gravity_torques(&posture, &case.gravity);
        let pulls = case.hand.fingertip_torques(&posture, &case.approach_wrenches(&posture));
        let expected: [f64; JOINTS] = std::array::from_fn(|k| pulls[k] + weight[k]);
        let resting = Stance { speeds_rad_s: &rest, ..stance };
        let still = normal_only.torques(&resting, Some(&normal_only.grip(&latches[0])));
        assert_eq!(still.0, expected);
        let released = case.law.torques(&resting, None).0;
        assert_eq!(released, weight);
        case.speeds = [0.0; JOINTS];
        assert_eq!(case.torques(&case.speeds, (0.0, 0.0)), released);
    }
}

/// Shares scale their terms, so that the soft start is a soft start.
///
/// Tolerance: 1e-13 of the largest torque that they could be: the same products in another order.
#[test]
fn shares_scale_their_terms() {
    let mut errors = Errors::new();
    for case in cases(9000, 100) {
        let still = [0.0; JOINTS];
        let [none, force, attitude, both] =
            [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.3, 0.6)].map(|shares| case.torques(&still, shares));
        for k in 0..case.hand.joint_count() {
            let expected = none[k] + 0.3 * (force[k] - none[k]) + 0.6 * (attitude[k] - none[k]);
            errors.add((both[k] - expected) / (case.approach_scale() + case.weight_scale() + K_ST_NM));
        }
    }
    println!("shares: {errors}");
    assert!(errors.largest() < 1e-13);
}
