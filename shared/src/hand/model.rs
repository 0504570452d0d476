//! A hand: joints, links and fingertips, checked and prepared once.

use super::check::{check_counts, check_fingertip, check_joint};
use crate::array::{self, Item};
use crate::math::{Real, norm};
use core::fmt;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// A rigid link, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Real")]
pub struct Link<T> {
    /// Mass, kg; zero for a link whose mass is counted in another.
    pub mass_kg: T,
    /// Centre of mass, m.
    pub mass_centre_m: Vector3<T>,
    /// Inertia tensor about the centre of mass, kg m^2; symmetric.
    pub inertia_kg_m2: Matrix3<T>,
}

/// A revolute joint and the link that it carries, as a user describes them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint<T> {
    /// Index of the parent link's joint, smaller than this joint's own; `None` for the base.
    pub parent: Option<usize>,
    /// Position of the joint (and of the origin of its link frame) in the parent's link frame, m.
    pub offset_m: Vector3<T>,
    /// Axes of the link frame at zero angle, in the parent's link frame; a rotation.
    pub attitude: Matrix3<T>,
    /// Direction of the axis in the link frame; a unit vector.
    pub axis: Vector3<T>,
    /// Lower end stop, rad.
    pub lower_rad: T,
    /// Upper end stop, rad.
    pub upper_rad: T,
    /// The link that turns with the joint.
    pub link: Link<T>,
}

/// A hemispherical fingertip.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Real")]
pub struct Fingertip<T> {
    /// Index of the link that it is part of.
    pub link: usize,
    /// Centre of its sphere in the link frame, m.
    pub offset_m: Vector3<T>,
    /// Radius `r_i`, m.
    pub radius_m: T,
}

/// An error in the description of a hand. The message names the joint or fingertip by its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandError {
    /// The hand has no joint.
    NoJoints,
    /// The hand has fewer than two fingertips, and nothing to press against.
    TooFewFingertips {
        /// Their number.
        count: usize,
    },
    /// More joints than the capacity.
    TooManyJoints {
        /// Their number.
        count: usize,
        /// The most that there may be.
        capacity: usize,
    },
    /// More fingertips than the capacity.
    TooManyFingertips {
        /// Their number.
        count: usize,
        /// The most that there may be.
        capacity: usize,
    },
    /// A joint's parent does not come before it.
    ParentNotBefore {
        /// The joint.
        joint: usize,
    },
    /// A joint's parameter is not what it has to be.
    Joint {
        /// The joint.
        joint: usize,
        /// The parameter.
        parameter: &'static str,
        /// The requirement.
        reason: &'static str,
    },
    /// A joint moves no fingertip.
    MovesNoFingertip {
        /// The joint.
        joint: usize,
    },
    /// A fingertip's parameter is not what it has to be.
    Fingertip {
        /// The fingertip.
        fingertip: usize,
        /// The parameter.
        parameter: &'static str,
        /// The requirement.
        reason: &'static str,
    },
}

impl fmt::Display for HandError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoJoints => write!(f, "the hand has no joint"),
            Self::TooFewFingertips { count } => {
                write!(f, "the hand has {count} fingertips: grasping needs at least two")
            }
            Self::TooManyJoints { count, capacity } => {
                write!(f, "the hand has {count} joints: at most {capacity} are supported")
            }
            Self::TooManyFingertips { count, capacity } => {
                write!(f, "the hand has {count} fingertips: at most {capacity} are supported")
            }
            Self::ParentNotBefore { joint } => {
                write!(f, "joint {joint}: its parent has to come before it")
            }
            Self::Joint { joint, parameter, reason } => write!(f, "joint {joint}: {parameter} {reason}"),
            Self::MovesNoFingertip { joint } => {
                write!(f, "joint {joint}: moves no fingertip; leave it out and add its mass to its parent")
            }
            Self::Fingertip { fingertip, parameter, reason } => {
                write!(f, "fingertip {fingertip}: {parameter} {reason}")
            }
        }
    }
}

impl core::error::Error for HandError {}

/// The attitude of the axes of a planar chain against those of the link that it starts from, by the angles of Denavit
/// and Hartenberg: turned about z until x is the common normal of both joint axes, then twisted about x.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Real")]
pub struct Bend<T> {
    /// Sine of the turn.
    pub turn_sine: T,
    /// Cosine of the turn.
    pub turn_cosine: T,
    /// Sine of the twist.
    pub twist_sine: T,
    /// Cosine of the twist.
    pub twist_cosine: T,
}

