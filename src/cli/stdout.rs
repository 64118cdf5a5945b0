//! Results on standard output.
//!
//! Text comes in; a reader that has closed the pipe is no error.

use std::fmt::Display;
use std::io::{ErrorKind, Result, Write, stdout};

/// Writes `text`, and whatever is still waiting. Where nobody reads on (`donut tasks | head -1`) the rest goes nowhere, and
/// the command ends as it would have.
///
/// # Errors
/// If the text cannot be written for another reason, such as a full disk.
pub fn text(text: impl Display) -> Result<()> {
    let mut out = stdout().lock();
    match write!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// Writes a line.
///
/// # Errors
/// As [`text`].
pub fn line(line: impl Display) -> Result<()> {
    text(format_args!("{line}\n"))
}
