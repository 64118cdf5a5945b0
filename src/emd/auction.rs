//! The auction algorithm: a matching whose total cost is within n eps of the optimum.
//!
//! Two packed clouds of equal size come in; a matching and the prices that support it go out. Every
//! source bids for its best target and raises its price until no source would rather have another by
//! more than eps; eps shrinks from phase to phase and the prices stay (Bertsekas 1988, "The auction
//! algorithm: a distributed relaxation method for the assignment problem"). Large clouds start with
//! the prices that clusters of their points arrive at. Imports nothing of the
//! other layers.

use super::candidates::{List, TwoBest, least_values, renew_all};
use super::packed::{CLUSTER, Packed, Prices};
use super::real::Real;
use super::wide::{Kernel, widest};

/// Marks a source without target and a target without source.
pub const NONE: u32 = u32::MAX;

/// The first phase's eps where nothing is known of the prices, as a part of the joint box's diagonal
/// (which is 1 here).
const FIRST_EPS: f32 = 0.02;
/// The first phase's eps times n^(2/3) where prices come from an auction of clusters.
const REFINED_EPS: f32 = 0.07;
/// Each phase's eps is about the last one's divided by this.
const EPS_DIVISOR: f32 = 8.0;
/// Clouds of fewer points are not clustered.
const COARSEST: usize = 256;
/// How far above its second best a row first looks for slots to remember, in eps of the first phase.
const MARGIN: f32 = 20.0;
/// Bids per source after which the auction gives up. Clouds in general position need 20 to 40.
const PATIENCE: usize = 200;

/// A matching with the prices it was reached at. Rows are sources, slots are places in the packed targets.
pub struct Matching<T> {
    /// Per row, its slot, or [`NONE`].
    pub slot_of: Vec<u32>,
    /// Per slot, its row, or [`NONE`].
    pub owner: Vec<u32>,
    pub prices: Prices<T>,
}

impl<T: Real> Matching<T> {
    /// Gives `slot` to `row`; returns the row that had it, or [`NONE`].
    #[inline(always)]
    pub fn give(&mut self, row: u32, slot: usize) -> u32 {
        let before = std::mem::replace(&mut self.owner[slot], row);
        if before != NONE {
            self.slot_of[before as usize] = NONE;
        }
        self.slot_of[row as usize] = slot as u32;
        before
    }
}

/// An auction of `targets` among `rows`, in normalised coordinates, ending at `eps`.
pub struct Auction<'a> {
    pub rows: &'a Packed<f32>,
    pub targets: &'a Packed<f32>,
    pub eps: f32,
}

/// How an auction ended.
pub struct Auctioned {
    pub matching: Matching<f32>,
    /// Per row, its best slots.
    pub lists: Vec<List<f32>>,
    /// Whether every row has a target; if not, patience ran out and the prices are still of use.
    pub complete: bool,
}

impl Kernel for Auction<'_> {
    type Output = Auctioned;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> Auctioned {
        let n = self.rows.len();
        let Start { prices, hints } = self.start();
        let mut matching = Matching { slot_of: vec![NONE; n], owner: vec![NONE; n], prices };
        let margin = MARGIN * self.first_eps();
        let mut lists: Vec<List<f32>> = hints.into_iter().map(|slot| List::hint(slot, margin)).collect();
        renew_all(&mut lists, self.rows, self.targets, &matching.prices);
        let mut bids_left = PATIENCE.saturating_mul(n);
        for eps in self.phases() {
            matching.slot_of.fill(NONE);
            matching.owner.fill(NONE);
            bids_left = self.phase(&mut matching, &mut lists, eps, bids_left);
            if bids_left == 0 {
                break;
            }
        }
        Auctioned { complete: bids_left > 0, matching, lists }
    }
}

/// Where an auction begins.
struct Start {
    prices: Prices<f32>,
    /// Per row, a slot that is likely to be good.
    hints: Vec<u32>,
}

impl Auction<'_> {
    /// Prices from an auction of clusters, carried to the points by the rule that makes them dual to
    /// the coarse rows' values: a target is as dear as the row that gains most from it can bear.
    fn start(&self) -> Start {
        let n = self.rows.len();
        if n < COARSEST {
            let hints = (0..n as u32).collect();
            return Start { prices: Prices::new(self.targets, |_| 0.0), hints };
        }
        let [rows, targets] = [self.rows, self.targets].map(|cloud| {
            let means = cloud.cluster_means();
            let order = (0..means.len() as u32).collect();
            Packed::new(&means, order)
        });
        let coarse = Auction { rows: &rows, targets: &targets, eps: self.first_eps() };
        let Matching { slot_of, mut prices, .. } = widest(coarse).matching;
        prices.refit(&targets);
        let values = least_values(&rows, &targets, &prices);
        let gains = least_values(self.targets, &rows, &Prices::new(&rows, |row| -values[row]));
        let hint = |row: usize| match slot_of[row / CLUSTER] {
            NONE => row as u32,
            cluster => cluster * CLUSTER as u32,
        };
        Start { prices: Prices::new(self.targets, |slot| -gains[slot]), hints: (0..n).map(hint).collect() }
    }

    /// The first phase's eps: large for prices that know nothing, else about what the prices of a
    /// coarser cloud are wrong by.
    fn first_eps(&self) -> f32 {
        let n = self.rows.len();
        let eps = if n < COARSEST { FIRST_EPS } else { REFINED_EPS / (n as f32).powf(2.0 / 3.0) };
        eps.max(self.eps)
    }

    /// The eps of each phase: evenly down to the last one, for a small last step costs as many bids as
    /// a large one.
    fn phases(&self) -> Vec<f32> {
        let first = self.first_eps();
        let steps = ((first / self.eps).ln() / EPS_DIVISOR.ln()).round().max(0.0) as i32;
        let ratio = (first / self.eps).powf(1.0 / steps.max(1) as f32);
        (0..=steps).rev().map(|k| self.eps * ratio.powi(k)).collect()
    }

    /// Bids until every row has a slot or no bids are left; returns how many are left.
    #[inline(always)]
    fn phase(
        &self,
        matching: &mut Matching<f32>,
        lists: &mut [List<f32>],
        eps: f32,
        mut bids_left: usize,
    ) -> usize {
        let mut waiting: Vec<u32> = (0..self.rows.len() as u32).rev().collect();
        while let Some(row) = waiting.pop() {
            if bids_left == 0 {
                break;
            }
            bids_left -= 1;
            let list = &mut lists[row as usize];
            let TwoBest { best, second, slot } =
                list.two_best(self.targets, &mut matching.prices, self.rows.point(row as usize));
            // A single target has no second best: any raise will do.
            let raise = if second < f32::FAR { second - best } else { 0.0 };
            matching.prices.raise(slot, matching.prices.get(slot) + raise + eps);
            let outbid = matching.give(row, slot);
            if outbid != NONE {
                waiting.push(outbid);
            }
        }
        bids_left
    }
}
