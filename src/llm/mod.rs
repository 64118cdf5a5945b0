//! What the language model is asked, and what its answer becomes.
//!
//! An answer comes in as markdown ([`reply`] takes it apart, [`answer`] runs its code and checks it) and
//! goes out as [`stage::Stage`]s. Prompts and recorded answers are embedded ([`recorded`]); live models answer
//! through the door [`model::Model`] ([`live`]), and are asked again when an answer cannot be used ([`repair`]).
//! Imports `math` and `stagecode`.

pub mod answer;
pub mod anthropic;
mod fields;
pub mod http;
pub mod live;
pub mod model;
pub mod openai;
pub mod prompt;
pub mod recorded;
pub mod repair;
pub mod reply;
pub mod stage;

pub use answer::{Answer, AnswerError, stages_from_answer};
