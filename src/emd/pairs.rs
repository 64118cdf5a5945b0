//! A Sinkhorn update of both potentials at once: each pair's exponential serves its row and its column.
//!
//! Two packed clouds with weights and potentials come in, both updated potentials go out. With
//! `E_ij = exp((f_i + g_j - C_ij) / eps)` the new `f_i` is `f_i - eps ln sum_j b_j E_ij`, and the new
//! `g_j` is `g_j - eps ln sum_i a_i E_ij`, so there is no need to look for a maximum first. Rows whose
//! sum shows that the old potential is too far off are done again by [`super::softmin`]. Rows are dealt
//! to a fixed number of strips, so the result has the same bits for any number of threads. Imports
//! nothing of the other layers.

use rayon::prelude::*;

use super::cost::Cost;
use super::packed::{BLOCK, GROUP, Packed, Prices};
use super::real::Real;
use super::softmin::Pass;
use super::wide::{Kernel, widest};

/// Strips that the row blocks are dealt to.
const STRIPS: usize = 16;
/// Bounds on a sum outside of which it is not trusted: below, what was left out would count; above,
/// the exponentials come near to what the type can hold.
const TRUSTED: [f64; 2] = [1.0 / 64.0, 1e6];
/// The smallest exponent of 2 that counts lies this much above [`Real::NEGLIGIBLE`]: with weights that
/// sum to 1 and a sum that is trusted, 2^-32 in single precision cannot be seen.
const NEGLIGIBLE_GAIN: f64 = 8.0;
/// The largest exponent of 2 that is computed; the sum is not trusted then.
const LARGEST_EXPONENT: f64 = 100.0;

/// A cloud with its weights and potential, by slot.
#[derive(Clone, Copy)]
pub struct Half<'a, T> {
    pub cloud: &'a Packed<T>,
    pub weights: &'a [T],
    pub log_weights: &'a [T],
    pub potential: &'a [T],
}

impl<T: Real> Half<'_, T> {
    fn blocks_of_weights(&self) -> Vec<[T; BLOCK]> {
        let weight = |slot: usize| self.weights.get(slot).copied().unwrap_or(T::ZERO);
        let block = |block: usize| std::array::from_fn(|k| weight(block * BLOCK + k));
        (0..self.cloud.len().div_ceil(BLOCK)).map(block).collect()
    }

    /// The potential with its sign turned, for its bounds.
    fn negated(&self) -> Prices<T> {
        Prices::new(self.cloud, |slot| -self.potential[slot])
    }

    /// The potential after a step that had these `sums`, seen from `other`.
    fn updated<C: Cost<T>>(&self, other: Half<T>, sums: &[T], cost: C, eps: T) -> Vec<T> {
        let mut updated: Vec<T> =
            self.potential.iter().zip(sums).map(|(&f, &sum)| f - eps * sum.ln()).collect();
        let [low, high] = TRUSTED.map(T::of);
        let again: Vec<usize> = (0..updated.len()).filter(|&k| !(sums[k] > low && sums[k] < high)).collect();
        if !again.is_empty() {
            let points: Vec<_> = again.iter().map(|&k| self.cloud.point(k).map(T::wide)).collect();
            let rows = Packed::new(&points, (0..again.len() as u32).collect());
            let prices = other.prices(eps);
            let pass = Pass { rows: &rows, targets: other.cloud, prices: &prices, cost, eps };
            for (k, minimum) in again.into_iter().zip(pass.soft_minima()) {
                updated[k] = minimum;
            }
        }
        updated
    }

    /// What [`Pass`] takes: the potential and the logarithm of the weight, turned into prices.
    pub fn prices(&self, eps: T) -> Prices<T> {
        Prices::new(self.cloud, |slot| -(eps * self.log_weights[slot] + self.potential[slot]))
    }
}

/// Both potentials of a problem between two clouds.
pub fn update<T: Real, C: Cost<T>>(x: Half<T>, y: Half<T>, cost: C, eps: T) -> [Vec<T>; 2] {
    let sums = Pairs { x, y, same: false, cost, eps }.sums();
    [x.updated(y, &sums[0], cost, eps), y.updated(x, &sums[1], cost, eps)]
}

/// The potential of a problem between a cloud and itself.
pub fn update_self<T: Real, C: Cost<T>>(x: Half<T>, cost: C, eps: T) -> Vec<T> {
    let [mut sums, mirrored] = Pairs { x, y: x, same: true, cost, eps }.sums();
    for (sum, mirrored) in sums.iter_mut().zip(mirrored) {
        *sum += mirrored;
    }
    x.updated(x, &sums, cost, eps)
}

struct Pairs<'a, T, C> {
    x: Half<'a, T>,
    y: Half<'a, T>,
    /// Whether `y` is `x`. Then only tiles on and above the diagonal are visited, and the column sums
    /// are those of the tiles above it.
    same: bool,
    cost: C,
    eps: T,
}