/// A joint as the kinematics wants it: its link frame is chosen such that the joint turns about the local z axis.
///
/// A joint that follows its parent in the list and has a parallel axis continues the parent's **planar chain**: its frame
/// at zero angle is the parent's. All other joints start a chain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Real")]
pub struct PreparedJoint<T> {
    /// Index of the parent link's joint, smaller than this joint's own; `None` for the base.
    pub parent: Option<usize>,
    /// The start of a chain; `None` for a joint that continues the chain of the joint before it, its parent.
    pub bend: Option<Bend<T>>,
    /// From the parent's origin to this joint's, in the prepared frame at zero angle, m.
    pub offset_m: Vector3<T>,
    /// Prepared frame in the link frame of the description.
    pub from_link: Matrix3<T>,
    /// Lower end stop, rad.
    pub lower_rad: T,
    /// Upper end stop, rad.
    pub upper_rad: T,
    /// The link that turns with the joint, in the prepared frame.
    pub link: Link<T>,
    /// First moment about the joint of its **augmented body**, kg m: of the link, with the mass of everything further
    /// out lumped where the next joints sit.
    pub first_moment_kg_m: Vector3<T>,
}

/// A hand, checked and prepared: at most `J` joints and `F` fingertips.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Real", try_from = "Parts<T, J, F>")]
pub struct Hand<T, const J: usize, const F: usize> {
    #[serde(skip)]
    pub(super) joint_count: usize,
    #[serde(skip)]
    pub(super) fingertip_count: usize,
    #[serde(with = "crate::array")]
    pub(super) joints: [PreparedJoint<T>; J],
    #[serde(with = "crate::array")]
    pub(super) fingertips: [Fingertip<T>; F],
}

/// The parts of a hand that are written. What was computed is believed when it is read, the tree is checked.
#[derive(Deserialize)]
#[serde(bound = "T: Real")]
struct Parts<T, const J: usize, const F: usize> {
    #[serde(with = "crate::array")]
    joints: [PreparedJoint<T>; J],
    #[serde(with = "crate::array")]
    fingertips: [Fingertip<T>; F],
}

#[inline(never)]
fn check_tree<T: Real>(joints: &[PreparedJoint<T>], fingertips: &[Fingertip<T>]) -> Result<(), HandError> {
    for (k, joint) in joints.iter().enumerate() {
        if joint.parent.is_some_and(|parent| parent >= k) {
            return Err(HandError::ParentNotBefore { joint: k });
        }
        if joint.bend.is_none() && joint.parent.is_none_or(|parent| parent + 1 != k) {
            let reason = "has to be given where the joint before is not the parent";
            return Err(HandError::Joint { joint: k, parameter: "bend", reason });
        }
    }
    match fingertips.iter().position(|fingertip| fingertip.link >= joints.len()) {
        Some(fingertip) => {
            let reason = "has to be the index of a joint";
            Err(HandError::Fingertip { fingertip, parameter: "link", reason })
        }
        None => Ok(()),
    }
}

impl<T: Real, const J: usize, const F: usize> TryFrom<Parts<T, J, F>> for Hand<T, J, F> {
    type Error = HandError;

    fn try_from(parts: Parts<T, J, F>) -> Result<Self, HandError> {
        let Parts { joints, fingertips } = parts;
        let (joint_count, fingertip_count) = (array::count(&joints), array::count(&fingertips));
        check_counts::<J, F>(joint_count, fingertip_count)?;
        check_tree(&joints[..joint_count], &fingertips[..fingertip_count])?;
        Ok(Self { joint_count, fingertip_count, joints, fingertips })
    }
}

