//! What stands behind a field's key: names of variables, places, volumes.
//!
//! Raw values come in; names, and formulas by name, go out. Formulas are worked out by whoever has the code's
//! variables at hand. Imports nothing.

use std::collections::BTreeMap;

/// Variable names in a value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Names {
    /// The names in order, each once.
    pub names: Vec<String>,
    /// Whether brackets, quotes or commas say that these words are names; otherwise they may be a sentence.
    pub certain: bool,
}

/// Variable names in a value such as `["ball", "disc"]` or `ball and disc`.
pub fn names(value: &str) -> Names {
    // Behind a closing bracket stand comments.
    let between =
        |open, close| value.find(open).and_then(|a| Some(&value[a + 1..a + value[a..].find(close)?]));
    let whole = |open: char, close| value.starts_with(open).then(|| between(open, close)).flatten();
    let inside = between('[', ']').or_else(|| whole('(', ')')).or_else(|| whole('{', '}'));
    let inner = inside.unwrap_or_else(|| value.split('(').next().unwrap_or(value));
    if matches!(inner.trim().to_lowercase().as_str(), "none" | "n/a" | "na" | "null" | "nothing") {
        return Names { names: Vec::new(), certain: true };
    }
    // Between brackets each name may have a description: `["ball" (as given), disc: the flat ball]`.
    let parts: Vec<&str> = match inside {
        Some(inner) => split_outside_brackets(inner).into_iter().map(without_description).collect(),
        None => vec![inner],
    };
    let mut found = Names { names: Vec::new(), certain: inside.is_some() };
    for part in &parts {
        let words = words_in(part);
        let any_quoted = words.iter().any(|(_, quoted)| *quoted);
        found.certain |= any_quoted;
        for (word, quoted) in words {
            let starts = word.starts_with(|c: char| c.is_alphabetic() || c == '_');
            if starts && (quoted || !any_quoted && word != "and") && !found.names.iter().any(|n| n == word) {
                found.names.push(word.to_owned());
            }
        }
    }
    let mut single = inner.split([',', ';']).flat_map(|p| p.split(" and "));
    found.certain |= single.all(|p| p.split_whitespace().count() <= 1);
    found
}

/// An item of a list of names without the description behind it.
fn without_description(part: &str) -> &str {
    part.trim_start_matches([' ', '(']).split(['(', ':', '=']).next().unwrap_or(part)
}

/// The words of a text, and whether each stands between quotes.
fn words_in(text: &str) -> Vec<(&str, bool)> {
    let is_quote = |c: Option<char>| c.is_some_and(|c| matches!(c, '"' | '\'' | '`'));
    let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|w| !w.is_empty());
    let at = |word: &str| word.as_ptr() as usize - text.as_ptr() as usize;
    let quoted = |word: &str| {
        let (start, end) = (at(word), at(word) + word.len());
        is_quote(text[..start].chars().next_back()) && is_quote(text[end..].chars().next())
    };
    words.map(|word| (word, quoted(word))).collect()
}

/// A place is no longer than this as it is written, so that brackets without end cost no time.
const PLACE_BYTES: usize = 1000;

/// Places in a value: `{"ball": (0, 0, 0)}`, `ball = [0, h/2, 0]`, `ball at (0, 0, 0)`, or bare ones for the
/// outputs in order. Each coordinate is a formula. Of several names before a place that of an output or input counts.
pub fn locations(value: &str, outputs: &[String], inputs: &[String]) -> BTreeMap<String, [String; 3]> {
    let mut named = BTreeMap::new();
    let mut bare = Vec::new();
    // Where the text begins that belongs to the next place.
    let mut before = 0;
    let mut open: Vec<usize> = Vec::new();
    for (at, c) in value.char_indices() {
        match c {
            '(' | '[' | '{' => open.push(at),
            ')' | ']' | '}' => {
                let Some(start) = open.pop() else { continue };
                if at - start > PLACE_BYTES {
                    continue;
                }
                let lead = &value[before.min(start)..start];
                let Some(point) = place(lead, &value[start + 1..at]) else { continue };
                let known = |word: &&(&str, bool)| outputs.iter().chain(inputs).any(|n| n == word.0);
                let piece = words_in(lead).iter().rfind(known).map(|(word, _)| (*word).to_owned());
                match piece.or_else(|| last_name(lead)) {
                    Some(name) => drop(named.insert(name, point)),
                    None => bare.push(point),
                }
                before = at + 1;
            }
            _ => {}
        }
    }
    if named.is_empty() {
        named.extend(outputs.iter().cloned().zip(bare));
    }
    named
}

