//! All integration tests in one program: each program of its own would link the whole library again, and compile its
//! simulators. `cargo test --release --test all plan_command` runs those of one file.

mod answer_rewritings;
mod answer_variants;
mod answers;
mod bench_command;
mod check;
mod common;
mod emd;
mod eval_command;
mod eval_suites;
mod gradcheck_command;
mod llm;
mod mpm;
mod new_task;
mod pictures;
mod plan_ablations;
mod plan_breakdown;
mod plan_command;
mod python_engine;
mod report;
mod report_browser;
mod run_dir;
mod simulate_command;
mod stagecode;
mod stagecode_fuzz;
mod stagecode_programs;
mod subgoals_cli;
mod view_command;
