//! The table of parameters: every number of the configuration that can be read, and while the hand is disarmed set, one by
//! one over the line. What belongs to the hand itself is built in.
//!
//! **The hand's file is the ceiling.** The configuration that a hand starts with, its file's, says the most that the line
//! may set a limit to, and the least of what protects ([`Bound`]): over the line a limit is made tighter, never looser.
//!
//! A row is a name, its unit and words, and where in the configuration it is kept. Gains, their limits and the choice of
//! laws have their rows by the list of [laws](crate::control).

use crate::command::Refusal;
use crate::control::{AttitudeError, GAIN_COUNT, GAINS, Gain, LAWS};
pub use crate::parameter::Each;

use crate::parameter::Text;
use crate::tick::{Config, Params};
use core::fmt;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// The bound that the hand's file sets to a parameter on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// As far as it can be used.
    Free,
    /// Down only.
    AtMost,
    /// Up only.
    AtLeast,
}

/// A parameter: the number of its row, which is its byte on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct Parameter(u8);

/// The name of a row, its unit and its words. Apart from the rest, because the firmware has no use for them.
#[derive(Clone, Copy)]
struct Label {
    key: Text,
    unit: &'static str,
    words: Text,
}

/// The rest of a row.
#[derive(Clone, Copy)]
struct Row {
    each: Each,
    bound: Bound,
    place: Place,
}

/// The place of a parameter in the configuration.
#[derive(Clone, Copy)]
enum Place {
    /// In the configuration, where the row says.
    Row(Number),
    /// Among the gains.
    Gain(u8),
    /// Among the limits of the gains.
    Limit(u8),
    /// In the choice of laws.
    Law(u8),
}

/// Writes the rows, a constant for each, and where it is kept.
macro_rules! parameters {
    ($($name:ident, $each:ident, $bound:ident, $key:literal, $unit:literal, $words:literal,
        $group:ident.$($field:ident).+ $([k].$part:ident)?;)*) => {
        /// The rows that are not of laws.
        #[allow(non_camel_case_types, clippy::upper_case_acronyms)]
        #[derive(Clone, Copy)]
        enum Number { $($name,)* }

        const ROWS: &[Row] = &[
            $(Row { each: Each::$each, bound: Bound::$bound, place: Place::Row(Number::$name) },)*
        ];
        const LABELS: &[Label] = &[
            $(Label { key: Text::plain($key), unit: $unit, words: Text::plain($words) },)*
        ];

        impl Parameter {
            $(#[doc = concat!($words, ", ", $unit, ".")]
            pub const $name: Self = Self(Number::$name as u8);)*
        }

        /// Returns the value of a row.
        fn get<const J: usize>(config: &Config<J>, number: Number, k: usize) -> Option<f32> {
            match number { $(Number::$name => config.$group.$($field).+ $(.get(k)?.$part)? .get(k),)* }
        }

        /// Sets the value of a row.
        fn put<const J: usize>(
            config: &mut Config<J>,
            number: Number,
            k: usize,
            value: Option<f32>,
        ) -> Result<(), Refusal> {
            let none = Refusal::NoSuchParameter;
            match number {
                $(Number::$name => config.$group.$($field).+ $(.get_mut(k).ok_or(none)?.$part)? .put(k, value),)*
            }
        }
    };
}

