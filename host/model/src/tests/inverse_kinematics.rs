//! Inverse kinematics on the hands that are shipped, and on one with a trunk.

use crate::Scene;
use blindgrasp_body::inverse_kinematics::{REACHED_M, is_trunk, own_joints, place};
use blindgrasp_body::{Hand, MAX_JOINTS, Posture};
use blindgrasp_meshes::Numbers;
use blindgrasp_shared::hand::{Fingertip, Joint, Link};
use nalgebra::{Matrix3, Vector3};

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
                lower + (upper - lower) * numbers.unit()
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
    let targets: Vec<_> = targets.iter().map(|target| target + Vector3::new(0.01, -0.005, 0.01)).collect();
    let found = place(&hand, &targets, &nominal).unwrap();
    let mut padded = [0.0; MAX_JOINTS];
    padded[..12].copy_from_slice(&found);
    let mut posture = Posture::at_base();
    hand.forward_kinematics(&padded, &mut posture);
    for fingertip in 0..3 {
        let (jacobian, _) = hand.jacobians(&posture, fingertip);
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
