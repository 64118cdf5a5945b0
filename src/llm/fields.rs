//! The fields of a step: `tool name:`, `in var name:`, `out var name:`, `loc:`, `vol:`.
//!
//! Lines of prose come in; fields with their raw values, and the names, points and volumes in them, go out.
//! Keys are recognised at the start of a line or behind a comma, in many spellings. Imports `math`.

use std::collections::BTreeMap;

use crate::math::cloud::Point;

/// What a field states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
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

/// Spellings of the keys, in lower case; longer ones stand before their beginnings.
const KEYS: &[(&str, Field)] = &[
    ("tool name", Field::Tool),
    ("tool used", Field::Tool),
    ("tool", Field::Tool),
    ("in var names", Field::Inputs),
    ("in var name", Field::Inputs),
    ("in vars", Field::Inputs),
    ("in var", Field::Inputs),
    ("in variable names", Field::Inputs),
    ("in variable name", Field::Inputs),
    ("input variable names", Field::Inputs),
    ("input variable name", Field::Inputs),
    ("input variables", Field::Inputs),
    ("input variable", Field::Inputs),
    ("input var names", Field::Inputs),
    ("input var name", Field::Inputs),
    ("inputs", Field::Inputs),
    ("input", Field::Inputs),
    ("out var names", Field::Outputs),
    ("out var name", Field::Outputs),
    ("out vars", Field::Outputs),
    ("out var", Field::Outputs),
    ("out variable names", Field::Outputs),
    ("out variable name", Field::Outputs),
    ("output variable names", Field::Outputs),
    ("output variable name", Field::Outputs),
    ("output variables", Field::Outputs),
    ("output variable", Field::Outputs),
    ("output var names", Field::Outputs),
    ("output var name", Field::Outputs),
    ("outputs", Field::Outputs),
    ("output", Field::Outputs),
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

/// The line without bullets, numbers, heading marks and emphasis at its start.
pub fn without_markup(line: &str) -> String {
    let mut rest = line.trim_start();
    loop {
        let before = rest;
        rest = rest.trim_start_matches(['#', '*', '>', '-', '+', '_', '`', ' ', '•']);
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
/// its brackets are open.
pub fn read(lines: &[(usize, String)]) -> Vec<(usize, Field, String)> {
    let mut out = Vec::new();
    let mut at = 0;
    while at < lines.len() {
        let number = lines[at].0;
        let mut text = without_markup(&lines[at].1);
        at += 1;
        if keys_in(&text).is_empty() {
            continue;
        }
        while open_brackets(&text) > 0 && at < lines.len() && !lines[at].1.trim().is_empty() {
            text.push(' ');
            text.push_str(&without_markup(&lines[at].1));
            at += 1;
        }
        let keys = keys_in(&text);
        for (i, &(field, _, start)) in keys.iter().enumerate() {
            let end = keys.get(i + 1).map_or(text.len(), |next| next.1);
            let value = text[start..end].trim().trim_end_matches([',', ';', '|', ' ', '*', '_']);
            out.push((number, field, value.trim_start_matches(['*', ' ']).to_owned()));
        }
    }
    out
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
    let (mut depth, mut may_start) = (0isize, true);
    for (at, c) in text.char_indices() {
        if may_start
            && depth == 0
            && let Some((field, value)) = key_at(text, at)
        {
            found.push((field, at, value));
        }
        match c {
            '[' | '(' | '{' => depth += 1,
            ']' | ')' | '}' => depth -= 1,
            _ => {}
        }
        may_start = matches!(c, ',' | ';' | '|') || may_start && matches!(c, ' ' | '*' | '_' | '`' | '-');
    }
    found
}

/// The key that stands at a place, and where its value starts.
fn key_at(text: &str, at: usize) -> Option<(Field, usize)> {
    KEYS.iter().find_map(|&(key, field)| {
        let head = text.get(at..at + key.len())?;
        let same = head
            .chars()
            .zip(key.chars())
            .all(|(a, b)| a.to_ascii_lowercase() == b || b == ' ' && matches!(a, '_' | '-'));
        let rest = &text[at + key.len()..];
        let body = rest.trim_start_matches("(s)").trim_start_matches(['*', '_', '`', ' ']);
        let value = body.strip_prefix([':', '='])?;
        same.then_some((field, text.len() - value.len()))
    })
}

/// Variable names in a value such as `["ball", "disc"]` or `ball and disc`.
pub fn names(value: &str) -> Vec<String> {
    // Behind a closing bracket stand comments.
    let inner = value.find('[').and_then(|a| Some(&value[a + 1..a + value[a..].find(']')?]));
    let inner = inner.unwrap_or(value);
    let words = inner.split(|c: char| !(c.is_alphanumeric() || c == '_'));
    let mut out: Vec<String> = Vec::new();
    for word in words {
        let filler = matches!(word.to_lowercase().as_str(), "none" | "and" | "n" | "a" | "na" | "null");
        let quoted = inner.contains(&format!("\"{word}\"")) || inner.contains(&format!("'{word}'"));
        let starts = word.starts_with(|c: char| c.is_alphabetic() || c == '_');
        if starts && (!filler || quoted) && !out.iter().any(|o| o == word) {
            out.push(word.to_owned());
        }
    }
    out
}

/// Locations in a value: `{"ball": (0, 0, 0)}`, `ball = [0, 0, 0]`, or bare points for the outputs in order.
pub fn locations(value: &str, outputs: &[String]) -> BTreeMap<String, Point> {
    let mut named = BTreeMap::new();
    let mut bare = Vec::new();
    let mut rest = value;
    while let Some((before, inside, after)) = innermost(rest) {
        let numbers: Vec<f64> = inside.split(',').filter_map(plain_number).collect();
        if let Ok(point) = <Point>::try_from(numbers) {
            match last_name(before) {
                Some(name) => drop(named.insert(name, point)),
                None => bare.push(point),
            }
        }
        rest = after;
    }
    if named.is_empty() {
        named.extend(outputs.iter().cloned().zip(bare));
    }
    named
}

/// The next innermost pair of brackets: what stands before, inside, behind.
fn innermost(text: &str) -> Option<(&str, &str, &str)> {
    let close = text.find([')', ']', '}'])?;
    let open = text[..close].rfind(['(', '[', '{']);
    match open {
        Some(open) => Some((&text[..open], &text[open + 1..close], &text[close + 1..])),
        None => innermost(&text[close + 1..]),
    }
}

/// The name that ends a text such as `{"ball": ` or `np.array` behind `ball = `.
fn last_name(before: &str) -> Option<String> {
    let before = before.trim_end().trim_end_matches("np.array").trim_end();
    let before = before.strip_suffix([':', '=']).unwrap_or(before).trim_end();
    let before = before.trim_end_matches(['"', '\'', '`', '*']);
    let start = before
        .rfind(|c: char| !(c.is_alphanumeric() || c == '_'))
        .map_or(0, |at| at + before[at..].chars().next().map_or(1, char::len_utf8));
    let name = &before[start..];
    let word = name.starts_with(|c: char| c.is_alphabetic() || c == '_');
    (word && !matches!(name, "at" | "is")).then(|| name.to_owned())
}

fn plain_number(text: &str) -> Option<f64> {
    let text = text.trim().replace('−', "-");
    text.parse().ok().filter(|x: &f64| x.is_finite())
}

/// Volumes in a value, as written: `{"ball": 4.19}`, `ball = 4/3*pi`, or a bare number for one output.
pub fn volumes(value: &str, outputs: &[String]) -> BTreeMap<String, String> {
    let inner = value.trim().trim_start_matches('{').trim_end_matches(['}', '.', ' ']);
    let mut out = BTreeMap::new();
    for part in split_outside_brackets(inner) {
        let (name, text) = match part.split_once([':', '=']) {
            Some((name, text)) if last_name(name).is_some() => (last_name(name), text),
            _ => (None, part),
        };
        let text = text.trim();
        let name = name.or_else(|| if out.is_empty() { outputs.first().cloned() } else { None });
        if let (Some(name), true) = (name, text.contains(|c: char| c.is_ascii_digit())) {
            out.insert(name, text.to_owned());
        }
    }
    out
}

/// The number that a stated volume is: behind its last `=`, without units, worked out if it is a formula.
pub fn number(text: &str, formula: impl FnOnce(&str) -> Option<f64>) -> Option<f64> {
    let last = text.rsplit(['=', '≈']).next().unwrap_or(text).trim();
    let plain = last.replace('−', "-").replace(['·', '×'], "*").replace('π', "pi").replace('^', "**");
    let digits = plain
        .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | '-' | '+')))
        .unwrap_or(plain.len());
    let rest = plain[digits..].trim_start();
    let unit = rest.is_empty() || rest.starts_with(char::is_alphabetic) && !rest.starts_with("pi");
    let value = if unit { plain[..digits].trim().parse().ok() } else { formula(&plain) };
    value.filter(|v: &f64| v.is_finite())
}

