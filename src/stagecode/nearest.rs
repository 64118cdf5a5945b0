//! The known name that is nearest to a misspelt one.
//!
//! A word and candidates come in; a candidate within two edits, if any, goes out. Imports nothing.

/// The candidate nearest to `word`, if it is near enough to have been meant.
pub fn nearest<'a>(word: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let allowed = (word.chars().count() / 3).clamp(1, 2);
    candidates
        .filter(|c| c.len().abs_diff(word.len()) <= 2 * allowed && word.len() < 64)
        .map(|c| (edits(word, c), c))
        .filter(|&(d, _)| d <= allowed)
        .min_by_key(|&(d, _)| d)
        .map(|(_, c)| c)
}

/// Number of letters to insert, delete or replace between two words.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &y) in b.iter().enumerate() {
            let replace = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replace.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_was_meant_and_nothing_far_away() {
        let names = ["linspace", "donut", "disc"];
        assert_eq!(nearest("lnspace", names.into_iter()), Some("linspace"));
        assert_eq!(nearest("donuts", names.into_iter()), Some("donut"));
        assert_eq!(nearest("pancake", names.into_iter()), None);
    }
}
