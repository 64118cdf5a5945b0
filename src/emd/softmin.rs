//! The two passes of a Sinkhorn divergence over all pairs: the soft minimum and its gradient.
//!
//! Packed clouds and prices come in, one number or vector per row goes out. Distances are computed on
//! the fly and blocks that cannot matter are skipped; rows are shared out in fixed chunks, so the
//! result has the same bits for any number of threads. Imports nothing of the other layers.

use rayon::prelude::*;

use super::cost::Cost;
use super::packed::{BLOCK, Packed, Prices, Visitor, any_below, halving_least};
use super::real::Real;
use super::wide::{Kernel, widest};

/// Rows that one task handles.
const CHUNK: usize = 64;

/// All rows against all slots at one temperature.
#[derive(Clone, Copy)]
pub struct Pass<'a, T, C> {
    pub rows: &'a Packed<T>,
    pub targets: &'a Packed<T>,
    pub prices: &'a Prices<T>,
    pub cost: C,
    pub eps: T,
}

impl<T: Real, C: Cost<T>> Pass<'_, T, C> {
    /// `-eps ln sum_j exp(-(C_ij + price_j) / eps)` per row i.
    pub fn soft_minima(self) -> Vec<T> {
        let mut minima = vec![T::ZERO; self.rows.len()];
        minima.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, out)| {
            widest(SoftMinima { pass: self, first_row: chunk * CHUNK, out });
        });
        minima
    }

    /// How the targets draw each row's point; `minima` are the pass's soft minima.
    pub fn pulls(self, minima: &[T]) -> Vec<Pull<T>> {
        let mut pulls = vec![Pull { gradient: [T::ZERO; 3], offset: [T::ZERO; 3] }; self.rows.len()];
        pulls.par_chunks_mut(CHUNK).zip(minima.par_chunks(CHUNK)).enumerate().for_each(
            |(chunk, (out, minima))| {
                widest(Pulls { pass: self, first_row: chunk * CHUNK, minima, out });
            },
        );
        pulls
    }

    /// Values above a soft minimum by more than this have no weight.
    #[inline(always)]
    fn negligible(&self) -> T {
        -T::NEGLIGIBLE * self.eps * T::of(std::f64::consts::LN_2)
    }

    /// Turns differences of values into exponents of 2.
    #[inline(always)]
    fn rate(&self) -> T {
        T::of(std::f64::consts::LOG2_E) / self.eps
    }
}

/// What the targets do to a row's point, each with its share of the row's mass,
/// `P_ij = exp((minimum_i - C_ij - price_j) / eps)`.
#[derive(Clone, Copy)]
pub struct Pull<T> {
    /// `sum_j P_ij grad C(x_i, y_j)`: the gradient of the soft minimum, the prices held fixed.
    pub gradient: [T; 3],
    /// `sum_j P_ij (y_j - x_i)`.
    pub offset: [T; 3],
}

/// exp(-(value - least) / eps), per slot; 0 where it is negligible.
#[inline(always)]
fn weights<T: Real, const FUSED: bool>(values: &[T; BLOCK], least: T, rate: T) -> [T; BLOCK] {
    let mut weights = [T::ZERO; BLOCK];
    for k in 0..BLOCK {
        let exponent = ((least - values[k]) * rate).most(T::NEGLIGIBLE);
        weights[k] = if exponent > T::NEGLIGIBLE { exponent.exp2::<FUSED>() } else { T::ZERO };
    }
    weights
}

/// The sum of all lanes, one after the other: an order that leaves the lanes in place until the end.
#[inline(always)]
fn total<T: Real>(lanes: [T; BLOCK]) -> T {
    lanes.into_iter().fold(T::ZERO, |sum, lane| sum + lane)
}

/// The rows of one task of [`Pass::soft_minima`].
struct SoftMinima<'a, T, C> {
    pass: Pass<'a, T, C>,
    first_row: usize,
    out: &'a mut [T],
}

impl<T: Real, C: Cost<T>> Kernel for SoftMinima<'_, T, C> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let Pass { rows, targets, prices, cost, eps } = self.pass;
        let rate = self.pass.rate();
        let mut gather = Gather {
            kept: Vec::with_capacity(targets.len().div_ceil(BLOCK)),
            least: T::INFINITY,
            at: 0,
            negligible: self.pass.negligible(),
        };
        for (k, out) in self.out.iter_mut().enumerate() {
            gather.kept.clear();
            gather.least = T::INFINITY;
            // Rows that follow each other are neighbours: start where the last one ended.
            targets.scan(prices, cost, rows.point(self.first_row + k), gather.at, &mut gather);
            let mut sums = [T::ZERO; BLOCK];
            for values in &gather.kept {
                let weights = weights::<T, FUSED>(values, gather.least, rate);
                for k in 0..BLOCK {
                    sums[k] += weights[k];
                }
            }
            *out = gather.least - eps * total(sums).ln();
        }
    }
}

/// Collects the blocks that matter to one row.
struct Gather<T> {
    kept: Vec<[T; BLOCK]>,
    least: T,
    /// The block of the least value.
    at: usize,
    negligible: T,
}

