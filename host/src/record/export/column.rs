//! The columns of a table: a row a record, with the names and units that the recording's own signals have.

use crate::record::mcap::Decoded;
use crate::record::table::{Cell, Kind};
use crate::scene::suggestion;
use blindgrasp_shared::event::Event;
use blindgrasp_shared::fault::Raised;

/// What limits a joint, by the bits of its limits.
const LIMITED_BY: [&str; 16] = [
    "none",
    "torque",
    "slew",
    "torque+slew",
    "lower_stop",
    "torque+lower_stop",
    "slew+lower_stop",
    "torque+slew+lower_stop",
    "upper_stop",
    "torque+upper_stop",
    "slew+upper_stop",
    "torque+slew+upper_stop",
    "lower_stop+upper_stop",
    "torque+lower_stop+upper_stop",
    "slew+lower_stop+upper_stop",
    "torque+slew+lower_stop+upper_stop",
];

/// Writes the enums of columns and their tables from one line a column.
macro_rules! columns {
    ($(#[$doc:meta])* $enum:ident: $($variant:ident, $name:literal, $kind:ident, $unit:literal, $words:literal;)*) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        enum $enum { $($variant),* }

        impl $enum {
            const ALL: &[Self] = &[$(Self::$variant),*];

            /// Name, kind, unit and words.
            const fn described(self) -> (&'static str, Kind, &'static str, &'static str) {
                match self { $(Self::$variant => ($name, Kind::$kind, $unit, $words),)* }
            }
        }
    };
}

#[rustfmt::skip]
columns! {
    /// Of the hand.
    OfHand:
    Time,               "time_s",                Double, "s",      "time of the tick since the device's start, on its clock";
    HostTime,           "host_time_s",           Double, "s",      "time of the tick since the beginning of the recording, on the host's clock; of several devices, the same";
    Sequence,           "sequence",              Whole,  "",       "number of the record, modulo 2^32";
    Tick,               "tick",                  Whole,  "",       "number of the tick since the device's start, modulo 2^32";
    Mode,               "mode",                  Words,  "",       "mode";
    Fault,              "fault",                 Whole,  "",       "number of the fault that the hand is in";
    FaultJoint,         "fault_joint",           Words,  "",       "its joint";
    ReadingFailed,      "reading_failed",        Whole,  "",       "number of the fault for which there are no counts";
    ReadingFailedJoint, "reading_failed_joint",  Words,  "",       "its joint";
    Answer,             "answer",                Words,  "",       "what became of the command of this tick";
    Heartbeat,          "heartbeat",             Truth,  "",       "whether a heartbeat of the host came in this tick";
    Late,               "late",                  Truth,  "",       "whether the tick before was late";
    FallbackClock,      "fallback_clock",        Truth,  "",       "whether the clock is not the crystal";
    Force,              "force_n",               Real,   "N",      "force f_d that acts";
    Stiffness,          "attitude_stiffness_nm", Real,   "N m",    "attitude stiffness K_st that acts";
    IntegralGain,       "integral_gain_nm_rad",  Real,   "N m/rad", "gain K_I of the earlier law that acts";
    Approach,           "approach_potential_j",  Real,   "J",      "potential V_s of the approach";
    Attitude,           "attitude_potential_j",  Real,   "J",      "potential V_st of the attitudes, above its least value";
    Integral,           "integral_potential_j",  Real,   "J",      "potential V_I of the joints' turns since the grasp began";
    Work,               "work_j",                Real,   "J",      "work of the motors since the last grasp began";
    Damped,             "damped_j",              Real,   "J",      "what the law's damping has taken since the last grasp began";
    Excess,             "excess_j",              Real,   "J",      "work of the motors in the last second (fading) beyond the drop of the law's potentials";
    Cycles,             "cycles",                Whole,  "cycles", "processor cycles of the tick before; 0 where nothing counts them";
    LateTicks,          "late_ticks",            Whole,  "",       "ticks that were late since the start";
    Dropped,            "dropped",               Whole,  "",       "records and answers that the device lost since its start";
    Decimation,         "decimation",            Whole,  "ticks",  "ticks from one sent record to the next";
    LostBefore,         "lost_before",           Whole,  "",       "records missing between the one before and this one";
}

#[rustfmt::skip]
columns! {
    /// Of a joint.
    OfJoint:
    Count,     "count",       Whole, "counts", "encoder count";
    Angle,     "angle_rad",   Real,  "rad",    "angle as the controller's estimator sees it";
    Speed,     "speed_rad_s", Real,  "rad/s",  "speed as the controller's estimator sees it";
    Torque,    "torque_nm",   Real,  "N m",    "torque of the next tick";
    LimitedBy, "limited_by",  Words, "",       "what limits the torque: none, torque, slew, lower_stop, upper_stop";
}

/// A column.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its name; those of joints begin with the joint's, and a full stop.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
    /// Its unit; empty for what has none.
    pub unit: &'static str,
    /// What it is.
    pub words: &'static str,
    source: Source,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    Hand(OfHand),
    Joint(usize, OfJoint),
}

