//! The command line, a file a command.

pub(crate) mod console;
pub(crate) mod export;
#[cfg(feature = "probe")]
pub(crate) mod flash;
pub(crate) mod hand;
#[cfg(feature = "monitor")]
pub(crate) mod monitor;
mod not_built;
pub(crate) mod object;
#[cfg(feature = "paper")]
pub(crate) mod paper;
pub(crate) mod pil;
mod ports;
mod progress;
mod reading;
pub(crate) mod record;
pub(crate) mod recording;
pub(crate) mod replay;
pub(crate) mod scene;
#[cfg(unix)]
pub(crate) mod serve;
pub(crate) mod sim;
#[cfg(feature = "sweep")]
pub(crate) mod sweep;

#[allow(unused_imports)]
pub(crate) use not_built::*;

/// The end of a command that was not misused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It showed what it should: exit code 0.
    Shown,
    /// It ran, and failed to show it (the grasp was lost, bits differ): exit code 1.
    Failed,
}

/// An error and its causes, in a line; a cause whose words stand there already is not told again.
pub(crate) fn in_a_line(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for words in error.chain().map(ToString::to_string) {
        if !line.contains(&words) {
            line += if line.is_empty() { "" } else { ": " };
            line += &words;
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_told_once() {
        let full = || std::io::Error::other("the disk is full");
        let table = blindgrasp::record::table::TableError::from(full());
        assert_eq!(in_a_line(&table.into()), "cannot write the table: the disk is full");
        let error =
            anyhow::Error::from(full()).context("cannot write a.csv").context("the export has failed");
        assert_eq!(in_a_line(&error), "the export has failed: cannot write a.csv: the disk is full");
    }
}
