//! What the language model is asked, and what its answer becomes.
//!
//! An answer comes in as markdown ([`reply`] takes it apart, [`answer`] runs its code and checks it) and
//! goes out as [`stage::Stage`]s. Prompts and recorded answers are embedded ([`recorded`]); live models answer
//! through the door [`model::Model`] ([`live`]), and are asked again when an answer cannot be used ([`repair`]).
//! Imports `math` and `stagecode`.
//!
//! | file | what it holds |
//! |---|---|
//! | `reply`, `reader` | an answer taken apart, line by line, with `heading`, `fence`, `fields`, `keys` and `values` for its parts |
//! | `answer`, `answer_error` | its code run step by step; why there are no stages |
//! | `checks`, `lineage`, `tools` | what looks wrong; which piece becomes which; names of tools |
//! | `stage` | what comes out |
//! | `recorded` | prompts and recorded answers |
//! | `prompt` | what is sent |
//! | `model`, `live`, `openai`, `anthropic`, `http` | whom it is sent to |
//! | `repair` | asking again |

pub mod answer;
mod answer_error;
pub mod anthropic;
mod checks;
mod fence;
mod fields;
mod heading;
pub mod http;
mod keys;
pub mod lineage;
pub mod live;
pub mod model;
pub mod openai;
pub mod prompt;
mod reader;
pub mod recorded;
pub mod repair;
pub mod reply;
pub mod stage;
mod tools;
mod values;

pub use answer::{Answer, stages_from_answer};
pub use answer_error::AnswerError;
