//! The keys of fields: `tool name:`, `in var name:` and their many other spellings.
//!
//! A line comes in; the keys in it go out, with where their values start. Imports nothing.

/// What a field states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// What the step does.
    Title,
    /// The tool.
    Tool,
    /// Pieces that go in.
    Inputs,
    /// Pieces that come out.
    Outputs,
    /// Where they are.
    Locations,
    /// How large they are.
    Volumes,
}

/// A key in a line.
pub struct Key {
    pub field: Field,
    pub sure: bool,
    /// Where it starts.
    pub start: usize,
    /// Where its value starts.
    pub value: usize,
}

/// Spellings of the keys, in lower case, a blank for each of ` _-`; longer ones stand before their beginnings.
const KEYS: &[(&str, Field)] = &[
    ("one line explanation", Field::Title),
    ("one line description", Field::Title),
    ("explanation", Field::Title),
    ("description", Field::Title),
    ("tool name", Field::Tool),
    ("tool used", Field::Tool),
    ("tool to be used", Field::Tool),
    ("tool to use", Field::Tool),
    ("selected tool", Field::Tool),
    ("chosen tool", Field::Tool),
    ("name of the tool", Field::Tool),
    ("tools", Field::Tool),
    ("tool", Field::Tool),
    ("in var names", Field::Inputs),
    ("in var name", Field::Inputs),
    ("in vars", Field::Inputs),
    ("in var", Field::Inputs),
    ("in variable names", Field::Inputs),
    ("in variable name", Field::Inputs),
    ("in variables", Field::Inputs),
    ("in variable", Field::Inputs),
    ("input variable names", Field::Inputs),
    ("input variable name", Field::Inputs),
    ("input variables", Field::Inputs),
    ("input variable", Field::Inputs),
    ("input var names", Field::Inputs),
    ("input var name", Field::Inputs),
    ("input vars", Field::Inputs),
    ("input var", Field::Inputs),
    ("input point clouds", Field::Inputs),
    ("input point cloud", Field::Inputs),
    ("input clouds", Field::Inputs),
    ("input cloud", Field::Inputs),
    ("input pieces", Field::Inputs),
    ("input piece", Field::Inputs),
    ("inputs", Field::Inputs),
    ("input", Field::Inputs),
    ("in", Field::Inputs),
    ("out var names", Field::Outputs),
    ("out var name", Field::Outputs),
    ("out vars", Field::Outputs),
    ("out var", Field::Outputs),
    ("out variable names", Field::Outputs),
    ("out variable name", Field::Outputs),
    ("out variables", Field::Outputs),
    ("out variable", Field::Outputs),
    ("output variable names", Field::Outputs),
    ("output variable name", Field::Outputs),
    ("output variables", Field::Outputs),
    ("output variable", Field::Outputs),
    ("output var names", Field::Outputs),
    ("output var name", Field::Outputs),
    ("output vars", Field::Outputs),
    ("output var", Field::Outputs),
    ("output point clouds", Field::Outputs),
    ("output point cloud", Field::Outputs),
    ("output clouds", Field::Outputs),
    ("output cloud", Field::Outputs),
    ("output pieces", Field::Outputs),
    ("output piece", Field::Outputs),
    ("outputs", Field::Outputs),
    ("output", Field::Outputs),
    ("out", Field::Outputs),
    ("variable names", Field::Outputs),
    ("variable name", Field::Outputs),
    ("var names", Field::Outputs),
    ("var name", Field::Outputs),
    ("locations", Field::Locations),
    ("location", Field::Locations),
    ("locs", Field::Locations),
    ("loc", Field::Locations),
    ("positions", Field::Locations),
    ("position", Field::Locations),
    ("volumes", Field::Volumes),
    ("volume", Field::Volumes),
    ("vols", Field::Volumes),
    ("vol", Field::Volumes),
];

/// What may stand between a key and its value, as in the paper's "the volume of each piece".
const TAILS: &[&str] =
    &[" of each piece", " of each cloud", " for the generated point cloud", " per piece", " (n)"];

/// Dashes, as bullets and between a key and its value.
pub const DASHES: &[char] = &['-', '‐', '‑', '‒', '–', '—', '―', '−'];

/// Whether the word is a key and nothing else.
pub fn is_key(word: &str) -> bool {
    KEYS.iter().any(|(key, _)| word.eq_ignore_ascii_case(key))
}

