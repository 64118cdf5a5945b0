//! Each source's best targets, remembered: what makes most bids of an auction cheap.
//!
//! Packed clouds and prices come in, the two best slots of a row go out. A row's list holds its best
//! slots at the time of a scan and the value that every other slot had at least. As prices only rise,
//! the two best of the list are the two best of all while the second is below that value, and only
//! when it no longer is must all targets be looked at again. Imports nothing of the other layers.

use rayon::prelude::*;

use super::cost::Distance;
use super::packed::{BLOCK, Packed, Prices, Visitor, any_below, halving_least};
use super::real::Real;
use super::wide::{Kernel, widest};

/// Most slots that a row remembers.
const LENGTH: usize = 32;
/// Slots that a scan collects before it sorts out the best.
const CAPACITY: usize = 128;
/// Rows that one task handles.
const CHUNK: usize = 64;

/// The cheapest slot for a row at the current prices, and what the second cheapest would cost.
#[derive(Clone, Copy)]
pub struct TwoBest<T> {
    pub best: T,
    pub second: T,
    pub slot: usize,
}

/// The best slots of one row.
#[derive(Clone)]
pub struct List<T> {
    /// Places without a slot have the cost [`Real::FAR`].
    cost: [T; LENGTH],
    slot: [u32; LENGTH],
    /// No slot outside the list is worth less than this.
    rest: T,
    /// Slots up to this much above the second best are looked for in the next scan.
    margin: T,
}

impl<T: Real> List<T> {
    /// A list that knows nothing but a slot that is likely to be good.
    pub fn hint(slot: u32, margin: T) -> Self {
        Self { cost: [T::FAR; LENGTH], slot: [slot; LENGTH], rest: -T::FAR, margin }
    }

    /// The two best slots at the current prices for the list's row, which is at `u`.
    #[inline(always)]
    pub fn two_best(&mut self, targets: &Packed<T>, prices: &mut Prices<T>, u: [T; 3]) -> TwoBest<T> {
        let found = self.two_best_listed(prices);
        if found.second <= self.rest {
            return found;
        }
        prices.refit(targets);
        self.renew(targets, prices, u);
        self.two_best_listed(prices)
    }

    /// The two best of the list.
    #[inline(always)]
    fn two_best_listed(&self, prices: &Prices<T>) -> TwoBest<T> {
        let mut values = self.cost;
        for k in 0..LENGTH {
            values[k] += prices.get(self.slot[k] as usize);
        }
        let (best, second) = two_least(values);
        let mut first = [0; LENGTH];
        for k in 0..LENGTH {
            first[k] = if values[k] == best { k as u32 } else { u32::MAX };
        }
        let first = first.into_iter().fold(u32::MAX, u32::min);
        TwoBest { best, second, slot: self.slot[first as usize] as usize }
    }

    /// The slots of the list with cost plus price.
    #[inline(always)]
    pub fn values(&self, prices: &Prices<T>) -> impl Iterator<Item = (usize, T)> {
        self.slot
            .iter()
            .zip(&self.cost)
            .map(|(&slot, &cost)| (slot as usize, cost + prices.get(slot as usize)))
    }

    /// No slot outside the list is worth less than this.
    #[inline(always)]
    pub fn rest(&self) -> T {
        self.rest
    }

    /// The block of a slot that is likely to be good.
    #[inline(always)]
    pub fn first_block(&self) -> usize {
        self.slot[0] as usize / BLOCK
    }

    /// Looks through all targets for the best slots of a row at `u`.
    #[inline(always)]
    pub fn renew(&mut self, targets: &Packed<T>, prices: &Prices<T>, u: [T; 3]) {
        let mut search = Search {
            found: [(T::INFINITY, 0); CAPACITY],
            count: 0,
            best: T::INFINITY,
            second: T::INFINITY,
            margin: self.margin,
            limit: T::INFINITY,
        };
        targets.scan(prices, Distance, u, self.first_block(), &mut search);
        search.prune();
        let few = search.count < LENGTH / 2;
        self.margin = if few { search.margin + search.margin } else { search.margin };
        self.rest = search.limit;
        self.cost = [T::FAR; LENGTH];
        for (k, &(_, slot)) in search.found[..search.count].iter().enumerate() {
            self.slot[k] = slot;
            self.cost[k] = targets.distance(u, slot as usize);
        }
    }
}

impl List<f32> {
    /// The same list in double precision, for clouds of which this one's are rounded.
    pub fn widened(&self, targets: &Packed<f64>, u: [f64; 3]) -> List<f64> {
        let mut cost = [f64::FAR; LENGTH];
        for k in 0..LENGTH {
            if self.cost[k] < f32::FAR {
                cost[k] = targets.distance(u, self.slot[k] as usize);
            }
        }
        let rest = if self.rest < f32::FAR { self.rest - f32::SLACK } else { self.rest };
        List { cost, slot: self.slot, rest: rest.wide(), margin: self.margin.wide() }
    }
}

/// Collects the best slots of a row.
struct Search<T> {
    found: [(T, u32); CAPACITY],
    count: usize,
    best: T,
    second: T,
    /// Slots up to this much above the second best are collected.
    margin: T,
    /// All slots below this are found.
    limit: T,
}

