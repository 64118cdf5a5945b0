//! GeomLoss's Sinkhorn divergence between weighted clouds, with its gradient.
//!
//! Two measures and the settings come in; value, gradient and how far the iteration got go out. The
//! iteration is that of Feydy, Séjourné, Vialard, Amari, Trouvé & Peyré 2019, "Interpolating between
//! optimal transport and MMD using Sinkhorn divergences", as the GeomLoss library runs it: one
//! averaged update per temperature and no test of convergence. Imports [`crate::math`].

use super::cost::{ClampedDistance, Cost, HalfSquare};
use super::error::{EmdError, Measure};
use super::order::compact_order;
use super::packed::{Packed, Prices, normalised};
use super::pairs::{Half, update, update_self};
use super::real::Real;
use super::schedule::{Power, Settings};
use super::softmin::Pass;
use crate::math::cloud::Point;

/// GeomLoss's p = 1 cost is constant below the root of this, in the unit of the coordinates squared.
const DISTANCE_CLAMP: f64 = 1e-8;
/// The logarithm that stands for that of a weight of 0.
const LOG_OF_ZERO: f64 = -1e5;
/// A transport plan counts as converged if no more than this part of the mass is misplaced.
const CONVERGED: f64 = 1e-2;
/// The marginal error of a plan that brings all mass to wrong targets.
const WHOLLY_MISPLACED: f64 = 2.0;

/// A Sinkhorn divergence and what came with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Divergence {
    /// In the unit of the coordinates to the power p.
    pub value: f64,
    /// Derivative of the value with respect to each source point, shape (n, 3). As in GeomLoss, only
    /// the last update is differentiated, its dual potentials held fixed; that is the true gradient
    /// where the iteration has converged.
    pub gradient: Vec<Point>,
    /// Where the transport plan brings each source point, shape (n, 3): the mean of the targets its
    /// mass goes to. Several points may share a target.
    pub image: Vec<Point>,
    /// Updates of the dual potentials.
    pub iterations: usize,
    /// How much mass the transport plan brings to the wrong targets: sum |column sum - weight|, of 2
    /// at most.
    pub marginal_error: f64,
    /// Whether the marginal error is below 1 %. With the paper's scaling of 0.5 it rarely is.
    pub converged: bool,
}

/// The Sinkhorn divergence of `source` from `target`, computed in `T`.
///
/// # Errors
/// If a cloud is empty or not finite, weights are negative or do not sum to 1, a setting is out of its
/// range, or diameter and blur are so many orders of magnitude apart that `T` cannot hold what comes out.
pub fn divergence<T: Real>(
    source: Measure,
    target: Measure,
    settings: &Settings,
) -> Result<Divergence, EmdError> {
    settings.check()?;
    source.check()?;
    target.check()?;
    let (x, y, diagonal) = normalised(source.points, target.points);
    let Some(diameter) = settings.diameter.or((diagonal > 0.0).then_some(diagonal)) else {
        return Ok(Divergence {
            value: 0.0,
            gradient: vec![[0.0; 3]; source.points.len()],
            image: source.points.to_vec(),
            iterations: 0,
            marginal_error: 0.0,
            converged: true,
        });
    };
    settings.check_count(diameter)?;
    let unit = if diagonal > 0.0 { diagonal } else { 1.0 };
    let temperatures = settings.temperatures(diameter);
    let same = source.points == target.points && source.weights == target.weights;
    let clouds = [Side::<T>::new(&x, source), Side::new(&y, target)];
    let found = match settings.power {
        Power::One => {
            let cost = ClampedDistance { clamp: T::of(DISTANCE_CLAMP / (unit * unit)) };
            Problem { clouds, cost, debias: settings.debias, same, unit, p: 1 }
                .solve(source.points, &temperatures)
        }
        Power::Two => Problem { clouds, cost: HalfSquare, debias: settings.debias, same, unit, p: 2 }
            .solve(source.points, &temperatures),
    };
    let is_finite = found.value.is_finite() && found.gradient.iter().flatten().all(|v| v.is_finite());
    if is_finite { Ok(found) } else { Err(EmdError::OutOfRange) }
}

