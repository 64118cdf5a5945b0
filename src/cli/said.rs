//! An answer to what is wanted, from a live model or the recorded ones, and the task with its stages.
//!
//! What is wanted and flags come in; a plan that fits, with what was said, goes out. Imports llm and task.

use std::path::Path;

use super::ask::{AskArgs, ask};
use super::engine::Engine;
use super::wanted::{Planned, Wanted};
use crate::llm::prompt::plan_prompt;
use crate::llm::repair::Conversation;

/// An answer, and how it was come by.
#[derive(Default)]
pub struct Said {
    /// The answer's text, if there is one.
    pub response: Option<String>,
    /// Everything that was said, if a model was asked.
    pub conversation: Option<Conversation>,
}

/// Asks the model of the flags until an answer fits; without one, takes the recorded answer number `index`. What
/// was said in vain is kept beside `out`; `otherwise` says how an answer of one's own is given.
pub fn asked_or_recorded(
    wanted: &Wanted,
    engine: Engine,
    asking: &AskArgs,
    index: usize,
    out: &Path,
    otherwise: &str,
) -> anyhow::Result<(Planned, Said)> {
    let Some(mut model) = asking.model()? else {
        let (text, name) = wanted.recorded(index, asking.variant(), otherwise)?;
        return given(wanted, engine, text, &name);
    };
    let prompt = plan_prompt(asking.variant(), wanted.line("--llm")?);
    let judge = |text: &str| wanted.planned(engine, text).map_err(|unusable| unusable.for_model(text));
    let (planned, conversation) = ask(&mut *model, prompt, judge, out)?;
    let response = conversation.attempts.last().map(|attempt| attempt.answer.text.clone());
    Ok((planned, Said { response, conversation: Some(conversation) }))
}

/// The plan of an answer at hand; `name` is what messages call it.
pub fn given(wanted: &Wanted, engine: Engine, text: &str, name: &str) -> anyhow::Result<(Planned, Said)> {
    let mut planned = wanted.planned(engine, text).map_err(|unusable| unusable.explained(name))?;
    for warning in &mut planned.warnings {
        *warning = format!("{name}: {warning}");
    }
    Ok((planned, Said { response: Some(text.to_owned()), conversation: None }))
}
