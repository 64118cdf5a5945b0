//! Ablations: which parts of a method take part.
//!
//! A [`Method`] comes in, its [`Switches`] go out; whoever owns a part asks for its switch in one place. Imports
//! settings.

use super::settings::{Method, PlannerSettings};

/// The parts of the paper's method that its ablations take away, one each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switches {
    /// DiffPhysics-P2P: the loss pulls each particle to its own next reachable place (lines 3 to 7 and 15 of
    /// Algorithm 1). Without: the EMD to the subgoal, anew at every gradient iteration.
    pub p2p: bool,
    /// Initial position selection (line 9). Without: over the dough at the rest pose's x and z.
    pub placement: bool,
    /// Tool reset (lines 19 to 22). Without: every segment is kept, and the tool goes on from where it is.
    pub reset: bool,
    /// Segments of L control steps, planned from what came of those before. Without: one segment that is as long
    /// as the stage.
    pub closed_loop: bool,
    /// The language model's subgoals. Without: the last goal for every stage, with all particles.
    pub stages: bool,
}

impl Switches {
    const ALL: Self = Self { p2p: true, placement: true, reset: true, closed_loop: true, stages: true };

    /// The planner's settings with which the open loop is one segment, and with which nothing but the end of a
    /// stage puts the tool at a new start where there is no reset.
    pub fn applied_to(self, settings: &PlannerSettings) -> PlannerSettings {
        let mut settings = settings.clone();
        if !self.closed_loop {
            settings.horizon = settings.max_steps;
        }
        if !self.reset {
            settings.reset_below_gain = f64::NEG_INFINITY;
        }
        settings
    }
}

impl Method {
    /// What takes part.
    pub fn switches(self) -> Switches {
        let all = Switches::ALL;
        match self {
            Self::Donut | Self::Paper => all,
            Self::DonutNoStages | Self::PaperNoStages => Switches { stages: false, ..all },
            Self::PaperNoP2p => Switches { p2p: false, ..all },
            Self::PaperNoPlacement => Switches { placement: false, ..all },
            Self::PaperNoReset => Switches { reset: false, ..all },
            Self::DiffPhysics => {
                Switches { p2p: false, placement: false, reset: false, closed_loop: false, stages: false }
            }
        }
    }
}