/// A packed measure. All numbers are in the packed order.
struct Side<T> {
    cloud: Packed<T>,
    weights: Vec<f64>,
    /// The same, rounded.
    shares: Vec<T>,
    log_weights: Vec<T>,
}

impl<T: Real> Side<T> {
    fn new(normalised: &[Point], measure: Measure) -> Self {
        let cloud = Packed::new(normalised, compact_order(normalised));
        let weights: Vec<f64> = cloud.order.iter().map(|&i| measure.weight(i as usize)).collect();
        let log = |&w: &f64| T::of(if w > 0.0 { w.ln() } else { LOG_OF_ZERO });
        let shares = weights.iter().map(|&w| T::of(w)).collect();
        Self { log_weights: weights.iter().map(log).collect(), weights, shares, cloud }
    }

    fn with<'a>(&'a self, potential: &'a [T]) -> Half<'a, T> {
        Half { cloud: &self.cloud, weights: &self.shares, log_weights: &self.log_weights, potential }
    }

    /// `sum_i weight_i potential_i`.
    fn integral(&self, potential: &[T]) -> f64 {
        self.weights.iter().zip(potential).map(|(&w, f)| w * f.wide()).sum()
    }
}

/// The dual potentials, in GeomLoss's names: `f_ba` and `f_aa` live on the source, `g_ab` and `g_bb` on
/// the target; `aa` and `bb` are empty when nothing is debiased.
struct Potentials<T> {
    f_ba: Vec<T>,
    g_ab: Vec<T>,
    f_aa: Vec<T>,
    g_bb: Vec<T>,
}

/// A normalised problem: source and target in a box of diagonal 1.
struct Problem<T, C> {
    clouds: [Side<T>; 2],
    cost: C,
    debias: bool,
    /// Whether source and target are the same, point for point.
    same: bool,
    /// Length of 1 in the user's unit.
    unit: f64,
    p: i32,
}

impl<T: Real, C: Cost<T>> Problem<T, C> {
    /// The annealing: every update averaged with the potentials before it, but for the first and last.
    fn solve(&self, points: &[Point], temperatures: &[f64]) -> Divergence {
        let scale = self.unit.powi(self.p);
        let eps_of = |&temperature: &f64| T::of(temperature / scale);
        let (first, last) = (eps_of(&temperatures[0]), eps_of(&temperatures[temperatures.len() - 1]));
        let mut potentials = self.update(first, &self.zero());
        for eps in temperatures.iter().map(eps_of) {
            let updated = self.update(eps, &potentials);
            potentials = mean(&potentials, &updated);
        }
        let end = self.update(last, &potentials);
        let [source, target] = &self.clouds;
        let mut value = source.integral(&end.f_ba) + target.integral(&end.g_ab);
        if self.debias {
            value -= source.integral(&end.f_aa) + target.integral(&end.g_bb);
        }
        let marginal_error = self.marginal_error(last, &potentials, &end);
        let (gradient, offset) = self.pulls(last, &potentials, &end);
        let image = points.iter().zip(offset).map(|(p, d)| std::array::from_fn(|a| p[a] + d[a])).collect();
        Divergence {
            value: value * scale,
            gradient,
            image,
            iterations: temperatures.len() + 2,
            marginal_error,
            converged: marginal_error < CONVERGED,
        }
    }

    fn zero(&self) -> Potentials<T> {
        let [n, m] = [0, 1].map(|k| vec![T::ZERO; self.clouds[k].weights.len()]);
        Potentials { f_ba: n.clone(), g_ab: m.clone(), f_aa: n, g_bb: m }
    }