/// The place between two brackets: `0, h/2, 0`, `x=0, y=0, z=0`, `"x": 0, "y": 0, "z": 0`, `0 0 0` as numpy prints it,
/// or the 3 of `np.zeros(3)`, which `lead` ends.
fn place(lead: &str, inner: &str) -> Option<[String; 3]> {
    let parts = split_outside_brackets(inner);
    if let [one] = parts[..] {
        if lead.ends_with("zeros") && one.trim() == "3" {
            return Some(["0", "0", "0"].map(str::to_owned));
        }
        let numbers = <[&str; 3]>::try_from(one.split_whitespace().collect::<Vec<_>>()).ok()?;
        return numbers.iter().all(|n| n.parse::<f64>().is_ok()).then(|| numbers.map(str::to_owned));
    }
    let parts = <[&str; 3]>::try_from(parts).ok()?;
    let axes = parts.map(|part| match part.split_once([':', '=']) {
        Some((axis, value)) if matches!(axis.trim().trim_matches(['"', '\'']), "x" | "y" | "z") => value,
        _ => part,
    });
    axes.iter().all(|p| is_formula(p)).then(|| axes.map(|p| p.trim().to_owned()))
}

/// Whether a text may be the formula of one number: no dict, no string, not empty.
fn is_formula(text: &str) -> bool {
    !text.trim().is_empty() && !text.contains([':', '"', '\'', '{', '['])
}

/// The name that ends a text such as `{"ball": `, `ball at` or `np.array` behind `ball = `.
fn last_name(before: &str) -> Option<String> {
    let marks = [':', '=', '→', '-', '>', ' ', '(', ')', '"', '\'', '`', '*', '$'];
    let mut before = before.trim_end_matches(marks);
    for word in ["np.array", "np.zeros", " at", " is", " center", " centre", " centered"] {
        before = before.strip_suffix(word).unwrap_or(before).trim_end_matches(marks);
    }
    let start = before
        .rfind(|c: char| !(c.is_alphanumeric() || c == '_'))
        .map_or(0, |at| at + before[at..].chars().next().map_or(1, char::len_utf8));
    let name = &before[start..];
    let word = name.starts_with(|c: char| c.is_alphabetic() || c == '_');
    (word && !matches!(name, "at" | "is" | "and")).then(|| name.to_owned())
}

/// Volumes in a value, as written: `{"ball": 4.19}`, `ball = 4/3*pi`, or a bare number for one output.
pub fn volumes(value: &str, outputs: &[String]) -> BTreeMap<String, String> {
    let whole = value.trim_matches(['.', ' ', ',', '`', '$']);
    let listed = whole.strip_prefix('[').and_then(|v| v.strip_suffix(']')).unwrap_or(whole);
    // Around the dicts stand remarks; other braces are those of LaTeX.
    let mut inner = dicts(whole);
    if !inner.iter().any(|dict| dict.contains([':', '='])) {
        inner = vec![listed.trim_start_matches('{').trim_end_matches(['}', ' ', ','])];
    }
    let mut out = BTreeMap::new();
    for part in inner.into_iter().flat_map(split_outside_brackets) {
        let (name, text) = match part.split_once([':', '=', '≈', '→']) {
            Some((name, text)) if last_name(name).is_some() => (last_name(name), text),
            // "ball 4.19"
            _ => match part.trim().split_once(' ') {
                Some((name, number)) if last_name(name).is_some() && number.trim().parse::<f64>().is_ok() => {
                    (last_name(name), number)
                }
                _ => (None, part),
            },
        };
        let text = text.trim_matches(['`', '"', '\'', '$', ' ']);
        let name = name.or_else(|| if out.is_empty() { outputs.first().cloned() } else { None });
        if let (Some(name), true) = (name, text.contains(|c: char| c.is_alphanumeric())) {
            out.insert(name, text.to_owned());
        }
    }
    out
}

/// What is inside the outermost braces of a text, or inside `dict(..)`; up to its end where they stay open.
fn dicts(text: &str) -> Vec<&str> {
    let (mut depth, mut out) = (0isize, Vec::new());
    // Depth and place at which the dict begins that is open.
    let mut open: Option<(isize, usize)> = None;
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' | '{' => {
                if open.is_none() && (c == '{' || c == '(' && text[..at].ends_with("dict")) {
                    open = Some((depth, at + 1));
                }
                depth += 1;
            }
            ')' | ']' | '}' => {
                depth -= 1;
                if let Some((outside, start)) = open
                    && depth <= outside
                {
                    out.push(&text[start..at]);
                    open = None;
                }
            }
            _ => {}
        }
    }
    out.extend(open.map(|(_, start)| &text[start..]));
    out
}

