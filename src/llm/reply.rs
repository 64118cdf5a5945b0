//! An answer taken apart: steps, their fields, and their code, without running anything.
//!
//! Markdown comes in; [`StepText`]s with line numbers of the answer go out. Headings, fields and code are
//! recognised in many spellings, because models vary them. Imports `fields`, `values`, `fence`, `heading`.

use std::collections::{BTreeMap, HashSet};

use super::fence::{CodeBlock, Fence, Language, unfenced};
use super::fields::{self, Field};
use super::heading::{self, Heading};
use super::values::{self, Names};

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
    pub inputs: Names,
    /// Names behind `out var name:`.
    pub outputs: Names,
    /// Line of `out var name:`, or none where there is no such field.
    pub output_line: Option<usize>,
    /// Locations by name, a formula for each coordinate.
    pub locations: BTreeMap<String, [String; 3]>,
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

impl Reply {
    /// Takes an answer apart. This never fails: what is missing is missing in the result.
    pub fn parse(text: &str) -> Self {
        let text = without_thoughts(&with_plain_signs(text));
        let reply = Self::with_headings(&text, heading::step);
        if !reply.steps.is_empty() {
            return reply;
        }
        let numbered = Self::with_headings(&text, heading::numbered);
        if numbered.steps.iter().any(|s| !s.code.is_empty()) {
            return numbered;
        }
        if let Some(commented) = Self::steps_in_comments(&reply) {
            return commented;
        }
        let mut listed = Self::with_headings(&text, heading::listed);
        // Other lists may stand between the steps.
        listed.steps.retain(|s| !s.code.is_empty());
        if listed.steps.is_empty() { reply } else { listed }
    }

    fn with_headings(text: &str, headings: fn(&str) -> Option<Heading>) -> Self {
        let all = Reader::read(text, headings, None);
        // Where headings are marked, "Step 1: .." in a derivation is none, unless it has a tool of its own.
        let best = all.headings.iter().map(|h| h.rank).max().unwrap_or(0);
        let chosen: HashSet<usize> =
            all.headings.iter().filter(|h| h.rank == best || h.has_tool).map(|h| h.line).collect();
        let mut reply = if chosen.len() < all.headings.len() {
            Reader::read(text, headings, Some(chosen)).reply
        } else {
            all.reply
        };
        // A list of the steps before or after them repeats their headings alone.
        let empty = |s: &StepText| s.code.is_empty() && s.tools.is_empty() && s.output_line.is_none();
        let full: HashSet<u32> = reply.steps.iter().filter(|s| !empty(s)).map(|s| s.step).collect();
        reply.steps.retain(|s| !(empty(s) && full.contains(&s.step)));
        reply
    }

    /// Steps whose headings are comments in the code: `# Step 1: roll it`.
    fn steps_in_comments(whole: &Self) -> Option<Self> {
        let mut reply = Self { unclosed_fence: whole.unclosed_fence, ..Self::default() };
        for block in &whole.preamble {
            let lines: Vec<&str> = block.text.lines().collect();
            let heading = |line: &str| line.starts_with('#').then(|| heading::step(line)).flatten();
            let mut start = 0;
            for at in 0..=lines.len() {
                let found = lines.get(at).and_then(|l| heading(l));
                if found.is_none() && at < lines.len() {
                    continue;
                }
                let first_line = block.first_line + start;
                let text = lines[start..at].join("\n") + "\n";
                reply.add_commented(CodeBlock { first_line, indent: block.indent, text });
                if let Some(Heading { step, title, .. }) = found {
                    let line = block.first_line + at;
                    reply.steps.push(StepText { step, line, title, ..StepText::default() });
                }
                start = at;
            }
        }
        (!reply.steps.is_empty()).then_some(reply)
    }

    fn add_commented(&mut self, block: CodeBlock) {
        if block.text.trim().is_empty() {
            return;
        }
        match self.steps.last_mut() {
            Some(step) => {
                step.read_fields(&comments_of(&block));
                step.code.push(block);
            }
            None => self.preamble.push(block),
        }
    }
}

impl StepText {
    /// Reads fields out of lines of prose.
    fn read_fields(&mut self, lines: &[(usize, String)]) {
        let found = fields::read(lines);
        for (number, field, value) in &found {
            match field {
                Field::Title if self.title.is_empty() => self.title.clone_from(value),
                Field::Tool => self.tools.push((*number, value.clone())),
                Field::Inputs if self.inputs.names.is_empty() => self.inputs = values::names(value),
                Field::Outputs if self.outputs.names.is_empty() => {
                    self.outputs = values::names(value);
                    self.output_line = Some(*number);
                }
                _ => {}
            }
        }
        // Names of the outputs are known by now, wherever they stand.
        for (_, field, value) in &found {
            match field {
                Field::Locations => self.locations.extend(values::locations(value, &self.outputs.names)),
                Field::Volumes => self.volumes.extend(values::volumes(value, &self.outputs.names)),
                _ => {}
            }
        }
    }
}

