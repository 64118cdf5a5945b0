//! The door to a language model: a conversation goes through it, an answer comes back.
//!
//! Behind it are live models ([`super::live`]) and, in `store`, recordings of them. Every error is a sentence
//! with the way out; none ever holds a key. Imports nothing of donut.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Who speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// donut.
    User,
    /// The model.
    Assistant,
}

/// One contribution to a conversation.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Message {
    /// Whose it is.
    pub role: Role,
    /// What is said, verbatim.
    pub text: String,
}

impl Message {
    /// What donut says.
    pub fn user(text: impl Into<String>) -> Self {
        Self { role: Role::User, text: text.into() }
    }

    /// What the model said.
    pub fn assistant(text: impl Into<String>) -> Self {
        Self { role: Role::Assistant, text: text.into() }
    }
}

/// What a model answered.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Completion {
    /// The answer. A server's separate record of the model's thinking is not part of it.
    pub text: String,
    /// What the server calls the model that answered, where it says so: often with a date in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answered_by: Option<String>,
    /// Length of the conversation in tokens, where the server counts them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input_tokens: Option<u64>,
    /// Length of the answer in tokens, where the server counts them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub output_tokens: Option<u64>,
}

/// Something that answers.
pub trait Model {
    /// `PROVIDER:MODEL`, as records and messages name it.
    fn name(&self) -> String;

    /// The answer to a conversation, whose last message is donut's.
    ///
    /// # Errors
    /// [`ModelError`] when there is no whole answer.
    fn complete(&mut self, conversation: &[Message]) -> Result<Completion, ModelError>;
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // The fields are what the messages say they are.
pub enum ModelError {
    #[error(
        "{variable} is not set, and {server} needs a key; export it, or give the address of another server \
         with --llm-url"
    )]
    MissingKey { variable: &'static str, server: String },

    #[error("{variable} cannot be sent: it has a character that no key has; export it without line breaks")]
    BadKey { variable: &'static str },

    #[error(
        "`{url}` is no address of a server ({reason}); give one such as http://127.0.0.1:8000/v1 with --llm-url"
    )]
    BadUrl { url: String, reason: String },

    #[error("donut cannot set up an encrypted connection: {reason}; install the system's CA certificates")]
    Tls { reason: String },

    #[error("{url} cannot be reached after {}: {reason}; is the server running, and is this its address? \
             See --llm-url", Attempts(*.attempts))]
    Unreachable { url: String, attempts: u32, reason: String },

    #[error("{url} has not answered within {seconds} s; raise --llm-timeout, or take a faster model")]
    TimedOut { url: String, seconds: u64 },

    #[error("{url} refuses the key ({status}): {said}; check {variable}")]
    KeyRefused { url: String, status: u16, said: String, variable: &'static str },

    #[error(
        "{url} has no model `{model}` there ({status}): {said}; check the model's name, and the server's \
         address (--llm-url)"
    )]
    NotFound { url: String, status: u16, model: String, said: String },

    #[error(
        "{url} says that the account's quota is used up ({status}): {said}; add to it, or take another model"
    )]
    QuotaUsedUp { url: String, status: u16, said: String },

    #[error("{url} refuses the request ({status}): {said}; check the model's name and --llm-max-tokens")]
    Refused { url: String, status: u16, said: String },

    #[error(
        "{url} sends its callers elsewhere ({status}), where donut does not follow with a key; give the \
             server's own address with --llm-url"
    )]
    Redirected { url: String, status: u16 },

    #[error("{url} still fails after {} ({status}): {said}; try again later, or take another model",
            Attempts(*.attempts))]
    Busy { url: String, attempts: u32, status: u16, said: String },

    #[error(
        "{url} asks to wait {seconds} s ({status}): {said}; that is longer than donut waits: try again then"
    )]
    WaitTooLong { url: String, seconds: u64, status: u16, said: String },

    #[error("the answer of {url} breaks off after {bytes} bytes, in {}; try again, or look for what cuts it \
             off on the way", Attempts(*.attempts))]
    BrokenOff { url: String, attempts: u32, bytes: usize },

    #[error(
        "{url} answers in no form that donut knows: {what}; is it an API of this provider? See --llm-url"
    )]
    UnknownForm { url: String, what: String },

    #[error("the answer of {url} is longer than {limit} bytes, which no plan is; ask another model")]
    TooLong { url: String, limit: usize },

    #[error("{url} sent an empty answer ({what}); try again, or take another model")]
    Empty { url: String, what: String },

    #[error("the model's answer was cut off at its length limit{}; raise --llm-max-tokens, or take a model \
             that thinks less", Tokens(*.tokens))]
    CutOff { tokens: Option<u64> },

    #[error("the model declined to answer: {said}; word the task otherwise, or take another model")]
    Declined { said: String },

    /// Of a recording.
    #[error(transparent)]
    Recording(Box<dyn std::error::Error + Send + Sync>),
}

/// "1 attempt", "5 attempts".
struct Attempts(u32);

impl fmt::Display for Attempts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} attempt{}", self.0, if self.0 == 1 { "" } else { "s" })
    }
}

/// " of 500 tokens", or nothing.
struct Tokens(Option<u64>);

impl fmt::Display for Tokens {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.map_or(Ok(()), |tokens| write!(f, " of {tokens} tokens"))
    }
}
