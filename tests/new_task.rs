//! `donut new-task`, `donut completions`, `-v` and `-q` as a newcomer calls them.

use std::fs;

use crate::common::donut_in;

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_new_task_is_valid_at_once_and_never_replaces_a_file() {
    let dir = tempfile::tempdir().unwrap();
    for (name, from) in [("bagel", "donut"), ("squash", "spread"), ("loaf", "baguette")] {
        let made = donut_in(dir.path(), &["new-task", name, "--from", from]);
        assert!(made.status.success(), "{}", text(&made.stderr));
        let file = format!("{name}.toml");
        assert!(text(&made.stdout).contains(&format!("donut check --task {file}")));
        let checked = donut_in(dir.path(), &["check", "--task", &file]);
        assert!(checked.status.success(), "{}", text(&checked.stderr));
        assert!(text(&checked.stdout).contains(&format!("{name} is a valid task.")));
    }
    fs::write(dir.path().join("bagel.toml"), "mine").unwrap();
    let again = donut_in(dir.path(), &["new-task", "bagel"]);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("bagel.toml exists and is not replaced"), "{}", text(&again.stderr));
    assert_eq!(fs::read_to_string(dir.path().join("bagel.toml")).unwrap(), "mine");
    for (name, says) in [("My Bagel", "hyphens"), ("donut", "take another"), ("../x", "hyphens")] {
        let refused = donut_in(dir.path(), &["new-task", name]);
        assert_eq!(refused.status.code(), Some(2));
        assert!(text(&refused.stderr).contains(says), "{}", text(&refused.stderr));
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 3);
}

#[test]
fn a_new_task_without_an_answer_says_how_to_get_one() {
    let dir = tempfile::tempdir().unwrap();
    assert!(donut_in(dir.path(), &["new-task", "bagel"]).status.success());
    let plan = donut_in(dir.path(), &["plan", "--task", "bagel.toml"]);
    assert_eq!(plan.status.code(), Some(2));
    let error = text(&plan.stderr);
    assert!(error.contains("--llm PROVIDER:MODEL") && error.contains("--response"), "{error}");
}

#[test]
fn a_reader_that_has_had_enough_is_no_error() {
    use std::process::{Command, Stdio};
    for args in [
        &["tasks", "--show", "donut"][..],
        &["tasks"],
        &["prompt", "--task", "donut"],
        &["completions", "bash"],
    ] {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("donut"));
        let mut child = command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{args:?}: {output:?}");
    }
}

#[test]
fn completions_know_the_commands() {
    let dir = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let made = donut_in(dir.path(), &["completions", shell]);
        assert!(made.status.success());
        let script = text(&made.stdout);
        assert!(script.contains("new-task") && script.contains("without-volume-reasoning"), "{shell}");
    }
    assert_eq!(donut_in(dir.path(), &["completions", "cmd"]).status.code(), Some(2));
}

#[test]
fn standard_error_says_as_much_as_is_wanted_and_standard_output_only_json() {
    let dir = tempfile::tempdir().unwrap();
    let short = "plan --task donut --method paper --particles 200 --iterations 1 --max-steps 10 --json";
    let short: Vec<&str> = short.split(' ').collect();
    let said = |flags: &[&str]| {
        let output = donut_in(dir.path(), &[flags, &short].concat());
        assert!(output.status.code().unwrap() <= 1, "{}", text(&output.stderr));
        let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(summary["task"], "donut");
        text(&output.stderr)
    };
    let usual = said(&[]);
    assert!(
        usual.lines().all(|line| line.starts_with("warning: ")),
        "quiet where there is no terminal: {usual}"
    );
    let more = said(&["-v"]);
    assert!(more.contains("stage 1/2, rolling pin: ") && more.contains("stage 2/2, pole: "), "{more}");
    assert!(more.contains(" control steps and "), "{more}");
    let most = said(&["-vv"]);
    assert!(most.contains("debug:   try 1: 10 control steps from a new start, EMD "), "{most}");
    assert_eq!(said(&["-q"]), "");
}
