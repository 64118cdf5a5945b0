//! `donut subgoals` for a task or a line of text: the answer of a model, or a recorded one.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use donut::llm::recorded::recorded;
use serde_json::Value;

use super::server::{Server, chat, message};

const NO_CODE: &str = "### Step 1: roll it\ntool name: [rolling pin]\n";
const BAGEL: &str = "The dough is initially a round ball at (0, 0, 0) with radius 1. Make a thick bagel with a hole of radius 0.3.";

/// `donut subgoals` with no key and no address in its environment.
fn subgoals(args: &[&str], dir: &Path) -> Output {
    let mut command = Command::cargo_bin("donut").unwrap();
    for variable in ["OPENAI_API_KEY", "OPENAI_BASE_URL", "ANTHROPIC_API_KEY", "ANTHROPIC_BASE_URL"] {
        command.env_remove(variable);
    }
    command.args(["-v", "subgoals"]).args(args).args(["--out", "out"]).current_dir(dir).output().unwrap()
}

fn names(dir: &Path) -> Vec<String> {
    let entries = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = entries.collect();
    names.sort();
    names
}

fn stages(dir: &Path) -> Value {
    serde_json::from_slice(&fs::read(dir.join("out/stages.json")).unwrap()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_model_is_asked_for_a_task_until_its_answer_fits() {
    let dir = tempfile::tempdir().unwrap();
    let good = recorded("donut", 2).unwrap();
    let server = Server::start(vec![chat(NO_CODE), chat(good)]);
    let output =
        subgoals(&["--task", "donut", "--llm", "openai:m", "--llm-url", &server.url, "--json"], dir.path());
    assert!(output.status.success(), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("asking openai:m ..") && said.contains("answer 1 cannot be used"), "{said}");
    assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap(), stages(dir.path()));
    let files = ["answer.md", "clouds.npz", "clouds.png", "conversation.txt", "stages.json"];
    assert_eq!(names(&dir.path().join("out")), files);
    assert_eq!(fs::read_to_string(dir.path().join("out/answer.md")).unwrap(), good);
    let conversation = fs::read_to_string(dir.path().join("out/conversation.txt")).unwrap();
    assert!(conversation.contains("===== what is wrong with answer 1 ====="), "{conversation}");
    assert_eq!(server.asked().len(), 2);

    // What it leaves is what a file with that answer gives, and a recorded answer needs no server.
    let same = tempfile::tempdir().unwrap();
    fs::write(same.path().join("answer.md"), good).unwrap();
    assert!(subgoals(&["answer.md"], same.path()).status.success());
    assert_eq!(stages(same.path()), stages(dir.path()));
    let embedded = tempfile::tempdir().unwrap();
    assert!(subgoals(&["--task", "donut", "--answer", "2"], embedded.path()).status.success());
    assert_eq!(stages(embedded.path()), stages(dir.path()));
    assert_eq!(names(&embedded.path().join("out")), ["clouds.npz", "clouds.png", "stages.json"]);
}

#[test]
fn a_described_task_is_asked_for_and_a_bad_end_leaves_the_conversation() {
    let dir = tempfile::tempdir().unwrap();
    let server = Server::start(vec![message(recorded("bagel", 1).unwrap())]);
    let args = ["--describe", BAGEL, "--llm", "anthropic:m", "--llm-url", &server.url];
    let output = subgoals(&args, dir.path());
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(server.asked()[0].body["messages"][0]["content"].as_str().unwrap().contains(BAGEL));
    assert!(!stages(dir.path()).as_array().unwrap().is_empty());

    let bad = tempfile::tempdir().unwrap();
    let server = Server::start(vec![chat(NO_CODE)]);
    let output = subgoals(&["--task", "donut", "--llm", "openai:m", "--llm-url", &server.url], bad.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("all 3 answers of openai:m cannot be used"), "{}", stderr(&output));
    assert_eq!(names(bad.path()), ["out-conversation.txt"]);
}

#[test]
fn flags_that_do_not_go_together_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    for (args, part) in [
        (&[][..], "RESPONSE.md"),
        (&["answer.md", "--task", "donut"], "--task"),
        (&["answer.md", "--llm", "openai:m"], "--llm"),
        (&["--task", "spread"], "generates its target"),
        (&["--task", "donut", "--answer", "99"], "99"),
        (&["--describe", "The dough is a ball. Make a star."], "--llm PROVIDER:MODEL"),
    ] {
        let output = subgoals(args, dir.path());
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(stderr(&output).contains(part), "{args:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty() && names(dir.path()).is_empty());
    }
}
