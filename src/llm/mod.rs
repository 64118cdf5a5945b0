//! What the language model is asked, and what its answer becomes.
//!
//! An answer comes in as markdown ([`reply`] takes it apart, [`answer`] runs its code and checks it) and
//! goes out as [`stage::Stage`]s. Prompts and recorded answers are embedded ([`recorded`]). Imports `math`
//! and `stagecode`.

pub mod answer;
mod fields;
pub mod recorded;
pub mod reply;
pub mod stage;

pub use answer::{Answer, AnswerError, stages_from_answer};
