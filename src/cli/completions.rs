//! `donut completions`: what a shell needs to complete donut's command line.
//!
//! A shell's name comes in; its script goes to standard output. Imports the command line itself.

use anyhow::Result;
use clap::{Args, CommandFactory};
use clap_complete::{Shell, generate};

use super::stdout;

/// Prints a shell's completions for donut.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    donut completions bash > ~/.local/share/bash-completion/completions/donut\n  \
    donut completions zsh > ~/.zfunc/_donut          with ~/.zfunc in your fpath\n  \
    donut completions fish > ~/.config/fish/completions/donut.fish")]
pub struct CompletionsArgs {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Prints the script.
pub fn run(args: &CompletionsArgs) -> Result<()> {
    let mut script = Vec::new();
    generate(args.shell, &mut super::Cli::command(), "donut", &mut script);
    Ok(stdout::text(String::from_utf8_lossy(&script))?)
}