impl<T: Real, const J: usize, const F: usize> Hand<T, J, F> {
    /// Checks a description and prepares it.
    ///
    /// # Errors
    /// The first thing that is wrong, with the joint or fingertip that it is wrong with.
    pub fn new(joints: &[Joint<T>], fingertips: &[Fingertip<T>]) -> Result<Self, HandError> {
        check_counts::<J, F>(joints.len(), fingertips.len())?;
        let mut hand = Self {
            joint_count: joints.len(),
            fingertip_count: fingertips.len(),
            joints: [PreparedJoint::still(); J],
            fingertips: [no_fingertip(); F],
        };
        // Mass of everything that a joint carries, kg.
        let mut carried_kg = [T::zero(); J];
        for (k, joint) in joints.iter().enumerate() {
            check_joint(k, joint)?;
            let parent = match joint.parent {
                Some(parent) if parent >= k => return Err(HandError::ParentNotBefore { joint: k }),
                parent => parent.map(|parent| &hand.joints[parent]),
            };
            hand.joints[k] = PreparedJoint::new(k, joint, parent);
            carried_kg[k] = joint.link.mass_kg;
        }
        for (k, joint) in joints.iter().enumerate().rev() {
            if let Some(parent) = joint.parent {
                let below = &mut hand.joints[parent];
                let offset_m = below.from_link.transpose() * joint.offset_m;
                let carried = carried_kg[k];
                below.first_moment_kg_m += offset_m * carried;
                carried_kg[parent] += carried;
            }
        }
        for (i, fingertip) in fingertips.iter().enumerate() {
            check_fingertip(i, fingertip, joints.len())?;
            let from_link = &hand.joints[fingertip.link].from_link;
            hand.fingertips[i] =
                Fingertip { offset_m: from_link.transpose() * fingertip.offset_m, ..*fingertip };
        }
        match (0..hand.joint_count).find(|&k| !(0..hand.fingertip_count).any(|i| hand.moves(k, i))) {
            Some(joint) => Err(HandError::MovesNoFingertip { joint }),
            None => Ok(hand),
        }
    }

    /// The joints as they were prepared.
    pub fn prepared_joints(&self) -> &[PreparedJoint<T>] {
        &self.joints[..self.joint_count.min(J)]
    }

    /// The fingertips as they were prepared: their offsets are in the prepared frames of their links.
    pub fn prepared_fingertips(&self) -> &[Fingertip<T>] {
        &self.fingertips[..self.fingertip_count.min(F)]
    }

    /// The same hand in another scalar: prepared in `f64`, used in `f32`.
    pub fn cast<U: Real>(&self) -> Hand<U, J, F> {
        Hand {
            joint_count: self.joint_count,
            fingertip_count: self.fingertip_count,
            joints: self.joints.map(|joint| joint.cast()),
            fingertips: self.fingertips.map(|fingertip| Fingertip {
                link: fingertip.link,
                offset_m: cast(&fingertip.offset_m),
                radius_m: U::from_f64(fingertip.radius_m.to_f64()),
            }),
        }
    }

    /// The same hand in another capacity: exact sizes for firmware.
    ///
    /// # Errors
    /// It does not fit.
    pub fn fit<const K: usize, const G: usize>(&self) -> Result<Hand<T, K, G>, HandError> {
        check_counts::<K, G>(self.joint_count, self.fingertip_count)?;
        Ok(Hand {
            joint_count: self.joint_count,
            fingertip_count: self.fingertip_count,
            joints: core::array::from_fn(|k| {
                self.joints.get(k).copied().unwrap_or_else(PreparedJoint::still)
            }),
            fingertips: core::array::from_fn(|i| {
                self.fingertips.get(i).copied().unwrap_or_else(no_fingertip)
            }),
        })
    }

    /// Number of joints.
    pub fn joint_count(&self) -> usize {
        self.joint_count
    }

    /// Number of fingertips.
    pub fn fingertip_count(&self) -> usize {
        self.fingertip_count
    }

    /// The joint on whose link a joint sits; `None` for the base or for a joint that the hand has not.
    pub fn parent(&self, joint: usize) -> Option<usize> {
        self.joints.get(joint).and_then(|joint| joint.parent)
    }

    /// Lower and upper end stop of a joint, rad.
    pub fn range_rad(&self, joint: usize) -> (T, T) {
        self.joints.get(joint).map_or((T::zero(), T::zero()), |joint| (joint.lower_rad, joint.upper_rad))
    }

    /// Link that a fingertip is part of.
    pub fn fingertip_link(&self, fingertip: usize) -> usize {
        self.fingertips.get(fingertip).map_or(0, |fingertip| fingertip.link)
    }

