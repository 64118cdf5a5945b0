//! What a trial depends on besides its task, method and number; and a hash of all that.
//!
//! Flags come in; scenes, planning parameters and the hash that results carry go out. Imports task, plan and llm.

use serde_json::json;
use sha2::{Digest, Sha256};

use super::suite::{ANSWERS, Contender};
use crate::llm::prompt::Variant;
use crate::llm::recorded::{recorded, recorded_without_volume_reasoning};
use crate::plan::settings::{Effort, Method, SearchSettings};
use crate::sim::SimdLevel;
use crate::task::run::Planning;
use crate::task::{Overrides, Scene, TaskSource};

/// Hexadecimal digits of a hash: 64 bits.
const DIGITS: usize = 16;

/// The configuration of an experiment.
#[derive(Clone, Debug)]
pub struct Config {
    /// The first seed.
    pub seed: u64,
    pub effort: Effort,
    pub overrides: Overrides,
    /// Plain arrays round otherwise than vectors; vectors of all machines give the same bits.
    pub simd: SimdLevel,
}

impl Config {
    /// The scene of a task in the binary.
    pub fn scene(&self, task: &str) -> Scene {
        let mut scene = source(task).scene().expect("the tasks in the binary are valid");
        self.overrides.apply(&mut scene);
        scene
    }

    /// How a contender plans.
    pub fn planning(&self, contender: Contender) -> Planning {
        Planning { method: contender.method, search: SearchSettings::of(self.effort) }
    }

    /// The hash of everything that a trial of this task and contender is a function of, but for its number: two
    /// trials of one number and hash are the same trial.
    pub fn hash(&self, task: &str, contender: Contender) -> String {
        let searches = matches!(contender.method, Method::Donut | Method::DonutNoStages);
        let answers: Vec<_> = (1..=ANSWERS).map(|index| answer(task, contender.variant, index)).collect();
        let all = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "task": source(task).text,
            "method": contender.name(),
            "search": searches.then(|| SearchSettings::of(self.effort)),
            "overrides": self.overrides,
            "answers": answers,
            "seed": self.seed,
            "scalar": self.simd == SimdLevel::Scalar,
        });
        let digest = Sha256::digest(all.to_string().as_bytes());
        let hex: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        hex[..DIGITS].to_owned()
    }
}

/// A recorded answer, if the task has any.
pub(super) fn answer(task: &str, variant: Variant, index: usize) -> Option<&'static str> {
    match variant {
        Variant::Full => recorded(task, index),
        Variant::WithoutVolumeReasoning => recorded_without_volume_reasoning(task, index),
    }
}

fn source(task: &str) -> TaskSource {
    TaskSource::find(task).expect("the tasks of suites are in the binary")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_tells_apart_what_gives_other_trials_and_nothing_else() {
        let config = Config {
            seed: 0,
            effort: Effort::Normal,
            overrides: Overrides::default(),
            simd: SimdLevel::best(),
        };
        let of = |config: &Config, task, name| config.hash(task, Contender::named(name).unwrap());
        let hash = of(&config, "cut", "donut");
        assert_eq!((hash.len(), &hash), (DIGITS, &of(&config.clone(), "cut", "donut")));
        let changed = [
            Config { seed: 1, ..config.clone() },
            Config { effort: Effort::Quick, ..config.clone() },
            Config {
                overrides: Overrides { particles: Some(300), ..Overrides::default() },
                ..config.clone()
            },
            Config {
                overrides: Overrides { max_steps: Some(300), ..Overrides::default() },
                ..config.clone()
            },
        ];
        for other in &changed {
            assert_ne!(hash, of(other, "cut", "donut"), "{other:?}");
        }
        assert_ne!(hash, of(&config, "spread", "donut"));
        assert_ne!(hash, of(&config, "cut", "donut-no-stages"));
        // Algorithm 1 knows no effort.
        assert_eq!(of(&config, "cut", "paper"), of(&changed[1], "cut", "paper"));
    }
}
