//! `donut eval` over suites of trials: what it leaves, and that neither kill -9 nor a second process nor sharding
//! changes a result.

use std::fs;
use std::path::Path;
use std::process::{Command as Process, Output, Stdio};
use std::time::{Duration, Instant};

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin;
use serde_json::{Value, json};

/// A quick version: few particles, few steps, little search.
const QUICK: [[&str; 2]; 4] =
    [["--particles", "200"], ["--max-steps", "8"], ["--effort", "quick"], ["--threads", "2"]];
/// The quickest method.
const PAPER: [&str; 4] = ["--method", "paper", "--iterations", "1"];

/// `donut eval`, quick but for what `more` says otherwise.
fn command(suite: &str, out: &Path, more: &[&str]) -> Process {
    let mut command = Process::new(cargo_bin("donut"));
    command.args(["eval", "--suite", suite, "--out"]).arg(out).args(more);
    for quick in QUICK.iter().filter(|quick| !more.contains(&quick[0])) {
        command.args(quick);
    }
    command
}

fn eval(suite: &str, out: &Path, more: &[&str]) -> Output {
    command(suite, out, more).arg("--json").output().unwrap()
}

fn ok(output: &Output) -> Value {
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The sentence of an error.
fn refused(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("error: "), "{stderr}");
    stderr
}

/// The results without what may differ from run to run, in an order of their own.
fn results(out: &Path) -> Vec<Value> {
    let text = fs::read_to_string(out.join("results.jsonl")).unwrap();
    let mut all: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    for trial in &mut all {
        trial["seconds"] = Value::Null;
        trial["machine"] = Value::Null;
        for stage in trial["stages"].as_array_mut().unwrap() {
            stage["seconds"] = Value::Null;
        }
    }
    all.sort_by_key(|t| format!("{} {} {:4}", t["task"], t["method"], t["trial"]));
    all
}

fn check_files(out: &Path, suite: &str, summary: &Value, rows: usize) {
    assert_eq!(summary["suite"], suite);
    assert_eq!(summary["rows"].as_array().unwrap().len(), rows, "{summary}");
    for row in summary["rows"].as_array().unwrap() {
        for field in ["task", "method", "trials", "score_mean", "score_std", "success_rate", "paper_score"] {
            assert!(!row[field].is_null(), "{field}: {row}");
        }
        assert_eq!(row["failed"], 0, "{row}");
        assert!(row["score_mean"].as_f64().unwrap().abs() <= 1.0 && row["rollouts_mean"] != 0.0, "{row}");
    }
    let table = fs::read_to_string(out.join("table.md")).unwrap();
    let csv = fs::read_to_string(out.join("results.csv")).unwrap();
    assert_eq!(csv.lines().count(), rows + 1);
    let svg = fs::read_to_string(out.join("chart.svg")).unwrap();
    for row in summary["rows"].as_array().unwrap() {
        let (task, method) = (row["task"].as_str().unwrap(), row["method"].as_str().unwrap());
        assert!(table.contains(&format!("| {task} | {method} |")), "{table}");
        assert!(csv.contains(&format!("{task},{method},")), "{csv}");
        assert!(svg.contains(&format!("<title>{task}, {method}:")), "{svg}");
    }
    assert!(!out.join(".claims").exists(), "nothing is being run");
}

