//! `dibs`: from a mesh file to a tree, and queries on it, on the command line.

// Requirement: P-08

#[macro_use]
mod output;

mod build;
mod construction;
mod filter;
mod generate;
mod inspect;
mod manual;
mod mesh_file;
mod modes;
mod motion;
mod nodes;
mod overwrite;
mod query;
mod recorded;
mod stand_off;
mod stream;
mod stretch;
mod tool;
mod track;
mod tree_file;
mod view;
#[cfg(test)]
mod words;

use clap::{Arg, ArgAction, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;

/// Closest points on a deforming surface, by trees that never need refitting.
#[derive(Parser)]
#[command(name = "dibs", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Build a tree from a mesh file
    Build(build::Args),
    /// Find the stretch limits that a recorded motion needs
    Stretch(stretch::Args),
    /// Validate a tree file and show its properties and costs
    Inspect(inspect::Args),
    /// Find the surface point closest to a tool
    Query(query::Args),
    /// Follow a tool near a moving surface, tick by tick
    Track(track::Args),
    /// Filter the commands of a tool near a moving surface, tick by tick
    Filter(filter::Args),
    /// Write a web page in which the surface moves and the query runs
    View(view::Args),
    /// Send a motion, recorded or live, to a controller, over a serial line or a socket
    Stream(stream::Args),
    /// The same by another name, for a live source of other programs
    Bridge(stream::Args),
    /// Generate a procedural heart or brain
    Generate(generate::Args),
    /// Print the completion script of a shell
    Completions(manual::Completions),
    /// Print or write the manual page
    Man(manual::Man),
}

const EXAMPLES: &str = "\
Examples:
  dibs generate heart --triangles 10272 -o heart.ply --motion heart.pc2
  dibs build heart.ply -o heart.dibs --stretch 1.5
  dibs stretch heart.ply --motion heart.pc2 --limits heart.limits
  dibs inspect heart.dibs
  dibs query heart.dibs --tool capsule:0,0,60,0,0,200,4 --vertices heart.pc2 --frame 9
  dibs view heart.dibs --motion heart.pc2 -o heart.html
  dibs stream heart.dibs --motion heart.pc2 --to serial:/dev/ttyUSB0@921600 --quantise --loop

Lengths are in millimetres. Warnings and progress go to standard error, results to
standard output; --json makes them one JSON object. Bad input ends with exit code 1.";

/// The command line.
fn command() -> clap::Command {
    // `--margin -0.1` is a wrong number, which the command reports, and not an option.
    let with_value = |arg: Arg| match arg.get_action() {
        ArgAction::Set | ArgAction::Append => arg.allow_negative_numbers(true),
        _ => arg,
    };
    Cli::command().mut_subcommands(|command| command.mut_args(with_value))
}

fn main() -> ExitCode {
    let parsed = command().try_get_matches().and_then(|matches| Cli::from_arg_matches(&matches));
    let cli = match parsed {
        Ok(cli) => cli,
        Err(answer) => return output::answer(&answer),
    };
    let outcome = match cli.command {
        Command::Build(args) => build::run(&args),
        Command::Stretch(args) => stretch::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Query(args) => query::run(&args),
        Command::Track(args) => track::run(&args),
        Command::Filter(args) => filter::run(&args),
        Command::View(args) => view::run(&args),
        Command::Stream(args) | Command::Bridge(args) => stream::run(&args),
        Command::Generate(args) => generate::run(&args),
        Command::Completions(args) => manual::complete(&args),
        Command::Man(args) => manual::write(&args),
    };
    match outcome.and_then(|()| output::finish()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
