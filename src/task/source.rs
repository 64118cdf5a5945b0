//! Where task files come from: the six in the binary, found by name, or a file of one's own.
//!
//! A `--task` argument comes in; a [`TaskSource`] (text and the name to show in errors) goes out, and from
//! it a checked [`Scene`]. Imports this module's file and scene types.

use std::path::Path;

use toml::de::{DeTable, DeValue};

use super::error::{Complaint, TaskError};
use super::file::TaskFile;
use super::scene::Scene;

/// The task files in the binary: name, text.
const BUILT_IN: &[(&str, &str)] = &[
    ("donut", include_str!("../../tasks/donut.toml")),
    ("baguette", include_str!("../../tasks/baguette.toml")),
    ("two-pancakes", include_str!("../../tasks/two-pancakes.toml")),
    ("spread", include_str!("../../tasks/spread.toml")),
    ("cut", include_str!("../../tasks/cut.toml")),
    ("arrange", include_str!("../../tasks/arrange.toml")),
];

/// The text of a task file and what to call it in an error.
#[derive(Clone, Debug)]
pub struct TaskSource {
    /// The path as the user gave it, or `tasks/NAME.toml` for a task in the binary.
    pub label: String,
    /// The whole file.
    pub text: String,
}

/// Names of the tasks in the binary, in the order of the paper.
pub fn built_in_names() -> Vec<&'static str> {
    BUILT_IN.iter().map(|(name, _)| *name).collect()
}

/// Finds a task by name, or reads the file if `task` looks like a path (it ends in `.toml` or holds a
/// separator), and checks it.
pub fn load_scene(task: &str) -> Result<Scene, TaskError> {
    TaskSource::find(task)?.scene()
}

impl TaskSource {
    /// The text behind a `--task NAME|FILE.toml` argument.
    pub fn find(task: &str) -> Result<Self, TaskError> {
        if let Some((name, text)) = BUILT_IN.iter().find(|(name, _)| *name == task) {
            return Ok(Self { label: format!("tasks/{name}.toml"), text: (*text).to_string() });
        }
        if task.ends_with(".toml") || task.contains(std::path::MAIN_SEPARATOR) {
            let text = std::fs::read_to_string(Path::new(task))
                .map_err(|reason| TaskError::Read { path: task.to_string(), reason })?;
            return Ok(Self { label: task.to_string(), text });
        }
        Err(TaskError::unknown(task, &built_in_names()))
    }

    /// Parses and checks the text. Every error names the file, the line and the key.
    pub fn scene(&self) -> Result<Scene, TaskError> {
        let written: TaskFile = toml::from_str(&self.text).map_err(|e| self.syntax_error(&e))?;
        Scene::check(written).map_err(|complaint| self.value_error(complaint))
    }

    fn syntax_error(&self, error: &toml::de::Error) -> TaskError {
        let start = error.span().map_or(0, |span| span.start);
        let line = line_of(&self.text, start);
        TaskError::Syntax {
            file: self.label.clone(),
            line,
            text: self.text.lines().nth(line - 1).unwrap_or("").trim().to_string(),
            message: error.message().replace('\n', " "),
        }
    }

    fn value_error(&self, complaint: Complaint) -> TaskError {
        let Complaint { key, problem } = complaint;
        let line = line_of(&self.text, offset_of(&self.text, &key));
        TaskError::Value { file: self.label.clone(), line, key, problem }
    }
}

/// Line number (from 1) of a byte offset.
fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|b| *b == b'\n').count()
}

/// Byte offset of the value at a dotted key such as `tools.1.friction`, or of the innermost table around
/// it that is written down.
fn offset_of(text: &str, key: &str) -> usize {
    let Ok(root) = DeTable::parse(text) else { return 0 };
    let mut offset = 0;
    let mut table = Some(root.get_ref());
    let mut array = None;
    for part in key.split('.') {
        let named = table.and_then(|t: &DeTable| t.iter().find(|(k, _)| k.get_ref() == part).map(|(_, v)| v));
        let numbered = part.parse::<usize>().ok().and_then(|i| array.and_then(|a: &[_]| a.get(i)));
        let Some(value) = named.or(numbered) else { break };
        offset = value.span().start;
        (table, array) = match value.get_ref() {
            DeValue::Table(inner) => (Some(inner), None),
            DeValue::Array(inner) => (None, Some(&inner[..])),
            _ => (None, None),
        };
    }
    offset
}
