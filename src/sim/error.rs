//! What can go wrong inside a rollout, with the place where it went wrong first.
//!
//! Comes out of every simulation call; the planner rejects the iteration and goes on, the command line
//! prints it. Imports nothing.

use std::fmt;

/// The operation that noticed the problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// Trial deformation, return mapping and stress.
    Constitutive,
    /// Grid to particles.
    G2p,
    /// The start state handed in by the caller.
    Start,
}

impl fmt::Display for Operation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Constitutive => "the constitutive update",
            Self::G2p => "grid to particles (G2P)",
            Self::Start => "the start state",
        })
    }
}

/// A rollout that could not be completed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimError {
    /// A number stopped being finite.
    #[error(
        "{operation} produced a non-finite value at control step {step}, substep {substep}, particle {particle}; \
         use a smaller dt or slower actions"
    )]
    NonFinite { operation: Operation, step: usize, substep: usize, particle: usize },
    /// A particle's deformation gradient turned inside out.
    #[error(
        "{} found the deformation gradient inverted (det F <= 0) at control step {step}, substep {substep}, particle \
         {particle}; use a smaller dt or slower actions",
        Operation::Constitutive
    )]
    Inverted { step: usize, substep: usize, particle: usize },
    /// The caller's arrays do not fit together.
    #[error("{0}")]
    Shape(String),
}
