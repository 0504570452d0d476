//! The hand under inspection, as the rules see it.

use crate::hand::is_capsule;
use crate::inspect::finding::{Finding, Severity};
use crate::{HandFile, posture};
use blindgrasp_body::inverse_kinematics::is_trunk;
use blindgrasp_body::{Capsule, Hand, MAX_JOINTS, Posture};
use nalgebra::Vector3;

/// The name of the posture from which the hands that are built in close.
const PRESHAPE: &str = "preshape";

/// The hand under inspection.
pub(super) struct Specimen {
    /// Its file; joints that move no fingertip are left out, and numbers that nothing can be computed with are replaced.
    pub(super) file: HandFile,
    /// The number of each joint in the user's file, from 1.
    pub(super) numbers: Vec<usize>,
    /// Kinematics and masses.
    pub(super) hand: Hand,
    /// Within the limits; zero beyond the hand's joints.
    pub(super) nominal_rad: [f64; MAX_JOINTS],
    /// At the nominal angles.
    pub(super) posture: Posture,
    /// The joints that move one fingertip only, by fingertip, from the base outwards.
    pub(super) own: Vec<Vec<usize>>,
}

impl Specimen {
    pub(super) fn new(file: HandFile, numbers: Vec<usize>, hand: Hand) -> Self {
        let mut nominal_rad = [0.0; MAX_JOINTS];
        for (k, joint) in file.joints.iter().enumerate() {
            let (lower, upper) = hand.range_rad(k);
            nominal_rad[k] = joint.nominal_rad.clamp(lower, upper);
        }
        let own = |i: usize| {
            let mut own: Vec<usize> = hand.joints_to(i).filter(|&k| !is_trunk(&hand, k)).collect();
            own.reverse();
            own
        };
        let own = (0..hand.fingertip_count()).map(own).collect();
        let posture = posture(&hand, &nominal_rad);
        Self { file, numbers, hand, nominal_rad, posture, own }
    }

    /// The posture from which it closes, and its name: its posture `preshape`, or without one the nominal one.
    pub(super) fn closing_posture(&self) -> (&'static str, Posture) {
        match self.file.postures.iter().find(|named| named.name == PRESHAPE) {
            Some(preshape) => ("posture `preshape`", posture(&self.hand, &preshape.angles_rad)),
            None => ("the nominal posture", self.posture.clone()),
        }
    }

    /// Its surfaces, as far as their numbers can be used.
    pub(super) fn capsules(&self) -> Vec<Capsule> {
        let mut capsules = self.file.capsules(&self.hand);
        capsules.retain(|capsule| is_capsule(&capsule.ends_m, capsule.radius_m));
        capsules
    }

    pub(super) fn fingers(&self) -> usize {
        self.own.len()
    }

    pub(super) fn joints(&self) -> usize {
        self.hand.joint_count()
    }

    pub(super) fn joint_key(&self, joint: usize, key: &str) -> String {
        format!("joint.{}.{key}", self.numbers[joint])
    }

    /// A finding about a joint.
    pub(super) fn on_joint(
        &self,
        severity: Severity,
        (joint, key): (usize, &str),
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Finding {
        Finding::new(severity, what, remedy)
            .about(format!("joint `{}`", self.file.joints[joint].name))
            .key(self.joint_key(joint, key))
    }

    /// A finding about a fingertip.
    pub(super) fn on_fingertip(
        &self,
        severity: Severity,
        (fingertip, key): (usize, &str),
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Finding {
        Finding::new(severity, what, remedy)
            .about(format!("fingertip `{}`", self.file.fingertips[fingertip].name))
            .key(format!("fingertip.{}.{key}", fingertip + 1))
    }

    /// The only fingertip that a joint moves; `None` for a joint of the trunk.
    pub(super) fn finger_of(&self, joint: usize) -> Option<usize> {
        self.own.iter().position(|own| own.contains(&joint))
    }

    /// Returns the beginning of a finger at the nominal posture, m: its first own joint, or its fingertip where it has
    /// none.
    pub(super) fn base_m(&self, fingertip: usize) -> Vector3<f64> {
        match self.own[fingertip].first() {
            Some(&first) => self.posture.link(first).origin_m,
            None => self.posture.centres_m[fingertip],
        }
    }

    /// The bones of a finger, m: between its own joints, and to the centre of its fingertip.
    pub(super) fn bones_m(&self, fingertip: usize) -> Vec<f64> {
        let own = &self.own[fingertip];
        if own.is_empty() {
            return Vec::new();
        }
        let between = own.iter().skip(1).map(|&k| self.hand.offset_m(k).norm());
        between.chain([self.hand.prepared_fingertips()[fingertip].offset_m.norm()]).collect()
    }

    /// From the first own joint of a finger to the centre of its fingertip along the bones, m.
    pub(super) fn finger_length_m(&self, fingertip: usize) -> f64 {
        self.bones_m(fingertip).iter().sum()
    }

    /// The middle one of all bones of all fingers that have a length, m.
    pub(super) fn typical_bone_m(&self) -> f64 {
        let mut bones: Vec<f64> = (0..self.fingers()).flat_map(|i| self.bones_m(i)).collect();
        bones.retain(|bone| *bone > 0.0);
        bones.sort_by(f64::total_cmp);
        bones.get(bones.len() / 2).copied().unwrap_or(0.0)
    }

    /// No fingertip's centre gets farther from the base's origin than this, m: all bones in line.
    pub(super) fn span_m(&self) -> f64 {
        let along = |i: usize| {
            let bones: f64 = self.hand.joints_to(i).map(|k| self.hand.offset_m(k).norm()).sum();
            bones + self.hand.prepared_fingertips()[i].offset_m.norm()
        };
        (0..self.fingers()).map(along).fold(0.0, f64::max)
    }

    /// The mean radius of the fingertips, m.
    pub(super) fn mean_radius_m(&self) -> f64 {
        (0..self.fingers()).map(|i| self.hand.radius_m(i)).sum::<f64>() / self.fingers() as f64
    }

    /// The posture with all joints at zero, or as near as their limits allow; the trunk stays at its nominal angles.
    pub(super) fn stretched(&self) -> Posture {
        let mut angles = self.nominal_rad;
        for &k in self.own.iter().flatten() {
            let (lower, upper) = self.hand.range_rad(k);
            angles[k] = f64::clamp(0.0, lower, upper);
        }
        posture(&self.hand, &angles)
    }

    /// The middle of the fingertips' centres, `x_c` of Eq. 31, m.
    pub(super) fn middle_m(&self, posture: &Posture) -> Vector3<f64> {
        posture.centres_m[..self.fingers()].iter().sum::<Vector3<f64>>() / self.fingers() as f64
    }

    /// Returns how directly a joint moves its fingertip towards the middle of all of them: the cosine between the
    /// fingertip's velocity and the way there, 1 for a joint that closes the hand when it turns in its positive sense,
    /// -1 for one that opens it; 0 where there is no way to go.
    pub(super) fn closing(&self, posture: &Posture, joint: usize) -> f64 {
        let Some(finger) = self.finger_of(joint) else { return 0.0 };
        let (tip, pose) = (posture.centres_m[finger], posture.link(joint));
        let velocity = pose.axis().cross(&(tip - pose.origin_m));
        let way = self.middle_m(posture) - tip;
        let size = velocity.norm() * way.norm();
        if size > 1e-9 * self.span_m() * self.span_m() { velocity.dot(&way) / size } else { 0.0 }
    }
}