    /// Radius `r_i` of a fingertip, m.
    pub fn radius_m(&self, fingertip: usize) -> T {
        self.fingertips.get(fingertip).map_or(T::zero(), |fingertip| fingertip.radius_m)
    }

    /// A link, in its prepared frame (the one of [`LinkPose::attitude`](super::LinkPose)).
    pub fn link(&self, joint: usize) -> Link<T> {
        self.joints.get(joint).map_or(PreparedJoint::still().link, |joint| joint.link)
    }

    /// The bone from the parent's joint to a joint, in the joint's prepared frame at zero angle, m.
    pub fn offset_m(&self, joint: usize) -> Vector3<T> {
        self.joints.get(joint).map_or(Vector3::zeros(), |joint| joint.offset_m)
    }

    /// Returns `true` if a joint lies between the base and a fingertip.
    pub fn moves(&self, joint: usize, fingertip: usize) -> bool {
        self.joints_to(fingertip).any(|k| k == joint)
    }

    /// The joints between a fingertip and the base, from the fingertip down.
    pub fn joints_to(&self, fingertip: usize) -> impl Iterator<Item = usize> + '_ {
        let first = self.fingertips[..self.fingertip_count.min(F)].get(fingertip).map(|tip| tip.link);
        core::iter::successors(first, |&joint| self.parent(joint))
    }
}

impl<T: Real> Item for PreparedJoint<T> {
    fn filler() -> Self {
        Self::still()
    }

    // A joint that is there has a bend or a parent.
    fn is_filler(&self) -> bool {
        self.bend.is_none() && self.parent.is_none()
    }
}

impl<T: Real> Item for Fingertip<T> {
    fn filler() -> Self {
        no_fingertip()
    }

    // The radius of one that is there is positive.
    fn is_filler(&self) -> bool {
        self.radius_m == T::zero()
    }
}

impl<T: Real> PreparedJoint<T> {
    /// A joint that is not there: fills the unused capacity.
    fn still() -> Self {
        Self {
            parent: None,
            bend: None,
            offset_m: Vector3::zeros(),
            from_link: Matrix3::identity(),
            lower_rad: T::zero(),
            upper_rad: T::zero(),
            link: Link {
                mass_kg: T::zero(),
                mass_centre_m: Vector3::zeros(),
                inertia_kg_m2: Matrix3::zeros(),
            },
            first_moment_kg_m: Vector3::zeros(),
        }
    }

    /// Joint `k`, on its parent.
    fn new(k: usize, joint: &Joint<T>, parent: Option<&Self>) -> Self {
        let parent_from_link = parent.map_or(Matrix3::identity(), |parent| parent.from_link);
        let to_parent = parent_from_link.transpose();
        let axis = to_parent * (joint.attitude * joint.axis);
        let axis = axis / norm(&axis);
        let follows = joint.parent.is_some_and(|parent| parent + 1 == k);
        let bend = if follows && is_z(&axis) { None } else { Some(Bend::to(&axis)) };
        let attitude = bend.map_or(Matrix3::identity(), |bend| bend.axes());
        let from_link = joint.attitude.transpose() * parent_from_link * attitude;
        let mass_centre_m = from_link.transpose() * joint.link.mass_centre_m;
        Self {
            parent: joint.parent,
            bend,
            offset_m: attitude.transpose() * (to_parent * joint.offset_m),
            from_link,
            lower_rad: joint.lower_rad,
            upper_rad: joint.upper_rad,
            link: Link {
                mass_kg: joint.link.mass_kg,
                mass_centre_m,
                inertia_kg_m2: from_link.transpose() * joint.link.inertia_kg_m2 * from_link,
            },
            first_moment_kg_m: mass_centre_m * joint.link.mass_kg,
        }
    }

    fn cast<U: Real>(&self) -> PreparedJoint<U> {
        PreparedJoint {
            parent: self.parent,
            bend: self.bend.map(|bend| bend.cast()),
            offset_m: cast(&self.offset_m),
            from_link: self.from_link.map(|v| U::from_f64(v.to_f64())),
            lower_rad: U::from_f64(self.lower_rad.to_f64()),
            upper_rad: U::from_f64(self.upper_rad.to_f64()),
            link: Link {
                mass_kg: U::from_f64(self.link.mass_kg.to_f64()),
                mass_centre_m: cast(&self.link.mass_centre_m),
                inertia_kg_m2: self.link.inertia_kg_m2.map(|v| U::from_f64(v.to_f64())),
            },
            first_moment_kg_m: cast(&self.first_moment_kg_m),
        }
    }
}