#[test]
fn a_quick_single_tool_suite_leaves_results_and_targets() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("single");
    let summary = ok(&eval("single-tool", &out, &["--trials", "1", "--jobs", "2"]));
    check_files(&out, "single-tool", &summary, 3);
    let trial = &results(&out)[0];
    assert_eq!(
        (&trial["task"], &trial["method"], &trial["target"]),
        (&json!("arrange"), &json!("donut"), &json!(0))
    );
    for field in ["config", "score_sinkhorn", "score_ceiling", "shape", "command", "build"] {
        assert!(!trial[field].is_null(), "{field}: {trial}");
    }
    // The targets: as solids, and as clouds.
    let targets: Value = serde_json::from_slice(&fs::read(out.join("targets.json")).unwrap()).unwrap();
    assert_eq!(targets["cut"]["0"]["pieces"].as_array().unwrap().len(), 2);
    let mut clouds = donut::store::npz::Reader::open(&out.join("targets/arrange-0.npz")).unwrap();
    assert_eq!(clouds.cloud("goal").unwrap().len(), 200);

    // The command in a result makes the same run.
    let command = trial["command"].as_str().unwrap().strip_prefix("donut ").unwrap();
    let run = Command::cargo_bin("donut")
        .unwrap()
        .args(command.split(' '))
        .args(["--json", "--out"])
        .arg(dir.path().join("run"))
        .output()
        .unwrap();
    let run: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!((&run["score"], &run["particles"]), (&trial["score"], &trial["particles"]));
}

#[test]
fn a_quick_multi_tool_suite_takes_one_answer_after_the_other() {
    let dir = tempfile::tempdir().unwrap();
    let summary = ok(&eval("multi-tool", dir.path(), &[&PAPER[..], &["--trials", "1"]].concat()));
    check_files(dir.path(), "multi-tool", &summary, 3);
    let out = dir.path().join("donut");
    let more =
        [&PAPER[..], &["--trials", "5", "--task", "donut", "--seed", "7", "--max-steps", "1"]].concat();
    ok(&eval("multi-tool", &out, &more));
    let order: Vec<_> = results(&out).iter().map(|t| (t["answer"].clone(), t["seed"].clone())).collect();
    let expected = [(1, 7), (2, 7), (3, 7), (4, 7), (1, 8)].map(|(a, s)| (json!(a), json!(s)));
    assert_eq!(order, expected);
}

#[test]
fn quick_ablations_stand_beside_the_full_method_and_the_paper() {
    let dir = tempfile::tempdir().unwrap();
    let one = ["--trials", "1", "--iterations", "1", "--max-steps", "2"];
    let single = dir.path().join("single");
    let summary = ok(&eval("single-tool-ablation", &single, &[&one[..], &["--task", "spread"]].concat()));
    check_files(&single, "single-tool-ablation", &summary, 4);
    assert_eq!(summary["rows"][0]["paper_score"], 0.26);
    let multi = dir.path().join("multi");
    let summary = ok(&eval("multi-tool-ablation", &multi, &[&one[..], &["--task", "baguette"]].concat()));
    check_files(&multi, "multi-tool-ablation", &summary, 3);
    let rows: Vec<_> =
        (0..3).map(|k| (&summary["rows"][k]["method"], &summary["rows"][k]["paper_score"])).collect();
    let expected = [("paper-no-stages", -0.165), ("paper-no-volume-reasoning", 0.289), ("paper", 0.501)];
    assert!(rows.iter().zip(expected).all(|(r, (m, p))| r.0 == m && *r.1 == p), "{rows:?}");
}

/// Six quick trials of one method.
const SIX: [&str; 8] = ["--method", "paper", "--iterations", "2", "--task", "cut,spread", "--trials", "3"];

