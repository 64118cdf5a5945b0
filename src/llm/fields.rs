//! The fields of a step: `tool name:`, `in var name:`, `out var name:`, `loc:`, `vol:`.
//!
//! Lines of prose come in; fields with their raw values go out (`values` reads those). Keys are recognised at the
//! start of a line, behind a comma, or in a row of a table, in many spellings. Imports nothing.

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

/// The line without bullets, numbers, heading marks and emphasis at its start.
pub fn without_markup(line: &str) -> String {
    let mut rest = line.trim_start();
    loop {
        let before = rest;
        rest =
            rest.trim_start_matches(['#', '*', '>', '+', '_', '`', ' ', '•', '◦', '‣', '▪', '·', '|', '→']);
        rest = rest.trim_start_matches(DASHES);
        let digits = rest.chars().take_while(char::is_ascii_digit).count();
        if digits > 0 && rest[digits..].starts_with(['.', ')']) {
            rest = &rest[digits + 1..];
        }
        if rest == before {
            return rest.to_owned();
        }
    }
}

/// All fields in lines of prose: line number, field, raw value. A value goes on over the next lines while
/// its brackets are open, and over a list below a key that has nothing behind it.
pub fn read(lines: &[(usize, String)]) -> Vec<(usize, Field, String)> {
    let mut out = Vec::new();
    let mut at = 0;
    while at < lines.len() {
        let (number, line) = &lines[at];
        let mut text = without_markup(line);
        at += 1;
        let Some(&(_, _, last)) = keys_in(&text).last() else { continue };
        let follows = |at: usize| at < lines.len() && lines[at].0 == lines[at - 1].0 + 1;
        if bare(&text[last..]).is_empty() {
            while follows(at) && is_item_below(line, &lines[at].1) {
                text.push_str(" , ");
                text.push_str(bare(&without_markup(&lines[at].1)));
                at += 1;
            }
        }
        while open_brackets(&text) > 0 && follows(at) && !lines[at].1.trim().is_empty() {
            text.push(' ');
            text.push_str(&without_markup(&lines[at].1));
            at += 1;
        }
        let keys = keys_in(&text);
        for (i, &(field, _, start)) in keys.iter().enumerate() {
            let end = keys.get(i + 1).map_or(text.len(), |next| next.1);
            out.push((*number, field, bare(&text[start..end]).to_owned()));
        }
    }
    out
}

/// A value without what surrounds it.
fn bare(value: &str) -> &str {
    value.trim().trim_end_matches([',', ';', '|', '/', ' ', '*', '_']).trim_start_matches(['*', ',', ' '])
}

/// Whether a line is an item of a list under `key`: a bullet that stands further right, and no field.
fn is_item_below(key: &str, line: &str) -> bool {
    let indent = |l: &str| l.len() - l.trim_start().len();
    let body = line.trim_start();
    let bullet = body.starts_with(['*', '+', '•', '◦', '▪']) || body.starts_with(DASHES);
    bullet && indent(line) > indent(key) && keys_in(&without_markup(line)).is_empty()
}

/// Whether the line holds a field.
pub fn is_field(line: &str) -> bool {
    !keys_in(&without_markup(line)).is_empty()
}

/// Whether the line names a tool.
pub fn is_tool(line: &str) -> bool {
    keys_in(&without_markup(line)).iter().any(|key| key.0 == Field::Tool)
}

fn open_brackets(text: &str) -> isize {
    text.chars().fold(0, |depth, c| match c {
        '[' | '(' | '{' => depth + 1,
        ']' | ')' | '}' => depth - 1,
        _ => depth,
    })
}

