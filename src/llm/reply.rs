//! An answer taken apart: steps, their fields, and their code, without running anything.
//!
//! Markdown comes in; [`StepText`]s with line numbers of the answer go out. Headings, fields and code are
//! recognised in many spellings, because models vary them. Imports `fields`, `values`, `fence`, `heading`, and to know
//! Python when it sees it, `stagecode`.

use std::collections::{BTreeMap, HashSet};

use super::fence::{CodeBlock, Fence, Language, leave_out_prose, unfenced};
use super::fields::{self, Field, Found};
use super::heading::{self, ASKED_RANK, Heading};
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
    fn read_fields(&mut self, lines: &[(usize, String)]) {
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
fn comments_of(block: &CodeBlock) -> Vec<(usize, String)> {
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

/// Typographic quotes and blanks as plain ones, one sign for one sign.
fn with_plain_signs(line: &str) -> String {
    let plain = |c: char| match c {
        '\u{a0}' | '\u{202f}' | '\u{2007}' | '\u{2009}' | '\u{3000}' => ' ',
        '“' | '”' | '„' => '"',
        '‘' | '’' => '\'',
        '：' => ':',
        '，' => ',',
        '（' => '(',
        '）' => ')',
        _ => c,
    };
    line.chars().map(plain).collect()
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
    /// How the heading of the current step is marked.
    rank: u8,
    /// What the fields of the current step have stated so far.
    stated: Vec<Field>,
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
            rank: 0,
            stated: Vec::new(),
            prose: Vec::new(),
        };
        for (at, line) in text.lines().enumerate() {
            reader.line(at + 1, &with_plain_signs(line), line);
        }
        // A wrapper around the whole answer leaves a fence at its end.
        let left = reader
            .fence
            .take()
            .filter(|f| !(reader.ended || f.language == Language::Unnamed && reader.wrappers > 0));
        if let Some(open) = left.filter(|open| open.lines.iter().any(|l| !l.trim().is_empty())) {
            reader.reply.unclosed_fence = Some(open.line);
            reader.close(&open);
        }
        reader.finish_step();
        let code = reader.reply.steps.iter().any(|s| !s.code.is_empty());
        leave_out_prose(&mut reader.reply.preamble, code);
        reader
    }

    /// Takes in a line with plain signs, and as it is written.
    fn line(&mut self, number: usize, line: &str, written: &str) {
        match self.fence.take() {
            Some(open) if open.is_closed_by(line) => self.close(&open),
            Some(open) if self.is_wrapper(&open, line) => {
                self.wrappers += 1;
                self.line(number, line, written);
            }
            Some(mut open) => {
                open.push(line, written);
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
                let Heading { step, title, rank } = heading;
                self.rank = rank;
                self.reply.steps.push(StepText { step, line: number, title, ..StepText::default() });
                return;
            }
        }
        if heading::ending(line).is_some_and(|rank| self.ends_steps(rank)) {
            self.finish_step();
            self.ended = true;
        }
        let stated: Vec<Field> = fields::stated_in(line).collect();
        if let Some(candidate) = self.headings.last_mut() {
            candidate.has_tool |= stated.contains(&Field::Tool);
        }
        if !self.ended {
            self.note(stated);
            self.prose.push((number, line.to_owned()));
        }
    }

    fn note(&mut self, stated: impl IntoIterator<Item = Field>) {
        for field in stated {
            if !self.stated.contains(&field) {
                self.stated.push(field);
            }
        }
    }

    /// Whether a line of this rank that may head what follows the steps does so: the current step must have its code, as
    /// derivations have notes and summaries too. A heading above the step's ends it then; any other line stands before
    /// or between the fields until they have been stated; one below the step's is a part of it.
    fn ends_steps(&self, rank: u8) -> bool {
        let has = |field| self.stated.contains(&field);
        let marked = self.rank > 2;
        let own = if marked { self.rank } else { ASKED_RANK };
        match self.reply.steps.last() {
            Some(step) if !step.code.is_empty() => match rank {
                2 => has(Field::Outputs) && (has(Field::Locations) || has(Field::Volumes)),
                _ if rank > own => true,
                _ if marked && rank < own => false,
                _ => has(Field::Outputs) || has(Field::Volumes),
            },
            _ => false,
        }
    }

    fn close(&mut self, fence: &Fence) {
        if self.ended {
            return;
        }
        if fence.language == Language::Other || fence.holds_fields() {
            self.take_prose(fence.numbered_lines().collect());
            return;
        }
        let (block, fields) = fence.parts();
        self.take_prose(fields);
        match self.reply.steps.last_mut() {
            Some(step) => {
                let comments = comments_of(&block);
                step.code.push(block);
                self.note(comments.iter().flat_map(|(_, line)| fields::stated_in(line)));
            }
            None => self.reply.preamble.push(block),
        }
    }

    /// Takes in lines of a fence that are no code.
    fn take_prose(&mut self, lines: Vec<(usize, String)>) {
        self.note(lines.iter().flat_map(|(_, line)| fields::stated_in(line)));
        self.prose.extend(lines);
    }

    /// Reads what was gathered for the current step.
    fn finish_step(&mut self) {
        let mut prose = std::mem::take(&mut self.prose);
        self.stated.clear();
        let Some(step) = self.reply.steps.last_mut().filter(|_| !self.ended) else { return };
        step.has_body = !step.code.is_empty() || prose.iter().any(|(_, line)| !line.trim().is_empty());
        prose.extend(leave_out_prose(&mut step.code, false));
        prose.sort_by_key(|(number, _)| *number);
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
