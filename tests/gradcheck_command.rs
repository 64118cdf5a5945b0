//! `donut gradcheck` as a user meets it.

use assert_cmd::Command;

fn gradcheck(arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("donut").unwrap();
    let output = command.current_dir(env!("CARGO_MANIFEST_DIR")).arg("gradcheck").args(arguments).output();
    let output = output.unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

const KNIFE: &str = "tests/data/mpm/s3-knife/scene.json";

#[test]
fn a_scene_gets_a_line_a_tool() {
    let (code, table, errors) = gradcheck(&["--scene", KNIFE, "--entries", "3"]);
    assert_eq!((code, errors.as_str()), (0, ""), "{table}");
    assert!(
        table.lines().any(|line| line.trim_start().starts_with("knife") && line.ends_with("ok")),
        "{table}"
    );
}

#[test]
fn a_task_gets_json_of_the_tool_that_is_asked_for() {
    let arguments = ["--task", "donut", "--tool", "pole", "--entries", "3", "--particles", "200", "--json"];
    let (code, text, _) = gradcheck(&arguments);
    assert_eq!(code, 0, "{text}");
    let rows: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(rows.as_array().unwrap().len(), 1);
    assert_eq!(rows[0]["tool"], "pole");
    assert_eq!(rows[0]["entries"], 3);
    assert!(rows[0]["median"].as_f64().unwrap() < 1e-6, "{text}");
}

#[test]
fn what_cannot_be_checked_is_an_error() {
    let (code, _, error) = gradcheck(&["--task", "donut", "--tool", "spoon"]);
    assert_eq!(code, 2);
    assert!(error.contains("no tool `spoon`") && error.contains("pole"), "{error}");
    let (code, _, error) = gradcheck(&["--scene", "tests/data/mpm/s1-fall/scene.json"]);
    assert_eq!(code, 2);
    assert!(error.starts_with("error: "), "{error}");
}
