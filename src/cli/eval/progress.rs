//! The progress of an experiment on standard error: trials done, what is being run, time left.
//!
//! Events of a schedule come in, a bar goes out; a line for each trial where standard error is not a terminal.
//! Imports eval.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::progress::RunShare;
use crate::eval::schedule::Event;
use crate::eval::{Config, Spec, Trial};

/// Ticks of a trial.
const TICKS: f64 = 1000.0;

/// Draws an experiment's progress.
pub struct Progress {
    bar: ProgressBar,
    begin: Instant,
    state: Mutex<State>,
    trials: usize,
    max_steps: usize,
}

/// Trials that are over, and how far the running ones are.
#[derive(Default)]
struct State {
    over: usize,
    running: Vec<Option<Running>>,
}

struct Running {
    name: String,
    share: RunShare,
}

impl Progress {
    /// A bar for these trials.
    pub fn new(specs: &[Spec], config: &Config) -> Self {
        let bar = ProgressBar::with_draw_target(
            Some(specs.len() as u64 * TICKS as u64),
            ProgressDrawTarget::stderr_with_hz(2),
        );
        let style =
            ProgressStyle::with_template("{prefix} {bar:24} {msg}").expect("the template is a constant");
        bar.set_style(style);
        let max_steps = specs.first().map_or(1, |spec| config.scene(spec.task).planner.max_steps);
        Self { bar, begin: Instant::now(), state: Mutex::default(), trials: specs.len(), max_steps }
    }

    /// Shows an event.
    pub fn show(&self, event: &Event<'_>) {
        let mut state = self.state.lock().expect("no job has panicked");
        match event {
            Event::Began { job, spec } => {
                if state.running.len() <= *job {
                    state.running.resize_with(job + 1, || None);
                }
                state.running[*job] =
                    Some(Running { name: spec.name(), share: RunShare::new(self.max_steps) });
            }
            Event::Moved { job, event, .. } => {
                if let Some(Some(running)) = state.running.get_mut(*job) {
                    running.share.hear(event);
                }
            }
            Event::Ended { job, spec, trial } => {
                state.over += 1;
                if let Some(slot) = state.running.get_mut(*job) {
                    *slot = None;
                }
                self.say(&format!("{} {}, {}", spec.name(), outcome(trial), self.count(&state)));
            }
            Event::Elsewhere { spec } => {
                state.over += 1;
                self.say(&format!("{} is another process's, {}", spec.name(), self.count(&state)));
            }
        }
        let names: Vec<&str> = state.running.iter().flatten().map(|r| r.name.as_str()).collect();
        self.bar.set_position((self.done(&state) * TICKS) as u64);
        self.bar.set_prefix(format!("{}/{}", state.over, self.trials));
        self.bar.set_message(format!("{}{}", names.join(", "), self.left(&state)));
    }

    /// A line that stays: above the bar, or where there is none.
    fn say(&self, line: &str) {
        if self.bar.is_hidden() {
            eprintln!("{line}");
        } else {
            self.bar.println(line);
        }
    }

    /// Trials, parts of trials included.
    fn done(&self, state: &State) -> f64 {
        state.over as f64 + state.running.iter().flatten().map(|r| r.share.value()).sum::<f64>()
    }

    fn count(&self, state: &State) -> String {
        format!("{}/{}{}", state.over, self.trials, self.left(state))
    }

    /// Time left, as long as there is something to judge by.
    fn left(&self, state: &State) -> String {
        let done = self.done(state);
        let left = self.trials as f64 - done;
        if done < 0.1 || left <= 0.0 {
            return String::new();
        }
        let seconds = self.begin.elapsed().as_secs_f64() * left / done;
        format!(", about {} left", HumanDuration(Duration::from_secs_f64(seconds)))
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

fn outcome(trial: &Trial) -> String {
    match &trial.error {
        Some(error) => format!("failed: {error}"),
        None => format!("score {:.3} in {:.0} s", trial.score, trial.seconds),
    }
}
