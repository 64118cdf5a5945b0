//! The rows of a suite's table, and `summary.json`.
//!
//! Trials come in, in any order; a row for each task and method goes out, in the order of the paper. Imports
//! statistics and the paper's figures.

use serde::{Deserialize, Serialize};

use super::paper::figure;
use super::statistics::{deviation, mean, mean_interval, rate_interval};
use super::suite::{Contender, Suite};
use super::trial::Trial;

/// How the intervals are computed, as results say it.
pub const INTERVALS: &str = "95 %: Student's t for mean scores, Wilson for success rates";

/// summary.json.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    pub suite: Suite,
    pub rows: Vec<Row>,
    /// How intervals and scores are computed.
    pub intervals: String,
    pub estimator: String,
    /// Versions of donut and machines that have made the trials.
    pub builds: Vec<String>,
    pub machines: Vec<String>,
}

/// One task with one method. Means are over all trials that have the number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub task: String,
    pub method: String,
    pub trials: usize,
    /// Trials that could not be run to an end; they count with a score of 0.
    pub failed: usize,
    pub threshold: f64,
    /// Normalised decrease of the exact EMD: mean, standard deviation (n - 1), 95 % interval of the mean.
    pub score_mean: f64,
    pub score_std: f64,
    pub score_low: Option<f64>,
    pub score_high: Option<f64>,
    /// What the paper prints.
    pub paper_score: Option<f64>,
    /// Share of trials over the threshold, and its 95 % interval.
    pub success_rate: f64,
    pub success_low: Option<f64>,
    pub success_high: Option<f64>,
    pub paper_success_rate: Option<f64>,
    /// What a second sample of the goals would score.
    pub score_ceiling_mean: Option<f64>,
    /// The score by the paper's estimator.
    pub score_sinkhorn_mean: Option<f64>,
    pub score_sinkhorn_std: Option<f64>,
    /// Share of trials that end with as many pieces as the goal has.
    pub pieces_as_goal_rate: Option<f64>,
    /// Free radius of holes as a share of the goal's, and the part of the dough that is in their middle; none where
    /// the goals have no hole.
    pub hole_radius_share_mean: Option<f64>,
    pub hole_radius_share_least: Option<f64>,
    pub membrane_mean: Option<f64>,
    pub steps_mean: f64,
    pub resets_mean: f64,
    /// Passes of the simulator.
    pub rollouts_mean: f64,
    pub gradient_iterations_mean: f64,
    /// Wall time of a trial, s.
    pub seconds_mean: f64,
}

impl Summary {
    /// The summary of a suite's trials.
    pub fn of(suite: Suite, trials: &[Trial]) -> Self {
        let mut rows = Vec::new();
        for task in suite.tasks() {
            for contender in Contender::all() {
                let name = contender.name();
                let own: Vec<&Trial> =
                    trials.iter().filter(|t| t.task == *task && t.method == name).collect();
                if !own.is_empty() {
                    rows.push(row(task, contender, &own));
                }
            }
        }
        let distinct = |of: fn(&Trial) -> &String| {
            let mut all: Vec<String> = trials.iter().map(|t| of(t).clone()).collect();
            all.sort();
            all.dedup();
            all
        };
        Self {
            suite,
            rows,
            intervals: INTERVALS.to_owned(),
            estimator: "exact assignment, all particles, settled dough".to_owned(),
            builds: distinct(|t| &t.build),
            machines: distinct(|t| &t.machine),
        }
    }
}

fn row(task: &str, contender: Contender, trials: &[&Trial]) -> Row {
    let all =
        |of: &dyn Fn(&Trial) -> Option<f64>| -> Vec<f64> { trials.iter().filter_map(|t| of(t)).collect() };
    let mean_of = |of: &dyn Fn(&Trial) -> Option<f64>| Some(mean(&all(of))).filter(|m| m.is_finite());
    let scores = all(&|t| Some(t.score));
    let sinkhorn = all(&|t| t.score_sinkhorn);
    let interval = mean_interval(&scores);
    let successes = trials.iter().filter(|t| t.success).count();
    let success_interval = rate_interval(successes, trials.len());
    let holes: Vec<_> = trials.iter().filter_map(|t| t.shape.as_ref()).flat_map(|s| &s.holes).collect();
    let radii: Vec<f64> = holes.iter().map(|h| h.radius / h.goal_radius).collect();
    let membranes: Vec<f64> = holes.iter().map(|h| h.membrane).collect();
    let some = |values: &[f64], value: f64| (!values.is_empty()).then_some(value);
    let figure = figure(task, contender);
    let count = |of: &dyn Fn(&Trial) -> f64| mean(&trials.iter().map(|t| of(t)).collect::<Vec<_>>());
    Row {
        task: task.to_owned(),
        method: contender.name(),
        trials: trials.len(),
        failed: trials.iter().filter(|t| t.error.is_some()).count(),
        threshold: trials[0].threshold,
        score_mean: mean(&scores),
        score_std: deviation(&scores),
        score_low: interval.map(|i| i[0]),
        score_high: interval.map(|i| i[1]),
        paper_score: figure.map(|f| f.score),
        success_rate: successes as f64 / trials.len() as f64,
        success_low: success_interval.map(|i| i[0]),
        success_high: success_interval.map(|i| i[1]),
        paper_success_rate: figure.map(|f| f.success_rate),
        score_ceiling_mean: mean_of(&|t| t.score_ceiling),
        score_sinkhorn_mean: some(&sinkhorn, mean(&sinkhorn)),
        score_sinkhorn_std: some(&sinkhorn, deviation(&sinkhorn)),
        pieces_as_goal_rate: mean_of(&|t| {
            t.shape.as_ref().map(|s| f64::from(u8::from(s.pieces == s.pieces_of_goal)))
        }),
        hole_radius_share_mean: some(&radii, mean(&radii)),
        hole_radius_share_least: some(&radii, radii.iter().copied().fold(f64::INFINITY, f64::min)),
        membrane_mean: some(&membranes, mean(&membranes)),
        steps_mean: count(&|t| t.steps as f64),
        resets_mean: count(&|t| t.resets as f64),
        rollouts_mean: count(&|t| t.rollouts as f64),
        gradient_iterations_mean: count(&|t| t.gradient_iterations as f64),
        seconds_mean: count(&|t| t.seconds),
    }
}
