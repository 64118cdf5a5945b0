//! One trial: a pure function of its spec and configuration.
//!
//! A [`Spec`] comes in, a [`Trial`] with its scores and measures goes out; only its seconds differ from run to run
//! and machine to machine. Imports task, emd and llm.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::config::{Config, answer};
use super::suite::{ANSWERS, Contender, Suite};
use crate::emd::Measure;
use crate::emd::schedule::Settings;
use crate::emd::sinkhorn::divergence;
use crate::llm::stage::Stage;
use crate::llm::stages_from_answer;
use crate::math::cloud::Point;
use crate::sim::Options;
use crate::store::record::StageSummary;
use crate::task::Scene;
use crate::task::measures::ShapeMeasures;
use crate::task::run::{RunEvent, TaskRun, normalised_decrease, run_task};

/// Which trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Spec {
    pub suite: Suite,
    pub task: &'static str,
    pub contender: Contender,
    /// From 0, within the task and contender.
    pub index: usize,
    /// Seed of the run.
    pub seed: u64,
    pub source: Source,
    /// Hash of the configuration.
    pub config: String,
}

/// Where a trial's stages come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Recorded answer, from 1.
    Answer(usize),
    /// Generated target, from 0.
    Target(u64),
}

/// How a trial went: a line of results.jsonl. Lengths in m, times in s.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    pub suite: Suite,
    pub task: String,
    pub method: String,
    /// Number within the task and method, from 0.
    pub trial: usize,
    pub seed: u64,
    /// The recorded answer that the stages came from, from 1, or the generated target, from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<u64>,
    /// Hash of the configuration.
    pub config: String,
    /// Normalised decrease of the exact EMD to the goal; 0 for a trial that could not be run.
    pub score: f64,
    /// The same by the paper's estimator, the Sinkhorn divergence as GeomLoss computes it.
    pub score_sinkhorn: Option<f64>,
    /// What a second sample of the goal itself would score.
    pub score_ceiling: Option<f64>,
    pub threshold: f64,
    pub success: bool,
    pub emd_initial: Option<f64>,
    pub emd_final: Option<f64>,
    /// Control steps executed, and how often the tool was taken off and put down anew within a stage.
    pub steps: usize,
    pub resets: usize,
    /// Forward and backward passes of the simulator.
    pub rollouts: u64,
    pub gradient_iterations: u64,
    pub seconds: f64,
    pub particles: usize,
    /// Pieces and holes of the dough at the end, beside the goal's.
    pub shape: Option<ShapeMeasures>,
    pub stages: Vec<StageSummary>,
    /// Why there is no result, if there is none: an answer that cannot be used, a breakdown.
    pub error: Option<String>,
    /// The command that makes the same run with its report.
    pub command: String,
    /// Version of donut and, where it is known, the commit.
    pub build: String,
    /// Processor, threads and instructions.
    pub machine: String,
}

/// The clouds of a trial, m: the dough at the start, and where it should be.
#[derive(Clone, Debug, PartialEq)]
pub struct Clouds {
    pub initial: Vec<Point>,
    pub goal: Vec<Point>,
}

