//! The named postures of a hand.

use crate::list::List;
use serde::{Deserialize, Serialize};

/// Most postures of a hand.
pub const POSTURES_MOST: usize = 8;
/// Most bytes of the name of a posture.
pub const NAME_BYTES: usize = 15;
/// The name of the posture to which a hand opens after a grasp.
pub const OPEN: &[u8] = b"open";

/// A posture with a name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedPosture<const J: usize> {
    /// Its name, in UTF-8.
    pub name: List<u8, NAME_BYTES>,
    /// Joint angles, rad.
    pub angles_rad: List<f32, J>,
}

impl<const J: usize> NamedPosture<J> {
    /// Returns the posture of a name, which is cut where it is too long, and joint angles, rad.
    pub fn new(name: &str, angles_rad: &[f32]) -> Self {
        let (mut bytes, mut angles) = ([0; NAME_BYTES], [0.0; J]);
        bytes.iter_mut().zip(name.bytes()).for_each(|(to, from)| *to = from);
        angles.iter_mut().zip(angles_rad).for_each(|(to, from)| *to = *from);
        Self { name: List::first_of(bytes, name.len()), angles_rad: List::first_of(angles, angles_rad.len()) }
    }

    /// Returns its name.
    pub fn name(&self) -> &str {
        core::str::from_utf8(self.name.as_slice()).unwrap_or("?")
    }
}

/// The postures of a hand.
pub type Postures<const J: usize> = List<NamedPosture<J>, POSTURES_MOST>;
