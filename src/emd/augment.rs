//! The exact finish of an assignment: shortest augmenting paths from good prices.
//!
//! Two packed clouds of equal size and prices come in, the optimal matching goes out. Two rounds of
//! augmenting row reduction leave few sources without a target; each of those is then placed by one
//! shortest augmenting path (Jonker & Volgenant 1987, "A shortest augmenting path algorithm for dense
//! and sparse linear assignment problems"). Imports nothing of the other layers.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::auction::{Matching, NONE};
use super::candidates::{List, TwoBest};
use super::cost::Distance;
use super::packed::{BLOCK, Packed, Prices, Visitor, any_below};
use super::real::Real;
use super::wide::Kernel;

/// Rounds of augmenting row reduction.
const REDUCTIONS: usize = 2;
/// The first guess of an augmenting path's length, as a part of the joint box's diagonal.
const FIRST_REACH: f64 = 1e-4;
/// A search that finds no free target is repeated with its reach multiplied by this.
const REACH_GROWTH: f64 = 4.0;
/// A reach beyond which there is no sense in pruning: costs are at most 1.
const PRUNED_REACH: f64 = 4.0;
/// Beyond every slot but the padding.
const UNLIMITED: f64 = 0.5 * f64::FAR;

/// Completes a matching of `rows` to `targets`, in normalised coordinates, optimally.
pub struct Finish<'a> {
    pub rows: &'a Packed<f64>,
    pub targets: &'a Packed<f64>,
    /// Prices to start from; the nearer to optimal, the less there is to do.
    pub prices: Prices<f64>,
    /// Per row, its best slots at these prices.
    pub lists: Vec<List<f64>>,
}

impl Kernel for Finish<'_> {
    /// Per row, its slot.
    type Output = Vec<u32>;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> Vec<u32> {
        let n = self.rows.len();
        let matching = Matching { slot_of: vec![NONE; n], owner: vec![NONE; n], prices: self.prices };
        let mut state = Paths {
            rows: self.rows,
            targets: self.targets,
            matching,
            lists: self.lists,
            labels: vec![Label::default(); n],
            search: 0,
            settled: Vec::new(),
        };
        let mut free = state.claim_best();
        for _ in 0..REDUCTIONS {
            free = state.reduce(free);
        }
        let mut reach = FIRST_REACH;
        for row in free {
            let best = state.two_best(row as usize).best;
            loop {
                if let Some(end) = state.search(row, best, reach) {
                    state.augment(row, end);
                    break;
                }
                reach = if reach > PRUNED_REACH { UNLIMITED } else { reach * REACH_GROWTH };
            }
            reach = reach.min(PRUNED_REACH);
        }
        state.matching.slot_of
    }
}

/// A slot's tentative distance from the search's root.
#[derive(Clone, Copy, Default)]
struct Label {
    /// The search that wrote this label; older ones do not count.
    search: u32,
    /// The row before the slot on its shortest path.
    from: u32,
    distance: f64,
}

/// A matching under repair. Invariant: a matched row's slot is (one of) its cheapest.
struct Paths<'a> {
    rows: &'a Packed<f64>,
    targets: &'a Packed<f64>,
    matching: Matching<f64>,
    lists: Vec<List<f64>>,
    labels: Vec<Label>,
    search: u32,
    /// Slots whose distance is final in the current search.
    settled: Vec<u32>,
}

/// A heap entry: nearest first, ties by slot.
#[derive(PartialEq)]
struct Entry {
    distance: f64,
    slot: u32,
}

