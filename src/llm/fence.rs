//! Code in an answer: fenced blocks, and code that stands there without a fence.
//!
//! Lines come in; [`CodeBlock`]s go out. Imports `fields` and, to know Python from what is none, `stagecode`.

use super::fields;
use crate::stagecode::is_python;

/// A block of code and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct CodeBlock {
    /// Line of the answer on which the code (not the fence) begins, from 1.
    pub first_line: usize,
    /// Spaces that were taken off every line because the fence was indented.
    pub indent: usize,
    /// Whether it is surely meant to be Python: its fence says so, or there is none. Others may hold anything.
    pub sure: bool,
    /// The code.
    pub text: String,
}

/// What a fence says that it holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// Python, by name.
    Python,
    /// Nothing is said.
    Unnamed,
    /// Markdown: a wrapper around the answer, which hides nothing.
    Markdown,
    /// Something else.
    Other,
}

/// Names of Python behind a fence.
const PYTHON: &[&str] = &["python", "py", "python3", "py3", "numpy", "code", "ipython", "python2"];

/// An open fence while the answer is read.
#[derive(Clone, Debug)]
pub struct Fence {
    mark: String,
    /// Its line.
    pub line: usize,
    /// Signs of the quote (`> `) in which it stands.
    quote: usize,
    indent: usize,
    /// What it holds.
    pub language: Language,
    /// Lines so far, with plain signs.
    pub lines: Vec<String>,
    /// The same as they are written: typographic quotes belong into strings.
    written: Vec<String>,
}

impl Fence {
    /// The fence that a line opens. It may be an item of a list, stand in a quote, or behind words if it says Python.
    pub fn opened_by(line: &str, number: usize) -> Option<Self> {
        let unquoted = without_quote(line);
        let body = without_bullet(unquoted);
        let (lead, body) = match body.find("```") {
            Some(at) if !body.starts_with(['`', '~']) => body.split_at(at),
            _ => ("", body),
        };
        let mark: String = body.chars().take_while(|&c| c == '`' || c == '~').collect();
        let uniform = mark.chars().all(|c| mark.starts_with(c));
        let info = body[mark.len()..].trim().to_lowercase();
        if mark.len() < 3 || !uniform || info.contains('`') {
            return None;
        }
        let mut words =
            info.split(|c: char| c.is_whitespace() || matches!(c, '{' | '}' | '.' | ':' | ',' | '#'));
        let language = match words.find(|word| !word.is_empty()).unwrap_or("") {
            "markdown" | "md" => Language::Markdown,
            "" => Language::Unnamed,
            name if PYTHON.contains(&name) => Language::Python,
            _ => Language::Other,
        };
        if !lead.is_empty() && !PYTHON.contains(&&*info) {
            return None;
        }
        let quote = line.len() - unquoted.len();
        let start = if lead.is_empty() { body } else { unquoted.trim_start() };
        let indent = unquoted.len() - start.len();
        Some(Self { mark, line: number, quote, indent, language, lines: Vec::new(), written: Vec::new() })
    }

    /// Whether a line closes it; a full stop may follow.
    pub fn is_closed_by(&self, line: &str) -> bool {
        let body = self.unquoted(line).trim().trim_end_matches(['.', ',', ';', ':']);
        body.len() >= self.mark.len()
            && body.starts_with(&self.mark)
            && body.chars().all(|c| self.mark.starts_with(c))
    }

    /// Takes in a line of its content, with plain signs and as it is written.
    pub fn push(&mut self, plain: &str, written: &str) {
        let inner = |line: &str| {
            let line = self.unquoted(line);
            let blanks = line.len() - line.trim_start_matches([' ', '\t']).len();
            line[blanks.min(self.indent)..].to_owned()
        };
        let (plain, written) = (inner(plain), inner(written));
        self.lines.push(plain);
        self.written.push(written);
    }

