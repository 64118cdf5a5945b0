//! The dough that a sentence describes.
//!
//! Text comes in; a [`GivenDough`] in the model's units goes out, or `None` where the text does not say. Only the
//! sentence about the initial dough is read, so that "make a ball of radius 2" is not. Imports `describe`'s type.

use super::describe::GivenDough;
use super::shapes::Solid;
use crate::math::cloud::Point;

/// A piece of a sentence.
#[derive(Clone, Debug, PartialEq)]
enum Token {
    Word(String),
    Number(f64),
    /// Three numbers in parentheses or brackets.
    Triple(Point),
}

const BALLS: &[&str] = &["ball", "sphere"];
const BOXES: &[&str] =
    &["rectangle", "rectangular", "box", "cuboid", "cube", "bar", "block", "brick", "slab", "loaf"];
const DISCS: &[&str] = &["disc", "disk", "cylinder", "puck"];
/// Words that stand before a place rather than a size.
const PLACES: &[&str] =
    &["at", "around", "near", "position", "location", "center", "centre", "centered", "centred"];

/// The dough that a text states, or what is wrong with its size.
pub fn dough_in_words(text: &str) -> Result<Option<GivenDough>, String> {
    let about_dough = |tokens: &Vec<Token>| is_any(tokens, &["dough", "initially"]);
    let Some(tokens) = sentences(text).iter().map(|s| tokens(s)).find(about_dough) else { return Ok(None) };
    let solid = if is_any(&tokens, BALLS) {
        Solid::Ball { radius: radius(&tokens).unwrap_or(1.0) }
    } else if is_any(&tokens, DISCS) {
        match (radius(&tokens), number_after(&tokens, &["height", "thickness", "high", "thick"])) {
            (Some(radius), Some(height)) => Solid::Disc { radius, height },
            _ => return Ok(None),
        }
    } else if is_any(&tokens, BOXES) {
        let side = number_after(&tokens, &["side", "sides", "edge", "edges"]).map(|s| [s; 3]);
        match size(&tokens).or(side) {
            Some(size) => Solid::Box { size },
            None => return Ok(None),
        }
    } else {
        return Ok(None);
    };
    if solid.size().iter().any(|s| !(1e-3..=1e3).contains(s)) {
        let [x, y, z] = solid.size();
        return Err(format!(
            "gives the dough a size of {x} x {y} x {z} units; write lengths between 0.001 and 1000"
        ));
    }
    Ok(Some(GivenDough { solid, center: center(&tokens).unwrap_or([0.0; 3]) }))
}

/// Splits at full stops that end a sentence: those before a blank, or at the end.
fn sentences(text: &str) -> Vec<&str> {
    text.split_inclusive(". ").flat_map(|s| s.split(['!', '?', ';'])).collect()
}

fn tokens(sentence: &str) -> Vec<Token> {
    let mut tokens = Vec::new();
    let mut rest = sentence;
    while let Some(first) = rest.chars().next() {
        let (token, length) = if matches!(first, '(' | '[') {
            triple(rest).map_or((None, 1), |(triple, length)| (Some(triple), length))
        } else if first.is_ascii_digit() || matches!(first, '-' | '+' | '.') {
            let length = rest.find(|c: char| !c.is_ascii_digit() && !"-+.".contains(c)).unwrap_or(rest.len());
            let number = rest[..length].trim_end_matches(['.', '-']).parse().ok();
            (number.map(Token::Number), length)
        } else if first.is_alphabetic() {
            let length = rest.find(|c: char| !c.is_alphabetic()).unwrap_or(rest.len());
            (Some(Token::Word(rest[..length].to_lowercase())), length)
        } else {
            // A sign of multiplication counts as "x".
            ((first == '×').then(|| Token::Word("x".into())), first.len_utf8())
        };
        tokens.extend(token);
        rest = &rest[length..];
    }
    tokens
}

/// `(1, 0.4, 0.4)` at the beginning of a text, and its length there.
fn triple(text: &str) -> Option<(Token, usize)> {
    let end = text.find([')', ']'])?;
    let numbers: Option<Vec<f64>> = text[1..end].split(',').map(|x| x.trim().parse().ok()).collect();
    Some((Token::Triple(numbers?.try_into().ok()?), end + 1))
}

fn is_any(tokens: &[Token], words: &[&str]) -> bool {
    tokens.iter().any(|t| is_word(t, words))
}

