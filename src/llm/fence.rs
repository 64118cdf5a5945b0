//! Code in an answer: fenced blocks, and code that stands there without a fence.
//!
//! Lines come in; [`CodeBlock`]s go out. Imports `fields`.

use super::fields;

/// A block of code and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct CodeBlock {
    /// Line of the answer on which the code (not the fence) begins, from 1.
    pub first_line: usize,
    /// Spaces that were taken off every line because the fence was indented.
    pub indent: usize,
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

/// An open fence while the answer is read.
#[derive(Clone, Debug)]
pub struct Fence {
    mark: String,
    /// Its line.
    pub line: usize,
    indent: usize,
    /// What it holds.
    pub language: Language,
    /// Lines so far.
    pub lines: Vec<String>,
}

impl Fence {
    /// The fence that a line opens.
    pub fn opened_by(line: &str, number: usize) -> Option<Self> {
        let body = line.trim_start().trim_start_matches("- ").trim_start();
        let mark: String = body.chars().take_while(|&c| c == '`' || c == '~').collect();
        let uniform = mark.chars().all(|c| mark.starts_with(c));
        let info = body[mark.len()..].trim().to_lowercase();
        if mark.len() < 3 || !uniform || info.contains('`') {
            return None;
        }
        let first = info.split(|c: char| c.is_whitespace() || matches!(c, '{' | '}' | '.' | ':' | ',' | '#'));
        let language = match first.into_iter().find(|word| !word.is_empty()).unwrap_or("") {
            "markdown" | "md" => Language::Markdown,
            "" => Language::Unnamed,
            "python" | "py" | "python3" | "py3" | "numpy" | "code" | "ipython" | "python2" => {
                Language::Python
            }
            _ => Language::Other,
        };
        Some(Self { mark, line: number, indent: line.len() - body.len(), language, lines: Vec::new() })
    }

    /// Whether a line closes it.
    pub fn is_closed_by(&self, line: &str) -> bool {
        let body = line.trim();
        body.len() >= self.mark.len()
            && body.starts_with(&self.mark)
            && body.chars().all(|c| self.mark.starts_with(c))
    }

    /// Takes in a line of its content.
    pub fn push(&mut self, line: &str) {
        let blanks = line.len() - line.trim_start_matches([' ', '\t']).len();
        self.lines.push(line[blanks.min(self.indent)..].to_owned());
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

    /// The code in it.
    pub fn code(&self) -> CodeBlock {
        CodeBlock { first_line: self.line + 1, indent: self.indent, text: self.lines.join("\n") + "\n" }
    }
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
    CodeBlock { first_line: run[0].0, indent, text: lines.join("\n") + "\n" }
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
        ] {
            assert_eq!(Fence::opened_by(line, 1).unwrap().language, language, "{line}");
        }
        for line in ["``", "```a`b```", "text ```"] {
            assert!(Fence::opened_by(line, 1).is_none(), "{line}");
        }
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