#[rustfmt::skip]
parameters! {
    DAMPING,          Joint, Free,    "damping_nm_s",                  "N m s/rad", "Damping of a joint",                                        laws.hold.damping_nm_s;
    GRAVITY,          Axis,  Free,    "gravity_m_s2",                  "m/s^2",     "Gravity in the base frame",                                 laws.hold.gravity_m_s2;
    BANDWIDTH,        Hand,  Free,    "estimator.bandwidth_hz",        "Hz",        "Bandwidth of the estimator",                                estimator.bandwidth_hz;
    TORQUE_LIMIT,     Joint, AtMost,  "limits.torque_nm",              "N m",       "Largest torque of a joint",                                 limits.torque_nm;
    SLEW_LIMIT,       Joint, AtMost,  "limits.slew_nm_s",              "N m/s",     "Largest change of a joint's torque",                        limits.slew_nm_s;
    STOP_MARGIN,      Joint, AtLeast, "limits.stops.margin_rad",       "rad",       "Where a soft end stop begins before its end",               limits.stop_margin_rad;
    STOP_STIFFNESS,   Joint, AtLeast, "limits.stops.stiffness_nm_rad", "N m/rad",   "Stiffness of a soft end stop",                              limits.stop_stiffness_nm_rad;
    STOP_DAMPING,     Joint, AtLeast, "limits.stops.damping_nm_s",     "N m s/rad", "Damping of a soft end stop",                                limits.stop_damping_nm_s;
    POSSIBLE_SPEED,   Joint, AtMost,  "faults.possible_speed_rad_s",   "rad/s",     "Speed that a joint can't reach",                            faults.possible_speed_rad_s;
    SPEED_LIMIT,      Joint, AtMost,  "faults.speed_limit_rad_s",      "rad/s",     "Speed that a joint must not reach",                         faults.speed_limit_rad_s;
    RANGE_SLACK,      Hand,  AtMost,  "faults.range_slack_rad",        "rad",       "Angle by which a joint may be beyond its range",            faults.range_slack_rad;
    SATURATED_TIME,   Hand,  AtMost,  "faults.saturated_ms",           "ms",        "Time for which a torque may stay at its limit",             faults.saturated_ms;
    FROZEN_TORQUE,    Joint, AtMost,  "faults.frozen_torque_nm",       "N m",       "Change of torque that is too much for a joint that stands still", faults.frozen_torque_nm;
    FROZEN_NEIGHBOUR, Hand,  AtMost,  "faults.frozen_neighbour_rad",   "rad",       "Turn of a neighbour that is too much for a joint that stands still", faults.frozen_neighbour_rad;
    FROZEN_TIME,      Hand,  AtMost,  "faults.frozen_ms",              "ms",        "Shortest standstill that counts",                           faults.frozen_ms;
    HEARTBEAT_TIME,   Hand,  AtMost,  "faults.heartbeat_ms",           "ms",        "Time for which the heartbeat may fail",                     faults.heartbeat_ms;
    LATE_TICKS,       Hand,  AtMost,  "faults.late_ticks",             "",          "Number of ticks in a row that may be late",                 faults.late_ticks;
    ENERGY,           Hand,  AtMost,  "faults.energy_j",               "J",         "Work in a second that the joints may do beyond the drop of the law's potentials", faults.energy_j;
    SOFT_START_TIME,  Hand,  AtLeast, "supervisor.soft_start_ms",      "ms",        "Time over which the force grows",                           supervisor.soft_start_ms;
    RELEASE_TIME,     Hand,  AtMost,  "supervisor.release_ms",         "ms",        "Time over which force and stiffness fall",                  supervisor.release_ms;
    AMPLIFIER_START_TIME, Hand, AtLeast, "supervisor.amplifier_start_ms", "ms",       "Time that the amplifiers take to start after they got power", supervisor.amplifier_start_ms;
    FRAME_DAMPING,    Hand,  Free,    "frame_damping_s",               "s",         "Damping of the fingertips' common place over its stiffness",  laws.frame.damping_s;
    FRAME_TURN_DAMPING, Hand, Free,   "frame_turn_damping_s",          "s",         "Damping of the fingertips' common attitude over its stiffness", laws.frame.turn_damping_s;
    FRAME_REACH,      Hand,  AtMost,  "frame_reach_m",                 "m",         "Distance from the target beyond which the pull no longer grows", laws.frame.reach_m;
    MOVING_INERTIA,   Joint, Free,    "moving.inertia_kg_m2",          "kg m^2",    "Inertia that a joint feels with the others free",           cycle.moving.inertia_kg_m2;
    MOVING_BANDWIDTH, Hand,  Free,    "moving.bandwidth_rad_s",        "rad/s",     "Bandwidth of joints that follow a path",                    cycle.moving.bandwidth_rad_s;
    MOVING_SPEED,     Hand,  AtMost,  "moving.speed_rad_s",            "rad/s",     "Largest speed of a joint on its path; 0 where there are none", cycle.moving.speed_rad_s;
    MOVING_INTEGRAL,  Hand,  AtMost,  "moving.integral_nm",            "N m",       "Most torque against the friction of a joint on its path",   cycle.moving.integral_nm;
    CLOSING_SPEED,    Hand,  AtMost,  "closing.speed_m_s",             "m/s",       "Speed of fingertips that close; 0 where a grasp begins at once, from touch", cycle.closing.speed_m_s;
    CLOSING_STIFFNESS, Hand, Free,    "closing.stiffness_n_m",         "N/m",       "Stiffness of fingertips that close",                        cycle.closing.stiffness_n_m;
    CLOSING_FORCE,    Hand,  AtMost,  "closing.force_n",               "N",         "Force of fingertips that close",                            cycle.closing.force_n;
    CLOSING_DAMPING,  Hand,  Free,    "closing.damping_n_s_m",         "N s/m",     "Damping of fingertips that close",                          cycle.closing.damping_n_s_m;
    CARRYING_REACH,   Hand,  AtMost,  "carrying.reach_m",              "m",         "Longest way of what is held from where the grasp began",    cycle.carrying.reach_m;
    CARRYING_TURN,    Hand,  AtMost,  "carrying.reach_rad",            "rad",       "Largest turn of what is held since the grasp began",        cycle.carrying.reach_rad;
    CARRYING_SPEED,   Hand,  AtMost,  "carrying.speed_m_s",            "m/s",       "Largest speed of what is held",                             cycle.carrying.speed_m_s;
    CARRYING_TURN_SPEED, Hand, AtMost, "carrying.speed_rad_s",         "rad/s",     "Largest angular speed of what is held",                     cycle.carrying.speed_rad_s;
    CARRYING_INTEGRAL, Hand, AtMost,  "carrying.integral_n",           "N",         "Most force of the integral that keeps what is held in its place", cycle.carrying.integral_n;
    CARRYING_CORRECTION, Hand, Free,  "carrying.correction_hz",        "Hz",        "Rate at which the target follows what rolling fingertips tell of the turn", cycle.carrying.correction_hz;
    CARRYING_STILL,   Hand,  Free,    "carrying.still_m",              "m",         "Way that is left which integral and correction leave alone", cycle.carrying.still_m;
    PUT_DOWN_SPEED,   Hand,  AtMost,  "carrying.put_down_m_s",         "m/s",       "Speed at which something is put down",                      cycle.carrying.put_down_m_s;
    PUT_DOWN_DEPTH,   Hand,  AtMost,  "carrying.put_down_m",           "m",         "Depth below where the grasp began to which something is put down", cycle.carrying.put_down_m;
    PUT_DOWN_FORCE,   Hand,  AtMost,  "carrying.put_down_n",           "N",         "Force on what is below at which something is put down",     cycle.carrying.put_down_n;
    ENCODER_REVERSED, Joint, Free,    "encoder_reversed",              "",          "1 where the count falls while the joint's angle rises, else 0", estimator.encoders[k].reversed;
    ENCODER_ZERO,     Joint, Free,    "encoder_zero_count",            "counts",    "Count at joint angle zero",                                 estimator.encoders[k].zero_count;
    MOTOR_REVERSED,   Joint, Free,    "motor_reversed",                "",          "1 where a positive voltage pushes the joint in its negative direction, else 0", motors.reversed;
    ATTITUDE_ERROR,   Hand,  Free,    "attitude_error",                "",          "0 where the error of two fingertips' relative attitude is the sine of their turn, 1 where that of half their turn", laws.attitude_error;
}

