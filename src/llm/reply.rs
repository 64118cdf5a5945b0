//! An answer taken apart: steps, their fields, and their code, without running anything.
//!
//! Markdown comes in; [`StepText`]s with line numbers of the answer go out. Headings, fields and code are
//! recognised in many spellings, because models vary them. Imports `reader`, `fields`, `values`, `fence`, `heading`, and
//! to know Python when it sees it, `stagecode`.

use std::collections::{BTreeMap, HashSet};

use super::fence::CodeBlock;
use super::fields::{self, Found};
use super::heading::{self, Heading};
use super::keys::Field;
use super::reader::Reader;
use super::values::{self, Names};
use crate::stagecode::is_python;

/// One step as it is written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepText {
    /// The number in the heading.
    pub step: u32,
    /// Line of the heading.
    pub line: usize,
    /// The rest of the heading.
    pub title: String,
    /// Whether anything stands below the heading.
    pub has_body: bool,
    /// What stands behind every `tool name:` of the step, or else behind every `tool:`, with its line.
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
    /// Line of a fence that is never closed; what stands behind it is taken for its content.
    pub unclosed_fence: Option<usize>,
}

impl Reply {
    /// Takes an answer apart. This never fails: what is missing is missing in the result.
    pub fn parse(text: &str) -> Self {
        let text = without_thoughts(&with_plain_ends(text));
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

    /// Whether the last step is there to its end: its code is Python, and it says what comes out.
    pub fn ends_whole(&self) -> bool {
        let whole = |code: &[CodeBlock]| code.last().is_some_and(|block| is_python(&block.text));
        let step = self.steps.last();
        step.is_some_and(|s| s.output_line.is_some() && s.outputs.certain && whole(&s.code))
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
                reply.add_commented(CodeBlock { first_line, text, ..block.clone() });
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
    pub(super) fn read_fields(&mut self, lines: &[(usize, String)]) {
        let found = fields::read(lines);
        let stated = |field| found.iter().filter(move |f| f.field == field && !f.value.is_empty());
        if let Some(title) = stated(Field::Title).next().filter(|_| self.title.is_empty()) {
            self.title.clone_from(&title.value);
        }
        let named = stated(Field::Tool).any(|tool| tool.sure);
        let tools = stated(Field::Tool).filter(|tool| tool.sure || !named);
        self.tools.extend(tools.map(|tool| (tool.line, tool.value.clone())));
        if let Some((_, names)) = names_of(stated(Field::Inputs)).filter(|_| self.inputs == Names::default())
        {
            self.inputs = names;
        }
        if let Some((line, names)) = names_of(stated(Field::Outputs)).filter(|_| self.output_line.is_none()) {
            self.outputs = names;
            self.output_line = Some(line);
        }
        // Names of the pieces are known by now, wherever they stand. Where a derivation speaks of the volume of
        // something else, that is no piece's.
        let (inputs, outputs) = (&self.inputs.names, &self.outputs.names);
        let told = self.inputs != Names::default() && !outputs.is_empty();
        let piece =
            |f: &Found, name: &String| f.sure || !told || inputs.contains(name) || outputs.contains(name);
        for sure in [false, true] {
            for f in stated(Field::Locations).filter(|f| f.sure == sure) {
                let places = values::locations(&f.value, outputs, inputs);
                self.locations.extend(places.into_iter().filter(|(name, _)| piece(f, name)));
            }
            for f in stated(Field::Volumes).filter(|f| f.sure == sure) {
                let volumes = values::volumes(&f.value, outputs);
                self.volumes.extend(volumes.into_iter().filter(|(name, _)| piece(f, name)));
            }
        }
    }
}

/// The names that a step states, and their line: behind the first `.. var name:`, or else the first that are surely
/// names, or else the first words.
fn names_of<'a>(fields: impl Iterator<Item = &'a Found>) -> Option<(usize, Names)> {
    let all: Vec<(bool, usize, Names)> = fields.map(|f| (f.sure, f.line, values::names(&f.value))).collect();
    let best = all.iter().find(|(sure, ..)| *sure).or_else(|| all.iter().find(|(.., names)| names.certain));
    best.or(all.first()).map(|(_, line, names)| (*line, names.clone()))
}

/// Comments of a block, as lines of prose.
pub(super) fn comments_of(block: &CodeBlock) -> Vec<(usize, String)> {
    let numbered = (block.first_line..).zip(block.text.lines());
    numbered.filter_map(|(number, l)| Some((number, l.trim_start().strip_prefix('#')?.to_owned()))).collect()
}

/// The text with plain line ends and without signs that nobody sees.
fn with_plain_ends(text: &str) -> String {
    let plain = |c: char| match c {
        '\u{feff}' | '\u{200b}' | '\u{200c}' | '\u{200d}' | '\u{2060}' => None,
        '\r' | '\u{2028}' | '\u{2029}' => Some('\n'),
        _ => Some(c),
    };
    text.replace("\r\n", "\n").chars().filter_map(plain).collect()
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
        assert!(!Reply::parse("Step 1: x\n```python\na").ends_whole());
        assert!(Reply::parse("Step 1: x\n```python\na = 1\nout var name: [a]").ends_whole());
        assert!(!Reply::parse("Step 1: x\nout var name: [a]\n```python\na = (1").ends_whole());
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

    /// A step of the form that the prompt asks for, with lines in its derivation and before its fields.
    fn step_with(derivation: &str, before_fields: &str) -> String {
        format!(
            "### Step 1: Roll\ntool name: pin\nderivation:\n{derivation}\n```python\na = 1\n```\n{before_fields}\n\
             in var name: [\"b\"], out var name: [\"a\"]\nloc: {{\"a\": (0, 0, 0)}}\nvol: {{\"b\": 2, \"a\": 2}}\n"
        )
    }

    #[test]
    fn notes_and_checks_within_a_step_do_not_end_it() {
        for line in [
            "**Final height:** h = 0.6",
            "**Verification:** V = 2 ✓",
            "**Note:** the centre moves",
            "- **Summary**",
            "1. **Overall volume:** 2",
            "> **Note:** y is up",
            "#### Verification",
            "### Volume check",
        ] {
            for text in [step_with(line, ""), step_with("V = 2", line)] {
                let reply = Reply::parse(&(text + "### Summary\nvol: 7\n```python\nplot()\n```\n"));
                let [step] = &reply.steps[..] else { panic!("{line}: {reply:?}") };
                assert_eq!((step.code.len(), &step.inputs.names[..]), (1, &["b".to_owned()][..]), "{line}");
                assert_eq!((step.locations.len(), step.volumes["a"].as_str()), (1, "2"), "{line}");
            }
        }
        // Between fields too.
        let text = step_with("V", "").replace("loc:", "**Note:** all is kept\nloc:");
        assert_eq!(Reply::parse(&text).steps[0].volumes.len(), 2);
    }

    #[test]
    fn steps_of_a_derivation_may_be_headings_below_those_of_the_steps() {
        let reply = Reply::parse(&step_with("#### Step 1: compute V\n#### Step 2: compute h", ""));
        assert_eq!(reply.steps.iter().map(|s| (s.step, s.code.len())).collect::<Vec<_>>(), [(1, 1)]);
    }

    #[test]
    fn fences_that_hold_no_python_are_prose_where_others_do() {
        for prose in ["V = 4/3 · π · r³", "V = 4/3 * pi * 1^3 = 4.18879", "disc shape: (3000, 3)"] {
            for language in ["python", ""] {
                let fence = format!("```\n{prose}\n```");
                let text = format!("```\npip install numpy\n```\n{}", step_with(&fence, &fence));
                let reply = Reply::parse(&text.replace("python", language));
                assert!(reply.preamble.is_empty(), "{reply:?}");
                assert_eq!(reply.steps[0].code.len(), 1, "{prose} {:?}", reply.steps[0].code);
            }
        }
        // Code that is none is reported as such where there is no other.
        assert_eq!(Reply::parse("Step 1: x\n```\na = (\n```\n").steps[0].code.len(), 1);
    }

    #[test]
    fn sure_names_and_tools_win_over_words_of_a_derivation() {
        let derivation = "- Input: a ball of radius 1\n- Output: a flat cylinder\n- Volume: V = 4\n- Tool: no knife\n\
                          - Location: (1, 2, 3)";
        let step = &Reply::parse(&step_with(derivation, "")).steps[0];
        assert_eq!(
            (&step.inputs.names[..], &step.outputs.names[..]),
            (&["b".to_owned()][..], &["a".to_owned()][..])
        );
        assert_eq!(step.tools, [(2, "pin".to_owned())]);
        assert_eq!((step.volumes.len(), step.locations["a"].join(" ")), (2, "0 0 0".to_owned()));
    }

    #[test]
    fn quotes_within_strings_stay_as_they_are_written() {
        for (written, wanted) in [
            ("print('the ball’s radius')", "print('the ball’s radius')"),
            ("print(“radius”)\u{a0}", "print(\"radius\") "),
        ] {
            let text = step_with("V", "").replace("a = 1", written);
            assert_eq!(Reply::parse(&text).steps[0].code[0].text.trim_end_matches('\n'), wanted);
        }
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
