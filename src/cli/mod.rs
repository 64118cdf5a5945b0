//! The command line: one file a subcommand. Parses flags, calls the library, prints results.
//!
//! Exit codes: 0 the command did what it was asked (for `plan`: the target was reached), 1 `plan`
//! ran to its end without reaching the target's threshold, or `gradcheck` found a wrong gradient, 2 an error. Results go to standard
//! output, progress and errors to standard error.

mod ask;
mod bench;
mod bench_emd;
mod check;
mod emd;
mod engine;
mod eval;
mod gradcheck;
mod pieces_table;
mod plan;
mod progress;
mod prompt;
mod record;
mod simulate;
mod subgoals;
mod tasks;
mod view;
mod wanted;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::sim::Params;

/// Plans how to shape dough with tools.
#[derive(Parser)]
#[command(version, about, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Plan(plan::PlanArgs),
    Tasks(tasks::TasksArgs),
    Check(check::CheckArgs),
    View(view::ViewArgs),
    Prompt(prompt::PromptArgs),
    Subgoals(subgoals::SubgoalsArgs),
    Eval(eval::EvalArgs),
    Emd(emd::EmdArgs),
    Simulate(simulate::SimulateArgs),
    Gradcheck(gradcheck::GradcheckArgs),
    Bench(bench::BenchArgs),
}

/// Says on standard error that a scene violates the stability bound. Tasks that do are refused; scenes are
/// experiments.
fn warn_if_unstable(file: &str, params: &Params) {
    if let Some(problem) = params.instability() {
        eprintln!("warning: {file}: {problem}");
    }
}

/// Runs the program; the whole of `main`.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome: anyhow::Result<ExitCode> = match cli.command {
        Command::Plan(args) => plan::run(&args),
        Command::Tasks(args) => tasks::run(args).map(|()| ExitCode::SUCCESS),
        Command::Check(args) => check::run(args).map(|()| ExitCode::SUCCESS),
        Command::View(args) => view::run(&args),
        Command::Prompt(args) => prompt::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Subgoals(args) => subgoals::run(&args),
        Command::Eval(args) => eval::run(&args),
        Command::Emd(args) => emd::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Gradcheck(args) => gradcheck::run(&args),
        Command::Bench(args) => bench::run(&args),
    };
    match outcome {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
