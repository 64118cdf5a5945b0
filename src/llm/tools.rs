//! The tools that an answer may name.
//!
//! Text comes in; canonical names go out. Imports nothing.

/// The tools there are, by canonical name, with other words for them.
const TOOLS: &[(&str, &[&str])] = &[
    ("rolling pin", &["rolling pin", "rollingpin", "rolling pins", "roller", "pin"]),
    ("knife", &["knife", "blade", "cutter", "knives"]),
    ("gripper", &["gripper", "grippers", "clamp"]),
    ("pole", &["pole", "stick", "rod"]),
];

/// Tools named in a text. Remarks in parentheses do not count, unless there is nothing else.
pub fn named_in(text: &str) -> Vec<&'static str> {
    let mut depth = 0;
    let outside: String = text
        .chars()
        .filter(|&c| {
            depth += i32::from(c == '(');
            let outside = depth == 0;
            depth -= i32::from(c == ')' && depth > 0);
            outside
        })
        .collect();
    let found = words_in(&outside);
    if found.is_empty() && !says_none(&outside) { words_in(text) } else { found }
}

/// Whether the text says that there is no tool.
pub fn says_none(text: &str) -> bool {
    let plain = text.to_lowercase();
    let bare = !plain.contains(|c: char| c.is_alphanumeric());
    let whole = plain.split(|c: char| !(c.is_alphanumeric() || c == '/'));
    bare || plain.contains("no tool")
        || whole.into_iter().any(|w| matches!(w, "none" | "n/a" | "na" | "null" | "nothing" | "initial"))
}

fn words_in(text: &str) -> Vec<&'static str> {
    let plain: String =
        text.to_lowercase().chars().map(|c| if c.is_alphanumeric() { c } else { ' ' }).collect();
    let padded = format!(" {} ", plain.split_whitespace().collect::<Vec<_>>().join(" "));
    let names = |words: &[&str]| words.iter().any(|w| padded.contains(&format!(" {w} ")));
    TOOLS.iter().filter(|(_, words)| names(words)).map(|(name, _)| *name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tools_in_many_spellings() {
        for text in
            ["[Rolling pin]", "rolling_pin", "RollingPin", "the rolling-pin (not the knife)", "'Roller'"]
        {
            assert_eq!(named_in(text), ["rolling pin"], "{text}");
        }
        assert_eq!(named_in("capsule (pole)"), ["pole"]);
        assert_eq!(named_in("[knife, gripper]"), ["knife", "gripper"]);
        assert!(
            named_in("none (the knife comes later)").is_empty() && says_none("none (the knife comes later)")
        );
        assert!(says_none("-") && says_none("N/A") && !says_none("whisk"));
    }
}
