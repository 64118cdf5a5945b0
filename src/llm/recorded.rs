//! The prompts, and answers that were recorded to exactly these prompts.
//!
//! Nothing comes in but a name; embedded text goes out, byte for byte as it was recorded, so that the
//! binary plans without a network and always the same. Imports nothing.

/// The prompt shared by all tasks; the line of the task is appended to it.
pub const PLAN: &str = include_str!("../../prompts/plan.md");

/// The same without the parts on volume and on chain reasoning.
pub const PLAN_WITHOUT_VOLUME_REASONING: &str =
    include_str!("../../prompts/plan-without-volume-reasoning.md");

/// What was sent and when, for each answer, as JSON.
pub const MANIFEST: &str = include_str!("../../prompts/recorded/manifest.json");

/// A recorded answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// The task, as its file is called.
    pub task: &'static str,
    /// Whether the prompt asked for reasoning about volume.
    pub volume_reasoning: bool,
    /// Counted from 1 within the task and prompt.
    pub index: usize,
    /// The answer.
    pub text: &'static str,
}

/// One answer of a task.
macro_rules! answer {
    ($task:literal, $volume:literal, $index:literal, $file:literal) => {
        Recorded {
            task: $task,
            volume_reasoning: $volume,
            index: $index,
            text: include_str!(concat!("../../prompts/recorded/", $task, "/", $file, ".md")),
        }
    };
}

/// The answers of one task to both prompts.
macro_rules! four_and_four {
    ($task:literal) => {
        [
            answer!($task, true, 1, "answer-1"),
            answer!($task, true, 2, "answer-2"),
            answer!($task, true, 3, "answer-3"),
            answer!($task, true, 4, "answer-4"),
            answer!($task, false, 1, "without-volume-reasoning-1"),
            answer!($task, false, 2, "without-volume-reasoning-2"),
            answer!($task, false, 3, "without-volume-reasoning-3"),
            answer!($task, false, 4, "without-volume-reasoning-4"),
        ]
    };
}

/// The answers of tasks that the paper does not have.
macro_rules! novel {
    ($($task:literal),*) => {
        [$(Recorded {
            task: $task,
            volume_reasoning: true,
            index: 1,
            text: include_str!(concat!("../../prompts/recorded/novel/", $task, ".md")),
        }),*]
    };
}

const DONUT: [Recorded; 8] = four_and_four!("donut");
const BAGUETTE: [Recorded; 8] = four_and_four!("baguette");
const TWO_PANCAKES: [Recorded; 8] = four_and_four!("two-pancakes");
const NOVEL: [Recorded; 6] =
    novel!("bagel", "breadstick", "button", "four-cookies", "move-and-flatten", "pizza-base");

/// All recorded answers.
pub fn all() -> impl Iterator<Item = &'static Recorded> {
    [&DONUT[..], &BAGUETTE, &TWO_PANCAKES, &NOVEL].into_iter().flatten()
}

/// The answer number `index` (from 1) to the full prompt for a task.
pub fn recorded(task: &str, index: usize) -> Option<&'static str> {
    find(task, true, index)
}

/// The answer number `index` (from 1) to the prompt without volume reasoning.
pub fn recorded_without_volume_reasoning(task: &str, index: usize) -> Option<&'static str> {
    find(task, false, index)
}

/// The name under which answers to a task's line are recorded, if there are any.
pub fn set_of_line(task_line: &str) -> Option<String> {
    let manifest: serde_json::Value = serde_json::from_str(MANIFEST).ok()?;
    let entry = manifest.as_array()?.iter().find(|entry| entry["task_line"] == task_line)?;
    entry["task"].as_str().map(str::to_owned)
}

/// How many answers a set has, to the prompt with reasoning about volume or the one without.
pub fn count(task: &str, volume_reasoning: bool) -> usize {
    all().filter(|r| r.task == task && r.volume_reasoning == volume_reasoning).count()
}

/// The names of all sets.
pub fn sets() -> Vec<&'static str> {
    let mut names: Vec<&str> = all().map(|r| r.task).collect();
    names.dedup();
    names
}

fn find(task: &str, volume_reasoning: bool, index: usize) -> Option<&'static str> {
    let wanted = (task, volume_reasoning, index);
    all().find(|r| (r.task, r.volume_reasoning, r.index) == wanted).map(|r| r.text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_answer_of_the_manifest_is_embedded() {
        let manifest: serde_json::Value = serde_json::from_str(MANIFEST).unwrap();
        assert_eq!(manifest.as_array().unwrap().len(), all().count());
        assert!(recorded("donut", 4).is_some() && recorded("bagel", 1).is_some());
        assert_eq!(set_of_line("Make it."), None);
        assert!(recorded("donut", 5).is_none() && recorded_without_volume_reasoning("bagel", 1).is_none());
    }
}
