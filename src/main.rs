//! The `donut` binary: parses the command line, calls [`donut::cli`], prints errors with a remedy.

fn main() -> std::process::ExitCode {
    donut::cli::main()
}
