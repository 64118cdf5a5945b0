//! `np.random`: its functions, and the methods of `RandomState` and `Generator`.
//!
//! Every row takes the generator first; the functions of the module run on one that the evaluator holds,
//! which starts from seed 0, so that code without a seed gives the same clouds on every run. Imports
//! generators, arguments, arrays, faults.

use std::cell::RefCell;
use std::rc::Rc;

use super::args::{Call, Row};
use super::array::{Array, broadcast_shapes};
use super::array_index;
use super::error::Fault;
use super::random::Random;
use super::scalar::Dtype;
use super::value::Value;

/// Functions that make generators.
const MAKERS: &[Row] = &[
    Row::new("default_rng", "seed?", |c| {
        if let Some(same @ Value::Random(_)) = c.opt(0) {
            return Ok(same.clone());
        }
        if let Some(Value::List(_) | Value::Tuple(_) | Value::Array(_)) = c.opt(0) {
            let seed = |v: &Value| v.as_int().and_then(|i| u64::try_from(i).ok());
            let seeds: Option<Vec<u64>> = c.sequence(0)?.iter().map(seed).collect();
            let seeds = seeds.ok_or_else(|| c.problem("seeds must be integers that are not negative"))?;
            return Ok(made(Random::pcg64_of(&seeds)));
        }
        let seed = if c.opt(0).is_some() { seed(c, 0)? } else { c.eval.next_unseeded() };
        Ok(made(Random::pcg64(seed)))
    }),
    Row::new("PCG64", "seed?", |c| {
        let seed = if c.opt(0).is_some() { seed(c, 0)? } else { c.eval.next_unseeded() };
        Ok(made(Random::pcg64(seed)))
    }),
    Row::new("Generator", "bit_generator", |c| c.get(0).cloned()),
    Row::new("RandomState", "seed?", |c| {
        let seed = if c.opt(0).is_some() { seed(c, 0)? } else { c.eval.next_unseeded() };
        Ok(made(Random::legacy(legacy_seed(c, seed)?)))
    }),
];

/// Methods that both kinds of generator have.
const COMMON: &[Row] = &[
    Row::new("random", "self size? dtype?", |c| fill(c, 1, Random::uniform)),
    Row::new("uniform", "self low? high? size?", |c| {
        draw(c, [(1, 0.0), (2, 1.0)], 3, |r, [low, high]| low + (high - low) * r.uniform())
    }),
    Row::new("normal", "self loc? scale? size?", |c| {
        draw(c, [(1, 0.0), (2, 1.0)], 3, |r, [middle, width]| middle + width * r.normal())
    }),
    Row::new("lognormal", "self mean? sigma? size?", |c| {
        draw(c, [(1, 0.0), (2, 1.0)], 3, |r, [middle, width]| (middle + width * r.normal()).exp())
    }),
    Row::new("exponential", "self scale? size?", |c| {
        draw(c, [(1, 1.0)], 2, |r, [scale]| scale * r.exponential())
    }),
    Row::new("standard_exponential", "self size?", |c| fill(c, 1, Random::exponential)),
    Row::new("standard_normal", "self size? dtype?", |c| fill(c, 1, Random::normal)),
    Row::new("triangular", "self left mode right size?", |c| {
        draw(c, [(1, 0.0), (2, 0.0), (3, 0.0)], 4, |r, sides| triangular(r.uniform(), sides))
    }),
    Row::new("choice", "self a size? replace? p? axis? shuffle?", super::random_choice::choice),
    Row::new("permutation", "self x axis?", permutation),
    Row::new("shuffle", "self x axis?", shuffle),
];

/// Methods of `Generator` alone.
const GENERATOR: &[Row] = &[Row::new("integers", "self low high? size? dtype? endpoint?", |c| {
    let endpoint = c.flag(5, false)?;
    integers(c, endpoint)
})];