impl Spec {
    /// The trials of a suite: number after number, so that an experiment that is cut short has some of everything.
    pub fn all(
        suite: Suite,
        tasks: &[&'static str],
        contenders: &[Contender],
        trials: usize,
        config: &Config,
    ) -> Vec<Self> {
        let mut specs = Vec::new();
        for index in 0..trials {
            for &task in tasks {
                for &contender in contenders {
                    let (seed, source) = if suite.has_answers() {
                        let seed = config.seed + (index / ANSWERS) as u64;
                        (seed, Source::Answer(index % ANSWERS + 1))
                    } else {
                        (config.seed, Source::Target(index as u64))
                    };
                    let config = config.hash(task, contender);
                    specs.push(Self { suite, task, contender, index, seed, source, config });
                }
            }
        }
        specs
    }

    /// Whether a result is this trial's.
    pub fn is(&self, trial: &Trial) -> bool {
        (self.task, self.index) == (trial.task.as_str(), trial.trial) && self.contender.name() == trial.method
    }

    /// A name for files.
    pub fn name(&self) -> String {
        format!("{}-{}-{}", self.task, self.contender.name(), self.index)
    }

    fn stages(&self, scene: &Scene) -> Result<Vec<Stage>, String> {
        match self.source {
            Source::Target(index) => {
                scene.generated_stages(self.seed, index).ok_or_else(|| "the task has no targets".to_owned())
            }
            Source::Answer(index) => {
                let text = answer(self.task, self.contender.variant, index);
                let text = text.ok_or_else(|| format!("there is no recorded answer {index}"))?;
                stages_from_answer(text).map(|a| a.stages).map_err(|e| e.to_string())
            }
        }
    }

    fn command(&self, config: &Config) -> String {
        let mut line = format!("donut plan --task {} --seed {}", self.task, self.seed);
        match self.source {
            Source::Answer(index) => line += &format!(" --answer {index}"),
            Source::Target(index) => line += &format!(" --target {index}"),
        }
        if self.contender.variant != crate::llm::prompt::Variant::Full {
            line += " --without-volume-reasoning";
        }
        let effort = format!("{:?}", config.effort).to_lowercase();
        line + &format!(" --method {} --effort {effort}{}", self.contender.method.name(), config.overrides)
    }

    /// Runs the trial. Whatever goes wrong is part of the result.
    pub fn run(
        &self,
        config: &Config,
        options: &Options,
        observe: impl FnMut(RunEvent<'_>),
    ) -> (Trial, Option<Clouds>) {
        let begin = Instant::now();
        let scene = config.scene(self.task);
        let planning = config.planning(self.contender);
        let outcome = self.stages(&scene).and_then(|stages| {
            // One trial that breaks an assumption of the program must not end an experiment of a hundred.
            catch_unwind(AssertUnwindSafe(|| {
                run_task(&scene, &stages, &planning, self.seed, options, observe).map_err(|e| e.to_string())
            }))
            .unwrap_or_else(|panic| Err(format!("internal error: {}", message(&*panic))))
        });
        let mut trial = self.blank(config, &scene);
        let clouds = match outcome {
            Ok(run) => {
                trial.fill(&scene, &run);
                Some(Clouds { initial: run.initial, goal: run.goal })
            }
            Err(error) => {
                trial.error = Some(error);
                None
            }
        };
        trial.seconds = begin.elapsed().as_secs_f64();
        (trial, clouds)
    }

    /// The trial before anything has happened.
    fn blank(&self, config: &Config, scene: &Scene) -> Trial {
        let (answer, target) = match self.source {
            Source::Answer(index) => (Some(index), None),
            Source::Target(index) => (None, Some(index)),
        };
        Trial {
            suite: self.suite,
            task: self.task.to_owned(),
            method: self.contender.name(),
            trial: self.index,
            seed: self.seed,
            answer,
            target,
            config: self.config.clone(),
            score: 0.0,
            score_sinkhorn: None,
            score_ceiling: None,
            threshold: scene.threshold,
            success: false,
            emd_initial: None,
            emd_final: None,
            steps: 0,
            resets: 0,
            rollouts: 0,
            gradient_iterations: 0,
            seconds: 0.0,
            particles: scene.dough.particles,
            shape: None,
            stages: Vec::new(),
            error: None,
            command: self.command(config),
            build: String::new(),
            machine: String::new(),
        }
    }
}

impl Trial {
    fn fill(&mut self, scene: &Scene, run: &TaskRun) {
        self.score = run.score();
        self.score_sinkhorn = sinkhorn_score(run);
        self.score_ceiling = Some(run.ceiling());
        self.success = self.score >= scene.threshold;
        (self.emd_initial, self.emd_final) = (Some(run.emd_initial), Some(run.emd_final));
        self.steps = run.stages.iter().map(|s| s.trace.steps).sum();
        self.resets = run.stages.iter().map(|s| s.trace.resets).sum();
        self.rollouts = run.stages.iter().map(|s| s.work.rollouts).sum();
        self.gradient_iterations = run.stages.iter().map(|s| s.work.gradients).sum();
        self.shape = Some(run.shape.clone());
        self.stages = run.stages.iter().map(|stage| StageSummary::of(scene, stage)).collect();
    }

    /// Whether two results are the same trial's and differ in nothing that a trial is a function of: times, machines
    /// and builds may differ.
    pub fn same_outcome(&self, other: &Self) -> bool {
        let bare = |trial: &Self| {
            let mut bare = trial.clone();
            bare.seconds = 0.0;
            (bare.build, bare.machine) = (String::new(), String::new());
            bare.stages.iter_mut().for_each(|stage| stage.seconds = 0.0);
            bare
        };
        bare(self) == bare(other)
    }
}

/// The paper's score by its own estimator; none where that does not give a finite number.
fn sinkhorn_score(run: &TaskRun) -> Option<f64> {
    let to_goal = |cloud: &[Point]| {
        let found =
            divergence::<f32>(Measure::uniform(cloud), Measure::uniform(&run.goal), &Settings::default());
        found.ok().map(|d| d.value).filter(|v| v.is_finite())
    };
    Some(normalised_decrease(to_goal(&run.initial)?, to_goal(&run.last)?))
}

/// What a panic said.
fn message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned())
}