/// Every row: those above, the gains, their limits, the laws.
const TABLE: [Row; Parameter::COUNT] = {
    let mut table = [Row { each: Each::Hand, bound: Bound::Free, place: Place::Law(0) }; Parameter::COUNT];
    let (mut at, mut k) = (0, 0);
    while k < ROWS.len() {
        table[at] = ROWS[k];
        (at, k) = (at + 1, k + 1);
    }
    k = 0;
    while k < GAIN_COUNT {
        table[at].place = Place::Gain(k as u8);
        table[at + GAIN_COUNT].place = Place::Limit(k as u8);
        table[at + GAIN_COUNT].bound = Bound::AtMost;
        (at, k) = (at + 1, k + 1);
    }
    at += GAIN_COUNT;
    k = 0;
    while k < LAWS.len() {
        table[at].place = Place::Law(k as u8);
        (at, k) = (at + 1, k + 1);
    }
    table
};

/// The hash of each name: the firmware has no use for the names themselves.
const HASHES: [u32; Parameter::COUNT] = {
    let mut hashes = [0; Parameter::COUNT];
    let mut k = 0;
    while k < hashes.len() {
        hashes[k] = Parameter::ALL[k].label().key.hash();
        let mut before = 0;
        while before < k {
            assert!(hashes[before] != hashes[k], "two names have the same hash");
            before += 1;
        }
        k += 1;
    }
    hashes
};

