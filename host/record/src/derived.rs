//! Signals that are not told by the hand but follow from what it tells: the host's part of the table of signals.

use blindgrasp_shared::parameters::Each;

/// Writes the enum and its rows from one line a signal.
macro_rules! derived {
    ($($name:ident, $each:ident, $key:literal, $unit:literal, $words:literal;)*) => {
        /// A signal that follows from what the hand tells.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Derived {
            $(#[doc = concat!($words, ", ", $unit, ".")] $name,)*
        }

        impl Derived {
            /// Every one, those of the hand first.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// Its name.
            pub const fn key(self) -> &'static str {
                match self { $(Self::$name => $key,)* }
            }

            /// Its unit; empty for a pure number.
            pub const fn unit(self) -> &'static str {
                match self { $(Self::$name => $unit,)* }
            }

            /// Its meaning.
            pub const fn words(self) -> &'static str {
                match self { $(Self::$name => $words,)* }
            }

            /// Returns the thing that has a value of its own.
            pub const fn each(self) -> Each {
                match self { $(Self::$name => Each::$each,)* }
            }
        }
    };
}

#[rustfmt::skip]
derived! {
    Time,       Hand,  "time_s",      "s",     "Time of the tick since the device's start, on the device's clock";
    HostTime,   Hand,  "host_time_s", "s",     "Time of the tick since the beginning of the recording, on the host's clock; it never runs back; of several devices, the same";
    Session,    Hand,  "session",     "",      "Session of the recording, from 1 on: another begins where the link was cut, or the device has started anew";
    LostBefore, Hand,  "lost_before", "",      "Records missing between the one before and this one, also across a cut; of a device that has started anew, since its start";
    Angle,      Joint, "angle_rad",   "rad",   "Angle as the controller's estimator sees it; missing where it is not known";
    Speed,      Joint, "speed_rad_s", "rad/s", "Speed as the controller's estimator sees it; missing where it is not known";
}
