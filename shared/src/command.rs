//! Commands of a user to the hand, and its answers.
//!
//! Every command gets an [`Answer`] in the record of the tick that took it: done, or refused with a named reason.
//! Which command is taken in which mode is the table in [`supervisor`](crate::supervisor).

use crate::control::{GAIN_COUNT, PerGain};
use core::fmt;
use serde::{Deserialize, Serialize};

/// A command.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Let the joints have torque: hold their weight and damp them.
    Arm,
    /// Take the torque away.
    Disarm,
    /// Close the hand, and hold what is in it.
    Grasp(Grasp),
    /// Let go slowly.
    Release,
    /// Take the torque away at once, in every mode.
    Stop,
    /// Leave the fault, once its cause is gone.
    ClearFault,
}

/// The gains of a grasp; a gain that is left out is as configured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Grasp {
    /// The gains that are asked for.
    pub gains: PerGain<Option<f32>>,
}

impl Grasp {
    /// As configured.
    pub const CONFIGURED: Self = Self { gains: PerGain::all(None) };
}

impl Command {
    /// Bytes that suffice for every command.
    pub const MOST_BYTES: usize = 1 + GAIN_COUNT * (1 + 4);

    /// Every command.
    pub const ALL: [Self; 6] = [
        Self::Arm,
        Self::Disarm,
        Self::Grasp(Grasp::CONFIGURED),
        Self::Release,
        Self::Stop,
        Self::ClearFault,
    ];

    /// Its name in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Arm => "arm",
            Self::Disarm => "disarm",
            Self::Grasp(_) => "grasp",
            Self::Release => "release",
            Self::Stop => "stop",
            Self::ClearFault => "clear fault",
        }
    }
}

/// Writes the enum and its tables from one line a refusal.
macro_rules! refusals {
    ($($name:ident = $words:literal;)*) => {
        /// A refusal of a request.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        pub enum Refusal {
            $(#[doc = concat!("\"", $words, "\"")] $name,)*
        }

        impl Refusal {
            /// Every refusal, in the order of their bytes on the wire.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// The reason, and what to do.
            pub const fn words(self) -> &'static str {
                match self { $(Self::$name => $words,)* }
            }
        }
    };
}

#[rustfmt::skip]
refusals! {
    NotArmed           = "the hand is disarmed: arm it first";
    NotGrasping        = "there is no grasp to release";
    Grasping           = "a grasp is under way: release it first, or stop";
    Releasing          = "a release is under way: wait for its end, or stop";
    InFault            = "the hand is in a fault: clear it first";
    NoFault            = "there is no fault to clear";
    FaultPersists      = "the cause of the fault is still there: remove it first";
    NoHeartbeat        = "there is no heartbeat: send it all the time while the hand is armed";
    FallbackClock      = "the crystal did not start, so that the tick has no exact time: repair the board";
    NotFinite          = "a value is not a finite number";
    OutOfRange         = "a value is out of its range: the limits are parameters";
    NotDisarmed        = "parameters and the line's rate are set while the hand is disarmed: disarm it, or clear its fault, first";
    NoSuchParameter    = "this hand has no parameter with this index";
    SwitchedOff        = "this limit is switched off in the hand's configuration";
    NoSession          = "there is no session of this number: say hello first";
    OutOfOrder         = "this request, or a later one, was taken before: number them upwards";
    OtherInterface     = "this firmware has another interface version: use the tool that belongs to it";
    NotUnderstood      = "this is no request of this interface version";
    Busy               = "too many requests are waiting: wait for the answers";
    JointsAreReal      = "this image has real joints: only the image `pil` takes them over the link";
    NoBurst            = "no fault was caught since the hand was last armed";
    BurstNotOver       = "the records after the fault are still being taken: ask again in a moment";
    LawNotChosen       = "the law of this gain is not chosen: set its parameter `laws.` to 1, disarmed";
    BeyondFile         = "this is looser than the hand's file, and the line can only tighten: `get` shows what the file says";
    SessionTaken       = "another program has said hello to this hand since, which ended this session: only one may lead it";
    NoSuchRate         = "this hand's line does not have this rate";
    Unconfirmed        = "signs or zeros were set: look at the angles, and confirm them, first";
    NotRead            = "the joints can't be read: see the fault";
    Saving             = "parameters are being saved: wait for the answer";
    NoStore            = "this hand has nothing to save to: an emulator has no flash";
    NoSpare            = "no room is left to save to: a reset of the board makes some";
    NotSaved           = "the flash did not take it; what was saved before is valid";
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words())
    }
}

impl core::error::Error for Refusal {}

/// The result of a command.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
        let refused = Answer { command: Command::Grasp(Grasp::CONFIGURED), refused: Some(Refusal::NotArmed) };
        assert_eq!(refused.to_string(), "grasp: refused, the hand is disarmed: arm it first");
    }
}
