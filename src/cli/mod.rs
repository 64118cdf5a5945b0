//! The command line: one file a subcommand. Parses flags, calls the library, prints results.
//!
//! Exit codes: 0 the command did what it was asked (for `plan`: the target was reached), 1 `plan`
//! ran to its end without reaching the target's threshold, 2 an error. Results go to standard
//! output, progress and errors to standard error.

mod bench;
mod check;
mod plan;
mod progress;
mod record;
mod simulate;
mod subgoals;
mod tasks;
mod view;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Plans how to shape dough with tools.
#[derive(Parser)]
#[command(version, about, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Simulate(simulate::SimulateArgs),
    View(view::ViewArgs),
    Tasks(tasks::TasksArgs),
    Plan(plan::PlanArgs),
    Bench(bench::BenchArgs),
    Check(check::CheckArgs),
    /// Parse a language model's answer, run its code, write its stages and clouds
    Subgoals(subgoals::Subgoals),
}

/// Runs the program; the whole of `main`.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome: anyhow::Result<ExitCode> = match cli.command {
        Command::Simulate(args) => simulate::run(&args),
        Command::View(args) => view::run(&args),
        Command::Tasks(args) => tasks::run(args).map(|()| ExitCode::SUCCESS),
        Command::Plan(args) => plan::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Check(args) => check::run(args).map(|()| ExitCode::SUCCESS),
        Command::Subgoals(flags) => subgoals::run(&flags),
    };
    match outcome {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
