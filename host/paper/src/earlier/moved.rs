//! The way that what is held goes with the position and attitude controller of ref. 17 beside each law (advantages 4 and 6).

use super::arm::{Felt, arm_joints};
use crate::evidence::{EvidenceError, scene, simulation};
use crate::laws::{Law, Lost, built};
use blindgrasp_body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_model::Scene;
use blindgrasp_model::file::StepFile;
use blindgrasp_shared::control::{Held, Pose};
use blindgrasp_shared::hand::Turn;
use blindgrasp_sim::Run;
use blindgrasp_sim::sample::Sample;
use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use serde::Serialize;

/// A hand, and what is asked of it.
struct Way {
    run: &'static str,
    /// Along x, y and z, mm, and about z, degrees.
    asked: [f64; 4],
    /// Parts of it that are asked for one after the other.
    shares: &'static [f64],
    settings: &'static [&'static str],
    laws: &'static [(Law, f64)],
}

/// The hand-arm with the gains that hold the printed cuboid, and twice the damping, so that it is at rest after each part; and the
/// experiments' hand, whose palm can't move.
const WAYS: [Way; 2] = [
    Way {
        run: "hand-arm",
        asked: [-100.0, 100.0, 141.4, 30.0],
        shares: &SHARES,
        settings: &[
            "control.frame_stiffness_n_m=300",
            "control.frame_turn_stiffness_nm=3",
            "control.frame_damping_s=0.1",
            "control.frame_turn_damping_s=0.1",
            "control.frame_reach_m=0.05",
            "control.carrying_reach_m=0.3",
            "control.damping_scale=2",
        ],
        laws: &super::arm::LAWS,
    },
    Way {
        run: "prism-ideal",
        asked: [10.0, 0.0, 0.0, 20.0],
        shares: &[0.0, 1.0],
        settings: &["control.frame_stiffness_n_m=300", "control.frame_turn_stiffness_nm=0.3"],
        laws: &[(Law::Attitudes, 5e-3), (Law::Integral, 5e-3), (Law::NormalOnly, 0.0)],
    },
];

/// Parts that are asked of the hand-arm.
pub const SHARES: [f64; 4] = [0.0, -0.5, 0.5, 1.0];
/// Time before the first, s, of each of the others, and of the motion at its beginning.
const FIRST_S: f64 = 8.0;
const EACH_S: f64 = 20.0;
const MOTION_S: f64 = 4.0;

/// A distance and an angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Off {
    /// The distance, m.
    pub way_m: f64,
    /// The angle, rad.
    pub turn_rad: f64,
}

impl Off {
    fn between(a: &Pose<f64>, b: &Pose<f64>) -> Self {
        let half = a.turn.inverse().then(&b.turn).shorter().v.norm();
        Self { way_m: (a.way_m - b.way_m).norm(), turn_rad: 2.0 * libm::asin(half.min(1.0)) }
    }
}

/// The end of a part of the way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stop {
    /// The part, of 1.
    pub share: f64,
    /// The frame of the fingertips' centres, off what was asked for.
    pub frame: Off,
    /// The object, off the same.
    pub object: Off,
    /// The largest torque of the frame's pull on a joint of the arm, N m.
    pub arm_pull_nm: f64,
    /// The frame's moment there, N m.
    pub moment_nm: f64,
}

/// A hand that moved what it holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Moved {
    /// The scene.
    pub run: &'static str,
    /// The law, beside that of the frame.
    pub law: Law,
    /// Its gain.
    pub gain: f64,
    /// The loss of the grasp, if there was one.
    pub lost: Option<Lost>,
    /// The end of each part that was reached.
    pub stops: Vec<Stop>,
    /// The motion that was asked for.
    pub asked: Off,
    /// The motion that the arm's joints made of it.
    pub by_arm: Off,
    /// The motion that the fingers' joints made of it.
    pub by_fingers: Off,
    /// The longest way on its face of a point where a fingertip touches, since the grasp began, m.
    pub rolled_m: f64,
    /// Change of a joint's torque by the law, as a part of its largest torque, when the arm alone moves as it did.
    pub changed: f64,
}

impl Moved {
    fn of(way: &Way, (law, gain): (Law, f64), scene: &Scene, run: &Run) -> Result<Self, EvidenceError> {
        let stopped =
            |k: usize| run.samples.iter().rev().find(|sample| sample.t_s <= FIRST_S + EACH_S * k as f64);
        let (Some(first), Some(before), Some(last)) = (run.samples.first(), stopped(0), run.samples.last())
        else {
            return Err(EvidenceError::of(way.run, "no samples"));
        };
        let felt = Felt::of(scene, first)?;
        let seen = Seen { scene, felt: &felt, first };
        let lost = Lost::of(&run.summary);
        let reached = if lost.is_some() { 0 } else { way.shares.len() };
        let stop = |(k, &share): (usize, &f64)| stopped(k).map(|sample| seen.stop(way, share, sample));
        let (angles, mut carried) = (last.joint_angles_rad(), before.joint_angles_rad());
        for k in arm_joints(&scene.hand) {
            carried[k] = angles[k];
        }
        let [from, to] =
            [&before.joint_angles_rad(), &carried].map(|angles| felt.torques_nm(angles, &Held::nothing()));
        let largest =
            |torques: [f64; MAX_JOINTS]| torques.iter().fold(0.0, |most: f64, torque| most.max(torque.abs()));
        let feet = first
            .contacts
            .iter()
            .zip(&last.contacts)
            .map(|(first, last)| (Vector2::from(last.foot_m) - Vector2::from(first.foot_m)).norm());
        let pose = |angles: [f64; MAX_JOINTS]| seen.held(&angles).frame.pose;
        let [begun, by_arm, ended] = [before.joint_angles_rad(), carried, angles].map(pose);
        Ok(Self {
            run: way.run,
            law,
            gain,
            lost,
            stops: way.shares.iter().enumerate().take(reached).filter_map(stop).collect(),
            asked: Off::between(&Pose::latched(), &way.pose(1.0)),
            by_arm: Off::between(&begun, &by_arm),
            by_fingers: Off::between(&by_arm, &ended),
            rolled_m: feet.fold(0.0, f64::max),
            changed: largest(std::array::from_fn(|k| to[k] - from[k])) / largest(from),
        })
    }
}

