//! Commands of a user to the hand, and its answers.
//!
//! Every command gets an [`Answer`] in the record of the tick that took it: done, or refused with a named reason.
//! Which command is taken in which mode is the table in [`supervisor`](crate::supervisor).

use crate::control::{GAIN_COUNT, PerGain};
use core::fmt;
use serde::{Deserialize, Serialize};

/// A command.
// Its tag is a word, so that it is moved by words and not by bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
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
    /// Say where a joint is to be in the posture that is aimed at. Nothing moves.
    Aim {
        /// The joint.
        joint: u8,
        /// Its angle, rad.
        angle_rad: f32,
    },
    /// Move to a posture, and hold it.
    Posture {
        /// Its number in the hand's file; `None` for the one that is aimed at.
        posture: Option<u8>,
        /// Time for the way, ms; 0 for the shortest that the limits allow.
        time_ms: u16,
    },
    /// Move what is held.
    Move(Move),
    /// Put down what is held.
    PutDown,
    /// Weigh what is held.
    Weigh,
}

/// A way of what is held, from where it was when the grasp began. Several in a row are followed smoothly: each is begun from
/// where the last has come to, and the last is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Move {
    /// Its position, m, in the base frame.
    pub position_m: [f32; 3],
    /// Its turn: a rotation vector, rad, in the base frame.
    pub turn_rad: [f32; 3],
    /// The point that it is turned about, m, from the middle of the fingertips when the grasp began.
    pub about_m: [f32; 3],
    /// Time for the way, ms; 0 for the shortest that the limits allow.
    pub time_ms: u16,
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
    pub const MOST_BYTES: usize = {
        let (grasp, movement) = (GAIN_COUNT * (1 + 4), 9 * 4 + 3);
        1 + if grasp > movement { grasp } else { movement }
    };

    /// Every command.
    pub const ALL: [Self; 11] = [
        Self::Arm,
        Self::Disarm,
        Self::Grasp(Grasp::CONFIGURED),
        Self::Release,
        Self::Stop,
        Self::ClearFault,
        Self::Aim { joint: 0, angle_rad: 0.0 },
        Self::Posture { posture: None, time_ms: 0 },
        Self::Move(Move { position_m: [0.0; 3], turn_rad: [0.0; 3], about_m: [0.0; 3], time_ms: 0 }),
        Self::PutDown,
        Self::Weigh,
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
            Self::Aim { .. } => "aim",
            Self::Posture { .. } => "posture",
            Self::Move(_) => "move",
            Self::PutDown => "put down",
            Self::Weigh => "weigh",
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
    Closing            = "the fingertips are closing: wait for their touch, release, or stop";
    NotCarrying        = "nothing is held firmly: grasp first, and wait until the hand is carrying";
    PuttingDown        = "what is held is being put down: wait for the end, release, or stop";
    Weighing           = "what is held is being weighed: wait for the end, release, or stop";
    NoSuchPosture      = "this hand has no posture of this number";
    NoSuchJoint        = "this hand has no joint of this number";
    BeyondRange        = "an angle is beyond the range of its joint, or in the margin of its end stop";
    NoPath             = "this hand's file gives no speed to move at: see its section `moving`";
    TooFast            = "the way is too far for its time: give it longer, or 0 for the shortest";
    TooFar             = "the way, or the turn, is longer than the hand's file allows";
    NoGravity          = "this hand is not told where down is: see `gravity_m_s2`";
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