impl Parameter {
    /// Number of parameters.
    pub const COUNT: usize = ROWS.len() + 2 * GAIN_COUNT + LAWS.len();

    /// Every parameter, in the order of their bytes on the wire.
    pub const ALL: [Self; Self::COUNT] = {
        assert!(Self::COUNT <= 64, "the identity has a bit for each");
        let mut all = [Self(0); Self::COUNT];
        let mut k = 0;
        while k < Self::COUNT {
            all[k] = Self(k as u8);
            k += 1;
        }
        all
    };

    /// Returns the parameter of this name.
    pub fn named(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.key() == key)
    }

    /// Returns the parameter that is a gain, by its number in the table of [gains](crate::control::GAINS).
    pub const fn gain(number: usize) -> Self {
        Self((ROWS.len() + number) as u8)
    }

    /// The limits of the gains, in the order of the table of [gains](crate::control::GAINS).
    pub const GAIN_LIMITS: [Self; GAIN_COUNT] = {
        let mut limits = [Self(0); GAIN_COUNT];
        let mut k = 0;
        while k < GAIN_COUNT {
            limits[k] = Self((ROWS.len() + GAIN_COUNT + k) as u8);
            k += 1;
        }
        limits
    };

    /// Returns the number of its row, which is its byte on the line.
    pub const fn number(self) -> u8 {
        self.0
    }

    fn row(self) -> Row {
        // There is a row for every number.
        TABLE.get(usize::from(self.0)).copied().unwrap_or(TABLE[0])
    }

    const fn label(self) -> Label {
        match TABLE[self.0 as usize].place {
            Place::Row(number) => LABELS[number as usize],
            Place::Gain(k) => {
                let Gain { key, unit, words, .. } = GAINS[k as usize];
                Label { key: Text::plain(key), unit, words: Text::plain(words) }
            }
            Place::Limit(k) => {
                let Gain { key, unit, .. } = GAINS[k as usize];
                let words = Text::new("Most that may be asked for of ", key);
                Label { key: Text::new("limits.", key), unit, words }
            }
            Place::Law(k) => {
                let (key, words) = LAWS[k as usize];
                let words = Text::new("1 where it may act, else 0: ", words);
                Label { key: Text::new("laws.", key), unit: "", words }
            }
        }
    }

    /// Returns its name.
    pub fn key(self) -> Text {
        self.label().key
    }

    /// Returns the hash of its name, by which it is saved: another firmware may have another number for it.
    pub fn key_hash(self) -> u32 {
        HASHES.get(usize::from(self.0)).copied().unwrap_or(0)
    }

    /// Returns its unit; empty for a pure number.
    pub fn unit(self) -> &'static str {
        self.label().unit
    }

    /// Returns what it is, in words.
    pub fn words(self) -> Text {
        self.label().words
    }

    /// Returns what its index counts.
    pub fn each(self) -> Each {
        self.row().each
    }

    /// Returns how many there are in a hand of so many joints.
    pub fn count(self, joint_count: usize) -> u8 {
        match self.each() {
            Each::Hand => 1,
            Each::Joint => joint_count as u8,
            Each::Axis => 3,
        }
    }

    /// Returns how far the line may move it from what the hand's file says. Gains have limits of their own.
    pub fn bound(self) -> Bound {
        self.row().bound
    }

    /// Returns `true` if what the joints' angles are read from hangs on it: their signs and zeros.
    pub fn is_reading(self) -> bool {
        matches!(self, Self::ENCODER_REVERSED | Self::ENCODER_ZERO)
    }

    /// Returns `true` if it says how firmly to grasp, so that it may be asked for with each grasp.
    pub fn is_gain(self) -> bool {
        matches!(self.row().place, Place::Gain(_))
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.key().fmt(f)
    }
}

