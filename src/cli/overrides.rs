//! Flags that change the size of a task, shared by the commands that run tasks.
//!
//! Flags come in, [`Overrides`] go out. Imports task.

use clap::Args;

use crate::task::Overrides;

/// Sizes instead of the task file's.
#[derive(Args, Clone, Copy, Debug)]
pub struct OverrideArgs {
    /// Particles, instead of the task's number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(50..=200_000))]
    particles: Option<u32>,
    /// Gradient steps per horizon (J) of Algorithm 1, instead of the task's number.
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    iterations: Option<u32>,
    /// Control steps a stage may take, instead of the task's number.
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    max_steps: Option<u32>,
}

impl OverrideArgs {
    /// What they say.
    pub fn overrides(&self) -> Overrides {
        let size = |n: Option<u32>| n.map(|n| n as usize);
        Overrides {
            particles: size(self.particles),
            iterations: size(self.iterations),
            max_steps: size(self.max_steps),
        }
    }
}
