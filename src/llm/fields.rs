//! The fields of a step: `tool name:`, `in var name:`, `out var name:`, `loc:`, `vol:`.
//!
//! Lines of prose come in; fields with their raw values go out (`values` reads those). Keys are recognised at the
//! start of a line, behind a comma, in a row of a table or as a heading, in many spellings. Imports `keys`.

use super::keys::{DASHES, Field, is_key, keys_in};

/// A field as it stands in the text.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Line of the key.
    pub line: usize,
    /// What it states.
    pub field: Field,
    /// Whether the key is one that nobody writes by chance, such as `tool name`; "Output: a flat cylinder" may be a
    /// line of a derivation.
    pub sure: bool,
    /// What stands behind the key.
    pub value: String,
}

/// The line without bullets, numbers, heading marks and emphasis at its start, backslashes before plain signs, and
/// breaks at its end.
pub fn without_markup(line: &str) -> String {
    let mut rest = line.trim().trim_end_matches("<br>");
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
            return without_escapes(rest);
        }
    }
}

/// The text without the backslashes of markdown: `disc\_cloud`, `\["disc"\]`.
fn without_escapes(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut signs = text.chars().peekable();
    while let Some(c) = signs.next() {
        if c != '\\' || !signs.peek().is_some_and(|next| "_[](){}*#`".contains(*next)) {
            out.push(c);
        }
    }
    out
}

/// The line without markup; a heading that is nothing but a key, such as `#### Tool name`, gets a colon.
fn keyed(line: &str) -> String {
    let mut text = without_markup(line);
    if ["#", "**", "__"].iter().any(|mark| line.trim_start().starts_with(mark)) {
        let word = text.trim_end_matches(['*', '_', '#', ' ']);
        if is_key(word) {
            text = format!("{word}:");
        }
    }
    text
}

/// All fields in lines of prose. A value goes on over the next lines while its brackets are open; behind a key with
/// nothing behind it stands what is below: a list, or a line.
pub fn read(lines: &[(usize, String)]) -> Vec<Found> {
    let mut out = Vec::new();
    let mut at = 0;
    while at < lines.len() {
        let (line, written) = &lines[at];
        let mut text = keyed(written);
        at += 1;
        let Some(last) = keys_in(&text).pop() else { continue };
        if bare(&text[last.value..]).is_empty() {
            at = add_value_below(&mut text, last.field, lines, at);
        }
        let mut depth = open_brackets(&text);
        while depth > 0 && follows(lines, at) && !lines[at].1.trim().is_empty() {
            let more = without_markup(&lines[at].1);
            depth += open_brackets(&more);
            text.push(' ');
            text.push_str(&more);
            at += 1;
        }
        let keys = keys_in(&text);
        for (i, key) in keys.iter().enumerate() {
            let end = keys.get(i + 1).map_or(text.len(), |next| next.start);
            let value = bare(&text[key.value..end]).to_owned();
            out.push(Found { line: *line, field: key.field, sure: key.sure, value });
        }
    }
    out
}

/// Whether there is a line that stands right behind the one before it, without code in between.
fn follows(lines: &[(usize, String)], at: usize) -> bool {
    lines.get(at).is_some_and(|line| line.0 == lines[at - 1].0 + 1)
}

/// Adds to a key the value that stands below it; `at` is the next line. Returns the line behind the value.
fn add_value_below(text: &mut String, field: Field, lines: &[(usize, String)], at: usize) -> usize {
    let key = &lines[at - 1].1;
    let mut next = at;
    while follows(lines, next) && lines[next].1.trim().is_empty() {
        next += 1;
    }
    let (mut items, mut first) = (0, true);
    while follows(lines, next) {
        let line = &lines[next].1;
        let item = is_item_below(key, line);
        let pair = matches!(field, Field::Locations | Field::Volumes) && is_pair(line);
        if !(item || pair || first && is_value(field, line)) {
            break;
        }
        text.push_str(if first { " " } else { " , " });
        let value = without_markup(line);
        // What is still open ends with a comma that counts.
        text.push_str(if open_brackets(&value) > 0 { &value } else { bare(&value) });
        (items, first) = (items + 1, false);
        next += 1;
        if !(item || pair) {
            break;
        }
    }
    if items == 0 { at } else { next }
}

/// A value without what surrounds it.
fn bare(value: &str) -> &str {
    value
        .trim()
        .trim_end_matches("->")
        .trim_end_matches([',', ';', '|', '/', ' ', '*', '_', '→'])
        .trim_start_matches(['*', ',', ' '])
}

