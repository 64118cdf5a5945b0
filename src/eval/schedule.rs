//! Running many trials, some at once, in one process or several on one directory.
//!
//! Specs come in; trials that have no result yet are claimed, run and appended; what happens is told to an observer.
//! Imports this module's trials and results.

use std::path::PathBuf;
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::config::Config;
use super::results::{ResultsDir, ResultsError};
use super::targets::write_target;
use super::trial::{Spec, Trial};
use crate::sim::Options;
use crate::task::run::RunEvent;

/// Memory for gradients, all jobs together, bytes.
const MEMORY: usize = 4 << 30;

/// Trials to be run, and on what.
pub struct Schedule<'a> {
    pub specs: &'a [Spec],
    pub config: &'a Config,
    /// Where results go; they are only returned if there is none.
    pub dir: Option<&'a ResultsDir>,
    /// Trials at once.
    pub jobs: usize,
    /// Threads, shared by the jobs.
    pub threads: usize,
}

/// What happens.
#[derive(Debug)]
pub enum Event<'a> {
    Began {
        job: usize,
        spec: &'a Spec,
    },
    Moved {
        job: usize,
        spec: &'a Spec,
        event: &'a RunEvent<'a>,
    },
    Ended {
        job: usize,
        spec: &'a Spec,
        trial: &'a Trial,
    },
    /// Another process runs it, or has run it meanwhile.
    Elsewhere {
        spec: &'a Spec,
    },
}

impl Schedule<'_> {
    /// Runs them all. The results are in no particular order.
    ///
    /// # Errors
    /// The first that a result could not be written or read back for; no further trial is begun.
    pub fn run(&self, observe: &(dyn Fn(Event<'_>) + Sync)) -> Result<Vec<Trial>, ResultsError> {
        let next = AtomicUsize::new(0);
        let stop = AtomicBool::new(false);
        let outcome = Mutex::new(Ok(Vec::new()));
        let jobs = self.jobs.clamp(1, self.specs.len().max(1));
        let threads = (self.threads / jobs).max(1);
        let origin = Origin::find(threads, self.config.simd);
        std::thread::scope(|scope| {
            for job in 0..jobs {
                let (next, stop, outcome, origin) = (&next, &stop, &outcome, &origin);
                scope.spawn(move || {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                    let pool = pool.expect("threads can be started");
                    while !stop.load(Ordering::Relaxed) {
                        let Some(spec) = self.specs.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
                        let done = self.run_one(job, spec, jobs, threads, &pool, origin, observe);
                        let mut all = outcome.lock().expect("no job has panicked");
                        match (done, &mut *all) {
                            (Ok(trial), Ok(trials)) => trials.extend(trial),
                            (Err(error), Ok(_)) => {
                                stop.store(true, Ordering::Relaxed);
                                *all = Err(error);
                            }
                            (_, Err(_)) => {}
                        }
                    }
                });
            }
        });
        outcome.into_inner().expect("no job has panicked")
    }

    /// Runs a trial and writes its result, unless another process does.
    #[expect(clippy::too_many_arguments, reason = "what a job knows")]
    fn run_one(
        &self,
        job: usize,
        spec: &Spec,
        jobs: usize,
        threads: usize,
        pool: &rayon::ThreadPool,
        origin: &Origin,
        observe: &(dyn Fn(Event<'_>) + Sync),
    ) -> Result<Option<Trial>, ResultsError> {
        let claim = match self.dir {
            None => None,
            Some(dir) => {
                let Some(claim) = dir.claim_pending(spec)? else {
                    observe(Event::Elsewhere { spec });
                    return Ok(None);
                };
                Some(claim)
            }
        };
        observe(Event::Began { job, spec });
        let options =
            Options { threads, simd: self.config.simd, memory_limit: MEMORY / jobs, ..Options::default() };
        let (mut trial, clouds) = pool.install(|| {
            spec.run(self.config, &options, |event| observe(Event::Moved { job, spec, event: &event }))
        });
        (trial.build, trial.machine) = (origin.build.clone(), origin.machine.clone());
        if let Some(dir) = self.dir {
            if let Some(clouds) = &clouds {
                write_target(dir.path(), spec, clouds)?;
            }
            dir.append(&trial)?;
        }
        if let Some(claim) = claim {
            claim.settle();
        }
        observe(Event::Ended { job, spec, trial: &trial });
        Ok(Some(trial))
    }
}

/// What made a result.
struct Origin {
    build: String,
    machine: String,
}

impl Origin {
    fn find(threads: usize, simd: crate::sim::SimdLevel) -> Self {
        let mut build = env!("CARGO_PKG_VERSION").to_owned();
        match commit() {
            Some(commit) => build += &format!(" ({commit})"),
            None => tracing::warn!(
                "the results name no commit: this program lies in no checkout of git (`cargo run --release -- eval ..` does)"
            ),
        }
        let simd = format!("{simd:?}").to_lowercase();
        let s = if threads == 1 { "" } else { "s" };
        Self { build, machine: format!("{}, {threads} thread{s}, {simd}", processor()) }
    }
}

/// The commit of the checkout that the program lies in, if it does.
fn commit() -> Option<String> {
    let folder: PathBuf = std::env::current_exe().ok()?.parent()?.to_owned();
    let git = Command::new("git")
        .arg("-C")
        .arg(folder)
        .args(["describe", "--always", "--dirty", "--exclude=*", "--abbrev=12"])
        .output()
        .ok()?;
    let text = String::from_utf8(git.stdout).ok()?;
    (git.status.success() && !text.trim().is_empty()).then(|| text.trim().to_owned())
}

/// The processor's name.
fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}
