//! `blindgrasp hand`: hands as files.

mod check;
mod export;

use super::Outcome;
use clap::{Args, Subcommand};

/// Hands: check one, or write a URDF of it
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    Check(check::Arguments),
    Export(export::Arguments),
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match &arguments.action {
        Action::Check(arguments) => check::run(arguments),
        Action::Export(arguments) => export::run(arguments),
    }
}
