//! Recorded exchanges with language models: one readable TOML file each.
//!
//! A conversation goes in with its answer, and comes out again for the same prompt and model, found by their hash,
//! which is the file's name. In a repair the answers so far are hashed too, but not what was said about them: a
//! newer donut may word its errors otherwise. [`Recorder`] writes what another model answers, [`Replayer`] needs no
//! network. Imports `llm`'s model types and `atomic`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::atomic;
use super::error::StoreError;
use crate::llm::model::{Completion, Message, Model, ModelError, Role};

/// Digits of the hash in a file's name: 64 bits, plenty for a directory of recordings.
const NAME_DIGITS: usize = 16;

/// Stands at the head of every file.
const HEAD: &str = "# An exchange with a language model, recorded by donut. It is found by its file name, which is the hash\n\
                    # of model and messages: the answer at the end may be edited, the rest may not.\n\n";

/// The file of an exchange.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Exchange {
    /// `PROVIDER:MODEL`.
    model: String,
    /// When it was recorded, for people.
    recorded: String,
    /// Version of donut.
    version: String,
    messages: Vec<Message>,
    answer: Completion,
}

/// What is wrong with a recording.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // The fields are what the messages say they are.
pub enum ExchangeError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error("{} is no recorded exchange: {reason}; remove it, or record it again with --llm record:DIR=PROVIDER:MODEL", path.display())]
    Format { path: PathBuf, reason: String },
    #[error("{} has no recorded exchange; record one with --llm record:{}=PROVIDER:MODEL", dir.display(), dir.display())]
    Nothing { dir: PathBuf },
    #[error(
        "{} has exchanges with {models}; say which model to replay: --llm replay:{}=PROVIDER:MODEL",
        dir.display(), dir.display()
    )]
    SeveralModels { dir: PathBuf, models: String },
    #[error(
        "{} has no answer of {model} to {what} ({name}): the task's line, the prompt or the model is \
         another; record it with --llm record:{}={model}", dir.display(), dir.display()
    )]
    NotRecorded { dir: PathBuf, model: String, what: &'static str, name: String },
    #[error("{} was edited: its model or messages are not those of its name; record it again", path.display())]
    Edited { path: PathBuf },
}

/// The name of the file for a conversation with a model.
pub fn file_name(model: &str, conversation: &[Message]) -> String {
    let mut hash = Sha256::new();
    for text in std::iter::once(model).chain(identity(conversation)) {
        // Lengths first, so that no two different lists of texts give the same bytes.
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text);
    }
    let digits: String = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{}.toml", &digits[..NAME_DIGITS])
}

/// The texts that tell a conversation from others: the prompt, and the answers to it so far.
fn identity(conversation: &[Message]) -> impl Iterator<Item = &str> {
    let answers = conversation.iter().skip(1).filter(|message| message.role == Role::Assistant);
    conversation.first().into_iter().chain(answers).map(|message| message.text.as_str())
}

fn read(path: &Path) -> Result<Exchange, ExchangeError> {
    let text = fs::read_to_string(path).map_err(StoreError::read(path))?;
    toml::from_str(&text).map_err(|error| ExchangeError::Format {
        path: path.to_owned(),
        reason: error.message().replace('\n', " "),
    })
}

impl From<ExchangeError> for ModelError {
    fn from(error: ExchangeError) -> Self {
        Self::Recording(Box::new(error))
    }
}

/// Asks another model, and writes down what it answers. An earlier answer to the same is replaced.
pub struct Recorder {
    dir: PathBuf,
    model: Box<dyn Model>,
}

impl Recorder {
    /// Records into `dir`, which is made if it is not there. A place that cannot be written is found now, not when
    /// an answer has been paid for.
    pub fn new(dir: &Path, model: Box<dyn Model>) -> Result<Self, StoreError> {
        fs::create_dir_all(dir).map_err(StoreError::write(dir))?;
        let probe = dir.join(format!(".probe-{}", std::process::id()));
        fs::write(&probe, "").and_then(|()| fs::remove_file(&probe)).map_err(StoreError::write(dir))?;
        Ok(Self { dir: dir.to_owned(), model })
    }
}

