//! Suites: which tasks, how many trials, and what competes.
//!
//! Names as typed come in; checked suites and contenders go out. Imports llm's prompt variants and plan's methods.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::llm::prompt::Variant;
use crate::plan::settings::Method;

/// Recorded answers to each prompt.
pub const ANSWERS: usize = 4;
/// What a method's name ends in if its answers are those to the prompt without volume and chain reasoning.
const NO_VOLUME_REASONING: &str = "-no-volume-reasoning";

/// An experiment of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Suite {
    /// Spread, cut and arrange, 5 generated targets each.
    SingleTool,
    /// Donut, baguette and two pancakes, 4 recorded answers with 5 seeds each.
    MultiTool,
    /// The tasks of single-tool without DiffPhysics-P2P, initial position selection, or tool reset.
    SingleToolAblation,
    /// The tasks of multi-tool without a language model's subgoals, or without volume and chain reasoning in the prompt.
    MultiToolAblation,
    /// How much the volume of the goal differs from the dough's, with and without the prompt's guidelines.
    Volume,
}

impl Suite {
    /// What `--suite` and results call it.
    pub fn name(self) -> String {
        let value = self.to_possible_value().expect("no variant is skipped");
        value.get_name().to_owned()
    }

    /// Its tasks, in the order of the paper.
    pub fn tasks(self) -> &'static [&'static str] {
        match self {
            Self::SingleTool | Self::SingleToolAblation => &["spread", "cut", "arrange"],
            Self::MultiTool | Self::MultiToolAblation | Self::Volume => {
                &["donut", "baguette", "two-pancakes"]
            }
        }
    }

    /// Trials of each task and method in the paper's protocol.
    pub fn trials(self) -> usize {
        match self {
            Self::SingleTool | Self::SingleToolAblation => 5,
            Self::MultiTool | Self::MultiToolAblation => 20,
            Self::Volume => ANSWERS,
        }
    }

    /// What competes if nothing else is asked for.
    pub fn contenders(self) -> Vec<Contender> {
        let names: &[&str] = match self {
            Self::SingleTool | Self::MultiTool => &["donut"],
            Self::SingleToolAblation => &["paper-no-p2p", "paper-no-placement", "paper-no-reset", "paper"],
            Self::MultiToolAblation => &["paper-no-stages", "paper-no-volume-reasoning", "paper"],
            Self::Volume => &[],
        };
        names.iter().map(|name| Contender::named(name).expect("these names are right")).collect()
    }

    /// Whether its stages come from recorded answers, of which there are two kinds.
    pub fn has_answers(self) -> bool {
        matches!(self, Self::MultiTool | Self::MultiToolAblation)
    }
}

/// What competes in a suite: a planner, and the prompt whose recorded answers it gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contender {
    pub method: Method,
    pub variant: Variant,
}

impl Contender {
    /// The contender of that name.
    pub fn named(name: &str) -> Option<Self> {
        let (method, variant) = match name.strip_suffix(NO_VOLUME_REASONING) {
            Some(method) => (method, Variant::WithoutVolumeReasoning),
            None => (name, Variant::Full),
        };
        Method::named(method).map(|method| Self { method, variant })
    }

    /// What `--method` and results call it.
    pub fn name(&self) -> String {
        let suffix = if self.variant == Variant::Full { "" } else { NO_VOLUME_REASONING };
        self.method.name() + suffix
    }

    /// Whether it makes sense only where there are recorded answers.
    pub fn needs_answers(&self) -> bool {
        self.variant != Variant::Full
    }

    /// All contenders there can be, in the order of tables: ablations before the method they are of, as in the
    /// paper's figures.
    pub fn all() -> Vec<Self> {
        let names = [
            "diff-physics",
            "paper-no-p2p",
            "paper-no-placement",
            "paper-no-reset",
            "paper-no-stages",
            "paper-no-volume-reasoning",
            "paper",
            "donut-no-stages",
            "donut-no-volume-reasoning",
            "donut",
        ];
        names.iter().map(|name| Self::named(name).expect("these names are right")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_contenders_read_back() {
        for contender in Contender::all() {
            assert_eq!(Contender::named(&contender.name()), Some(contender));
        }
        for method in Method::value_variants() {
            assert!(Contender::all().iter().any(|c| c.method == *method), "{method:?} has no place");
        }
        assert_eq!(Contender::named("pasta"), None);
        assert_eq!(Contender::named("-no-volume-reasoning"), None);
    }

    #[test]
    fn the_protocol_is_the_papers() {
        assert_eq!((Suite::SingleTool.trials(), Suite::MultiTool.trials()), (5, 20));
        assert_eq!(Suite::MultiToolAblation.name(), "multi-tool-ablation");
        for suite in Suite::value_variants() {
            assert_eq!(serde_json::to_value(suite).unwrap(), suite.name());
        }
    }
}
