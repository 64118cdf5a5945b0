//! CPython in a sandbox, for code beyond the evaluator's subset.
//!
//! Blocks of code come in as for [`super::Session`], arrays go out; in between is a process of python3 that
//! `sandbox` has shut in. It is asked over a pipe and answers with JSON and .npy, of which nothing is trusted: sizes
//! are checked before they are believed, and who does not answer in time is killed. Imports `limits`, `error`.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use ndarray::ArrayD;
use ndarray_npy::ReadNpyExt;
use serde_json::{Value, json};

use super::error::{CodeError, Fault};
use super::limits::Limits;
use super::sandbox::{self, EngineError};
use super::session::{Captured, Interpreter};

const HARNESS: &str = include_str!("harness.py");
/// Address space of the process, bytes: numpy itself takes some hundred million.
const MEMORY_BYTES: u64 = 4 << 30;
/// Time that Python has to start, seconds.
const START_SECONDS: u64 = 60;

/// A message of the process: the JSON, and the bytes behind it.
type Message = Option<(Value, Vec<u8>)>;

/// A running sandboxed Python.
pub struct Python {
    child: Child,
    requests: ChildStdin,
    replies: Receiver<Message>,
    deadline: Instant,
    seconds: u64,
}

impl Python {
    /// Starts the sandbox. The time limit of all code together begins to run.
    pub fn start(limits: &Limits) -> Result<Self, EngineError> {
        let seconds = limits.seconds.clamp(1.0, 3600.0).ceil() as u64;
        let told =
            json!({ "elements": limits.elements, "memory_bytes": MEMORY_BYTES, "cpu_seconds": seconds + 1 });
        let mut command = sandbox::command(HARNESS, &told.to_string())?;
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let refused = |error: std::io::Error| EngineError::Refused(error.to_string());
        let mut child = command.spawn().map_err(refused)?;
        let (Some(requests), Some(replies)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(EngineError::Refused("it has no pipes".into()));
        };
        let replies = read_in_background(replies, limits.clone());
        let deadline = Instant::now() + Duration::from_secs(START_SECONDS);
        let mut python = Self { child, requests, replies, deadline, seconds };
        let ready = python.next();
        python.deadline = Instant::now() + Duration::from_secs(seconds);
        match ready {
            Ok((message, _)) if message["ready"].is_string() => Ok(python),
            Ok((message, _)) => Err(EngineError::NoNumpy(
                message["missing"].as_str().unwrap_or("it does not start").to_owned(),
            )),
            Err(_) => Err(EngineError::Refused(python.last_words())),
        }
    }

    /// Asks for something and waits for the reply.
    fn ask(&mut self, request: &Value) -> Result<(Value, Vec<u8>), Fault> {
        let mut line = request.to_string();
        line.push('\n');
        if self.requests.write_all(line.as_bytes()).and_then(|()| self.requests.flush()).is_err() {
            return Err(ended());
        }
        self.next()
    }

    fn next(&mut self) -> Result<(Value, Vec<u8>), Fault> {
        let left = self.deadline.saturating_duration_since(Instant::now());
        match self.replies.recv_timeout(left) {
            Ok(Some(message)) => Ok(message),
            Ok(None) | Err(RecvTimeoutError::Disconnected) => Err(ended()),
            Err(RecvTimeoutError::Timeout) => {
                self.stop();
                Err(Fault::limit("seconds of run time", self.seconds))
            }
        }
    }

    fn stop(&mut self) {
        // It may be gone already, which is as good.
        drop(self.child.kill());
        drop(self.child.wait());
    }

    /// What a sandbox that did not start has to say.
    fn last_words(&mut self) -> String {
        self.stop();
        let mut text = String::new();
        if let Some(errors) = self.child.stderr.take() {
            drop(errors.take(4096).read_to_string(&mut text));
        }
        text.lines().last().unwrap_or("it says nothing").trim().to_owned()
    }
}

impl Drop for Python {
    fn drop(&mut self) {
        self.stop();
    }
}

impl Interpreter for Python {
    fn run(&mut self, code: &str, first_line: usize, indent: usize) -> Result<(), CodeError> {
        let failed = |line, column, fault| Err(CodeError { line, column, fault });
        let (told, _) = match self.ask(&json!({ "do": "run", "code": code, "first_line": first_line })) {
            Ok(told) => told,
            Err(fault) => return failed(first_line, indent + 1, fault),
        };
        let Some(exception) = told["exception"].as_str() else { return Ok(()) };
        let number = |key: &str| told[key].as_u64().map_or(1, |n| n as usize);
        let message = told["message"].as_str().unwrap_or("").to_owned();
        let fault = match exception {
            "SyntaxError" => Fault::Syntax(message),
            _ => Fault::Raised { exception: exception.to_owned(), message },
        };
        let line = if number("line") == 0 { first_line } else { number("line") };
        failed(line, number("column") + indent, fault)
    }

    fn formula(&mut self, text: &str) -> Option<f64> {
        self.ask(&json!({ "do": "formula", "text": text })).ok()?.0["value"].as_f64()
    }

    fn capture(&mut self, name: &str) -> Captured {
        let Ok((told, bytes)) = self.ask(&json!({ "do": "capture", "name": name })) else {
            return Captured::Missing;
        };
        match told["kind"].as_str() {
            Some("array") => match ArrayD::<f64>::read_npy(&bytes[..]) {
                Ok(array) => {
                    Captured::Array { shape: array.shape().to_vec(), values: array.iter().copied().collect() }
                }
                Err(_) => Captured::Other("broken array".into()),
            },
            Some("other") => Captured::Other(told["type"].as_str().unwrap_or("value").to_owned()),
            _ => Captured::Missing,
        }
    }

    fn clouds(&mut self) -> Vec<String> {
        let Ok((told, _)) = self.ask(&json!({ "do": "clouds" })) else { return Vec::new() };
        let names = told["names"].as_array().map(Vec::as_slice).unwrap_or_default();
        names.iter().filter_map(|n| n.as_str().map(str::to_owned)).collect()
    }
}

fn ended() -> Fault {
    Fault::value("the sandboxed Python has ended without an answer, perhaps for want of memory or time")
}

/// Reads replies on a thread of its own, so that waiting for one can end.
fn read_in_background(replies: ChildStdout, limits: Limits) -> Receiver<Message> {
    let (send, receive) = sync_channel(1);
    std::thread::spawn(move || {
        let mut replies = BufReader::new(replies);
        loop {
            let message = read_message(&mut replies, &limits);
            let last = message.is_none();
            if send.send(message).is_err() || last {
                return;
            }
        }
    });
    receive
}

/// The next message, if it keeps to the form and the limits.
fn read_message(replies: &mut impl BufRead, limits: &Limits) -> Message {
    let mut line = Vec::new();
    replies.by_ref().take(limits.output_bytes as u64).read_until(b'\n', &mut line).ok()?;
    let told: Value = serde_json::from_slice(&line).ok()?;
    // The header of a .npy file takes some hundred bytes.
    let most = 8 * limits.elements as u64 + 4096;
    let count = told["bytes"].as_u64().unwrap_or(0);
    if count > most {
        return None;
    }
    let mut bytes = Vec::new();
    replies.take(count).read_to_end(&mut bytes).ok()?;
    (bytes.len() as u64 == count).then_some((told, bytes))
}
