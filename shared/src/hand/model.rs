//! What a hand is: joints, links and fingertips, checked and prepared once.

use super::check::{check_counts, check_fingertip, check_joint};
use crate::math::{Real, norm};
use core::fmt;
use nalgebra::{Matrix3, Vector3};

/// A rigid link, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// Where the joint (and the origin of its link frame) sits in the parent's link frame, m.
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fingertip<T> {
    /// Index of the link that it is part of.
    pub link: usize,
    /// Centre of its sphere in the link frame, m.
    pub offset_m: Vector3<T>,
    /// Radius `r_i`, m.
    pub radius_m: T,
}

/// Why a description is not a hand. The message names the joint or fingertip by its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandError {
    /// The hand has no joint.
    NoJoints,
    /// The hand has fewer than two fingertips, and nothing to press against.
    TooFewFingertips {
        /// How many there are.
        count: usize,
    },
    /// More joints than the capacity.
    TooManyJoints {
        /// How many there are.
        count: usize,
        /// How many there may be.
        capacity: usize,
    },
    /// More fingertips than the capacity.
    TooManyFingertips {
        /// How many there are.
        count: usize,
        /// How many there may be.
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
        /// What it has to be.
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
        /// What it has to be.
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

/// A joint as the kinematics wants it: its link frame is chosen such that the joint turns about the local z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreparedJoint<T> {
    /// Index of the parent link's joint, smaller than this joint's own; `None` for the base.
    pub parent: Option<usize>,
    /// Joint origin in the parent's prepared frame, m.
    pub offset_m: Vector3<T>,
    /// Prepared frame at zero angle in the parent's prepared frame; `None` where the two axes are parallel, because the
    /// frame is then chosen to be the parent's, and forward kinematics saves a product.
    pub attitude: Option<Matrix3<T>>,
    /// Prepared frame in the link frame of the description.
    pub from_link: Matrix3<T>,
    /// Lower end stop, rad.
    pub lower_rad: T,
    /// Upper end stop, rad.
    pub upper_rad: T,
    /// The link that turns with the joint, in the prepared frame.
    pub link: Link<T>,
    /// Mass of the link times its centre, kg m.
    pub first_moment_kg_m: Vector3<T>,
    /// Mass of everything that the joint carries, kg.
    pub carried_kg: T,
}

