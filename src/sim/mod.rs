//! The differentiable MLS-MPM simulator.
//!
//! A rollout is control steps of substeps; a substep is the list in [`substep`]: constitutive update
//! ([`constitutive`]: trial deformation, [`plasticity`], [`elasticity`]), particles to grid ([`p2g`]), grid
//! update ([`grid`]: [`contact`] with the tools, [`boundary`]), grid to particles ([`g2p`]). The adjoint of
//! each operation stands below it in the same file. [`Simulator`] is the way in.
//!
//! # The method in one page
//!
//! The material point method keeps what belongs to the material on particles: position x, velocity v, the
//! gradient C of the velocity around the particle, and the elastic deformation gradient F. It computes what
//! needs neighbours on a grid that is thrown away after each substep of length dt. Written out, with p for
//! particles, i for nodes, `w_ip` the quadratic B-spline weights ([`kernel`]; B-splines) and the keys of
//! docs/references.md:
//!
//! 1. *Trial deformation* ([`constitutive`]): `F <- (I + dt C) F`.
//! 2. *Return mapping* ([`plasticity`]; PlasticineLab; return mapping in Hencky strain): with the singular
//!    values s of F, the strain `e = ln s`, its deviator `e' = e - mean(e)`, and
//!    `excess = |e'| - yield / (2 mu)`: where the excess is positive, e' is shortened by it. The trace of e stays,
//!    and with it det F: plastic flow keeps the volume (but for singular values below 0.05, which are raised).
//! 3. *Stress* ([`elasticity`]; fixed corotated): `tau = 2 mu (F - R) F^T + lambda J (J - 1) I`, with R the
//!    rotation in F and J = det F.
//! 4. *Particles to grid* ([`p2g`]; APIC, MLS-MPM eq. 29): with `A = m C - dt Vol (4 / dx^2) tau`,
//!    `m_i = sum_p w_ip m` and `(m v)_i = sum_p w_ip (m v + A (x_i - x))`. The first part of A carries the
//!    affine velocity, the second is the impulse of the stress.
//! 5. *Grid update* ([`grid`]): `v_i = (m v)_i / m_i + dt g`, then every tool ([`contact`]; PlasticineLab), then the
//!    walls and the floor's friction ([`boundary`]).
//! 6. *Grid to particles* ([`g2p`]; APIC): `v = sum_i w_ip v_i`, `C = (4 / dx^2) sum_i w_ip v_i (x_i - x)^T`,
//!    `x <- x + dt v`.
//!
//! The weights of a particle sum to one, which is why 4 and 6 keep mass and momentum; C in 4 is why they keep
//! angular momentum (APIC, section 5).
//!
//! # The gradient in half a page
//!
//! A loss L of the end state has derivatives by that state. Each operation f: a -> b has an adjoint, which
//! turns `dL/db` into `dL/da = (df/da)^T dL/db`; running the adjoints in the opposite order turns the derivatives
//! by the end into those by the start and, on the way, by every action. Two points need care. The return mapping and
//! the stress depend on singular vectors, whose derivatives do not exist where singular values coincide, as they all
//! do at F = I; but both are functions of `F F^T` alone, whose derivatives do ([`spectral`]; Daleckii and Krein). And
//! the adjoints need the states that the forward pass went through: they are kept, or, when memory is short, run
//! again from the start of each control step ([`rollout`]). [`gradcheck`] compares the result with finite
//! differences.
//!
//! # Precision, lanes and threads
//!
//! Kernels are written once for f32 and f64 and for 16 particles at a time ([`lanes`]); particles are sorted along
//! the grid at the start of each control step ([`layout`], [`particles`]). Contact and tools are f64 throughout.
//! Sums are taken in an order that does not depend on the number of threads.

pub mod batch;
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

pub use batch::Batch;
pub use error::SimError;
pub use lanes::SimdLevel;
pub use params::Params;
pub use particles::ParticleState;
pub use rollout::{Options, RolloutGradient, Simulator, StepSeed};
pub use tool::{Motion, Shape, Tool, ToolPose};
