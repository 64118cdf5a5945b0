//! Anthropic's messages API.
//!
//! A conversation becomes the JSON of a request, the JSON of an answer a [`Completion`]. Imports `model`.

use serde_json::{Value, json};

use super::model::{Completion, Message, ModelError};
use super::openai::one_line;

/// The version of the API that is spoken here.
pub const VERSION: &str = "2023-06-01";
/// The API wants a length limit. Recorded plans have 1000 to 3000 tokens.
const MAX_TOKENS: u32 = 8192;

/// The body of a request.
pub fn request(model: &str, conversation: &[Message], max_tokens: Option<u32>) -> Value {
    let messages: Vec<Value> =
        conversation.iter().map(|m| json!({"role": m.role, "content": m.text})).collect();
    json!({"model": model, "max_tokens": max_tokens.unwrap_or(MAX_TOKENS), "messages": messages})
}

/// The answer in a server's JSON.
pub fn completion(json: &Value, url: String) -> Result<Completion, ModelError> {
    let Some(blocks) = json.get("content").and_then(Value::as_array) else {
        return Err(ModelError::UnknownForm { url, what: "there is no list `content`".into() });
    };
    let tokens = |name| json.pointer("/usage")?.get(name)?.as_u64();
    let output_tokens = tokens("output_tokens");
    let texts = blocks.iter().filter(|block| block["type"] == "text");
    let text: String = texts.filter_map(|block| block["text"].as_str()).collect();
    match json["stop_reason"].as_str() {
        Some("max_tokens" | "model_context_window_exceeded") => {
            return Err(ModelError::CutOff { tokens: output_tokens });
        }
        Some("refusal") => {
            let said = if text.is_empty() { "it says nothing more".into() } else { one_line(&text) };
            return Err(ModelError::Declined { said });
        }
        _ => {}
    }
    if text.trim().is_empty() {
        return Err(ModelError::Empty { url, what: "its list `content` has no text".into() });
    }
    let answered_by = json["model"].as_str().map(str::to_owned);
    Ok(Completion { text, answered_by, input_tokens: tokens("input_tokens"), output_tokens })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_has_a_limit() {
        let asked = [Message::user("a"), Message::assistant("b"), Message::user("c")];
        let body = request("m", &asked, None);
        assert_eq!((&body["model"], &body["max_tokens"]), (&json!("m"), &json!(8192)));
        assert_eq!(body["messages"][1], json!({"role": "assistant", "content": "b"}));
        assert_eq!(request("m", &asked, Some(7))["max_tokens"], 7);
    }

    #[test]
    fn only_text_is_the_answer() {
        let json = json!({"content": [{"type": "thinking", "thinking": "no"}, {"type": "text", "text": "yes"}],
            "stop_reason": "end_turn", "model": "m-1", "usage": {"input_tokens": 3, "output_tokens": 4}});
        let found = completion(&json, "URL".into()).unwrap();
        assert_eq!((found.text.as_str(), found.answered_by.as_deref()), ("yes", Some("m-1")));
        assert_eq!((found.input_tokens, found.output_tokens), (Some(3), Some(4)));
    }

    #[test]
    fn what_is_no_answer_says_so() {
        for (json, part) in [
            (json!({"content": []}), "no text"),
            (json!({"choices": []}), "`content`"),
            (json!({"content": [], "stop_reason": "max_tokens"}), "--llm-max-tokens"),
            (json!({"content": [{"type": "text", "text": "never"}], "stop_reason": "refusal"}), "never"),
        ] {
            let error = completion(&json, "URL".into()).unwrap_err().to_string();
            assert!(error.contains(part), "{json}: {error}");
        }
    }
}
