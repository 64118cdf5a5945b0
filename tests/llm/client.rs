//! The client: what is sent, what comes back, and how often it is tried.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, SystemTime};

use donut::llm::http::{Key, Patience, Pause};
use donut::llm::live::{LiveModel, Settings};
use donut::llm::model::{Completion, Message, Model};
use serde_json::json;

use super::server::{Reply, Server, chat, error, message};

const KEY: &str = "sk-secret-123";

/// Asks a model with the id `id` at an address; the pauses that were made are only noted.
fn ask_at(
    id: &str,
    url: &str,
    key: Option<&str>,
    answer: Duration,
) -> (Result<Completion, String>, Vec<Pause>) {
    let pauses = Rc::new(RefCell::new(Vec::new()));
    let noted = Rc::clone(&pauses);
    let settings = Settings {
        id: id.parse().unwrap(),
        url: Some(url.to_owned()),
        key: key.map(Key::new),
        max_tokens: None,
        patience: Patience { answer, ..Patience::default() },
    };
    let mut model = LiveModel::new(settings, Box::new(move |p| noted.borrow_mut().push(p.clone()))).unwrap();
    let answer = model.complete(&[Message::user("Make a donut.")]).map_err(|e| e.to_string());
    drop(model);
    (answer, pauses.take())
}

fn ask(server: &Server) -> (Result<Completion, String>, Vec<Pause>) {
    ask_at("openai:some-model", &server.url, Some(KEY), Duration::from_secs(20))
}

fn waits(pauses: &[Pause]) -> Vec<u64> {
    pauses.iter().map(|pause| pause.wait.as_secs()).collect()
}

/// The error of a server that always replies the same, after this many requests.
fn error_of(reply: Reply, requests: usize) -> String {
    let server = Server::start(vec![reply]);
    let (answer, pauses) = ask(&server);
    let error = answer.unwrap_err();
    assert_eq!((server.asked().len(), pauses.len()), (requests, requests - 1), "{error}");
    assert!(!error.contains(KEY) && !error.contains('\n'), "{error}");
    error
}

#[test]
fn chat_completions() {
    let server = Server::start(vec![chat("### Step 1: roll")]);
    let (answer, pauses) = ask(&server);
    let wanted = Completion {
        text: "### Step 1: roll".into(),
        answered_by: Some("served-model".into()),
        input_tokens: Some(11),
        output_tokens: Some(22),
    };
    assert_eq!((answer, pauses), (Ok(wanted), vec![]));
    let asked = &server.asked()[0];
    assert_eq!(asked.path, "/v1/chat/completions");
    assert_eq!(asked.header("authorization"), Some("Bearer sk-secret-123"));
    assert_eq!(asked.header("content-type"), Some("application/json"));
    let messages = json!([{"role": "user", "content": "Make a donut."}]);
    assert_eq!(asked.body, json!({"model": "some-model", "messages": messages, "stream": false}));
}

#[test]
fn messages() {
    let server = Server::start(vec![message("### Step 1: roll")]);
    let (answer, _) = ask_at("anthropic:some-model", &server.url, Some(KEY), Duration::from_secs(20));
    let answer = answer.unwrap();
    assert_eq!((answer.text.as_str(), answer.output_tokens), ("### Step 1: roll", Some(22)));
    let asked = &server.asked()[0];
    assert_eq!(asked.path, "/v1/messages");
    assert_eq!(asked.header("x-api-key"), Some(KEY));
    assert_eq!(asked.header("anthropic-version"), Some("2023-06-01"));
    assert_eq!(asked.header("authorization"), None);
    assert_eq!(asked.body["messages"], json!([{"role": "user", "content": "Make a donut."}]));
    assert!(asked.body["max_tokens"].as_u64().unwrap() >= 4096);
}

#[test]
fn a_local_server_needs_no_key() {
    let server = Server::start(vec![chat("yes")]);
    assert!(ask_at("openai:m", &server.url, None, Duration::from_secs(20)).0.is_ok());
    assert_eq!(server.asked()[0].header("authorization"), None);
}

#[test]
fn too_many_requests_then_success() {
    let server = Server::start(vec![
        error(429, "Retry-After: 7\r\n", "slow down"),
        error(429, "", "slow down"),
        chat("yes"),
    ]);
    let (answer, pauses) = ask(&server);
    assert_eq!(answer.unwrap().text, "yes");
    assert_eq!(waits(&pauses), [7, 2], "as asked for, then as usual");
    assert_eq!((pauses[0].attempt, pauses[0].attempts), (1, 5));
    assert!(pauses[0].reason.contains("429") && pauses[0].reason.contains("slow down"), "{pauses:?}");
}