impl<T: Real> Search<T> {
    /// Drops what is not below the limit, and lowers the limit so that at most [`LENGTH`] slots are.
    #[inline(always)]
    fn prune(&mut self) {
        let mut kept = 0;
        for k in 0..self.count {
            self.found[kept] = self.found[k];
            kept += usize::from(self.found[k].0 < self.limit);
        }
        self.count = kept;
        if kept > LENGTH {
            let order = |a: &(T, u32), b: &(T, u32)| a.0.wide().total_cmp(&b.0.wide()).then(a.1.cmp(&b.1));
            let (_, first_left_out, _) = self.found[..kept].select_nth_unstable_by(LENGTH, order);
            self.limit = first_left_out.0;
            self.margin = self.limit - self.second;
            self.count = LENGTH;
        }
    }
}

impl<T: Real> Visitor<T> for Search<T> {
    #[inline(always)]
    fn visit(&mut self, block: usize, values: &[T; BLOCK]) -> T {
        if any_below(values, self.limit) {
            if any_below(values, self.second) {
                let (best, second) = two_least(*values);
                self.second = self.second.least(second).least(self.best.most(best));
                self.best = self.best.least(best);
                self.limit = self.limit.least(self.second + self.margin);
            }
            if self.count + BLOCK > CAPACITY {
                self.prune();
            }
            for (k, &value) in values.iter().enumerate() {
                self.found[self.count] = (value, (block * BLOCK + k) as u32);
                self.count += usize::from(value < self.limit);
            }
        }
        self.limit
    }
}

/// The least of some values and the next, by halves, which suits vectors: the least of each half's least, and the least
/// of what is left.
#[inline(always)]
fn two_least<T: Real, const N: usize>(values: [T; N]) -> (T, T) {
    let (mut best, mut second) = (values, [T::INFINITY; N]);
    let mut width = N / 2;
    while width > 0 {
        for k in 0..width {
            let (a, b) = (best[k], best[k + width]);
            best[k] = a.least(b);
            second[k] = second[k].least(second[k + width]).least(a.most(b));
        }
        width /= 2;
    }
    (best[0], second[0])
}

/// Renews all lists, on all threads.
pub fn renew_all<T: Real>(lists: &mut [List<T>], rows: &Packed<T>, targets: &Packed<T>, prices: &Prices<T>) {
    lists.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, lists)| {
        widest(Renewal { first_row: chunk * CHUNK, lists, rows, targets, prices });
    });
}

/// One task of [`renew_all`].
struct Renewal<'a, T> {
    first_row: usize,
    lists: &'a mut [List<T>],
    rows: &'a Packed<T>,
    targets: &'a Packed<T>,
    prices: &'a Prices<T>,
}

impl<T: Real> Kernel for Renewal<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        for (k, list) in self.lists.iter_mut().enumerate() {
            list.renew(self.targets, self.prices, self.rows.point(self.first_row + k));
        }
    }
}

/// What the best slot costs each row, price included, on all threads.
pub fn least_values<T: Real>(rows: &Packed<T>, targets: &Packed<T>, prices: &Prices<T>) -> Vec<T> {
    let mut values = vec![T::ZERO; rows.len()];
    values.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, out)| {
        widest(LeastValues { first_row: chunk * CHUNK, out, rows, targets, prices });
    });
    values
}

/// One task of [`least_values`].
struct LeastValues<'a, T> {
    first_row: usize,
    out: &'a mut [T],
    rows: &'a Packed<T>,
    targets: &'a Packed<T>,
    prices: &'a Prices<T>,
}

impl<T: Real> Kernel for LeastValues<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let mut least = Least { value: T::INFINITY, block: 0 };
        for (k, out) in self.out.iter_mut().enumerate() {
            // Rows that follow each other are neighbours: start where the last one ended.
            least.value = T::INFINITY;
            self.targets.scan(
                self.prices,
                Distance,
                self.rows.point(self.first_row + k),
                least.block,
                &mut least,
            );
            *out = least.value;
        }
    }
}

/// The least value so far and its block.
struct Least<T> {
    value: T,
    block: usize,
}

impl<T: Real> Visitor<T> for Least<T> {
    #[inline(always)]
    fn visit(&mut self, block: usize, values: &[T; BLOCK]) -> T {
        let value = halving_least(*values);
        if value < self.value {
            *self = Self { value, block };
        }
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emd::order::compact_order;
    use crate::math::cloud::Point;
    use crate::math::rng;

    #[test]
    fn lists_find_the_two_best_while_prices_rise() {
        let mut rng = rng::seeded(8, "candidates");
        for n in [1, 2, 40, 700] {
            let points: Vec<Point> =
                (0..n).map(|_| std::array::from_fn(|_| rng::uniform(&mut rng))).collect();
            let targets = Packed::<f64>::new(&points, compact_order(&points));
            let mut prices = Prices::new(&targets, |_| 0.0);
            let u = [0.3, 0.4, 0.5];
            let mut list = List::hint(0, 0.1);
            for _ in 0..300 {
                let found = list.two_best(&targets, &mut prices, u);
                let mut values: Vec<f64> = (0..n).map(|k| targets.distance(u, k) + prices.get(k)).collect();
                assert_eq!(values[found.slot], found.best);
                values.sort_by(f64::total_cmp);
                assert_eq!(values[0], found.best, "n = {n}");
                if n > 1 {
                    assert_eq!(values[1], found.second, "n = {n}");
                }
                prices.raise(found.slot, prices.get(found.slot) + 0.02 * rng::uniform(&mut rng));
            }
            prices.refit(&targets);
            let rows = Packed::new(&[u], vec![0]);
            let least = (0..n).map(|k| targets.distance(u, k) + prices.get(k)).fold(f64::INFINITY, f64::min);
            assert_eq!(least_values(&rows, &targets, &prices), [least]);
        }
    }
}