/// A fingertip that is not there: fills the unused capacity.
fn no_fingertip<T: Real>() -> Fingertip<T> {
    Fingertip { link: 0, offset_m: Vector3::zeros(), radius_m: T::zero() }
}

fn cast<T: Real, U: Real>(v: &Vector3<T>) -> Vector3<U> {
    v.map(|v| U::from_f64(v.to_f64()))
}

/// Returns `true` if a unit vector is z, but for rounding: axes that a file gives as parallel differ by some once they
/// went through a rotation or two.
fn is_z<T: Real>(axis: &Vector3<T>) -> bool {
    let rounding = T::from_f64(if T::from_f64(1.0 + 1e-9) == T::one() { 1e-6 } else { 1e-14 });
    axis.z > T::zero() && axis.x.magnitude() <= rounding && axis.y.magnitude() <= rounding
}

impl<T: Real> Bend<T> {
    /// The bend that takes z to `axis`, a unit vector.
    fn to(axis: &Vector3<T>) -> Self {
        let across = norm(&Vector3::new(axis.x, axis.y, T::zero()));
        let (turn_sine, turn_cosine) = if across > T::zero() {
            (axis.x / across, -axis.y / across)
        } else {
            // Parallel axes have many common normals.
            (T::zero(), T::one())
        };
        Self { turn_sine, turn_cosine, twist_sine: across, twist_cosine: axis.z }
    }

    fn cast<U: Real>(&self) -> Bend<U> {
        let cast = |v: T| U::from_f64(v.to_f64());
        Bend {
            turn_sine: cast(self.turn_sine),
            turn_cosine: cast(self.turn_cosine),
            twist_sine: cast(self.twist_sine),
            twist_cosine: cast(self.twist_cosine),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Pair = ([PreparedJoint<f32>; 3], [Fingertip<f32>; 2]);

    /// Two fingers, one of two joints.
    fn pair() -> Pair {
        let bend = Some(Bend::to(&Vector3::x()));
        let joint = |parent: Option<usize>| PreparedJoint {
            parent,
            bend: bend.filter(|_| parent.is_none()),
            ..PreparedJoint::still()
        };
        let fingertip = |link| Fingertip { link, offset_m: Vector3::zeros(), radius_m: 0.01 };
        ([joint(None), joint(Some(0)), joint(None)], [fingertip(1), fingertip(2)])
    }

    #[test]
    fn a_prepared_hand_is_the_hand_that_was_prepared() {
        let (joints, fingertips) = pair();
        let hand = Hand::try_from(Parts { joints, fingertips }).unwrap();
        assert_eq!((hand.joint_count(), hand.fingertip_count()), (3, 2));
        assert_eq!((hand.prepared_joints(), hand.prepared_fingertips()), (&joints[..], &fingertips[..]));
        let larger: Hand<f32, 7, 4> = hand.fit().unwrap();
        let Hand { joints, fingertips, .. } = larger.clone();
        assert_eq!(Hand::try_from(Parts { joints, fingertips }), Ok(larger), "with room to spare");
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        let refused = |change: fn(&mut Pair)| {
            let mut pair = pair();
            change(&mut pair);
            let (joints, fingertips) = pair;
            Hand::try_from(Parts { joints, fingertips }).unwrap_err()
        };
        let error = refused(|(joints, _)| joints[1].parent = Some(1));
        assert_eq!(error, HandError::ParentNotBefore { joint: 1 });
        let error = refused(|(joints, _)| (joints[2].parent, joints[2].bend) = (Some(0), None));
        assert!(matches!(error, HandError::Joint { joint: 2, parameter: "bend", .. }));
        let error = refused(|(_, fingertips)| fingertips[1].link = 3);
        assert!(matches!(error, HandError::Fingertip { fingertip: 1, parameter: "link", .. }));
        let error = refused(|(_, fingertips)| fingertips[1] = no_fingertip());
        assert_eq!(error, HandError::TooFewFingertips { count: 1 });
        let error = refused(|(joints, _)| *joints = [PreparedJoint::still(); 3]);
        assert_eq!(error, HandError::NoJoints);
    }
}
