//! `donut tasks` and `donut check` as a user meets them.

use assert_cmd::Command;

fn donut(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("donut").unwrap().args(arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn tasks_are_listed_and_each_checks() {
    let (code, list, _) = donut(&["tasks"]);
    assert_eq!(code, 0);
    for name in ["donut", "baguette", "two-pancakes", "spread", "cut", "arrange"] {
        assert!(list.contains(name), "{list}");
        let (code, table, errors) = donut(&["check", "--task", name]);
        assert_eq!((code, errors.as_str()), (0, ""));
        assert!(table.contains("Courant number") && table.contains("0.465"), "{table}");
    }
}

#[test]
fn a_shown_task_is_a_file_that_checks() {
    let (_, text, _) = donut(&["tasks", "--show", "donut"]);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.toml");
    std::fs::write(&file, text).unwrap();
    assert_eq!(donut(&["check", "--task", file.to_str().unwrap()]).0, 0);
}

#[test]
fn the_plain_primitives_are_shapes_of_a_task_file() {
    let (_, text, _) = donut(&["tasks", "--show", "donut"]);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.toml");
    let pole = "shape = { capsule = { radius_m = 0.02, length_m = 0.2 } }";
    assert!(text.contains(pole));
    for shape in [
        "{ box = { half_extents_m = [0.015, 0.05, 0.1] } }",
        "{ sphere = { radius_m = 0.04 } }",
        "{ cylinder = { radius_m = 0.04, length_m = 0.1 } }",
        "{ torus = { radius_m = 0.05, tube_radius_m = 0.015 } }",
    ] {
        std::fs::write(&file, text.replace(pole, &format!("shape = {shape}"))).unwrap();
        let (code, _, error) = donut(&["check", "--task", file.to_str().unwrap()]);
        assert_eq!(code, 0, "{shape}: {error}");
    }
    let flat = "shape = { torus = { radius_m = 0.05, tube_radius_m = 0.0 } }";
    std::fs::write(&file, text.replace(pole, flat)).unwrap();
    let (code, _, error) = donut(&["check", "--task", file.to_str().unwrap()]);
    assert_eq!(code, 2);
    assert!(error.contains("torus.tube_radius_m"), "{error}");
}

#[test]
fn bad_tasks_get_one_error_and_exit_code_2() {
    let (code, out, error) = donut(&["check", "--task", "bagguette"]);
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(error.starts_with("error: ") && error.contains("did you mean `baguette`?"), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.toml");
    let donut_toml = include_str!("../tasks/donut.toml");
    std::fs::write(&file, donut_toml.replace("radius_m = 0.07", "radius_m = -0.07")).unwrap();
    let (code, _, error) = donut(&["check", "--task", file.to_str().unwrap()]);
    assert_eq!(code, 2);
    assert!(error.contains("mine.toml, line") && error.contains("dough.shape.ball.radius_m"), "{error}");

    for (from, to, words) in [
        ("name = \"donut\"", "name = \"../donut\"", "`name` is"),
        ("recorded_answers = \"donut\"", "recorded_answers = \"nope\"", "only donut, baguette, two-pancakes"),
    ] {
        assert!(donut_toml.contains(from), "{from}");
        std::fs::write(&file, donut_toml.replace(from, to)).unwrap();
        let (code, _, error) = donut(&["check", "--task", file.to_str().unwrap()]);
        assert!(code == 2 && error.contains(words), "{error}");
    }
}

#[test]
fn an_answer_is_checked_with_the_task() {
    let (code, table, errors) = donut(&["check", "--task", "two-pancakes"]);
    assert_eq!((code, errors.as_str()), (0, ""));
    assert!(table.contains("half_left") && table.contains("measured"), "{table}");

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("answer.md");
    let text = include_str!("../prompts/recorded/donut/answer-1.md");
    std::fs::write(&file, text.replace("donut = donut +", "donut = 9 * donut +")).unwrap();
    let (code, _, error) = donut(&["check", "--task", "donut", "--response", file.to_str().unwrap()]);
    assert_eq!(code, 2);
    assert!(error.contains("step 2 puts `donut`") && error.contains("outside the workspace"), "{error}");
    assert!(error.contains("warning:") && error.contains("changes the volume"), "{error}");

    // Another unit asks for eight times the dough.
    let scale = folder.path().join("scale.toml");
    let large = include_str!("../tasks/donut.toml").replace("llm_unit_m = 0.07", "llm_unit_m = 0.14");
    std::fs::write(&scale, large).unwrap();
    let (code, _, error) = donut(&["check", "--task", scale.to_str().unwrap()]);
    assert_eq!(code, 0, "{error}");
    assert!(error.contains("m^3 of the dough") && error.contains("a llm_unit_m of 0.49"), "{error}");

    let (code, _, error) = donut(&["check", "--task", "spread", "--response", file.to_str().unwrap()]);
    assert_eq!(code, 2);
    assert!(error.contains("generates its target"), "{error}");
}