/// The number that a stated value is: behind its last `=`, without units and remarks, worked out by `formula`
/// if it is one.
pub fn number(text: &str, mut formula: impl FnMut(&str) -> Option<f64>) -> Option<f64> {
    let last = last_side(text).trim();
    let last = ["approximately ", "approx. ", "approx ", "about ", "~"]
        .iter()
        .find_map(|word| last.strip_prefix(word))
        .unwrap_or(last)
        .trim_end_matches(['.', '…', '*', '`', ' ']);
    let plain =
        last.replace(['−', '–'], "-").replace(['·', '×', '∙'], "*").replace('π', "pi").replace('^', "**");
    let digits = plain
        .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | '-' | '+')))
        .unwrap_or(plain.len());
    let rest = plain[digits..].trim_start();
    let unit = rest.is_empty() || rest.starts_with(char::is_alphabetic) && !rest.starts_with("pi");
    // A remark in parentheses may follow a plain number, or another way to write it.
    let words = rest.contains(char::is_alphabetic) && !rest.contains("pi");
    let remark = rest.starts_with('(') && (words || rest.contains(['=', '≈']));
    let plainly = || plain[..digits].trim().parse().ok();
    let direct = if unit || remark { plainly() } else { None };
    let value = direct.or_else(|| formula(&plain)).or_else(|| formula(&with_products(&plain)));
    // What is no formula behind a dash is a remark too.
    let value = value.or_else(|| if rest.starts_with(['-', '—']) { plainly() } else { None });
    value.filter(|v: &f64| v.is_finite())
}

/// The last side of an equation that says something: `4.19` of `V = 4.19 (= 4/3 pi)`.
fn last_side(text: &str) -> &str {
    let (mut depth, mut start, mut side) = (0isize, 0, None);
    let says = |part: &str| part.contains(char::is_alphanumeric);
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            '=' | '≈' if depth <= 0 => {
                side = Some(&text[start..at]).filter(|part| says(part)).or(side);
                start = at + c.len_utf8();
            }
            _ => {}
        }
    }
    Some(&text[start..]).filter(|part| says(part)).or(side).unwrap_or(text)
}

/// Writes the products that people leave out: `4/3 pi (2 r)` becomes `4/3 *pi *(2 *r)`.
fn with_products(text: &str) -> String {
    let mut out = String::new();
    // The last sign that is no blank, and whether it ends a number or bracket.
    let (mut ended, mut word) = (false, false);
    for c in text.chars() {
        let starts = !word && (c.is_alphanumeric() || c == '(');
        if starts && ended
            || word && ended && c.is_alphabetic() && out.ends_with(|d: char| d.is_ascii_digit())
        {
            out.push('*');
        }
        out.push(c);
        if c.is_whitespace() {
            word = false;
            continue;
        }
        word = c.is_alphanumeric() || matches!(c, '.' | '_');
        ended = word || c == ')';
    }
    out
}

