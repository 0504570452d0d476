//! `blindgrasp scene`: scenes as files.

mod export;
mod new;
mod show;

use super::Outcome;
use clap::{Args, Subcommand};

/// Scenes: place an object in a hand, and write a scene file of it; export scenes
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    New(new::Arguments),
    Export(export::Arguments),
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match &arguments.action {
        Action::New(arguments) => new::run(arguments),
        Action::Export(arguments) => export::run(arguments),
    }
}