/// A pattern of `--signals` that fits no column.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("--signals: no column is called `{pattern}`; {suggestion}\ncolumns: {columns}")]
pub struct NoSuchColumn {
    pattern: String,
    suggestion: String,
    columns: String,
}

impl Column {
    /// All columns of a hand.
    pub fn all(joint_names: &[String]) -> Vec<Self> {
        let of_hand = OfHand::ALL.iter().map(|&signal| {
            let (name, kind, unit, words) = signal.described();
            Self { name: name.to_owned(), kind, unit, words, source: Source::Hand(signal) }
        });
        let of_joints = joint_names.iter().enumerate().flat_map(|(k, joint)| {
            OfJoint::ALL.iter().map(move |&signal| {
                let (name, kind, unit, words) = signal.described();
                Self { name: format!("{joint}.{name}"), kind, unit, words, source: Source::Joint(k, signal) }
            })
        });
        of_hand.chain(of_joints).collect()
    }

    /// The columns that patterns ask for, in the order of all, and the time; all without patterns. A pattern is a name,
    /// with `*` for anything; the name of a joint, for all of it; or a name without its joint, for all joints.
    ///
    /// # Errors
    /// The first pattern that fits none.
    pub fn chosen(joint_names: &[String], patterns: &[String]) -> Result<Vec<Self>, NoSuchColumn> {
        let all = Self::all(joint_names);
        if patterns.is_empty() {
            return Ok(all);
        }
        let fits = |pattern: &str, name: &str| {
            let without_joint = name.rsplit_once('.').map(|(_, signal)| signal);
            let joint = name.rsplit_once('.').map(|(joint, _)| joint);
            is_like(pattern, name) || joint == Some(pattern) || without_joint == Some(pattern)
        };
        for pattern in patterns {
            if !all.iter().any(|column| fits(pattern, &column.name)) {
                let signals = OfJoint::ALL.iter().map(|signal| signal.described().0);
                let names = all.iter().map(|column| column.name.as_str());
                let known = names.clone().chain(signals).chain(joint_names.iter().map(String::as_str));
                let of_hand = names.clone().take(OfHand::ALL.len());
                let listed = of_hand
                    .map(str::to_owned)
                    .chain(OfJoint::ALL.iter().map(|signal| format!("JOINT.{}", signal.described().0)));
                return Err(NoSuchColumn {
                    pattern: pattern.clone(),
                    suggestion: nearest(pattern, known),
                    columns: format!(
                        "{}; joints: {}",
                        listed.collect::<Vec<_>>().join(", "),
                        joint_names.join(", ")
                    ),
                });
            }
        }
        let is_chosen = |column: &Self| {
            column.source == Source::Hand(OfHand::Time) || patterns.iter().any(|p| fits(p, &column.name))
        };
        Ok(all.into_iter().filter(is_chosen).collect())
    }

    /// The column's value in a record's row. `start_ns` is when the recording begins.
    #[inline]
    pub fn cell<'a>(&self, decoded: &Decoded, start_ns: u64, joint_names: &'a [String]) -> Cell<'a> {
        let record = &decoded.record;
        match self.source {
            Source::Joint(k, signal) => {
                let real = |values: &[f32]| values.get(k).map_or(Cell::Missing, |&value| Cell::Real(value));
                match signal {
                    OfJoint::Count => match record.counts.as_slice().get(k) {
                        Some(&count) => Cell::Whole(count.into()),
                        None => Cell::Missing,
                    },
                    OfJoint::Angle => real(decoded.angles_rad.as_slice()),
                    OfJoint::Speed => real(decoded.speeds_rad_s.as_slice()),
                    OfJoint::Torque => real(record.torques_nm.as_slice()),
                    OfJoint::LimitedBy => match record.limiting.as_slice().get(k) {
                        Some(limiting) => Cell::Word(LIMITED_BY[usize::from(limiting.bits() & 15)]),
                        None => Cell::Missing,
                    },
                }
            }
            Source::Hand(signal) => match signal {
                OfHand::Time => Cell::Double(decoded.time_s),
                OfHand::HostTime => Cell::Double(seconds(decoded.at.0, start_ns)),
                OfHand::Sequence => Cell::Whole(record.sequence.into()),
                OfHand::Tick => Cell::Whole(record.tick.into()),
                OfHand::Mode => Cell::Word(record.mode.words()),
                OfHand::Fault => fault(record.fault),
                OfHand::FaultJoint => joint(record.fault, joint_names),
                OfHand::ReadingFailed => fault(record.reading_failed),
                OfHand::ReadingFailedJoint => joint(record.reading_failed, joint_names),
                OfHand::Answer => {
                    record.answer.map_or(Cell::Missing, |answer| Cell::Text(answer.to_string()))
                }
                OfHand::Heartbeat => Cell::Truth(record.events.contains(Event::Heartbeat)),
                OfHand::Late => Cell::Truth(record.events.contains(Event::Late)),
                OfHand::FallbackClock => Cell::Truth(record.events.contains(Event::FallbackClock)),
                OfHand::Force => Cell::Real(record.force_n),
                OfHand::Stiffness => Cell::Real(record.attitude_stiffness_nm),
                OfHand::IntegralGain => Cell::Real(record.integral_gain_nm_rad),
                OfHand::Approach => Cell::Real(record.approach_potential_j),
                OfHand::Attitude => Cell::Real(record.attitude_potential_j),
                OfHand::Integral => Cell::Real(record.integral_potential_j),
                OfHand::Work => Cell::Real(record.work_j),
                OfHand::Damped => Cell::Real(record.damped_j),
                OfHand::Excess => Cell::Real(record.excess_j),
                OfHand::Cycles => Cell::Whole(record.cycles.into()),
                OfHand::LateTicks => Cell::Whole(record.late_ticks.into()),
                OfHand::Dropped => Cell::Whole(record.dropped.into()),
                OfHand::Decimation => Cell::Whole(record.decimation.into()),
                OfHand::LostBefore => Cell::Whole(decoded.lost_before as i64),
            },
        }
    }
}

