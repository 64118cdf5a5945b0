//! Optimal and nearly optimal matchings between two clouds of equal size.
//!
//! Two clouds come in; who goes where, and the mean distance, go out. The exact one is an auction to
//! a fine tolerance in `f32`, then shortest augmenting paths in `f64`. Imports [`crate::math`].

use std::borrow::Cow;

use super::auction::{Auction, Auctioned};
use super::augment::Finish;
use super::candidates::List;
use super::order::compact_order;
use super::packed::{Packed, Prices, normalised};
use super::wide::widest;
use crate::math::cloud::{Point, distance};

/// The auction's eps before the exact finish, as a part of the joint box's diagonal: smaller makes
/// the auction longer and leaves less to the augmenting paths. Sixteen units in the last place of a
/// price of 1; if a price rises so far that eps is rounded away, the auction's patience ends it.
const HANDOVER: f64 = 1e-6;
/// The smallest tolerance, as a part of the diagonal, that an auction in `f32` is trusted with.
const SINGLE_PRECISION: f64 = 1e-5;

/// A one-to-one correspondence and its cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    /// For every source point, the index of its target point.
    pub target_of: Vec<usize>,
    /// Mean Euclidean distance between matched points: the exact W1 for uniform weights.
    pub mean_distance: f64,
}

/// A cloud that others are matched with.
#[derive(Clone, Debug)]
pub struct Target {
    points: Vec<Point>,
    /// [`compact_order`] of the points.
    order: Vec<u32>,
}

impl Target {
    /// Points of shape (n, 3), in any unit.
    pub fn new(points: Vec<Point>) -> Self {
        Self { order: compact_order(&points), points }
    }

    /// The points, in their order.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The assignment of least total Euclidean distance. `source` has as many points as the target, in its unit; of
    /// several optimal assignments the choice is fixed by the order of the points.
    ///
    /// # Panics
    /// If the clouds differ in length or hold a coordinate that is not finite.
    pub fn assign(&self, source: &[Point]) -> Assignment {
        let problem = Problem::new(source, self);
        if problem.diagonal == 0.0 {
            return Assignment::of(source, &self.points, (0..source.len()).collect());
        }
        let slots = problem.finish(problem.auction(HANDOVER));
        problem.assignment(source, &self.points, &slots)
    }

    /// An assignment whose mean distance exceeds the least possible by at most `tolerance`, in the unit
    /// of the coordinates. Several times faster than [`Target::assign`] for large clouds; a tolerance below
    /// 1e-5 of the joint box's diagonal gets the exact one.
    ///
    /// # Panics
    /// As [`Target::assign`].
    pub fn assign_within(&self, source: &[Point], tolerance: f64) -> Assignment {
        let problem = Problem::new(source, self);
        // A tenth is kept back for what single precision rounds away.
        let eps = 0.9 * tolerance / problem.diagonal;
        if problem.diagonal == 0.0 || eps.is_nan() || eps < SINGLE_PRECISION {
            return self.assign(source);
        }
        let auctioned = problem.auction(eps);
        let slots = if auctioned.complete { auctioned.matching.slot_of } else { problem.finish(auctioned) };
        problem.assignment(source, &self.points, &slots)
    }
}

/// [`Target::assign`] for a target that is met once.
pub fn assign(source: &[Point], target: &[Point]) -> Assignment {
    Target::new(target.to_vec()).assign(source)
}

/// [`Target::assign_within`] for a target that is met once.
pub fn assign_within(source: &[Point], target: &[Point], tolerance: f64) -> Assignment {
    Target::new(target.to_vec()).assign_within(source, tolerance)
}

impl Assignment {
    fn of(source: &[Point], target: &[Point], target_of: Vec<usize>) -> Self {
        let total: f64 = target_of.iter().enumerate().map(|(i, &j)| distance(source[i], target[j])).sum();
        Self { mean_distance: total / target_of.len().max(1) as f64, target_of }
    }
}

/// Two clouds, normalised and packed.
struct Problem<'a> {
    /// Normalised source and target.
    clouds: [Vec<Point>; 2],
    orders: [Cow<'a, [u32]>; 2],
    /// Length of the joint bounding box's diagonal, in the user's unit.
    diagonal: f64,
}

impl<'a> Problem<'a> {
    fn new(source: &[Point], target: &'a Target) -> Self {
        let points = &target.points;
        assert_eq!(source.len(), points.len(), "an assignment needs clouds of equal length");
        let finite = source.iter().chain(points).flatten().all(|v| v.is_finite());
        assert!(finite, "an assignment needs finite coordinates");
        let orders = [Cow::Owned(compact_order(source)), Cow::Borrowed(&target.order[..])];
        let (source, target, diagonal) = normalised(source, points);
        Self { orders, clouds: [source, target], diagonal }
    }

    fn auction(&self, eps: f64) -> Auctioned {
        let [rows, targets] = [0, 1].map(|k| Packed::new(&self.clouds[k], self.orders[k].to_vec()));
        widest(Auction { rows: &rows, targets: &targets, eps: eps as f32 })
    }

    fn finish(&self, auctioned: Auctioned) -> Vec<u32> {
        let [rows, targets] = [0, 1].map(|k| Packed::new(&self.clouds[k], self.orders[k].to_vec()));
        let matching = &auctioned.matching;
        let prices = Prices::new(&targets, |slot| f64::from(matching.prices.get(slot)));
        let widened = |(row, list): (usize, &List<f32>)| list.widened(&targets, rows.point(row));
        let lists = auctioned.lists.iter().enumerate().map(widened).collect();
        widest(Finish { rows: &rows, targets: &targets, prices, lists })
    }

    /// The assignment in the user's order and unit.
    fn assignment(&self, source: &[Point], target: &[Point], slot_of: &[u32]) -> Assignment {
        let mut target_of = vec![0; slot_of.len()];
        for (row, &slot) in slot_of.iter().enumerate() {
            target_of[self.orders[0][row] as usize] = self.orders[1][slot as usize] as usize;
        }
        Assignment::of(source, target, target_of)
    }
}
