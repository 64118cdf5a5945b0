//! Exact optimal transport between weighted clouds of any sizes.
//!
//! Two measures come in; the cost and the plan, of at most n + m - 1 shipments, go out. A primal
//! network simplex does it: the best arc of one source's row enters at a time (Kennington & Helgason
//! 1980, "Algorithms for Network Programming"; Bonneel et al. 2011 for its use on clouds). Imports
//! [`crate::math`].

use super::error::{EmdError, Measure};
use super::packed::normalised;
use super::schedule::Power;
use super::tree::Tree;
use crate::math::cloud::{Point, distance};

/// Most pairs that are accepted. 2 10^7 pairs take a few seconds; this many may take minutes.
const MOST_PAIRS: usize = 100_000_000;
/// A reduced cost above the negative of this is no gain; the largest cost is 1.
const NO_GAIN: f64 = 1e-12;
/// Pivots per node after which the simplex gives up. Clouds in general position need about 10.
const PATIENCE: usize = 10_000;

/// Mass that goes from one point to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shipment {
    /// Index of the source point.
    pub source: usize,
    /// Index of the target point.
    pub target: usize,
    /// Positive; all masses sum to 1.
    pub mass: f64,
}

/// An optimal transport plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Transport {
    /// Total cost: mean distance for p = 1, half the mean squared distance for p = 2.
    pub value: f64,
    /// Who ships how much where, by source and target.
    pub plan: Vec<Shipment>,
    /// Steps of the simplex.
    pub pivots: usize,
    /// Whether the simplex ended by proving the plan optimal and not by running out of patience.
    pub optimal: bool,
}

/// The optimal transport of `source` to `target` under |u - v| or |u - v|^2 / 2. Time grows about as
/// (n + m) m, memory as n + m.
///
/// # Errors
/// If a cloud is empty or not finite, weights are negative or do not sum to 1, or n m exceeds 10^8.
pub fn transport(source: Measure, target: Measure, power: Power) -> Result<Transport, EmdError> {
    source.check()?;
    target.check()?;
    let (n, m) = (source.points.len(), target.points.len());
    if n.saturating_mul(m) > MOST_PAIRS {
        return Err(EmdError::TooLarge { source_points: n, target_points: m });
    }
    let (x, y, diagonal) = normalised(source.points, target.points);
    let surplus = surplus(source, target);
    let mut simplex = Simplex {
        x,
        y,
        power,
        // Dearer than any way through the tree, so that no artificial arc stays in use.
        tree: Tree::star(&surplus, (n + m) as f64),
        row: 0,
    };
    let limit = PATIENCE * (n + m);
    let mut pivots = 0;
    let mut optimal = false;
    while pivots < limit && !optimal {
        optimal = !simplex.step();
        pivots += usize::from(!optimal);
    }
    let total: f64 = surplus[..n].iter().sum();
    let plan = simplex.plan(total);
    let cost = |s: &Shipment| s.mass * simplex.cost(s.source, s.target);
    let value = plan.iter().map(cost).sum::<f64>() * diagonal.powi(power.exponent());
    Ok(Transport { value, plan, pivots, optimal })
}

/// What each point has to give, sources first; targets have a negative surplus. Equal weights become
/// whole numbers, with which the flows stay exact.
fn surplus(source: Measure, target: Measure) -> Vec<f64> {
    let (n, m) = (source.points.len(), target.points.len());
    if source.weights.is_none() && target.weights.is_none() {
        return [vec![m as f64; n], vec![-(n as f64); m]].concat();
    }
    let given: f64 = (0..n).map(|i| source.weight(i)).sum();
    let taken: f64 = (0..m).map(|j| target.weight(j)).sum();
    let gives = (0..n).map(|i| source.weight(i) / given);
    let takes = (0..m).map(|j| -target.weight(j) / taken);
    gives.chain(takes).collect()
}

struct Simplex {
    /// Normalised points.
    x: Vec<Point>,
    y: Vec<Point>,
    power: Power,
    /// Sources, then targets, then the root.
    tree: Tree,
    /// The source to look at next.
    row: usize,
}

impl Simplex {
    fn cost(&self, i: usize, j: usize) -> f64 {
        let d = distance(self.x[i], self.y[j]);
        match self.power {
            Power::One => d,
            Power::Two => 0.5 * d * d,
        }
    }

    /// Lets the best arc of the next source that has a gain enter; false if none has.
    fn step(&mut self) -> bool {
        let n = self.x.len();
        for _ in 0..n {
            let i = self.row;
            self.row = (i + 1) % n;
            let own = self.tree.nodes[i].potential;
            let reduced = |j: usize| self.cost(i, j) + (own - self.tree.nodes[n + j].potential);
            let first = (0, reduced(0));
            let best =
                (1..self.y.len()).map(|j| (j, reduced(j))).fold(first, |a, b| if b.1 < a.1 { b } else { a });
            // Potentials may be as large as n + m, and are rounded accordingly.
            if best.1 < -NO_GAIN * (1.0 + own.abs()) {
                let cost = self.cost(i, best.0);
                self.tree.pivot(i, n + best.0, cost);
                return true;
            }
        }
        false
    }

    /// The flows on the arcs between sources and targets, with `total` as the unit.
    fn plan(&self, total: f64) -> Vec<Shipment> {
        let n = self.x.len();
        let root = n + self.y.len();
        let nodes = self.tree.nodes[..root].iter().enumerate();
        let used = nodes.filter(|(_, node)| node.parent != root && node.flow > 0.0);
        let mut plan: Vec<Shipment> = used
            .map(|(k, node)| {
                let (source, target) = (k.min(node.parent), k.max(node.parent) - n);
                Shipment { source, target, mass: node.flow / total }
            })
            .collect();
        plan.sort_by_key(|s| (s.source, s.target));
        plan
    }
}
