//! `--engine python`: CPython in a sandbox, or a clear refusal.

use std::fs;

use assert_cmd::Command;
use donut::stagecode::{Captured, EngineError, Fault, Interpreter, Limits, Python};

fn answer(name: &str) -> String {
    format!("{}/prompts/recorded/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// A running sandbox; where there can be none, a printed line.
fn sandbox(limits: &Limits) -> Option<Python> {
    match Python::start(limits) {
        Ok(python) => Some(python),
        Err(error) => {
            println!("skipped: {error}");
            None
        }
    }
}

#[test]
fn it_refuses_where_there_is_no_sandbox() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for command in [
        vec!["subgoals".to_owned(), answer("donut/answer-1.md"), "--out".into(), out.display().to_string()],
        ["check", "--task", "donut"].map(String::from).to_vec(),
        ["plan", "--task", "donut"].map(String::from).to_vec(),
    ] {
        let mut donut = Command::cargo_bin("donut").unwrap();
        let run = donut
            .args(&command)
            .args(["--engine", "python"])
            .env("PATH", folder.path())
            .current_dir(folder.path());
        let stderr = String::from_utf8(run.assert().code(2).get_output().stderr.clone()).unwrap();
        assert!(stderr.contains("no `bwrap` in PATH") && stderr.contains("leave --engine away"), "{stderr}");
    }
    assert!(!out.exists());
    fs::write(folder.path().join("bwrap"), "").unwrap();
    let mut donut = Command::cargo_bin("donut").unwrap();
    let run = donut.args(["check", "--task", "donut", "--engine", "python"]).env("PATH", folder.path());
    let stderr = String::from_utf8(run.assert().code(2).get_output().stderr.clone()).unwrap();
    assert!(stderr.contains("needs `python3`"), "{stderr}");
}

#[test]
fn it_gives_the_clouds_of_the_evaluator() {
    let Some(mut python) = sandbox(&Limits::default()) else { return };
    let text = fs::read_to_string(answer("donut/answer-1.md")).unwrap();
    let theirs = donut::llm::answer::stages_by(&mut python, &text).unwrap();
    let ours = donut::llm::stages_from_answer(&text).unwrap();
    assert_eq!((theirs.stages.len(), &theirs.warnings), (ours.stages.len(), &ours.warnings));
    for (a, b) in theirs.stages.iter().zip(&ours.stages) {
        assert_eq!((&a.stated_volume, &a.stated_location), (&b.stated_volume, &b.stated_location));
        for (x, y) in a.outputs.iter().zip(&b.outputs).flat_map(|(x, y)| x.points.iter().zip(&y.points)) {
            assert!(x.iter().zip(y).all(|(p, q)| (p - q).abs() < 1e-12), "{x:?} {y:?}");
        }
    }
}

#[test]
fn code_beyond_the_subset_runs_and_faults_have_their_place() {
    let Some(mut python) = sandbox(&Limits::default()) else { return };
    let code = "class Ball:\n    def points(self):\n        yield from np.eye(3)\nx = np.array(list(Ball().points()))\n";
    python.run(code, 1, 0).unwrap();
    assert_eq!(python.clouds(), ["x"]);
    let Captured::Array { shape, values } = python.capture("x") else { panic!() };
    assert_eq!((shape, values.iter().sum::<f64>()), (vec![3, 3], 3.0));
    assert_eq!(python.capture("y"), Captured::Missing);
    assert_eq!(python.capture("Ball"), Captured::Other("type".into()));
    assert!((python.formula("4/3 * pi").unwrap() - 4.18879).abs() < 1e-5);
    let error = python.run("a = 1\nb = a / 0\n", 10, 2).unwrap_err();
    assert_eq!(error.line, 11);
    assert!(error.fault.to_string().contains("ZeroDivisionError"), "{error}");
    let error = python.run("a = (\n", 20, 0).unwrap_err();
    assert!(matches!(error.fault, Fault::Syntax(_)) && error.line >= 20, "{error:?}");
}

#[test]
fn it_has_no_network_no_files_and_no_time_without_end() {
    let limits = Limits { seconds: 3.0, elements: 1000, ..Limits::default() };
    let Some(mut python) = sandbox(&limits) else { return };
    for code in [
        "import socket\nsocket.create_connection(('1.1.1.1', 53), timeout=1)",
        "with open('/tmp/x', 'w') as f: f.write('x')",
        "open('/usr/x', 'w')",
        "open('/root/.bashrc')",
        "import os\nos.kill(1, 9) or os.listdir('/home')",
        "x = np.zeros(10**10)",
    ] {
        let error = python.run(code, 1, 0).expect_err(code);
        assert!(matches!(error.fault, Fault::Raised { .. }), "{code}: {error}");
    }
    python.run("print('noise' * 1000)\nx = np.zeros((1001, 1))", 1, 0).unwrap();
    assert!(matches!(python.capture("x"), Captured::Other(_)), "beyond the limit of elements");
    let error = python.run("while True: pass", 7, 0).unwrap_err();
    assert!(matches!(error.fault, Fault::Limit { .. } | Fault::Value(_)), "{error}");
    assert!(python.run("x = 1", 1, 0).is_err(), "it is gone");
    assert!(EngineError::NoBubblewrap.to_string().contains("install"));
}
