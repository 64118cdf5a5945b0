//! The texts that are sent to a language model, from `prompts/`.
//!
//! A task's line, or what is wrong with an answer, comes in; the text goes out, byte for byte as it is sent. The
//! recorded answers belong to exactly these texts. Imports `recorded`.

use super::recorded::{PLAN, PLAN_WITHOUT_VOLUME_REASONING};

/// What asks again; `{problem}` stands for what is wrong.
const REPAIR: &str = include_str!("../../prompts/repair.md");

/// Which of the prompts for a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Variant {
    /// The whole prompt.
    #[default]
    Full,
    /// Without the parts on volume and on chain reasoning, the paper's ablation.
    WithoutVolumeReasoning,
}

/// The prompt for a task: the text shared by all tasks, and the task's line behind it.
pub fn plan_prompt(variant: Variant, task_line: &str) -> String {
    let shared = match variant {
        Variant::Full => PLAN,
        Variant::WithoutVolumeReasoning => PLAN_WITHOUT_VOLUME_REASONING,
    };
    format!("{shared}{}\n", task_line.trim())
}

/// What is said to a model about an answer that cannot be used.
pub fn repair_prompt(problem: &str) -> String {
    REPAIR.replacen("{problem}", problem, 1)
}
