//! numpy functions that rearrange one array: shapes, axes, flips.
//!
//! Where numpy returns a view, so do these. Imports arguments, arrays, conversions, faults.

use super::args::{Call, Row, normalize_axis};
use super::array::Array;
use super::convert;
use super::error::Fault;
use super::value::Value;

/// The rows of this area.
pub const ROWS: &[Row] = &[
    Row::new("reshape", "a shape? *more order?", reshape),
    Row::new("ravel", "a order?", |c| flatten(c, false)),
    Row::new("flatten", "a order?", |c| flatten(c, true)),
    Row::new("transpose", "a axes? *more", transpose),
    Row::new("permute_dims", "a axes? *more", transpose),
    Row::new("swapaxes", "a axis1 axis2", swapaxes),
    Row::new("moveaxis", "a source destination", moveaxis),
    Row::new("squeeze", "a axis?", squeeze),
    Row::new("expand_dims", "a axis", expand_dims),
    Row::new("atleast_1d", "a", |c| at_least(c, 1)),
    Row::new("atleast_2d", "a", |c| at_least(c, 2)),
    Row::new("atleast_3d", "a", |c| at_least(c, 3)),
    Row::new("broadcast_to", "array shape", broadcast_to),
    Row::new("flip", "m axis?", |c| flip(c, None)),
    Row::new("flipud", "m", |c| flip(c, Some(0))),
    Row::new("fliplr", "m", |c| flip(c, Some(1))),
    Row::new("roll", "a shift axis?", roll),
    Row::new("shape", "a", |c| Ok(Value::shape(c.array(0)?.shape()))),
    Row::new("ndim", "a", |c| Ok(Value::count(c.array(0)?.ndim()))),
    Row::new("size", "a axis?", size),
];

/// A shape in which one length may be -1: what is left over.
fn resolve(c: &Call, lengths: &[Value], size: usize) -> Result<Vec<usize>, Fault> {
    let mut shape = Vec::new();
    let mut open = None;
    for (at, length) in lengths.iter().enumerate() {
        match length.as_int() {
            Some(-1) if open.is_none() => {
                open = Some(at);
                shape.push(1);
            }
            Some(n) if n >= 0 => shape.push(n as usize),
            _ => return Err(c.problem("a shape consists of integers, at most one of them -1")),
        }
    }
    let known = shape.iter().try_fold(1usize, |n, &d| n.checked_mul(d)).unwrap_or(usize::MAX);
    if let Some(at) = open {
        shape[at] = size.checked_div(known).unwrap_or(0);
    }
    if shape.iter().try_fold(1usize, |n, &d| n.checked_mul(d)) != Some(size) {
        let wanted = super::array::show(&shape);
        return Err(Fault::value(format!("an array of {size} elements cannot have the shape {wanted}")));
    }
    c.eval.budget.allocate_shape(&shape)?;
    convert::check_dimensions(shape)
}

fn reshape(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    let mut lengths = match c.get(1)? {
        Value::List(_) | Value::Tuple(_) | Value::Array(_) => c.sequence(1)?,
        one => vec![one.clone()],
    };
    lengths.extend(c.rest.iter().cloned());
    let fortran = c.opt(3).is_some() && c.text(3)? == "F";
    c.eval.budget.allocate(a.size())?;
    let mut shape = resolve(c, &lengths, a.size())?;
    if !fortran {
        return Ok(Value::array(a.reshape(shape)));
    }
    // Column-major order is row-major order with all axes reversed.
    shape.reverse();
    let reversed = |a: &Array| a.permute(&(0..a.ndim()).rev().collect::<Vec<_>>());
    Ok(Value::array(reversed(&reversed(&a).reshape(shape))))
}

fn flatten(c: &Call, copy: bool) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    c.eval.budget.allocate(a.size())?;
    if c.opt(1).is_some() && c.text(1)? == "F" {
        a = a.permute(&(0..a.ndim()).rev().collect::<Vec<_>>());
    }
    let flat = a.reshape(vec![a.size()]);
    Ok(Value::Array(if copy { flat.copy() } else { flat }))
}

fn transpose(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    let mut axes = match c.opt(1) {
        None => (0..a.ndim() as i64).rev().map(Value::int).collect(),
        Some(Value::List(_) | Value::Tuple(_)) => c.sequence(1)?,
        Some(one) => vec![one.clone()],
    };
    axes.extend(c.rest.iter().cloned());
    let order: Vec<usize> = axes
        .iter()
        .map(|v| {
            v.as_int().ok_or_else(|| c.problem("axes are integers")).and_then(|i| normalize_axis(i, a.ndim()))
        })
        .collect::<Result<_, _>>()?;
    let mut sorted = order.clone();
    sorted.sort_unstable();
    if sorted != (0..a.ndim()).collect::<Vec<_>>() {
        return Err(c.problem(format!("the axes must name each of the {} axes once", a.ndim())));
    }
    Ok(Value::array(a.permute(&order)))
}

