//! The sandbox for CPython: which programs there are, and the bubblewrap command around them.
//!
//! `PATH` is searched; a command that has no network, no home directory and a read-only system goes out, or the
//! reason why there is none. Imports nothing of donut.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Why there is no sandboxed Python.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EngineError {
    /// No bubblewrap.
    #[error(
        "--engine python runs code only in a sandbox, and there is no `bwrap` in PATH; install bubblewrap, or leave --engine away"
    )]
    NoBubblewrap,
    /// No interpreter.
    #[error("--engine python needs `python3`, and there is none in PATH; install it, or leave --engine away")]
    NoPython,
    /// An interpreter without numpy.
    #[error("--engine python needs numpy, and python3 has none ({0}); install it, or leave --engine away")]
    NoNumpy(String),
    /// Bubblewrap that may not or cannot do its work.
    #[error(
        "the sandbox of --engine python does not start ({0}); bubblewrap needs unprivileged user namespaces: allow them, or leave --engine away"
    )]
    Refused(String),
}

/// Where Python is, as it tells itself: one path a line.
const TELL: &str = "import os, sys, numpy\n\
    for p in (sys.executable, sys.prefix, sys.base_prefix, os.path.dirname(os.path.dirname(numpy.__file__))): print(p)";

/// Directories of the system that programs need to run.
const SYSTEM: &[&str] = &[
    "/usr",
    "/lib",
    "/lib32",
    "/lib64",
    "/bin",
    "/etc/ld.so.cache",
    "/etc/ld.so.conf",
    "/etc/alternatives",
    "/nix/store",
];

/// The command that runs `script` with `argument` in the sandbox, with all three streams still to be said.
pub fn command(script: &str, argument: &str) -> Result<Command, EngineError> {
    let bwrap = in_path("bwrap").ok_or(EngineError::NoBubblewrap)?;
    let python = in_path("python3").ok_or(EngineError::NoPython)?;
    let told = Command::new(&python).args(["-c", TELL]).stdin(Stdio::null()).output();
    let told = told.map_err(|_| EngineError::NoPython)?;
    if !told.status.success() {
        let errors = String::from_utf8_lossy(&told.stderr).into_owned();
        let last = errors.lines().last().unwrap_or("it does not run").trim().to_owned();
        return Err(EngineError::NoNumpy(last));
    }
    let told = String::from_utf8_lossy(&told.stdout).into_owned();
    let paths: Vec<&str> = told.lines().collect();
    let [executable, prefix, base, site] = paths[..] else { return Err(EngineError::NoPython) };

    let mut command = Command::new(bwrap);
    command.args(["--unshare-all", "--die-with-parent", "--new-session", "--cap-drop", "ALL", "--clearenv"]);
    command.args(["--proc", "/proc", "--dev", "/dev", "--tmpfs", "/tmp", "--chdir", "/tmp"]);
    for path in SYSTEM {
        command.args(["--ro-bind-try", path, path]);
    }
    for path in [prefix, base, site] {
        if !SYSTEM.iter().any(|s| Path::new(path).starts_with(s)) {
            command.args(["--ro-bind", path, path]);
        }
    }
    // Threads of a numerical library would each reserve memory.
    for (name, value) in
        [("PYTHONPATH", site), ("OPENBLAS_NUM_THREADS", "1"), ("OMP_NUM_THREADS", "1"), ("LC_ALL", "C.UTF-8")]
    {
        command.args(["--setenv", name, value]);
    }
    command.args(["--", executable, "-s", "-B", "-c", script, argument]);
    Ok(command)
}

/// The program of a name in `PATH`.
fn in_path(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file())
}