/// A hand, checked and prepared: at most `J` joints and `F` fingertips.
#[derive(Clone, Debug, PartialEq)]
pub struct Hand<T, const J: usize, const F: usize> {
    pub(super) joint_count: usize,
    pub(super) fingertip_count: usize,
    pub(super) joints: [PreparedJoint<T>; J],
    pub(super) fingertips: [Fingertip<T>; F],
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
        for (k, joint) in joints.iter().enumerate() {
            check_joint(k, joint)?;
            let parent_from_link = match joint.parent {
                Some(parent) if parent >= k => return Err(HandError::ParentNotBefore { joint: k }),
                Some(parent) => hand.joints[parent].from_link,
                None => Matrix3::identity(),
            };
            hand.joints[k] = PreparedJoint::new(joint, &parent_from_link);
        }
        for k in (0..hand.joint_count).rev() {
            if let Some(parent) = hand.joints[k].parent {
                let carried_kg = hand.joints[k].carried_kg;
                hand.joints[parent].carried_kg += carried_kg;
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

    /// A hand of exact size from what [`Self::prepared_joints`] and [`Self::prepared_fingertips`] gave, as a constant: the
    /// host prepares a hand, the firmware is built with the result. What was computed is believed, the tree is checked.
    ///
    /// # Errors
    /// No joint, fewer than two fingertips, a parent that does not come before its joint, or a fingertip on no link.
    pub const fn from_prepared(
        joints: [PreparedJoint<T>; J],
        fingertips: [Fingertip<T>; F],
    ) -> Result<Self, HandError> {
        if J == 0 {
            return Err(HandError::NoJoints);
        }
        if F < 2 {
            return Err(HandError::TooFewFingertips { count: F });
        }
        let mut joint = 0;
        while joint < J {
            if let Some(parent) = joints[joint].parent
                && parent >= joint
            {
                return Err(HandError::ParentNotBefore { joint });
            }
            joint += 1;
        }
        let mut fingertip = 0;
        while fingertip < F {
            if fingertips[fingertip].link >= J {
                let reason = "has to be the index of a joint";
                return Err(HandError::Fingertip { fingertip, parameter: "link", reason });
            }
            fingertip += 1;
        }
        Ok(Self { joint_count: J, fingertip_count: F, joints, fingertips })
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

    /// Where a joint sits in its parent's prepared frame, m: the bone between the two.
    pub fn offset_m(&self, joint: usize) -> Vector3<T> {
        self.joints.get(joint).map_or(Vector3::zeros(), |joint| joint.offset_m)
    }

    /// Whether a joint lies between the base and a fingertip.
    pub fn moves(&self, joint: usize, fingertip: usize) -> bool {
        self.joints_to(fingertip).any(|k| k == joint)
    }

    /// The joints between a fingertip and the base, from the fingertip down.
    pub fn joints_to(&self, fingertip: usize) -> impl Iterator<Item = usize> + '_ {
        let first = self.fingertips[..self.fingertip_count.min(F)].get(fingertip).map(|tip| tip.link);
        core::iter::successors(first, |&joint| self.parent(joint))
    }
}

impl<T: Real> PreparedJoint<T> {
    /// A joint that is not there: fills the unused capacity.
    fn still() -> Self {
        Self {
            parent: None,
            offset_m: Vector3::zeros(),
            attitude: None,
            from_link: Matrix3::identity(),
            lower_rad: T::zero(),
            upper_rad: T::zero(),
            link: Link {
                mass_kg: T::zero(),
                mass_centre_m: Vector3::zeros(),
                inertia_kg_m2: Matrix3::zeros(),
            },
            first_moment_kg_m: Vector3::zeros(),
            carried_kg: T::zero(),
        }
    }

    fn new(joint: &Joint<T>, parent_from_link: &Matrix3<T>) -> Self {
        let to_parent = parent_from_link.transpose();
        let axis = to_parent * (joint.attitude * joint.axis);
        let axis = axis / norm(&axis);
        let attitude = rotation_from_z(&axis);
        let from_link =
            joint.attitude.transpose() * parent_from_link * attitude.unwrap_or(Matrix3::identity());
        let mass_centre_m = from_link.transpose() * joint.link.mass_centre_m;
        Self {
            parent: joint.parent,
            offset_m: to_parent * joint.offset_m,
            attitude,
            from_link,
            lower_rad: joint.lower_rad,
            upper_rad: joint.upper_rad,
            link: Link {
                mass_kg: joint.link.mass_kg,
                mass_centre_m,
                inertia_kg_m2: from_link.transpose() * joint.link.inertia_kg_m2 * from_link,
            },
            first_moment_kg_m: mass_centre_m * joint.link.mass_kg,
            carried_kg: joint.link.mass_kg,
        }
    }

    fn cast<U: Real>(&self) -> PreparedJoint<U> {
        PreparedJoint {
            parent: self.parent,
            offset_m: cast(&self.offset_m),
            attitude: self.attitude.map(|attitude| attitude.map(|v| U::from_f64(v.to_f64()))),
            from_link: self.from_link.map(|v| U::from_f64(v.to_f64())),
            lower_rad: U::from_f64(self.lower_rad.to_f64()),
            upper_rad: U::from_f64(self.upper_rad.to_f64()),
            link: Link {
                mass_kg: U::from_f64(self.link.mass_kg.to_f64()),
                mass_centre_m: cast(&self.link.mass_centre_m),
                inertia_kg_m2: self.link.inertia_kg_m2.map(|v| U::from_f64(v.to_f64())),
            },
            first_moment_kg_m: cast(&self.first_moment_kg_m),
            carried_kg: U::from_f64(self.carried_kg.to_f64()),
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

/// The smallest rotation that takes z to `axis`; `None` where that is no rotation at all.
fn rotation_from_z<T: Real>(axis: &Vector3<T>) -> Option<Matrix3<T>> {
    let one = T::one();
    let c = axis.z;
    if c < T::zero() {
        // Half a turn about x first, so that the formula below stays far from its singularity at -z.
        let flip = Matrix3::from_diagonal(&Vector3::new(one, -one, -one));
        return Some(flip * rotation_from_z(&(flip * axis)).unwrap_or(Matrix3::identity()));
    }
    let (x, y) = (axis.x, axis.y);
    // Axes that a file gives as parallel differ by rounding once they went through a rotation or two.
    let rounding = T::from_f64(if T::from_f64(1.0 + 1e-9) == one { 1e-6 } else { 1e-14 });
    if x.magnitude() <= rounding && y.magnitude() <= rounding {
        return None;
    }
    let k = one / (one + c);
    Some(Matrix3::new(one - x * x * k, -x * y * k, x, -x * y * k, one - y * y * k, y, -x, -y, c))
}