    fn unquoted<'a>(&self, line: &'a str) -> &'a str {
        if self.quote > 0 { without_quote(line) } else { line }
    }

    /// Whether there is nothing but fields in it: `loc:` and the rest, fenced for looks.
    pub fn holds_fields(&self) -> bool {
        let numbered: Vec<(usize, String)> = (0..).zip(self.lines.iter().cloned()).collect();
        let first = self.lines.iter().find(|l| !l.trim().is_empty());
        let count = fields::read(&numbered).len();
        let assigns = |l: &String| l.contains("np.") || l.trim_start().starts_with("import ");
        self.language != Language::Python
            && first.is_some_and(|l| fields::is_field(l))
            && count > 0
            && !self.lines.iter().any(assigns)
    }

    /// Its lines with their numbers in the answer.
    pub fn numbered_lines(&self) -> impl Iterator<Item = (usize, String)> {
        (self.line + 1..).zip(self.lines.iter().cloned())
    }

    /// The code in it, and the lines of fields behind the code, before which the fence should have been closed.
    pub fn parts(&self) -> (CodeBlock, Vec<(usize, String)>) {
        let whole = self.code(self.lines.len());
        if !is_python(&whole.text) {
            let first = (1..self.lines.len()).find(|&at| fields::is_field(&self.lines[at]));
            let split = first.map(|at| (at, self.code(at)));
            if let Some((at, code)) = split.filter(|(_, code)| is_python(&code.text)) {
                return (code, self.numbered_lines().skip(at).collect());
            }
        }
        (whole, Vec::new())
    }

    /// The code in its first lines: as it is written if that is Python, or else with plain signs and tidied.
    fn code(&self, count: usize) -> CodeBlock {
        let text = |lines: &[String]| lines.join("\n") + "\n";
        let (sure, first_line) = (self.language == Language::Python, self.line + 1);
        let block =
            |text, more| CodeBlock { first_line, indent: self.quote + self.indent + more, sure, text };
        let as_written = text(&self.written[..count]);
        if is_python(&as_written) {
            return block(as_written, 0);
        }
        let plain = text(&self.lines[..count]);
        let (tidy, indent) = tidied(&self.lines[..count]);
        if !is_python(&plain) && is_python(&text(&tidy)) {
            return block(text(&tidy), indent);
        }
        block(plain, 0)
    }
}

/// Lines of code without what a notebook or a console adds: an indent of all lines, prompts `>>>` and the output between
/// them, commands such as `%matplotlib inline` and `!pip install numpy`. Also the number of signs taken off each line.
fn tidied(lines: &[String]) -> (Vec<String>, usize) {
    let filled = || lines.iter().filter(|l| !l.trim().is_empty());
    let indent = filled().map(|l| indent_of(l)).min().unwrap_or(0);
    let console = filled().any(|l| l.trim_start().starts_with(">>>"));
    let tidy = lines.iter().map(|line| {
        let line = line.get(indent..).unwrap_or("");
        let prompted = line.strip_prefix(">>>").or_else(|| line.strip_prefix("..."));
        match prompted {
            Some(code) if console => code.strip_prefix(' ').unwrap_or(code).to_owned(),
            // Lines stay, so that errors name the right one.
            _ if console || line.starts_with(['%', '!']) => String::new(),
            _ => line.to_owned(),
        }
    });
    (tidy.collect(), indent + if console { 4 } else { 0 })
}

/// The line without the mark of a quote.
fn without_quote(line: &str) -> &str {
    let body = line.trim_start();
    match body.strip_prefix('>') {
        Some(inner) => inner.strip_prefix(' ').unwrap_or(inner),
        None => line,
    }
}

/// The line without blanks, bullets and numbers at its start.
fn without_bullet(line: &str) -> &str {
    let body = line.trim_start().trim_start_matches("- ").trim_start();
    let body = body.strip_prefix("* ").or_else(|| body.strip_prefix("+ ")).unwrap_or(body);
    let digits = body.chars().take_while(char::is_ascii_digit).count();
    let numbered = if digits > 0 { body[digits..].strip_prefix(". ") } else { None };
    numbered.unwrap_or(body).trim_start()
}

