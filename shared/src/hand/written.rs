//! A prepared hand on the wire: the joints and fingertips that it has, and nothing of the capacity.

use super::check::check_counts;
use super::model::{Fingertip, Hand, HandError, PreparedJoint};
use crate::math::Real;
use crate::plain::Number;
use crate::telemetry::List;
use serde::{Deserialize, Serialize, Serializer};

#[derive(Serialize)]
#[serde(bound = "T: Number")]
struct Written<'a, T> {
    joints: &'a [PreparedJoint<T>],
    fingertips: &'a [Fingertip<T>],
}

impl<T: Number, const J: usize, const F: usize> Serialize for Hand<T, J, F> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let joints = self.joints.get(..self.joint_count).unwrap_or(&self.joints);
        let fingertips = self.fingertips.get(..self.fingertip_count).unwrap_or(&self.fingertips);
        Written { joints, fingertips }.serialize(serializer)
    }
}

/// What was [`Written`], before it is known to be a hand.
#[derive(Deserialize)]
#[serde(bound = "T: Number")]
pub(super) struct Read<T, const J: usize, const F: usize> {
    joints: List<PreparedJoint<T>, J>,
    fingertips: List<Fingertip<T>, F>,
}

impl<T: Real, const J: usize, const F: usize> TryFrom<Read<T, J, F>> for Hand<T, J, F> {
    type Error = HandError;

    /// Checks that it is a tree: whoever walks along it comes to an end.
    fn try_from(read: Read<T, J, F>) -> Result<Self, HandError> {
        let (joints, fingertips) = (read.joints.as_slice(), read.fingertips.as_slice());
        check_counts::<J, F>(joints.len(), fingertips.len())?;
        if let Some(joint) = (0..joints.len()).find(|&k| joints[k].parent.is_some_and(|parent| parent >= k)) {
            return Err(HandError::ParentNotBefore { joint });
        }
        if let Some(fingertip) = fingertips.iter().position(|tip| tip.link >= joints.len()) {
            let reason = "has to be the index of a joint";
            return Err(HandError::Fingertip { fingertip, parameter: "link", reason });
        }
        Ok(Self {
            joint_count: joints.len(),
            fingertip_count: fingertips.len(),
            joints: read.joints.filled(),
            fingertips: read.fingertips.filled(),
        })
    }
}
