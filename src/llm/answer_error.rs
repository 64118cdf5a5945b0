//! Why an answer has no stages, and the ways out.
//!
//! Made by `answer`, printed by the command line and sent back to a language model. Imports `stagecode`.

use crate::stagecode::CodeError;

/// Why an answer has no stages.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // `line` and `step` are those of the answer, the rest is in the message.
pub enum AnswerError {
    #[error("line 1: the answer has no step")]
    NoSteps,
    #[error("line 1: the answer has no code")]
    NoCode,
    #[error("line {line}: the code fence is never closed")]
    UnclosedFence { line: usize },
    #[error("line {line}: step {step} has no code")]
    StepWithoutCode { line: usize, step: u32 },
    #[error("line {line}: step {step} names no tool")]
    NoTool { line: usize, step: u32 },
    #[error("line {line}: step {step} names the tool `{name}`, which is not known")]
    UnknownTool { line: usize, step: u32, name: String },
    #[error("line {line}: step {step} names several tools: {}", .names.join(", "))]
    SeveralTools { line: usize, step: u32, names: Vec<String> },
    #[error("line {line}: step {step} names no cloud that comes out of it")]
    NoOutput { line: usize, step: u32, clouds: Vec<String> },
    #[error("line {line}: step {step} names the cloud `{name}`, but its code does not define it")]
    MissingOutput { line: usize, step: u32, name: String, clouds: Vec<String> },
    #[error("line {line}: step {step}: `{name}` is {what}, not a cloud of shape (number of points, 3)")]
    NotACloud { line: usize, step: u32, name: String, what: String },
    #[error("line {line}: step {step}: point {point} of `{name}` is not finite")]
    NotFinite { line: usize, step: u32, name: String, point: usize },
    #[error("line {}, column {}: step {step}: {}", .error.line, .error.column, .error.fault)]
    Code { step: u32, error: CodeError },
}

impl AnswerError {
    /// A way out, where one is known.
    pub fn hint(&self) -> Option<String> {
        let defined = |clouds: &[String]| match clouds {
            [] => "build the cloud as an array of shape (number of points, 3)".to_owned(),
            some => format!("clouds defined so far: {}", some.join(", ")),
        };
        Some(match self {
            Self::NoSteps => "begin each step with a line such as `### Step 1: roll the ball flat`".into(),
            Self::NoCode => "put the code of each step between ```python and ```".into(),
            Self::UnclosedFence { .. } => "close it with ```; perhaps the answer was cut off".into(),
            Self::StepWithoutCode { .. } => {
                "add code that builds the cloud after this step, between ```python and ```".into()
            }
            Self::NoTool { .. } | Self::UnknownTool { .. } => {
                "write `tool name: rolling pin`, or knife, gripper or pole; `none` for step 0".into()
            }
            Self::SeveralTools { .. } => "split it into steps that use one tool each".into(),
            Self::NoOutput { clouds, .. } | Self::MissingOutput { clouds, .. } => {
                format!("write `out var name: [..]` with names the code defines; {}", defined(clouds))
            }
            Self::NotACloud { .. } => "stack x, y and z with np.stack([x, y, z], axis=1)".into(),
            Self::NotFinite { .. } => "look for divisions by zero and roots of negative numbers".into(),
            Self::Code { error, .. } => return error.fault.hint(),
        })
    }
}
