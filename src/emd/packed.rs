//! A cloud packed for scanning: coordinates side by side, in spatially compact blocks.
//!
//! Points come in; out comes a structure over which "every target whose cost plus price is below a
//! limit" is found without looking at most targets. The auction, the augmenting paths and the
//! Sinkhorn passes all run on this one scan. Imports [`crate::math`].

use super::cost::Cost;
use super::real::Real;
use crate::math::cloud::{Bounds, Point, sub};

/// Points per block: two AVX2 registers of `f32`.
pub const BLOCK: usize = 16;
/// Blocks whose bounds are tested together.
const GROUP: usize = 8;

/// Points in an order in which neighbours in memory are neighbours in space.
#[derive(Clone)]
pub struct Packed<T> {
    /// Coordinates (x, y, z), each padded to whole groups of blocks with copies of the last point.
    at: [Vec<T>; 3],
    /// Lower and upper corner of each block's bounding box, per axis.
    low: [Vec<T>; 3],
    high: [Vec<T>; 3],
    /// Index in the original cloud of the point in each slot; `len` entries.
    pub order: Vec<u32>,
}

/// A number per slot that is added to the cost of reaching it, with its minimum over each block.
#[derive(Clone)]
pub struct Prices<T> {
    /// Per slot; padding has an infinite price, so it is never chosen.
    of: Vec<T>,
    floor: Vec<T>,
}

/// What a scan does with a block: sees `cost + price` of its slots, answers with the limit from now on.
pub trait Visitor<T> {
    fn visit(&mut self, block: usize, values: &[T; BLOCK]) -> T;
}

impl<T: Real> Packed<T> {
    /// Packs the points, given in an order from [`compact_order`].
    pub fn new(points: &[Point], order: Vec<u32>) -> Self {
        let padded = order.len().next_multiple_of(BLOCK * GROUP);
        let last = order.last().copied().unwrap_or(0);
        let at: [Vec<T>; 3] = std::array::from_fn(|axis| {
            let slots = order.iter().chain(std::iter::repeat(&last)).take(padded);
            slots.map(|&i| T::of(points[i as usize][axis])).collect()
        });
        let corner = |pick: fn(T, T) -> T| {
            std::array::from_fn(|axis| {
                let blocks = at[axis].chunks_exact(BLOCK);
                blocks.map(|block| block.iter().copied().fold(block[0], pick)).collect()
            })
        };
        Self { low: corner(T::least), high: corner(T::most), at, order }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// The point in a slot.
    #[inline(always)]
    pub fn point(&self, slot: usize) -> [T; 3] {
        [self.at[0][slot], self.at[1][slot], self.at[2][slot]]
    }

    /// Squared distances from `u` to the points of a block.
    #[inline(always)]
    pub fn squared_distances(&self, u: [T; 3], block: usize) -> [T; BLOCK] {
        let start = block * BLOCK;
        let [xs, ys, zs] = self.at.each_ref().map(|axis| &axis[start..start + BLOCK]);
        let mut d2 = [T::ZERO; BLOCK];
        for k in 0..BLOCK {
            let (dx, dy, dz) = (xs[k] - u[0], ys[k] - u[1], zs[k] - u[2]);
            d2[k] = dx * dx + dy * dy + dz * dz;
        }
        d2
    }

    /// `cost + price` from `u` to the slots of a block.
    #[inline(always)]
    fn values(&self, prices: &Prices<T>, cost: impl Cost, u: [T; 3], block: usize) -> [T; BLOCK] {
        let mut values = self.squared_distances(u, block);
        let price = &prices.of[block * BLOCK..(block + 1) * BLOCK];
        for k in 0..BLOCK {
            values[k] = cost.at(values[k]) + price[k];
        }
        values
    }

    /// Lower bounds of `cost + price` over each block of a group. Rounding is monotone and the
    /// operations are those of `values` in the same order, so the bounds hold to the last bit.
    #[inline(always)]
    fn bounds(&self, prices: &Prices<T>, cost: impl Cost, u: [T; 3], group: usize) -> [T; GROUP] {
        let start = group * GROUP;
        let mut square = [[T::ZERO; GROUP]; 3];
        for axis in 0..3 {
            let low = &self.low[axis][start..start + GROUP];
            let high = &self.high[axis][start..start + GROUP];
            for k in 0..GROUP {
                let gap = (low[k] - u[axis]).most(u[axis] - high[k]).most(T::ZERO);
                square[axis][k] = gap * gap;
            }
        }
        let floor = &prices.floor[start..start + GROUP];
        let mut bounds = [T::ZERO; GROUP];
        for k in 0..GROUP {
            bounds[k] = cost.at(square[0][k] + square[1][k] + square[2][k]) + floor[k];
        }
        bounds
    }

    /// Shows `visitor` every block that may hold a value below the limit, the block `first` first.
    #[inline(always)]
    pub fn scan(
        &self,
        prices: &Prices<T>,
        cost: impl Cost,
        u: [T; 3],
        first: usize,
        visitor: &mut impl Visitor<T>,
    ) {
        let mut limit = visitor.visit(first, &self.values(prices, cost, u, first));
        for group in 0..self.low[0].len() / GROUP {
            let bounds = self.bounds(prices, cost, u, group);
            if !any_below(&bounds, limit) {
                continue;
            }
            for (k, &bound) in bounds.iter().enumerate() {
                let block = group * GROUP + k;
                if bound < limit && block != first {
                    limit = visitor.visit(block, &self.values(prices, cost, u, block));
                }
            }
        }
    }
}

impl<T: Real> Prices<T> {
    /// A price for every point of `packed`, by slot.
    pub fn new(packed: &Packed<T>, price_of_slot: impl Fn(usize) -> T) -> Self {
        let padded = packed.at[0].len();
        let of: Vec<T> =
            (0..padded).map(|k| if k < packed.len() { price_of_slot(k) } else { T::INFINITY }).collect();
        let floor = of.chunks_exact(BLOCK).map(lowest).collect();
        Self { of, floor }
    }