impl TryFrom<u8> for Parameter {
    type Error = Refusal;

    fn try_from(number: u8) -> Result<Self, Refusal> {
        if usize::from(number) < Self::COUNT { Ok(Self(number)) } else { Err(Refusal::NoSuchParameter) }
    }
}

impl From<Parameter> for u8 {
    fn from(parameter: Parameter) -> Self {
        parameter.0
    }
}

/// A number in the configuration, or one for each joint or axis, which may be switched off.
trait Field {
    /// Returns the value; `None` where it is switched off.
    fn get(&self, k: usize) -> Option<f32>;

    /// Sets the value, switched on with zeros for its neighbours if it was off; `None` switches it off with all of them.
    fn put(&mut self, k: usize, value: Option<f32>) -> Result<(), Refusal>;
}

impl Field for f32 {
    fn get(&self, _: usize) -> Option<f32> {
        Some(*self)
    }

    fn put(&mut self, _: usize, value: Option<f32>) -> Result<(), Refusal> {
        *self = value.ok_or(Refusal::OutOfRange)?;
        Ok(())
    }
}

impl Field for u32 {
    fn get(&self, _: usize) -> Option<f32> {
        Some(*self as f32)
    }

    fn put(&mut self, _: usize, value: Option<f32>) -> Result<(), Refusal> {
        let value = value.ok_or(Refusal::OutOfRange)?;
        let whole = value as u32;
        if whole as f32 != value {
            return Err(Refusal::OutOfRange);
        }
        *self = whole;
        Ok(())
    }
}

/// The largest number of which every smaller one is an `f32`.
const MOST_WHOLE: f32 = 16_777_216.0;

impl Field for i32 {
    fn get(&self, _: usize) -> Option<f32> {
        Some(*self as f32)
    }

    fn put(&mut self, _: usize, value: Option<f32>) -> Result<(), Refusal> {
        let value = value.ok_or(Refusal::OutOfRange)?;
        let whole = value as i32;
        if whole as f32 != value || value.abs() > MOST_WHOLE {
            return Err(Refusal::OutOfRange);
        }
        *self = whole;
        Ok(())
    }
}

impl Field for bool {
    fn get(&self, _: usize) -> Option<f32> {
        Some(if *self { 1.0 } else { 0.0 })
    }

    fn put(&mut self, _: usize, value: Option<f32>) -> Result<(), Refusal> {
        let (Some(0.0) | Some(1.0)) = value else { return Err(Refusal::OutOfRange) };
        *self = value == Some(1.0);
        Ok(())
    }
}

impl Field for AttitudeError {
    fn get(&self, k: usize) -> Option<f32> {
        (*self == Self::HalfAngle).get(k)
    }

    fn put(&mut self, k: usize, value: Option<f32>) -> Result<(), Refusal> {
        let mut is_half = false;
        is_half.put(k, value)?;
        *self = if is_half { Self::HalfAngle } else { Self::Sine };
        Ok(())
    }
}

