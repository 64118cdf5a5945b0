//! `donut plan --llm` as a user calls it.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use donut::llm::recorded::recorded;
use donut::store::run_dir::read_run;
use serde_json::Value;

use super::server::{Server, chat, error, message};

/// A short run: few particles, one iteration, one horizon.
/// Where a plan comes from is tested here, not how good it is.
const SHORT: &str = "--method paper --particles 200 --iterations 1 --max-steps 5 --threads 1";
const BAGEL: &str = "The dough is initially a round ball at (0, 0, 0) with radius 1. Make a thick bagel with a hole of radius 0.3.";
const NO_CODE: &str = "### Step 1: roll it\ntool name: [rolling pin]\n";

struct Plan {
    command: Command,
    folder: tempfile::TempDir,
}

/// `donut plan` in an empty folder, with no key and no address in its environment.
fn plan(args: &[&str]) -> Plan {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::cargo_bin("donut").unwrap();
    for variable in ["OPENAI_API_KEY", "OPENAI_BASE_URL", "ANTHROPIC_API_KEY", "ANTHROPIC_BASE_URL"] {
        command.env_remove(variable);
    }
    command.arg("plan").args(args).args(SHORT.split(' ')).args(["--out", "run"]).current_dir(folder.path());
    Plan { command, folder }
}

impl Plan {
    /// Runs it to its end, whatever the score.
    fn ends(&mut self) -> Output {
        let output = self.command.output().unwrap();
        assert!(output.status.code().unwrap() <= 1, "{}", stderr(&output));
        output
    }

