//! Finite-difference checks of adjoints, shared by the tests of every kernel.
//!
//! Takes a function and its adjoint as closures over flat vectors; panics with the figures when the two
//! disagree. One tolerance rule for all: finite, and `|adj - fd| <= absolute + relative |fd|`.

use super::rng::{Pcg64, normal};

/// How far an adjoint may be from the finite difference.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Relative part.
    pub relative: f64,
    /// Absolute part.
    pub absolute: f64,
}

/// Checks `<J dx, y_adj> = <dx, J^T y_adj>` in a random direction and for a random output adjoint, `J dx`
/// by a central difference in f64.
///
/// # Panics
/// If the two sides differ by more than the tolerance, or are not finite.
pub fn directional(
    rng: &mut Pcg64,
    x: &[f64],
    f: impl Fn(&[f64]) -> Vec<f64>,
    adj: impl Fn(&[f64], &[f64]) -> Vec<f64>,
    tolerance: Tolerance,
) {
    let scale = x.iter().fold(0.0f64, |m, v| m.max(v.abs())).max(1e-3);
    directional_scaled(rng, x, &vec![scale; x.len()], f, adj, tolerance);
}

/// [`directional`] with a scale for each input, for inputs of different magnitude.
///
/// # Panics
/// As [`directional`].
pub fn directional_scaled(
    rng: &mut Pcg64,
    x: &[f64],
    scale: &[f64],
    f: impl Fn(&[f64]) -> Vec<f64>,
    adj: impl Fn(&[f64], &[f64]) -> Vec<f64>,
    tolerance: Tolerance,
) {
    let direction: Vec<f64> = scale.iter().map(|s| s * normal(rng)).collect();
    let y_adj: Vec<f64> = f(x).iter().map(|_| normal(rng)).collect();
    let step = 1e-6;
    let at = |h: f64| -> f64 {
        let moved: Vec<f64> = x.iter().zip(&direction).map(|(x, d)| x + h * d).collect();
        f(&moved).iter().zip(&y_adj).map(|(y, a)| y * a).sum()
    };
    let fd = (at(step) - at(-step)) / (2.0 * step);
    let by_adjoint: f64 = adj(x, &y_adj).iter().zip(&direction).map(|(a, d)| a * d).sum();
    assert!(
        by_adjoint.is_finite()
            && (by_adjoint - fd).abs() <= tolerance.absolute + tolerance.relative * fd.abs(),
        "adjoint {by_adjoint:e}, finite difference {fd:e}, at {x:?}"
    );
}
