//! An answer taken apart: steps, their fields, and their code, without running anything.
//!
//! Markdown comes in; [`StepText`]s with line numbers of the answer go out. Headings, fields and fences are
//! recognised in many spellings, because models vary them. Imports `fields`.

use std::collections::BTreeMap;

use super::fields::{self, Field};
use crate::math::cloud::Point;

/// A fenced block of code and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct CodeBlock {
    /// Line of the answer on which the code (not the fence) begins, from 1.
    pub first_line: usize,
    /// Spaces that were taken off every line because the fence was indented.
    pub indent: usize,
    /// The code.
    pub text: String,
}

/// One step as it is written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepText {
    /// The number in the heading.
    pub step: u32,
    /// Line of the heading.
    pub line: usize,
    /// The rest of the heading.
    pub title: String,
    /// What stands behind every `tool name:` of the step, with its line.
    pub tools: Vec<(usize, String)>,
    /// Names behind `in var name:`.
    pub inputs: Vec<String>,
    /// Names behind `out var name:`.
    pub outputs: Vec<String>,
    /// Line of `out var name:`, or of the heading where there is none.
    pub output_line: usize,
    /// Locations by name.
    pub locations: BTreeMap<String, Point>,
    /// Volumes by name, as written.
    pub volumes: BTreeMap<String, String>,
    /// Code blocks in order.
    pub code: Vec<CodeBlock>,
}

/// A whole answer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reply {
    /// Code before the first step.
    pub preamble: Vec<CodeBlock>,
    /// The steps in order.
    pub steps: Vec<StepText>,
    /// Line of a fence that is never closed.
    pub unclosed_fence: Option<usize>,
}

/// An open fence while the answer is read.
struct Fence {
    mark: String,
    line: usize,
    indent: usize,
    is_code: bool,
    lines: Vec<String>,
}

impl Reply {
    /// Takes an answer apart. This never fails: what is missing is missing in the result.
    pub fn parse(text: &str) -> Self {
        let mut reply = Self::default();
        let mut fence: Option<Fence> = None;
        // Lines of prose not yet read as fields, from the line with this number.
        let mut prose: Vec<(usize, String)> = Vec::new();
        for (at, line) in text.lines().enumerate() {
            let number = at + 1;
            match fence.take() {
                Some(open) if closes(&open, line) => reply.add_code(open),
                Some(mut open) => {
                    open.lines.push(without_indent(line, open.indent));
                    fence = Some(open);
                }
                None => {
                    if let Some(open) = opens(line, number) {
                        fence = Some(open);
                    } else if let Some((step, title)) = heading(line) {
                        reply.read_fields(std::mem::take(&mut prose));
                        let (line, output_line) = (number, number);
                        reply.steps.push(StepText { step, line, output_line, title, ..StepText::default() });
                    } else {
                        prose.push((number, line.to_owned()));
                        continue;
                    }
                }
            }
            if fence.is_some() {
                reply.read_fields(std::mem::take(&mut prose));
            }
        }
        reply.read_fields(prose);
        // A wrapper around the whole answer leaves an empty fence at its end.
        if let Some(open) = fence.filter(|open| open.lines.iter().any(|l| !l.trim().is_empty())) {
            reply.unclosed_fence = Some(open.line);
        }
        reply
    }

    fn add_code(&mut self, open: Fence) {
        if !open.is_code {
            return;
        }
        let comments: Vec<(usize, String)> = (open.line + 1..)
            .zip(&open.lines)
            .filter_map(|(number, l)| Some((number, l.trim_start().strip_prefix('#')?.to_owned())))
            .collect();
        let block =
            CodeBlock { first_line: open.line + 1, indent: open.indent, text: open.lines.join("\n") + "\n" };
        match self.steps.last_mut() {
            Some(step) => step.code.push(block),
            None => self.preamble.push(block),
        }
        // Some answers put the fields into comments of the code.
        self.read_fields(comments);
    }

    /// Reads fields out of lines of prose into the last step.
    fn read_fields(&mut self, lines: Vec<(usize, String)>) {
        let Some(step) = self.steps.last_mut() else { return };
        for (number, field, value) in fields::read(&lines) {
            match field {
                Field::Tool => step.tools.push((number, value)),
                Field::Inputs if step.inputs.is_empty() => step.inputs = fields::names(&value),
                Field::Outputs if step.outputs.is_empty() => {
                    step.outputs = fields::names(&value);
                    step.output_line = number;
                }
                Field::Locations => {
                    let found = fields::locations(&value, &step.outputs);
                    step.locations.extend(found);
                }
                Field::Volumes => {
                    let found = fields::volumes(&value, &step.outputs);
                    step.volumes.extend(found);
                }
                Field::Inputs | Field::Outputs => {}
            }
        }
    }
}