/// Keys outside brackets.
pub fn keys_in(text: &str) -> Vec<Key> {
    let mut found: Vec<Key> = Vec::new();
    let (mut depth, mut may_start, mut word) = (0isize, true, true);
    for (at, c) in text.char_indices() {
        // The long keys are unmistakable, wherever a word begins.
        if (may_start || word && !found.is_empty())
            && depth == 0
            && found.last().is_none_or(|last| last.value <= at)
            && let Some((field, key, value)) = key_at(text, at)
            && (may_start || key.contains(" var"))
        {
            let sure = match field {
                Field::Inputs | Field::Outputs => key.contains(" var"),
                Field::Locations | Field::Volumes => matches!(key, "loc" | "vol"),
                Field::Tool | Field::Title => key.contains(' '),
            };
            found.push(Key { field, sure, start: at, value });
        }
        match c {
            '[' | '(' | '{' => depth += 1,
            ']' | ')' | '}' => depth -= 1,
            _ => {}
        }
        may_start = matches!(c, ',' | ';' | '|' | ']' | '}') || may_start && is_filling(c);
        word = !c.is_alphanumeric();
    }
    found
}

fn is_filling(c: char) -> bool {
    matches!(c, ' ' | '*' | '_' | '`' | '"' | '.' | '/') || DASHES.contains(&c)
}

/// The key that stands at a place, and where its value starts.
fn key_at(text: &str, at: usize) -> Option<(Field, &'static str, usize)> {
    let article = text.get(at..at + 4).is_some_and(|head| head.eq_ignore_ascii_case("the "));
    let at = if article { at + 4 } else { at };
    KEYS.iter().find_map(|&(key, field)| {
        let head = text.get(at..at + key.len())?;
        let same = head
            .chars()
            .zip(key.chars())
            .all(|(a, b)| a.to_ascii_lowercase() == b || b == ' ' && matches!(a, '_' | '-'));
        same.then(|| value_start(text, at + key.len(), key, field)).flatten().map(|value| (field, key, value))
    })
}

/// Where the value begins behind a key that ends at `end`: behind a colon or equals sign, a dash or a bar, or
/// for keys of several words right away if it is bracketed or quoted.
fn value_start(text: &str, end: usize, key: &str, field: Field) -> Option<usize> {
    let mut rest = &text[end..];
    for tail in TAILS.iter().chain(&["(s)", "s"]) {
        rest = rest.strip_prefix(tail).unwrap_or(rest);
    }
    // "volume of `disc`: 4.19": the name goes along with the value.
    if matches!(field, Field::Locations | Field::Volumes)
        && let Some(of) = rest.strip_prefix(" of ")
        && let Some(colon) = of.find([':', '='])
        && of[..colon].split_whitespace().count() <= 2
    {
        let name = of[..colon].trim_start_matches("the ").trim_start_matches(['`', '"', '\'']);
        return Some(text.len() - of.len() + colon - name.len());
    }
    let several_words = key.contains(' ');
    let short = matches!(key, "tool" | "loc" | "vol");
    // "vol (approx.): {..}"
    if (several_words || short)
        && let Some(remark) = rest.trim_start_matches(['*', ' ']).strip_prefix('(')
        && let Some((_, behind)) = remark.split_once(')')
        && behind.trim_start_matches(['*', '_', '`', ' ']).starts_with([':', '='])
    {
        rest = behind;
    }
    let body = rest.trim_start_matches(['*', '_', '`', '"', ' ']);
    let start = |rest: &str| text.len() - rest.len();
    if let Some(value) = body.strip_prefix([':', '=', '→']) {
        return Some(start(value.trim_start_matches(['`', '*', ' ', '='])));
    }
    let apart = rest.starts_with([' ', '*', '`']);
    if several_words
        && apart
        && let Some(value) = body.strip_prefix("is ")
    {
        return Some(start(value));
    }
    if apart && body.starts_with('|') {
        return Some(start(&body[1..]));
    }
    if apart && body.starts_with(DASHES) && (several_words || short) {
        return Some(start(body.trim_start_matches(DASHES)));
    }
    let opened = body.starts_with(['[', '{', '"', '\'']) || rest.trim_start().starts_with('`');
    (apart && opened && (several_words || matches!(key, "loc" | "vol"))).then(|| start(body))
}