/// Leaves out the blocks that are no Python, where others are: formulas and outputs in fences. Returns their lines.
pub fn leave_out_prose(blocks: &mut Vec<CodeBlock>, others: bool) -> Vec<(usize, String)> {
    let is_code = |block: &CodeBlock| block.sure || is_python(&block.text);
    if !others && !blocks.iter().any(is_code) {
        return Vec::new();
    }
    let (code, prose): (Vec<CodeBlock>, Vec<CodeBlock>) =
        std::mem::take(blocks).into_iter().partition(is_code);
    *blocks = code;
    let lines = |block: CodeBlock| {
        (block.first_line..).zip(block.text.lines().map(str::to_owned)).collect::<Vec<_>>()
    };
    prose.into_iter().flat_map(lines).collect()
}

/// Code without a fence among lines of prose: runs of lines that read as Python and use numpy. Returns the blocks
/// and the lines that are none of it.
pub fn unfenced(lines: &[(usize, String)]) -> (Vec<CodeBlock>, Vec<(usize, String)>) {
    let (mut blocks, mut prose) = (Vec::new(), Vec::new());
    let mut at = 0;
    while at < lines.len() {
        let end = run_of_code(lines, at);
        let run = &lines[at..end];
        if run.iter().any(|(_, l)| l.contains("np.")) {
            blocks.push(block(run));
            at = end;
        } else {
            prose.push(lines[at].clone());
            at += 1;
        }
    }
    (blocks, prose)
}

/// Where the run of code that begins at `start` ends; `start` if none does.
fn run_of_code(lines: &[(usize, String)], start: usize) -> usize {
    let (mut at, mut end, mut depth) = (start, start, 0isize);
    let margin = indent_of(&lines[start].1);
    // Indent of the last statement, and whether it opens a block.
    let (mut indent, mut opens) = (margin, false);
    while at < lines.len() && (at == start || lines[at].0 == lines[at - 1].0 + 1) {
        let line = &lines[at].1;
        let code = line.split('#').next().unwrap_or("");
        let blank_or_comment = code.trim().is_empty();
        let deepest = if opens { usize::MAX } else { indent };
        let fits = (margin..=deepest).contains(&indent_of(line));
        if depth <= 0 && !blank_or_comment && !(reads_as_code(code) && fits) {
            break;
        }
        if at == start && line.trim().is_empty() {
            break;
        }
        if depth <= 0 && !blank_or_comment {
            (indent, opens) = (indent_of(line), code.trim_end().ends_with(':'));
        }
        depth +=
            code.chars().fold(0, |d, c| d + isize::from("([{".contains(c)) - isize::from(")]}".contains(c)));
        at += 1;
        if !line.trim().is_empty() {
            end = at;
        }
    }
    end
}