impl<T: Real, C: Cost<T>> Pairs<'_, T, C> {
    /// `sum_j b_j E_ij` per row and `sum_i a_i E_ij` per column.
    fn sums(&self) -> [Vec<T>; 2] {
        let weights = [self.x, self.y].map(|half| half.blocks_of_weights());
        let prices = [self.x, self.y].map(|half| half.negated());
        let strips: Vec<Strip<T>> = (0..STRIPS)
            .into_par_iter()
            .map(|strip| {
                let columns = vec![[T::ZERO; BLOCK]; weights[1].len()];
                let mut sums = Strip { rows: Vec::new(), columns };
                widest(Tiles { pairs: self, weights: &weights, prices: &prices, strip, sums: &mut sums });
                sums
            })
            .collect();
        let rows = (0..weights[0].len()).flat_map(|block| strips[block % STRIPS].rows[block / STRIPS]);
        let mut columns = vec![[T::ZERO; BLOCK]; weights[1].len()];
        for strip in &strips {
            for (sum, part) in columns.iter_mut().zip(&strip.columns) {
                for k in 0..BLOCK {
                    sum[k] += part[k];
                }
            }
        }
        [
            rows.take(self.x.weights.len()).collect(),
            columns.into_iter().flatten().take(self.y.weights.len()).collect(),
        ]
    }
}

/// The sums of one strip: its own rows, and its part of all columns.
struct Strip<T> {
    rows: Vec<[T; BLOCK]>,
    columns: Vec<[T; BLOCK]>,
}

/// The tiles, 16 rows by 16 columns, of one strip.
struct Tiles<'a, 'b, T, C> {
    pairs: &'a Pairs<'b, T, C>,
    weights: &'a [Vec<[T; BLOCK]>; 2],
    prices: &'a [Prices<T>; 2],
    strip: usize,
    sums: &'a mut Strip<T>,
}

impl<T: Real, C: Cost<T>> Kernel for Tiles<'_, '_, T, C> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(mut self) {
        let Pairs { x, y, same, cost, eps } = *self.pairs;
        let limit = -(T::NEGLIGIBLE + T::of(NEGLIGIBLE_GAIN)) * eps * T::of(std::f64::consts::LN_2);
        let blocks = self.weights[1].len();
        for row in (self.strip..self.weights[0].len()).step_by(STRIPS) {
            let mut rows = [[T::ZERO; BLOCK]; BLOCK];
            let first = if same { row } else { 0 };
            for group in first / GROUP..blocks.div_ceil(GROUP) {
                let bounds = y.cloud.pair_bounds(&self.prices[1], cost, group, x.cloud, &self.prices[0], row);
                for (k, &bound) in bounds.iter().enumerate() {
                    let column = group * GROUP + k;
                    if bound < limit && column >= first && column < blocks {
                        self.tile::<FUSED>(row, column, &mut rows);
                    }
                }
            }
            self.sums.rows.push(rows.map(|lanes| lanes.into_iter().fold(T::ZERO, |sum, lane| sum + lane)));
        }
    }
}

impl<T: Real, C: Cost<T>> Tiles<'_, '_, T, C> {
    /// Adds the terms of one tile to the sums of its rows, per lane, and of its columns.
    #[inline(always)]
    fn tile<const FUSED: bool>(&mut self, row: usize, column: usize, rows: &mut [[T; BLOCK]; BLOCK]) {
        let Pairs { x, y, same, cost, eps } = *self.pairs;
        let rate = T::of(std::f64::consts::LOG2_E) / eps;
        let fall = -rate;
        let (least, most) = (T::NEGLIGIBLE + T::of(NEGLIGIBLE_GAIN), T::of(LARGEST_EXPONENT));
        let (price, weight) = (self.prices[1].block(column), &self.weights[1][column]);
        let (row_price, row_weight) = (self.prices[0].block(row), &self.weights[0][row]);
        // On the diagonal the columns are rows as well.
        let mirror = if same && row == column { T::ZERO } else { T::ONE };
        let mut columns = self.sums.columns[column];
        // Per column and per row, so that the loop below has nothing of this left to do.
        let (mut gain, mut row_gain, mut row_weight) = (*price, *row_price, *row_weight);
        for k in 0..BLOCK {
            gain[k] = gain[k] * fall;
            row_gain[k] = row_gain[k] * fall;
            row_weight[k] = row_weight[k] * mirror;
        }
        for i in 0..BLOCK {
            let d = y.cloud.offsets(x.cloud.point(row * BLOCK + i), column);
            for k in 0..BLOCK {
                let d2 =
                    d[0][k].mul_add::<FUSED>(d[0][k], d[1][k].mul_add::<FUSED>(d[1][k], d[2][k] * d[2][k]));
                let exponent = cost.at(d2).mul_add::<FUSED>(fall, gain[k] + row_gain[i]);
                let e = exponent.most(least).least(most).exp2::<FUSED>();
                rows[i][k] = weight[k].mul_add::<FUSED>(e, rows[i][k]);
                columns[k] = row_weight[i].mul_add::<FUSED>(e, columns[k]);
            }
        }
        self.sums.columns[column] = columns;
    }
}
