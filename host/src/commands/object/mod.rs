//! `blindgrasp object`: objects as files.

mod check;
mod new;

use super::Outcome;
use blindgrasp::model::mesh::Unit;
use blindgrasp::model::suggestion;
use clap::{Args, Subcommand};

/// Objects: check one; make one from an STL or OBJ file
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    Check(check::Arguments),
    New(new::Arguments),
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match &arguments.action {
        Action::Check(arguments) => check::run(arguments),
        Action::New(arguments) => new::run(arguments),
    }
}

/// A unit on the command line.
fn unit(word: &str) -> Result<Unit, String> {
    Unit::of(word).ok_or_else(|| suggestion(word, Unit::ALL.map(Unit::word)))
}
