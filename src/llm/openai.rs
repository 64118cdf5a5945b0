//! OpenAI's chat completions, as many servers speak them: OpenAI, vLLM, llama.cpp, Ollama, OpenRouter.
//!
//! A conversation becomes the JSON of a request, the JSON of an answer a [`Completion`]. Imports `model`.

use serde_json::{Value, json};

use super::model::{Completion, Message, ModelError};

/// The body of a request. OpenAI's own server calls the length limit otherwise than all others do.
pub fn request(model: &str, conversation: &[Message], max_tokens: Option<u32>, is_openai: bool) -> Value {
    let messages: Vec<Value> =
        conversation.iter().map(|m| json!({"role": m.role, "content": m.text})).collect();
    let mut body = json!({"model": model, "messages": messages, "stream": false});
    if let Some(tokens) = max_tokens {
        body[if is_openai { "max_completion_tokens" } else { "max_tokens" }] = tokens.into();
    }
    body
}

/// The answer in a server's JSON.
pub fn completion(json: &Value, url: String) -> Result<Completion, ModelError> {
    let Some(choices) = json.get("choices").and_then(Value::as_array) else {
        return Err(ModelError::UnknownForm { url, what: "there is no list `choices`".into() });
    };
    let Some(choice) = choices.first() else {
        return Err(ModelError::Empty { url, what: "its list `choices` is empty".into() });
    };
    let tokens = |name| json.pointer("/usage")?.get(name)?.as_u64();
    let output_tokens = tokens("completion_tokens");
    match choice["finish_reason"].as_str() {
        Some("length") => return Err(ModelError::CutOff { tokens: output_tokens }),
        Some("content_filter") => {
            return Err(ModelError::Declined { said: "its provider's filter stopped it".into() });
        }
        _ => {}
    }
    if let Some(said) = choice.pointer("/message/refusal").and_then(Value::as_str) {
        return Err(ModelError::Declined { said: one_line(said) });
    }
    let text = without_thinking(&text_of(&choice["message"]["content"]));
    if text.trim().is_empty() {
        return Err(ModelError::Empty { url, what: "its message has no text".into() });
    }
    let answered_by = json["model"].as_str().map(str::to_owned);
    Ok(Completion { text, answered_by, input_tokens: tokens("prompt_tokens"), output_tokens })
}

/// The text of a message: a string, or a list of parts.
fn text_of(content: &Value) -> String {
    match content {
        Value::String(text) => text.clone(),
        Value::Array(parts) => parts.iter().filter_map(|part| part["text"].as_str()).collect(),
        _ => String::new(),
    }
}

/// The text behind a block of thinking at its beginning, which some local servers leave in the answer. In there
/// may be drafts of steps and code that are not meant.
fn without_thinking(text: &str) -> String {
    let thinking = text.trim_start().strip_prefix("<think>").and_then(|rest| rest.split_once("</think>"));
    thinking.map_or(text, |(_, answer)| answer.trim_start()).to_owned()
}

/// A text as one short line without control characters.
pub(super) fn one_line(text: &str) -> String {
    let plain: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    plain.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(300).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(json: Value) -> Result<Completion, String> {
        completion(&json, "URL".into()).map_err(|error| error.to_string())
    }

    #[test]
    fn the_limit_goes_by_the_name_that_the_server_knows() {
        let asked = [Message::user("a")];
        assert_eq!(
            request("m", &asked, None, true),
            json!({"model": "m", "messages": [{"role": "user", "content": "a"}], "stream": false})
        );
        assert_eq!(request("m", &asked, Some(9), true)["max_completion_tokens"], 9);
        assert_eq!(request("m", &asked, Some(9), false)["max_tokens"], 9);
    }

    #[test]
    fn answers_in_the_forms_that_servers_use() {
        let plain = json!({"choices": [{"message": {"content": "hi"}, "finish_reason": "stop"}],
            "model": "m-1", "usage": {"prompt_tokens": 3, "completion_tokens": 4}});
        let found = read(plain).unwrap();
        assert_eq!((found.text.as_str(), found.answered_by.as_deref()), ("hi", Some("m-1")));
        assert_eq!((found.input_tokens, found.output_tokens), (Some(3), Some(4)));
        let parts = json!({"choices": [{"message": {"content": [{"text": "a"}, {"text": "b"}]}}]});
        assert_eq!(read(parts).unwrap().text, "ab");
        let thinking = "<think>\nStep 1: no\n</think>\n\n### Step 1: yes";
        let thinking = json!({"choices": [{"message": {"content": thinking}}]});
        assert_eq!(read(thinking).unwrap().text, "### Step 1: yes");
    }

    #[test]
    fn what_is_no_answer_says_so() {
        for (json, part) in [
            (json!({"choices": []}), "empty"),
            (json!({"choices": [{"message": {"content": null}}]}), "no text"),
            (json!({"output": 1}), "choices"),
            (json!({"choices": [{"message": {"refusal": "I won't"}}]}), "I won't"),
            (json!({"choices": [{"finish_reason": "content_filter"}]}), "filter"),
            (
                json!({"choices": [{"finish_reason": "length"}], "usage": {"completion_tokens": 5}}),
                "of 5 tokens; raise --llm-max-tokens",
            ),
        ] {
            let error = read(json.clone()).unwrap_err();
            assert!(error.contains(part), "{json}: {error}");
        }
    }
}
