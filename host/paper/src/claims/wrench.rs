//! An arm feels neither `u_s` nor `u_st`: what they put on the fingertips sums to no force and no moment.

use super::{joint_torques, largest, row, runs};
use crate::claim::{Claim, Figure, Row, Verdict, number};
use crate::evidence::{Done, Evidence, EvidenceError};
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_body::dynamics::JointVector;
use blindgrasp_shared::control::Latch;
use blindgrasp_shared::hand::Wrench;
use blindgrasp_sim::laws;
use nalgebra::Vector3;

/// One sample in so many.
const STRIDE: usize = 20;
/// Largest remainder, as a share of the sum of the forces' and moments' own lengths.
const LEFT: f64 = 1e-12;

pub(super) fn balanced(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let names = ["hand-arm", "hand-arm-stiff", "cube"];
    Ok(Claim {
        key: "no-net-wrench",
        words: "The control signals for grasping do not disturb the arm: it feels no net force or moment of u_s and u_st",
        place: "Secs. 1 and 3, Eqs. 30 and 32",
        criterion: "at every 20th sample the forces of u_s, their moments and the moments of u_st sum to less than 1e-12 of the \
                    sum of their lengths, and so do the torques that they put on joints that carry several fingers",
        tolerance: "Rounding of double precision, 1e-16, over a dozen operations on numbers of like size.",
        rows: runs(evidence, &names)?.into_iter().map(balanced_row).collect(),
    })
}

pub(super) fn balanced_row(done: &Done) -> Row {
    let scene = &done.scene;
    let (Ok(laws), Some(first)) = (laws(scene), done.run.samples.first()) else {
        return row(done, "no sample".to_owned(), Verdict::NotReproduced);
    };
    let hand = &scene.hand;
    let latch = Latch::of(hand, &first.posture(hand), &first.joint_angles_rad());
    let fingers = hand.fingertip_count();
    let shared: Vec<usize> = (0..hand.joint_count())
        .filter(|&k| (0..fingers).filter(|&i| hand.moves(k, i)).count() == fingers)
        .collect();
    let (mut force, mut moment, mut torque) = (0.0_f64, 0.0_f64, 0.0_f64);
    for sample in done.run.samples.iter().step_by(STRIDE) {
        let posture = sample.posture(hand);
        let [force_n, stiffness_nm] = laws.gains().grasp;
        let pulls = laws.grasp.approach_wrenches(hand, &posture, force_n);
        let turns = laws.grasp.attitude_wrenches(hand, &posture, &latch.grasp, stiffness_nm);
        let (mut forces, mut moments, mut lengths) = (Vector3::zeros(), Vector3::zeros(), [0.0; 2]);
        let mut torques_nm: JointVector = [0.0; MAX_JOINTS];
        for i in 0..fingers {
            let arm = posture.centres_m[i].cross(&pulls[i].force_n);
            forces += pulls[i].force_n;
            moments += arm + turns[i].moment_nm;
            lengths[0] += pulls[i].force_n.norm();
            lengths[1] += arm.norm() + turns[i].moment_nm.norm();
            let both = Wrench { force_n: pulls[i].force_n, moment_nm: turns[i].moment_nm };
            for (sum, torque) in torques_nm.iter_mut().zip(joint_torques(hand, &posture, i, &both)) {
                *sum += torque;
            }
        }
        force = largest([force, forces.norm() / lengths[0]].into_iter());
        moment = largest([moment, moments.norm() / lengths[1]].into_iter());
        torque = largest(shared.iter().map(|&k| torques_nm[k].abs() / lengths[1]).chain([torque]));
    }
    let mut measured = format!("forces sum to {}, moments to {}", number(force), number(moment));
    if !shared.is_empty() {
        measured += &format!(", torques of the {} arm joints to {}", shared.len(), number(torque));
    }
    let holds = force < LEFT && moment < LEFT && torque < LEFT;
    let mut row = row(done, measured + " of their parts", Verdict::holds(holds));
    row.figures = vec![
        Figure::new("force_left", force, ""),
        Figure::new("moment_left", moment, ""),
        Figure::new("arm_torque_left", torque, ""),
    ];
    row
}
