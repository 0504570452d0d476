//! A hand with its configuration as bytes: what the build puts into a firmware image, and what its start reads.

use super::Config;
use crate::hand::Hand;
use crate::telemetry::BufferTooSmall;
use core::fmt;
use serde::{Deserialize, Serialize};

/// A hand and how it is controlled.
///
/// Its bytes are postcard and do not depend on the capacities: what a host of large capacity writes, a firmware of exact
/// size reads, and to the bit. What they say is checked by [`Params::new`](super::Params::new).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model<const J: usize, const F: usize> {
    /// The hand, prepared.
    pub hand: Hand<f32, J, F>,
    /// Gains, limits, times.
    pub config: Config<f32, J>,
}

/// Why bytes are not a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelError {
    /// They end too early, or hold what no model holds, or a hand that is larger than the capacity.
    Malformed,
    /// There are more of them than the model has.
    TrailingBytes,
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Malformed => write!(f, "the bytes are no model of a hand of this size"),
            Self::TrailingBytes => write!(f, "there are bytes after the model"),
        }
    }
}

impl core::error::Error for ModelError {}

impl<const J: usize, const F: usize> Model<J, F> {
    /// Writes the model into a buffer and returns the part that was written: about 180 bytes a joint.
    ///
    /// # Errors
    /// If the buffer is too small.
    pub fn encode<'a>(&self, buffer: &'a mut [u8]) -> Result<&'a mut [u8], BufferTooSmall> {
        postcard::to_slice(self, buffer).map_err(|_| BufferTooSmall)
    }

    /// Reads a model that takes up all the bytes.
    ///
    /// # Errors
    /// If they are anything else, or the hand has more joints or fingertips than the capacity.
    pub fn decode(bytes: &[u8]) -> Result<Self, ModelError> {
        match postcard::take_from_bytes(bytes) {
            Ok((model, [])) => Ok(model),
            Ok(_) => Err(ModelError::TrailingBytes),
            Err(_) => Err(ModelError::Malformed),
        }
    }
}
