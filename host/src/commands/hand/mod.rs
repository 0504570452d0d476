//! `blindgrasp hand`: hands as files.

mod export;

use super::Outcome;
use clap::{Args, Subcommand};

/// Hands: write a URDF of one
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    Export(export::Arguments),
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match &arguments.action {
        Action::Export(arguments) => export::run(arguments),
    }
}
