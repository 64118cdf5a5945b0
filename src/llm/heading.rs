//! Headings: which lines begin a step, and which end the steps.
//!
//! A line comes in; number, title and how surely it is a heading go out. Imports `fields`.

use std::borrow::Cow;

use super::fields;
use super::keys::DASHES;

/// The heading of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Heading {
    /// The step's number.
    pub step: u32,
    /// The rest of the line.
    pub title: String,
    /// How it is marked: 8 by `#` to 3 by `######`, 2 by bold type or brackets around the number, 1 by nothing.
    pub rank: u8,
}

/// The rank of `### Step N`, the form that the prompt asks for.
pub const ASKED_RANK: u8 = 6;

/// Numbers that are written out.
const WORDS: [&str; 11] =
    ["zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten"];

/// The same in Roman numerals, from one on.
const ROMAN: [&str; 10] = ["i", "ii", "iii", "iv", "v", "vi", "vii", "viii", "ix", "x"];

/// Headings of what comes after the last step, each also with an s.
const ENDINGS: &[&str] = &[
    "summary",
    "conclusion",
    "recap",
    "overview",
    "result",
    "verification",
    "visualization",
    "visualisation",
    "plotting",
    "note",
    "remark",
    "final answer",
    "final result",
    "final summary",
    "final code",
    "final script",
    "complete code",
    "complete script",
    "full code",
    "full script",
    "overall",
    "volume check",
    "volume summary",
    "plan summary",
    "combined code",
];

/// The heading of a step such as `### Step 2: Roll it` or `Step [2]: Roll it`.
pub fn step(line: &str) -> Option<Heading> {
    let line = &*without_tag(line);
    let plain = fields::without_markup(line);
    // Pictures and brackets may stand before the word of a marked heading.
    let plain =
        if rank(line) > 1 { plain.trim_start_matches(|c: char| !c.is_alphanumeric()) } else { &plain };
    let rest = strip_word(plain, "step").or_else(|| strip_word(plain, "stage"))?;
    let opened = rest.trim_start_matches([' ', '#', '*', '_']);
    let opened = if rest.starts_with(DASHES) { &opened[opened.chars().next()?.len_utf8()..] } else { opened };
    let body = opened.trim_start_matches(['[', '(']);
    let (step, after) = numeral(body)?;
    let bracketed = body.len() < opened.len() && after.starts_with([']', ')']);
    let after = without_total(after.trim_start_matches([']', ')', '*', '_', ' ']));
    let title = after.trim_start_matches([':', '.', ')', '|', ' ', '*', '_', '→']).trim_start_matches(DASHES);
    let title = title.trim_start_matches([' ', '*', ':', '_']);
    let rank = rank(line).max(if bracketed { 2 } else { 1 });
    // Without a mark of its own, "Step 2 uses the pin" is a sentence.
    let ends_number =
        after.is_empty() || after.len() > title.len() && !after.starts_with(char::is_alphanumeric);
    (rank > 1 || ends_number || after.starts_with('(')).then(|| Heading { step, title: tidy(title), rank })
}

/// The heading of a step in an answer that never says "step": `## 2. Roll it` or `**2) Roll it**`.
pub fn numbered(line: &str) -> Option<Heading> {
    let body = line.trim_start();
    let marked = body.trim_start_matches(['#', '*', ' ']);
    if marked.len() == body.len() || body.starts_with("* ") {
        return None;
    }
    let digits = marked.chars().take_while(char::is_ascii_digit).count();
    let step = marked[..digits].parse().ok()?;
    let title = marked[digits..].strip_prefix(['.', ')', ':'])?;
    title.starts_with([' ', '*']).then(|| Heading { step, title: tidy(title), rank: rank(line) })
}

/// The heading of a step in an answer that is a plain list: `2. Roll it` or `2) **Roll it**` at the margin.
pub fn listed(line: &str) -> Option<Heading> {
    let digits = line.chars().take_while(char::is_ascii_digit).count();
    let step = line[..digits].parse().ok()?;
    let title = line[digits..].strip_prefix(['.', ')'])?;
    let heads = title.starts_with(' ') && !title.trim().is_empty() && !fields::is_field(line);
    heads.then(|| Heading { step, title: tidy(title), rank: 1 })
}

/// How the line is marked if it may head what follows the steps, such as `## Summary` or `**Note:** ..`. Items of
/// lists and quotes head nothing.
pub fn ending(line: &str) -> Option<u8> {
    if !line.trim_start().starts_with(['#', '*', '_']) || line.trim_start().starts_with("* ") {
        return None;
    }
    let plain = fields::without_markup(line).to_lowercase();
    let whole = |rest: &str| !rest.strip_prefix('s').unwrap_or(rest).starts_with(char::is_alphanumeric);
    let named = ENDINGS.iter().any(|word| plain.strip_prefix(word).is_some_and(whole));
    (named && rank(line) > 1).then(|| rank(line))
}

fn rank(line: &str) -> u8 {
    let body = line.trim_start().trim_start_matches(['-', '>', ' ']);
    let digits = body.chars().take_while(char::is_ascii_digit).count();
    let body = body[digits..].trim_start_matches(['.', ')', ' ']);
    match body.as_bytes() {
        [b'#', ..] => 9 - body.bytes().take(6).take_while(|&b| b == b'#').count() as u8,
        [b'*', b'*', ..] | [b'_', b'_', ..] => 2,
        _ => 1,
    }
}

