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
    // A scene's tools are called as in its file.
    let pin = "tests/data/mpm/s2-pin/scene.json";
    let (code, _, error) = gradcheck(&["--scene", pin, "--tool", "rollingpin"]);
    assert!(code == 2 && error.contains("the tools are rolling_pin"), "{error}");
    let (code, _, error) = gradcheck(&["--scene", "tests/data/mpm/s1-fall/scene.json"]);
    assert_eq!(code, 2);
    assert!(error.starts_with("error: "), "{error}");
}

#[test]
#[ignore = "takes half an hour: cargo test --release --test all gradcheck_command -- --ignored"]
fn a_hundred_entries_of_every_tool_over_sixty_control_steps() {
    let task = "tests/data/every-tool.toml";
    let arguments = ["--task", task, "--steps", "60", "--particles", "300", "--json"];
    let (code, text, _) = gradcheck(&arguments);
    let rows: serde_json::Value = serde_json::from_str(&text).unwrap();
    let rows = rows.as_array().unwrap();
    assert_eq!((code, rows.len()), (0, 8), "{text}");
    for row in rows {
        let unconverged = row["unconverged"].as_array().unwrap().len() as u64;
        let judged = row["entries"].as_u64().unwrap() - row["idle"].as_u64().unwrap() - unconverged;
        assert_eq!(row["entries"], 100, "{row}");
        assert!(judged >= 50, "{row}");
    }
}

/// A scene of a substep five times too long, with the arrays of the knife's.
fn unstable_scene(folder: &std::path::Path) -> String {
    let text = std::fs::read_to_string(KNIFE).unwrap().replace("\"dt\": 0.0001", "\"dt\": 0.0005");
    let path = folder.join("scene.json");
    std::fs::write(&path, text).unwrap();
    std::fs::copy(KNIFE.replace(".json", ".npz"), folder.join("scene.npz")).unwrap();
    path.to_str().unwrap().to_string()
}

#[test]
fn a_scene_beyond_the_stability_bound_gets_a_warning_with_the_number_and_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let scene = unstable_scene(folder.path());
    let out = folder.path().join("out.npz");
    for arguments in [
        vec!["simulate", &scene, "--out", out.to_str().unwrap()],
        vec!["gradcheck", "--scene", &scene, "--entries", "1"],
    ] {
        let output = Command::cargo_bin("donut").unwrap().args(&arguments).output().unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        let warning = errors.lines().next().unwrap_or_default();
        assert!(warning.starts_with("warning: ") && warning.contains("2.33 grid cells"), "{errors}");
        assert!(warning.contains("make dt at most 1.94e-4 s"), "{errors}");
    }
}

#[test]
fn a_scene_that_is_no_json_is_one_error_with_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.json");
    std::fs::write(&scene, "{\"grid\": ").unwrap();
    let (code, _, error) = gradcheck(&["--scene", scene.to_str().unwrap()]);
    assert_eq!(code, 2);
    assert!(error.contains("scene.json is no scene"), "{error}");
    assert_eq!(error.matches("EOF").count(), 1, "{error}");
}