    /// Runs it into an error.
    fn fails(&mut self) -> String {
        let output = self.command.output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(output.stdout.is_empty() && !self.path("run").exists());
        stderr(&output)
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn a_live_plan_with_a_repair_is_recorded_and_replayed_without_network() {
    let good = recorded("donut", 2).unwrap();
    let server = Server::start(vec![chat(NO_CODE), chat(good)]);
    let mut live = plan(&["--task", "donut", "--llm", "record:said=openai:some-model"]);
    live.command.env("OPENAI_BASE_URL", &server.url).env("OPENAI_API_KEY", "sk-secret-123");
    let output = live.ends();
    let said = stderr(&output);
    assert!(said.contains("answer 1 cannot be used: line 1: the answer has no code"), "{said}");

    let asked = server.asked();
    assert_eq!(asked.len(), 2);
    let messages = asked[1].body["messages"].as_array().unwrap();
    assert_eq!((messages.len(), messages[1]["content"].as_str()), (3, Some(NO_CODE)));
    let repair = messages[2]["content"].as_str().unwrap();
    assert!(repair.contains("the answer has no code") && repair.contains("```python"), "{repair}");

    let run = live.path("run");
    let record = read_run(&run).unwrap();
    let conversation = record.plan.conversation.unwrap();
    assert_eq!(conversation.model, "openai:some-model");
    assert_eq!(conversation.attempts.len(), 2);
    assert_eq!(conversation.attempts[1].answer.text, good);
    assert_eq!(conversation.attempts[1].answer.output_tokens, Some(22));
    assert_eq!(record.plan.response.as_deref(), Some(good));
    assert_eq!(record.plan.stages.len(), 2);
    let summary = json(&run.join("summary.json"));
    assert_eq!((&summary["model"], &summary["answers"]), (&"openai:some-model".into(), &2.into()));
    let text = fs::read_to_string(run.join("conversation.txt")).unwrap();
    assert!(text.contains("===== answer 2 ====="), "{text}");
    assert_eq!(fs::read_dir(live.path("said")).unwrap().count(), 2);
    let everything = walk(live.folder.path());
    assert!(everything.len() > 6);
    for file in everything {
        let bytes = fs::read(&file).unwrap();
        assert!(!bytes.windows(13).any(|w| w == b"sk-secret-123"), "the key is in {}", file.display());
    }

    // The server is not named any more; the run is the same.
    let said = live.path("said");
    let mut replay = plan(&["--task", "donut", "--llm", &format!("replay:{}", said.display())]);
    replay.ends();
    let trajectory = |run: &Path| fs::read(run.join("trajectory.npz")).unwrap();
    assert!(trajectory(&run) == trajectory(&replay.path("run")), "the replayed run is another");
    assert_eq!(server.asked().len(), 2);

    // Another task was not recorded.
    let mut other = plan(&["--task", "baguette", "--llm", &format!("replay:{}", said.display())]);
    let missing = other.fails();
    assert!(missing.contains("no answer of openai:some-model to this prompt"), "{missing}");
}

fn walk(dir: &Path) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}

#[test]
fn after_three_bad_answers_it_is_over_and_they_are_kept() {
    let server = Server::start(vec![message(NO_CODE)]);
    let mut bad = plan(&["--task", "donut", "--llm", "anthropic:some-model", "--llm-url", &server.url]);
    bad.command.env("ANTHROPIC_API_KEY", "sk-secret-123");
    let error = bad.fails();
    assert!(error.contains("all 3 answers of anthropic:some-model cannot be used"), "{error}");
    assert!(error.contains("hint: ") && error.contains("run-conversation.txt"), "{error}");
    assert_eq!(server.asked().len(), 3);
    let kept = fs::read_to_string(bad.path("run-conversation.txt")).unwrap();
    assert!(kept.contains("===== what is wrong with answer 3 ====="), "{kept}");
}

#[test]
fn a_plan_that_does_not_fit_the_table_goes_back_too() {
    let good = recorded("donut", 1).unwrap();
    let wide = good.replacen("np.stack([", "9 * np.stack([", 2);
    assert_ne!(wide, good);
    let server = Server::start(vec![chat(&wide), chat(good)]);
    let mut live = plan(&["--task", "donut", "--llm", "openai:m", "--llm-url", &server.url]);
    let said = stderr(&live.ends());
    assert!(said.contains("outside the workspace"), "{said}");
    let repair = server.asked()[1].body["messages"][2]["content"].to_string();
    assert!(repair.contains("One of your units is 0.07 m."), "{repair}");
}

#[test]
fn without_a_key_nothing_is_sent() {
    let error = plan(&["--task", "donut", "--llm", "openai:some-model"]).fails();
    assert!(error.contains("OPENAI_API_KEY is not set, and api.openai.com needs a key"), "{error}");
    let mut empty = plan(&["--task", "donut", "--llm", "anthropic:some-model"]);
    empty.command.env("ANTHROPIC_API_KEY", " ");
    let error = empty.fails();
    assert!(error.contains("ANTHROPIC_API_KEY is not set"), "{error}");
    let server = Server::start(vec![error_401()]);
    let error = plan(&["--task", "donut", "--llm", "openai:m", "--llm-url", &server.url]).fails();
    assert!(error.contains("401") && error.contains("OPENAI_API_KEY"), "{error}");
}

fn error_401() -> super::server::Reply {
    error(401, "", "You didn't provide an API key.")
}

#[test]
fn flags_that_do_not_go_together_are_refused() {
    for (args, part) in [
        (&["--task", "donut", "--llm", "gpt-5"][..], "openai:MODEL"),
        (&["--task", "donut", "--llm", "record:said"], "record:said=PROVIDER:MODEL"),
        (&["--task", "donut", "--llm", "replay:nowhere"], "nowhere"),
        (&["--task", "donut", "--llm", "openai:m", "--response", "a.md"], "--response"),
        (&["--task", "donut", "--describe", BAGEL], "--describe"),
        (
            &["--task", "spread", "--llm", "openai:m", "--llm-url", "http://127.0.0.1:9"],
            "generates its target",
        ),
        (&["--describe", "The dough is a ball. Make a star."], "--llm PROVIDER:MODEL"),
        (&["--describe", "The dough is a ball of radius 0."], "size of"),
        (&[], "--task"),
    ] {
        let error = plan(args).fails();
        assert!(error.contains(part), "{args:?}: {error}");
    }
}

#[test]
fn a_described_task_runs_from_a_recorded_answer_a_file_and_a_model() {
    let bagel = recorded("bagel", 1).unwrap();
    let mut embedded = plan(&["--describe", BAGEL]);
    embedded.ends();
    let mut file = plan(&["--describe", BAGEL, "--response", "answer.md"]);
    fs::write(file.path("answer.md"), bagel).unwrap();
    file.ends();
    let server = Server::start(vec![chat(bagel)]);
    let mut live = plan(&["--describe", BAGEL, "--llm", "openai:m", "--llm-url", &server.url]);
    live.ends();
    let prompt = server.asked()[0].body["messages"][0]["content"].as_str().unwrap().to_owned();
    assert!(prompt.ends_with(&format!("# The task\n\n{BAGEL}\n")), "{prompt}");

    let trajectory = |plan: &Plan| fs::read(plan.path("run/trajectory.npz")).unwrap();
    assert!(trajectory(&embedded) == trajectory(&file) && trajectory(&file) == trajectory(&live));
    let record = read_run(&live.path("run")).unwrap();
    assert_eq!(record.summary.task, "make-a-thick-bagel");
    assert!(record.plan.command.contains("--describe 'The dough is"), "{}", record.plan.command);
    // The task file in the plan is one that can be used again.
    fs::write(live.path("bagel.toml"), &record.plan.task_file).unwrap();
    let mut again = plan(&["--task", "bagel.toml", "--response", "answer.md"]);
    fs::write(again.path("bagel.toml"), &record.plan.task_file).unwrap();
    fs::write(again.path("answer.md"), bagel).unwrap();
    again.ends();
    assert!(trajectory(&again) == trajectory(&live));
}
