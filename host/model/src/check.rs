//! Checks of single values, and the errors that they make.

use super::error::SceneError;
use super::file::SCHEMA;

/// The result of a check.
pub(super) type Result<T> = std::result::Result<T, SceneError>;

/// Bytes of a name.
pub(super) const LONGEST_NAME: usize = 100;

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

/// Names that are all different.
pub(super) fn distinct<'a>(list: &str, names: impl Iterator<Item = &'a str>) -> Result<()> {
    let mut seen: Vec<&str> = Vec::new();
    for (index, word) in names.enumerate() {
        let key = item(list, index, "name");
        name(&key, word)?;
        if seen.contains(&word) {
            return fail(key, format!("`{word}` is there twice"), "rename one of them");
        }
        seen.push(word);
    }
    Ok(())
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