impl Model for Recorder {
    fn name(&self) -> String {
        self.model.name()
    }

    fn complete(&mut self, conversation: &[Message]) -> Result<Completion, ModelError> {
        let answer = self.model.complete(conversation)?;
        let exchange = Exchange {
            model: self.name(),
            recorded: httpdate::fmt_http_date(SystemTime::now()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            messages: conversation.to_vec(),
            answer: answer.clone(),
        };
        let path = self.dir.join(file_name(&exchange.model, conversation));
        let text = toml::to_string_pretty(&exchange)
            .map_err(|error| ExchangeError::Format { path: path.clone(), reason: error.to_string() })?;
        atomic::write(&path, format!("{HEAD}{text}").as_bytes()).map_err(ExchangeError::Store)?;
        Ok(answer)
    }
}

/// Answers from recordings.
#[derive(Debug)]
pub struct Replayer {
    dir: PathBuf,
    model: String,
}

impl Replayer {
    /// Replays what `model` (`PROVIDER:MODEL`) answered, or the only model there is in `dir`.
    pub fn new(dir: &Path, model: Option<String>) -> Result<Self, ExchangeError> {
        let dir = dir.to_owned();
        if let Some(model) = model {
            return Ok(Self { dir, model });
        }
        let mut models = BTreeSet::new();
        for entry in fs::read_dir(&dir).map_err(StoreError::read(&dir))? {
            let path = entry.map_err(StoreError::read(&dir))?.path();
            let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            if !hidden && path.extension().is_some_and(|e| e == "toml") {
                models.insert(read(&path)?.model);
            }
        }
        let mut found = models.iter().cloned();
        match (found.next(), found.next()) {
            (None, _) => Err(ExchangeError::Nothing { dir }),
            (Some(model), None) => Ok(Self { dir, model }),
            _ => {
                let models = models.into_iter().collect::<Vec<_>>().join(" and ");
                Err(ExchangeError::SeveralModels { dir, models })
            }
        }
    }

    fn find(&self, conversation: &[Message]) -> Result<Completion, ExchangeError> {
        let name = file_name(&self.model, conversation);
        let path = self.dir.join(&name);
        if !path.is_file() {
            let what = if conversation.len() == 1 { "this prompt" } else { "this repair" };
            let (dir, model) = (self.dir.clone(), self.model.clone());
            return Err(ExchangeError::NotRecorded { dir, model, what, name });
        }
        let exchange = read(&path)?;
        if exchange.model != self.model || !identity(&exchange.messages).eq(identity(conversation)) {
            return Err(ExchangeError::Edited { path });
        }
        Ok(exchange.answer)
    }
}

impl Model for Replayer {
    fn name(&self) -> String {
        self.model.clone()
    }

