//! Pieces of dough: which there are in a plan, and which particles belong to which.
//!
//! Names and clouds of a plan come in as [`Piece`]s; [`Pieces`] says for every particle where it belongs,
//! and follows that through the stages. Imports point clouds and this module's subgoals.

use super::subgoal::Subgoal;
use crate::math::cloud::Point;

/// Index of a piece in a plan. Piece 0 is the initial dough.
pub type PieceId = usize;

/// One piece of dough as a plan describes it. Names need not be distinct: a plan may use one again.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// What the plan calls it.
    pub name: String,
    /// Its cloud in the world, resting on the table, m; empty for the initial dough, which is simulated.
    pub points: Vec<Point>,
    /// Volume as the plan states it, m^3, if it states a positive one.
    pub stated_volume: Option<f64>,
    /// Volume as measured from the points, m^3.
    pub measured_volume: f64,
}

/// For every particle, the piece that it belongs to now.
#[derive(Clone, Debug, PartialEq)]
pub struct Pieces {
    of_particle: Vec<PieceId>,
}

impl Pieces {
    /// `particles` particles that all belong to the initial dough.
    pub fn initial(particles: usize) -> Self {
        Self { of_particle: vec![0; particles] }
    }

    /// The piece of each particle.
    pub fn of_particles(&self) -> &[PieceId] {
        &self.of_particle
    }

    /// Indices of the particles of any of these pieces, in increasing order.
    pub fn members(&self, pieces: &[PieceId]) -> Vec<usize> {
        (0..self.of_particle.len()).filter(|&i| pieces.contains(&self.of_particle[i])).collect()
    }

    /// After a stage: each active particle goes to the piece of the target point that it is matched with.
    /// `positions` are of all particles, in m. `matching` gets the active particles and the target (equally
    /// many) and returns, for each particle, the index of its target point; `emd`'s exact assignment is
    /// meant.
    pub fn relabel(
        &mut self,
        subgoal: &Subgoal,
        positions: &[Point],
        matching: impl FnOnce(&[Point], &[Point]) -> Vec<usize>,
    ) {
        let active: Vec<Point> = subgoal.active.iter().map(|&i| positions[i]).collect();
        let target_of = matching(&active, &subgoal.target);
        for (&particle, &target) in subgoal.active.iter().zip(&target_of) {
            self.of_particle[particle] = subgoal.piece_of_target[target];
        }
    }
}

/// How many of `n` points each piece gets: in proportion to the stated volumes if all are stated, otherwise
/// to the measured ones.
pub fn weights(pieces: &[&Piece]) -> Vec<f64> {
    let stated: Option<Vec<f64>> = pieces.iter().map(|p| p.stated_volume).collect();
    // A cloud too degenerate to measure still gets its point.
    stated.unwrap_or_else(|| pieces.iter().map(|p| p.measured_volume.max(f64::MIN_POSITIVE)).collect())
}
