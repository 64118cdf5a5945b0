//! Where an answer comes from: the flags about language models, and asking with a word on the terminal.
//!
//! Flags and the environment come in; a model goes out, and from it a usable answer with the conversation that led to
//! it. Keys are read here and nowhere else. Imports llm and store's recordings.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use clap::Args;
use tracing::{debug, info, warn};

use crate::llm::http::{Key, Patience, Pause};
use crate::llm::live::{LiveModel, ModelId, NoModelId, Provider, Settings};
use crate::llm::model::Model;
use crate::llm::prompt::Variant;
use crate::llm::repair::{self, Conversation, MAX_REPAIRS};
use crate::store::atomic;
use crate::store::exchange::{Recorder, Replayer};

/// One `--llm`.
#[derive(Clone, Debug, PartialEq)]
pub enum Llm {
    /// `openai:MODEL`, `anthropic:MODEL`.
    Live(ModelId),
    /// `record:DIR=PROVIDER:MODEL`, or `record:DIR` beside another `--llm`.
    Record(PathBuf, Option<ModelId>),
    /// `replay:DIR`, `replay:DIR=PROVIDER:MODEL`.
    Replay(PathBuf, Option<ModelId>),
}

impl FromStr for Llm {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let place = |rest: &str| {
            // Directories and models may have a `=` in their names: the one before a provider counts.
            let starts = Provider::ALL.map(|provider| rest.rfind(&format!("={}:", provider.name())));
            let split =
                starts.into_iter().flatten().find_map(|at| Some((&rest[..at], rest[at + 1..].parse().ok()?)));
            let (dir, id) = split.map_or((rest, None), |(dir, id)| (dir, Some(id)));
            if dir.is_empty() { Err("the directory is missing".to_owned()) } else { Ok((dir.into(), id)) }
        };
        if let Some(rest) = text.strip_prefix("record:") {
            return place(rest).map(|(dir, id)| Self::Record(dir, id));
        }
        if let Some(rest) = text.strip_prefix("replay:") {
            return place(rest).map(|(dir, id)| Self::Replay(dir, id));
        }
        text.parse()
            .map(Self::Live)
            .map_err(|error: NoModelId| format!("{error}, replay:DIR, or record:DIR=PROVIDER:MODEL"))
    }
}

/// Flags about language models.
#[derive(Args, Debug)]
#[command(next_help_heading = "Asking a language model")]
pub struct AskArgs {
    /// Ask a model: `openai:MODEL` (OpenAI's chat completions, which vLLM, llama.cpp, Ollama and OpenRouter speak
    /// too) or `anthropic:MODEL`. `record:DIR=PROVIDER:MODEL` also writes down what it answers, `replay:DIR` takes
    /// the answer from there. Keys come from OPENAI_API_KEY and ANTHROPIC_API_KEY.
    #[arg(long, value_name = "PROVIDER:MODEL")]
    pub llm: Vec<Llm>,
    /// Address of the model's server, such as http://127.0.0.1:11434/v1; otherwise that in OPENAI_BASE_URL or
    /// ANTHROPIC_BASE_URL, or the provider's own.
    #[arg(long, value_name = "URL", requires = "llm")]
    llm_url: Option<String>,
    /// How long to wait for an answer.
    #[arg(long, value_name = "SECONDS", default_value_t = 600, value_parser = clap::value_parser!(u64).range(1..=86_400))]
    llm_timeout: u64,
    /// The longest answer. If not given, the server's own limit, or 8192 for Anthropic, which wants one.
    #[arg(long, value_name = "TOKENS", requires = "llm", value_parser = clap::value_parser!(u32).range(1..))]
    llm_max_tokens: Option<u32>,
    /// Ask with the prompt that lacks the parts on volume and chain reasoning; without --llm, take an answer that
    /// was recorded to it.
    #[arg(long)]
    pub without_volume_reasoning: bool,
}

