//! numpy functions that take elements out by place, and treat arrays as sets.
//!
//! Arrays come in, arrays go out. Imports arguments, arrays, faults.

use super::args::{Call, Row};
use super::array::Array;
use super::array_index;
use super::elementwise::{Op, binary_values};
use super::error::Fault;
use super::numpy_sort::order;
use super::value::Value;

/// The rows of this area.
pub const ROWS: &[Row] = &[
    Row::new("take", "a indices axis?", take),
    Row::new("compress", "condition a axis?", |c| compressed(c, 0, 1)),
    Row::new("diagonal", "a offset?", |c| {
        let a = c.array(0)?;
        let [rows, columns] = *a.shape() else { return Err(c.problem("takes a matrix")) };
        let offset = c.int_or(1, 0)?;
        let (down, right) = (offset.min(0).unsigned_abs() as usize, offset.max(0) as usize);
        let n = rows.saturating_sub(down).min(columns.saturating_sub(right));
        c.eval.budget.allocate(a.size())?;
        let all = a.to_floats();
        let out = (0..n).map(|i| all[(i + down) * columns + i + right]).collect();
        Ok(Value::Array(Array::floats_as(out, a.dtype(), vec![n])))
    }),
    Row::new("fill_diagonal", "a val", fill_diagonal),
    Row::new("unravel_index", "indices shape", unravel),
    Row::new("ravel_multi_index", "multi_index dims", |c| {
        let lengths = c.shape(1)?;
        let axes = c.sequence(0)?;
        if axes.len() != lengths.len() {
            return Err(c.problem("takes one array of indices for each axis"));
        }
        let mut flat = Value::int(0);
        for (axis, n) in axes.iter().zip(lengths) {
            flat = binary_values(&c.eval.budget, Op::Multiply, &flat, &Value::count(n))?;
            flat = binary_values(&c.eval.budget, Op::Add, &flat, axis)?;
        }
        Ok(flat)
    }),
    Row::new("triu_indices", "n k? m?", |c| triangle(c, |row, column, k| column >= row + k)),
    Row::new("tril_indices", "n k? m?", |c| triangle(c, |row, column, k| column <= row + k)),
    Row::new("diag_indices", "n ndim?", |c| {
        let n = c.count(0)?;
        c.eval.budget.allocate(n)?;
        let all = Value::Array(Array::ints((0..n as i64).collect(), vec![n]));
        Ok(Value::tuple(vec![all; c.int_or(1, 2)?.clamp(0, 16) as usize]))
    }),
    Row::new("ndindex", "*shape", |c| {
        let given = if let [one @ Value::Tuple(_)] = &c.rest[..] {
            one.clone()
        } else {
            Value::tuple(c.rest.clone())
        };
        let all = every_index(c, &super::convert::to_shape(&given)?)?;
        Ok(Value::iter(all.into_iter().map(Value::tuple).collect()))
    }),
    Row::new("ndenumerate", "arr", |c| {
        let a = c.array(0)?;
        let places = every_index(c, a.shape())?.into_iter().map(Value::tuple);
        let pairs =
            places.zip(a.to_scalars()).map(|(at, n)| Value::tuple(vec![at, Value::Number(n.numpys())]));
        Ok(Value::iter(pairs.collect()))
    }),
    Row::new("rot90", "m k?", rot90),
    Row::new("union1d", "ar1 ar2", |c| combined(c, |_, _| true)),
    Row::new("intersect1d", "ar1 ar2", |c| combined(c, |a, b| a && b)),
    Row::new("setdiff1d", "ar1 ar2", |c| combined(c, |a, b| a && !b)),
];

/// The elements, or the slices along an axis, at some places.
fn take(c: &Call) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    let axis = c.axis(2, a.ndim())?;
    c.eval.budget.allocate(a.size())?;
    if axis.is_none() {
        a = a.reshape(vec![a.size()]);
    }
    along(c, &a, axis.unwrap_or(0), c.get(1)?)
}

/// `a[..., index, ...]` with the index in the place of an axis.
pub fn along(c: &Call, a: &Array, axis: usize, index: &Value) -> Result<Value, Fault> {
    // A list of places is an index array, not a list of indices.
    let index = match index {
        Value::Number(_) => index.clone(),
        other => Value::Array(super::convert::to_array(&c.eval.budget, other, None)?),
    };
    let mut order: Vec<usize> = (0..a.ndim()).filter(|&x| x != axis).collect();
    order.insert(0, axis);
    let picked = array_index::get(&c.eval.budget, &a.permute(&order), &index)?;
    let Value::Array(picked) = picked else { return Ok(picked) };
    let added = picked.ndim() + 1 - a.ndim();
    let mut back: Vec<usize> = (added..picked.ndim()).collect();
    for k in (0..added).rev() {
        back.insert(axis.min(back.len()), k);
    }
    Ok(Value::array(picked.permute(&back)))
}

/// The slices of the array at `array` where the condition at `condition` holds; the axis stands behind them.
pub fn compressed(c: &Call, condition: usize, array: usize) -> Result<Value, Fault> {
    let mut a = c.array(array)?;
    let axis = c.axis(2, a.ndim())?;
    c.eval.budget.allocate(a.size())?;
    if axis.is_none() {
        a = a.reshape(vec![a.size()]);
    }
    let length = a.shape().get(axis.unwrap_or(0)).copied().unwrap_or(0);
    let keep = c.array(condition)?.to_bools();
    let at: Vec<i64> = (0..keep.len().min(length)).filter(|&i| keep[i]).map(|i| i as i64).collect();
    let n = at.len();
    along(c, &a, axis.unwrap_or(0), &Value::Array(Array::ints(at, vec![n])))
}

