//! From an answer to stages: its code is run step by step, and what comes out is checked.
//!
//! The text of an answer comes in. [`Stage`]s with their clouds go out, together with warnings about what
//! looks wrong but runs; or an [`AnswerError`] that names step and line and, mostly, a way out. Imports
//! `math` and `stagecode`.

use std::collections::BTreeMap;

use super::answer_error::AnswerError;
use super::checks::Checks;
use super::reply::{Reply, StepText};
use super::stage::{NamedCloud, Stage};
use super::{tools, values};
use crate::math::cloud::Point;
use crate::stagecode::{Captured, Interpreter, Limits, evaluate};

/// An answer that ran.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Its steps in order.
    pub stages: Vec<Stage>,
    /// What looks wrong but does not stop a plan.
    pub warnings: Vec<String>,
}

/// Parses an answer, runs its code, and checks what came out.
pub fn stages_from_answer(text: &str) -> Result<Answer, AnswerError> {
    stages_within(text, &Limits::default())
}

/// The same within other limits.
pub fn stages_within(text: &str, limits: &Limits) -> Result<Answer, AnswerError> {
    let reply = parsed(text)?;
    evaluate(limits, |session| run(session, &reply))
}

/// The same with code run by another interpreter.
pub fn stages_by(interpreter: &mut dyn Interpreter, text: &str) -> Result<Answer, AnswerError> {
    run(interpreter, &parsed(text)?)
}

/// The answer taken apart, if there is anything to run in it.
fn parsed(text: &str) -> Result<Reply, AnswerError> {
    let reply = Reply::parse(text);
    if let Some(line) = reply.unclosed_fence.filter(|_| !reply.ends_whole()) {
        return Err(AnswerError::UnclosedFence { line });
    }
    if reply.steps.is_empty() {
        return Err(AnswerError::NoSteps);
    }
    if reply.preamble.is_empty() && reply.steps.iter().all(|s| s.code.is_empty()) {
        return Err(AnswerError::NoCode);
    }
    Ok(reply)
}

fn run(code: &mut dyn Interpreter, reply: &Reply) -> Result<Answer, AnswerError> {
    let mut answer = Answer { stages: Vec::new(), warnings: Vec::new() };
    let mut checks = Checks::default();
    if let Some(line) = reply.unclosed_fence {
        answer
            .warnings
            .push(format!("the code fence of line {line} is never closed; it ends with the answer"));
    }
    let any_sure = reply.steps.iter().flat_map(|s| &s.code).any(|block| block.sure);
    for block in &reply.preamble {
        if let Err(error) = code.run(&block.text, block.first_line, block.indent) {
            let error = AnswerError::Code { step: 0, error };
            if block.sure || !any_sure {
                return Err(error);
            }
            answer.warnings.push(left_out(&error));
        }
    }
    for step in &reply.steps {
        if is_empty(step) {
            if step.step > 0 {
                answer.warnings.push(format!("step {} has neither tool nor code and is left out", step.step));
            }
            continue;
        }
        let tool = tool(step, &mut answer.warnings)?;
        if step.code.is_empty() {
            if tool.is_some() {
                return Err(AnswerError::StepWithoutCode { line: step.line, step: step.step });
            }
            answer.warnings.push(format!("step {} has no code and is left out", step.step));
            continue;
        }
        let before = code.clouds();
        let (ran, failed) = run_step(code, step)?;
        answer.warnings.extend(failed.iter().map(left_out));
        let outputs = match outputs(code, step, &before, &mut answer.warnings) {
            Ok(outputs) => outputs,
            Err(AnswerError::NoOutput { .. }) if tool.is_none() && failed.is_empty() => {
                answer.warnings.push(format!("step {} shapes nothing and is left out", step.step));
                continue;
            }
            // What was left out was needed.
            Err(error) => return Err(failed.into_iter().next().unwrap_or(error)),
        };
        let stage = Stage {
            step: step.step,
            title: step.title.clone(),
            tool,
            inputs: inputs(step, &answer.stages),
            outputs,
            stated_location: locations(code, step),
            stated_volume: volumes(code, step, &mut answer.warnings),
            code: ran.join("\n"),
        };
        checks.stage(&stage, &mut answer.warnings);
        answer.stages.push(stage);
    }
    Ok(answer)
}

/// Whether a step says nothing that a plan could use: a remark under a heading of its own.
fn is_empty(step: &StepText) -> bool {
    let says_nothing = step.code.is_empty() && step.tools.is_empty() && step.outputs.names.is_empty();
    // A heading with nothing below it is one at which the answer was cut off.
    says_nothing && (step.step == 0 || step.has_body && tools::mentioned_in(&step.title).is_empty())
}

