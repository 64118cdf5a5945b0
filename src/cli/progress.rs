//! The progress line of `donut plan` on standard error, what `-v` says beside it, and bars that count.
//!
//! Run events come in, a bar with stage, step, EMD, resets and time left goes out; nothing where standard error is
//! not a terminal or with `-q`. Imports task's events.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use tracing::{debug, info};

use super::log::is_quiet;
use crate::plan::Progress;
use crate::task::run::{RunEvent, StageRun};

/// Ticks of a run.
const TICKS: f64 = 1000.0;

/// How much of a run is done.
#[derive(Clone, Copy, Debug)]
pub struct RunShare {
    max_steps: usize,
    stage: usize,
    stages: usize,
    /// Of the stage.
    done: f64,
}

impl RunShare {
    /// Of a run of stages of at most `max_steps` control steps.
    pub fn new(max_steps: usize) -> Self {
        Self { max_steps, stage: 0, stages: 1, done: 0.0 }
    }

    /// Takes note of an event.
    pub fn hear(&mut self, event: &RunEvent<'_>) {
        match event {
            RunEvent::Stage { index, count, .. } => {
                (self.stage, self.stages, self.done) = (*index, *count, 0.0)
            }
            RunEvent::Progress(p) => {
                // The segment that is being planned counts by how far its search is; a rejected one does not
                // move the bar on.
                let steps = p.step as f64 + p.searched * p.horizon as f64;
                self.done = (steps / self.max_steps.max(1) as f64).min(1.0);
            }
            RunEvent::StageDone { .. } => self.done = 1.0,
        }
    }

    /// From 0 to 1.
    pub fn value(&self) -> f64 {
        (self.stage as f64 + self.done) / self.stages.max(1) as f64
    }
}

/// Where bars are drawn.
fn target() -> ProgressDrawTarget {
    if is_quiet() { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(4) }
}

/// A bar that counts `things`; it begins to show once it knows how many there are.
pub fn counting(things: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix} {pos}/{len} {bar:24} {eta} left")
        .expect("the template is a constant");
    ProgressBar::with_draw_target(None, target()).with_style(style).with_prefix(things)
}

/// Draws a run's progress.
pub struct ProgressLine {
    bar: ProgressBar,
    max_steps: usize,
    /// EMD at the start of the stage, m.
    before: Option<f64>,
    share: RunShare,
}

impl ProgressLine {
    /// A line for stages of at most `max_steps` control steps.
    pub fn new(max_steps: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(TICKS as u64), target());
        let style = ProgressStyle::with_template("{prefix} {bar:24} {msg}, {eta} left")
            .expect("the template is a constant");
        bar.set_style(style);
        Self { bar, max_steps, before: None, share: RunShare::new(max_steps) }
    }

    /// Shows an event.
    pub fn show(&mut self, event: &RunEvent<'_>) {
        self.share.hear(event);
        self.bar.set_position((self.share.value() * TICKS) as u64);
        match event {
            RunEvent::Stage { index, count, tool, title } => {
                self.before = None;
                self.bar.set_prefix(format!("stage {}/{count} {tool}", index + 1));
                self.bar.suspend(|| info!("stage {}/{count}, {tool}: {title}", index + 1));
            }
            RunEvent::Progress(p) => {
                let before = *self.before.get_or_insert(p.emd);
                self.bar.set_message(message(p, before, self.max_steps));
            }
            RunEvent::StageDone { run, .. } => {
                self.bar.suspend(|| log_stage(run));
            }
        }
    }

    /// Takes the line away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Where a stage is.
fn message(p: &Progress, before: f64, max_steps: usize) -> String {
    let resets = if p.resets == 1 { "1 reset".to_owned() } else { format!("{} resets", p.resets) };
    format!("step {}/{max_steps}, EMD {before:.4} -> {:.4} m, {resets}", p.step, p.emd)
}

/// How a stage went, try by try.
fn log_stage(run: &StageRun) {
    for (number, s) in run.trace.segments.iter().enumerate() {
        let start = if s.placed { "a new start" } else { "where the tool was" };
        let kept = if s.accepted { "kept" } else { "not kept" };
        debug!(
            "  try {}: {} control steps from {start}, EMD {:.4} -> {:.4} m, {kept}",
            number + 1,
            s.horizon.actions.len(),
            s.emd_before,
            s.emd_after
        );
    }
    info!(
        "  EMD {:.4} -> {:.4} m in {} control steps and {:.0} s: {}",
        run.emd_initial, run.emd_final, run.trace.steps, run.seconds, run.trace.stop
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_has_step_emd_before_and_now_and_resets() {
        let p = Progress { step: 40, searched: 0.5, horizon: 40, emd: 0.01234, resets: 1 };
        assert_eq!(message(&p, 0.05, 200), "step 40/200, EMD 0.0500 -> 0.0123 m, 1 reset");
        assert!(message(&Progress { resets: 0, ..p }, 0.05, 200).ends_with("0 resets"));
    }
}
