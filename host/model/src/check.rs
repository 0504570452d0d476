//! Checks of single values, and the errors that they make.

use super::error::SceneError;
use super::file::SCHEMA;

/// The result of a check.
pub(super) type Result<T> = std::result::Result<T, SceneError>;

/// Bytes of a name.
pub(super) const LONGEST_NAME: usize = 100;

/// The errors of a file, in the order in which they were found: a loader refuses the file for the first, a check tells them
/// all.
#[derive(Debug, Default)]
pub(crate) struct Refused(Vec<SceneError>);

impl Refused {
    /// Adds the error of a check that failed; of one that did not, returns the value.
    pub(super) fn take<T>(&mut self, checked: Result<T>) -> Option<T> {
        checked.map_err(|error| self.0.push(error)).ok()
    }

    /// Adds the errors of several checks.
    pub(super) fn take_all(&mut self, checked: impl IntoIterator<Item = Result<()>>) {
        self.0.extend(checked.into_iter().filter_map(Result::err));
    }

    /// Adds what is wrong with the names in a list; returns `true` if they are all different.
    pub(super) fn names<'a>(&mut self, list: &str, names: impl Iterator<Item = &'a str>) -> bool {
        let mut seen: Vec<&str> = Vec::new();
        let mut are_different = true;
        for (index, word) in names.enumerate() {
            let key = item(list, index, "name");
            self.take(name(&key, word));
            if seen.contains(&word) {
                are_different = false;
                self.take::<()>(fail(key, format!("`{word}` is there twice"), "rename one of them"));
            }
            seen.push(word);
        }
        are_different
    }

    /// Returns what was found in spite of the errors, if there are none.
    ///
    /// # Errors
    /// The first.
    pub(super) fn or<T>(self, found: Option<T>) -> Result<T> {
        let nothing = || SceneError::new("", "can't be used", "");
        self.0.into_iter().next().map_or_else(|| found.ok_or_else(nothing), Err)
    }
}

impl IntoIterator for Refused {
    type Item = SceneError;
    type IntoIter = std::vec::IntoIter<SceneError>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

pub(super) fn fail<T>(
    key: impl Into<String>,
    problem: impl Into<String>,
    remedy: impl Into<String>,
) -> Result<T> {
    Err(SceneError::new(key, problem, remedy))
}

/// A number within a range. Written so that NaN fails.
pub(super) fn within(key: &str, value: f64, low: f64, high: f64) -> Result<()> {
    if value >= low && value <= high {
        return Ok(());
    }
    let range = match (low, high) {
        (low, high) if low == -high => format!("has to be within {high:?} of zero"),
        (low, high) => format!("has to be between {low:?} and {high:?}"),
    };
    fail(key, format!("{value:?} is out of range"), range)
}

pub(super) fn all_within(key: &str, values: &[f64], largest: f64) -> Result<()> {
    values.iter().try_for_each(|&value| within(key, value, -largest, largest))
}

/// The key of an item of a list, as `--set` takes it.
pub(super) fn item(list: &str, index: usize, key: &str) -> String {
    format!("{list}.{}.{key}", index + 1)
}

/// The version of a file's format.
pub(super) fn schema(key: &str, version: u32) -> Result<()> {
    if version == SCHEMA {
        return Ok(());
    }
    let remedy = format!("write it as format {SCHEMA}");
    fail(key, format!("{version} is a format that this program does not know"), remedy)
}

/// A name that can be shown in one line.
pub(super) fn name(key: &str, word: &str) -> Result<()> {
    if word.is_empty() || word.len() > LONGEST_NAME || word.chars().any(char::is_control) {
        let remedy = format!("has to be a word of at most {LONGEST_NAME} bytes, without control characters");
        return fail(key, "is not a name", remedy);
    }
    Ok(())
}