/// Runs the code of a step. Returns the blocks that ran, and why others did not that the step can do without: those that
/// do not say that they are Python, beside some that do, and those behind the step's fields, such as pictures.
fn run_step<'a>(
    code: &mut dyn Interpreter,
    step: &'a StepText,
) -> Result<(Vec<&'a str>, Vec<AnswerError>), AnswerError> {
    let (mut ran, mut failed) = (Vec::new(), Vec::new());
    let any_sure = step.code.iter().any(|block| block.sure);
    for block in &step.code {
        let behind = |line| step.code[0].first_line < line && line < block.first_line;
        match code.run(&block.text, block.first_line, block.indent) {
            Ok(()) => ran.push(block.text.as_str()),
            Err(error) => {
                let error = AnswerError::Code { step: step.step, error };
                if !(any_sure && !block.sure || step.output_line.is_some_and(behind)) {
                    return Err(error);
                }
                failed.push(error);
            }
        }
    }
    Ok((ran, failed))
}

fn left_out(error: &AnswerError) -> String {
    format!("a block of code fails and is left out: {error}")
}

/// The canonical name of the step's tool; `None` where it says none (or is step 0 and says nothing).
fn tool(step: &StepText, warnings: &mut Vec<String>) -> Result<Option<String>, AnswerError> {
    let number = step.step;
    let mut named: Vec<&str> = Vec::new();
    for (line, text) in &step.tools {
        let found = tools::named_in(text);
        if found.is_empty() && !tools::says_none(text) {
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
        ([], true) => match tools::mentioned_in(&step.title)[..] {
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

/// Names of what goes in. Words of a sentence count only if a step before made a cloud of that name.
fn inputs(step: &StepText, before: &[Stage]) -> Vec<String> {
    let made = |name: &String| before.iter().any(|s| s.outputs.iter().any(|o| o.name == *name));
    step.inputs.names.iter().filter(|name| step.inputs.certain || made(name)).cloned().collect()
}

/// The clouds that come out of a step whose code has run; `before` are the clouds that there were.
fn outputs(
    code: &mut dyn Interpreter,
    step: &StepText,
    before: &[String],
    warnings: &mut Vec<String>,
) -> Result<Vec<NamedCloud>, AnswerError> {
    let number = step.step;
    let clouds = code.clouds();
    let line = step.output_line.unwrap_or(step.line);
    let mut names = step.outputs.names.clone();
    if !step.outputs.certain {
        names.retain(|name| clouds.contains(name));
    }
    if step.output_line.is_none() {
        // Forgotten: what the step places or measures, or else the one cloud that it makes.
        let new: Vec<&String> = clouds.iter().filter(|c| !before.contains(c)).collect();
        let told = |name: &&String| step.locations.contains_key(*name) || step.volumes.contains_key(*name);
        names = new.iter().copied().filter(told).cloned().collect();
        if let ([], [one]) = (&names[..], &new[..]) {
            names.push((*one).clone());
        }
        if !names.is_empty() {
            let list = names.join("`, `");
            warnings.push(format!("step {number} has no line `out var name:`; its code makes `{list}`"));
        }
    }
    if names.is_empty() {
        return Err(AnswerError::NoOutput { line, step: number, clouds });
    }
    names.iter().map(|name| cloud(code, name, line, number)).collect()
}

fn cloud(code: &mut dyn Interpreter, name: &str, line: usize, step: u32) -> Result<NamedCloud, AnswerError> {
    let name = name.to_owned();
    let values = match code.capture(&name) {
        Captured::Missing => {
            return Err(AnswerError::MissingOutput { line, step, name, clouds: code.clouds() });
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

/// The stated volumes as numbers. Formulas such as `4/3 * pi` are worked out by the interpreter, under the
/// same limits as everything else; what is no number is left out.
fn volumes(code: &mut dyn Interpreter, step: &StepText, warnings: &mut Vec<String>) -> BTreeMap<String, f64> {
    let mut out = BTreeMap::new();
    for (name, text) in &step.volumes {
        match number(code, text) {
            Some(volume) => drop(out.insert(name.clone(), volume)),
            None => {
                let (number, text) = (step.step, text.chars().take(60).collect::<String>());
                warnings.push(format!("step {number}: the stated volume of `{name}` is no number: {text}"));
            }
        }
    }
    out
}

/// The stated locations, worked out in the same way.
fn locations(code: &mut dyn Interpreter, step: &StepText) -> BTreeMap<String, Point> {
    let mut out = BTreeMap::new();
    for (name, [x, y, z]) in &step.locations {
        if let (Some(x), Some(y), Some(z)) = (number(code, x), number(code, y), number(code, z)) {
            out.insert(name.clone(), [x, y, z]);
        }
    }
    out
}

fn number(code: &mut dyn Interpreter, text: &str) -> Option<f64> {
    values::number(text, |formula| code.formula(formula))
}