#[test]
fn a_date_to_retry_after() {
    let date = httpdate::fmt_http_date(SystemTime::now() + Duration::from_secs(60));
    let header: &'static str = Box::leak(format!("Retry-After: {date}\r\n").into_boxed_str());
    let server = Server::start(vec![error(503, header, "busy"), chat("yes")]);
    let (answer, pauses) = ask(&server);
    assert!(answer.is_ok() && (30..=60).contains(&waits(&pauses)[0]), "{pauses:?}");
}

#[test]
fn a_wait_of_an_hour_is_not_waited_for() {
    let error = error_of(error(429, "Retry-After: 3600\r\n", "come back later"), 1);
    assert!(error.contains("3600 s") && error.contains("come back later"), "{error}");
}

#[test]
fn server_errors_until_giving_up() {
    let server = Server::start(vec![error(500, "", "oops")]);
    let (answer, pauses) = ask(&server);
    let error = answer.unwrap_err();
    assert!(error.contains("after 5 attempts (500): oops"), "{error}");
    assert_eq!((server.asked().len(), waits(&pauses)), (5, vec![1, 2, 4, 8]));
    let overloaded = error_of(error_529(), 5);
    assert!(overloaded.contains("529"), "{overloaded}");
}

fn error_529() -> Reply {
    error(529, "", "Overloaded")
}

#[test]
fn silence_is_a_time_out_and_not_tried_again() {
    let server = Server::start(vec![Reply::Silence(Duration::from_secs(30))]);
    let (answer, pauses) = ask_at("openai:m", &server.url, None, Duration::from_millis(1100));
    let error = answer.unwrap_err();
    assert!(error.contains("has not answered within 1 s; raise --llm-timeout"), "{error}");
    assert_eq!((server.asked().len(), pauses.len()), (1, 0));
}

#[test]
fn lost_connections_are_tried_again() {
    let server = Server::start(vec![Reply::HangUp, Reply::BrokenOff("{\"choices\": ["), chat("yes")]);
    let (answer, pauses) = ask(&server);
    assert_eq!(answer.unwrap().text, "yes");
    assert_eq!(waits(&pauses), [1, 2]);
    assert!(pauses[1].reason.contains("breaks off after 13 bytes"), "{pauses:?}");

    // Port 9 of this machine: nobody listens there.
    let (answer, pauses) = ask_at("openai:m", "http://127.0.0.1:9", None, Duration::from_secs(20));
    let error = answer.unwrap_err();
    assert!(error.contains("http://127.0.0.1:9") && error.contains("refused"), "{error}");
    assert_eq!(pauses.len(), 4);
}

#[test]
fn truncated_json() {
    let truncated = "{\"choices\": [{\"message\": {\"content\": \"### Step";
    let error = error_of(Reply::Full(200, "", truncated.into()), 5);
    assert!(error.contains("breaks off after 46 bytes") && error.contains("5 attempts"), "{error}");
    let html = error_of(Reply::Full(200, "", "<html>\u{1b}[31m\nWelcome".into()), 1);
    assert!(html.contains("begins with `<html> [31m Welcome`") && html.contains("--llm-url"), "{html}");
}

#[test]
fn answers_that_are_none() {
    let empty = error_of(Reply::Full(200, "", "{\"choices\": []}".into()), 1);
    assert!(empty.contains("`choices` is empty"), "{empty}");
    let cut = json!({"choices": [{"message": {"content": "### Step"}, "finish_reason": "length"}],
        "usage": {"completion_tokens": 50}});
    let cut = error_of(Reply::Full(200, "", cut.to_string()), 1);
    assert!(cut.contains("cut off at its length limit of 50 tokens; raise --llm-max-tokens"), "{cut}");
    let elsewhere = error_of(Reply::Full(307, "Location: http://127.0.0.1:9/\r\n", String::new()), 1);
    assert!(elsewhere.contains("307"), "{elsewhere}");
}

#[test]
fn refusals_say_what_to_do_and_no_secret() {
    let key = error_of(error(401, "", "Incorrect API key: sk-secret-123."), 1);
    assert!(key.contains("(401): Incorrect API key: [key].; check OPENAI_API_KEY"), "{key}");
    let model = error_of(error(404, "", "no such model"), 1);
    assert!(model.contains("`some-model`") && model.contains("no such model"), "{model}");
    let quota = json!({"error": {"message": "You exceeded your quota", "code": "insufficient_quota"}});
    let quota = error_of(Reply::Full(429, "", quota.to_string()), 1);
    assert!(quota.contains("quota is used up"), "{quota}");
    let other = error_of(Reply::Full(400, "", "{\"error\": \"as Ollama says it\"}".into()), 1);
    assert!(other.contains("(400): as Ollama says it"), "{other}");
    let passed_on = error_of(error(200, "", "their key sk-secret-123 is wrong"), 1);
    assert!(passed_on.contains("(200): their key [key] is wrong"), "{passed_on}");
    let nothing = error_of(Reply::Full(400, "", String::new()), 1);
    assert!(nothing.contains("it says nothing more"), "{nothing}");
}
