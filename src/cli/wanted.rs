//! What is to be made: a task by name or file, or a description in one line.
//!
//! The flags `--task` and `--describe` come in; the line for a language model goes out, and for an answer to it the
//! task with its stages, checked as a whole. Imports llm and task.

use anyhow::{Context, anyhow, bail, ensure};
use clap::Args;

use super::engine::{Engine, explained};
use crate::llm::AnswerError;
use crate::llm::prompt::Variant;
use crate::llm::recorded::{self, recorded, recorded_without_volume_reasoning};
use crate::llm::stage::Stage;
use crate::task::{Description, Scene, StageError, StagePlan, Target, TaskError, TaskSource};

/// Flags that say what is to be made.
#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
pub struct WantedArgs {
    /// A task's name (see `donut tasks`) or the path of a task file.
    #[arg(long, value_name = "NAME|FILE.toml")]
    pub task: Option<String>,
    /// A new task in one line: the dough and what to make of it, in units of your own.
    #[arg(long, value_name = "TEXT")]
    pub describe: Option<String>,
}

/// What is to be made.
pub enum Wanted {
    /// A task with a file.
    Task { source: TaskSource, scene: Box<Scene> },
    /// A line of text; its file follows from the answer.
    Described(Description),
}

/// A task with stages that fit it.
pub struct Planned {
    pub source: TaskSource,
    pub scene: Scene,
    pub stages: Vec<Stage>,
    /// What looks wrong in the answer but does not stop a plan.
    pub warnings: Vec<String>,
}

/// Why an answer cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum Unusable {
    #[error(transparent)]
    Answer(#[from] AnswerError),
    /// With the length of the model's unit, m.
    #[error("{error}")]
    Stages { error: StageError, unit_m: f64 },
    #[error(transparent)]
    Task(#[from] TaskError),
    /// What runs the code could not start.
    #[error("{0:#}")]
    Engine(anyhow::Error),
}

impl WantedArgs {
    /// Finds the task, or reads the description.
    pub fn find(&self) -> anyhow::Result<Wanted> {
        match (&self.task, &self.describe) {
            (Some(task), _) => {
                let source = TaskSource::find(task)?;
                let scene = Box::new(source.scene()?);
                Ok(Wanted::Task { source, scene })
            }
            (None, Some(text)) => Ok(Wanted::Described(Description::new(text)?)),
            (None, None) => bail!("give --task NAME or --describe TEXT"),
        }
    }
}

impl Wanted {
    /// What directories and reports call it.
    pub fn name(&self) -> String {
        match self {
            Self::Task { scene, .. } => scene.name.clone(),
            Self::Described(description) => description.name(),
        }
    }

    /// The line that a language model gets. Tasks with generated targets have none; `flag` is what asked for it.
    pub fn line(&self, flag: &str) -> anyhow::Result<&str> {
        match self {
            Self::Task { scene, .. } => {
                ensure!(
                    matches!(scene.target, Target::Stages { .. }),
                    "the task `{}` generates its target; {flag} is for tasks with [target.stages]",
                    scene.name
                );
                Ok(&scene.task_line)
            }
            Self::Described(description) => Ok(&description.text),
        }
    }

    /// The recorded answer number `index` to a prompt for this, and what to call it. `otherwise` says how an answer of
    /// one's own is given.
    pub fn recorded(
        &self,
        index: usize,
        variant: Variant,
        otherwise: &str,
    ) -> anyhow::Result<(&'static str, String)> {
        let set = match self {
            Self::Task { scene, .. } => {
                let Target::Stages { recorded_answers: Some(set), .. } = &scene.target else {
                    bail!(
                        "the task `{}` has no recorded answer; ask a model with --llm PROVIDER:MODEL, or give \
                         one of your own: {otherwise}",
                        scene.name
                    );
                };
                set.clone()
            }
            Self::Described(description) => recorded::set_of_line(&description.text).with_context(|| {
                format!(
                    "there is no recorded answer to this description; ask a model with --llm PROVIDER:MODEL, or give \
                     one of your own: {otherwise} (`donut prompt --describe TEXT` prints what to ask)"
                )
            })?,
        };
        let (text, kind) = match variant {
            Variant::Full => (recorded(&set, index), ""),
            Variant::WithoutVolumeReasoning => {
                (recorded_without_volume_reasoning(&set, index), " without volume reasoning")
            }
        };
        let text = text.with_context(|| {
            let count = recorded::count(&set, variant == Variant::Full);
            format!("the set `{set}` has no recorded answer {index}{kind}; --answer counts from 1, and there are {count}")
        })?;
        Ok((text, format!("recorded answer {index} of `{set}`{kind}")))
    }

    /// The task with the stages of an answer, if they fit it.
    pub fn planned(&self, engine: Engine, answer: &str) -> Result<Planned, Unusable> {
        let answer = engine.run(answer).map_err(Unusable::Engine)??;
        let (source, scene) = match self {
            Self::Task { source, scene } => (source.clone(), (**scene).clone()),
            Self::Described(description) => {
                let source = description.task(&answer.stages)?;
                let scene = source.scene()?;
                (source, scene)
            }
        };
        let frame = scene.frame();
        let plan = StagePlan::new(&answer.stages, &frame, &scene.world(scene.nominal_floor()))
            .map_err(|error| Unusable::Stages { error, unit_m: frame.unit_m })?;
        let mut warnings = answer.warnings;
        warnings.extend(plan.volume_warning(scene.dough.solid.volume()));
        Ok(Planned { source, scene, stages: answer.stages, warnings })
    }
}

impl Unusable {
    /// For a person who gave the answer, under a name.
    pub fn explained(&self, name: &str) -> anyhow::Error {
        match self {
            Self::Answer(error) => explained(name, error),
            other => anyhow!("{name}: {other}"),
        }
    }

    /// For the model that gave the answer: with the line at fault, since models cannot count lines.
    pub fn for_model(&self, answer: &str) -> String {
        let mut text = self.to_string();
        if let Self::Stages { error: StageError::OutsideWorkspace { .. }, unit_m } = self {
            text += &format!("\nOne of your units is {unit_m} m.");
        }
        if let Self::Answer(error) = self {
            if let AnswerError::Code { error, .. } = error
                && let Some(line) = error.line.checked_sub(1).and_then(|at| answer.lines().nth(at))
            {
                text += &format!("\nThat line is: {}", line.trim());
            }
            if let Some(hint) = error.hint() {
                text += &format!("\nHint: {hint}");
            }
        }
        text
    }
}
