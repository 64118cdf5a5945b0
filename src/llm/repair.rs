//! Asking until an answer can be used: the repair loop.
//!
//! A model, a prompt and a judge of answers come in; what the judge made of a good answer goes out, with the whole
//! [`Conversation`]. A bad answer is sent back with what is wrong with it, at most twice. Imports `model` and
//! `prompt`.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

use super::model::{Completion, Message, Model, ModelError};
use super::prompt::repair_prompt;

/// How often a bad answer is sent back.
pub const MAX_REPAIRS: usize = 2;

/// One answer, and what is wrong with it if it cannot be used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// What the model answered.
    #[serde(flatten)]
    pub answer: Completion,
    /// What is wrong with it, in the words that were sent back (or would have been, for the last).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

/// Everything that was said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Conversation {
    /// `PROVIDER:MODEL`.
    pub model: String,
    /// What was sent first.
    pub prompt: String,
    /// The answers in order.
    pub attempts: Vec<Attempt>,
}

impl Conversation {
    /// What the model sees when it is asked next.
    pub fn messages(&self) -> Vec<Message> {
        let mut messages = vec![Message::user(&self.prompt)];
        for attempt in &self.attempts {
            messages.push(Message::assistant(&attempt.answer.text));
            messages.extend(attempt.problem.as_deref().map(|problem| Message::user(repair_prompt(problem))));
        }
        messages
    }

    /// As text for people.
    pub fn to_text(&self) -> String {
        let mut text = format!("===== donut to {} =====\n\n{}\n", self.model, self.prompt.trim_end());
        for (index, attempt) in self.attempts.iter().enumerate() {
            let (number, answer) = (index + 1, attempt.answer.text.trim_end());
            // Writing to a string cannot fail.
            let _ = write!(text, "\n===== answer {number} =====\n\n{answer}\n");
            if let Some(problem) = &attempt.problem {
                let _ = write!(text, "\n===== what is wrong with answer {number} =====\n\n{problem}\n");
            }
        }
        text
    }
}

/// Why there is no usable answer.
#[derive(Debug, thiserror::Error)]
pub enum NoPlan {
    /// The model did not answer.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// It did, as often as it was asked, but not usably.
    #[error(
        "{} of {model} cannot be used; the last one: {problem}\nhint: ask another model, word the task \
         otherwise, or correct the answer and give it with --response", answers(*.attempts)
    )]
    Unusable {
        /// `PROVIDER:MODEL`.
        model: String,
        /// How many answers there were.
        attempts: usize,
        /// What is wrong with the last.
        problem: String,
    },
}

fn answers(count: usize) -> String {
    if count == 1 { "the answer".to_owned() } else { format!("all {count} answers") }
}

/// Asks for a plan until `judge` accepts an answer. `observe` gets the conversation after each answer; the judge's
/// error is what is sent back. The conversation comes back in either case.
pub fn ask<T>(
    model: &mut dyn Model,
    prompt: String,
    mut judge: impl FnMut(&str) -> Result<T, String>,
    mut observe: impl FnMut(&Conversation),
) -> (Conversation, Result<T, NoPlan>) {
    let mut conversation = Conversation { model: model.name(), prompt, attempts: Vec::new() };
    loop {
        let answer = match model.complete(&conversation.messages()) {
            Ok(answer) => answer,
            Err(error) => return (conversation, Err(error.into())),
        };
        let judged = judge(&answer.text);
        let problem = judged.as_ref().err().cloned();
        conversation.attempts.push(Attempt { answer, problem });
        observe(&conversation);
        let attempts = conversation.attempts.len();
        match judged {
            Ok(made) => return (conversation, Ok(made)),
            Err(problem) if attempts > MAX_REPAIRS => {
                let model = conversation.model.clone();
                return (conversation, Err(NoPlan::Unusable { model, attempts, problem }));
            }
            Err(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Says what it is told, and remembers what it was asked.
    struct Script {
        answers: Vec<&'static str>,
        asked: Vec<Vec<Message>>,
    }

    impl Model for Script {
        fn name(&self) -> String {
            "test:script".into()
        }

        fn complete(&mut self, conversation: &[Message]) -> Result<Completion, ModelError> {
            self.asked.push(conversation.to_vec());
            let text = self.answers[self.asked.len() - 1].to_owned();
            Ok(Completion { text, ..Completion::default() })
        }
    }

    fn judge(text: &str) -> Result<usize, String> {
        text.strip_prefix("good").map(str::len).ok_or_else(|| format!("`{text}` is not good"))
    }

    #[test]
    fn a_bad_answer_goes_back_with_what_is_wrong() {
        let mut model = Script { answers: vec!["bad", "good 1"], asked: vec![] };
        let mut seen = Vec::new();
        let (conversation, made) = ask(&mut model, "P".into(), judge, |c| seen.push(c.attempts.len()));
        assert_eq!((made.unwrap(), seen), (2, vec![1, 2]));
        assert_eq!(model.asked[0], [Message::user("P")]);
        assert_eq!(model.asked[1][..2], [Message::user("P"), Message::assistant("bad")]);
        assert!(model.asked[1][2].text.contains("\n`bad` is not good\n"), "{:?}", model.asked[1][2]);
        let problems: Vec<_> = conversation.attempts.iter().map(|a| a.problem.as_deref()).collect();
        assert_eq!(problems, [Some("`bad` is not good"), None]);
        let text = conversation.to_text();
        for part in ["donut to test:script =====\n\nP\n", "answer 1 =====\n\nbad\n", "good 1\n"] {
            assert!(text.contains(part), "{text}");
        }
    }

    #[test]
    fn after_two_repairs_it_is_over() {
        let mut model = Script { answers: vec!["a", "b", "c", "good"], asked: vec![] };
        let (conversation, made) = ask(&mut model, "P".into(), judge, |_| {});
        let error = made.unwrap_err().to_string();
        assert!(
            error.starts_with("all 3 answers of test:script cannot be used; the last one: `c`"),
            "{error}"
        );
        assert_eq!((model.asked.len(), conversation.attempts.len()), (3, 3));
        assert_eq!(model.asked[2].len(), 5);
    }

    #[test]
    fn a_conversation_goes_through_json() {
        let mut model = Script { answers: vec!["bad", "good"], asked: vec![] };
        let (conversation, _) = ask(&mut model, "P".into(), judge, |_| {});
        let json = serde_json::to_string(&conversation).unwrap();
        assert_eq!(serde_json::from_str::<Conversation>(&json).unwrap(), conversation);
    }
}
