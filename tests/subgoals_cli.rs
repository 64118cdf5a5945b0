//! `donut subgoals` as other programs call it.

use std::fs;
use std::path::Path;

use ndarray::Array2;
use ndarray_npy::NpzReader;

use crate::common::donut;

fn answer(name: &str) -> String {
    format!("{}/prompts/recorded/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn writes_stages_and_clouds() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/out");
    let run =
        donut().args(["subgoals", &answer("two-pancakes/answer-1.md"), "--json", "--out"]).arg(&out).assert();
    let printed: serde_json::Value = serde_json::from_slice(&run.success().get_output().stdout).unwrap();
    let written: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("stages.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    assert_eq!(written[1]["tool"], "knife");
    assert_eq!(written[0]["tool"], serde_json::Value::Null);
    assert_eq!(written[1]["outputs"], serde_json::json!(["half_left", "half_right"]));
    assert_eq!(written[1]["stated_location"]["half_left"], serde_json::json!([-0.75, 0.0, 0.0]));
    let keys: Vec<&String> = written[1].as_object().unwrap().keys().collect();
    let contract = ["step", "title", "tool", "inputs", "outputs", "stated_location", "stated_volume", "code"];
    assert_eq!(keys[..8], contract);
    assert_eq!(keys[8..], ["measured_volume"]);
    let measured = written[1]["measured_volume"]["half_left"].as_f64().unwrap();
    assert!((measured / 0.08 - 1.0).abs() < 0.1, "{measured}");
    let mut clouds = NpzReader::new(fs::File::open(out.join("clouds.npz")).unwrap()).unwrap();
    assert!(clouds.names().unwrap().iter().any(|n| n.starts_with("step1/half_left")));
    let half: Array2<f64> = clouds.by_name("step1/half_left").unwrap();
    assert_eq!(half.shape(), [3000, 3]);
    let png = fs::read(out.join("clouds.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG"));
    assert_eq!(fs::read_dir(&out).unwrap().count(), 3);
}

fn fails(text: &str, messages: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("answer.md"), folder.path().join("out"));
    fs::write(&file, text).unwrap();
    let run = donut().arg("subgoals").arg(&file).arg("--out").arg(&out).assert().code(2);
    let stderr = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(stderr.starts_with("error: ") && run.get_output().stdout.is_empty());
    for message in messages {
        assert!(stderr.contains(message), "{stderr}");
    }
    assert!(!Path::new(&out).exists(), "nothing may be written");
}

#[test]
fn an_answer_without_code_is_an_error_with_a_hint() {
    fails(
        "### Step 1: roll it\ntool name: rolling pin\n",
        &["answer.md: line 1: the answer has no code", "\nhint: put the code"],
    );
}

#[test]
fn code_that_fails_is_an_error_with_its_place() {
    let text = "### Step 1: roll it\ntool name: rolling pin\n```python\nimport os\n```\nout var name: [a]\n";
    fails(text, &["answer.md: line 4, column 1: step 1: importing `os`", "\nhint: only numpy"]);
}

#[test]
fn a_missing_file_is_an_error() {
    let run = donut().args(["subgoals", "/nowhere/answer.md", "--out", "/nowhere/out"]).assert().code(2);
    assert!(String::from_utf8_lossy(&run.get_output().stderr).contains("/nowhere/answer.md"));
}

#[test]
fn the_picture_goes_where_it_is_wanted() {
    let folder = tempfile::tempdir().unwrap();
    let (out, png) = (folder.path().join("out"), folder.path().join("mine.png"));
    donut()
        .args(["subgoals", &answer("donut/answer-1.md"), "--out"])
        .arg(&out)
        .arg("--png")
        .arg(&png)
        .assert()
        .success();
    assert!(fs::read(png).unwrap().len() > 10_000);
    assert!(!out.join("clouds.png").exists());
}

#[test]
fn volumes_that_do_not_fit_are_warned_of_with_both_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("answer.md");
    let text = fs::read_to_string(answer("donut/answer-1.md")).unwrap();
    fs::write(&file, text.replace("\"donut\": 4.18879}", "\"donut\": 9.5}")).unwrap();
    let run =
        donut().arg("subgoals").arg(&file).arg("--out").arg(folder.path().join("out")).assert().success();
    let stderr = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(stderr.contains("`donut` is stated to have a volume of 9.5, its points measure 4."), "{stderr}");
    assert!(stderr.contains("states a volume of 4.18879 before and 9.5 after"), "{stderr}");
}
