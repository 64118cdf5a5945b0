//! Answers to stages: every recorded answer against CPython and numpy, other formats, errors.

use std::collections::BTreeMap;
use std::path::Path;

use donut::llm::recorded::{self, Recorded};
use donut::llm::{AnswerError, stages_from_answer};
use donut::math::cloud::{Bounds, Point, centroid};
use serde_json::Value;

fn golden() -> BTreeMap<String, BTreeMap<String, Value>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/golden.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn file_of(r: &Recorded) -> String {
    if r.text == recorded::recorded(r.task, 1).unwrap_or("")
        && !["donut", "baguette", "two-pancakes"].contains(&r.task)
    {
        return format!("novel/{}.md", r.task);
    }
    let name = if r.volume_reasoning { "answer" } else { "without-volume-reasoning" };
    format!("{}/{name}-{}.md", r.task, r.index)
}

fn near(found: Point, wanted: &Value, what: &str) {
    for (a, x) in found.iter().enumerate() {
        let y = wanted[a].as_f64().unwrap();
        assert!((x - y).abs() <= 1e-12, "{what}: {x} is not {y}");
    }
}

#[test]
fn every_recorded_answer_gives_the_clouds_of_numpy() {
    let golden = golden();
    let mut clouds = 0;
    for r in recorded::all() {
        let file = file_of(r);
        let answer = stages_from_answer(r.text).unwrap_or_else(|e| panic!("{file}: {e}"));
        assert!(answer.warnings.is_empty(), "{file}: {:?}", answer.warnings);
        let wanted = &golden[&file];
        let mut names = Vec::new();
        for stage in &answer.stages {
            for output in &stage.outputs {
                let key = format!("step{}/{}", stage.step, output.name);
                let truth = &wanted[&key];
                assert_eq!(output.points.len() as u64, truth["shape"][0].as_u64().unwrap(), "{file} {key}");
                let bounds = Bounds::of(&output.points).unwrap();
                near(centroid(&output.points), &truth["mean"], &key);
                near(bounds.min, &truth["min"], &key);
                near(bounds.max, &truth["max"], &key);
                for (at, point) in truth["points"].as_object().unwrap() {
                    near(output.points[at.parse::<usize>().unwrap()], point, &key);
                }
                names.push(key);
                clouds += 1;
            }
        }
        names.sort();
        assert_eq!(names, wanted.keys().cloned().collect::<Vec<_>>(), "{file}");
    }
    assert_eq!((golden.len(), clouds), (30, 114));
}

#[test]
fn fields_of_a_recorded_answer_are_read() {
    let answer = stages_from_answer(recorded::recorded("two-pancakes", 1).unwrap()).unwrap();
    let knife = &answer.stages[1];
    assert_eq!((knife.step, knife.tool.as_deref()), (1, Some("knife")));
    assert_eq!(knife.title, "cut the dough in the middle into two equal halves along x");
    assert_eq!(knife.inputs, ["dough"]);
    assert_eq!(knife.stated_location["half_left"], [-0.75, 0.0, 0.0]);
    assert_eq!(knife.stated_volume["half_right"], 0.08);
    assert!(knife.code.contains("half_left = rng.uniform"));
    assert_eq!(answer.stages[0].tool, None);
}

/// The paper's form of an answer, with the spellings that models mix into it.
const PAPER: &str = r#"
Sure! Here is the plan.

Step [1]: [Roll the ball flat]
* **Tool name**: [Rolling Pin]
* Python code:
  ```
  import numpy as np
  def disc_points(n, r, h):
      t, u = np.random.rand(n) * 2 * np.pi, np.random.rand(n)
      return np.c_[r * np.sqrt(u) * np.cos(t), h * (np.random.rand(n) - 0.5), r * np.sqrt(u) * np.sin(t)]
  ```
  ```py
  disc = disc_points(2000, 1.2, 0.5)
  ```
* In var name: ['ball'], Out var name: ['disc']
* Location: ball: (0, 0, 0), disc: [0, 0, 0]
* Volume: {"ball": 4/3 * pi, "disc": 4.19}

**Step 2: Cut it**
1. tool name: "knife" (comes down once)
2. code