fn is_word(token: &Token, words: &[&str]) -> bool {
    matches!(token, Token::Word(word) if words.contains(&word.as_str()))
}

/// The number behind one of the words, with at most "of" or "is" between: "radius 1", "a side of 2".
fn number_after(tokens: &[Token], words: &[&str]) -> Option<f64> {
    let at = tokens.iter().position(|t| is_word(t, words))?;
    let mut after = tokens[at + 1..].iter().skip_while(|t| is_word(t, &["of", "is", "length"]));
    match after.next()? {
        Token::Number(number) => Some(*number),
        _ => None,
    }
}

fn radius(tokens: &[Token]) -> Option<f64> {
    number_after(tokens, &["radius"]).or_else(|| Some(0.5 * number_after(tokens, &["diameter"])?))
}

/// Three numbers that are no place, or `1 x 0.4 x 0.4`.
fn size(tokens: &[Token]) -> Option<Point> {
    let triples = tokens.iter().enumerate().filter_map(|(at, token)| match token {
        Token::Triple(numbers) if !is_place(tokens, at) => Some(*numbers),
        _ => None,
    });
    let spelled = tokens.windows(5).filter_map(|five| match five {
        [Token::Number(x), first, Token::Number(y), second, Token::Number(z)]
            if is_word(first, &["x", "by"]) && is_word(second, &["x", "by"]) =>
        {
            Some([*x, *y, *z])
        }
        _ => None,
    });
    triples.chain(spelled).next()
}

fn center(tokens: &[Token]) -> Option<Point> {
    tokens.iter().enumerate().find_map(|(at, token)| match token {
        Token::Triple(numbers) if is_place(tokens, at) => Some(*numbers),
        _ => None,
    })
}

/// Whether the word before the token says that it is a place.
fn is_place(tokens: &[Token], at: usize) -> bool {
    at > 0 && is_word(&tokens[at - 1], PLACES)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dough(text: &str) -> Option<(Solid, Point)> {
        dough_in_words(text).unwrap().map(|given| (given.solid, given.center))
    }

    #[test]
    fn dough_in_many_words() {
        let origin = [0.0; 3];
        let ball = |radius| Solid::Ball { radius };
        let bar = Solid::Box { size: [1.0, 0.4, 0.4] };
        for (text, solid, center) in [
            ("The dough is initially a round ball at (0, 0, 0) with radius 1. Make it.", ball(1.0), origin),
            ("The dough is a ball at (-1, 0, 0) with radius 0.6. Carry it.", ball(0.6), [-1.0, 0.0, 0.0]),
            ("Make buns. The dough is a sphere of diameter 3.", ball(1.5), origin),
            ("the dough is a BALL", ball(1.0), origin),
            ("The dough is initially a rectangle at (0, 0, 0) with dimensions (1, 0.4, 0.4).", bar, origin),
            ("The dough is a bar, 1 x 0.4 x 0.4. Make two.", bar, origin),
            ("The dough is a block of 1 by .4 by 0.4, centered at [1, 0, 2].", bar, [1.0, 0.0, 2.0]),
            ("The dough is a cube with a side of 2.", Solid::Box { size: [2.0; 3] }, origin),
            (
                "The dough is a flat cylinder of radius 2 and height 0.5! Make a ball of radius 9.",
                Solid::Disc { radius: 2.0, height: 0.5 },
                origin,
            ),
        ] {
            assert_eq!(dough(text), Some((solid, center)), "{text}");
        }
    }

    #[test]
    fn what_is_not_stated_is_left_open() {
        for text in [
            "Make a ball of radius 2.",
            "The dough is a rectangle. Make a bar of size (1, 2, 3).",
            "The dough is at (0, 0, 0).",
            "The dough is a disc of radius 2.",
            "",
        ] {
            assert_eq!(dough(text), None, "{text}");
        }
    }

    proptest::proptest! {
        #[test]
        fn no_text_is_too_odd(text in "(dough|ball|box|at|radius|[-+.0-9(),\\[\\]x×é ])*") {
            let _ = dough_in_words(&text);
        }
    }

    #[test]
    fn impossible_sizes_are_refused() {
        for text in [
            "The dough is a ball with radius 0.",
            "The dough is a ball with radius -1.",
            "The dough is a bar of size (1, 0, 1).",
        ] {
            assert!(dough_in_words(text).unwrap_err().contains("size of"), "{text}");
        }
    }
}