#[test]
fn killed_and_resumed_gives_what_an_undisturbed_run_gives() {
    let dir = tempfile::tempdir().unwrap();
    let (whole, killed) = (dir.path().join("whole"), dir.path().join("killed"));
    ok(&eval("single-tool", &whole, &SIX));

    let mut process =
        command("single-tool", &killed, &SIX).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let file = killed.join("results.jsonl");
    let begin = Instant::now();
    while !fs::read_to_string(&file).is_ok_and(|text| text.contains('\n')) {
        assert!(begin.elapsed() < Duration::from_secs(120), "no trial came to an end");
        std::thread::sleep(Duration::from_millis(2));
    }
    process.kill().unwrap();
    process.wait().unwrap();
    let kept = results(&killed);
    assert!((1..6).contains(&kept.len()), "{} trials were done before the kill", kept.len());

    // Worse than a kill: a line that is cut in the middle.
    let mut text = fs::read_to_string(&file).unwrap();
    let half = text.lines().next().unwrap()[..100].to_owned();
    text.push_str(&half);
    fs::write(&file, text).unwrap();

    let without = refused(&eval("single-tool", &killed, &SIX));
    assert!(without.contains("--resume"), "{without}");
    let summary = ok(&eval("single-tool", &killed, &[&SIX[..], &["--resume"]].concat()));
    assert_eq!(summary["rows"][0]["trials"], 3);
    assert_eq!(results(&killed), results(&whole));

    // Nothing is left to do, and nothing is done.
    let before = fs::read(&file).unwrap();
    ok(&eval("single-tool", &killed, &[&SIX[..], &["--resume"]].concat()));
    assert_eq!(fs::read(&file).unwrap(), before);
}

#[test]
fn two_processes_on_one_directory_share_the_trials() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("shared");
    let start = || {
        command("single-tool", &out, &[&SIX[..], &["--resume"]].concat())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let both = [start(), start()].map(|p| p.wait_with_output().unwrap());
    let said = both.map(|o| {
        assert!(o.status.success());
        String::from_utf8(o.stderr).unwrap()
    });
    let trials = results(&out);
    assert_eq!(trials.len(), 6, "{said:?}");
    let keys: std::collections::BTreeSet<String> =
        trials.iter().map(|t| format!("{} {}", t["task"], t["trial"])).collect();
    assert_eq!(keys.len(), 6, "each trial once");
    let ran: usize = said.iter().map(|text| text.matches(" score ").count()).sum();
    assert_eq!(ran, 6, "none was run twice: {said:?}");
}

#[test]
fn shards_merge_to_what_one_run_gives() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let whole = ok(&eval("single-tool", &at("whole"), &SIX));
    for part in ["1/2", "2/2"] {
        ok(&eval("single-tool", &at(&part[..1]), &[&SIX[..], &["--shard", part]].concat()));
        assert_eq!(results(&at(&part[..1])).len(), 3);
    }
    let merge = |parts: &[&str], out: &str| {
        Command::cargo_bin("donut")
            .unwrap()
            .args(["eval", "merge", "--json", "--out", out])
            .args(parts)
            .current_dir(dir.path())
            .output()
            .unwrap()
    };
    let merged = ok(&merge(&["1", "2"], "merged"));
    assert_eq!(results(&at("merged")), results(&at("whole")));
    for name in ["targets.json", "targets/cut-2.npz", "targets/spread-0.npz"] {
        assert_eq!(fs::read(at("merged").join(name)).unwrap(), fs::read(at("whole").join(name)).unwrap());
    }
    for (a, b) in merged["rows"].as_array().unwrap().iter().zip(whole["rows"].as_array().unwrap()) {
        assert_eq!(
            (&a["task"], &a["score_mean"], &a["trials"]),
            (&b["task"], &b["score_mean"], &b["trials"])
        );
    }

    // A part twice is no harm; another experiment's is refused, and so is a directory without results.
    assert_eq!(ok(&merge(&["1", "2", "1"], "again"))["rows"], ok(&merge(&["merged"], "once"))["rows"]);
    ok(&eval("single-tool", &at("other"), &[&SIX[..], &["--seed", "3"]].concat()));
    let error = refused(&merge(&["1", "other"], "mixed"));
    assert!(error.contains("other") && error.contains("configuration"), "{error}");
    let error = refused(&merge(&["1", "nothing"], "mixed"));
    assert!(error.contains("nothing"), "{error}");
}

