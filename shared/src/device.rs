//! What the tick is given of the joints.

use crate::fault::Raised;

/// What was read of the joints in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading<const J: usize> {
    /// The encoder count of every joint.
    Counts([i32; J]),
    /// A joint could not be read or driven.
    Failed(Raised),
}
