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
    let inside = value.find('[').and_then(|a| Some(&value[a + 1..a + value[a..].find(']')?]));
    let inner = inside.unwrap_or_else(|| value.split('(').next().unwrap_or(value));
    if matches!(inner.trim().to_lowercase().as_str(), "none" | "n/a" | "na" | "null" | "nothing") {
        return Names { names: Vec::new(), certain: true };
    }
    let quoted = |word: &str| ['"', '\'', '`'].iter().any(|q| inner.contains(&format!("{q}{word}{q}")));
    let words = || inner.split(|c: char| !(c.is_alphanumeric() || c == '_'));
    let any_quoted = words().any(|w| !w.is_empty() && quoted(w));
    let mut out: Vec<String> = Vec::new();
    for word in words() {
        let starts = word.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let counts = quoted(word) || inside.is_some() || !any_quoted && word != "and";
        if starts && counts && !out.iter().any(|o| o == word) {
            out.push(word.to_owned());
        }
    }
    let parts = inner.split([',', ';']).flat_map(|p| p.split(" and "));
    let one_word_each = parts.clone().all(|p| p.split_whitespace().count() <= 1);
    Names { names: out, certain: inside.is_some() || any_quoted || one_word_each }
}

/// Places in a value: `{"ball": (0, 0, 0)}`, `ball = [0, h/2, 0]`, `ball at (0, 0, 0)`, or bare ones for the
/// outputs in order. Each coordinate is a formula.
pub fn locations(value: &str, outputs: &[String]) -> BTreeMap<String, [String; 3]> {
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
                let parts = split_outside_brackets(&value[start + 1..at]);
                let Ok(point) = <[&str; 3]>::try_from(parts) else { continue };
                if !point.iter().all(|p| is_formula(p)) {
                    continue;
                }
                let point = point.map(|p| p.trim().to_owned());
                match last_name(&value[before.min(start)..start]) {
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

/// Whether a text may be the formula of one number: no dict, no string, not empty.
fn is_formula(text: &str) -> bool {
    !text.trim().is_empty() && !text.contains([':', '"', '\'', '{', '['])
}

/// The name that ends a text such as `{"ball": `, `ball at` or `np.array` behind `ball = `.
fn last_name(before: &str) -> Option<String> {
    let mut before = before.trim_end().trim_end_matches('(').trim_end();
    before = before.strip_suffix("np.array").unwrap_or(before).trim_end();
    before = before.trim_end_matches([':', '=', '→', '-', '>', ' ']);
    for word in [" at", " is", " center", " centre", " centered"] {
        before = before.strip_suffix(word).unwrap_or(before).trim_end();
    }
    let before = before.trim_end_matches(['"', '\'', '`', '*', ' ']);
    let start = before
        .rfind(|c: char| !(c.is_alphanumeric() || c == '_'))
        .map_or(0, |at| at + before[at..].chars().next().map_or(1, char::len_utf8));
    let name = &before[start..];
    let word = name.starts_with(|c: char| c.is_alphabetic() || c == '_');
    (word && !matches!(name, "at" | "is" | "and")).then(|| name.to_owned())
}

/// Volumes in a value, as written: `{"ball": 4.19}`, `ball = 4/3*pi`, or a bare number for one output.
pub fn volumes(value: &str, outputs: &[String]) -> BTreeMap<String, String> {
    let whole = value.trim().trim_end_matches(['.', ' ', ',']);
    let listed = whole.strip_prefix('[').and_then(|v| v.strip_suffix(']'));
    let inner = listed.unwrap_or(whole).trim_start_matches('{').trim_end_matches(['}', ' ', ',']);
    let mut out = BTreeMap::new();
    for part in split_outside_brackets(inner) {
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
        let text = text.trim().trim_matches('`');
        let name = name.or_else(|| if out.is_empty() { outputs.first().cloned() } else { None });
        if let (Some(name), true) = (name, text.contains(|c: char| c.is_alphanumeric())) {
            out.insert(name, text.to_owned());
        }
    }
    out
}

/// The number that a stated value is: behind its last `=`, without units and remarks, worked out by `formula`
/// if it is one.
pub fn number(text: &str, mut formula: impl FnMut(&str) -> Option<f64>) -> Option<f64> {
    let last =
        text.rsplit(['=', '≈']).find(|part| part.contains(char::is_alphanumeric)).unwrap_or(text).trim();
    let last = ["approximately ", "approx. ", "approx ", "about ", "~"]
        .iter()
        .find_map(|word| last.strip_prefix(word))
        .unwrap_or(last)
        .trim_end_matches(['.', '*', '`', ' ']);
    let plain =
        last.replace(['−', '–'], "-").replace(['·', '×', '∙'], "*").replace('π', "pi").replace('^', "**");
    let digits = plain
        .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | '-' | '+')))
        .unwrap_or(plain.len());
    let rest = plain[digits..].trim_start();
    let unit = rest.is_empty() || rest.starts_with(char::is_alphabetic) && !rest.starts_with("pi");
    // A remark in parentheses may follow a plain number.
    let remark = rest.starts_with('(') && rest.contains(char::is_alphabetic) && !rest.contains("pi");
    let direct = (unit || remark).then(|| plain[..digits].trim().parse().ok()).flatten();
    let value = direct.or_else(|| formula(&plain)).or_else(|| formula(&with_products(&plain)));
    value.filter(|v: &f64| v.is_finite())
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
        ] {
            assert_eq!(locations(text, &["ball".into()])["ball"], ["0", "-0.5", "h/2"], "{text}");
        }
        let two = locations("{'a': (1, (2), 3), 'b': (4, 5, 6)}", &[]);
        assert_eq!((&two["a"][1], &two["b"][0]), (&"(2)".to_owned(), &"4".to_owned()));
        let in_words = locations("a at (1, 2, 3) and b at (4, 5, 6)", &[]);
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
        ] {
            assert_eq!(number(text, formula), wanted, "{text}");
        }
    }
}
