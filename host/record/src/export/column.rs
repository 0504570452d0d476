//! The columns of a table: a row a record, with the names and units that the recording's own signals have.

use crate::derived::Derived;
use crate::mcap::Decoded;
use crate::table::{Cell, Kind};
use blindgrasp_model::suggestion;
use blindgrasp_shared::limit::Limit;
use blindgrasp_shared::parameters::Each;
use blindgrasp_shared::signals::{self, Value};
use blindgrasp_wire::Record;
use std::sync::LazyLock;

/// Words for the limits of a joint, by their bits.
static LIMITED_BY: LazyLock<[String; 16]> = LazyLock::new(|| {
    std::array::from_fn(|bits| {
        let limits = Limit::ALL.into_iter().filter(|&limit| bits & limit as usize != 0);
        let keys: Vec<_> = limits.map(Limit::key).collect();
        if keys.is_empty() { "none".into() } else { keys.join("+") }
    })
});

/// A column.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its name; those of joints begin with the joint's, and a full stop.
    pub name: String,
    /// The kind of its values.
    pub kind: Kind,
    /// Its unit; empty for what has none.
    pub unit: &'static str,
    /// Its meaning.
    pub words: &'static str,
    source: Source,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    Derived(Derived, Option<usize>),
    /// The place in [`Row::told`].
    Told(usize),
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
        let mut told = Vec::new();
        let mut at = 0;
        Record::BLANK.tell(|signal| {
            told.push((signal.signal, signal.kind, signal.each, at));
            at += if signal.each == Each::Joint { joint_names.len() } else { 1 };
        });
        let of = |each: Each, joint: Option<(usize, &String)>| {
            let name = |key: &str| joint.map_or(key.to_owned(), |(_, joint)| format!("{joint}.{key}"));
            let joint = joint.map(|(k, _)| k);
            let derived = Derived::ALL.iter().filter(|derived| derived.each() == each).map(|&derived| Self {
                name: name(derived.key()),
                kind: kind_of_derived(derived),
                unit: derived.unit(),
                words: derived.words(),
                source: Source::Derived(derived, joint),
            });
            let told = told.iter().filter(|(_, _, of, _)| *of == each);
            let told = told.map(|&(signal, kind, _, at)| Self {
                name: name(signal.key),
                kind: kind_of(kind),
                unit: signal.unit,
                words: signal.words,
                source: Source::Told(at + joint.unwrap_or(0)),
            });
            derived.chain(told).collect::<Vec<_>>()
        };
        let of_joints = joint_names.iter().enumerate().flat_map(|joint| of(Each::Joint, Some(joint)));
        of(Each::Hand, None).into_iter().chain(of_joints).collect()
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
                let one = Self::all(&["JOINT".to_owned()]);
                let signals = one.iter().filter_map(|column| column.name.strip_prefix("JOINT."));
                let known = all.iter().map(|column| column.name.as_str()).chain(signals);
                let known = known.chain(joint_names.iter().map(String::as_str));
                let listed = one.iter().map(|column| column.name.as_str());
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
            column.source == Source::Derived(Derived::Time, None)
                || patterns.iter().any(|p| fits(p, &column.name))
        };
        Ok(all.into_iter().filter(is_chosen).collect())
    }

    /// The column's value in a record's row.
    #[inline]
    pub fn cell<'a>(&self, row: &Row, joint_names: &'a [String]) -> Cell<'a> {
        let decoded = &row.decoded;
        let real = |values: &[f32], joint: Option<usize>| {
            joint.and_then(|k| values.get(k)).map_or(Cell::Missing, |&value| Cell::Real(value))
        };
        match self.source {
            Source::Derived(Derived::Time, _) => Cell::Double(decoded.time_s),
            Source::Derived(Derived::HostTime, _) => Cell::Double(seconds(decoded.at.0, row.start_ns)),
            Source::Derived(Derived::Session, _) => Cell::Whole(decoded.session.into()),
            Source::Derived(Derived::LostBefore, _) => Cell::Whole(decoded.lost_before as i64),
            Source::Derived(Derived::Angle, joint) => real(decoded.angles_rad.as_slice(), joint),
            Source::Derived(Derived::Speed, joint) => real(decoded.speeds_rad_s.as_slice(), joint),
            Source::Told(at) => cell(row.told.get(at).copied().unwrap_or(Value::Missing), joint_names),
        }
    }
}

/// A record, of which every column takes its cell.
pub struct Row {
    decoded: Decoded,
    /// The beginning of the recording.
    start_ns: u64,
    /// The values that the hand told, signal by signal, and of a signal of joints joint by joint.
    told: Vec<Value<'static>>,
}