impl Eq for Entry {}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.distance.total_cmp(&other.distance).then(self.slot.cmp(&other.slot))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Paths<'_> {
    /// The two best slots of a row at the current prices.
    #[inline(always)]
    fn two_best(&mut self, row: usize) -> TwoBest<f64> {
        self.lists[row].two_best(self.targets, &mut self.matching.prices, self.rows.point(row))
    }

    /// Gives every row its cheapest slot if nobody has it yet; returns the rows left without.
    #[inline(always)]
    fn claim_best(&mut self) -> Vec<u32> {
        let mut free = Vec::new();
        for row in 0..self.rows.len() {
            let slot = self.two_best(row).slot;
            if self.matching.owner[slot] == NONE {
                self.matching.give(row as u32, slot);
            } else {
                free.push(row as u32);
            }
        }
        free
    }

    /// One round of augmenting row reduction: each free row takes its best slot and raises its price
    /// to where the second best is as good; the row pushed out goes on at once if the price rose, and
    /// waits for the next round if it did not.
    #[inline(always)]
    fn reduce(&mut self, free: Vec<u32>) -> Vec<u32> {
        let mut left = Vec::new();
        let mut bids_left = 10 * self.rows.len();
        for first in free {
            let mut row = first;
            while row != NONE {
                let found = self.two_best(row as usize);
                let before = self.matching.prices.get(found.slot);
                let raised = before + (found.second - found.best);
                let rose = raised > before && found.second < f64::FAR;
                if !rose && self.matching.owner[found.slot] != NONE || bids_left == 0 {
                    left.push(row);
                    break;
                }
                bids_left -= 1;
                if rose {
                    self.matching.prices.raise(found.slot, raised);
                }
                row = self.matching.give(row, found.slot);
            }
        }
        left
    }

    /// Dijkstra's algorithm on reduced costs from a free row to the nearest free slot, no farther than
    /// `reach`. On success the prices of the settled slots are raised, which keeps the invariant and
    /// makes the path's edges tight.
    #[inline(always)]
    fn search(&mut self, root: u32, best: f64, mut reach: f64) -> Option<usize> {
        self.search += 1;
        self.settled.clear();
        let mut heap = BinaryHeap::new();
        self.relax(root, Step { cheapest: best, distance: 0.0 }, &mut reach, &mut heap);
        while let Some(Reverse(Entry { distance, slot })) = heap.pop() {
            let slot = slot as usize;
            if distance > self.labels[slot].distance {
                continue;
            }
            let row = self.matching.owner[slot];
            if row == NONE {
                for &settled in &self.settled {
                    let settled = settled as usize;
                    let price = self.matching.prices.get(settled);
                    self.matching.prices.raise(settled, price + (distance - self.labels[settled].distance));
                }
                return Some(slot);
            }
            self.settled.push(slot as u32);
            let step = Step { cheapest: self.cheapest(row as usize, slot), distance };
            self.relax(row, step, &mut reach, &mut heap);
        }
        None
    }

    /// Cost plus price of a row's own slot, which is its cheapest.
    #[inline(always)]
    fn cheapest(&self, row: usize, slot: usize) -> f64 {
        let (u, v) = (self.rows.point(row), self.targets.point(slot));
        let (dx, dy, dz) = (v[0] - u[0], v[1] - u[1], v[2] - u[2]);
        (dx * dx + dy * dy + dz * dz).sqrt() + self.matching.prices.get(slot)
    }

    /// Lowers the labels of the slots that are reached sooner through `row`.
    #[inline(always)]
    fn relax(&mut self, row: u32, step: Step, reach: &mut f64, heap: &mut BinaryHeap<Reverse<Entry>>) {
        let mut visitor = Relax {
            row,
            step,
            reach: *reach,
            search: self.search,
            labels: &mut self.labels,
            owner: &self.matching.owner,
            heap,
        };
        let list = &mut self.lists[row as usize];
        let prices = &mut self.matching.prices;
        if !visitor.offered_by(list, prices) {
            prices.refit(self.targets);
            list.renew(self.targets, prices, self.rows.point(row as usize));
            if !visitor.offered_by(list, prices) {
                self.targets.scan(
                    prices,
                    Distance,
                    self.rows.point(row as usize),
                    list.first_block(),
                    &mut visitor,
                );
            }
        }
        *reach = visitor.reach;
    }
}

/// Where a search stands when it goes on from a row.
#[derive(Clone, Copy)]
struct Step {
    /// Cost plus price of the row's cheapest slot.
    cheapest: f64,
    /// The row's distance from the root.
    distance: f64,
}

/// The scan of [`Paths::relax`].
struct Relax<'a> {
    row: u32,
    step: Step,
    /// Distance of the nearest free slot so far, or how far to look.
    reach: f64,
    search: u32,
    labels: &'a mut [Label],
    owner: &'a [u32],
    heap: &'a mut BinaryHeap<Reverse<Entry>>,
}

impl Visitor<f64> for Relax<'_> {
    #[inline(always)]
    fn visit(&mut self, block: usize, values: &[f64; BLOCK]) -> f64 {
        if any_below(values, self.limit()) {
            for (k, &value) in values.iter().enumerate() {
                self.offer(block * BLOCK + k, value);
            }
        }
        self.limit()
    }
}

impl Relax<'_> {
    /// The least value (cost plus price) that is of no interest.
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.step.cheapest + (self.reach - self.step.distance)
    }

    /// Takes notice of a row's best slots; returns whether no other slot is of interest.
    #[inline(always)]
    fn offered_by(&mut self, list: &List<f64>, prices: &Prices<f64>) -> bool {
        for (slot, value) in list.values(prices) {
            self.offer(slot, value);
        }
        self.limit() <= list.rest()
    }

    /// Takes notice of a slot at cost plus price `value`.
    #[inline(always)]
    fn offer(&mut self, slot: usize, value: f64) {
        // Rounding may take a tight edge a hair below zero. Without the clamp a settled slot could be
        // lowered again, and the paths could close to a ring.
        let distance = self.step.distance + (value - self.step.cheapest).max(0.0);
        if distance < self.reach {
            self.lower(slot, distance);
        }
    }

    fn lower(&mut self, slot: usize, distance: f64) {
        let label = &mut self.labels[slot];
        if label.search == self.search && label.distance <= distance {
            return;
        }
        *label = Label { search: self.search, from: self.row, distance };
        self.heap.push(Reverse(Entry { distance, slot: slot as u32 }));
        if self.owner[slot] == NONE {
            self.reach = distance;
        }
    }
}

impl Paths<'_> {
    /// Shifts the matching along the path that ends at `end`, so that `root` gets a slot.
    #[inline(always)]
    fn augment(&mut self, root: u32, end: usize) {
        let mut slot = end;
        loop {
            let row = self.labels[slot].from;
            let next = self.matching.slot_of[row as usize];
            self.matching.owner[slot] = row;
            self.matching.slot_of[row as usize] = slot as u32;
            if row == root {
                return;
            }
            slot = next as usize;
        }
    }
}
