//! One line that says where, which key, what is wrong, and what to do.

use std::ffi::OsStr;
use std::{fmt, sync::Arc};

/// Longer messages are cut, bytes.
const LONGEST_LINE: usize = 800;
/// Longer words are not compared, bytes.
const LONGEST_WORD: usize = 100;

/// The place that a value comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// A file's name, the name of something built in, or `--set`.
    pub source: Arc<str>,
    /// Line, from 1; 0 where lines mean nothing.
    pub line: usize,
}

impl Place {
    /// A place without a line.
    pub fn whole(source: &str) -> Self {
        Self { source: source.into(), line: 0 }
    }

    /// A file, without a line.
    pub(super) fn of_path(path: &OsStr) -> Self {
        Self::whole(&path.to_string_lossy())
    }

    /// Returns `true` if it is in a file, and not on the command line.
    pub(super) fn is_in_a_file(&self) -> bool {
        !matches!(&*self.source, "--set" | "--vary")
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}", self.source),
            line => write!(f, "{}:{line}", self.source),
        }
    }
}

/// An error for which a scene can't be run. One line: `file:line: key: what is wrong; remedy`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.line())]
pub struct SceneError {
    /// The place; nowhere for scenes built in code.
    pub place: Option<Place>,
    /// The key, as `--set` takes it; empty where it is about the file as a whole.
    pub key: String,
    /// The fault.
    pub problem: String,
    /// The remedy; may be empty.
    pub remedy: String,
}

impl SceneError {
    /// An error about a key whose place is still to be found.
    pub fn new(key: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { place: None, key: key.into(), problem: problem.into(), remedy: remedy.into() }
    }

    pub(crate) fn at(mut self, place: &Place) -> Self {
        self.place.get_or_insert_with(|| place.clone());
        self
    }

    fn line(&self) -> String {
        let mut line = String::new();
        if let Some(place) = &self.place {
            line = format!("{place}: ");
        }
        if !self.key.is_empty() {
            line = line + &self.key + ": ";
        }
        line += &self.problem;
        if !self.remedy.is_empty() {
            line = line + "; " + &self.remedy;
        }
        one_line(&line)
    }
}

/// A text without control characters, cut where it is too long: keys and names come from files and may contain anything.
pub(crate) fn one_line(text: &str) -> String {
    let mut clean = String::new();
    for c in text.chars() {
        if clean.len() > LONGEST_LINE {
            return clean + " ...";
        }
        if c.is_control() {
            clean.extend(c.escape_debug());
        } else {
            clean.push(c);
        }
    }
    clean
}

/// `did you mean ...`, or everything there is.
pub fn suggestion<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let likeness = |candidate: &str| match word.len().max(candidate.len()) {
        0..=LONGEST_WORD => strsim::jaro_winkler(word, candidate),
        _ => 0.0,
    };
    let best = known.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    match best {
        Some(best) if likeness(best) > 0.8 => format!("did you mean `{best}`?"),
        Some(_) => format!("known: {}", known.join(", ")),
        None => "nothing is known here".into(),
    }
}