/// Comments of a block, as lines of prose.
fn comments_of(block: &CodeBlock) -> Vec<(usize, String)> {
    let numbered = (block.first_line..).zip(block.text.lines());
    numbered.filter_map(|(number, l)| Some((number, l.trim_start().strip_prefix('#')?.to_owned()))).collect()
}

/// Typographic quotes, blanks and line ends as plain ones, one sign for one sign.
fn with_plain_signs(text: &str) -> String {
    let lines = text.replace("\r\n", "\n");
    let plain = |c: char| {
        Some(match c {
            '\u{feff}' | '\u{200b}' | '\u{200c}' | '\u{200d}' | '\u{2060}' => return None,
            '\r' | '\u{2028}' | '\u{2029}' => '\n',
            '\u{a0}' | '\u{202f}' | '\u{2007}' | '\u{2009}' | '\u{3000}' => ' ',
            '“' | '”' | '„' => '"',
            '‘' | '’' => '\'',
            '：' => ':',
            '，' => ',',
            '（' => '(',
            '）' => ')',
            _ => c,
        })
    };
    lines.chars().filter_map(plain).collect()
}

/// The text without what a model thought before it answered, up to `</think>`; lines keep their numbers.
fn without_thoughts(text: &str) -> String {
    // Some servers leave out the tag that opens the thoughts.
    let Some((end, tag)) = ["</think>", "</thinking>"].iter().find_map(|tag| Some((text.rfind(tag)?, tag)))
    else {
        return text.to_owned();
    };
    let (thoughts, answer) = text.split_at(end + tag.len());
    "\n".repeat(thoughts.matches('\n').count()) + answer
}

/// A line that may be a heading.
struct Candidate {
    line: usize,
    rank: u8,
    /// Whether a tool is named before the next candidate.
    has_tool: bool,
}

/// Reads an answer line by line.
struct Reader {
    is_heading: fn(&str) -> Option<Heading>,
    /// Lines whose headings count; all if not given.
    chosen: Option<HashSet<usize>>,
    reply: Reply,
    headings: Vec<Candidate>,
    fence: Option<Fence>,
    /// Fences around (part of) the answer that were seen through and are not closed yet.
    wrappers: usize,
    /// Whether the steps have ended.
    ended: bool,
    /// Lines of the current step that are neither code nor heading.
    prose: Vec<(usize, String)>,
}

impl Reader {
    fn read(text: &str, is_heading: fn(&str) -> Option<Heading>, chosen: Option<HashSet<usize>>) -> Self {
        let mut reader = Self {
            is_heading,
            chosen,
            reply: Reply::default(),
            headings: Vec::new(),
            fence: None,
            wrappers: 0,
            ended: false,
            prose: Vec::new(),
        };
        for (at, line) in text.lines().enumerate() {
            reader.line(at + 1, line);
        }
        reader.finish_step();
        // A wrapper around the whole answer leaves a fence at its end.
        let left = reader
            .fence
            .take()
            .filter(|f| !(reader.ended || f.language == Language::Unnamed && reader.wrappers > 0));
        if let Some(open) = left.filter(|open| open.lines.iter().any(|l| !l.trim().is_empty())) {
            reader.reply.unclosed_fence = Some(open.line);
        }
        reader
    }

    fn line(&mut self, number: usize, line: &str) {
        match self.fence.take() {
            Some(open) if open.is_closed_by(line) => self.close(open),
            Some(open) if self.is_wrapper(&open, line) => {
                self.wrappers += 1;
                self.line(number, line);
            }
            Some(mut open) => {
                open.push(line);
                self.fence = Some(open);
            }
            None => self.prose_line(number, line),
        }
    }

    /// Whether a fence of unsaid or other language begins with the heading of a step: it is around the answer.
    fn is_wrapper(&self, open: &Fence, line: &str) -> bool {
        let first = open.lines.iter().all(|l| l.trim().is_empty());
        let comment = line.trim_start().starts_with("# ");
        open.language != Language::Python && first && !comment && (self.is_heading)(line).is_some()
    }

    fn prose_line(&mut self, number: usize, line: &str) {
        if let Some(open) = Fence::opened_by(line, number) {
            if open.language == Language::Markdown {
                self.wrappers += 1;
            } else {
                self.fence = Some(open);
            }
            return;
        }
        if let Some(heading) = (self.is_heading)(line) {
            self.headings.push(Candidate { line: number, rank: heading.rank, has_tool: false });
            // Behind the steps their headings may come again.
            let told = self.ended && self.reply.steps.iter().any(|s| s.step == heading.step);
            if !told && self.chosen.as_ref().is_none_or(|chosen| chosen.contains(&number)) {
                self.finish_step();
                self.ended = false;
                let Heading { step, title, .. } = heading;
                self.reply.steps.push(StepText { step, line: number, title, ..StepText::default() });
                return;
            }
        }
        if heading::ends_steps(line) && !self.reply.steps.is_empty() {
            self.finish_step();
            self.ended = true;
        }
        if let Some(candidate) = self.headings.last_mut() {
            candidate.has_tool |= fields::is_tool(line);
        }
        if !self.ended {
            self.prose.push((number, line.to_owned()));
        }
    }