fn swapaxes(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    let mut order: Vec<usize> = (0..a.ndim()).collect();
    order.swap(normalize_axis(c.int(1)?, a.ndim())?, normalize_axis(c.int(2)?, a.ndim())?);
    Ok(Value::array(a.permute(&order)))
}

/// The argument at `at` as one or several axes of an array with `ndim`.
fn axes(c: &Call, at: usize, ndim: usize) -> Result<Vec<usize>, Fault> {
    if let Value::Number(_) = c.get(at)? {
        return Ok(vec![normalize_axis(c.int(at)?, ndim)?]);
    }
    let whole = |v: &Value| v.as_int().ok_or_else(|| c.problem("an axis must be an integer"));
    c.sequence(at)?.iter().map(|v| normalize_axis(whole(v)?, ndim)).collect()
}

fn moveaxis(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    let (from, to) = (axes(c, 1, a.ndim())?, axes(c, 2, a.ndim())?);
    if from.len() != to.len() {
        return Err(c.problem("`source` and `destination` must name as many axes"));
    }
    let mut order: Vec<usize> = (0..a.ndim()).filter(|axis| !from.contains(axis)).collect();
    let mut moves: Vec<(usize, usize)> = to.into_iter().zip(from).collect();
    moves.sort_unstable();
    moves.into_iter().for_each(|(to, from)| order.insert(to.min(order.len()), from));
    if order.len() != a.ndim() {
        return Err(c.problem("an axis is named twice"));
    }
    Ok(Value::array(a.permute(&order)))
}

fn squeeze(c: &Call) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    let only = c.axis(1, a.ndim())?;
    if only.is_some_and(|axis| a.shape()[axis] != 1) {
        return Err(c.problem("only an axis of length one can be removed"));
    }
    for axis in (0..a.ndim()).rev() {
        if a.shape()[axis] == 1 && only.is_none_or(|o| o == axis) {
            a = a.remove_axis(axis);
        }
    }
    Ok(Value::array(a))
}

fn expand_dims(c: &Call) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    let count = if let Value::Number(_) = c.get(1)? { 1 } else { c.sequence(1)?.len() };
    convert::check_dimensions(vec![1; a.ndim().saturating_add(count)])?;
    let mut new = axes(c, 1, a.ndim() + count)?;
    new.sort_unstable();
    for axis in new {
        a = a.insert_axis(axis.min(a.ndim()));
    }
    Ok(Value::array(a))
}

fn at_least(c: &Call, ndim: usize) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    while a.ndim() < ndim {
        // The third axis is added behind, the others in front, as numpy does.
        a = a.insert_axis(if a.ndim() == 2 { 2 } else { 0 });
    }
    Ok(Value::Array(a))
}

fn broadcast_to(c: &Call) -> Result<Value, Fault> {
    let shape = c.shape(1)?;
    c.eval.budget.allocate_shape(&shape)?;
    Ok(Value::array(c.array(0)?.broadcast(&shape)?.copy()))
}

fn flip(c: &Call, fixed: Option<usize>) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    let only = match fixed {
        Some(axis) => Some(normalize_axis(axis as i64, a.ndim())?),
        None => c.axis(1, a.ndim())?,
    };
    for axis in 0..a.ndim() {
        let n = a.shape()[axis];
        if n > 0 && only.is_none_or(|o| o == axis) {
            a = a.slice(axis, n - 1, -1, n);
        }
    }
    Ok(Value::array(a))
}

fn roll(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    c.eval.budget.allocate(a.size())?;
    let axis = c.axis(2, a.ndim())?;
    let (base, axis) = match axis {
        Some(axis) => (a.clone(), axis),
        None => (a.reshape(vec![a.size()]), 0),
    };
    let n = base.shape()[axis];
    if n == 0 {
        return Ok(Value::array(a.copy()));
    }
    let shift = c.int(1)?.rem_euclid(n as i64) as usize;
    let out = base.copy();
    out.slice(axis, shift, 1, n - shift).assign(&base.slice(axis, 0, 1, n - shift))?;
    out.slice(axis, 0, 1, shift).assign(&base.slice(axis, n - shift, 1, shift))?;
    Ok(Value::array(out.reshape(a.shape().to_vec())))
}

fn size(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    Ok(Value::count(c.axis(1, a.ndim())?.map_or(a.size(), |axis| a.shape()[axis])))
}
