//! The paper's table of volume change: how much the volume of what an answer makes differs from the dough's.
//!
//! Recorded answers come in, with and without the prompt's two guidelines (preserve the volume; derive the
//! dimensions step by step); a trial for each and a row for each task and prompt go out. Imports llm, math, scenes.

use serde::{Deserialize, Serialize};

use super::scene::{Scene, Target};
use super::source::load_scene;
use crate::llm::lineage::last_clouds;
use crate::llm::recorded::{self, Recorded};
use crate::llm::stages_from_answer;

/// The tasks of the paper's table, and its changes of volume: with both guidelines, and without.
const PAPER: [(&str, f64, f64); 3] =
    [("donut", 0.098, 0.739), ("baguette", 0.389, 0.425), ("two-pancakes", 0.0, 0.650)];

/// One answer.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeTrial {
    pub task: &'static str,
    /// Whether the prompt had the two guidelines.
    pub guidelines: bool,
    /// Number of the answer, from 1.
    pub answer: usize,
    /// Volume of the dough that the task gives, in the model's unit cubed.
    pub dough: f64,
    /// Measured volume of all clouds that exist at the end, or why there is none.
    pub made: Result<f64, String>,
}

impl VolumeTrial {
    /// |made - dough| / dough.
    pub fn change(&self) -> Option<f64> {
        self.made.as_ref().ok().map(|made| (made - self.dough).abs() / self.dough)
    }
}

/// All answers to one task with one prompt.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VolumeRow {
    pub task: String,
    #[serde(rename = "method", with = "by_prompt_name")]
    pub guidelines: bool,
    pub trials: usize,
    /// Trials whose answer could not be run or followed.
    pub failed: usize,
    /// Mean and standard deviation (over the trials) of the relative change; not a number if all failed.
    #[serde(rename = "volume_change_mean")]
    pub change_mean: f64,
    #[serde(rename = "volume_change_std")]
    pub change_std: f64,
    /// What the paper prints.
    #[serde(rename = "paper_volume_change")]
    pub paper_change: f64,
}

/// Every recorded answer of the paper's tasks, in the order of the table.
pub fn volume_trials() -> Vec<VolumeTrial> {
    let mut trials = Vec::new();
    for (task, _, _) in PAPER {
        for guidelines in [false, true] {
            let answers = recorded::all().filter(|r| r.task == task && r.volume_reasoning == guidelines);
            trials.extend(answers.map(trial));
        }
    }
    trials
}

fn trial(answer: &Recorded) -> VolumeTrial {
    let scene = load_scene(answer.task).expect("the tasks in the binary are valid");
    let made = stages_from_answer(answer.text).map_err(|e| e.to_string()).and_then(|run| {
        let clouds = last_clouds(&run.stages).map_err(|e| e.to_string())?;
        Ok(clouds.iter().map(|cloud| cloud.measured_volume()).sum())
    });
    VolumeTrial {
        task: answer.task,
        guidelines: answer.volume_reasoning,
        answer: answer.index,
        dough: dough_volume(&scene),
        made,
    }
}

/// The volume of a task's dough in the language model's unit cubed.
fn dough_volume(scene: &Scene) -> f64 {
    let unit = match scene.target {
        Target::Stages { frame, .. } => frame.unit_m,
        Target::Generated { .. } => 1.0,
    };
    scene.dough.solid.volume() / unit.powi(3)
}

/// What results call a prompt.
pub fn prompt_name(guidelines: bool) -> &'static str {
    if guidelines { "full" } else { "without-volume-reasoning" }
}

/// A prompt by that name in JSON.
mod by_prompt_name {
    use serde::de::{Deserialize, Deserializer, Error};
    use serde::ser::Serializer;

    use super::prompt_name;

    pub fn serialize<S: Serializer>(guidelines: &bool, s: S) -> Result<S::Ok, S::Error> {
        s.serialize_str(prompt_name(*guidelines))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<bool, D::Error> {
        let name = String::deserialize(d)?;
        let found = [true, false].into_iter().find(|g| prompt_name(*g) == name);
        found.ok_or_else(|| D::Error::custom(format!("there is no prompt `{name}`")))
    }
}

/// The rows of the table that have trials.
pub fn volume_rows(trials: &[VolumeTrial]) -> Vec<VolumeRow> {
    let mut rows = Vec::new();
    for (task, with, without) in PAPER {
        for guidelines in [false, true] {
            let own: Vec<&VolumeTrial> =
                trials.iter().filter(|t| t.task == task && t.guidelines == guidelines).collect();
            if own.is_empty() {
                continue;
            }
            let changes: Vec<f64> = own.iter().filter_map(|t| t.change()).collect();
            let n = changes.len() as f64;
            let mean = changes.iter().sum::<f64>() / n;
            let variance = changes.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / n;
            rows.push(VolumeRow {
                task: task.to_owned(),
                guidelines,
                trials: own.len(),
                failed: own.len() - changes.len(),
                change_mean: mean,
                change_std: variance.sqrt(),
                paper_change: if guidelines { with } else { without },
            });
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_relative_to_the_dough_and_failures_are_counted() {
        let trial = |answer, made| VolumeTrial { task: "donut", guidelines: true, answer, dough: 4.0, made };
        let trials = [trial(1, Ok(5.0)), trial(2, Ok(2.0)), trial(3, Err("no".into()))];
        let row = &volume_rows(&trials)[0];
        assert_eq!((row.task.as_str(), row.guidelines, row.trials, row.failed), ("donut", true, 3, 1));
        assert_eq!((row.change_mean, row.change_std), (0.375, 0.125));
        assert_eq!(row.paper_change, 0.098);
    }

    #[test]
    fn the_dough_of_the_tasks_is_what_their_lines_say() {
        let ball = dough_volume(&load_scene("donut").unwrap());
        assert!((ball - 4.0 / 3.0 * std::f64::consts::PI).abs() < 1e-9);
        assert!((dough_volume(&load_scene("two-pancakes").unwrap()) - 0.16).abs() < 1e-12);
    }
}
