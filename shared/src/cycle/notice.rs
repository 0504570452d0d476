//! Notices: events that the tick finds by itself, and tells.

use core::fmt;
use serde::{Deserialize, Serialize};

/// Writes the enum and its tables from one line a notice.
macro_rules! notices {
    ($($name:ident = $key:literal, $words:literal;)*) => {
        /// A thing that is noticed.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[repr(u8)]
        pub enum Notice {
            $(#[doc = concat!("\"", $words, "\"")] $name,)*
        }

        impl Notice {
            /// Every notice, in the order of their bytes on the wire.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// Returns its name in scripts.
            pub const fn key(self) -> &'static str {
                match self { $(Self::$name => $key,)* }
            }

            /// Returns it in words.
            pub const fn words(self) -> &'static str {
                match self { $(Self::$name => $words,)* }
            }
        }
    };
}

#[rustfmt::skip]
notices! {
    InPosture     = "in-posture",      "the posture is reached";
    Touched       = "touched",         "all fingertips touch: the grasp begins";
    Empty         = "empty",           "there is nothing between the fingertips: the hand opens again";
    NeverTouched  = "never-touched",   "this fingertip touches nothing, though others do: the hand opens again";
    Holding       = "holding",         "the grasp is at its force: what is held can be moved";
    Lost          = "lost",            "what was held is gone: the hand opens again";
    AtTarget      = "at-target",       "the target is where it was to go";
    Weighed       = "weighed",         "it is weighed";
    OnGround      = "on-ground",       "it stands on something";
    Lowered       = "lowered",         "it was put down as far as is stated, and nothing was felt below it";
    Opened        = "opened",          "the grasp is let go";
}

/// A notice, and the fingertip that it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Noticed {
    /// The notice.
    pub notice: Notice,
    /// The fingertip; `None` for what concerns the whole hand.
    pub fingertip: Option<u8>,
}

impl Noticed {
    /// Returns a notice of the whole hand.
    pub const fn of_hand(notice: Notice) -> Self {
        Self { notice, fingertip: None }
    }

    /// Returns a notice of a fingertip.
    pub const fn at(fingertip: u8, notice: Notice) -> Self {
        Self { notice, fingertip: Some(fingertip) }
    }
}

impl fmt::Display for Noticed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(fingertip) = self.fingertip {
            write!(f, "fingertip {fingertip}: ")?;
        }
        f.write_str(self.notice.words())
    }
}
