//! What the command line can do, a file a command.

pub(crate) mod console;
pub(crate) mod export;
pub(crate) mod flash;
pub(crate) mod hand;
pub(crate) mod monitor;
pub(crate) mod object;
mod output;
pub(crate) mod paper;
pub(crate) mod pil;
mod ports;
pub(crate) mod record;
mod recording;
pub(crate) mod replay;
pub(crate) mod scene;
#[cfg(unix)]
pub(crate) mod serve;
pub(crate) mod sim;
pub(crate) mod sweep;

/// How a command ended that was not misused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It showed what it should: exit code 0.
    Shown,
    /// It ran, and failed to show it (the grasp was lost, bits differ): exit code 1.
    Failed,
}
