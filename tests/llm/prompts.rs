//! The prompts: what is sent is what was sent when the embedded answers were recorded.

use assert_cmd::Command;
use donut::llm::recorded::MANIFEST;
use serde_json::Value;
use sha2::{Digest, Sha256};

fn prompt(args: &[&str]) -> String {
    let output = Command::cargo_bin("donut").unwrap().arg("prompt").args(args).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn every_embedded_answer_was_given_to_the_prompt_that_is_printed() {
    let manifest: Value = serde_json::from_str(MANIFEST).unwrap();
    for entry in manifest.as_array().unwrap() {
        let text = |key: &str| entry[key].as_str().unwrap();
        let file = format!("{}/{}", env!("CARGO_MANIFEST_DIR"), text("prompt"));
        let shared = std::fs::read_to_string(file).unwrap();
        let wanted = format!("{shared}{}\n", text("task_line"));
        let variant = match text("prompt") {
            "prompts/plan.md" => vec![],
            "prompts/plan-without-volume-reasoning.md" => vec!["--without-volume-reasoning"],
            other => panic!("{other} is not known"),
        };
        if !text("file").contains("/novel/") {
            assert_eq!(prompt(&[&["--task", text("task")], &variant[..]].concat()), wanted);
        }
        assert_eq!(prompt(&[&["--describe", text("task_line")], &variant[..]].concat()), wanted);
    }
}

/// The recorded answers belong to exactly these bytes. Whoever changes a prompt has to record new answers to it.
#[test]
fn the_prompts_are_those_of_the_recordings() {
    for (args, wanted) in [
        (&["--task", "donut"][..], "fb03b5c20e66daa6c87a8f4d70dca997ef1fef47ffdb1c747378a96eec7b610d"),
        (
            &["--task", "two-pancakes", "--without-volume-reasoning"],
            "9ac269885db52e0572baa9377fafb7ed938a4b5c2112813068249b54758e20c8",
        ),
    ] {
        let digits: String = Sha256::digest(prompt(args)).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(digits, wanted, "{args:?}");
    }
}

#[test]
fn a_generated_target_has_no_prompt() {
    let output = Command::cargo_bin("donut").unwrap().args(["prompt", "--task", "cut"]).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr.contains("generates its target") && output.stdout.is_empty(), "{stderr}");
}