impl AskArgs {
    /// Which prompt to ask with.
    pub fn variant(&self) -> Variant {
        if self.without_volume_reasoning { Variant::WithoutVolumeReasoning } else { Variant::Full }
    }

    /// The model to ask, if one was named. Nothing is sent yet.
    pub fn model(&self) -> anyhow::Result<Option<Box<dyn Model>>> {
        let (mut live, mut record, mut replay) = (Vec::new(), Vec::new(), Vec::new());
        for llm in self.llm.clone() {
            match llm {
                Llm::Live(id) => live.push(id),
                Llm::Record(dir, id) => {
                    record.push(dir);
                    live.extend(id);
                }
                Llm::Replay(dir, id) => replay.push((dir, id)),
            }
        }
        match (&live[..], &record[..], &replay[..]) {
            ([], [], []) => Ok(None),
            ([], [], [(dir, id)]) => {
                Ok(Some(Box::new(Replayer::new(dir, id.as_ref().map(ToString::to_string))?)))
            }
            ([id], [], []) => Ok(Some(Box::new(self.live(id)?))),
            ([id], [dir], []) => Ok(Some(Box::new(Recorder::new(dir, Box::new(self.live(id)?))?))),
            ([], [dir], []) => bail!(
                "--llm record:{} says nothing about whom to ask; write --llm record:{}=PROVIDER:MODEL",
                dir.display(),
                dir.display()
            ),
            _ => bail!("these --llm do not go together; name one model, and at most one directory"),
        }
    }

    fn live(&self, id: &ModelId) -> anyhow::Result<LiveModel> {
        let variable = |name| std::env::var(name).ok().filter(|value| !value.trim().is_empty());
        let settings = Settings {
            id: id.clone(),
            url: self.llm_url.clone().or_else(|| variable(id.provider.url_variable())),
            key: variable(id.provider.key_variable()).as_deref().map(Key::new),
            max_tokens: self.llm_max_tokens,
            patience: Patience { answer: Duration::from_secs(self.llm_timeout), ..Patience::default() },
        };
        Ok(LiveModel::new(settings, Box::new(wait))?)
    }

    /// The flags as they were given, for the record of a run.
    pub fn command_line(&self) -> String {
        let mut line = String::new();
        for llm in &self.llm {
            line += &format!(" --llm {}", quoted(&llm.to_string()));
        }
        if let Some(url) = &self.llm_url {
            line += &format!(" --llm-url {}", quoted(url));
        }
        if let Some(tokens) = self.llm_max_tokens {
            line += &format!(" --llm-max-tokens {tokens}");
        }
        if self.without_volume_reasoning {
            line += " --without-volume-reasoning";
        }
        line
    }
}

impl std::fmt::Display for Llm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (word, dir, id) = match self {
            Self::Live(id) => return write!(f, "{id}"),
            Self::Record(dir, id) => ("record", dir, id),
            Self::Replay(dir, id) => ("replay", dir, id),
        };
        write!(f, "{word}:{}", dir.display())?;
        id.as_ref().map_or(Ok(()), |id| write!(f, "={id}"))
    }
}

/// A word of a shell's command line.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=@%+,".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Says why there is a wait, and waits.
fn wait(pause: &Pause) {
    let seconds = pause.wait.as_secs_f64();
    let (next, all) = (pause.attempt + 1, pause.attempts);
    warn!("{}; attempt {next} of {all} in {seconds:.0} s", pause.reason);
    std::thread::sleep(pause.wait);
}

