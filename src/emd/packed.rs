//! A cloud packed for scanning: coordinates side by side, in spatially compact blocks.
//!
//! Points come in; out comes a structure over which "every target whose cost plus price is below a
//! limit" is found without looking at most targets. The auction, the augmenting paths and the
//! Sinkhorn passes all run on this one scan. Imports [`crate::math`].

use super::cost::{Cost, Distance};
use super::real::Real;
use crate::math::cloud::{Bounds, Point, centroid, sub};
use nalgebra::{Matrix3, Vector3};

/// Points per block: two AVX2 registers of `f32`.
pub const BLOCK: usize = 16;
/// Neighbours that a coarser cloud has one point for; divides [`BLOCK`].
pub const CLUSTER: usize = 4;
/// Blocks whose bounds are tested together.
pub const GROUP: usize = 16;
/// Part of the trace that is added to a block's moments before they are inverted.
const RIDGE: f64 = 1e-3;
/// Greatest slope of a plane below prices. Dual prices of transport in a box of diagonal 1 stay below 1.
const STEEPEST: f64 = 2.0;

/// Points in an order in which neighbours in memory are neighbours in space. A point's place is its
/// slot; slots beyond the last point repeat it.
#[derive(Clone)]
pub struct Packed<T> {
    blocks: Vec<Block<T>>,
    groups: Vec<Group<T>>,
    /// Index in the original cloud of the point in each slot; `len` entries.
    pub order: Vec<u32>,
}

#[derive(Clone)]
struct Block<T> {
    /// Coordinates, per axis and slot.
    at: [[T; BLOCK]; 3],
    /// The weights with which the block's prices sum up to their gradient, per axis and slot.
    fit: [[T; BLOCK]; 3],
}

/// Bounding boxes of some blocks: middle and half the size, per axis and block.
#[derive(Clone)]
struct Group<T> {
    center: [[T; GROUP]; 3],
    half: [[T; GROUP]; 3],
}

/// A number per slot that is added to the cost of reaching it.
#[derive(Clone)]
pub struct Prices<T> {
    /// Per block and slot; padding has the price [`Real::FAR`], so it is never chosen.
    of: Vec<[T; BLOCK]>,
    planes: Vec<Planes<T>>,
    /// Blocks with a price that rose after its plane was laid.
    risen: Vec<u32>,
    has_risen: Vec<bool>,
}

/// For each block of a group a plane that lies below its prices: `base + gradient . (v - center)`.
///
/// Dual prices of transport by distance fall along the rays of transport as fast as the distance
/// rises, so a bound from a plane is far tighter than one from the lowest price.
#[derive(Clone)]
struct Planes<T> {
    base: [T; GROUP],
    gradient: [[T; GROUP]; 3],
}

/// What a scan does with a block: sees `cost + price` of its slots, answers with the limit from now on.
pub trait Visitor<T> {
    fn visit(&mut self, block: usize, values: &[T; BLOCK]) -> T;
}

impl<T: Real> Packed<T> {
    /// Packs the points, given in an order from [`compact_order`].
    pub fn new(points: &[Point], order: Vec<u32>) -> Self {
        let groups = order.len().div_ceil(BLOCK * GROUP);
        let zero = [[T::ZERO; GROUP]; 3];
        let mut packed = Self {
            blocks: Vec::with_capacity(groups * GROUP),
            groups: vec![Group { center: zero, half: zero }; groups],
            order,
        };
        for block in 0..groups * GROUP {
            packed.add_block(block, points);
        }
        packed
    }

