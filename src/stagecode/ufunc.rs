//! What numpy's functions on elements have in common: `out=` and `where=`, and the methods of those of two
//! operands: `np.add.outer`, `np.maximum.reduce`, `np.add.accumulate`, `np.add.at`.
//!
//! Each row takes the function first. Imports arguments, arrays, faults.

use super::args::{Call, Row, Run, normalize_axis};
use super::array::Array;
use super::array_index;
use super::convert::{check_dimensions, to_array};
use super::elementwise::{self, Op, binary_values};
use super::error::Fault;
use super::value::Value;

/// The methods.
pub const ROWS: &[Row] = &[
    Row::new("outer", "self A B", outer),
    Row::new("reduce", "self array axis? dtype? out? keepdims?", |c| {
        let (mut all, axis) = folded(c)?;
        let last = all.pop().ok_or_else(|| c.problem("needs at least one element"))?;
        if !c.flag(5, false)? {
            return Ok(last);
        }
        let last = to_array(&c.eval.budget, &last, None)?;
        Ok(Value::Array(last.insert_axis(axis.min(last.ndim()))))
    }),
    Row::new("accumulate", "self array axis?", |c| {
        let (all, axis) = folded(c)?;
        let made = to_array(&c.eval.budget, &Value::list(all), None)?;
        let mut order: Vec<usize> = (1..made.ndim()).collect();
        order.insert(axis.min(order.len()), 0);
        Ok(Value::array(made.permute(&order).copy()))
    }),
    Row::new("at", "self a indices b", at),
];

/// A result as the arguments behind the operands want it: written to `out` (the argument at `at`), only `where`
/// a mask is true, as a `dtype`.
pub fn put(c: &Call, made: Value, at: usize) -> Result<Value, Fault> {
    let mask = c.opt(at + 1);
    if c.opt(at).is_none() && mask.is_none() && c.opt(at + 2).is_none() {
        return Ok(made);
    }
    let budget = &c.eval.budget;
    let result = to_array(budget, &made, c.dtype(at + 2)?)?;
    let target = match c.opt(at) {
        Some(Value::Array(a)) => a.clone(),
        Some(tuple @ Value::Tuple(_)) => match tuple.items().as_deref() {
            Some([Value::Array(a)]) => a.clone(),
            _ => return Err(c.problem("`out` must be an array")),
        },
        Some(_) => return Err(c.problem("`out` must be an array")),
        None if mask.is_none() => return Ok(Value::array(result)),
        // numpy leaves what is not computed as it finds the memory; here it is zero.
        None => {
            budget.allocate(result.size())?;
            Array::floats_as(vec![0.0; result.size()], result.dtype(), result.shape().to_vec())
        }
    };
    if result.dtype().is_float() && !target.dtype().is_float() {
        let (have, want) = (result.dtype().name(), target.dtype().name());
        return Err(Fault::kind(format!("{}(): {have} results do not fit an `out` of {want}", c.name)));
    }
    budget.allocate(target.size())?;
    let Some(mask) = mask else {
        target.assign(&result)?;
        return Ok(Value::Array(target));
    };
    let mask = to_array(budget, mask, None)?.broadcast(target.shape())?.to_bools();
    let values = result.broadcast(target.shape())?.to_scalars();
    let chosen = target.positions().into_iter().zip(values).zip(mask).filter(|(_, chosen)| *chosen);
    let (places, values): (Vec<usize>, Vec<_>) = chosen.map(|(pair, _)| pair).unzip();
    target.scatter(&places, &values);
    Ok(Value::Array(target))
}

/// The operation that the first argument stands for.
fn operation(c: &Call) -> Result<Op, Fault> {
    match c.get(0)? {
        Value::Builtin(Row { run: Run::Binary(op), .. }) => Ok(*op),
        _ => Err(c.problem("belongs to functions of two arrays, such as np.add")),
    }
}

fn outer(c: &Call) -> Result<Value, Fault> {
    let (a, b) = (c.array(1)?, c.array(2)?);
    let shape = check_dimensions([a.shape(), &vec![1; b.ndim()][..]].concat())?;
    c.eval.budget.allocate(a.size())?;
    let stretched: Array = a.reshape(shape);
    binary_values(&c.eval.budget, operation(c)?, &Value::Array(stretched), &Value::Array(b))
}

/// The running results along an axis, and the axis.
fn folded(c: &Call) -> Result<(Vec<Value>, usize), Fault> {
    let op = operation(c)?;
    let mut a = c.array(1)?;
    let axis = match c.get(2) {
        Ok(Value::None) => {
            c.eval.budget.allocate(a.size())?;
            a = a.reshape(vec![a.size()]);
            0
        }
        _ => normalize_axis(c.int_or(2, 0)?, a.ndim())?,
    };
    let mut order: Vec<usize> = (0..a.ndim()).filter(|&x| x != axis).collect();
    order.insert(0, axis);
    let mut all: Vec<Value> = Vec::new();
    for row in c.eval.collect(&Value::Array(a.permute(&order)))? {
        let next = match all.last() {
            Some(so_far) => binary_values(&c.eval.budget, op, so_far, &row)?,
            None => row,
        };
        all.push(next);
    }
    Ok((all, axis))
}

/// `a[indices] op= b`, with an element that is named twice taken twice.
fn at(c: &Call) -> Result<Value, Fault> {
    let op = operation(c)?;
    let Value::Array(a) = c.get(1)? else { return Err(c.problem("takes an array")) };
    let (places, shape) = array_index::places(&c.eval.budget, a, c.get(2)?)?;
    let values = c.array(3)?;
    if values.dtype().is_float() && !a.dtype().is_float() {
        return Err(Fault::kind(
            "an int64 array cannot take float64 results in place; use an array of floats",
        ));
    }
    let values = values.broadcast(&shape)?.to_scalars();
    for (place, value) in places.into_iter().zip(values) {
        let Some(old) = a.pick(&[place], Vec::new()).first() else { continue };
        a.scatter(&[place], &[elementwise::numbers(op, old, value)?]);
    }
    Ok(Value::None)
}