impl<T: Real> Visitor<T> for Gather<T> {
    #[inline(always)]
    fn visit(&mut self, block: usize, values: &[T; BLOCK]) -> T {
        if any_below(values, self.least + self.negligible) {
            if any_below(values, self.least) {
                self.least = halving_least(*values);
                self.at = block;
            }
            self.kept.push(*values);
        }
        self.least + self.negligible
    }
}

/// The rows of one task of [`Pass::pulls`].
struct Pulls<'a, T, C> {
    pass: Pass<'a, T, C>,
    first_row: usize,
    minima: &'a [T],
    out: &'a mut [Pull<T>],
}

impl<T: Real, C: Cost<T>> Kernel for Pulls<'_, T, C> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let Pass { rows, targets, prices, cost, .. } = self.pass;
        for (k, out) in self.out.iter_mut().enumerate() {
            let u = rows.point(self.first_row + k);
            let mut sums = PullSums::<T, C, FUSED> {
                targets,
                cost,
                u,
                minimum: self.minima[k],
                rate: self.pass.rate(),
                negligible: self.pass.negligible(),
                mass: [T::ZERO; BLOCK],
                slope: [[T::ZERO; BLOCK]; 3],
                offset: [[T::ZERO; BLOCK]; 3],
            };
            targets.scan(prices, cost, u, 0, &mut sums);
            // In exact arithmetic the mass is 1; dividing by it takes off what rounding did to all.
            let mass = total(sums.mass);
            *out = Pull {
                gradient: sums.slope.map(|axis| -total(axis) / mass),
                offset: sums.offset.map(|axis| total(axis) / mass),
            };
        }
    }
}

/// The sums of a [`Pull`], per lane.
struct PullSums<'a, T, C, const FUSED: bool> {
    targets: &'a Packed<T>,
    cost: C,
    u: [T; 3],
    minimum: T,
    rate: T,
    negligible: T,
    mass: [T; BLOCK],
    slope: [[T; BLOCK]; 3],
    offset: [[T; BLOCK]; 3],
}

impl<T: Real, C: Cost<T>, const FUSED: bool> Visitor<T> for PullSums<'_, T, C, FUSED> {
    #[inline(always)]
    fn visit(&mut self, block: usize, values: &[T; BLOCK]) -> T {
        let limit = self.minimum + self.negligible;
        if any_below(values, limit) {
            let weights = weights::<T, FUSED>(values, self.minimum, self.rate);
            let d = self.targets.offsets(self.u, block);
            for k in 0..BLOCK {
                let d2 = d[0][k] * d[0][k] + d[1][k] * d[1][k] + d[2][k] * d[2][k];
                let slope = self.cost.slope(d2);
                self.mass[k] += weights[k];
                for axis in 0..3 {
                    let offset = weights[k] * d[axis][k];
                    self.offset[axis][k] += offset;
                    self.slope[axis][k] += slope * offset;
                }
            }
        }
        limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emd::cost::{ClampedDistance, HalfSquare};
    use crate::emd::order::compact_order;
    use crate::math::cloud::Point;
    use crate::math::rng;

    fn cloud(n: usize, seed: u64) -> Vec<Point> {
        let mut rng = rng::seeded(seed, "softmin");
        (0..n).map(|_| std::array::from_fn(|_| 0.5 * rng::uniform(&mut rng))).collect()
    }

    /// The gradient of every row's soft minimum against central differences, and the soft minimum
    /// against its definition summed up plainly.
    fn check(cost: impl Cost<f64>, eps: f64) {
        let (x, y) = (cloud(70, 1), cloud(90, 2));
        let targets = Packed::new(&y, compact_order(&y));
        let prices = Prices::new(&targets, |slot| 0.1 * (slot as f64).sin());
        let minima_of = |x: &[Point]| {
            let rows = Packed::new(x, (0..x.len() as u32).collect());
            let pass = Pass { rows: &rows, targets: &targets, prices: &prices, cost, eps };
            let minima = pass.soft_minima();
            let pulls = pass.pulls(&minima);
            (minima, pulls)
        };
        let (minima, pulls) = minima_of(&x);
        for (i, u) in x.iter().enumerate() {
            let term = |slot: usize| {
                let d2: f64 = targets.point(slot).iter().zip(u).map(|(v, u)| (v - u) * (v - u)).sum();
                (-(cost.at(d2) + prices.get(slot)) / eps).exp()
            };
            let plain = -eps * (0..90).map(term).sum::<f64>().ln();
            assert!((minima[i] - plain).abs() < 1e-13, "row {i}: {} for {plain}", minima[i]);
        }
        let step = 1e-6;
        for axis in 0..3 {
            let moved = |by: f64| {
                let x: Vec<Point> = x
                    .iter()
                    .map(|p| std::array::from_fn(|a| p[a] + if a == axis { by } else { 0.0 }))
                    .collect();
                minima_of(&x).0
            };
            for ((up, down), pull) in moved(step).iter().zip(moved(-step)).zip(&pulls) {
                let difference = (up - down) / (2.0 * step);
                let gradient = pull.gradient[axis];
                assert!((gradient - difference).abs() < 1e-7, "{gradient} for {difference}");
            }
        }
    }

    #[test]
    fn gradients_are_those_of_the_soft_minima() {
        for eps in [1.0, 0.1, 0.01] {
            check(ClampedDistance { clamp: 1e-8 }, eps);
            check(HalfSquare, eps);
        }
    }
}