impl<const N: usize> Field for [bool; N] {
    fn get(&self, k: usize) -> Option<f32> {
        <[bool]>::get(self, k)?.get(0)
    }

    fn put(&mut self, k: usize, value: Option<f32>) -> Result<(), Refusal> {
        <[bool]>::get_mut(self, k).ok_or(Refusal::NoSuchParameter)?.put(0, value)
    }
}

impl<const N: usize> Field for [f32; N] {
    fn get(&self, k: usize) -> Option<f32> {
        <[f32]>::get(self, k).copied()
    }

    fn put(&mut self, k: usize, value: Option<f32>) -> Result<(), Refusal> {
        *self.get_mut(k).ok_or(Refusal::NoSuchParameter)? = value.ok_or(Refusal::OutOfRange)?;
        Ok(())
    }
}

impl Field for Vector3<f32> {
    fn get(&self, k: usize) -> Option<f32> {
        self.as_slice().get(k).copied()
    }

    fn put(&mut self, k: usize, value: Option<f32>) -> Result<(), Refusal> {
        let place = self.as_mut_slice().get_mut(k).ok_or(Refusal::NoSuchParameter)?;
        *place = value.ok_or(Refusal::OutOfRange)?;
        Ok(())
    }
}

/// All zeros.
trait Blank {
    const BLANK: Self;
}

impl Blank for f32 {
    const BLANK: Self = 0.0;
}

impl Blank for u32 {
    const BLANK: Self = 0;
}

impl<const N: usize> Blank for [f32; N] {
    const BLANK: Self = [0.0; N];
}

impl Blank for Vector3<f32> {
    const BLANK: Self = Vector3::new(0.0, 0.0, 0.0);
}

impl<F: Field + Blank> Field for Option<F> {
    fn get(&self, k: usize) -> Option<f32> {
        self.as_ref()?.get(k)
    }

    fn put(&mut self, k: usize, value: Option<f32>) -> Result<(), Refusal> {
        if value.is_none() {
            *self = None;
            return Ok(());
        }
        self.get_or_insert(F::BLANK).put(k, value)
    }
}

impl<const J: usize> Config<J> {
    /// Returns a parameter; `None` where what it belongs to is switched off.
    ///
    /// # Errors
    /// There is no such parameter.
    pub fn value(&self, joint_count: usize, parameter: Parameter, index: u8) -> Result<Option<f32>, Refusal> {
        if index >= parameter.count(joint_count) {
            return Err(Refusal::NoSuchParameter);
        }
        Ok(match parameter.row().place {
            Place::Row(number) => get(self, number, index.into()),
            Place::Gain(k) => self.laws.gains.iter().nth(k.into()).copied(),
            Place::Limit(k) => self.limits.gains.iter().nth(k.into()).copied().flatten(),
            Place::Law(k) => Some(if self.laws.chosen.has(k) { 1.0 } else { 0.0 }),
        })
    }

    /// Puts a parameter in, without looking at the others: [`Params::new`] does. `None` switches off what it belongs to,
    /// with all its joints; a value switches it on, with zeros for the rest.
    ///
    /// # Errors
    /// There is no such parameter, it can't be switched off, or it is a whole number and the value is none.
    pub fn put(
        &mut self,
        joint_count: usize,
        parameter: Parameter,
        index: u8,
        value: Option<f32>,
    ) -> Result<(), Refusal> {
        if index >= parameter.count(joint_count) {
            return Err(Refusal::NoSuchParameter);
        }
        let none = Refusal::NoSuchParameter;
        match parameter.row().place {
            Place::Row(number) => put(self, number, index.into(), value),
            Place::Gain(k) => self.laws.gains.iter_mut().nth(k.into()).ok_or(none)?.put(0, value),
            Place::Limit(k) => self.limits.gains.iter_mut().nth(k.into()).ok_or(none)?.put(0, value),
            Place::Law(k) => {
                let mut is_chosen = self.laws.chosen.has(k);
                is_chosen.put(0, value)?;
                self.laws.chosen = self.laws.chosen.with(k, is_chosen);
                Ok(())
            }
        }
    }
}

