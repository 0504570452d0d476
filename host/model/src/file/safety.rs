//! The safety numbers of a hand: one list, from which follow the keys of `[safety]`, their checks, what `hand new` writes, and
//! the table of `docs/hands.md`.

use blindgrasp_shared::parameters::Parameter;
use serde::{Deserialize, Serialize};

/// A key of `[safety]`, as a user is told of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyKey {
    /// Its name.
    pub name: &'static str,
    /// Its value where the file does not have it, as it is written there.
    pub default: &'static str,
    /// The least that it may be.
    pub least: f64,
    /// The most that it may be.
    pub most: f64,
    /// The parameters of the controller that follow from it.
    pub parameters: &'static [Parameter],
    /// Its meaning, and the harm that it protects from.
    pub what: &'static str,
    /// The way to choose it.
    pub choice: &'static str,
}

macro_rules! safety_keys {
    ($($name:ident: $type:ty = $default:literal, $least:literal to $most:literal, $parameters:expr, $what:literal, $choice:literal;)*) => {
        /// The numbers that keep a hand from doing harm, beside the limits of its joints.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct Safety {
            $(#[doc = $what] pub $name: $type,)*
        }

        impl Default for Safety {
            fn default() -> Self {
                Self { $($name: $default),* }
            }
        }

        impl Safety {
            /// All keys.
            pub const KEYS: &[SafetyKey] = &[$(SafetyKey {
                name: stringify!($name),
                default: stringify!($default),
                least: $least,
                most: $most,
                parameters: &$parameters,
                what: $what,
                choice: $choice,
            }),*];

            /// Returns all keys with their values.
            pub fn values(&self) -> impl Iterator<Item = (&'static SafetyKey, f64)> {
                Self::KEYS.iter().zip([$(f64::from(self.$name)),*])
            }
        }
    };
}

// The frozen counter: left alone, a grasp does not come near `frozen_neighbour_rad`: neighbours of joints that really stood
// still turned by 0.011 rad at most. But somebody who pushes a fingertip of the cube or the prism by 0.25 to 2 N bends the
// fingers so that a knee, whose angle is at its extremum, stands still while its neighbours turn by a tenth of a radian and
// more. Of 72 such pushes that the grasp survives, share and angle mistake none for a frozen counter
// (`tests/tests/faults.rs`); a share of 0.02 and 0.03 rad mistook one in four or five, and found fewer of the counters that
// really were frozen.
//
// The energy: 50 mJ for the three-fingered hand, what a stretched finger has at 9 rad/s. Hands that hold, pushed ones
// included, stay below a fiftieth of that (`tests/tests/ledger.rs`); hands that ring after a hard touch, and then hold, below
// two thirds.
safety_keys! {
    slew_s: f64 = 0.01, 0.001 to 10.0, [Parameter::SLEW_LIMIT],
        "Least time in which a joint's whole torque comes or goes, s: no torque jumps",
        "well above the period; grasps need a fiftieth of the default's slope. In a scene, `actuators.slew_limit_nm_s` wins";
    stop_margin_rad: f64 = 0.1, 0.001 to 1.0, [Parameter::STOP_MARGIN],
        "Distance from its end stop at which a joint begins to be slowed, rad; at most an eighth of its range",
        "the angle in which the joint can be stopped from the speed that it has there";
    stop_torque_share: f64 = 0.1, 0.0 to 1.0, [Parameter::STOP_STIFFNESS],
        "Torque with which a soft end stop pushes back once its margin is used up, as a share of the joint's torque limit",
        "more than the links' weight asks for; 0 only brakes";
    stop_damping_factor: f64 = 10.0, 0.0 to 1000.0, [Parameter::STOP_DAMPING],
        "Damping at a soft end stop, as a multiple of the joint's own",
        "lower it where a joint rings at its end";
    firmest_factor: f64 = 4.0, 1.0 to 100.0, Parameter::GAIN_LIMITS,
        "Firmest grasp that a user may ask for, as a multiple of what `[control]` says",
        "what object and fingertips bear; 1 allows no more than `[control]`";
    range_slack_rad: f64 = 0.1, 0.0 to 1.0, [Parameter::RANGE_SLACK],
        "Angle by which a joint may be beyond its end stop, rad: more is a wrong zero, or a broken stop",
        "what the stops give, and how well the zero is known";
    impossible_speed_factor: f64 = 1.5, 1.0 to 100.0, [Parameter::POSSIBLE_SPEED],
        "Speed that a joint can't have from one tick to the next, as a multiple of its motor's: a count that jumps",
        "more where somebody may throw the joints about";
    saturated_ms: u32 = 1000, 10.0 to 60000.0, [Parameter::SATURATED_TIME],
        "Longest time for which a torque may stay at its limit, ms: a jam, or a motor that gets hot",
        "how long the motors bear their largest torque";
    frozen_ms: u32 = 50, 1.0 to 60000.0, [Parameter::FROZEN_TIME],
        "Shortest standstill of a counter that can be suspicious, ms",
        "longer than joints take to come over their friction";
    frozen_torque_share: f64 = 0.05, 0.001 to 1.0, [Parameter::FROZEN_TORQUE],
        "Change of a torque, as a share of its limit, by which the joint has to move",
        "above the joint's friction; see [safety.md](safety.md#counters-that-stand-still) before it is lowered";
    frozen_neighbour_rad: f64 = 0.1, 0.001 to 10.0, [Parameter::FROZEN_NEIGHBOUR],
        "Turn of a neighbour by which the joint has to move too, rad",
        "higher where a false alarm is worse than a frozen counter, and the other way round";
    energy_travel_rad: f64 = 0.003, 0.000001 to 1.0, [Parameter::ENERGY],
        "Largest work of the joints in a second beyond the law's potentials: that of all torque limits over this angle, rad. More is a swing that the controller itself feeds",
        "see [safety.md](safety.md#the-energy-ledger); more where a grasp that rings may go on";
    release_ms: u32 = 300, 0.0 to 60000.0, [Parameter::RELEASE_TIME],
        "Time that letting go takes, ms",
        "0 drops the object at once";
    heartbeat_ms: u32 = 250, 60.0 to 5000.0, [Parameter::HEARTBEAT_TIME],
        "Longest time without the host's heartbeat while the hand has torque, ms: a cable, or a program that stands still. It can't be switched off",
        "several heartbeats (a host sends one every 50 ms), and no longer than a hand may go on by itself";
    late_ticks: u32 = 3, 0.0 to 100.0, [Parameter::LATE_TICKS],
        "Ticks in a row that may be late",
        "a processor that is late more often needs a longer period";
}
