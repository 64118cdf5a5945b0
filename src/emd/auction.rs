//! The auction algorithm: a matching whose total cost is within n eps of the optimum.
//!
//! Two packed clouds of equal size come in; a matching and the prices that support it go out. Every
//! source bids for its best target and raises its price until no source would rather have another by
//! more than eps; eps shrinks from phase to phase and the prices stay (Bertsekas 1988, "The auction
//! algorithm: a distributed relaxation method for the assignment problem"). Imports nothing of the
//! other layers.

use super::cost::Distance;
use super::packed::{BLOCK, Packed, Prices, Visitor, any_below};
use super::real::Real;
use super::wide::Kernel;

/// Marks a source without target and a target without source.
pub const NONE: u32 = u32::MAX;

/// The first phase's eps, as a part of the joint box's diagonal (which is 1 here).
const FIRST_EPS: f32 = 0.02;
/// Each phase's eps is about the last one's divided by this.
const EPS_DIVISOR: f32 = 5.0;
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

/// The cheapest slot for a row at the current prices, and what the second cheapest would cost.
pub struct TwoBest<T> {
    pub best: T,
    pub second: T,
    pub slot: usize,
}

impl<T: Real> TwoBest<T> {
    /// Looks for the two best slots for a row at `u`; `hint` is a slot that is likely to be good.
    #[inline(always)]
    pub fn find(targets: &Packed<T>, prices: &Prices<T>, u: [T; 3], hint: usize) -> Self {
        let mut found = Self { best: T::INFINITY, second: T::INFINITY, slot: hint };
        targets.scan(prices, Distance, u, hint / BLOCK, &mut found);
        found
    }
}

impl<T: Real> Visitor<T> for TwoBest<T> {
    #[inline(always)]
    fn visit(&mut self, block: usize, values: &[T; BLOCK]) -> T {
        if any_below(values, self.second) {
            for (k, &value) in values.iter().enumerate() {
                if value < self.best {
                    self.second = self.best;
                    self.best = value;
                    self.slot = block * BLOCK + k;
                } else if value < self.second {
                    self.second = value;
                }
            }
        }
        self.second
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
    /// Whether every row has a target; if not, patience ran out and the prices are still of use.
    pub complete: bool,
}

impl Kernel for Auction<'_> {
    type Output = Auctioned;

    #[inline(always)]
    fn run(self) -> Auctioned {
        let n = self.rows.len();
        let mut matching = Matching {
            slot_of: vec![NONE; n],
            owner: vec![NONE; n],
            prices: Prices::new(self.targets, |_| 0.0),
        };
        let mut hints: Vec<u32> = (0..n as u32).collect();
        let mut bids_left = PATIENCE.saturating_mul(n);
        for eps in self.phases() {
            matching.slot_of.fill(NONE);
            matching.owner.fill(NONE);
            bids_left = self.phase(&mut matching, &mut hints, eps, bids_left);
            if bids_left == 0 {
                break;
            }
        }
        Auctioned { complete: bids_left > 0, matching }
    }
}

impl Auction<'_> {
    /// The eps of each phase: evenly down to the last one, for a small last step costs as many bids as
    /// a large one.
    #[inline(always)]
    fn phases(&self) -> Vec<f32> {
        let steps = ((FIRST_EPS / self.eps).ln() / EPS_DIVISOR.ln()).round().max(0.0) as i32;
        let ratio = (FIRST_EPS / self.eps).max(1.0).powf(1.0 / steps.max(1) as f32);
        (0..=steps).rev().map(|k| self.eps * ratio.powi(k)).collect()
    }

    /// Bids until every row has a slot or no bids are left; returns how many are left.
    #[inline(always)]
    fn phase(
        &self,
        matching: &mut Matching<f32>,
        hints: &mut [u32],
        eps: f32,
        mut bids_left: usize,
    ) -> usize {
        let mut waiting: Vec<u32> = (0..self.rows.len() as u32).rev().collect();
        while let Some(row) = waiting.pop() {
            if bids_left == 0 {
                break;
            }
            bids_left -= 1;
            let u = self.rows.point(row as usize);
            let hint = hints[row as usize] as usize;
            let TwoBest { best, second, slot } = TwoBest::find(self.targets, &matching.prices, u, hint);
            // A single target has no second best: any raise will do.
            let raise = if second < f32::FAR { second - best } else { 0.0 };
            matching.prices.set(self.targets, slot, matching.prices.get(slot) + raise + eps);
            hints[row as usize] = slot as u32;
            let outbid = matching.give(row, slot);
            if outbid != NONE {
                waiting.push(outbid);
            }
        }
        bids_left
    }
}
