//! The earlier law (the paper's references 14 and 15), `u_I = -K_I` times the integral of each joint's velocity: against its
//! potential, against the integral as it was defined, and against what the paper says speaks for its own law instead.

use blindgrasp::model::Scene;
use blindgrasp::sim::Simulation;
use blindgrasp_shared::control::PerGain;
use blindgrasp_tests::cases::{Case, JOINTS, K_I_NM_RAD, K_ST_NM, Torques, cases};
use blindgrasp_tests::numeric::{Errors, derivative};
use nalgebra::{DMatrix, DVector, Vector3};

const STILL: Torques = [0.0; JOINTS];

/// `u_I` alone.
fn integral() -> PerGain<f64> {
    PerGain { integral: [K_I_NM_RAD], ..PerGain::all(0.0) }
}

/// Returns the torques that `u_I` adds.
fn pull_back(case: &Case) -> Torques {
    let (with, without) =
        (case.with_gains(&STILL, integral()).0, case.with_gains(&STILL, PerGain::all(0.0)).0);
    std::array::from_fn(|k| with[k] - without[k])
}

/// Tolerance: 1e-12 of `K_I` times a radian. The potential is quadratic, so that differences have no truncation error; it
/// is up to 2.5 rad^2 (thirty turns of up to 0.7 rad) times `K_I`, and three times its rounding over the step of 1/512 is
/// 8e-13. Torques are differences of sums in which the links' weight is, which costs 1e-15 of that.
#[test]
fn it_is_the_negative_gradient_of_its_potential() {
    let (mut errors, mut potentials) = (Errors::new(), Errors::new());
    for case in cases(100, 300) {
        let potential = |angles: &Torques| {
            let turned = angles.iter().zip(&case.latched).map(|(now, then)| now - then);
            0.5 * K_I_NM_RAD * turned.map(|turned| turned * turned).sum::<f64>()
        };
        let torques = pull_back(&case);
        for (k, torque) in torques.iter().enumerate() {
            let along = |by: f64| {
                let mut angles = case.angles;
                angles[k] += by;
                potential(&angles)
            };
            errors.add((torque + derivative(1.0 / 512.0, along)) / (K_I_NM_RAD + case.weight_scale()));
        }
        let monitor = case.with_gains(&case.speeds, integral()).1;
        potentials.add((monitor.potentials_j.integral[0] - potential(&case.angles)) / K_I_NM_RAD);
    }
    println!("u_I against the gradient of its potential: {errors}; V_I: {potentials}");
    assert!(errors.largest() < 1e-12);
    assert!(potentials.largest() < 1e-14);
}

/// At the latch it does nothing, exactly, and without its gain it is not there, to the bit.
#[test]
fn it_is_zero_at_the_latch_and_without_its_gain() {
    for mut case in cases(200, 100) {
        let (paper, monitor) = case.with_gains(&case.speeds, case.law.gains());
        assert_eq!((case.torques(&case.speeds, (1.0, 1.0)), monitor.potentials_j.integral[0]), (paper, 0.0));
        case.angles = case.latched;
        let monitor = case.with_gains(&case.speeds, integral()).1;
        assert_eq!((pull_back(&case), monitor.potentials_j.integral[0]), (STILL, 0.0));
    }
}

/// In a grasp of the cube, through encoders and their estimator, the law that is meant to integrate speeds does: what the
/// torques hold at rest is `-K_I` times the sum of the speeds that the controller estimated on the way, times the period.
///
/// Tolerance: 1e-6 rad. The filter's angle is the sum of its speeds and of its corrections, which are as much as the
/// speed has changed: from rest to rest nothing is left of them, and the sum of 8000 speeds in single precision, of up to
/// 0.1 rad in all, errs by less than that. A count is 2.9e-4 rad.
#[test]
fn it_equals_the_integral_of_the_speeds() {
    let settings = ["control.attitude_stiffness_nm=0", "control.integral_gain_nm_rad=0.02"];
    let scene = Scene::load("cube", &settings.map(str::to_owned)).expect("the scene");
    let period_s = scene.control.period_s;
    let run = Simulation::new(&scene).expect("a plant").run();
    assert!(
        run.summary.grasp_held && run.summary.settled && run.summary.fault.is_none(),
        "{:?}",
        run.summary
    );
    let (first, last) = (&run.samples[0], run.samples.last().expect("samples"));
    let mut farthest_rad: f64 = 0.0;
    for k in 0..scene.joints.len() {
        let integral_rad: f64 =
            run.samples.iter().map(|sample| sample.estimated_speeds_rad_s[k] * period_s).sum();
        let turned_rad = last.estimated_angles_rad[k] - first.estimated_angles_rad[k];
        assert!((integral_rad - turned_rad).abs() < 1e-6, "joint {k}: {integral_rad} and {turned_rad} rad");
        farthest_rad = farthest_rad.max(turned_rad.abs());
    }
    println!("the joint that turned most turned by {farthest_rad:.4} rad");
    assert!(farthest_rad > 0.01, "or nothing was shown");
}

