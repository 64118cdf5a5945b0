//! Live language models: a provider, a model's name, an address and perhaps a key make a [`Model`].
//!
//! Settings come in; a [`LiveModel`] goes out, which asks over [`super::http`] in the words of [`super::openai`] or
//! [`super::anthropic`]. Nothing here reads the environment. Imports those and `model`.

use std::fmt;
use std::str::FromStr;

use reqwest::Url;

use super::http::{Http, Key, Patience, Waiter};
use super::model::{Completion, Message, Model, ModelError};
use super::{anthropic, openai};

/// Whose language a server speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Provider {
    /// Chat completions, OpenAI's and everybody's.
    OpenAi,
    /// Messages.
    Anthropic,
}

impl Provider {
    /// All there are.
    pub const ALL: [Self; 2] = [Self::OpenAi, Self::Anthropic];

    /// The word before the colon.
    pub fn name(self) -> &'static str {
        match self {
            Self::OpenAi => "openai",
            Self::Anthropic => "anthropic",
        }
    }

    /// The environment variable that holds the key.
    pub fn key_variable(self) -> &'static str {
        match self {
            Self::OpenAi => "OPENAI_API_KEY",
            Self::Anthropic => "ANTHROPIC_API_KEY",
        }
    }

    /// The environment variable that may hold another address.
    pub fn url_variable(self) -> &'static str {
        match self {
            Self::OpenAi => "OPENAI_BASE_URL",
            Self::Anthropic => "ANTHROPIC_BASE_URL",
        }
    }

    /// The provider's own address.
    fn own_url(self) -> &'static str {
        match self {
            Self::OpenAi => "https://api.openai.com/v1",
            Self::Anthropic => "https://api.anthropic.com/v1",
        }
    }

    /// What is called below the address.
    fn call(self) -> &'static str {
        match self {
            Self::OpenAi => "/chat/completions",
            Self::Anthropic => "/messages",
        }
    }
}

/// A model of a provider, written `PROVIDER:MODEL`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelId {
    /// Whose language its server speaks.
    pub provider: Provider,
    /// What the server calls it.
    pub model: String,
}

impl fmt::Display for ModelId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.provider.name(), self.model)
    }
}

/// Not a `PROVIDER:MODEL`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no PROVIDER:MODEL; write openai:MODEL or anthropic:MODEL")]
pub struct NoModelId(String);

impl FromStr for ModelId {
    type Err = NoModelId;

    fn from_str(text: &str) -> Result<Self, NoModelId> {
        let found = Provider::ALL.into_iter().find_map(|provider| {
            let model = text.strip_prefix(provider.name())?.strip_prefix(':')?.trim();
            (!model.is_empty()).then(|| Self { provider, model: model.to_owned() })
        });
        found.ok_or_else(|| NoModelId(text.to_owned()))
    }
}

/// What a live model is made from.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Which model.
    pub id: ModelId,
    /// Another address than the provider's own.
    pub url: Option<String>,
    /// The key; servers other than the provider's own may need none.
    pub key: Option<Key>,
    /// The longest answer, in tokens, where it should not be the default.
    pub max_tokens: Option<u32>,
    /// How long and how often to wait.
    pub patience: Patience,
}

/// A model behind an HTTP server.
pub struct LiveModel {
    id: ModelId,
    max_tokens: Option<u32>,
    /// Whether the server is OpenAI's own.
    is_openai: bool,
    http: Http,
}

impl LiveModel {
    /// Checks the settings; nothing is sent yet. `waiter` waits between attempts.
    pub fn new(settings: Settings, waiter: Waiter) -> Result<Self, ModelError> {
        let Settings { id, url, key, max_tokens, patience } = settings;
        let provider = id.provider;
        let base = base_url(url.as_deref().unwrap_or(provider.own_url()))?;
        let is_own = base.host_str() == base_url(provider.own_url())?.host_str();
        let variable = provider.key_variable();
        if is_own && key.is_none() {
            let server = base.host_str().unwrap_or_default().to_owned();
            return Err(ModelError::MissingKey { variable, server });
        }
        let mut http = Http::new(call_url(base, provider.call()), patience, waiter)?;
        if provider == Provider::Anthropic {
            http = http.header("anthropic-version", anthropic::VERSION);
        }
        if let Some(key) = key {
            http = match provider {
                Provider::OpenAi => http.key("authorization", "Bearer ", key, variable)?,
                Provider::Anthropic => http.key("x-api-key", "", key, variable)?,
            };
        }
        Ok(Self { is_openai: provider == Provider::OpenAi && is_own, id, max_tokens, http })
    }
}

impl Model for LiveModel {
    fn name(&self) -> String {
        self.id.to_string()
    }