/// Keys outside brackets: field, where the key starts, where its value starts.
fn keys_in(text: &str) -> Vec<(Field, usize, usize)> {
    let mut found: Vec<(Field, usize, usize)> = Vec::new();
    let (mut depth, mut may_start, mut word) = (0isize, true, true);
    for (at, c) in text.char_indices() {
        // The long keys are unmistakable, wherever a word begins.
        if (may_start || word && !found.is_empty())
            && depth == 0
            && found.last().is_none_or(|last| last.2 <= at)
            && let Some((field, key, value)) = key_at(text, at)
            && (may_start || key.contains(" var"))
        {
            found.push((field, at, value));
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
    let body = rest.trim_start_matches(['*', '_', '`', '"', ' ']);
    let start = |rest: &str| text.len() - rest.len();
    if let Some(value) = body.strip_prefix([':', '=', '→']) {
        return Some(start(value.trim_start_matches(['`', '*', ' ', '='])));
    }
    let apart = rest.starts_with([' ', '*', '`']);
    if apart && body.starts_with('|') {
        return Some(start(&body[1..]));
    }
    let several_words = key.contains(' ');
    if apart && body.starts_with(DASHES) && (several_words || matches!(key, "tool" | "loc" | "vol")) {
        return Some(start(body.trim_start_matches(DASHES)));
    }
    let opened = body.starts_with(['[', '{', '"', '\'']) || rest.trim_start().starts_with('`');
    (apart && opened && (several_words || matches!(key, "loc" | "vol"))).then(|| start(body))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(line: &str) -> Vec<(Field, String)> {
        read(&[(1, line.to_owned())]).into_iter().map(|(_, f, v)| (f, v)).collect()
    }

    #[test]
    fn keys_in_many_spellings() {
        for line in [
            "tool name: [Rolling pin]",
            "**Tool name:** [Rolling pin]",
            "- *Tool*: [Rolling pin]",
            "2. Tool_Name = [Rolling pin]",
            "tool name [Rolling pin]",
            "Tool name – [Rolling pin]",
            "• The tool to be used: [Rolling pin]",
            "| **Tool name** | [Rolling pin] |",
            "`tool name`: [Rolling pin]",
            "\"tool name\": [Rolling pin],",
            "— Tools: [Rolling pin]",
        ] {
            assert_eq!(one(line), [(Field::Tool, "[Rolling pin]".to_owned())], "{line}");
        }
        for line in [
            "my tool: a pin",
            "- Volume before V = 4",
            "input volume = 3",
            "tool marks are left",
            "The variables of this step:",
            "The output of this step: a disc",
            "volume is preserved",
            "the position [0, 0, 0] is the centre",
            "The volume of the new cylinder then has to be equal: V",
        ] {
            assert!(one(line).is_empty(), "{line}: {:?}", one(line));
        }
    }

    #[test]
    fn inputs_and_outputs_on_one_line() {
        for line in [
            "in var name: [\"ball\", rest], out var name: [disc]",
            "In var name: [\"ball\", rest] | Out var name: [disc]",
            "in var name: [\"ball\", rest] out var name: [disc]",
            "in var name [\"ball\", rest]; out var name [disc]",
            "in var name: [\"ball\", rest] / out var name: [disc]",
        ] {
            let found = one(line);
            assert_eq!(found[0], (Field::Inputs, "[\"ball\", rest]".to_owned()), "{line}");
            assert_eq!(found[1], (Field::Outputs, "[disc]".to_owned()), "{line}");
        }
        let plain = one("in var name: ball out var name: disc");
        assert_eq!(plain, [(Field::Inputs, "ball".to_owned()), (Field::Outputs, "disc".to_owned())]);
    }

    #[test]
    fn fields_may_be_sentences_of_one_line() {
        let found = one("Loc: [a: (0, 0, 0)]. Vol: [a: 4.0].");
        let wanted = [(Field::Locations, "[a: (0, 0, 0)]."), (Field::Volumes, "[a: 4.0].")];
        assert_eq!(found, wanted.map(|(f, v)| (f, v.to_owned())));
    }

    #[test]
    fn places_and_volumes_may_be_of_something() {
        let of = one("Volume of disc: 4.19");
        assert_eq!(of, [(Field::Volumes, "disc: 4.19".to_owned())]);
        let each = one("- **Location of each piece**: disc (0, 0, 0)");
        assert_eq!(each, [(Field::Locations, "disc (0, 0, 0)".to_owned())]);
    }

    #[test]
    fn values_go_on_while_brackets_are_open() {
        let lines: Vec<(usize, String)> =
            (5..).zip(["loc: {", "  \"a\": (1, 2, 3),", "}", "vol: {\"a\": 1}"].map(String::from)).collect();
        let found = read(&lines);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].0, found[1].0), (5, 8));
        assert_eq!(found[0].2, "{ \"a\": (1, 2, 3), }");
    }

    #[test]
    fn values_may_be_lists_below_their_key() {
        let text = "- **Vol**:\n    - ball: 4.19\n    - disc: 4.18\n- Out var name:\n  * disc\n- not an item";
        let lines: Vec<(usize, String)> = (1..).zip(text.lines().map(String::from)).collect();
        let found: Vec<(Field, String)> = read(&lines).into_iter().map(|(_, f, v)| (f, v)).collect();
        let wanted = [(Field::Volumes, "ball: 4.19 , disc: 4.18"), (Field::Outputs, "disc")];
        assert_eq!(found, wanted.map(|(f, v)| (f, v.to_owned())));
    }
}