/// Methods of `RandomState` alone.
const LEGACY: &[Row] = &[
    Row::new("rand", "self *shape", |c| fill_rest(c, Random::uniform)),
    Row::new("randn", "self *shape", |c| fill_rest(c, Random::normal)),
    Row::new("random_sample", "self size?", |c| fill(c, 1, Random::uniform)),
    Row::new("ranf", "self size?", |c| fill(c, 1, Random::uniform)),
    Row::new("sample", "self size?", |c| fill(c, 1, Random::uniform)),
    Row::new("randint", "self low high? size? dtype?", |c| integers(c, false)),
    Row::new("seed", "self seed?", |c| {
        let seed = if c.opt(1).is_some() { seed(c, 1)? } else { c.eval.next_unseeded() };
        *generator(c)?.borrow_mut() = Random::legacy(legacy_seed(c, seed)?);
        Ok(Value::None)
    }),
];

/// Methods of a generator.
pub fn methods(legacy: bool) -> impl Iterator<Item = &'static Row> + Clone {
    COMMON.iter().chain(if legacy { LEGACY } else { GENERATOR })
}

/// Functions of the module that are not methods of its generator.
pub fn makers() -> impl Iterator<Item = &'static Row> + Clone {
    MAKERS.iter()
}

fn made(random: Random) -> Value {
    Value::Random(Rc::new(RefCell::new(random)))
}

/// The generator of a call.
pub fn generator<'a>(c: &'a Call) -> Result<&'a RefCell<Random>, Fault> {
    match c.get(0)? {
        Value::Random(random) => Ok(random),
        _ => Err(c.problem("needs a random generator")),
    }
}

fn seed(c: &Call, at: usize) -> Result<u64, Fault> {
    u64::try_from(c.int(at)?).map_err(|_| c.problem("a seed must not be negative"))
}

fn legacy_seed(c: &Call, seed: u64) -> Result<u32, Fault> {
    u32::try_from(seed).map_err(|_| c.problem("a seed must be below 2**32"))
}

/// Draws without parameters; `size` is the argument with the shape.
fn fill(c: &Call, size: usize, next: fn(&mut Random) -> f64) -> Result<Value, Fault> {
    draw(c, [], size, |r, []| next(r))
}

/// Draws into a shape given as separate arguments.
fn fill_rest(c: &Call, next: fn(&mut Random) -> f64) -> Result<Value, Fault> {
    let shape = super::convert::to_shape(&Value::tuple(c.rest.clone()))?;
    let count = c.eval.budget.allocate_shape(&shape)?;
    let mut random = generator(c)?.borrow_mut();
    if shape.is_empty() {
        return Ok(Value::float(next(&mut random)));
    }
    let all = (0..count).map(|_| next(&mut random)).collect();
    Ok(Value::array(Array::floats(all, shape)))
}

/// Draws with parameters that stretch to each other and to `size`. A parameter is the place of its
/// argument and its default.
fn draw<const N: usize>(
    c: &Call,
    parameters: [(usize, f64); N],
    size: usize,
    next: impl Fn(&mut Random, [f64; N]) -> f64,
) -> Result<Value, Fault> {
    let mut arrays = Vec::with_capacity(N);
    for (at, default) in parameters {
        let given = c.opt(at).is_some();
        arrays.push(if given { c.array(at)? } else { Array::floats(vec![default], Vec::new()) });
    }
    let common = arrays.iter().try_fold(Vec::new(), |s, a| broadcast_shapes(&s, a.shape()))?;
    let shape = if c.opt(size).is_some() { c.shape(size)? } else { common };
    let count = c.eval.budget.allocate_shape(&shape)?;
    let mut columns = Vec::with_capacity(N);
    for array in &arrays {
        // One number serves all draws; it is not stretched in memory.
        columns.push(if array.size() == 1 {
            array.to_floats()
        } else {
            array.broadcast(&shape)?.to_floats()
        });
    }
    let mut random = generator(c)?.borrow_mut();
    let all: Vec<f64> = (0..count)
        .map(|i| next(&mut random, std::array::from_fn(|p| columns[p][i.min(columns[p].len() - 1)])))
        .collect();
    let dtype = if c.opt(size + 1).is_some() { c.dtype(size + 1)? } else { None };
    if let ([], &[one]) = (&shape[..], &all[..]) {
        // numpy returns a float of Python's.
        return Ok(Value::float(one));
    }
    Ok(Value::array(Array::floats_as(all, dtype.unwrap_or(Dtype::F64), shape)))
}

