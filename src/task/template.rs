//! A task file to begin with: one of those in the binary, under another name.
//!
//! A name and a task in the binary come in; the text of a file that is valid as it stands goes out. Imports this
//! module's sources.

use super::error::TaskError;
use super::source::{TaskSource, built_in_names};

/// The most characters a name may have: it becomes part of file names.
const LONGEST: usize = 60;

/// The file of the task `from` in the binary, made into one for a task called `name`.
///
/// # Errors
/// [`TaskError::Name`] if `name` is not made of small letters, digits and hyphens, or is a task in the binary;
/// [`TaskError::Unknown`] if `from` is none.
pub fn new_task(name: &str, from: &str) -> Result<String, TaskError> {
    check(name)?;
    if !built_in_names().contains(&from) {
        return Err(TaskError::unknown(from, &built_in_names()));
    }
    let text = TaskSource::find(from)?.text;
    let words = name.replace('-', " ");
    let explained =
        if from == "donut" { "" } else { "\n# Every key is explained by `donut tasks --show donut`." };
    let head = format!(
        "# The task `{name}`, made from `{from}`. Lengths in m of the unit cube, y up. Unknown keys are refused.{explained}\n#\n\
         #     donut check --task {name}.toml       is it valid, and what follows from it\n\
         #     donut plan --task {name}.toml        with --llm PROVIDER:MODEL or --response ANSWER.md if it has [target.stages]\n"
    );
    let mut lines = Vec::new();
    for line in text.lines().skip_while(|line| line.starts_with('#')) {
        lines.push(match line.split(" = ").next() {
            Some("name") if !lines.iter().any(|l: &String| l.starts_with('[')) => {
                format!("name = \"{name}\"")
            }
            Some("description") => format!("description = \"{}.\"", capitalised(&words)),
            // Whoever edits the line asks a model again, or gives an answer.
            Some("task_line") => format!("{}Make a {words}.\"", up_to_the_goal(line)),
            Some("recorded_answers") => format!("# {line}"),
            _ => line.to_owned(),
        });
    }
    Ok(head + &lines.join("\n") + "\n")
}

fn check(name: &str) -> Result<(), TaskError> {
    let refused = |reason: &'static str| Err(TaskError::Name { name: name.to_owned(), reason });
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if name.is_empty() || name.len() > LONGEST || name.starts_with('-') || !name.chars().all(plain) {
        return refused("take small letters, digits and hyphens, 60 at most, such as thick-bagel");
    }
    if built_in_names().contains(&name) {
        return refused("a task in the program has it; take another");
    }
    Ok(())
}

fn capitalised(words: &str) -> String {
    let mut rest = words.chars();
    rest.next().map_or_else(String::new, |first| first.to_ascii_uppercase().to_string() + rest.as_str())
}

/// The beginning of a task line, up to what is to be made.
fn up_to_the_goal(line: &str) -> &str {
    let end = line.to_lowercase().rfind(". ").map_or(line.len() - 1, |at| at + 2);
    &line[..end]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::Scene;

    fn scene(text: &str) -> Scene {
        let source = TaskSource { label: "new.toml".into(), text: text.into() };
        source.scene().unwrap_or_else(|error| panic!("{error}\n{text}"))
    }

    #[test]
    fn a_file_from_every_task_is_valid_and_has_the_name() {
        for from in built_in_names() {
            let text = new_task("thick-bagel-2", from).unwrap();
            let scene = scene(&text);
            assert_eq!((&scene.name[..], &scene.description[..]), ("thick-bagel-2", "Thick bagel 2."));
            let original = TaskSource::find(from).unwrap().scene().unwrap();
            assert_eq!(scene.tools.len(), original.tools.len());
            assert_eq!(scene.task_line.is_empty(), original.task_line.is_empty());
            assert!(text.lines().any(|line| line == "name = \"thick-bagel-2\""), "{text}");
        }
        let text = new_task("bagel", "donut").unwrap();
        let scene = scene(&text);
        assert_eq!(
            scene.task_line,
            "The dough is initially a round ball at (0, 0, 0) with radius 1. Make a bagel."
        );
        assert!(text.matches('#').count() > 50, "it is commented");
    }

    #[test]
    fn names_that_would_not_do() {
        for name in ["", "Bagel", "my bagel", "../bagel", "-x", "bagel.toml", &"b".repeat(61)] {
            assert!(new_task(name, "donut").unwrap_err().to_string().contains("hyphens"), "{name}");
        }
        assert!(new_task("donut", "donut").unwrap_err().to_string().contains("take another"));
        assert!(new_task("bagel", "bread").unwrap_err().to_string().contains("bread"));
    }
}
