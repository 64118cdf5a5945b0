//! From an answer to stages: its code is run step by step, and what comes out is checked.
//!
//! The text of an answer comes in. [`Stage`]s with their clouds go out, together with warnings about what
//! looks wrong but runs; or an [`AnswerError`] that names step and line and, mostly, a way out. Imports
//! `math` and `stagecode`.

use std::collections::BTreeMap;

use super::fields;
use super::reply::{Reply, StepText};
use super::stage::{NamedCloud, Stage};
use crate::math::cloud::{Bounds, Point, centroid, distance};
use crate::stagecode::{Captured, CodeError, Limits, Session, evaluate};

/// The tools there are, by canonical name, with other words for them.
const TOOLS: &[(&str, &[&str])] = &[
    ("rolling pin", &["rolling pin", "rollingpin", "roller", "pin"]),
    ("knife", &["knife", "blade", "cutter"]),
    ("gripper", &["gripper", "grippers", "clamp"]),
    ("pole", &["pole", "stick", "rod"]),
];

/// Stated and summed volumes may differ by this share before there is a warning.
const VOLUME_TOLERANCE: f64 = 0.05;
/// A cloud's mean may be off its stated location by this share of the cloud's diagonal.
const LOCATION_TOLERANCE: f64 = 0.1;
/// Clouds with fewer points than these are too thin to plan with.
const FEW_POINTS: usize = 200;

/// An answer that ran.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Its steps in order.
    pub stages: Vec<Stage>,
    /// What looks wrong but does not stop a plan.
    pub warnings: Vec<String>,
}

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

/// Parses an answer, runs its code, and checks what came out.
pub fn stages_from_answer(text: &str) -> Result<Answer, AnswerError> {
    stages_within(text, &Limits::default())
}

/// The same within other limits.
pub fn stages_within(text: &str, limits: &Limits) -> Result<Answer, AnswerError> {
    let reply = Reply::parse(text);
    if let Some(line) = reply.unclosed_fence {
        return Err(AnswerError::UnclosedFence { line });
    }
    if reply.steps.is_empty() {
        return Err(AnswerError::NoSteps);
    }
    if reply.preamble.is_empty() && reply.steps.iter().all(|s| s.code.is_empty()) {
        return Err(AnswerError::NoCode);
    }
    evaluate(limits, |session| run(session, &reply))
}

fn run(session: &mut Session, reply: &Reply) -> Result<Answer, AnswerError> {
    let mut answer = Answer { stages: Vec::new(), warnings: Vec::new() };
    for block in &reply.preamble {
        let done = session.run(&block.text, block.first_line, block.indent);
        done.map_err(|error| AnswerError::Code { step: 0, error })?;
    }
    for step in &reply.steps {
        let tool = tool(step, &mut answer.warnings)?;
        if step.code.is_empty() && (tool.is_some() || !step.outputs.is_empty()) {
            return Err(AnswerError::StepWithoutCode { line: step.line, step: step.step });
        }
        for block in &step.code {
            let done = session.run(&block.text, block.first_line, block.indent);
            done.map_err(|error| AnswerError::Code { step: step.step, error })?;
        }
        if step.code.is_empty() {
            continue;
        }
        let stage = Stage {
            step: step.step,
            title: step.title.clone(),
            tool,
            inputs: step.inputs.clone(),
            outputs: outputs(session, step)?,
            stated_location: step.locations.clone(),
            stated_volume: volumes(session, step),
            code: step.code.iter().map(|b| b.text.as_str()).collect::<Vec<_>>().join("\n"),
        };
        warn(&stage, &answer.stages, &mut answer.warnings);
        answer.stages.push(stage);
    }
    Ok(answer)
}

/// The canonical name of the step's tool; `None` where it says none (or is step 0 and says nothing).
fn tool(step: &StepText, warnings: &mut Vec<String>) -> Result<Option<String>, AnswerError> {
    let number = step.step;
    let mut named: Vec<&str> = Vec::new();
    for (line, text) in &step.tools {
        let found = tools_in(text);
        let plain = text.to_lowercase();
        let none = plain.chars().all(|c| !c.is_alphanumeric())
            || ["none", "no tool", "n/a", "null", "nothing"].iter().any(|n| plain.contains(n));
        if found.is_empty() && !none {
            return Err(AnswerError::UnknownTool { line: *line, step: number, name: text.clone() });
        }
        named.extend(found);
    }
    named.sort_unstable();
    named.dedup();
    let line = step.tools.first().map_or(step.line, |t| t.0);
    match (&named[..], step.tools.is_empty()) {
        ([one], _) => Ok(Some((*one).to_owned())),
        ([], false) => Ok(None),
        ([], true) if number == 0 => Ok(None),
        ([], true) => match tools_in(&step.title)[..] {
            [one] => {
                warnings.push(format!("step {number} has no line `tool name:`; its title says {one}"));
                Ok(Some(one.to_owned()))
            }
            _ => Err(AnswerError::NoTool { line, step: number }),
        },
        (several, _) => {
            let names = several.iter().map(ToString::to_string).collect();
            Err(AnswerError::SeveralTools { line, step: number, names })
        }
    }
}