fn fill_diagonal(c: &Call) -> Result<Value, Fault> {
    let Value::Array(a) = c.get(0)? else { return Err(c.problem("takes an array")) };
    let [rows, columns] = *a.shape() else { return Err(c.problem("takes a matrix")) };
    let values = c.array(1)?;
    if values.size() == 0 {
        return Err(c.problem("needs a value"));
    }
    c.eval.budget.allocate(a.size())?;
    let given = values.to_floats();
    let mut all = a.to_floats();
    (0..rows.min(columns)).for_each(|i| all[i * columns + i] = given[i % given.len()]);
    a.assign(&Array::floats_as(all, a.dtype(), vec![rows, columns]))?;
    Ok(Value::None)
}

fn rot90(c: &Call) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    if a.ndim() < 2 {
        return Err(c.problem("takes an array with two axes or more"));
    }
    let mut order: Vec<usize> = (0..a.ndim()).collect();
    order.swap(0, 1);
    for _ in 0..c.int_or(1, 1)?.rem_euclid(4) {
        a = a.permute(&order);
        let n = a.shape()[0];
        if n > 0 {
            a = a.slice(0, n - 1, -1, n);
        }
    }
    Ok(Value::array(a))
}

/// The sorted distinct elements of both arrays for which `keep(in the first, in the second)` holds.
fn combined(c: &Call, keep: fn(bool, bool) -> bool) -> Result<Value, Fault> {
    let (a, b) = (c.array(0)?, c.array(1)?);
    let count = a.size().saturating_add(b.size());
    c.eval.budget.charge(count.saturating_mul(32))?;
    c.eval.budget.allocate(count)?;
    let rising = |a: &Array| {
        let all = a.to_floats();
        let mut sorted: Vec<f64> = order(&all).into_iter().map(|i| all[i]).collect();
        sorted.dedup();
        sorted
    };
    let (x, y) = (rising(&a), rising(&b));
    let both = [&x[..], &y[..]].concat();
    let mut all: Vec<f64> = order(&both).into_iter().map(|i| both[i]).collect();
    all.dedup();
    let has = |sorted: &[f64], v: f64| sorted.binary_search_by(|p| p.total_cmp(&v)).is_ok();
    all.retain(|&v| keep(has(&x, v), has(&y, v)));
    let (n, dtype) = (all.len(), a.dtype().promote(b.dtype()));
    Ok(Value::Array(Array::floats_as(all, dtype, vec![n])))
}

/// Places counted through all elements, as indices along each axis.
fn unravel(c: &Call) -> Result<Value, Fault> {
    let (mut shape, flat) = (c.shape(1)?, c.array(0)?);
    let size = shape.iter().fold(1usize, |n, &d| n.saturating_mul(d));
    let mut left = flat.to_ints();
    c.eval.budget.allocate(left.len().saturating_mul(shape.len()))?;
    if let Some(beyond) = left.iter().find(|&&i| usize::try_from(i).map_or(true, |i| i >= size)) {
        return Err(Fault::value(format!("index {beyond} is outside an array of {size} elements")));
    }
    let mut axes = Vec::with_capacity(shape.len());
    while let Some(n) = shape.pop() {
        let along = left.iter().map(|i| i % n as i64).collect();
        axes.push(Value::array(Array::ints(along, flat.shape().to_vec())));
        left.iter_mut().for_each(|i| *i /= n as i64);
    }
    axes.reverse();
    Ok(Value::tuple(axes))
}

/// Rows and columns of a part of a matrix.
fn triangle(c: &Call, part: fn(i64, i64, i64) -> bool) -> Result<Value, Fault> {
    let rows = c.count(0)?;
    let (k, columns) =
        (c.int_or(1, 0)?.clamp(-1 << 40, 1 << 40), if c.opt(2).is_some() { c.count(2)? } else { rows });
    c.eval.budget.allocate_shape(&[rows, columns])?;
    let all = (0..rows as i64).flat_map(|i| (0..columns as i64).map(move |j| (i, j)));
    let (down, across): (Vec<i64>, Vec<i64>) = all.filter(|&(i, j)| part(i, j, k)).unzip();
    let n = down.len();
    Ok(Value::tuple(vec![
        Value::Array(Array::ints(down, vec![n])),
        Value::Array(Array::ints(across, vec![n])),
    ]))
}

/// The indices of all elements of an array of this shape, in C order.
fn every_index(c: &Call, shape: &[usize]) -> Result<Vec<Vec<Value>>, Fault> {
    let count = c.eval.budget.allocate_shape(shape)?;
    c.eval.budget.allocate_items(count.saturating_mul(shape.len().max(1)))?;
    let index = |mut flat: usize| {
        let mut at: Vec<Value> = Vec::with_capacity(shape.len());
        for n in shape.iter().rev() {
            at.push(Value::count(flat % n));
            flat /= n;
        }
        at.reverse();
        at
    };
    Ok((0..count).map(index).collect())
}
