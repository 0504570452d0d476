//! The torques that an arm feels of each law, while the object is pushed in its hand.

use crate::evidence::{EvidenceError, scene, simulation};
use crate::laws::{Law, Lost, built};
use blindgrasp_body::{Hand, MAX_FINGERS, MAX_JOINTS, Posture};
use blindgrasp_model::Scene;
use blindgrasp_model::file::PushFile;
use blindgrasp_shared::control::{Held, Latch, Laws, Stance};
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
        let arm = arm_joints(&scene.hand);
        let of_the_fingers = (0..scene.hand.joint_count()).filter(|k| !arm.contains(k)).collect::<Vec<_>>();
        let samples = &run.samples;
        let Some(first) = samples.first() else { return Err(EvidenceError::of(RUN, "no samples")) };
        let felt = Felt::of(scene, first)?;
        let torques_nm = |sample: &Sample| felt.torques_nm(&sample.joint_angles_rad(), &Held::nothing());
        let torques: Vec<_> = samples.iter().step_by(STRIDE).map(torques_nm).collect();
        let largest = |joints: &[usize]| {
            let all = torques.iter().flat_map(|torques| joints.iter().map(|&k| torques[k].abs()));
            all.fold(0.0, f64::max)
        };
        let turned = |sample: Option<&Sample>| {
            sample.map_or(f64::NAN, |now| {
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

/// The joints that move every finger.
pub(super) fn arm_joints(hand: &Hand) -> Vec<usize> {
    (0..hand.joint_count()).filter(|&k| (0..hand.fingertip_count()).all(|i| hand.moves(k, i))).collect()
}

/// The law of a scene, from where it grasped.
pub(super) struct Felt<'a> {
    scene: &'a Scene,
    laws: Laws<f64, MAX_JOINTS>,
    pub(super) latch: Latch<f64, MAX_JOINTS, MAX_FINGERS>,
}

impl<'a> Felt<'a> {
    pub(super) fn of(scene: &'a Scene, first: &Sample) -> Result<Self, EvidenceError> {
        let laws = laws(scene).map_err(|cause| EvidenceError::of(&scene.name, cause))?;
        let latch = Latch::of(&scene.hand, &first.posture(&scene.hand), &first.joint_angles_rad());
        Ok(Self { scene, laws, latch })
    }

    pub(super) fn posture(&self, angles_rad: &[f64; MAX_JOINTS]) -> Posture {
        let mut posture = Posture::at_base();
        self.scene.hand.forward_kinematics(angles_rad, &mut posture);
        posture
    }

    /// Returns the torques on the joints besides damping and weight, N m.
    pub(super) fn torques_nm(
        &self,
        angles_rad: &[f64; MAX_JOINTS],
        held: &Held<f64, MAX_FINGERS>,
    ) -> [f64; MAX_JOINTS] {
        let (posture, speeds_rad_s) = (self.posture(angles_rad), [0.0; MAX_JOINTS]);
        let stance = Stance {
            hand: &self.scene.hand,
            posture: &posture,
            angles_rad,
            speeds_rad_s: &speeds_rad_s,
            held,
        };
        let all = |grip| self.laws.torques(&stance, grip).0;
        let (with, without) = (all(Some(&self.laws.grip(&self.latch))), all(None));
        std::array::from_fn(|k| with[k] - without[k])
    }
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
