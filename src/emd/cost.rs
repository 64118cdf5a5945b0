//! What it costs to move a unit of mass from one point to another.
//!
//! Each cost is a function of the squared distance that never falls as the distance grows, which is
//! what lets [`super::packed`] bound it over a box. Imports nothing of the other layers.

use super::real::Real;

/// A cost as a function of the squared Euclidean distance. Zero-sized: it selects a kernel.
pub trait Cost: Copy + Send + Sync {
    /// The cost at squared distance `d2`.
    fn at<T: Real>(self, d2: T) -> T;
    /// `s` such that the gradient of the cost with respect to its first point is `s (u - v)`.
    fn slope<T: Real>(self, d2: T) -> T;
}

/// |u - v|.
#[derive(Clone, Copy)]
pub struct Distance;

impl Cost for Distance {
    #[inline(always)]
    fn at<T: Real>(self, d2: T) -> T {
        d2.sqrt()
    }
    #[inline(always)]
    fn slope<T: Real>(self, d2: T) -> T {
        if d2 > T::ZERO { T::ONE / d2.sqrt() } else { T::ZERO }
    }
}

/// |u - v|, but nowhere below 1e-4: the distance of GeomLoss's p = 1 (Feydy et al. 2019).
#[derive(Clone, Copy)]
pub struct ClampedDistance;

/// Squared distance under which [`ClampedDistance`] is constant.
const CLAMP: f64 = 1e-8;

impl Cost for ClampedDistance {
    #[inline(always)]
    fn at<T: Real>(self, d2: T) -> T {
        d2.most(T::of(CLAMP)).sqrt()
    }
    #[inline(always)]
    fn slope<T: Real>(self, d2: T) -> T {
        let inverse = T::ONE / self.at(d2);
        if d2 < T::of(CLAMP) { T::ZERO } else { inverse }
    }
}

/// |u - v|^2 / 2: GeomLoss's p = 2.
#[derive(Clone, Copy)]
pub struct HalfSquare;

impl Cost for HalfSquare {
    #[inline(always)]
    fn at<T: Real>(self, d2: T) -> T {
        d2 * T::of(0.5)
    }
    #[inline(always)]
    fn slope<T: Real>(self, _: T) -> T {
        T::ONE
    }
}
