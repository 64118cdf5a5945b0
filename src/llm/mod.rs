//! What the language model is asked, and what its answer becomes.

pub mod answer;
pub mod recorded;
pub mod stage;
