//! The differentiable MLS-MPM simulator.
//!
//! A start state, tools and actions come in; a trajectory goes out, and for a loss of it the gradient by every
//! action. [`Simulator`] is the way in. Imports math.
//!
//! A rollout is control steps of substeps; a substep is the list in [`substep`]: constitutive update
//! ([`constitutive`]: trial deformation, [`plasticity`], [`elasticity`]), particles to grid ([`p2g`]), grid
//! update ([`grid`]: [`contact`] with the tools, [`boundary`]), grid to particles ([`g2p`]). The adjoint of
//! each operation stands below it in the same file. What follows is the method as a whole, written to be read
//! once from top to bottom before the files. Names in small brackets, as \[APIC], are keys of docs/references.md.
//!
//! # 1. What is solved
//!
//! Dough is a continuum. A point that was at X when undeformed is now at x = phi(X, t), moving with velocity v. Two
//! laws hold:
//!
//! ```text
//! mass       D rho / Dt = - rho div v
//! momentum   rho Dv / Dt = div sigma + rho g            (+ what tools and walls do)
//! ```
//!
//! with density rho, Cauchy stress sigma (Pa) and the acceleration g (m/s^2). The stress follows from the
//! deformation gradient F = d phi / dX, which obeys `DF/Dt = (grad v) F` and is split into an elastic part, which
//! makes stress, and a plastic one, which is forgotten. What this crate calls F is the elastic part.
//!
//! # 2. Notation and units
//!
//! ```text
//! symbol  meaning                                        unit     where
//! p, i    a particle, a grid node
//! x_p     position                                       m        particles::X (stored in cells, see there)
//! v_p     velocity                                       m/s      particles::V
//! C_p     affine velocity matrix: gradient of v at x_p   1/s      particles::C
//! F_p     elastic deformation gradient                   1        particles::F (stored as F - I)
//! m, V    mass and "volume" of a particle                kg, m^3  params::Params::particle_mass
//! x_i     position of a node, dx times three integers    m        layout
//! v_i     velocity of a node                             m/s      grid
//! m_i     mass at a node                                 kg       grid
//! w_ip    weight between node i and particle p           1        kernel
//! dx, dt  cell size, substep                             m, s     params::Params
//! E, nu   Young's modulus, Poisson's ratio               Pa, 1    params::Params
//! mu, lambda   Lame's parameters                         Pa       params::Params::mu, lambda
//! sigma_Y yield stress                                   Pa       params::Params::yield_stress
//! tau     Kirchhoff stress, det(F) sigma                 Pa       elasticity
//! q_k, e_k     singular values of F, their logarithms    1        spectral, plasticity
//! ```
//!
//! Matrices are row-major; `A^T` is the transpose, `|a|` the Euclidean (of a matrix: Frobenius) norm, `a . b`
//! the scalar product, `I` the identity, `det` the determinant. In code `NAME_adj` is the derivative of the loss
//! by NAME, and a function `NAME_adj` carries such derivatives from the results of NAME to its arguments.
//!
//! # 3. One substep
//!
//! The material point method keeps what belongs to the material on particles, which are never remeshed, and computes
//! what needs neighbours on a regular grid, which is thrown away after each substep \[MLS-MPM]. Each of the six
//! operations is one file.
//!
//! ```text
//! 1. trial deformation   F <- (I + dt C) F                                       constitutive
//! 2. return mapping      F <- K F, so that F satisfies the yield condition       plasticity
//! 3. stress              tau = 2 mu (F - R) F^T + lambda J (J - 1) I             elasticity
//! 4. particles to grid   A        = m C - dt V (4 / dx^2) tau                    p2g
//!                        m_i      = sum_p w_ip m
//!                        (m v)_i  = sum_p w_ip (m v_p + A (x_i - x_p))
//! 5. grid update         v_i = (m v)_i / m_i + dt g;  tools;  walls              grid, contact, boundary
//! 6. grid to particles   v_p = sum_i w_ip v_i                                    g2p
//!                        C_p = (4 / dx^2) sum_i w_ip v_i (x_i - x_p)^T
//!                        x_p <- x_p + dt v_p
//! ```
//!
//! **1.** integrates `DF/Dt = (grad v) F` explicitly over dt with the velocity gradient that the last substep
//! left in C \[MLS-MPM].
//!
//! **2.** With `F = U diag(q) W^T` and the Hencky strain `e_k = ln q_k`, its mean `e_m = (e_1 + e_2 + e_3) / 3` and
//! deviator `e'_k = e_k - e_m`, dough yields where
//!
//! ```text
//! |e'| > sigma_Y / (2 mu)
//! ```
//!
//! which is von Mises' condition for stress linear in the Hencky strain. The deviator is then shortened to that
//! norm and the mean left alone: `det F = exp(3 e_m)` stays, plastic flow keeps the volume \[PlasticineLab,
//! return mapping in Hencky strain].
//!
//! **3.** is the fixed corotated model \[Fixed corotated]: R is the rotation in the polar decomposition of F, J = det F.
//! In the frame of U it is diagonal, `tau_k = 2 mu q_k (q_k - 1) + lambda J (J - 1)`.
//!
//! **4.** is where MLS-MPM differs from the older MPM. The momentum equation in weak form asks for the force
//! `f_i = - sum_p V tau_p grad w_ip` on a node. With quadratic B-splines and moving least squares
//! `grad w_ip` is replaced by `(4 / dx^2) w_ip (x_i - x_p)`: then the impulse `dt f_i` has the same form as the
//! affine momentum `m C (x_i - x_p)` of APIC, and both travel in one matrix A \[MLS-MPM, eq. 29; APIC]. `4 / dx^2`
//! is the inverse of the B-splines' second moment, `sum_i w_ip (x_i - x_p)(x_i - x_p)^T = dx^2 / 4 I`.
//!
//! **5.** divides momentum by mass (nodes lighter than 1e-12 are empty), adds gravity, and then changes
//! velocities where tools and walls forbid them: softened Coulomb contact \[PlasticineLab], in f64.
//!
//! **6.** reads velocity and its gradient back with the same weights \[APIC] and moves the particle.
//!
//! Everything is explicit: each quantity depends on earlier ones only, which makes the adjoint easy and dt short.
//! A pressure wave runs at `c = sqrt((lambda + 2 mu) / rho)`, and a substep in which it crosses about a cell explodes
//! ([`params::Params::courant`]).
//!
//! # 4. What is conserved
//!
//! `sum_i w_ip = 1`, so 4 keeps mass, and 4 and 6 keep momentum; `sum_i w_ip x_i = x_p`, so the stress term
//! adds no momentum in total. The particle's angular momentum is that of v plus that of C, and APIC passes both through
//! the grid and back \[APIC, section 5]. Energy is lost to the grid (what 27 nodes know and 12 numbers do
//! not), to plastic flow, friction and softened contact, and never gained at rest. tests/mpm/conservation.rs holds the
//! simulator to all of this.
//!
//! # 5. The gradient
//!
//! A loss L of states has derivatives by them. Each operation f: a -> b has an adjoint, which turns
//! `b_adj = dL/db` into `a_adj = (df/da)^T b_adj`; the adjoints in the opposite order turn the derivatives by the end
//! into those by the start and, on the way, by every action. Some are pleasing: the adjoint of a gather is
//! a scatter with the same weights, so that 4 and 6 swap places backwards, and a substep's
//! adjoint costs about three times the substep.
//!
//! Three points need care.
//!
//! - *Coinciding singular values.* The derivatives of U and W have `1 / (q_i^2 - q_j^2)` in them and do not exist where
//!   two coincide, as all three do at F = I, where every simulation starts. But K and tau are isotropic functions of
//!   `b = F F^T`, whose derivative is that of the eigenvalues and, off the diagonal, *divided differences*
//!   `(f_i - f_j) / (b_i - b_j)` \[Daleckii and Krein], which are smooth where b_i = b_j. [`constitutive`]
//!   writes them so that nothing is divided by a difference.
//! - *Jumps and kinks.* The touch of a tool begins with a jump at influence 0.1, yielding and friction begin
//!   with kinks. The adjoint is the derivative of the branch that the forward pass took.
//! - *Memory.* The adjoints need the states that the forward pass went through. They are kept, or, where memory is
//!   short, run again from the start of a control step ([`rollout`], `epoch`).
//!
//! [`gradcheck`] compares gradients of whole rollouts with finite differences; every operation has a test of its own
//! adjoint besides.
//!
//! # 6. Precision
//!
//! Kernels are written once for f32 and f64 ([`lanes`]). Contact and tools are f64 throughout. What a substep adds to a
//! position, some 1e-5 m, and to F, some 1e-4, is small against what is there, and 800 substeps make a horizon: so
//! positions are stored relative to the nearest node, deformations as F - I, logarithms and exponentials are
//! taken of what differs from 1, and K is applied as K - I ([`particles`], [`constitutive`]). f32 then has 2^-24 of a
//! *cell* and of a *strain* to lose at each step, not of the world and of the 1 in F.
//!
//! # 7. Lanes and threads
//!
//! Kernels run on 16 particles at a time ([`lanes`]); particles are sorted along the grid at the start of each control
//! step ([`layout`], [`particles`]). Work is split into parts whose number depends on the particles alone,
//! and sums are taken in the order of the parts, so that no bit of a result depends on the number of threads.

pub mod batch;
pub mod block;
pub mod boundary;
pub mod constitutive;
pub mod contact;
pub mod elasticity;
mod epoch;
pub mod error;
pub mod g2p;
pub mod gradcheck;
pub mod grid;
mod input;
pub mod kernel;
pub mod lanes;
pub mod layout;
mod options;
pub mod p2g;
pub mod params;
pub mod particles;
pub mod plasticity;
pub mod rollout;
pub mod seed;
pub mod spectral;
pub mod substep;
pub mod tool;
pub mod transfer;
pub mod work;

pub use batch::Batch;
pub use error::SimError;
pub use lanes::SimdLevel;
pub use options::Options;
pub use params::Params;
pub use particles::ParticleState;
pub use rollout::{RolloutGradient, Simulator};
pub use seed::StepSeed;
pub use tool::{Motion, Shape, Tool, ToolPose};
pub use work::{Tally, Work};
