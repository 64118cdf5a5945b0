//! The differentiable MLS-MPM simulator.
//!
//! A rollout is control steps of substeps; a substep is the list in [`substep`]: constitutive update
//! ([`constitutive`]: trial deformation, [`plasticity`], [`elasticity`]), particles to grid ([`p2g`]), grid
//! update ([`grid`]: [`contact`] with the tools, [`boundary`]), grid to particles ([`g2p`]). The adjoint of
//! each operation stands below it in the same file. [`Simulator`] is the way in.

mod block;
pub mod boundary;
pub mod constitutive;
pub mod contact;
pub mod elasticity;
mod epoch;
pub mod error;
pub mod g2p;
pub mod gradcheck;
pub mod grid;
pub mod kernel;
pub mod lanes;
pub mod layout;
pub mod p2g;
pub mod params;
pub mod particles;
pub mod plasticity;
pub mod rollout;
pub mod spectral;
pub mod substep;
pub mod tool;
pub mod transfer;

pub use error::SimError;
pub use lanes::SimdLevel;
pub use params::Params;
pub use particles::ParticleState;
pub use rollout::{Options, RolloutGradient, Simulator, StepSeed};
pub use tool::{Motion, Shape, Tool, ToolPose};