    fn complete(&mut self, conversation: &[Message]) -> Result<Completion, ModelError> {
        let ModelId { provider, model } = &self.id;
        let body = match provider {
            Provider::OpenAi => openai::request(model, conversation, self.max_tokens, self.is_openai),
            Provider::Anthropic => anthropic::request(model, conversation, self.max_tokens),
        };
        let url = self.http.shown_url();
        let refused = |status, said| match status {
            401 | 403 => {
                ModelError::KeyRefused { url: url.clone(), status, said, variable: provider.key_variable() }
            }
            404 => ModelError::NotFound { url: url.clone(), status, model: model.clone(), said },
            _ => ModelError::Refused { url: url.clone(), status, said },
        };
        let json = self.http.post(&body, refused)?;
        match provider {
            Provider::OpenAi => openai::completion(&json, url),
            Provider::Anthropic => anthropic::completion(&json, url),
        }
    }
}

/// The address that somebody typed, checked. Without a path it gets `/v1`, which all these servers have.
fn base_url(typed: &str) -> Result<Url, ModelError> {
    let bad = |reason: &str| ModelError::BadUrl { url: typed.to_owned(), reason: reason.to_owned() };
    let mut url = Url::parse(typed.trim()).map_err(|error| bad(&error.to_string()))?;
    if !url.username().is_empty() || url.password().is_some() {
        // Not repeated: it holds a secret.
        let url = "..@..".to_owned();
        return Err(ModelError::BadUrl { url, reason: "keys come from the environment alone".into() });
    }
    if !matches!(url.scheme(), "http" | "https") || !url.has_host() {
        return Err(bad("it begins with neither http:// nor https://"));
    }
    let path = url.path().trim_end_matches('/').to_owned();
    url.set_path(if path.is_empty() { "/v1" } else { &path });
    url.set_fragment(None);
    Ok(url)
}

/// The address of a call, unless the base is that already.
fn call_url(mut base: Url, call: &str) -> Url {
    if !base.path().ends_with(call) {
        base.set_path(&format!("{}{call}", base.path()));
    }
    base
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(id: &str, url: Option<&str>, key: Option<&str>) -> Settings {
        Settings {
            id: id.parse().unwrap(),
            url: url.map(str::to_owned),
            key: key.map(Key::new),
            max_tokens: None,
            patience: Patience::default(),
        }
    }

    fn called(id: &str, url: Option<&str>) -> String {
        let model = LiveModel::new(settings(id, url, Some("k")), super::super::http::sleep());
        model.unwrap().http.shown_url()
    }

    #[test]
    fn model_ids() {
        let id: ModelId = "openai:meta/llama-3:8b".parse().unwrap();
        assert_eq!((id.provider, id.model.as_str()), (Provider::OpenAi, "meta/llama-3:8b"));
        assert_eq!(id.to_string(), "openai:meta/llama-3:8b");
        for text in ["gpt", "openai", "openai:", "openai: ", "google:x", ""] {
            assert!(text.parse::<ModelId>().is_err(), "{text}");
        }
    }

    #[test]
    fn addresses_as_people_type_them() {
        assert_eq!(called("openai:m", None), "https://api.openai.com/v1/chat/completions");
        assert_eq!(called("anthropic:m", None), "https://api.anthropic.com/v1/messages");
        for typed in [
            "http://localhost:1",
            "http://localhost:1/",
            "http://localhost:1/v1",
            "http://localhost:1/v1/",
            "http://localhost:1/v1/chat/completions",
        ] {
            assert_eq!(called("openai:m", Some(typed)), "http://localhost:1/v1/chat/completions", "{typed}");
        }
        let deep = called("openai:m", Some("https://openrouter.ai/api/v1"));
        assert_eq!(deep, "https://openrouter.ai/api/v1/chat/completions");
        assert_eq!(called("anthropic:m", Some("http://[::1]:4")), "http://[::1]:4/v1/messages");
    }

    #[test]
    fn bad_addresses_and_keys_are_found_before_anything_is_sent() {
        let error = |s: Settings| match LiveModel::new(s, super::super::http::sleep()) {
            Ok(_) => panic!("this should not work"),
            Err(error) => error.to_string(),
        };
        let missing = error(settings("openai:m", None, None));
        assert!(missing.contains("OPENAI_API_KEY") && missing.contains("api.openai.com"), "{missing}");
        let missing = error(settings("anthropic:m", None, None));
        assert!(missing.contains("ANTHROPIC_API_KEY") && missing.contains("--llm-url"), "{missing}");
        let bad_key = error(settings("openai:m", None, Some("sk-\n1")));
        assert!(bad_key.contains("OPENAI_API_KEY") && !bad_key.contains("sk-"), "{bad_key}");
        for typed in ["localhost:8000", "ftp://localhost", "nonsense", ""] {
            assert!(error(settings("openai:m", Some(typed), None)).contains("--llm-url"), "{typed}");
        }
        let secret = error(settings("openai:m", Some("http://me:word@localhost"), None));
        assert!(!secret.contains("word") && secret.contains("environment"), "{secret}");
        // A server of one's own needs no key.
        assert!(
            LiveModel::new(
                settings("openai:m", Some("http://127.0.0.1:1"), None),
                super::super::http::sleep()
            )
            .is_ok()
        );
    }
}