#[test]
fn the_same_trials_of_another_suite_are_taken_over() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let two = |methods| ["--method", methods, "--iterations", "1", "--task", "cut", "--trials", "2"];
    ok(&eval("single-tool", &at("first"), &two("paper")));
    let first = at("first");
    let reuse = ["--reuse", first.to_str().unwrap()];
    let both = two("paper,paper-no-reset");
    ok(&eval("single-tool-ablation", &at("alone"), &both));
    let output = eval("single-tool-ablation", &at("reused"), &[&both[..], &reuse].concat());
    assert!(String::from_utf8_lossy(&output.stderr).contains("2 trials are taken over"), "{output:?}");
    ok(&output);
    assert_eq!(results(&at("reused")), results(&at("alone")));

    // Not run again: even the seconds are those of the first time. Nothing is taken over twice.
    let lines = |name| fs::read_to_string(at(name).join("results.jsonl")).unwrap();
    let reused = lines("reused");
    for line in lines("first").lines() {
        assert!(reused.contains(&line.replace("\"single-tool\"", "\"single-tool-ablation\"")), "{line}");
    }
    ok(&eval("single-tool-ablation", &at("reused"), &[&both[..], &reuse, &["--resume"]].concat()));
    assert_eq!(lines("reused"), reused);

    // Another configuration's trials are others.
    let output = eval("single-tool", &at("seed"), &[&two("paper")[..], &reuse, &["--seed", "1"]].concat());
    assert!(String::from_utf8_lossy(&output.stderr).contains("0 trials are taken over"), "{output:?}");
    let nothing = at("nothing");
    let more = [&both[..], &["--reuse", nothing.to_str().unwrap()]].concat();
    assert!(refused(&eval("single-tool-ablation", &at("new"), &more)).contains("nothing"));
    assert!(!at("new").exists());
}

#[test]
fn another_configuration_or_suite_is_not_mixed_in() {
    let dir = tempfile::tempdir().unwrap();
    let one = ["--method", "paper", "--iterations", "1", "--task", "cut", "--trials", "1"];
    ok(&eval("single-tool", dir.path(), &one));
    let resume =
        |suite, more: &[&str]| refused(&eval(suite, dir.path(), &[&one[..], more, &["--resume"]].concat()));
    for more in [["--particles", "210"], ["--seed", "1"], ["--max-steps", "9"], ["--simd", "scalar"]] {
        let error = resume("single-tool", &more);
        assert!(error.contains("line 1") && error.contains("configuration"), "{error}");
    }
    assert!(resume("single-tool-ablation", &[]).contains("suite single-tool"));
    // Another method is another experiment, beside the first.
    let more =
        ["--method", "paper-no-reset", "--iterations", "1", "--task", "cut", "--trials", "1", "--resume"];
    let summary = ok(&eval("single-tool", dir.path(), &more));
    assert_eq!(summary["rows"].as_array().unwrap().len(), 2);

    // A line that is whole but no result is somebody's mistake, which is not passed over.
    let file = dir.path().join("results.jsonl");
    fs::write(&file, fs::read_to_string(&file).unwrap() + "{\"suite\":\"pastry\"}\n").unwrap();
    let error = resume("single-tool", &[]);
    assert!(error.contains("line 3") && error.contains("results.jsonl"), "{error}");
}

#[test]
fn what_does_not_compete_is_refused_with_what_does() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    for (suite, more, expected) in [
        ("single-tool", ["--method", "pasta"], "paper-no-p2p"),
        ("single-tool", ["--method", "paper-no-volume-reasoning"], "single-tool"),
        ("single-tool", ["--task", "donut"], "spread, cut, arrange"),
        ("multi-tool", ["--shard", "3/2"], "K/N"),
        ("multi-tool", ["--shard", "one"], "K/N"),
        ("volume", ["--method", "paper"], "without-volume-reasoning"),
        ("volume", ["--shard", "1/2"], "--shard"),
    ] {
        let error = refused(&eval(suite, &out, &more));
        assert!(error.contains(expected) && !out.exists(), "{error}");
    }
}
