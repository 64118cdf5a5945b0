//! **donut** plans how to shape dough with tools.
//!
//! It is an open implementation of "Make a Donut: Hierarchical EMD-Space Planning for Zero-Shot
//! Deformable Manipulation with Tools" (You et al., RA-L 2025). The modules, in layer order
//! (each imports only from the ones above it):
//!
//! | module | what lives there |
//! |---|---|
//! | [`math`] | point clouds, quaternions, seeded random numbers, finite-difference checks |
//! | [`sim`] | the differentiable MLS-MPM simulator and its adjoint |
//! | [`emd`] | the earth mover's distance: Sinkhorn divergence and exact assignment |
//! | [`stagecode`] | the evaluator for the numpy code a language model writes |
//! | [`llm`] | prompts, recorded answers, and parsing an answer into stages |
//! | [`plan`] | Algorithm 1 of the paper |
//! | [`task`] | task files, scenes, pieces of dough, subgoals in the simulator's world |
//! | [`store`] | what a run leaves on disk; `.npy` and `.npz` |
//! | [`view`] | `report.html` and pictures |
//! | [`eval`] | the paper's experiments: trials, statistics, tables |
//! | [`cli`] | one file a subcommand |

pub mod cli;
pub mod emd;
pub mod eval;
pub mod llm;
pub mod math;
pub mod plan;
pub mod sim;
pub mod stagecode;
pub mod store;
pub mod task;
pub mod view;
