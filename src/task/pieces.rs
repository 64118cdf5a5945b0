//! Pieces of dough: which there are in a plan, and which particles belong to which.
//!
//! Names and clouds of a plan come in as [`Piece`]s; [`Pieces`] says for every particle where it belongs,
//! whatever stages do to them. Imports point clouds.

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

    /// Says that a particle belongs to a piece now.
    pub fn assign(&mut self, particle: usize, piece: PieceId) {
        self.of_particle[particle] = piece;
    }
}

/// In what proportion pieces share particles: by their stated volumes if all are stated, otherwise by the
/// measured ones.
pub fn weights(pieces: &[&Piece]) -> Vec<f64> {
    let stated: Option<Vec<f64>> = pieces.iter().map(|p| p.stated_volume).collect();
    // A cloud too degenerate to measure still gets its point.
    stated.unwrap_or_else(|| pieces.iter().map(|p| p.measured_volume.max(f64::MIN_POSITIVE)).collect())
}