/// Returns `true` if a joint carries all fingertips.
fn is_of_the_trunk(case: &Case, joint: usize) -> bool {
    (0..case.hand.fingertip_count()).all(|i| case.hand.moves(joint, i))
}

/// The point that the paper makes against it. A hand that is carried about by its trunk, with the fingers as they were when
/// they grasped, is let go where it likes by `u_s` and `u_st`: their wrenches sum to zero (`control.rs`,
/// `a_trunk_feels_neither_term`). `u_I` pulls every joint of the trunk back by `K_I` times its turn.
///
/// Tolerance: 1e-13 of the largest torque that the terms could put on a joint, as there.
#[test]
fn an_arm_that_is_moved_feels_it() {
    let (mut paper, mut earlier, mut trunks) = (Errors::new(), Errors::new(), 0);
    for mut case in cases(300, 300) {
        let carried: Vec<usize> =
            (0..case.hand.joint_count()).filter(|&joint| is_of_the_trunk(&case, joint)).collect();
        let moved = case.angles;
        case.angles = case.latched;
        for &joint in &carried {
            case.angles[joint] = moved[joint];
        }
        let rest = case.torques(&STILL, (0.0, 0.0));
        let with_both = case.torques(&STILL, (1.0, 1.0));
        let (pulled, scale) = (pull_back(&case), case.approach_scale() + case.weight_scale() + K_ST_NM);
        for &joint in &carried {
            let turned = case.angles[joint] - case.latched[joint];
            paper.add((with_both[joint] - rest[joint]) / scale);
            earlier.add((pulled[joint] + K_I_NM_RAD * turned) / scale);
            assert!(pulled[joint] * turned < 0.0, "it does not pull back");
            trunks += 1;
        }
    }
    println!("{trunks} joints of trunks: u_s + u_st {paper}; u_I less K_I times the turn {earlier}");
    assert!(paper.largest() < 1e-13 && earlier.largest() < 1e-13);
    assert!(trunks > 200, "{trunks}");
}

/// And so does one that has not moved, as soon as there is something in the hand: the forces `F` that fingers put on it by
/// their torques, `J^T F = u`, sum to zero for `u_s` and do not for `u_I`. What is left pushes the object, and against it
/// the arm has to stand. `u_st` is made of moments, which are no part of `J^T F`.
///
/// Of fingers with three joints of their own and more, that are not nearly straight: by least squares, whose condition is
/// 20 at most. Tolerance: 1e-11, for singular values that are right to 1e-15 of the largest, squared.
#[test]
fn what_it_puts_on_an_object_need_not_sum_to_zero() {
    let (mut paper, mut earlier, mut hands) = (Errors::new(), Vec::new(), 0);
    for mut case in cases(400, 600) {
        let fingers = case.hand.fingertip_count();
        let own = |i: usize, k: usize| (0..fingers).all(|other| case.hand.moves(k, other) == (other == i));
        let joints = |i: usize| (0..case.hand.joint_count()).filter(|&k| own(i, k)).collect::<Vec<_>>();
        let chains: Vec<Vec<usize>> = (0..fingers).map(joints).collect();
        if chains.iter().any(|chain| chain.len() < 3) {
            continue;
        }
        for k in (0..case.hand.joint_count()).filter(|k| !chains.iter().flatten().any(|own| own == k)) {
            case.angles[k] = case.latched[k];
        }
        let posture = case.posture(&case.angles);
        let sum = |torques: &Torques| -> Option<(Vector3<f64>, f64)> {
            let (mut sum, mut size) = (Vector3::zeros(), 0.0);
            for (i, chain) in chains.iter().enumerate() {
                let jacobian = case.hand.jacobians(&posture, i).0;
                let transposed = DMatrix::from_fn(chain.len(), 3, |row, axis| jacobian[(axis, chain[row])]);
                let torques = DVector::from_iterator(chain.len(), chain.iter().map(|&k| torques[k]));
                let values = transposed.clone().svd(true, true);
                // A finger that is nearly straight bears what its torques say nothing of.
                if values.singular_values.min() < 0.05 * values.singular_values.max() {
                    return None;
                }
                let force = values.solve(&torques, 0.0).ok()?;
                size += force.norm();
                sum += Vector3::new(force[0], force[1], force[2]);
            }
            Some((sum, size))
        };
        let rest = case.torques(&STILL, (0.0, 0.0));
        let approach = case.torques(&STILL, (1.0, 0.0));
        let pulls: Torques = std::array::from_fn(|k| approach[k] - rest[k]);
        let (Some((zero, scale)), Some((left, size))) = (sum(&pulls), sum(&pull_back(&case))) else {
            continue;
        };
        paper.add(zero.norm() / scale);
        earlier.push(left.norm() / size);
        hands += 1;
    }
    earlier.sort_by(f64::total_cmp);
    println!(
        "{hands} hands: sum of the forces over the sum of their magnitudes: u_s {paper}; u_I {:.3} to {:.3}, half of them \
        above {:.3}",
        earlier[0],
        earlier[hands - 1],
        earlier[hands / 2]
    );
    assert!(paper.largest() < 1e-11);
    assert!(hands > 30 && earlier[hands / 2] > 0.1);
}