    /// The soft minima at `eps` from the potentials `old`: `softmin_j(C_ij - eps ln w_j - old_j)`.
    fn update(&self, eps: T, old: &Potentials<T>) -> Potentials<T> {
        let [x, y] = &self.clouds;
        let alone = |side: &Side<T>, potential: &[T]| update_self(side.with(potential), self.cost, eps);
        if self.same {
            // One problem, not three: what must cancel does so to the last bit.
            let f = alone(x, &old.f_ba);
            let debiasing = if self.debias { f.clone() } else { Vec::new() };
            return Potentials { g_ab: f.clone(), f_aa: debiasing.clone(), g_bb: debiasing, f_ba: f };
        }
        let [f_ba, g_ab] = update(x.with(&old.f_ba), y.with(&old.g_ab), self.cost, eps);
        let [f_aa, g_bb] =
            if self.debias { [alone(x, &old.f_aa), alone(y, &old.g_bb)] } else { [Vec::new(), Vec::new()] };
        Potentials { f_ba, g_ab, f_aa, g_bb }
    }

    fn pass<'a>(
        &self,
        eps: T,
        rows: &'a Side<T>,
        targets: &'a Side<T>,
        prices: &'a Prices<T>,
    ) -> Pass<'a, T, C> {
        Pass { rows: &rows.cloud, targets: &targets.cloud, prices, cost: self.cost, eps }
    }

    /// The gradient of the last update (from `before` to `end`) in the source points, and the way from
    /// each to its image, in the order of the source.
    fn pulls(&self, eps: T, before: &Potentials<T>, end: &Potentials<T>) -> (Vec<Point>, Vec<Point>) {
        let [x, y] = &self.clouds;
        let pulls = |targets: &Side<T>, potential: &[T], minima: &[T]| {
            self.pass(eps, x, targets, &targets.with(potential).prices(eps)).pulls(minima)
        };
        let toward = pulls(y, &before.g_ab, &end.f_ba);
        let apart = if self.debias { pulls(x, &before.f_aa, &end.f_aa) } else { Vec::new() };
        let scale = self.unit.powi(self.p - 1);
        let mut gradient = vec![[0.0; 3]; toward.len()];
        let mut offset = gradient.clone();
        for (row, &i) in x.cloud.order.iter().enumerate() {
            gradient[i as usize] = std::array::from_fn(|axis| {
                let apart = apart.get(row).map_or(0.0, |pull| pull.gradient[axis].wide());
                scale * x.weights[row] * (toward[row].gradient[axis].wide() - apart)
            });
            offset[i as usize] = toward[row].offset.map(|v| self.unit * v.wide());
        }
        (gradient, offset)
    }

    /// The plan of `f_ba` after the last update and `g_ab` before it has the right row sums; how far its
    /// column sums are from the target's weights is seen by updating `g_ab` once more.
    fn marginal_error(&self, eps: T, before: &Potentials<T>, end: &Potentials<T>) -> f64 {
        let [x, y] = &self.clouds;
        let next = self.pass(eps, y, x, &x.with(&end.f_ba).prices(eps)).soft_minima();
        let columns = before.g_ab.iter().zip(&next).zip(&y.weights);
        let misplaced =
            |((&g, &next), &b): ((&T, &T), &f64)| b * (((g - next) / eps).wide().exp() - 1.0).abs();
        // A column that rounding has sent far off, at a temperature near 0, may claim any amount of mass.
        columns.map(misplaced).sum::<f64>().min(WHOLLY_MISPLACED)
    }
}

fn mean<T: Real>(old: &Potentials<T>, new: &Potentials<T>) -> Potentials<T> {
    let mean =
        |a: &[T], b: &[T]| -> Vec<T> { a.iter().zip(b).map(|(&a, &b)| (a + b) * T::of(0.5)).collect() };
    Potentials {
        f_ba: mean(&old.f_ba, &new.f_ba),
        g_ab: mean(&old.g_ab, &new.g_ab),
        f_aa: mean(&old.f_aa, &new.f_aa),
        g_bb: mean(&old.g_bb, &new.g_bb),
    }
}