/// The value of a parameter, and the hand's file's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// The value that acts.
    pub value: f32,
    /// The value in the hand's file.
    pub file: f32,
}

impl<const J: usize, const F: usize> Params<J, F> {
    /// Returns a parameter as it is, and as the hand's file has it. Times in ms are whole numbers.
    ///
    /// # Errors
    /// There is no such parameter, or what it belongs to is switched off.
    pub fn get(&self, parameter: Parameter, index: u8) -> Result<Setting, Refusal> {
        let joint_count = self.hand().joint_count();
        let value = self.config().value(joint_count, parameter, index)?;
        let file = self.file().value(joint_count, parameter, index)?;
        value.zip(file).map(|(value, file)| Setting { value, file }).ok_or(Refusal::SwitchedOff)
    }

    /// Sets a parameter, if it can be used with all the others, and is no looser than in the hand's file.
    ///
    /// # Errors
    /// There is no such parameter, what it belongs to is switched off, or the value is not finite, not whole where it
    /// has to be, out of its range, or looser than the hand's file allows. Nothing changes then.
    pub fn set(&mut self, parameter: Parameter, index: u8, value: f32) -> Result<(), Refusal> {
        if !value.is_finite() {
            return Err(Refusal::NotFinite);
        }
        let Setting { file, .. } = self.get(parameter, index)?;
        let is_looser = match parameter.bound() {
            Bound::Free => false,
            Bound::AtMost => value > file,
            Bound::AtLeast => value < file,
        };
        if is_looser {
            return Err(Refusal::BeyondFile);
        }
        let mut config = *self.config();
        config.put(self.hand().joint_count(), parameter, index, Some(value))?;
        self.change(&config, parameter)
    }

    /// Sets the zero of a joint, or of all, to the counts at which they stand.
    ///
    /// # Errors
    /// There is no such joint, or a count is too large. Nothing changes then.
    pub fn set_zero(&mut self, joint: Option<u8>, counts: &[i32; J]) -> Result<(), Refusal> {
        let joint_count = self.hand().joint_count();
        if joint.is_some_and(|joint| usize::from(joint) >= joint_count) {
            return Err(Refusal::NoSuchParameter);
        }
        let mut config = *self.config();
        let encoders = config.estimator.encoders.iter_mut().zip(counts).take(joint_count);
        for (_, (encoder, count)) in
            (0_u8..).zip(encoders).filter(|(k, _)| joint.is_none_or(|joint| joint == *k))
        {
            encoder.zero_count = *count;
        }
        self.change(&config, Parameter::ENCODER_ZERO)
    }

    /// Puts the configuration of the hand's file in force.
    pub fn reset(&mut self) {
        let file = *self.file();
        // It was good at the start.
        if self.configure(&file).is_ok() {
            self.changed = 0;
        }
    }

    /// Exchanges the configuration for one that differs by a parameter.
    fn change(&mut self, config: &Config<J>, parameter: Parameter) -> Result<(), Refusal> {
        self.configure(config).map_err(|_| Refusal::OutOfRange)?;
        let bit = 1 << parameter.number();
        self.changed = if self.differs(parameter) { self.changed | bit } else { self.changed & !bit };
        Ok(())
    }

    /// Returns `true` if signs or zeros are other than in the hand's file.
    pub fn reading_differs(&self) -> bool {
        let is_changed = |parameter: &Parameter| self.changed & (1 << parameter.number()) != 0;
        Parameter::ALL.iter().filter(|parameter| parameter.is_reading()).any(is_changed)
    }

    /// Returns `true` if a parameter is other than in the hand's file, of any joint or axis.
    fn differs(&self, parameter: Parameter) -> bool {
        (0..parameter.count(self.hand().joint_count()))
            .any(|index| self.get(parameter, index).is_ok_and(|setting| setting.value != setting.file))
    }

    /// Returns the parameters that differ from the hand's file: a bit for each, by its number.
    pub fn changed(&self) -> u64 {
        self.changed
    }
}