/// Whether a line is an item of a list under `key`: a bullet that is no field, and stands further right or below a
/// key that is no bullet itself.
fn is_item_below(key: &str, line: &str) -> bool {
    let indent = |l: &str| l.len() - l.trim_start().len();
    let bullet = |l: &str| {
        let body = l.trim_start();
        let mark = body.starts_with(['*', '+', '•', '◦', '▪']) || body.starts_with(DASHES);
        mark && !body.starts_with("**") && !body.starts_with("---")
    };
    let below = indent(line) > indent(key) || indent(line) == indent(key) && !bullet(key);
    bullet(line) && below && !is_field(line)
}

/// Whether a line gives something to one name: `disc: 2.0`.
fn is_pair(line: &str) -> bool {
    let text = without_markup(line);
    let Some((name, value)) = text.split_once([':', '=']) else { return false };
    let name = name.trim().trim_matches(['"', '\'', '`', '*']);
    let one_word = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_');
    one_word && value.contains(|c: char| c.is_ascii_digit()) && !is_field(line)
}

/// Whether a line that stands alone below a key may be its value.
fn is_value(field: Field, line: &str) -> bool {
    let text = without_markup(line);
    let text = text.trim();
    if text.is_empty() || line.trim_start().starts_with(['#', '|']) || is_field(line) {
        return false;
    }
    let opened = text.starts_with(['{', '[', '(', '"', '\'', '`', '$']);
    // "derivation: V = 4.19" begins something else.
    let label = text.split_once(':').is_some_and(|(before, _)| before.split_whitespace().count() <= 4);
    match field {
        Field::Locations | Field::Volumes => opened || text.starts_with(|c: char| c.is_ascii_digit()),
        Field::Tool => !label && !text.contains('='),
        _ => opened || !label,
    }
}

/// What the fields in a line state.
pub fn stated_in(line: &str) -> impl Iterator<Item = Field> {
    keys_in(&keyed(line)).into_iter().map(|key| key.field)
}

/// Whether the line holds a field.
pub fn is_field(line: &str) -> bool {
    stated_in(line).next().is_some()
}

fn open_brackets(text: &str) -> isize {
    text.chars().fold(0, |depth, c| match c {
        '[' | '(' | '{' => depth + 1,
        ']' | ')' | '}' => depth - 1,
        _ => depth,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(line: &str) -> Vec<(Field, String)> {
        read(&[(1, line.to_owned())]).into_iter().map(|f| (f.field, f.value)).collect()
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
            "tool name (one of the four): [Rolling pin]",
            "The tool name is [Rolling pin]",
            "tool\\_name: \\[Rolling pin\\]<br>",
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
        assert_eq!((found[0].line, found[1].line), (5, 8));
        assert_eq!(found[0].value, "{ \"a\": (1, 2, 3), }");
    }

    /// Fields of a text of several lines, but for those without a value.
    fn several(text: &str) -> Vec<(Field, String)> {
        let lines: Vec<(usize, String)> = (1..).zip(text.lines().map(String::from)).collect();
        read(&lines).into_iter().filter(|f| !f.value.is_empty()).map(|f| (f.field, f.value)).collect()
    }

    #[test]
    fn values_may_be_lists_below_their_key() {
        for text in [
            "- **Vol**:\n    - ball: 4.19\n    - disc: 4.18\n- Out var name:\n  * disc\n- not an item",
            "vol:\n- ball: 4.19\n- disc: 4.18\nOut var name:\n\n* disc\n\nNo item.",
            "#### Vol\nball: 4.19\ndisc: 4.18\n#### Out var name\ndisc\n#### Remarks",
        ] {
            let wanted = [(Field::Volumes, "ball: 4.19 , disc: 4.18"), (Field::Outputs, "disc")];
            assert_eq!(several(text), wanted.map(|(f, v)| (f, v.to_owned())), "{text}");
        }
    }

    #[test]
    fn a_value_may_be_the_line_below_its_key() {
        for text in [
            "tool name:\nrolling pin\nderivation:\nV",
            "#### Tool name\n\nrolling pin",
            "**Tool name**\nrolling pin",
            "- Tool:\n  rolling pin",
        ] {
            assert_eq!(several(text), [(Field::Tool, "rolling pin".to_owned())], "{text}");
        }
        assert_eq!(several("vol:\n{\"a\": 1,\n\"b\": 2}"), [(Field::Volumes, "{\"a\": 1, \"b\": 2}".into())]);
        for text in [
            "tool name:\nderivation: V = 4",
            "vol:\nThe volume stays.",
            "tool name:\n### Step 1",
            "loc:\n---",
        ] {
            assert!(several(text).is_empty(), "{text}");
        }
    }
}