    /// The price of a slot.
    #[inline(always)]
    pub fn get(&self, slot: usize) -> T {
        self.of[slot]
    }

    /// The prices of a block.
    #[inline(always)]
    pub fn block(&self, block: usize) -> &[T] {
        &self.of[block * BLOCK..(block + 1) * BLOCK]
    }

    /// Changes the price of a slot.
    #[inline(always)]
    pub fn set(&mut self, slot: usize, price: T) {
        self.of[slot] = price;
        let block = slot / BLOCK;
        self.floor[block] = lowest(&self.of[block * BLOCK..(block + 1) * BLOCK]);
    }
}

/// Whether any value is below the limit, without a branch per value.
#[inline(always)]
pub fn any_below<T: Real, const N: usize>(values: &[T; N], limit: T) -> bool {
    values.iter().fold(false, |any, &v| any | (v < limit))
}

#[inline(always)]
fn lowest<T: Real>(values: &[T]) -> T {
    values.iter().fold(T::INFINITY, |low, &v| v.least(low))
}

/// An order in which every run of [`BLOCK`] points is compact: halve the cloud across its longest
/// side, again and again. Ties are broken by index, so the order depends on nothing but the points.
pub fn compact_order(points: &[Point]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let mut parts = vec![&mut order[..]];
    while let Some(part) = parts.pop() {
        if part.len() <= BLOCK {
            continue;
        }
        let axis = longest_side(points, part);
        let middle = (part.len() / 2).next_multiple_of(BLOCK);
        part.select_nth_unstable_by(middle, |&i, &j| {
            points[i as usize][axis].total_cmp(&points[j as usize][axis]).then(i.cmp(&j))
        });
        let (left, right) = part.split_at_mut(middle);
        parts.extend([left, right]);
    }
    order
}

fn longest_side(points: &[Point], part: &[u32]) -> usize {
    let first = points[part[0] as usize];
    let mut bounds = Bounds { min: first, max: first };
    for &i in part {
        for axis in 0..3 {
            bounds.min[axis] = bounds.min[axis].min(points[i as usize][axis]);
            bounds.max[axis] = bounds.max[axis].max(points[i as usize][axis]);
        }
    }
    let size = bounds.size();
    (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0)
}

/// Moves both clouds to the middle of their joint box and divides by its diagonal, so that the
/// kernels work on numbers near one whatever the user's units. Returns the clouds and the diagonal.
pub fn normalised(source: &[Point], target: &[Point]) -> (Vec<Point>, Vec<Point>, f64) {
    let (Some(a), Some(b)) = (Bounds::of(source), Bounds::of(target)) else {
        return (source.to_vec(), target.to_vec(), 0.0);
    };
    let joint = a.union(&b);
    let (center, diagonal) = (joint.center(), joint.diagonal());
    let scale = if diagonal > 0.0 { 1.0 / diagonal } else { 0.0 };
    let shrink = |cloud: &[Point]| cloud.iter().map(|&p| sub(p, center).map(|v| v * scale)).collect();
    (shrink(source), shrink(target), diagonal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emd::cost::Distance;
    use crate::math::rng;

    fn cloud(n: usize) -> Vec<Point> {
        let mut rng = rng::seeded(5, "packed");
        (0..n).map(|_| std::array::from_fn(|_| rng::uniform(&mut rng))).collect()
    }

    struct Collect(Vec<f64>, f64);

    impl Visitor<f64> for Collect {
        fn visit(&mut self, _: usize, values: &[f64; BLOCK]) -> f64 {
            self.0.extend(values.iter().filter(|&&v| v < self.1));
            self.1
        }
    }

    #[test]
    fn a_scan_misses_nothing_below_its_limit() {
        for n in [1, 15, 16, 17, 128, 129, 1000] {
            let points = cloud(n);
            let packed = Packed::<f64>::new(&points, compact_order(&points));
            let prices = Prices::new(&packed, |slot| 0.1 * packed.point(slot)[0]);
            let u = [0.3, 0.4, 0.5];
            let value = |slot: usize| {
                let d = sub(packed.point(slot), u);
                (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt() + prices.get(slot)
            };
            let mut expected: Vec<f64> = (0..n).map(value).filter(|&v| v < 0.4).collect();
            let mut found = Collect(vec![], 0.4);
            packed.scan(&prices, Distance, u, 0, &mut found);
            expected.sort_by(f64::total_cmp);
            found.0.sort_by(f64::total_cmp);
            assert_eq!(found.0, expected, "n = {n}");
        }
    }

    #[test]
    fn the_order_is_a_permutation() {
        let points = cloud(333);
        let mut order = compact_order(&points);
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(k, &i)| k == i as usize));
    }
}