    /// Adds a block with its box and the weights of the least-squares plane through its prices.
    fn add_block(&mut self, block: usize, points: &[Point]) {
        let last = self.len() - 1;
        let start = (block * BLOCK).min(last);
        let end = (start + BLOCK).min(self.len());
        let points: Vec<Point> = self.order[start..end].iter().map(|&i| points[i as usize]).collect();
        let mean = centroid(&points);
        let mut moments = Matrix3::zeros();
        for &p in &points {
            let d = Vector3::from(sub(p, mean));
            moments += d * d.transpose();
        }
        // A little of the trace keeps flat blocks invertible; any plane gives a sound bound.
        let ridge = Matrix3::identity() * (RIDGE * moments.trace());
        let inverse = (moments + ridge).try_inverse().unwrap_or_else(Matrix3::zeros);
        let weights: Vec<Vector3<f64>> =
            points.iter().map(|&p| inverse * Vector3::from(sub(p, mean))).collect();
        let at =
            std::array::from_fn(|axis| std::array::from_fn(|k| T::of(points[k.min(points.len() - 1)][axis])));
        let fit = std::array::from_fn(|axis| {
            std::array::from_fn(|k| weights.get(k).map_or(T::ZERO, |w| T::of(w[axis])))
        });
        for axis in 0..3 {
            let coordinates: &[T; BLOCK] = &at[axis];
            let low = coordinates.iter().copied().fold(coordinates[0], T::least);
            let high = coordinates.iter().copied().fold(coordinates[0], T::most);
            let center = (low + high) * T::of(0.5);
            let group = &mut self.groups[block / GROUP];
            group.center[axis][block % GROUP] = center;
            group.half[axis][block % GROUP] = (high - center).most(center - low);
        }
        self.blocks.push(Block { at, fit });
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// The point in a slot.
    #[inline(always)]
    pub fn point(&self, slot: usize) -> [T; 3] {
        let block = &self.blocks[slot / BLOCK];
        [block.at[0][slot % BLOCK], block.at[1][slot % BLOCK], block.at[2][slot % BLOCK]]
    }

    /// The mean of each [`CLUSTER`] points that follow each other.
    pub fn cluster_means(&self) -> Vec<Point> {
        let points: Vec<Point> = (0..self.len()).map(|slot| self.point(slot).map(T::wide)).collect();
        points.chunks(CLUSTER).map(centroid).collect()
    }

    /// The distance from `u` to a slot, to the bit the cost in [`Self::scan`].
    #[inline(always)]
    pub fn distance(&self, u: [T; 3], slot: usize) -> T {
        let v = self.point(slot);
        let d: [T; 3] = std::array::from_fn(|axis| v[axis] - u[axis]);
        Distance.at(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    }

    /// The vectors from `u` to the points of a block, per axis and slot.
    #[inline(always)]
    pub fn offsets(&self, u: [T; 3], block: usize) -> [[T; BLOCK]; 3] {
        let mut offsets = self.blocks[block].at;
        for axis in 0..3 {
            for k in 0..BLOCK {
                offsets[axis][k] = offsets[axis][k] - u[axis];
            }
        }
        offsets
    }

    /// `cost + price` from `u` to the slots of a block.
    #[inline(always)]
    fn values(&self, prices: &Prices<T>, cost: impl Cost<T>, u: [T; 3], block: usize) -> [T; BLOCK] {
        let d = self.offsets(u, block);
        let price = &prices.of[block];
        let mut values = [T::ZERO; BLOCK];
        for k in 0..BLOCK {
            values[k] = cost.at(d[0][k] * d[0][k] + d[1][k] * d[1][k] + d[2][k] * d[2][k]) + price[k];
        }
        values
    }

    /// Lower bounds of `cost + price` over each block of a group. The cost is convex, so over a box it
    /// lies above its tangent plane at the middle; with the plane below the prices that leaves
    /// `cost(c) + base - sum_a |cost'(c) + gradient|_a half_a`.
    #[inline(always)]
    fn bounds(&self, prices: &Prices<T>, cost: impl Cost<T>, u: [T; 3], group: usize) -> [T; GROUP] {
        let Group { center, half } = &self.groups[group];
        let Planes { base, gradient } = &prices.planes[group];
        let mut bounds = [T::ZERO; GROUP];
        for k in 0..GROUP {
            let d = [center[0][k] - u[0], center[1][k] - u[1], center[2][k] - u[2]];
            let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let slope = cost.slope(d2);
            let mut bound = cost.at(d2) + base[k];
            for axis in 0..3 {
                bound = bound - (slope * d[axis] + gradient[axis][k]).abs() * half[axis][k];
            }
            bounds[k] = bound;
        }
        bounds
    }

    /// Lower bounds of `cost + price + row price` over each pair of one block of `rows` with the blocks of
    /// a group, by the tangent plane at both middles.
    #[inline(always)]
    pub fn pair_bounds(
        &self,
        prices: &Prices<T>,
        cost: impl Cost<T>,
        group: usize,
        rows: &Self,
        row_prices: &Prices<T>,
        row: usize,
    ) -> [T; GROUP] {
        let Group { center, half } = &self.groups[group];
        let Planes { base, gradient } = &prices.planes[group];
        let (own, own_planes, at) = (&rows.groups[row / GROUP], &row_prices.planes[row / GROUP], row % GROUP);
        let mut bounds = [T::ZERO; GROUP];
        for k in 0..GROUP {
            let d: [T; 3] = std::array::from_fn(|axis| center[axis][k] - own.center[axis][at]);
            let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let slope = cost.slope(d2);
            let mut bound = cost.at(d2) + base[k] + own_planes.base[at];
            for axis in 0..3 {
                let pull = slope * d[axis];
                bound = bound - (pull + gradient[axis][k]).abs() * half[axis][k];
                bound = bound - (own_planes.gradient[axis][at] - pull).abs() * own.half[axis][at];
            }
            bounds[k] = bound;
        }
        bounds
    }

    /// Shows `visitor` every block that may hold a value below the limit, the block `first` first.
    #[inline(always)]
    pub fn scan(
        &self,
        prices: &Prices<T>,
        cost: impl Cost<T>,
        u: [T; 3],
        first: usize,
        visitor: &mut impl Visitor<T>,
    ) {
        let mut limit = visitor.visit(first, &self.values(prices, cost, u, first));
        for group in 0..self.groups.len() {
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
        let price = |slot| if slot < packed.len() { price_of_slot(slot) } else { T::FAR };
        let zero = Planes { base: [T::ZERO; GROUP], gradient: [[T::ZERO; GROUP]; 3] };
        let mut prices = Self {
            of: (0..packed.blocks.len())
                .map(|block| std::array::from_fn(|k| price(block * BLOCK + k)))
                .collect(),
            planes: vec![zero; packed.groups.len()],
            risen: Vec::new(),
            has_risen: vec![false; packed.blocks.len()],
        };
        for block in 0..packed.blocks.len() {
            prices.fit(packed, block);
        }
        prices
    }

    /// The price of a slot.
    #[inline(always)]
    pub fn get(&self, slot: usize) -> T {
        self.of[slot / BLOCK][slot % BLOCK]
    }

    /// The prices of a block.
    #[inline(always)]
    pub fn block(&self, block: usize) -> &[T; BLOCK] {
        &self.of[block]
    }

    /// Raises the price of a slot. The plane below its block stays below; [`Self::refit`] brings it near.
    #[inline(always)]
    pub fn raise(&mut self, slot: usize, price: T) {
        let block = slot / BLOCK;
        self.of[block][slot % BLOCK] = price;
        if !self.has_risen[block] {
            self.has_risen[block] = true;
            self.risen.push(block as u32);
        }
    }

    /// Lays new planes below the blocks in which prices rose.
    #[inline(always)]
    pub fn refit(&mut self, packed: &Packed<T>) {
        while let Some(block) = self.risen.pop() {
            self.has_risen[block as usize] = false;
            self.fit(packed, block as usize);
        }
    }

    /// Lays a plane below the prices of a block.
    #[inline(always)]
    fn fit(&mut self, packed: &Packed<T>, block: usize) {
        let Block { at, fit } = &packed.blocks[block];
        let price = &self.of[block];
        let planes = &mut self.planes[block / GROUP];
        let mut rest = *price;
        for axis in 0..3 {
            let mut terms = [T::ZERO; BLOCK];
            for k in 0..BLOCK {
                terms[k] = fit[axis][k] * price[k];
            }
            let gradient = halving_sum(terms);
            // A steep plane belongs to prices that are far apart, where rounding would make it unsound.
            let gradient = if gradient.abs() < T::of(STEEPEST) { gradient } else { T::ZERO };
            let center = packed.groups[block / GROUP].center[axis][block % GROUP];
            for k in 0..BLOCK {
                rest[k] = rest[k] - gradient * (at[axis][k] - center);
            }
            planes.gradient[axis][block % GROUP] = gradient;
        }
        planes.base[block % GROUP] = halving_least(rest) - T::SLACK;
    }
}

/// The sum, by halves: a fixed order that suits vectors.
#[inline(always)]
fn halving_sum<T: Real>(mut terms: [T; BLOCK]) -> T {
    let mut width = BLOCK / 2;
    while width > 0 {
        for k in 0..width {
            terms[k] += terms[k + width];
        }
        width /= 2;
    }
    terms[0]
}

/// The smallest, by halves.
#[inline(always)]
pub fn halving_least<T: Real>(mut terms: [T; BLOCK]) -> T {
    let mut width = BLOCK / 2;
    while width > 0 {
        for k in 0..width {
            terms[k] = terms[k].least(terms[k + width]);
        }
        width /= 2;
    }
    terms[0]
}

/// Whether any value is below the limit, without a branch per value.
#[inline(always)]
pub fn any_below<T: Real, const N: usize>(values: &[T; N], limit: T) -> bool {
    values.iter().fold(false, |any, &v| any | (v < limit))
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
    use super::super::order::compact_order;
    use super::*;
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
}
