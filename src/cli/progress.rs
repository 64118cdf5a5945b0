//! The progress line of `donut plan` on standard error.
//!
//! Run events come in, a bar with stage, step, EMD and time left goes out; quiet when standard error is
//! not a terminal, apart from a line per stage. Imports task's events.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::task::run::RunEvent;

/// Ticks of a stage that uses all of its budget.
const TICKS: usize = 1000;

/// Draws a run's progress.
pub struct ProgressLine {
    bar: ProgressBar,
    max_steps: usize,
    stage: usize,
}

impl ProgressLine {
    /// A line for stages of at most `max_steps` control steps.
    pub fn new(max_steps: usize) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(4));
        let style = ProgressStyle::with_template("{prefix} {bar:24} {msg}, {eta} left")
            .expect("the template is a constant");
        bar.set_style(style);
        Self { bar, max_steps, stage: 0 }
    }

    /// Shows an event.
    pub fn show(&mut self, event: &RunEvent<'_>) {
        match event {
            RunEvent::Stage { index, count, tool, title } => {
                self.stage = *index;
                self.bar.set_length((count * TICKS) as u64);
                self.bar.set_position((index * TICKS) as u64);
                self.bar.set_prefix(format!("stage {}/{count} {tool}", index + 1));
                if self.bar.is_hidden() {
                    eprintln!("stage {}/{count}, {tool}: {title}", index + 1);
                }
            }
            RunEvent::Progress(p) => {
                // The segment that is being planned counts by how far its search is; a rejected one does not
                // move the bar on.
                let share = (p.step as f64 + p.searched * p.horizon as f64) / self.max_steps.max(1) as f64;
                let done = self.stage * TICKS + (share.min(1.0) * TICKS as f64) as usize;
                self.bar.set_position(done as u64);
                self.bar.set_message(format!(
                    "step {}/{}, EMD {:.4} m, {} resets",
                    p.step, self.max_steps, p.emd, p.resets
                ));
            }
            RunEvent::StageDone { index, run } => {
                self.bar.set_position(((index + 1) * TICKS) as u64);
                if self.bar.is_hidden() {
                    eprintln!("  EMD {:.4} -> {:.4} m, {}", run.emd_initial, run.emd_final, run.trace.stop);
                }
            }
        }
    }

    /// Takes the line away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
