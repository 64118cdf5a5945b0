//! What can be wrong with the clouds and settings of a distance, each with its remedy.
//!
//! Clouds and weights come in to be checked once, at the border; the kernels below it do not check
//! again. Imports [`crate::math`].

use thiserror::Error;

use crate::math::cloud::Point;

/// Total weight may differ from 1 by this much.
const WEIGHT_SUM_TOLERANCE: f64 = 1e-3;

/// Coordinates reach this far at most, in any unit, so that their squares stay finite.
const FARTHEST: f64 = 1e100;

/// Why a distance cannot be computed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum EmdError {
    #[error("the cloud is empty; a distance needs at least one point")]
    Empty,
    #[error("row {row} has a coordinate that is not finite; remove or repair that point")]
    NotFinite { row: usize },
    #[error("row {row} has the coordinate {coordinate:e}; use a unit in which all are below 1e100")]
    TooFar { row: usize, coordinate: f64 },
    #[error("there are {weights} weights for {points} points; give one weight per point")]
    WeightCount { weights: usize, points: usize },
    #[error("row {row} has the weight {weight}; weights must be finite and not negative")]
    Weight { row: usize, weight: f64 },
    #[error("the weights sum to {sum}; divide them by their sum, it must be 1")]
    WeightSum { sum: f64 },
    #[error("blur is {0}; it must be a positive length, for example 0.001")]
    Blur(f64),
    #[error("scaling is {0}; it must lie between 0 and 1, for example 0.5")]
    Scaling(f64),
    #[error(
        "scaling {scaling} leads through {count} temperatures, {most} are accepted; take a smaller scaling, for example 0.9"
    )]
    Temperatures { scaling: f64, count: usize, most: usize },
    #[error(
        "the iteration left the range of its floating-point type; take a blur nearer to the clouds' size, or f64"
    )]
    OutOfRange,
    #[error("diameter is {0}; it must be a positive length, or left out")]
    Diameter(f64),
    #[error("step length is {0}; it must be a finite length and not negative")]
    StepLength(f64),
    #[error("the clouds have {source_points} and {target_points} points; a matching needs equally many")]
    Unequal { source_points: usize, target_points: usize },
    #[error(
        "{source_points} x {target_points} points are too many for exact transport; take fewer, or sinkhorn"
    )]
    TooLarge { source_points: usize, target_points: usize },
}

/// A cloud with weights: what a distance is measured between.
#[derive(Clone, Copy, Debug)]
pub struct Measure<'a> {
    /// Shape (n, 3), any unit.
    pub points: &'a [Point],
    /// One per point, not negative, summing to 1; 1/n each if left out.
    pub weights: Option<&'a [f64]>,
}

impl<'a> Measure<'a> {
    /// The cloud with equal weights.
    pub fn uniform(points: &'a [Point]) -> Self {
        Self { points, weights: None }
    }

    /// Refuses what no distance is defined for.
    pub fn check(&self) -> Result<(), EmdError> {
        if self.points.is_empty() {
            return Err(EmdError::Empty);
        }
        if let Some(row) = self.points.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
            return Err(EmdError::NotFinite { row });
        }
        if let Some(row) = self.points.iter().position(|p| p.iter().any(|v| v.abs() > FARTHEST)) {
            let coordinate = self.points[row].into_iter().find(|v| v.abs() > FARTHEST).unwrap_or_default();
            return Err(EmdError::TooFar { row, coordinate });
        }
        let Some(weights) = self.weights else { return Ok(()) };
        if weights.len() != self.points.len() {
            return Err(EmdError::WeightCount { weights: weights.len(), points: self.points.len() });
        }
        if let Some(row) = weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
            return Err(EmdError::Weight { row, weight: weights[row] });
        }
        let sum: f64 = weights.iter().sum();
        if (sum - 1.0).abs() > WEIGHT_SUM_TOLERANCE {
            return Err(EmdError::WeightSum { sum });
        }
        Ok(())
    }

    /// The weight of a point.
    pub fn weight(&self, point: usize) -> f64 {
        self.weights.map_or(1.0 / self.points.len() as f64, |weights| weights[point])
    }
}