/// Seconds from one time to another, which may be before it.
pub(super) fn seconds(at_ns: u64, start_ns: u64) -> f64 {
    (i128::from(at_ns) - i128::from(start_ns)) as f64 / 1e9
}

fn fault(raised: Option<Raised>) -> Cell<'static> {
    raised.map_or(Cell::Missing, |raised| Cell::Whole(raised.fault.number().into()))
}

fn joint(raised: Option<Raised>, joint_names: &[String]) -> Cell<'_> {
    let name = raised.and_then(|raised| joint_names.get(usize::from(raised.joint?)));
    name.map_or(Cell::Missing, |name| Cell::Word(name))
}

/// The likeliest of many names.
fn nearest<'a>(pattern: &str, known: impl Iterator<Item = &'a str>) -> String {
    let words = suggestion(pattern, known);
    if words.starts_with("did you mean") { words } else { "the names are".into() }
}

/// Whether a name is like a pattern in which `*` stands for anything.
fn is_like(pattern: &str, name: &str) -> bool {
    let mut pieces = pattern.split('*');
    let Some(mut rest) = pieces.next().and_then(|first| name.strip_prefix(first)) else { return false };
    let pieces: Vec<&str> = pieces.collect();
    let Some((last, between)) = pieces.split_last() else { return rest.is_empty() };
    for piece in between {
        let Some(at) = rest.find(piece) else { return false };
        rest = &rest[at + piece.len()..];
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::limit::{Limit, Limiting};

    fn names(patterns: &[&str]) -> Result<Vec<String>, String> {
        let joints = ["thumb-1", "thumb-2", "index-1"].map(str::to_owned);
        let patterns: Vec<String> = patterns.iter().map(|&pattern| pattern.to_owned()).collect();
        let columns = Column::chosen(&joints, &patterns).map_err(|error| error.to_string())?;
        Ok(columns.into_iter().map(|column| column.name).collect())
    }

    #[test]
    fn signals_are_chosen_by_name_joint_signal_or_pattern() {
        assert_eq!(names(&[]).unwrap().len(), OfHand::ALL.len() + 3 * OfJoint::ALL.len());
        assert_eq!(names(&["tick"]).unwrap(), ["time_s", "tick"]);
        assert_eq!(
            names(&["angle_rad"]).unwrap(),
            ["time_s", "thumb-1.angle_rad", "thumb-2.angle_rad", "index-1.angle_rad"]
        );
        assert_eq!(
            names(&["thumb-*.torque_nm"]).unwrap(),
            ["time_s", "thumb-1.torque_nm", "thumb-2.torque_nm"]
        );
        assert_eq!(names(&["index-1"]).unwrap(), names(&["index-1.*"]).unwrap());
        assert_eq!(names(&["index-1"]).unwrap().len(), 1 + OfJoint::ALL.len());
        assert_eq!(names(&["*"]).unwrap(), names(&[]).unwrap());
        assert_eq!(
            names(&["*potential*"]).unwrap(),
            ["time_s", "approach_potential_j", "attitude_potential_j", "integral_potential_j"]
        );
    }

    #[test]
    fn what_no_column_is_called_is_told_with_what_there_is() {
        let error = names(&["tick", "angel_rad"]).unwrap_err();
        assert!(error.contains("`angel_rad`; did you mean `angle_rad`?"), "{error}");
        assert!(error.contains("JOINT.limited_by; joints: thumb-1, thumb-2, index-1"), "{error}");
        assert!(names(&["pinky.*"]).is_err());
    }

    #[test]
    fn every_combination_of_limits_has_its_word() {
        for (bits, word) in LIMITED_BY.into_iter().enumerate() {
            let mut limiting = Limiting::NONE;
            let limits = Limit::ALL.into_iter().filter(|&limit| bits & limit as usize != 0);
            limits.clone().for_each(|limit| limiting.insert(limit));
            assert_eq!(usize::from(limiting.bits()), bits);
            let short = |limit| match limit {
                Limit::Torque => "torque",
                Limit::Slew => "slew",
                Limit::LowerStop => "lower_stop",
                Limit::UpperStop => "upper_stop",
            };
            let words = limits.map(short).collect::<Vec<_>>().join("+");
            assert_eq!(if words.is_empty() { "none" } else { &words }, word);
        }
    }
}