/// The triangular distribution by inversion of a uniform number.
fn triangular(u: f64, [left, mode, right]: [f64; 3]) -> f64 {
    let base = right - left;
    let ratio = (mode - left) / base;
    if u <= ratio {
        left + (u * base * (mode - left)).sqrt()
    } else {
        right - ((1.0 - u) * base * (right - mode)).sqrt()
    }
}

fn integers(c: &Call, endpoint: bool) -> Result<Value, Fault> {
    let (low, high) = if c.opt(2).is_some() { (c.int(1)?, c.int(2)?) } else { (0, c.int(1)?) };
    let last = if endpoint { Some(high) } else { high.checked_sub(1) };
    let span = last.filter(|&last| last >= low).map(|last| last.wrapping_sub(low) as u64);
    let span = span.ok_or_else(|| c.problem("`low` must be below `high`"))?;
    let shape = if c.opt(3).is_some() { c.shape(3)? } else { Vec::new() };
    let count = c.eval.budget.allocate_shape(&shape)?;
    let mut random = generator(c)?.borrow_mut();
    let all: Vec<i64> = (0..count).map(|_| low.wrapping_add(random.below_or_at(span) as i64)).collect();
    if let (true, [], &[one]) = (random.is_legacy(), &shape[..], &all[..]) {
        // `randint` returns an integer of Python's, `integers` one of numpy's.
        return Ok(Value::int(one));
    }
    Ok(Value::array(Array::ints(all, shape)))
}

/// The rows of an array at these places.
pub fn rows(c: &Call, a: &Array, at: Vec<usize>) -> Result<Value, Fault> {
    let n = at.len();
    let at = Array::ints(at.into_iter().map(|i| i as i64).collect(), vec![n]);
    array_index::get(&c.eval.budget, a, &Value::Array(at))
}

fn permutation(c: &Call) -> Result<Value, Fault> {
    let axis = match c.get(1)? {
        Value::Number(_) => 0,
        _ => c.axis(2, c.array(1)?.ndim())?.unwrap_or(0),
    };
    let n = match c.get(1)? {
        Value::Number(_) => c.count(1)?,
        _ => c.array(1)?.shape().get(axis).copied().unwrap_or(0),
    };
    c.eval.budget.allocate(n)?;
    let mut at: Vec<usize> = (0..n).collect();
    generator(c)?.borrow_mut().shuffle(&mut at);
    match c.get(1)? {
        Value::Number(_) => {
            Ok(Value::Array(Array::ints(at.into_iter().map(|i| i as i64).collect(), vec![n])))
        }
        _ => {
            let at = Array::ints(at.into_iter().map(|i| i as i64).collect(), vec![n]);
            super::numpy_place::along(c, &c.array(1)?, axis, &Value::Array(at))
        }
    }
}

fn shuffle(c: &Call) -> Result<Value, Fault> {
    match c.get(1)? {
        Value::List(items) => {
            c.eval.budget.charge(items.0.borrow().len())?;
            generator(c)?.borrow_mut().shuffle(&mut items.0.borrow_mut());
        }
        Value::Array(a) if a.ndim() > 0 => {
            let axis = c.axis(2, a.ndim())?.unwrap_or(0);
            let mut order: Vec<usize> = (0..a.ndim()).filter(|&x| x != axis).collect();
            order.insert(0, axis);
            let a = &a.permute(&order);
            let n = a.shape()[0];
            c.eval.budget.allocate(n)?;
            let mut at: Vec<usize> = (0..n).collect();
            generator(c)?.borrow_mut().shuffle(&mut at);
            let mixed = rows(c, a, at)?;
            a.assign(&super::convert::to_array(&c.eval.budget, &mixed, None)?)?;
        }
        other => return Err(c.problem(format!("takes a list or an array, not {}", other.type_name()))),
    }
    Ok(Value::None)
}