    fn close(&mut self, fence: Fence) {
        if self.ended {
            return;
        }
        if fence.language == Language::Other || fence.holds_fields() {
            self.prose.extend(fence.numbered_lines());
            return;
        }
        match self.reply.steps.last_mut() {
            Some(step) => step.code.push(fence.code()),
            None => self.reply.preamble.push(fence.code()),
        }
    }

    /// Reads what was gathered for the current step.
    fn finish_step(&mut self) {
        let mut prose = std::mem::take(&mut self.prose);
        let Some(step) = self.reply.steps.last_mut().filter(|_| !self.ended) else { return };
        if step.code.is_empty() {
            (step.code, prose) = unfenced(&prose);
        }
        step.read_fields(&prose);
        // Some answers put the fields into comments of the code.
        if step.output_line.is_none() {
            let comments: Vec<(usize, String)> = step.code.iter().flat_map(comments_of).collect();
            step.read_fields(&comments);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        for fence in ["```markdown", "```", "```text"] {
            let text = format!("{fence}\nStep 1: x\n```python\na = 1\n```\nvol: {{\"a\": 2}}\n```\nBye.\n");
            let reply = Reply::parse(&text);
            assert_eq!(reply.unclosed_fence, None);
            assert_eq!(reply.steps[0].code.len(), 1);
            assert_eq!(reply.steps[0].volumes["a"], "2");
        }
    }

    #[test]
    fn steps_of_a_derivation_are_no_steps() {
        let text = "### Step 1: Roll\ntool name: pin\nStep 1: V = 4\nStep 2: h = 1\n```python\na\n```\n\
                    ### Step 2: Cut\ntool name: knife\n```python\nb\n```\n";
        let titles: Vec<String> = Reply::parse(text).steps.into_iter().map(|s| s.title).collect();
        assert_eq!(titles, ["Roll", "Cut"]);
    }

    #[test]
    fn lists_of_the_steps_and_a_summary_are_no_steps() {
        let text = "The plan:\nStep 1: Roll\nStep 2: Cut\n\nStep 1: Roll\ntool name: pin\n```python\na\n```\n\
                    Step 2: Cut\ntool name: knife\n```python\nb\n```\n\n## Summary\nStep 1: rolled\nvol: 7\n\
                    ```python\nplot()\n```\n";
        let reply = Reply::parse(text);
        assert_eq!(reply.steps.iter().map(|s| (s.step, s.code.len())).collect::<Vec<_>>(), [(1, 1), (2, 1)]);
        assert!(reply.steps[1].volumes.is_empty());
    }

    #[test]
    fn fields_in_a_fence_or_in_comments_are_fields() {
        let fenced = "Step 1: x\n```\na = np.ones(3)\n```\n```\nin var name: [b], out var name: [a]\nvol: {\"a\": 2}\n```\n";
        let commented =
            "Step 1: x\n```\n# in var name: [b], out var name: [a]\n# vol: {\"a\": 2}\na = np.ones(3)\n```\n";
        for text in [fenced, commented] {
            let step = &Reply::parse(text).steps[0];
            assert_eq!((step.code.len(), &step.outputs.names[..]), (1, &["a".to_owned()][..]), "{text}");
            assert_eq!(step.volumes["a"], "2");
        }
    }

    #[test]
    fn thoughts_are_no_part_of_an_answer() {
        let thoughts = "Step 1: perhaps\ntool name: spoon\n</think>\n";
        for text in [format!("<think>\n{thoughts}"), format!("\n{thoughts}")] {
            let reply = Reply::parse(&(text + "Step 1: Roll\ntool name: pin\n```\na\n```\n"));
            let [step] = &reply.steps[..] else { panic!("{reply:?}") };
            assert_eq!((step.title.as_str(), step.line), ("Roll", 5));
        }
    }

    #[test]
    fn steps_may_be_items_of_a_list() {
        let text = "We need:\n1. a pin\n\n1. **Roll it** (tool: pin)\n\n   ```python\n   a = 1\n   ```\n\n   \
                    - tool name: pin\n   - out var name: a\n2. **Cut it**\n   ```\n   b\n   ```\n";
        let reply = Reply::parse(text);
        let found: Vec<_> =
            reply.steps.iter().map(|s| (s.step, s.line, s.code.len(), s.tools.len())).collect();
        assert_eq!(found, [(1, 4, 1, 1), (2, 12, 1, 0)]);
    }

    #[test]
    fn steps_may_be_comments_of_one_block() {
        let text = "```python\nimport numpy as np\n# Step 1: Roll\n# tool name: [rolling pin]\na = 1\n# Step 2: Cut\nb\n```\n";
        let reply = Reply::parse(text);
        assert_eq!(reply.preamble.len(), 1);
        assert_eq!((reply.steps[0].title.as_str(), reply.steps[1].title.as_str()), ("Roll", "Cut"));
        assert_eq!(reply.steps[0].tools[0].1, "[rolling pin]");
        assert_eq!(reply.steps[1].code[0].first_line, 7 - 1);
    }
}
