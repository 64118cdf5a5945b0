//! What it costs to move a unit of mass from one point to another.
//!
//! Each cost is a convex function of the distance, which is what lets [`super::packed`] bound it over
//! a box. Imports nothing of the other layers.

use super::real::Real;

/// A cost as a function of the squared Euclidean distance; convex in the points.
pub trait Cost<T>: Copy + Send + Sync {
    /// The cost at squared distance `d2`.
    fn at(self, d2: T) -> T;
    /// `s` such that the gradient of the cost with respect to its first point is `s (u - v)`.
    fn slope(self, d2: T) -> T;
}

/// |u - v|.
#[derive(Clone, Copy)]
pub struct Distance;

impl<T: Real> Cost<T> for Distance {
    #[inline(always)]
    fn at(self, d2: T) -> T {
        d2.sqrt()
    }
    #[inline(always)]
    fn slope(self, d2: T) -> T {
        if d2 > T::ZERO { T::ONE / d2.sqrt() } else { T::ZERO }
    }
}

/// |u - v|, but constant where it is small: GeomLoss's p = 1 (Feydy et al. 2019).
#[derive(Clone, Copy)]
pub struct ClampedDistance<T> {
    /// The squared distance under which the cost is constant.
    pub clamp: T,
}

impl<T: Real> Cost<T> for ClampedDistance<T> {
    #[inline(always)]
    fn at(self, d2: T) -> T {
        d2.most(self.clamp).sqrt()
    }
    #[inline(always)]
    fn slope(self, d2: T) -> T {
        let inverse = T::ONE / self.at(d2);
        if d2 < self.clamp { T::ZERO } else { inverse }
    }
}

/// |u - v|^2 / 2: GeomLoss's p = 2.
#[derive(Clone, Copy)]
pub struct HalfSquare;

impl<T: Real> Cost<T> for HalfSquare {
    #[inline(always)]
    fn at(self, d2: T) -> T {
        d2 * T::of(0.5)
    }
    #[inline(always)]
    fn slope(self, _: T) -> T {
        T::ONE
    }
}
