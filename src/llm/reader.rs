//! The lines of an answer, one after the other: what belongs to which step, and where the steps end.
//!
//! Text comes in, and a way to tell headings; a [`Reply`] and all lines that may be headings go out. Imports
//! `reply` for what it fills, `fence`, `fields`, `heading`.

use std::collections::HashSet;

use super::fence::{Fence, Language, leave_out_prose, unfenced};
use super::fields;
use super::heading::{self, ASKED_RANK, Heading};
use super::keys::Field;
use super::reply::{Reply, StepText, comments_of};

/// A line that may be a heading.
pub(super) struct Candidate {
    pub line: usize,
    pub rank: u8,
    /// Whether a tool is named before the next candidate.
    pub has_tool: bool,
}

/// Reads an answer line by line.
pub(super) struct Reader {
    is_heading: fn(&str) -> Option<Heading>,
    /// Lines whose headings count; all if not given.
    chosen: Option<HashSet<usize>>,
    pub reply: Reply,
    pub headings: Vec<Candidate>,
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
    pub fn read(text: &str, is_heading: fn(&str) -> Option<Heading>, chosen: Option<HashSet<usize>>) -> Self {
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
