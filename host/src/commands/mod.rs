//! What the command line can do, a file a command.

pub(crate) mod console;
pub(crate) mod export;
#[cfg(feature = "probe")]
pub(crate) mod flash;
pub(crate) mod hand;
#[cfg(feature = "monitor")]
pub(crate) mod monitor;
mod not_built;
pub(crate) mod object;
mod output;
#[cfg(feature = "paper")]
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
#[cfg(feature = "sweep")]
pub(crate) mod sweep;

#[allow(unused_imports)]
pub(crate) use not_built::*;

/// How a command ended that was not misused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It showed what it should: exit code 0.
    Shown,
    /// It ran, and failed to show it (the grasp was lost, bits differ): exit code 1.
    Failed,
}
