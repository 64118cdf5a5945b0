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

/// What stands between the tool and the reason for it.
const REASONS: &[&str] = &[" because ", " since ", " instead of ", " rather than ", " not "];

/// Tools named in a text. The first clause with a tool counts, and behind it those that are nothing but a tool's name:
/// the rest are reasons. Remarks in parentheses do not count, unless there is nothing else.
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
    let mut found: Vec<&str> = Vec::new();
    for clause in clauses(&outside) {
        let named = mentioned_in(&clause);
        if found.is_empty() && named.is_empty() && says_none(&clause) {
            return Vec::new();
        }
        if found.is_empty() || is_only_a_name(&clause) {
            found.extend(named);
        }
    }
    found.dedup();
    if found.is_empty() { mentioned_in(text) } else { found }
}

/// The clauses of a text, between commas and dashes, up to the reason for the tool.
fn clauses(text: &str) -> Vec<String> {
    let plain = text.to_lowercase().replace(['—', '–', ':', '.'], ",").replace(" - ", ",");
    let starts = REASONS.iter().filter_map(|reason| plain.find(reason));
    let reason = starts.filter(|&at| !mentioned_in(&plain[..at]).is_empty()).min();
    let told = &plain[..reason.unwrap_or(plain.len())];
    told.split([',', ';']).map(str::to_owned).collect()
}

/// Whether a clause is the name of a tool and nothing more.
fn is_only_a_name(clause: &str) -> bool {
    let words = || clause.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
    let known =
        |word: &str| TOOLS.iter().any(|(_, all)| all.iter().any(|a| a.split(' ').any(|part| part == word)));
    words().all(|word| known(word) || matches!(word, "the" | "a" | "and" | "or" | "then"))
}

/// Whether the text says that there is no tool.
pub fn says_none(text: &str) -> bool {
    let plain = text.to_lowercase();
    let bare = !plain.trim().is_empty() && !plain.contains(|c: char| c.is_alphanumeric());
    let whole = plain.split(|c: char| !(c.is_alphanumeric() || c == '/'));
    bare || plain.contains("no tool")
        || whole.into_iter().any(|w| matches!(w, "none" | "n/a" | "na" | "null" | "nothing" | "initial"))
}

/// All tools that a text mentions.
pub fn mentioned_in(text: &str) -> Vec<&'static str> {
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
        for text in [
            "rolling pin - used because the pole cannot flatten",
            "rolling pin, because the knife and gripper cannot press along y",
            "rolling pin; the knife comes later",
            "the rolling pin instead of the pole",
        ] {
            assert_eq!(named_in(text), ["rolling pin"], "{text}");
        }
        assert_eq!(named_in("capsule (pole)"), ["pole"]);
        assert_eq!(named_in("[knife, gripper]"), ["knife", "gripper"]);
        assert!(
            named_in("none (the knife comes later)").is_empty() && says_none("none (the knife comes later)")
        );
        assert!(named_in("none, the knife comes later").is_empty());
        assert!(says_none("-") && says_none("N/A") && !says_none("whisk") && !says_none(""));
    }
}