```python3
left, right = disc[disc[:, 0] < 0], disc[disc[:, 0] >= 0]
left = left - np.array([0.5, 0, 0])
right = right + np.array([0.5, 0, 0])
```
in var name: [disc]
out var name: [left, right]
Loc = {"disc": (0, 0, 0),
       "left": (-1, 0, 0), "right": (1, 0, 0)}
"#;

#[test]
fn the_form_of_the_paper_is_understood() {
    let answer = stages_from_answer(PAPER).unwrap();
    let [first, second] = &answer.stages[..] else { panic!("{answer:?}") };
    assert_eq!((first.tool.as_deref(), second.tool.as_deref()), (Some("rolling pin"), Some("knife")));
    assert_eq!(first.title, "Roll the ball flat");
    assert_eq!(first.inputs, ["ball"]);
    assert!((first.stated_volume["ball"] - 4.18879).abs() < 1e-5);
    assert_eq!(first.stated_location["disc"], [0.0; 3]);
    assert_eq!(second.outputs.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["left", "right"]);
    assert_eq!(second.stated_location["right"], [1.0, 0.0, 0.0]);
    assert_eq!(first.outputs[0].points.len(), 2000);
}

fn step(tool: &str, code: &str, out: &str) -> String {
    format!(
        "### Step 1: roll\ntool name: {tool}\n```python\n{code}\n```\nin var name: [], out var name: [{out}]\n"
    )
}

fn error(text: &str) -> AnswerError {
    stages_from_answer(text).expect_err(text)
}

#[test]
fn errors_name_line_step_and_remedy() {
    let cloud = "disc = np.random.rand(300, 3)";
    let cases = [
        (String::from("Roll it."), "line 1: the answer has no step", "begin each step"),
        (String::from("### Step 1: x\ntool name: knife"), "line 1: the answer has no code", "```python"),
        (format!("### Step 1: x\n```python\n{cloud}"), "line 2: the code fence is never closed", "cut off"),
        (step("spoon", cloud, "disc"), "line 2: step 1 names the tool `spoon`", "rolling pin"),
        (
            step("knife and pole", cloud, "disc"),
            "line 2: step 1 names several tools: knife, pole",
            "split it",
        ),
        (
            step("knife", cloud, "disk"),
            "line 6: step 1 names the cloud `disk`",
            "clouds defined so far: disc",
        ),
        (step("knife", cloud, ""), "line 6: step 1 names no cloud", "clouds defined so far: disc"),
        (step("knife", "disc = [1, 2]", "disc"), "`disc` is a list", "np.stack"),
        (step("knife", "disc = np.zeros((3, 300))", "disc"), "an array of shape [3, 300]", "np.stack"),
        (
            step("knife", "disc = np.full((300, 3), np.nan)", "disc"),
            "point 0 of `disc` is not finite",
            "roots",
        ),
        (step("knife", "a = 1\ndisc = foo", "disc"), "line 5, column 8: step 1: name `foo`", "define it"),
        (step("knife", "disc = (", "disc"), "line 4", ""),
    ];
    for (text, message, hint) in cases {
        let error = error(&text);
        assert!(error.to_string().contains(message), "{text}\n{error}");
        assert!(error.hint().unwrap_or_default().contains(hint), "{text}\n{:?}", error.hint());
    }
    let no_code =
        format!("{}### Step 2: cut\ntool name: knife\nout var name: [a]\n", step("pole", cloud, "disc"));
    assert!(matches!(error(&no_code), AnswerError::StepWithoutCode { step: 2, line: 7 }));
}

#[test]
fn what_looks_wrong_but_runs_is_a_warning() {
    let first = step("none", "ball = np.random.rand(300, 3)", "ball").replace("Step 1", "Step 0");
    let second = "### Step 1: with the pole\n```python\nring = ball[:100] + 5\n```\nin var name: [bal], out var name: [ring]\n\
                  loc: {\"ring\": (0, 0, 0)}\nvol: {\"bal\": 1.0, \"ring\": 0.5}\n";
    let answer = stages_from_answer(&(first + second)).unwrap();
    assert_eq!(answer.stages[1].tool.as_deref(), Some("pole"));
    let all = answer.warnings.join("\n");
    for part in [
        "title says pole",
        "takes `bal`",
        "volume of 1 before and 0.5 after",
        "only 100 points",
        "is stated at",
    ] {
        assert!(all.contains(part), "{all}");
    }
}
