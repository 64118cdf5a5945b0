//! Independent rollouts side by side, one simulator a thread.
//!
//! A list of jobs comes in, one result per job goes out, in order; which simulator ran which job changes
//! nothing. Imports rollout.

use std::cmp::Reverse;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::lanes::Real;
use super::options::Options;
use super::params::Params;
use super::rollout::Simulator;
use super::tool::Tool;

/// Simulators of one world, as many as threads.
pub struct Batch<T: Real> {
    simulators: Vec<Simulator<T>>,
    pool: Option<rayon::ThreadPool>,
}

impl<T: Real> Batch<T> {
    /// `options.threads` simulators with one thread each; they share the memory limit.
    pub fn new(params: &Params, tools: &[Tool], options: &Options) -> Self {
        let count = options.threads.max(1);
        let each = Options { threads: 1, memory_limit: options.memory_limit / count, ..options.clone() };
        let pool = (count > 1).then(|| {
            let builder = rayon::ThreadPoolBuilder::new().num_threads(count);
            builder.build().expect("threads can be started")
        });
        let one = || Simulator::new(params.clone(), tools.to_vec(), each.clone());
        Self { simulators: (0..count).map(|_| one()).collect(), pool }
    }

    /// Runs `work` once a job and returns its results in the order of the jobs. Those of the greatest `length` begin
    /// first, so that all threads end at about the same time.
    ///
    /// `work` gets a simulator that has run other jobs before: it must start with a rollout of its own. Then
    /// the results are, bit by bit, those of running the jobs one after the other.
    pub fn run<J: Sync, R: Send>(
        &mut self,
        jobs: &[J],
        length: impl Fn(&J) -> usize,
        work: impl Fn(&mut Simulator<T>, &J) -> R + Sync,
    ) -> Vec<R> {
        let Some(pool) = &self.pool else {
            return jobs.iter().map(|job| work(&mut self.simulators[0], job)).collect();
        };
        let mut order: Vec<usize> = (0..jobs.len()).collect();
        order.sort_by_key(|&k| Reverse(length(&jobs[k])));
        let next = AtomicUsize::new(0);
        let done = Mutex::new(Vec::with_capacity(jobs.len()));
        pool.scope(|scope| {
            for sim in &mut self.simulators {
                let (order, next, done, work) = (&order, &next, &done, &work);
                scope.spawn(move |_| {
                    // Jobs differ in length: whoever is free takes the next one.
                    while let Some(&k) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let result = work(sim, &jobs[k]);
                        done.lock().expect("no thread has panicked").push((k, result));
                    }
                });
            }
        });
        let mut done = done.into_inner().expect("no thread has panicked");
        done.sort_by_key(|(k, _)| *k);
        done.into_iter().map(|(_, result)| result).collect()
    }
}
