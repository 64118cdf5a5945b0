//! `choice`: picking from an array with and without replacement, with and without probabilities.
//!
//! A bound call comes in, the picked rows go out, in numpy's order for the same seed. Imports generators,
//! arguments, arrays, faults.

use std::collections::HashSet;

use super::args::Call;
use super::array::Array;
use super::error::Fault;
use super::random::Random;
use super::random_table::{generator, rows};
use super::value::Value;

/// Runs the call: `self a size? replace? p? axis? shuffle?`.
pub fn choice(c: &Call) -> Result<Value, Fault> {
    let pool = match c.get(1)? {
        Value::Number(_) => None,
        _ => Some(c.array(1)?),
    };
    let axis = match &pool {
        Some(a) => c.axis(5, a.ndim())?.unwrap_or(0),
        None => 0,
    };
    let n = match &pool {
        None => c.count(1)?,
        Some(a) => a.shape().get(axis).copied().unwrap_or(0),
    };
    let shape = if c.opt(2).is_some() { c.shape(2)? } else { Vec::new() };
    let count = c.eval.budget.allocate_shape(&shape)?;
    let replace = c.flag(3, true)?;
    if n == 0 && count > 0 || !replace && count > n {
        return Err(c.problem(format!("cannot pick {count} of {n}")));
    }
    c.eval.budget.allocate(n)?;
    let shares = if c.opt(4).is_some() { Some(checked_shares(c, n)?) } else { None };
    let mut random = generator(c)?.borrow_mut();
    let at = match (shares, replace) {
        (None, true) => (0..count).map(|_| random.below_or_at(n as u64 - 1) as usize).collect(),
        (None, false) => distinct(&mut random, n, count, c.flag(6, true)?),
        (Some(p), true) => {
            let steps = cumulative(&p);
            (0..count).map(|_| place(&steps, random.uniform())).collect()
        }
        (Some(p), false) => distinct_by_share(c, &mut random, p, count)?,
    };
    drop(random);
    let Some(pool) = pool else {
        return Ok(Value::array(Array::ints(at.into_iter().map(|i| i as i64).collect(), shape)));
    };
    if axis > 0 {
        let at = Array::ints(at.into_iter().map(|i| i as i64).collect(), shape);
        return super::numpy_place::along(c, &pool, axis, &Value::Array(at));
    }
    let picked = super::convert::to_array(&c.eval.budget, &rows(c, &pool, at)?, None)?;
    Ok(Value::array(picked.reshape([&shape, &picked.shape()[1..]].concat())))
}

fn checked_shares(c: &Call, n: usize) -> Result<Vec<f64>, Fault> {
    let p = c.floats(4)?;
    let sum: f64 = p.iter().sum();
    let fair = p.len() == n && p.iter().all(|x| *x >= 0.0) && (sum - 1.0).abs() < 1e-7;
    if fair { Ok(p) } else { Err(c.problem(format!("`p` must be {n} probabilities that add up to 1"))) }
}

/// Running sums that end at 1.
fn cumulative(p: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut steps: Vec<f64> = p
        .iter()
        .map(|x| {
            sum += x;
            sum
        })
        .collect();
    steps.iter_mut().for_each(|s| *s /= sum);
    steps
}

fn place(steps: &[f64], u: f64) -> usize {
    steps.partition_point(|&s| s <= u).min(steps.len() - 1)
}

/// Different places without probabilities. `RandomState` shuffles them all; `Generator` shuffles the tail
/// of a large pool or draws by Floyd's method from a small one.
fn distinct(random: &mut Random, n: usize, count: usize, shuffle: bool) -> Vec<usize> {
    let mut all: Vec<usize> = (0..n).collect();
    if random.is_legacy() {
        random.shuffle(&mut all);
        all.truncate(count);
        return all;
    }
    if n > 10_000 && count > n / if shuffle { 50 } else { 20 } {
        random.shuffle_tail(&mut all, n - count);
        return all.split_off(n - count);
    }
    let mut taken = HashSet::new();
    let mut picked = Vec::with_capacity(count);
    for last in n - count..n {
        let draw = random.below_or_at(last as u64) as usize;
        let one = if taken.contains(&draw) { last } else { draw };
        taken.insert(one);
        picked.push(one);
    }
    if shuffle {
        random.shuffle_tail(&mut picked, 1);
    }
    picked
}

/// Different places with probabilities: draws in rounds, leaving out what is taken.
fn distinct_by_share(
    c: &Call,
    random: &mut Random,
    mut p: Vec<f64>,
    count: usize,
) -> Result<Vec<usize>, Fault> {
    if p.iter().filter(|x| **x > 0.0).count() < count {
        return Err(c.problem("has fewer probabilities above zero than it is to pick"));
    }
    let mut picked: Vec<usize> = Vec::with_capacity(count);
    while picked.len() < count {
        c.eval.budget.charge(p.len())?;
        let draws: Vec<f64> = (picked.len()..count).map(|_| random.uniform()).collect();
        picked.iter().for_each(|&i| p[i] = 0.0);
        let steps = cumulative(&p);
        for u in draws {
            let at = place(&steps, u);
            if !picked.contains(&at) {
                picked.push(at);
            }
        }
    }
    Ok(picked)
}
