//! The torques that an arm feels of each law, while the object is pushed in its hand.

use crate::evidence::{EvidenceError, scene, simulation};
use crate::laws::{Law, Lost, built};
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_model::Scene;
use blindgrasp_model::file::PushFile;
use blindgrasp_shared::control::{Held, Latch, Stance};
use blindgrasp_sim::laws;
use blindgrasp_sim::sample::Sample;
use rayon::prelude::*;
use serde::Serialize;

const RUN: &str = "pushed-arm";
/// Each law with a gain that holds the printed cuboid.
pub(super) const LAWS: [(Law, f64); 2] = [(Law::Attitudes, 0.3), (Law::Integral, 0.3)];
const DURATION: &str = "duration_s=20";
/// The push: what a hand would have of somebody who takes the object with one finger.
const PUSH: PushFile =
    PushFile { from_s: 2.0, for_s: 3.0, rise_s: 0.5, force_n: [0.0, -0.2, 0.0], moment_nm: [0.0; 3] };
/// One sample in so many is looked at.
const STRIDE: usize = 20;

/// The hand-arm, whose object was pushed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Carried {
    /// The law.
    pub law: Law,
    /// Its gain.
    pub gain: f64,
    /// The loss of the grasp, if there was one.
    pub lost: Option<Lost>,
    /// Largest torque on a joint of the arm that is neither damping nor weight, N m.
    pub arm_torque_nm: f64,
    /// Largest such torque on a joint of the fingers, N m.
    pub finger_torque_nm: f64,
    /// The largest turn of a joint of the arm when the push ended, rad.
    pub turned_by_push_rad: f64,
    /// And at the end of the run, rad.
    pub turned_at_end_rad: f64,
}

impl Carried {
    /// The largest torque on the arm, as a part of the largest on the fingers.
    pub fn felt(&self) -> f64 {
        self.arm_torque_nm / self.finger_torque_nm
    }

    fn of(law: Law, gain: f64, scene: &Scene, run: &blindgrasp_sim::Run) -> Result<Self, EvidenceError> {
        let hand = &scene.hand;
        let fingers = hand.fingertip_count();
        let arm: Vec<usize> =
            (0..hand.joint_count()).filter(|&k| (0..fingers).all(|i| hand.moves(k, i))).collect();
        let of_the_fingers = (0..hand.joint_count()).filter(|k| !arm.contains(k)).collect::<Vec<_>>();
        let samples = &run.samples;
        let torques = torques(scene, samples)?;
        let largest = |joints: &[usize]| {
            let all = torques.iter().flat_map(|torques| joints.iter().map(|&k| torques[k].abs()));
            all.fold(0.0, f64::max)
        };
        let turned = |sample: Option<&Sample>| {
            samples.first().zip(sample).map_or(f64::NAN, |(first, now)| {
                arm.iter().map(|&k| (now.angles_rad[k] - first.angles_rad[k]).abs()).fold(0.0, f64::max)
            })
        };
        Ok(Self {
            law,
            gain,
            lost: Lost::of(&run.summary),
            arm_torque_nm: largest(&arm),
            finger_torque_nm: largest(&of_the_fingers),
            turned_by_push_rad: turned(samples.iter().find(|sample| sample.t_s >= PUSH.from_s + PUSH.for_s)),
            turned_at_end_rad: turned(samples.last()),
        })
    }
}

/// Returns the torques of the law on the joints besides damping and weight, N m.
fn torques(scene: &Scene, samples: &[Sample]) -> Result<Vec<[f64; MAX_JOINTS]>, EvidenceError> {
    let laws = laws(scene).map_err(|cause| EvidenceError::of(RUN, cause))?;
    let Some(first) = samples.first() else { return Ok(Vec::new()) };
    let latch = Latch::of(&scene.hand, &first.posture(&scene.hand), &first.joint_angles_rad());
    let still = [0.0; MAX_JOINTS];
    let of = |sample: &Sample| {
        let (posture, angles_rad) = (sample.posture(&scene.hand), sample.joint_angles_rad());
        let (hand, held) = (&scene.hand, Held::nothing());
        let stance =
            Stance { hand, posture: &posture, angles_rad: &angles_rad, speeds_rad_s: &still, held: &held };
        let all = |grip| laws.torques(&stance, grip).0;
        let (with, without) = (all(Some(&laws.grip(&latch))), all(None));
        std::array::from_fn(|k| with[k] - without[k])
    };
    Ok(samples.iter().step_by(STRIDE).map(of).collect())
}

/// Pushes the object in the hand, under each law.
pub(super) fn carry(told: &(dyn Fn(&str) + Sync)) -> Result<Vec<Carried>, EvidenceError> {
    let one = |&(law, gain): &(Law, f64)| {
        let mut file = scene(RUN, "hand-arm", &[DURATION.to_owned()])?.file;
        law.set(&mut file.control, gain);
        file.plant.pushes.push(PUSH);
        let scene = built(RUN, file)?;
        let run = simulation(RUN, &scene)?.run();
        told(RUN);
        Carried::of(law, gain, &scene, &run)
    };
    LAWS.par_iter().map(one).collect()
}
