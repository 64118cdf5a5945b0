//! `--engine`: what runs the code of an answer.
//!
//! An answer's text and a choice come in; stages and warnings go out. Imports `llm` and `stagecode`.

use anyhow::{Result, anyhow};
use clap::ValueEnum;
use tracing::warn;

use crate::llm::answer::stages_by;
use crate::llm::{Answer, AnswerError, stages_from_answer};
use crate::stagecode::{Limits, Python};

/// What runs the code of an answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// donut's own evaluator: a subset of Python and numpy, under limits, nothing installed.
    #[default]
    Builtin,
    /// CPython with numpy, shut into a bubblewrap sandbox without network and files.
    Python,
}

impl Engine {
    /// The stages of an answer; its warnings go to standard error. `name` is what messages call it.
    pub fn answered(self, text: &str, name: &str) -> Result<Answer> {
        let answer = self.run(text)?.map_err(|error| explained(name, &error))?;
        for warning in &answer.warnings {
            warn!("{name}: {warning}");
        }
        Ok(answer)
    }

    /// The stages of an answer. The outer error says why the engine cannot start.
    pub fn run(self, text: &str) -> Result<Result<Answer, AnswerError>> {
        Ok(match self {
            Self::Builtin => stages_from_answer(text),
            Self::Python => stages_by(&mut Python::start(&Limits::default())?, text),
        })
    }
}

/// The error as `main` prints it: the file, the place, and the way out on a line of its own.
pub fn explained(file: &str, error: &AnswerError) -> anyhow::Error {
    match error.hint() {
        Some(hint) => anyhow!("{file}: {error}\nhint: {hint}"),
        None => anyhow!("{file}: {error}"),
    }
}
