//! The next reachable cloud: a few small steps through the space of the earth mover's distance.
//!
//! A cloud, its goal, and a number and length of steps come in; the moved cloud goes out, point for
//! point. Both methods solve equation 1 of "Make a Donut" (You et al. 2025), `p' = p - alpha dEMD/dp`
//! K times over: by the matching that the exact distance has, or by the Sinkhorn divergence as in the
//! paper. Imports [`crate::math`].

use serde::{Deserialize, Serialize};

use super::error::{EmdError, Measure};
use super::exact::assign_within;
use super::schedule::Settings;
use super::sinkhorn::divergence;
use crate::math::cloud::{Point, norm, sub};

/// How much farther than necessary the matched points may be on average, as a part of one step.
const MATCHING_SLACK: f64 = 0.02;

/// How the next reachable cloud is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Along one matching, point to point: points keep their spacing. Clouds of equal size only.
    Exact,
    /// Along the gradient of the Sinkhorn divergence with the paper's settings: points crowd together
    /// where they share a target.
    Sinkhorn,
}

/// The cloud that is reached.
#[derive(Clone, Debug, PartialEq)]
pub struct Reachable {
    /// Shape (n, 3); row i is where point i goes.
    pub cloud: Vec<Point>,
    /// The goal point that each point is on its way to, where there is exactly one.
    pub target_of: Option<Vec<usize>>,
    /// Distance of the points from the goal before the move, by the method's estimator, m.
    pub emd: f64,
}

/// Moves `points` toward `goal` by `steps` steps of at most `step_length_m` each.
///
/// # Errors
/// If a cloud is empty or not finite, the step length is negative or not finite, or the method is
/// [`Method::Exact`] and the clouds differ in size.
pub fn next_reachable(
    points: &[Point],
    goal: &[Point],
    steps: usize,
    step_length_m: f64,
    method: Method,
) -> Result<Reachable, EmdError> {
    Measure::uniform(points).check()?;
    Measure::uniform(goal).check()?;
    if !(step_length_m.is_finite() && step_length_m >= 0.0) {
        return Err(EmdError::StepLength(step_length_m));
    }
    match method {
        Method::Exact => along_matching(points, goal, steps, step_length_m),
        Method::Sinkhorn => along_gradient(points, goal, steps, step_length_m),
    }
}

/// With p = 1 the gradient of each point has length 1/n and points at its match, and moving all points
/// straight toward their matches keeps the matching optimal. So one matching serves all steps: each
/// point goes `min(steps * step, distance)`. The matching is an auction's: its mean distance is within
/// 2 % of one step of the least possible.
fn along_matching(
    points: &[Point],
    goal: &[Point],
    steps: usize,
    step_length_m: f64,
) -> Result<Reachable, EmdError> {
    if points.len() != goal.len() {
        return Err(EmdError::Unequal { source_points: points.len(), target_points: goal.len() });
    }
    let matching = assign_within(points, goal, MATCHING_SLACK * step_length_m);
    let reach = steps as f64 * step_length_m;
    let pairs = points.iter().zip(&matching.target_of);
    let cloud = pairs.map(|(&p, &j)| add(p, clipped(sub(goal[j], p), reach))).collect();
    Ok(Reachable { cloud, target_of: Some(matching.target_of), emd: matching.mean_distance })
}

/// Gradient descent with alpha = n times the step length, since the gradient of each point is about
/// 1/n long. A point moves no farther than one step, and no farther than the mean of the targets that
/// the transport plan gives it: without that clip points that have arrived swing about their targets.
fn along_gradient(
    points: &[Point],
    goal: &[Point],
    steps: usize,
    step_length_m: f64,
) -> Result<Reachable, EmdError> {
    let alpha = step_length_m * points.len() as f64;
    let mut cloud = points.to_vec();
    let mut emd = None;
    for _ in 0..steps {
        let found =
            divergence::<f32>(Measure::uniform(&cloud), Measure::uniform(goal), &Settings::default())?;
        emd.get_or_insert(found.value);
        for (k, p) in cloud.iter_mut().enumerate() {
            let limit = step_length_m.min(norm(sub(found.image[k], *p)));
            *p = add(*p, clipped(found.gradient[k].map(|g| -alpha * g), limit));
        }
    }
    let emd = match emd {
        Some(value) => value,
        None => {
            divergence::<f32>(Measure::uniform(points), Measure::uniform(goal), &Settings::default())?.value
        }
    };
    Ok(Reachable { cloud, target_of: None, emd })
}

fn add(u: Point, v: Point) -> Point {
    std::array::from_fn(|axis| u[axis] + v[axis])
}

/// `v`, shortened to `longest` if it is longer.
fn clipped(v: Point, longest: f64) -> Point {
    let length = norm(v);
    if length > longest { v.map(|c| c * (longest / length)) } else { v }
}
