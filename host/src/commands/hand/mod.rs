//! `blindgrasp hand`: hands as files.

mod check;
mod export;
mod new;
mod tune;

use super::Outcome;
use clap::{Args, Subcommand};

/// Hands: start one from a URDF, check one, tune one, write one as a URDF
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    New(new::Arguments),
    Check(check::Arguments),
    Export(export::Arguments),
    Tune(tune::Arguments),
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match &arguments.action {
        Action::New(arguments) => new::run(arguments),
        Action::Check(arguments) => check::run(arguments),
        Action::Export(arguments) => export::run(arguments),
        Action::Tune(arguments) => tune::run(arguments),
    }
}
