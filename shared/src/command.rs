//! What a user may ask of the hand, and what it answers.
//!
//! Every command gets an [`Answer`] in the record of the tick that took it: done, or refused with a named reason.
//! Which command is taken in which mode is the table in [`supervisor`](crate::supervisor).

use core::fmt;
use serde::{Deserialize, Serialize};

/// A command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Command {
    /// Let the joints have torque: hold their weight and damp them.
    Arm,
    /// Take the torque away.
    Disarm,
    /// Close the hand, and hold what is in it.
    Grasp,
    /// Let go slowly.
    Release,
    /// Take the torque away at once, in every mode.
    Stop,
    /// Leave the fault, once its cause is gone.
    ClearFault,
}

impl Command {
    /// Every command.
    pub const ALL: [Self; 6] =
        [Self::Arm, Self::Disarm, Self::Grasp, Self::Release, Self::Stop, Self::ClearFault];

    /// Its name in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Arm => "arm",
            Self::Disarm => "disarm",
            Self::Grasp => "grasp",
            Self::Release => "release",
            Self::Stop => "stop",
            Self::ClearFault => "clear fault",
        }
    }
}

/// Why a command was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The hand is disarmed.
    NotArmed,
    /// There is no grasp to release.
    NotGrasping,
    /// A grasp is under way.
    Grasping,
    /// A release is under way.
    Releasing,
    /// The hand is in a fault.
    InFault,
    /// There is no fault to clear.
    NoFault,
    /// The cause of a fault is still there.
    FaultPersists,
}

impl Refusal {
    /// Every refusal.
    pub const ALL: [Self; 7] = [
        Self::NotArmed,
        Self::NotGrasping,
        Self::Grasping,
        Self::Releasing,
        Self::InFault,
        Self::NoFault,
        Self::FaultPersists,
    ];

    /// The reason, and what to do.
    pub const fn words(self) -> &'static str {
        match self {
            Self::NotArmed => "the hand is disarmed: arm it first",
            Self::NotGrasping => "there is no grasp to release",
            Self::Grasping => "a grasp is under way: release it first, or stop",
            Self::Releasing => "a release is under way: wait for its end, or stop",
            Self::InFault => "the hand is in a fault: clear it first",
            Self::NoFault => "there is no fault to clear",
            Self::FaultPersists => "the cause of the fault is still there: remove it first",
        }
    }
}

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answer {
    /// The command.
    pub command: Command,
    /// `None`: done.
    pub refused: Option<Refusal>,
}

impl fmt::Display for Answer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.refused {
            None => write!(f, "{}: done", self.command.words()),
            Some(refusal) => write!(f, "{}: refused, {}", self.command.words(), refusal.words()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn answers_say_what_became_of_the_command() {
        let done = Answer { command: Command::Arm, refused: None };
        assert_eq!(done.to_string(), "arm: done");
        let refused = Answer { command: Command::Grasp, refused: Some(Refusal::NotArmed) };
        assert_eq!(refused.to_string(), "grasp: refused, the hand is disarmed: arm it first");
    }
}
