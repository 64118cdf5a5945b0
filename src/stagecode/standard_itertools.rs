//! `itertools`: combinations, products and chains of sequences.
//!
//! Sequences come in, all the items go out at once, charged before they are made; what has no end is a range.
//! Imports arguments, faults, values.

use super::args::{Arguments, Call, Row};
use super::error::{Fault, Raised};
use super::iterate::Steps;
use super::operators;
use super::value::Value;

/// The functions of the module.
pub const ROWS: &[Row] = &[
    Row::new("product", "*iterables repeat?", product),
    Row::new("combinations", "iterable r", |c| {
        arrangements(c, |at, next| at.last().is_none_or(|&l| l < next))
    }),
    Row::new("combinations_with_replacement", "iterable r", |c| {
        arrangements(c, |at, next| at.last().is_none_or(|&l| l <= next))
    }),
    Row::new("permutations", "iterable r?", |c| arrangements(c, |at, next| !at.contains(&next))),
    Row::new("chain", "*iterables", |c| joined(c, &c.rest)),
    Row::new("repeat", "object times?", |c| {
        if c.opt(1).is_none() {
            return Err(c.problem("needs the number of times"));
        }
        let times = usize::try_from(c.int(1)?).unwrap_or(0);
        c.eval.budget.allocate_items(times)?;
        Ok(Value::iter(vec![c.get(0)?.clone(); times]))
    }),
    Row::new("count", "start? step?", |c| match (c.int_or(0, 0)?, c.int_or(1, 1)?) {
        (_, 0) => Err(c.problem("the step must not be zero")),
        (start, step) => Ok(Value::Range(start, if step > 0 { i64::MAX } else { i64::MIN }, step)),
    }),
    Row::new("islice", "iterable start stop? step?", islice),
    Row::back("accumulate", "iterable func? initial?", accumulate),
    Row::new("pairwise", "iterable", |c| {
        let items = c.sequence(0)?;
        c.eval.budget.allocate_items(items.len())?;
        Ok(Value::iter(items.windows(2).map(|pair| Value::tuple(pair.to_vec())).collect()))
    }),
    Row::new("zip_longest", "*iterables fillvalue?", zip_longest),
    Row::back("starmap", "function iterable", |c| {
        let mut out = Vec::new();
        for item in c.sequence(1)? {
            let positional = c.eval.collect(&item)?;
            out.push(c.eval.call(c.get(0)?, Arguments { positional, keyword: Vec::new() })?);
        }
        Ok(Value::iter(out))
    }),
];

/// `itertools.chain.from_iterable`.
pub static FROM_ITERABLE: Row = Row::new("from_iterable", "iterable", |c| joined(c, &c.sequence(0)?));

fn joined(c: &Call, parts: &[Value]) -> Result<Value, Fault> {
    let mut all = Vec::new();
    for part in parts {
        let items = c.eval.collect(part)?;
        c.eval.budget.allocate_items(all.len().saturating_add(items.len()))?;
        all.extend(items);
    }
    Ok(Value::iter(all))
}

/// Every choice of one item of each, the last changing fastest.
fn product(c: &Call) -> Result<Value, Fault> {
    let once: Vec<Vec<Value>> = c.rest.iter().map(|v| c.eval.collect(v)).collect::<Result<_, _>>()?;
    let times = usize::try_from(c.int_or(1, 1)?).unwrap_or(0);
    c.eval.budget.allocate_items(once.len().saturating_mul(times))?;
    let pools: Vec<&Vec<Value>> = std::iter::repeat_n(&once, times).flatten().collect();
    let count = pools.iter().fold(1usize, |n, pool| n.saturating_mul(pool.len()));
    c.eval.budget.allocate_items(count.saturating_mul(pools.len().max(1)))?;
    let choice = |mut at: usize| {
        let mut items: Vec<Value> = Vec::with_capacity(pools.len());
        for pool in pools.iter().rev() {
            items.push(pool[at % pool.len()].clone());
            at /= pool.len();
        }
        items.reverse();
        Value::tuple(items)
    };
    Ok(Value::iter((0..count).map(choice).collect()))
}

/// All rows of `r` places, each of which `fits` behind those before it, in the order of the places.
fn arrangements(c: &Call, fits: fn(&[usize], usize) -> bool) -> Result<Value, Fault> {
    let items = c.sequence(0)?;
    let r = if c.opt(1).is_some() { c.count(1)? } else { items.len() };
    let mut out = Vec::new();
    let mut at: Vec<usize> = Vec::new();
    let mut next = 0;
    loop {
        c.eval.budget.charge((1 + at.len()).saturating_mul(1 + at.len()))?;
        if at.len() == r {
            c.eval.budget.allocate_items(out.len().saturating_add(1).saturating_mul(r.max(1)))?;
            out.push(Value::tuple(at.iter().map(|&i| items[i].clone()).collect()));
        } else if let Some(place) = (next..items.len()).find(|&place| fits(&at, place)) {
            at.push(place);
            next = 0;
            continue;
        }
        match at.pop() {
            Some(last) => next = last + 1,
            None => return Ok(Value::iter(out)),
        }
    }
}

fn islice(c: &Call) -> Result<Value, Fault> {
    let end = |at: usize| c.opt(at).map(|_| c.count(at)).transpose();
    let (start, stop) = if c.get(2).is_ok() { (end(1)?.unwrap_or(0), end(2)?) } else { (0, end(1)?) };
    let step = end(3)?.unwrap_or(1);
    if step == 0 {
        return Err(c.problem("the step must not be zero"));
    }
    let mut steps = Steps::of(c.get(0)?)?;
    let left = steps.remaining().min(stop.unwrap_or(usize::MAX));
    c.eval.budget.allocate_items(left)?;
    let taken: Vec<Value> = steps.by_ref().take(left).collect();
    Ok(Value::iter(taken.into_iter().skip(start).step_by(step).collect()))
}

fn accumulate(c: &Call) -> Result<Value, Raised> {
    let mut out: Vec<Value> = c.opt(2).cloned().into_iter().collect();
    for item in c.sequence(0)? {
        out.push(match (out.last(), c.opt(1)) {
            (None, _) => item,
            (Some(last), None) => {
                operators::binary(&c.eval.budget, ruff_python_ast::Operator::Add, last, &item)?
            }
            (Some(last), Some(function)) => {
                let positional = vec![last.clone(), item];
                c.eval.call(function, Arguments { positional, keyword: Vec::new() })?
            }
        });
    }
    Ok(Value::iter(out))
}

fn zip_longest(c: &Call) -> Result<Value, Fault> {
    let all: Vec<Vec<Value>> = c.rest.iter().map(|v| c.eval.collect(v)).collect::<Result<_, _>>()?;
    let count = all.iter().map(Vec::len).max().unwrap_or(0);
    c.eval.budget.allocate_items(count.saturating_mul(all.len()))?;
    let fill = c.opt(1).cloned().unwrap_or(Value::None);
    let row = |i: usize| all.iter().map(|items| items.get(i).unwrap_or(&fill).clone()).collect();
    Ok(Value::iter((0..count).map(|i| Value::tuple(row(i))).collect()))
}