impl Row {
    /// Returns the row of a record in a recording that begins at `start_ns`, of a hand of so many joints.
    pub fn of(decoded: Decoded, start_ns: u64, joint_count: usize) -> Self {
        let mut told = Vec::with_capacity(32 + 3 * joint_count);
        decoded.record.tell(|signal| match signal.value {
            value @ (Value::Counts(_) | Value::Reals(_) | Value::Limits(_)) => {
                told.extend((0..joint_count).map(|joint| value.of_joint(joint)));
            }
            Value::Missing => told.push(Value::Missing),
            Value::Whole(value) => told.push(Value::Whole(value)),
            Value::Count(value) => told.push(Value::Count(value)),
            Value::Real(value) => told.push(Value::Real(value)),
            Value::Truth(value) => told.push(Value::Truth(value)),
            Value::Mode(mode) => told.push(Value::Mode(mode)),
            Value::Fault(fault) => told.push(Value::Fault(fault)),
            Value::Joint(joint) => told.push(Value::Joint(joint)),
            Value::Answer(answer) => told.push(Value::Answer(answer)),
            Value::Notice(noticed) => told.push(Value::Notice(noticed)),
            Value::Limiting(limiting) => told.push(Value::Limiting(limiting)),
        });
        Self { decoded, start_ns, told }
    }
}

fn kind_of(kind: signals::Kind) -> Kind {
    match kind {
        signals::Kind::Whole | signals::Kind::Count | signals::Kind::Fault => Kind::Whole,
        signals::Kind::Real => Kind::Real,
        signals::Kind::Truth => Kind::Truth,
        signals::Kind::Mode
        | signals::Kind::Joint
        | signals::Kind::Answer
        | signals::Kind::Notice
        | signals::Kind::Limiting => Kind::Words,
    }
}

fn kind_of_derived(derived: Derived) -> Kind {
    match derived {
        Derived::Time | Derived::HostTime => Kind::Double,
        Derived::Session | Derived::LostBefore => Kind::Whole,
        Derived::Angle | Derived::Speed => Kind::Real,
    }
}

fn cell<'a>(value: Value<'_>, joint_names: &'a [String]) -> Cell<'a> {
    match value {
        Value::Missing | Value::Counts(_) | Value::Reals(_) | Value::Limits(_) => Cell::Missing,
        Value::Whole(value) => Cell::Whole(value.into()),
        Value::Count(value) => Cell::Whole(value.into()),
        Value::Real(value) => Cell::Real(value),
        Value::Truth(value) => Cell::Truth(value),
        Value::Mode(mode) => Cell::Word(mode.words()),
        Value::Fault(fault) => Cell::Whole(fault.number().into()),
        Value::Joint(joint) => {
            joint_names.get(usize::from(joint)).map_or(Cell::Missing, |name| Cell::Word(name))
        }
        Value::Answer(answer) => Cell::Text(answer.to_string()),
        Value::Notice(noticed) => Cell::Text(noticed.to_string()),
        Value::Limiting(limiting) => Cell::Word(&LIMITED_BY[usize::from(limiting.bits() & 15)]),
    }
}

/// Seconds from one time to another, which may be before it.
pub(super) fn seconds(at_ns: u64, start_ns: u64) -> f64 {
    (i128::from(at_ns) - i128::from(start_ns)) as f64 / 1e9
}

/// The likeliest of many names.
fn nearest<'a>(pattern: &str, known: impl Iterator<Item = &'a str>) -> String {
    let words = suggestion(pattern, known);
    if words.starts_with("did you mean") { words } else { "the names are".into() }
}

/// Returns `true` if a name is like a pattern in which `*` stands for anything.
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
    use blindgrasp_shared::control::GAINS;

    fn names(patterns: &[&str]) -> Result<Vec<String>, String> {
        let joints = ["thumb-1", "thumb-2", "index-1"].map(str::to_owned);
        let patterns: Vec<String> = patterns.iter().map(|&pattern| pattern.to_owned()).collect();
        let columns = Column::chosen(&joints, &patterns).map_err(|error| error.to_string())?;
        Ok(columns.into_iter().map(|column| column.name).collect())
    }

    #[test]
    fn signals_are_chosen_by_name_joint_signal_or_pattern() {
        let of_joint = Column::all(&[String::new()]).len() - Column::all(&[]).len();
        assert_eq!(names(&[]).unwrap().len(), Column::all(&[]).len() + 3 * of_joint);
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
        assert_eq!(names(&["index-1"]).unwrap().len(), 1 + of_joint);
        assert_eq!(names(&["*"]).unwrap(), names(&[]).unwrap());
        let potentials = GAINS.iter().map(|gain| gain.potential.key);
        assert_eq!(
            names(&["*potential*"]).unwrap(),
            ["time_s"].into_iter().chain(potentials).collect::<Vec<_>>()
        );
    }

    #[test]
    fn what_no_column_is_called_is_told_with_what_there_is() {
        let error = names(&["tick", "angel_rad"]).unwrap_err();
        assert!(error.contains("`angel_rad`; did you mean `angle_rad`?"), "{error}");
        assert!(error.contains("JOINT.limited_by; joints: thumb-1, thumb-2, index-1"), "{error}");
        assert!(names(&["pinky.*"]).is_err());
    }
}
