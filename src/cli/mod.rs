//! The command line: one file a subcommand. Parses flags, calls the library, prints results.
//!
//! Exit codes: 0 the command did what it was asked (for `plan`: the target was reached), 1 `plan`
//! ran to its end without reaching the target's threshold, or `gradcheck` could not confirm a gradient, 2 an error. Results go to standard
//! output; progress, warnings and errors go to standard error, warnings and what `-v` shows as `tracing` events.

mod ask;
mod bench;
mod bench_emd;
mod bench_sim;
mod check;
mod completions;
mod emd;
mod engine;
mod eval;
mod gradcheck;
mod log;
mod memory;
mod new_task;
mod overrides;
mod pieces_table;
mod plan;
mod progress;
mod prompt;
mod record;
mod said;
mod simulate;
mod stdout;
mod subgoals;
mod tasks;
mod view;
mod wanted;

use std::path::Path;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::store::sim_scene::SimScene;

/// Plans how to shape dough with tools.
#[derive(Parser)]
#[command(
    version,
    about,
    arg_required_else_help = true,
    after_help = "Examples:\n  \
    donut plan --task donut             makes a donut from a recorded answer: no network, no keys\n  \
    donut tasks                         what else there is to make\n  \
    donut view runs/donut --gif d.gif   the run as a film; runs/donut/report.html shows it in a browser\n\n\
    `donut help COMMAND` has more examples. Exit status: 0 done, 1 a plan ended below its threshold or a gradient is \
    not confirmed, 2 an error."
)]
struct Cli {
    #[command(flatten)]
    log: log::LogArgs,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Plan(plan::PlanArgs),
    Tasks(tasks::TasksArgs),
    NewTask(new_task::NewTaskArgs),
    Check(check::CheckArgs),
    View(view::ViewArgs),
    Prompt(prompt::PromptArgs),
    Subgoals(subgoals::SubgoalsArgs),
    #[command(after_help = "Examples:\n  \
        donut eval --suite volume\n  \
        donut eval --suite volume --out results --json")]
    Eval(eval::EvalArgs),
    Emd(emd::EmdArgs),
    Simulate(simulate::SimulateArgs),
    Gradcheck(gradcheck::GradcheckArgs),
    Bench(bench::BenchArgs),
    Completions(completions::CompletionsArgs),
}

/// Says on standard error what is hardly meant in a scene, such as a substep above the stability bound. Tasks like that
/// are refused; scenes are experiments.
fn warn_of(file: &Path, scene: &SimScene) {
    scene.warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
    if let Some(problem) = scene.params.instability() {
        tracing::warn!("{}: {problem}", file.display());
    }
}

/// Runs the program; the whole of `main`.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    cli.log.start();
    let outcome: anyhow::Result<ExitCode> = match cli.command {
        Command::Plan(args) => plan::run(&args),
        Command::Tasks(args) => tasks::run(args).map(|()| ExitCode::SUCCESS),
        Command::NewTask(args) => new_task::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Check(args) => check::run(args).map(|()| ExitCode::SUCCESS),
        Command::View(args) => view::run(&args),
        Command::Prompt(args) => prompt::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Subgoals(args) => subgoals::run(&args),
        Command::Eval(args) => eval::run(&args),
        Command::Emd(args) => emd::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Gradcheck(args) => gradcheck::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Completions(args) => completions::run(&args).map(|()| ExitCode::SUCCESS),
    };
    match outcome {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    /// A shell's line as words: blanks part them, single quotes keep them together.
    fn words(line: &str) -> Vec<String> {
        let (mut words, mut word, mut quoted) = (Vec::new(), String::new(), false);
        for c in line.chars() {
            match c {
                '\'' => quoted = !quoted,
                ' ' if !quoted => words.push(std::mem::take(&mut word)),
                _ => word.push(c),
            }
        }
        words.push(word);
        words.retain(|word| !word.is_empty());
        words
    }

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_command_has_examples_that_it_understands() {
        let mut all = Cli::command();
        all.build();
        let commands = std::iter::once(&all).chain(all.get_subcommands().filter(|c| c.get_name() != "help"));
        for command in commands {
            let name = command.get_name();
            let help =
                command.get_after_help().unwrap_or_else(|| panic!("`{name}` has no examples")).to_string();
            let (_, examples) = help.split_once("Examples:\n").unwrap_or_else(|| panic!("`{name}`: {help}"));
            let lines: Vec<&str> =
                examples.lines().map(str::trim).filter(|l| l.starts_with("donut ")).collect();
            assert!(!lines.is_empty(), "`{name}`: {help}");
            for line in lines {
                // What is said about an example stands behind two blanks, where its output goes behind `>`.
                let call = line.split("  ").next().unwrap().split(" > ").next().unwrap();
                if let Err(error) = Cli::try_parse_from(words(call)) {
                    panic!("`{name}`: {call}: {error}");
                }
            }
        }
    }
}