fn split_outside_brackets(text: &str) -> Vec<&str> {
    let (mut depth, mut start, mut out) = (0isize, 0, Vec::new());
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            ',' | ';' if depth == 0 => {
                out.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    out.push(&text[start..]);
    out
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
        ] {
            assert_eq!(one(line), [(Field::Tool, "[Rolling pin]".to_owned())], "{line}");
        }
        assert!(one("the tool: a pin").is_empty());
        assert!(one("- Volume before V = 4").is_empty());
    }

    #[test]
    fn inputs_and_outputs_on_one_line() {
        let found = one("in var name: [\"ball\", rest], out var name: [disc]");
        assert_eq!(found[0], (Field::Inputs, "[\"ball\", rest]".to_owned()));
        assert_eq!(found[1], (Field::Outputs, "[disc]".to_owned()));
        assert_eq!(names(&found[0].1), ["ball", "rest"]);
        assert_eq!(names("`half_left` and `half_right`"), ["half_left", "half_right"]);
        assert!(names("None").is_empty());
        assert!(names("[]").is_empty());
    }

    #[test]
    fn locations_and_volumes_in_many_spellings() {
        for text in [
            "{\"ball\": (0, -0.5, 1)}",
            "ball: [0, -0.5, 1]",
            "`ball` = np.array([0, −0.5, 1])",
            "(0, -0.5, 1)",
        ] {
            assert_eq!(locations(text, &["ball".into()])["ball"], [0.0, -0.5, 1.0], "{text}");
        }
        let two = locations("{'a': (1, 2, 3), 'b': (4, 5, 6)}", &[]);
        assert_eq!((two["a"], two["b"]), ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]));
        let volumes_of = |text: &str| volumes(text, &["disc".into()]);
        assert_eq!(volumes_of("{\"ball\": 4.19, \"disc\": 4/3*pi}")["disc"], "4/3*pi");
        assert_eq!(volumes_of("4.18879")["disc"], "4.18879");
        assert_eq!(volumes_of("ball: round(4.2, 1), disc: 2 cubic units")["ball"], "round(4.2, 1)");
    }

    #[test]
    fn volumes_become_numbers() {
        let formula = |text: &str| (text == "4/3 * pi").then_some(4.0);
        assert_eq!(number("4.19", formula), Some(4.19));
        assert_eq!(number("2 cubic units", formula), Some(2.0));
        assert_eq!(number("a * b = 0.08", formula), Some(0.08));
        assert_eq!(number("4/3 · π", formula), Some(4.0));
        assert_eq!(number("as before", formula), None);
    }

    #[test]
    fn values_go_on_while_brackets_are_open() {
        let lines: Vec<(usize, String)> =
            (5..).zip(["loc: {", "  \"a\": (1, 2, 3),", "}", "vol: {\"a\": 1}"].map(String::from)).collect();
        let found = read(&lines);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].0, found[1].0), (5, 8));
        assert_eq!(locations(&found[0].2, &[])["a"], [1.0, 2.0, 3.0]);
    }
}