fn indent_of(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// Whether a line without its comment may be Python: an import, a call, a compound statement, an assignment.
fn reads_as_code(line: &str) -> bool {
    let body = line.trim();
    let first = body.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or("");
    if !body.is_ascii() || fields::is_field(body) && !body.contains("np.") && !is_plain_assignment(body) {
        return false;
    }
    match first {
        "import" => return true,
        "from" => return body.contains(" import "),
        "for" | "while" | "if" | "elif" | "else" | "def" | "try" | "except" | "with" => {
            return body.ends_with(':');
        }
        "return" | "pass" | "break" | "continue" | "print" | "np" | "rng" => return true,
        _ => {}
    }
    let Some((target, value)) = body.split_once('=') else {
        // A call of a method, such as `parts.append(x)`.
        return first.len() < body.len() && body[first.len()..].starts_with('.') && body.ends_with(')');
    };
    let target = target.trim_end_matches(['+', '-', '*', '/', '%', '&', '|']);
    let starts = target.starts_with(|c: char| c.is_alphabetic() || c == '_' || c == '(');
    let words = |part: &str| part.split('[').next().is_some_and(|p| p.split_whitespace().count() == 1);
    let names = target.trim_matches(['(', ')', ' ']).split(',').all(words);
    starts && names && !value.trim().is_empty() && !value.starts_with('=')
}

/// Whether a line sets a variable, such as `volume = 0.16 / 2`, rather than a field, such as `Volume: 0.08`.
fn is_plain_assignment(body: &str) -> bool {
    let Some((name, value)) = body.split_once('=') else { return false };
    let variable = name.trim().chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    variable && !value.trim_start().starts_with(['{', '[', '(', '"', '\'', '`'])
}

fn block(run: &[(usize, String)]) -> CodeBlock {
    let indent =
        run.iter().filter(|(_, l)| !l.trim().is_empty()).map(|(_, l)| indent_of(l)).min().unwrap_or(0);
    let lines: Vec<&str> = run.iter().map(|(_, l)| l.get(indent..).unwrap_or("")).collect();
    CodeBlock { first_line: run[0].0, indent, sure: true, text: lines.join("\n") + "\n" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn languages_in_many_spellings() {
        for (line, language) in [
            ("```", Language::Unnamed),
            ("``` Python", Language::Python),
            ("```{.python}", Language::Python),
            ("```python:step1.py", Language::Python),
            ("  ~~~py title=\"x\"", Language::Python),
            ("```python # step 1", Language::Python),
            ("````json", Language::Other),
            ("```markdown", Language::Markdown),
            ("Code: ```python", Language::Python),
            ("* ```python", Language::Python),
            ("1. ```py", Language::Python),
            ("> ```", Language::Unnamed),
        ] {
            assert_eq!(Fence::opened_by(line, 1).unwrap().language, language, "{line}");
        }
        for line in ["``", "```a`b```", "text ```", "between ```python and ```", "see ```python below"] {
            assert!(Fence::opened_by(line, 1).is_none(), "{line}");
        }
    }

    /// The code of a fence whose content is `text`.
    fn code_in(opening: &str, text: &str) -> CodeBlock {
        let mut fence = Fence::opened_by(opening, 1).unwrap();
        text.lines().for_each(|line| fence.push(line, line));
        fence.parts().0
    }

    #[test]
    fn code_is_tidied_where_it_is_no_python_as_it_stands() {
        for (text, wanted) in [
            ("a = 1\n", "a = 1\n"),
            ("    a = 1\n      # b\n", "a = 1\n  # b\n"),
            (">>> for i in x:\n...     a = 1\n...\n1.0\n", "for i in x:\n    a = 1\n\n\n"),
            ("%matplotlib inline\n!pip install numpy\na = 1\n", "\n\na = 1\n"),
            ("a = (\n", "a = (\n"),
            ("a = 5 % 3\nprint('%d' % a)\n", "a = 5 % 3\nprint('%d' % a)\n"),
        ] {
            assert_eq!(code_in("```python", text).text, wanted);
        }
        let quoted = code_in("> ```python", "> a = 1\n>   # b");
        assert_eq!((quoted.indent, quoted.text.as_str()), (2, "a = 1\n  # b\n"));
    }

    #[test]
    fn fields_behind_the_code_are_none_of_it() {
        let mut fence = Fence::opened_by("```python", 1).unwrap();
        for line in ["a = 1", "in var name: [b], out var name: [a]", "vol: {\"a\": 2}"] {
            fence.push(line, line);
        }
        let (code, fields) = fence.parts();
        assert_eq!((code.text.as_str(), fields.len(), fields[0].0), ("a = 1\n", 2, 3));
    }

    #[test]
    fn code_without_a_fence_is_found_between_prose() {
        let text = "Formula: V = 4/3 pi r^3\nR = 1.2 follows from this.\nCode:\n    import numpy as np\n    \
                    n = 300  # points\n\n    for i in range(2):\n        a = np.zeros(\n  (3, 3))\n    b = a\n\n\
                    in var name: [a], out var name: [b]";
        let lines: Vec<(usize, String)> = (1..).zip(text.lines().map(str::to_owned)).collect();
        let (blocks, prose) = unfenced(&lines);
        let [block] = &blocks[..] else { panic!("{blocks:?}") };
        assert_eq!((block.first_line, block.indent), (4, 2));
        assert!(block.text.trim_end().ends_with("  b = a"), "{}", block.text);
        assert_eq!(prose.len(), 5);
    }
}
