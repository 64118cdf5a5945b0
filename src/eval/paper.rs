//! What the paper and its poster print: mean scores and success rates.
//!
//! A task and a contender come in, the figure goes out if there is one. Imports suites.

use super::suite::Contender;
use crate::llm::prompt::Variant;
use crate::plan::settings::Method;

/// A figure of the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// Mean normalised decrease of the EMD, by GeomLoss's divergence.
    pub score: f64,
    /// Share of trials over the task's threshold.
    pub success_rate: f64,
}

/// Columns of the paper's table I, the full method and the baseline, and of its two ablation figures.
#[derive(Clone, Copy)]
enum Column {
    Full,
    DiffPhysics,
    NoP2p,
    NoPlacement,
    NoReset,
    NoStages,
    NoVolumeReasoning,
}

/// Task, column, score, success rate.
const FIGURES: [(&str, Column, f64, f64); 27] = [
    ("donut", Column::Full, 0.346, 0.75),
    ("baguette", Column::Full, 0.501, 0.75),
    ("two-pancakes", Column::Full, 0.858, 0.65),
    ("spread", Column::Full, 0.680, 1.0),
    ("cut", Column::Full, 0.685, 1.0),
    ("arrange", Column::Full, 0.981, 1.0),
    ("donut", Column::DiffPhysics, 0.141, 0.0),
    ("baguette", Column::DiffPhysics, 0.175, 0.2),
    ("two-pancakes", Column::DiffPhysics, 0.583, 0.0),
    ("spread", Column::DiffPhysics, 0.184, 0.2),
    ("cut", Column::DiffPhysics, 0.401, 0.6),
    ("arrange", Column::DiffPhysics, 0.296, 0.2),
    ("donut", Column::NoStages, 0.002, 0.0),
    ("baguette", Column::NoStages, -0.165, 0.0),
    ("two-pancakes", Column::NoStages, 0.001, 0.0),
    ("donut", Column::NoVolumeReasoning, 0.001, 0.0),
    ("baguette", Column::NoVolumeReasoning, 0.289, 0.25),
    ("two-pancakes", Column::NoVolumeReasoning, -0.001, 0.0),
    ("spread", Column::NoP2p, 0.260, 0.0),
    ("cut", Column::NoP2p, 0.150, 0.0),
    ("arrange", Column::NoP2p, 0.480, 0.2),
    ("spread", Column::NoPlacement, 0.589, 1.0),
    ("cut", Column::NoPlacement, 0.546, 1.0),
    ("arrange", Column::NoPlacement, 0.553, 0.4),
    ("spread", Column::NoReset, 0.647, 1.0),
    ("cut", Column::NoReset, 0.509, 0.8),
    ("arrange", Column::NoReset, 0.980, 1.0),
];

/// What the paper prints for this contender; methods of our own stand beside the paper's that have the same parts.
pub fn figure(task: &str, contender: Contender) -> Option<Figure> {
    let column = match (contender.method, contender.variant) {
        (Method::Donut | Method::Paper, Variant::Full) => Column::Full,
        (Method::Donut | Method::Paper, Variant::WithoutVolumeReasoning) => Column::NoVolumeReasoning,
        (_, Variant::WithoutVolumeReasoning) => return None,
        (Method::DonutNoStages | Method::PaperNoStages, _) => Column::NoStages,
        (Method::PaperNoP2p, _) => Column::NoP2p,
        (Method::PaperNoPlacement, _) => Column::NoPlacement,
        (Method::PaperNoReset, _) => Column::NoReset,
        (Method::DiffPhysics, _) => Column::DiffPhysics,
    };
    let same = |c: Column| c as usize == column as usize;
    let found = FIGURES.iter().find(|f| f.0 == task && same(f.1))?;
    Some(Figure { score: found.2, success_rate: found.3 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::suite::Suite;

    #[test]
    fn every_bar_of_the_papers_figures_has_its_value() {
        for suite in
            [Suite::SingleTool, Suite::MultiTool, Suite::SingleToolAblation, Suite::MultiToolAblation]
        {
            for task in suite.tasks() {
                for contender in suite.contenders() {
                    let figure = figure(task, contender);
                    assert!(figure.is_some(), "{task} {}", contender.name());
                }
            }
        }
        let of = |task, name| figure(task, Contender::named(name).unwrap()).map(|f| f.score);
        assert_eq!(of("baguette", "paper-no-volume-reasoning"), Some(0.289));
        assert_eq!(of("cut", "paper-no-stages"), None);
        assert_eq!(of("donut", "diff-physics-no-volume-reasoning"), None);
    }
}
