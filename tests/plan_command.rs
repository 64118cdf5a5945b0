//! `donut plan` as a user calls it: what a run leaves, that it repeats to the bit, and what bad input gets.

use std::fs;
use std::path::Path;

use donut::store::record::RunRecord;
use donut::store::run_dir::read_run;
use serde_json::Value;

use crate::common::donut_in;

/// A short run: few particles, few steps, little search.
const SHORT: [&str; 6] = ["--particles", "300", "--effort", "quick", "--max-steps", "30"];
/// The same with Algorithm 1.
const SHORT_PAPER: [&str; 8] =
    ["--particles", "300", "--method", "paper", "--iterations", "3", "--max-steps", "30"];

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_run_leaves_its_files_and_repeats_to_the_bit() {
    let record = check_run("donut", &SHORT);
    let steps: usize = record.summary.stages.iter().map(|s| s.steps).sum();
    let executed = record.trajectory.tool.iter().skip(1).filter(|t| **t >= 0).count();
    assert_eq!(executed, steps, "every control step has its frame");
    assert!(record.summary.shape.is_some() && record.plan.search.is_some());
}

#[test]
fn a_run_of_algorithm_1_leaves_its_files_and_repeats_to_the_bit() {
    let record = check_run("paper", &SHORT_PAPER);
    assert_eq!(record.plan.stages[0].segments[0].actions.len(), 30);
}

fn check_run(method: &str, short: &[&str]) -> RunRecord {
    let dir = tempfile::tempdir().unwrap();
    let run = |out: &str, threads: &str| {
        let args =
            [&["plan", "--task", "donut", "--json", "--out", out, "--threads", threads][..], short].concat();
        let output = donut_in(dir.path(), &args);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code().unwrap() <= 1, "{stderr}");
        serde_json::from_slice::<Value>(&output.stdout).unwrap()
    };
    let summary = run("a", "1");
    for key in [
        "task",
        "seed",
        "method",
        "score",
        "threshold",
        "success",
        "emd_initial",
        "emd_final",
        "seconds",
        "particles",
        "stages",
        "score_ceiling",
    ] {
        assert!(!summary[key].is_null(), "{key} is missing");
    }
    assert_eq!(summary["method"], method);
    let stages = summary["stages"].as_array().unwrap();
    assert_eq!(stages.len(), 2);
    assert_eq!(stages[0]["tool"], "rolling pin");
    assert_eq!(stages[1]["tool"], "pole");
    assert_eq!(names(&dir.path().join("a")), ["plan.json", "report.html", "summary.json", "trajectory.npz"]);

    let record = read_run(&dir.path().join("a")).unwrap();
    let t = &record.trajectory;
    assert_eq!(t.positions.len(), t.actions.len() + 1);
    assert_eq!(t.subgoals.len(), 2);

    run("b", "2");
    let bytes = |out: &str| fs::read(dir.path().join(out).join("trajectory.npz")).unwrap();
    assert!(bytes("a") == bytes("b"), "threads change the trajectory");
    record
}

#[test]
fn generated_targets_differ_by_index() {
    let dir = tempfile::tempdir().unwrap();
    let goal = |index: &str| {
        let args = ["plan", "--task", "arrange", "--target", index, "--out", index, "--threads", "1"];
        let output = donut_in(dir.path(), &[&args[..], &SHORT_PAPER].concat());
        assert!(output.status.code().unwrap() <= 1, "{}", String::from_utf8_lossy(&output.stderr));
        read_run(&dir.path().join(index)).unwrap().trajectory.target
    };
    assert_ne!(goal("0"), goal("1"));
}

/// The error of a call that must fail, leaving nothing behind in `dir`.
fn error_of(args: &[&str], dir: &Path) -> String {
    let before = names(dir);
    let output = donut_in(dir, args);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(output.stdout.is_empty());
    assert_eq!(names(dir), before, "something was left behind");
    stderr
}

#[test]
fn bad_input_gets_one_clear_error_and_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let plan = |more: &[&str]| error_of(&[&["plan"], more].concat(), dir.path());

    let error = plan(&["--task", "donnut"]);
    assert!(error.contains("donnut") && error.contains("donut"), "{error}");

    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("tasks/donut.toml")).unwrap();
    fs::write(at("key.toml"), text.replacen("nodes = 64", "noodles = 64", 1)).unwrap();
    let error = plan(&["--task", "key.toml"]);
    assert!(error.contains("key.toml") && error.contains("line") && error.contains("noodles"), "{error}");

    fs::write(at("radius.toml"), text.replacen("radius_m = 0.07", "radius_m = -0.07", 1)).unwrap();
    let error = plan(&["--task", "radius.toml"]);
    assert!(error.contains("radius.toml") && error.contains("radius_m"), "{error}");

    fs::write(at("answer.md"), "### Step 1: flatten\ntool name: [rolling pin]\nno code at all\n").unwrap();
    let error = plan(&["--task", "donut", "--response", "answer.md"]);
    assert!(error.contains("answer.md") && error.contains("code") && error.contains("hint:"), "{error}");

    let error = plan(&["--task", "donut", "--answer", "99"]);
    assert!(error.contains("99"), "{error}");

    let error = plan(&["--task", "spread", "--response", "answer.md"]);
    assert!(error.contains("--response"), "{error}");

    // Below a file there is no directory to make.
    fs::write(at("file"), "").unwrap();
    let error = plan(&["--task", "donut", "--out", "file/run"]);
    assert!(error.contains("file/run"), "{error}");

    // A directory that donut did not make is not overwritten.
    fs::create_dir(at("mine")).unwrap();
    fs::write(at("mine/letter.txt"), "dear").unwrap();
    let error = plan(&["--task", "donut", "--out", "mine"]);
    assert!(error.contains("mine"), "{error}");
    assert_eq!(names(&at("mine")), ["letter.txt"]);
}