impl Way {
    fn pose(&self, share: f64) -> Pose<f64> {
        let [x, y, z, turn] = self.asked.map(|value| value * share);
        Pose {
            way_m: Vector3::new(x, y, z) * 1e-3,
            turn: Turn::by(&Vector3::new(0.0, 0.0, turn.to_radians())),
        }
    }

    fn script(&self) -> Vec<StepFile> {
        let step =
            |order: String, at_s: f64| StepFile { order, at_s, within_s: at_s + 1.0, ..StepFile::default() };
        let motion = |(k, &share): (usize, &f64)| {
            let [x, y, z, turn] = self.asked.map(|value| value * share);
            let order = format!("move x_mm={x} y_mm={y} z_mm={z} turn_z_deg={turn} time_s={MOTION_S}");
            step(order, FIRST_S + EACH_S * (k as f64 - 1.0))
        };
        let motions = self.shares.iter().enumerate().skip(1).map(motion);
        std::iter::once(step("grasp".to_owned(), 0.0)).chain(motions).collect()
    }

    fn go(&self, (law, gain): (Law, f64)) -> Result<Moved, EvidenceError> {
        let mut settings: Vec<String> = self.settings.iter().map(|&setting| setting.to_owned()).collect();
        settings
            .extend(["control.carrying_correction_hz=0", "control.carrying_integral_n=0"].map(str::to_owned));
        let mut file = scene(self.run, self.run, &settings)?.file;
        law.set(&mut file.control, gain);
        file.script = self.script();
        file.duration_s = FIRST_S + EACH_S * (self.shares.len() - 1) as f64;
        let scene = built(self.run, file)?;
        let run = simulation(self.run, &scene)?.run();
        Moved::of(self, (law, gain), &scene, &run)
    }
}

/// A grasp, seen from where it began.
struct Seen<'a> {
    scene: &'a Scene,
    felt: &'a Felt<'a>,
    first: &'a Sample,
}

impl Seen<'_> {
    fn held(&self, angles_rad: &[f64; MAX_JOINTS]) -> Held<f64, MAX_FINGERS> {
        let hand = &self.scene.hand;
        Held::at_latch(hand, &self.felt.posture(angles_rad), &self.felt.latch.frame)
    }

    fn stop(&self, way: &Way, share: f64, sample: &Sample) -> Stop {
        let (asked, angles) = (way.pose(share), sample.joint_angles_rad());
        let held = Held { target: asked, target_before: asked, ..self.held(&angles) };
        let count = self.scene.hand.fingertip_count();
        let centres = &self.felt.posture(&self.first.joint_angles_rad()).centres_m;
        let about = self.first.position_m - centres[..count].iter().sum::<Vector3<f64>>() / count as f64;
        let turned = sample.attitude * self.first.attitude.inverse();
        let object = Pose {
            way_m: sample.position_m - self.first.position_m + about - asked.turn.turn(&about),
            turn: Turn { w: turned.w, v: turned.imag() },
        };
        let torques = |held| self.felt.torques_nm(&angles, held);
        let (with, without) = (torques(&held), torques(&Held::nothing()));
        let on_arm = arm_joints(&self.scene.hand).into_iter().map(|k| (with[k] - without[k]).abs());
        let frame = Off::between(&held.frame.pose, &asked);
        Stop {
            share,
            frame,
            object: Off::between(&object, &asked),
            arm_pull_nm: on_arm.fold(0.0, f64::max),
            moment_nm: 2.0 * self.scene.control.gains.frame[1] * libm::sin(0.5 * frame.turn_rad),
        }
    }
}

/// Returns the number of runs.
pub(super) fn runs() -> usize {
    WAYS.iter().map(|way| way.laws.len()).sum()
}

/// Goes every way, under each law.
pub(super) fn go(told: &(dyn Fn(&str) + Sync)) -> Result<Vec<Moved>, EvidenceError> {
    let all: Vec<_> = WAYS.iter().flat_map(|way| way.laws.iter().map(move |law| (way, *law))).collect();
    let one = |&(way, law): &(&Way, (Law, f64))| {
        let moved = way.go(law);
        told(way.run);
        moved
    };
    all.par_iter().with_max_len(1).map(one).collect()
}
