//! The command line: one file a subcommand. Parses flags, calls the library, prints results.
//!
//! Exit codes: 0 the command did what it was asked (for `plan`: the target was reached), 1 `plan`
//! ran to its end without reaching the target's threshold, 2 an error. Results go to standard
//! output, progress and errors to standard error.

mod emd;
mod npy;

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
    Emd(emd::Args),
}

/// Runs the program; the whole of `main`.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome: anyhow::Result<ExitCode> = match cli.command {
        Command::Emd(args) => emd::run(&args),
    };
    match outcome {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