fn split_outside_brackets(text: &str) -> Vec<&str> {
    let (mut depth, mut start, mut out) = (0isize, 0, Vec::new());
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            ',' | ';' if depth == 0 => {
                out.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    if !text[start..].trim().is_empty() {
        out.push(&text[start..]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_many_spellings() {
        for (value, wanted, certain) in [
            ("[\"ball\", rest]", &["ball", "rest"][..], true),
            ("`half_left` and `half_right`", &["half_left", "half_right"], true),
            ("left, right", &["left", "right"], true),
            ("[disc] (a cylinder)", &["disc"], true),
            ("[\"ball\" (as given), disc: the flat ball]", &["ball", "disc"], true),
            ("(\"disc\",)", &["disc"], true),
            ("{\"disc\"}", &["disc"], true),
            ("disc (a cylinder)", &["disc"], true),
            ("the cloud `disc` from step 1", &["disc"], true),
            ("the ball of step 0", &["the", "ball", "of", "step"], false),
            ("None", &[], true),
            ("[]", &[], true),
        ] {
            assert_eq!(
                names(value),
                Names { names: wanted.iter().map(ToString::to_string).collect(), certain }
            );
        }
    }

    #[test]
    fn locations_in_many_spellings() {
        for text in [
            "{\"ball\": (0, -0.5, h/2)}",
            "ball: [0, -0.5, h/2]",
            "`ball` = np.array([0, -0.5, h/2])",
            "(0, -0.5, h/2)",
            "ball at (0, -0.5, h/2)",
            "the ball is at (0, -0.5, h/2).",
            "**ball** → (0, -0.5, h/2)",
            "[(0, -0.5, h/2)]",
            "{\"ball\": \"(0, -0.5, h/2)\"}",
            "{(\"ball\"): (0, -0.5, h/2)}",
            "{\"ball\": {\"x\": 0, \"y\": -0.5, \"z\": h/2}}",
            "ball: centre of the floor (0, -0.5, h/2)",
        ] {
            let found = locations(text, &["ball".into()], &[]);
            let [(name, place)] = &found.iter().collect::<Vec<_>>()[..] else { panic!("{text}: {found:?}") };
            assert_eq!((name.as_str(), *place), ("ball", &["0", "-0.5", "h/2"].map(String::from)), "{text}");
        }
        for text in ["{\"ball\": np.zeros(3)}", "ball: [0 0 0]"] {
            assert_eq!(locations(text, &[], &[])["ball"], ["0", "0", "0"], "{text}");
        }
        let two = locations("{'a': (1, (2), 3), 'b': (4, 5, 6)}", &[], &[]);
        assert_eq!((&two["a"][1], &two["b"][0]), (&"(2)".to_owned(), &"4".to_owned()));
        let in_words = locations("a at (1, 2, 3) and b at (4, 5, 6)", &[], &[]);
        assert_eq!(in_words.keys().collect::<Vec<_>>(), ["a", "b"]);
    }

    #[test]
    fn volumes_in_many_spellings() {
        let volumes_of = |text: &str| volumes(text, &["disc".into()]);
        assert_eq!(volumes_of("{\"ball\": 4.19, \"disc\": 4/3*pi}")["disc"], "4/3*pi");
        assert_eq!(volumes_of("4.18879")["disc"], "4.18879");
        assert_eq!(volumes_of("ball: round(4.2, 1), disc: 2 cubic units")["ball"], "round(4.2, 1)");
        assert_eq!(volumes_of("disc ≈ 4.19")["disc"], "4.19");
        assert_eq!(volumes_of("[4.19]")["disc"], "4.19");
        assert_eq!(volumes_of("[disc: 4.19].")["disc"], "4.19");
        assert_eq!(volumes_of("`disc`: `4/3 * pi`")["disc"], "4/3 * pi");
        assert_eq!(volumes_of("{\"disc\": V}")["disc"], "V");
        for text in [
            "`{\"ball\": 4.2, \"disc\": 2.0}`",
            "```{\"ball\": 4.2, \"disc\": 2.0}```",
            "{\"ball\": 4.2, \"disc\": 2.0} (conserved)",
            "{\"ball\": 4.2, \"disc\": 2.0} — conserved: nothing is lost",
            "{\"ball\": \"4.2\", \"disc\": \"2.0\"}",
            "{\"ball\": 4.2}, {\"disc\": 2.0}",
            "in {\"ball\": 4.2}, out {\"disc\": 2.0}",
            "{\"ball\": 4.2} -> {\"disc\": 2.0}",
            "dict(ball=4.2, disc=2.0)",
            "${ball: 4.2, disc: 2.0}$",
            "{\"ball\": 4.2, \"disc\": 2.0",
        ] {
            let found = volumes_of(text);
            let pairs: Vec<_> = found.iter().map(|(n, v)| (n.as_str(), v.as_str())).collect();
            assert_eq!(pairs, [("ball", "4.2"), ("disc", "2.0")], "{text}");
        }
    }

    #[test]
    fn volumes_become_numbers() {
        let formula = |text: &str| match text.replace(' ', "").as_str() {
            "4/3*pi" | "4*pi/3" | "(4/3)*pi" | "4/3*pi*(1)**3" => Some(4.0),
            "V" => Some(5.0),
            _ => None,
        };
        for (text, wanted) in [
            ("4.19", Some(4.19)),
            ("2 cubic units", Some(2.0)),
            ("a * b = 0.08", Some(0.08)),
            ("4/3 · π", Some(4.0)),
            ("4π/3", Some(4.0)),
            ("(4/3)π", Some(4.0)),
            ("4/3 π (1)^3", Some(4.0)),
            ("about 4.19 (unchanged)", Some(4.19)),
            ("~4.19.", Some(4.19)),
            ("4.19 =", Some(4.19)),
            ("V", Some(5.0)),
            ("as before", None),
            ("1e-3", Some(1e-3)),
            ("4.19 (= 4/3 · π)", Some(4.19)),
            ("V = 4.19 (≈ 4/3 π)", Some(4.19)),
            ("4.19…", Some(4.19)),
            ("4.19 — as before", Some(4.19)),
        ] {
            assert_eq!(number(text, formula), wanted, "{text}");
        }
    }
}