/// The fence that a line opens.
fn opens(line: &str, number: usize) -> Option<Fence> {
    let body = line.trim_start();
    let mark: String = body.chars().take_while(|&c| c == '`' || c == '~').collect();
    let uniform = mark.chars().all(|c| mark.starts_with(c));
    let language =
        body[mark.len()..].trim().trim_matches(|c| c == '{' || c == '}' || c == '.').to_lowercase();
    if mark.len() < 3 || !uniform || language.contains('`') {
        return None;
    }
    // A fence around the whole answer is no code and hides none.
    if matches!(language.as_str(), "markdown" | "md") {
        return None;
    }
    let first = language.split_whitespace().next().unwrap_or("");
    let is_code = matches!(first, "" | "python" | "py" | "python3" | "numpy" | "code" | "ipython");
    Some(Fence { mark, line: number, indent: line.len() - body.len(), is_code, lines: Vec::new() })
}

fn closes(open: &Fence, line: &str) -> bool {
    let body = line.trim();
    body.len() >= open.mark.len()
        && body.starts_with(&open.mark)
        && body.chars().all(|c| open.mark.starts_with(c))
}

/// The line without up to `indent` leading blanks.
fn without_indent(line: &str, indent: usize) -> String {
    let blanks = line.len() - line.trim_start_matches([' ', '\t']).len();
    line[blanks.min(indent)..].to_owned()
}

/// Number and title, if the line is the heading of a step.
fn heading(line: &str) -> Option<(u32, String)> {
    let plain = fields::without_markup(line);
    let marked = line.trim_start().starts_with('#') || line.trim_start().starts_with("**");
    let rest = strip_word(&plain, "step")?;
    let rest = rest.trim_start_matches([' ', '[', '(', '#', '*', '_']);
    let digits = rest.chars().take_while(char::is_ascii_digit).count();
    let step = rest[..digits].parse().ok()?;
    let after = rest[digits..].trim_start_matches([']', ')', '*', '_', ' ']);
    let title = after.trim_start_matches([':', '.', '-', '–', '—', ' ', '*']);
    // Without a mark of its own, "Step 2 uses the pin" is a sentence.
    let ends_number =
        after.is_empty() || after.len() > title.len() && !after.starts_with(char::is_alphanumeric);
    if !marked && !ends_number {
        return None;
    }
    let title = title.trim().trim_end_matches(['*', '#', ' ']);
    let title = title.strip_prefix('[').and_then(|t| t.strip_suffix(']')).unwrap_or(title);
    Some((step, title.to_owned()))
}

/// The rest of `text` behind a word, whatever its case.
fn strip_word<'a>(text: &'a str, word: &str) -> Option<&'a str> {
    let head = text.get(..word.len())?;
    let rest = &text[word.len()..];
    let whole = !rest.starts_with(|c: char| c.is_alphabetic());
    (head.eq_ignore_ascii_case(word) && whole).then_some(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_in_many_spellings() {
        for line in [
            "### Step 2: Roll it",
            "Step [2]: Roll it",
            "**Step 2: Roll it**",
            "**Step 2:** Roll it",
            "2. **Step 2** - Roll it",
            "## STEP 2 — Roll it",
            "* Step (2). Roll it",
            "Step [2]: [Roll it]",
        ] {
            assert_eq!(heading(line), Some((2, "Roll it".to_owned())), "{line}");
        }
        assert_eq!(heading("Step 2"), Some((2, String::new())));
        for line in ["Step 2 uses the rolling pin", "the pole of step 2: none", "Steps 2: x", "stepwise"] {
            assert_eq!(heading(line), None, "{line}");
        }
    }

    #[test]
    fn fences_belong_to_their_steps_and_keep_their_lines() {
        let text = "```\na = 1\n```\nStep 1: x\n  ~~~py\n  b = 2\n    c\n  ~~~\n```json\n{}\n```\n```python\nd\n```\n";
        let reply = Reply::parse(text);
        assert_eq!(reply.preamble[0].text, "a = 1\n");
        let code = &reply.steps[0].code;
        assert_eq!((code[0].first_line, code[0].indent, code[0].text.as_str()), (6, 2, "b = 2\n  c\n"));
        assert_eq!((code.len(), code[1].first_line), (2, 13));
        assert_eq!(Reply::parse("Step 1: x\n```python\na").unclosed_fence, Some(2));
    }

    #[test]
    fn a_wrapper_around_the_whole_answer_is_seen_through() {
        let reply = Reply::parse("```markdown\n### Step 1: x\n```python\na = 1\n```\nvol: {\"a\": 2}\n```\n");
        assert_eq!(reply.unclosed_fence, None);
        assert_eq!(reply.steps[0].code.len(), 1);
        assert_eq!(reply.steps[0].volumes["a"], "2");
    }
}
