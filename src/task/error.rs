//! What can be wrong with a task or with a plan for it.
//!
//! Made by the other files of this module and printed by the command line, which ends with exit code 2; each
//! message is a sentence that names the thing at fault and the way out. Imports llm's errors.

use thiserror::Error;

use crate::llm::lineage::UnknownPiece;

/// A task that cannot be used.
#[derive(Debug, Error)]
pub enum TaskError {
    #[error(
        "there is no task `{name}`; {suggestion}the known tasks are {known}, or give the path of a .toml file"
    )]
    Unknown { name: String, suggestion: String, known: String },

    #[error("cannot read the task file `{path}`: {reason}; check the path, or name a task of `donut tasks`")]
    Read { path: String, reason: std::io::Error },

    #[error("{file}, line {line}, `{text}`: {message}; `donut tasks --show donut` explains every key")]
    Syntax { file: String, line: usize, text: String, message: String },

    #[error("{file}, line {line}: `{key}` {problem}")]
    Value { file: String, line: usize, key: String, problem: String },

    #[error("a task cannot be called `{name}`: {reason}")]
    Name { name: String, reason: &'static str },

    #[error("the text of --describe {problem}")]
    Description { problem: String },
}

/// Why a plan cannot be carried out in a task's world.
#[derive(Debug, Error, PartialEq)]
pub enum StageError {
    #[error("the plan has no step that uses a tool; ask for another answer")]
    Empty,

    #[error("step {step} names no tool; this task has {known}")]
    NoTool { step: u32, known: String },

    #[error(
        "step {step} uses the tool `{tool}`, which this task does not have; it has {known}: add a [[tools]] \
         table or ask for another answer"
    )]
    UnknownTool { step: u32, tool: String, known: String },

    #[error(transparent)]
    UnknownPiece(#[from] UnknownPiece),

    #[error("step {step} makes no piece of dough; its output variables must be arrays of points")]
    NoOutput { step: u32 },

    #[error("step {step} makes `{name}` with {problem}; correct its code or ask for another answer")]
    BadCloud { step: u32, name: String, problem: String },

    #[error(
        "step {step} puts `{name}` {excess_m:.3} m outside the workspace: it reaches {axis} = {reach_m:.3} m, \
         and the workspace ends at {limit_m:.3} m; a smaller shape is needed, or a smaller llm_unit_m"
    )]
    OutsideWorkspace { step: u32, name: String, axis: char, reach_m: f64, limit_m: f64, excess_m: f64 },
}

/// A value that a check refuses: a dotted key (`tools.1.friction`) and what is wrong with it, phrased to
/// follow the key ("is -1, but must be positive").
#[derive(Clone, Debug, PartialEq)]
pub struct Complaint {
    pub key: String,
    pub problem: String,
}

impl Complaint {
    /// A complaint about the value at `key`.
    pub fn new(key: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { key: key.into(), problem: problem.into() }
    }
}

impl TaskError {
    /// An unknown task name, with the nearest known one if it is near enough to be a slip.
    pub fn unknown(name: &str, known: &[&str]) -> Self {
        let nearest = known.iter().min_by_key(|candidate| edit_distance(name, candidate));
        let suggestion = match nearest {
            Some(near) if edit_distance(name, near) <= 1 + near.len() / 3 => {
                format!("did you mean `{near}`? otherwise, ")
            }
            _ => String::new(),
        };
        Self::Unknown { name: name.to_string(), suggestion, known: known.join(", ") }
    }
}

/// Levenshtein distance: insertions, deletions and replacements from `a` to `b`.
fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.chars().enumerate() {
            let replaced = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.chars().count()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_task_lists_the_known_and_suggests_the_nearest() {
        let slip = TaskError::unknown("dnout", &["donut", "cut"]).to_string();
        assert!(slip.contains("did you mean `donut`?") && slip.contains("donut, cut"), "{slip}");
        let other = TaskError::unknown("croissant", &["donut", "cut"]).to_string();
        assert!(!other.contains("did you mean"), "{other}");
    }

    #[test]
    fn edit_distances() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("same", "same"), 0);
    }
}
