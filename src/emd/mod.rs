//! The earth mover's distance between point clouds: exact, nearly exact, and as a Sinkhorn divergence.
//!
//! Clouds of points come in, distances, correspondences, gradients and moved clouds go out; nothing
//! here knows of dough, tools or files. Imports only [`crate::math`].
//!
//! | looking for | open |
//! |---|---|
//! | the exact matching of equal clouds | [`exact`], which runs [`auction`] (with [`candidates`]) and then [`augment`] |
//! | clouds of different size, weights | [`transport`], a network simplex on a [`tree`] |
//! | GeomLoss's Sinkhorn divergence | [`sinkhorn`], with [`schedule`], [`pairs`] and [`softmin`] |
//! | the next reachable cloud of the paper's equation 1 | [`reach`] |
//! | how an inner loop skips and vectorises | [`packed`] (in the [`order`] of its points), [`real`], [`wide`] |

#![allow(clippy::needless_range_loop, reason = "kernels step through several arrays by one lane or axis")]

mod auction;
mod augment;
mod candidates;
mod cost;
mod error;
pub mod exact;
mod order;
mod packed;
mod pairs;
pub mod reach;
mod real;
pub mod schedule;
pub mod sinkhorn;
mod softmin;
pub mod transport;
mod tree;
mod wide;

pub use error::{EmdError, Measure};
pub use real::Real;