    fn complete(&mut self, conversation: &[Message]) -> Result<Completion, ModelError> {
        Ok(self.find(conversation)?)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Answers with the given text.
    struct Parrot(&'static str, Completion);

    impl Model for Parrot {
        fn name(&self) -> String {
            self.0.into()
        }

        fn complete(&mut self, _: &[Message]) -> Result<Completion, ModelError> {
            Ok(self.1.clone())
        }
    }

    fn said(text: &str) -> Completion {
        Completion { text: text.into(), input_tokens: Some(3), ..Completion::default() }
    }

    fn record(dir: &Path, model: &'static str, conversation: &[Message], answer: &Completion) {
        let mut recorder = Recorder::new(dir, Box::new(Parrot(model, answer.clone()))).unwrap();
        assert_eq!(&recorder.complete(conversation).unwrap(), answer);
    }

    fn replayed(dir: &Path, model: Option<&str>, conversation: &[Message]) -> Result<Completion, String> {
        let mut replayer = Replayer::new(dir, model.map(str::to_owned)).map_err(|error| error.to_string())?;
        replayer.complete(conversation).map_err(|error| error.to_string())
    }

    #[test]
    fn names_tell_models_prompts_and_answers_apart() {
        let repair = |answer, problem| {
            let conversation = [Message::user("b"), Message::assistant(answer), Message::user(problem)];
            file_name("a", &conversation)
        };
        let first = file_name("a", &[Message::user("b")]);
        let names = [
            first.clone(),
            file_name("ab", &[Message::user("")]),
            file_name("", &[Message::user("ab")]),
            repair("c", "wrong"),
            repair("", "wrong"),
        ];
        assert_eq!(BTreeSet::from(names.clone()).len(), names.len());
        assert_eq!(repair("c", "wrong"), repair("c", "worded otherwise"));
        // Names are on other people's disks: they stay.
        assert_eq!(first, "cf6ab613e3942391.toml");
    }

    #[test]
    fn an_exchange_is_found_again_and_readable() {
        let dir = tempfile::tempdir().unwrap();
        let asked = [Message::user("Make a donut.\nIt's \"round\".\n")];
        let answer = said("### Step 1: roll\n```python\nx = 'a\\n'\n```\n");
        record(&dir.path().join("new"), "p:one", &asked, &answer);
        let dir = dir.path().join("new");
        assert_eq!(replayed(&dir, None, &asked).unwrap(), answer);
        assert_eq!(replayed(&dir, Some("p:one"), &asked).unwrap(), answer);
        let names: Vec<_> = fs::read_dir(&dir).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(names, [file_name("p:one", &asked).as_str()]);
        let text = fs::read_to_string(dir.join(&names[0])).unwrap();
        for verbatim in [asked[0].text.as_str(), answer.text.as_str()] {
            assert!(text.contains(verbatim), "{text}");
        }
        let newer = said("another");
        record(&dir, "p:one", &asked, &newer);
        assert_eq!(replayed(&dir, None, &asked).unwrap(), newer);
    }

    #[test]
    fn what_is_not_there_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path();
        let asked = [Message::user("a")];
        let error = |model, asked: &[Message]| replayed(dir, model, asked).unwrap_err();
        assert!(error(None, &asked).contains("has no recorded exchange; record one"));
        record(dir, "p:one", &asked, &said("1"));
        assert!(error(None, &[Message::user("b")]).contains("no answer of p:one to this prompt"));
        assert!(error(Some("p:two"), &asked).contains("no answer of p:two"));
        record(dir, "p:two", &asked, &said("2"));
        assert!(error(None, &asked).contains("p:one and p:two"));
        assert_eq!(replayed(dir, Some("p:two"), &asked).unwrap().text, "2");
        let path = dir.join(file_name("p:one", &asked));
        fs::write(&path, fs::read_to_string(&path).unwrap().replace("text = \"a\"", "text = \"c\"")).unwrap();
        assert!(error(Some("p:one"), &asked).contains("was edited"));
        fs::write(&path, "model = 3").unwrap();
        assert!(error(Some("p:one"), &asked).contains("is no recorded exchange"));
        fs::write(dir.join("file"), "").unwrap();
        assert!(Recorder::new(&dir.join("file/below"), Box::new(Parrot("p:one", said("")))).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn every_text_comes_back_verbatim(prompt in any::<String>(), text in r#"[ -~\n\r\t'"\\]{0,40}"#) {
            let dir = tempfile::tempdir().unwrap();
            let asked = [Message::user(prompt), Message::assistant(text.as_str()), Message::user("?")];
            record(dir.path(), "p:m", &asked, &said(&text));
            prop_assert_eq!(replayed(dir.path(), None, &asked).unwrap().text, text);
        }
    }
}