/// Asks until `judge` accepts an answer, and says on the terminal how that goes. Where it comes to nothing, the
/// conversation is kept beside `out`: the answers may have cost something.
pub fn ask<T>(
    model: &mut dyn Model,
    prompt: String,
    judge: impl FnMut(&str) -> Result<T, String>,
    out: &Path,
) -> anyhow::Result<(T, Conversation)> {
    info!("asking {} ..", model.name());
    let observe = |conversation: &Conversation| {
        let number = conversation.attempts.len();
        let Some(attempt) = conversation.attempts.last() else { return };
        debug!("answer {number} has {} characters", attempt.answer.text.chars().count());
        if let Some(problem) = &attempt.problem {
            warn!("answer {number} cannot be used: {problem}");
            if number <= MAX_REPAIRS {
                info!("asking again ({number} of {MAX_REPAIRS}) ..");
            }
        }
    };
    let (conversation, made) = repair::ask(model, prompt, judge, observe);
    match made {
        Ok(made) => Ok((made, conversation)),
        Err(error) if conversation.attempts.is_empty() => Err(error.into()),
        Err(error) => {
            let kept = keep(&conversation, out)
                .with_context(|| format!("{error}; and what was said cannot be kept either"))?;
            Err(anyhow!("{error}\nwhat was said is in {}", kept.display()))
        }
    }
}

/// Writes the conversation to a file beside a run that did not come about.
fn keep(conversation: &Conversation, out: &Path) -> anyhow::Result<PathBuf> {
    let name = out.file_name().map_or_else(|| "run".into(), |name| name.to_string_lossy());
    let path = out.with_file_name(format!("{name}-conversation.txt"));
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent)?;
    }
    atomic::write(&path, conversation.to_text().as_bytes())?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(llm: &[&str]) -> AskArgs {
        AskArgs {
            llm: llm.iter().map(|text| text.parse().unwrap()).collect(),
            llm_url: Some("http://127.0.0.1:9".into()),
            llm_timeout: 1,
            llm_max_tokens: None,
            without_volume_reasoning: false,
        }
    }

    #[test]
    fn values_of_llm() {
        let id = || Some("openai:a=b".parse::<ModelId>().unwrap());
        for (text, meant) in [
            ("replay:some/dir", Llm::Replay("some/dir".into(), None)),
            ("replay:C:\\dir", Llm::Replay("C:\\dir".into(), None)),
            ("record:d=1=openai:a=b", Llm::Record("d=1".into(), id())),
            ("record:d=1=openai:m", Llm::Record("d=1".into(), "openai:m".parse().ok())),
            ("record:d=1", Llm::Record("d=1".into(), None)),
            ("openai:a=b", Llm::Live(id().unwrap())),
        ] {
            assert_eq!(text.parse(), Ok(meant), "{text}");
            assert_eq!(text.parse::<Llm>().unwrap().to_string(), text);
        }
        for text in ["record:", "replay:", "record:=openai:m", "gpt-4", "google:x"] {
            assert!(text.parse::<Llm>().is_err(), "{text}");
        }
    }

    #[test]
    fn values_that_go_together() {
        let dir = tempfile::tempdir().unwrap();
        let record = format!("record:{}", dir.path().join("new").display());
        let name = |llm: &[&str]| args(llm).model().map(|model| model.map(|m| m.name()));
        assert_eq!(name(&[]).unwrap(), None);
        assert_eq!(name(&["openai:m"]).unwrap().as_deref(), Some("openai:m"));
        for llm in [vec![format!("{record}=openai:m")], vec![record.clone(), "openai:m".into()]] {
            let llm: Vec<&str> = llm.iter().map(String::as_str).collect();
            assert_eq!(name(&llm).unwrap().as_deref(), Some("openai:m"));
        }
        assert_eq!(name(&["replay:d=anthropic:m"]).unwrap().as_deref(), Some("anthropic:m"));
        assert!(name(&[&record]).unwrap_err().to_string().contains("=PROVIDER:MODEL"));
        for llm in [vec!["openai:a", "openai:b"], vec!["openai:a", "replay:d=openai:a"]] {
            assert!(name(&llm).is_err(), "{llm:?}");
        }
    }

    #[test]
    fn words_of_a_shell() {
        assert_eq!(quoted("runs/a-1"), "runs/a-1");
        assert_eq!(quoted("It's 1"), r"'It'\''s 1'");
        assert_eq!(quoted(""), "''");
    }
}
