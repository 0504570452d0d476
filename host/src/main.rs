//! The command `blindgrasp`. Results go to stdout, progress and errors to stderr.

#[macro_use]
mod terminal;
mod commands;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Blind grasping of polyhedral objects with a multi-fingered, torque-controlled hand
#[derive(Parser)]
#[command(name = "blindgrasp", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Sim(commands::sim::Arguments),
    Sweep(commands::sweep::Arguments),
    Hand(commands::hand::Arguments),
    Object(commands::object::Arguments),
    Paper(commands::paper::Arguments),
    Scene(commands::scene::Arguments),
    Pil(commands::pil::Arguments),
    Flash(commands::flash::Arguments),
    Console(commands::console::Arguments),
    Monitor(commands::monitor::Arguments),
    Record(commands::record::Arguments),
    #[cfg(unix)]
    Serve(commands::serve::Arguments),
    Replay(commands::replay::Arguments),
    Recording(commands::recording::Arguments),
    Export(commands::export::Arguments),
}

fn main() -> ExitCode {
    let command = Cli::parse().command;
    blindgrasp::files::protect_inputs();
    blindgrasp::device::interrupt::tidy_up();
    let outcome = match command {
        Command::Sim(arguments) => commands::sim::run(&arguments),
        Command::Sweep(arguments) => commands::sweep::run(&arguments),
        Command::Hand(arguments) => commands::hand::run(&arguments),
        Command::Object(arguments) => commands::object::run(&arguments),
        Command::Paper(arguments) => commands::paper::run(&arguments),
        Command::Scene(arguments) => commands::scene::run(&arguments),
        Command::Pil(arguments) => commands::pil::run(&arguments),
        Command::Flash(arguments) => commands::flash::run(&arguments),
        Command::Console(arguments) => commands::console::run(&arguments),
        Command::Monitor(arguments) => commands::monitor::run(&arguments),
        Command::Record(arguments) => commands::record::run(&arguments),
        #[cfg(unix)]
        Command::Serve(arguments) => commands::serve::run(&arguments),
        Command::Replay(arguments) => commands::replay::run(&arguments),
        Command::Recording(arguments) => commands::recording::run(&arguments),
        Command::Export(arguments) => commands::export::run(&arguments),
    };
    match outcome {
        Ok(commands::Outcome::Shown) => ExitCode::SUCCESS,
        Ok(commands::Outcome::Failed) => ExitCode::from(1),
        Err(error) => {
            eprintln!("blindgrasp: {}", commands::in_a_line(&error));
            ExitCode::from(2)
        }
    }
}
