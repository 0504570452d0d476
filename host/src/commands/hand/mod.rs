//! `blindgrasp hand`: what can be done with a hand alone.

mod check;

use super::Outcome;
use clap::{Args, Subcommand};

/// Check a hand
#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Check(check::Arguments),
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match &arguments.command {
        Command::Check(arguments) => check::run(arguments),
    }
}