/// A heading of HTML, `<h3>Roll it</h3>`, as one of markdown; other lines as they are.
fn without_tag(line: &str) -> Cow<'_, str> {
    let body = line.trim();
    let level = body.strip_prefix("<h").and_then(|b| b.chars().next()?.to_digit(7));
    match (level, body.split_once('>')) {
        (Some(level @ 1..), Some((_, rest))) => {
            let title = rest.split("</").next().unwrap_or("");
            Cow::Owned(format!("{} {title}", "#".repeat(level as usize)))
        }
        _ => Cow::Borrowed(line),
    }
}

/// The number at the start of a text, in digits or in words, and the rest.
fn numeral(text: &str) -> Option<(u32, &str)> {
    let digits = text.chars().take_while(char::is_ascii_digit).count();
    if digits > 0 {
        return Some((text[..digits].parse().ok()?, &text[digits..]));
    }
    let words = (0..).zip(WORDS).chain((1..).zip(ROMAN));
    let word = words.into_iter().find_map(|(n, word)| Some((n, strip_word(text, word)?)));
    word.or_else(|| strip_word(text, "n").and_then(|rest| numeral(rest.strip_prefix('=')?)))
}

/// Takes off the "of 3" or "/3" behind a step's number.
fn without_total(after: &str) -> &str {
    let rest = after.strip_prefix('/').or_else(|| strip_word(after, "of")).map(str::trim_start);
    match rest.and_then(numeral) {
        Some((_, rest)) => rest.trim_start_matches([']', ')', '*', '_', ' ']),
        None => after,
    }
}

fn tidy(title: &str) -> String {
    let title = title.trim().trim_end_matches(['*', '#', ' ', '_']).trim_start_matches(['*', ' ']);
    title.strip_prefix('[').and_then(|t| t.strip_suffix(']')).unwrap_or(title).to_owned()
}

/// The rest of `text` behind a word, whatever its case.
fn strip_word<'a>(text: &'a str, word: &str) -> Option<&'a str> {
    let head = text.get(..word.len())?;
    let rest = &text[word.len()..];
    let whole = !rest.starts_with(|c: char| c.is_alphabetic());
    (head.eq_ignore_ascii_case(word) && whole).then_some(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_in_many_spellings() {
        for line in [
            "### Step 2: Roll it",
            "Step [2]: Roll it",
            "**Step 2: Roll it**",
            "**Step 2:** Roll it",
            "**Step 2**: Roll it",
            "2. **Step 2** - Roll it",
            "## STEP 2 — Roll it",
            "* Step (2). Roll it",
            "Step [2]: [Roll it]",
            "#### Step 2 of 3: Roll it",
            "Step 2/3 ‐ Roll it",
            "Step Two: Roll it",
            "### Stage 2) Roll it",
            "__Step 2:__ Roll it",
            "- **Step [2]**: Roll it",
            "Step-2: Roll it",
            "Step_2: Roll it",
            "step2: Roll it",
            "> ### Step 2 | Roll it",
            "### Step 2 Roll it ###",
            "\tStep [N=2]: Roll it",
            "### [Step 2] Roll it",
            "### \u{2705} Step 2: Roll it",
            "### Step II: Roll it",
            "<h3>Step 2: Roll it</h3>",
        ] {
            let found = step(line).map(|h| (h.step, h.title));
            assert_eq!(found, Some((2, "Roll it".to_owned())), "{line}");
        }
        assert_eq!(step("Step 2").unwrap().title, "");
        assert_eq!(step("Step [0] (optional): build the ball").unwrap().title, "(optional): build the ball");
        for line in
            ["Step 2 uses the rolling pin", "the pole of step 2: none", "Steps 2: x", "stepwise", "Step on"]
        {
            assert_eq!(step(line), None, "{line}");
        }
    }

    #[test]
    fn numbers_may_head_steps_if_they_are_marked() {
        for line in ["## 2. Roll it", "**2. Roll it**", "### 2) **Roll it**"] {
            assert_eq!(numbered(line).unwrap().title, "Roll it", "{line}");
        }
        for line in ["2. Roll it", "* 2. Roll it", "## Roll 2. it", "**2.5 units**"] {
            assert_eq!(numbered(line), None, "{line}");
        }
    }

    #[test]
    fn items_of_a_list_may_head_steps_if_they_are_no_fields() {
        assert_eq!(listed("2. **Roll it**").unwrap().title, "Roll it");
        for line in ["2. **Tool name:** pole", " 2. Roll it", "2.5 units", "2. ", "Roll"] {
            assert_eq!(listed(line), None, "{line}");
        }
    }

    #[test]
    fn a_summary_may_end_the_steps() {
        for (line, rank) in [
            ("## Summary of the plan", 7),
            ("**Final result:**", 2),
            ("__Notes__", 2),
            ("#### Volume check", 5),
        ] {
            assert_eq!(ending(line), Some(rank), "{line}");
        }
        for line in [
            "Summary",
            "### Noteworthy",
            "#### Code",
            "**Final height:** 0.5",
            "- **Note:** y is up",
            "* **Verification:** V = 2",
            "1. **Overall:** 2",
            "> **Note:** y is up",
        ] {
            assert_eq!(ending(line), None, "{line}");
        }
    }
}