/// Tools named in a text. Remarks in parentheses do not count.
fn tools_in(text: &str) -> Vec<&'static str> {
    let mut depth = 0;
    let plain: String = text
        .to_lowercase()
        .chars()
        .filter(|&c| {
            depth += i32::from(c == '(');
            let outside = depth == 0;
            depth -= i32::from(c == ')' && depth > 0);
            outside
        })
        .map(|c| if c.is_alphanumeric() { c } else { ' ' })
        .collect();
    let padded = format!(" {} ", plain.split_whitespace().collect::<Vec<_>>().join(" "));
    let names = |words: &[&str]| words.iter().any(|w| padded.contains(&format!(" {w} ")));
    TOOLS.iter().filter(|(_, words)| names(words)).map(|(name, _)| *name).collect()
}

fn outputs(session: &Session, step: &StepText) -> Result<Vec<NamedCloud>, AnswerError> {
    let (line, number) = (step.output_line, step.step);
    if step.outputs.is_empty() {
        return Err(AnswerError::NoOutput { line, step: number, clouds: session.clouds() });
    }
    step.outputs.iter().map(|name| cloud(session, name, line, number)).collect()
}

fn cloud(session: &Session, name: &str, line: usize, step: u32) -> Result<NamedCloud, AnswerError> {
    let name = name.to_owned();
    let values = match session.capture(&name) {
        Captured::Missing => {
            return Err(AnswerError::MissingOutput { line, step, name, clouds: session.clouds() });
        }
        Captured::Other(kind) => {
            let what = format!("a {kind}");
            return Err(AnswerError::NotACloud { line, step, name, what });
        }
        Captured::Array { shape, values } => match shape[..] {
            [n, 3] if n > 0 => values,
            [] => return Err(AnswerError::NotACloud { line, step, name, what: "a number".into() }),
            _ => {
                let what = format!("an array of shape {shape:?}");
                return Err(AnswerError::NotACloud { line, step, name, what });
            }
        },
    };
    let points: Vec<Point> = values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    if let Some(point) = points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        return Err(AnswerError::NotFinite { line, step, name, point });
    }
    Ok(NamedCloud { name, points })
}

/// The stated volumes as numbers. Formulas such as `4/3 * pi` are worked out by the evaluator, under the
/// same limits as everything else; what is no number is left out.
fn volumes(session: &mut Session, step: &StepText) -> BTreeMap<String, f64> {
    let mut out = BTreeMap::new();
    for (name, text) in &step.volumes {
        if let Some(volume) = fields::number(text, |formula| session.formula(formula)) {
            out.insert(name.clone(), volume);
        }
    }
    out
}

/// Adds warnings about a stage that runs but looks wrong.
fn warn(stage: &Stage, before: &[Stage], warnings: &mut Vec<String>) {
    let step = stage.step;
    let made = |name: &String| before.iter().any(|s| s.outputs.iter().any(|o| o.name == *name));
    if !before.is_empty() {
        for name in stage.inputs.iter().filter(|name| !made(name)) {
            warnings.push(format!("step {step} takes `{name}`, which no step before it makes"));
        }
    }
    if before.iter().any(|s| s.step == step) {
        warnings.push(format!("there are two steps with the number {step}"));
    }
    let stated = |name: &String| stage.stated_volume.get(name).copied();
    let sum = |names: Vec<&String>| names.into_iter().map(stated).sum::<Option<f64>>();
    let (going_in, coming_out) =
        (sum(stage.inputs.iter().collect()), sum(stage.outputs.iter().map(|o| &o.name).collect()));
    if let (Some(a), Some(b), false) = (going_in, coming_out, stage.inputs.is_empty())
        && (a - b).abs() > VOLUME_TOLERANCE * a.abs().max(b.abs())
    {
        warnings.push(format!("step {step} states a volume of {a} before and {b} after"));
    }
    for output in &stage.outputs {
        if output.points.len() < FEW_POINTS {
            warnings.push(format!("step {step}: `{}` has only {} points", output.name, output.points.len()));
        }
        let Some(bounds) = Bounds::of(&output.points) else { continue };
        let middle = centroid(&output.points);
        match stage.stated_location.get(&output.name) {
            Some(&place) if distance(place, middle) > LOCATION_TOLERANCE * bounds.diagonal() => {
                let shown = middle.map(|x| (x * 1000.0).round() / 1000.0);
                warnings.push(format!(
                    "step {step}: `{}` is stated at {place:?}, its mean is {shown:?}",
                    output.name
                ));
            }
            _ => {}
        }
    }
}
