//! numpy functions that join arrays, repeat them, and take them apart.
//!
//! Sequences of arrays come in, one array (or a list of parts) goes out. Imports arguments, arrays, faults.

use super::args::{Call, Row, normalize_axis};
use super::array::{Array, show};
use super::convert;
use super::error::Fault;
use super::limits::Budget;
use super::scalar::Dtype;
use super::value::Value;

/// The rows of this area.
pub const ROWS: &[Row] = &[
    Row::new("concatenate", "arrays axis? dtype?", |c| along(c, arrays(c, 0)?)),
    Row::new("concat", "arrays axis? dtype?", |c| along(c, arrays(c, 0)?)),
    Row::new("append", "arr values axis?", append),
    Row::new("stack", "arrays axis?", stack),
    Row::new("vstack", "tup", |c| vstack(c, 0)),
    Row::new("row_stack", "tup", |c| vstack(c, 0)),
    Row::new("hstack", "tup", hstack),
    Row::new("dstack", "tup", dstack),
    Row::new("column_stack", "tup", column_stack),
    Row::new("tile", "A reps", tile),
    Row::new("repeat", "a repeats axis?", repeat),
    Row::new("split", "ary indices_or_sections axis?", |c| split(c, c.int_or(2, 0)?)),
    Row::new("array_split", "ary indices_or_sections axis?", |c| split(c, c.int_or(2, 0)?)),
    Row::new("vsplit", "ary indices_or_sections", |c| split(c, 0)),
    Row::new("hsplit", "ary indices_or_sections", |c| split(c, 1)),
    Row::new("delete", "arr obj axis?", delete),
    Row::new("insert", "arr obj values axis?", insert),
    Row::new("pad", "array pad_width mode? constant_values?", pad),
];

/// The argument as a list of arrays.
fn arrays(c: &Call, at: usize) -> Result<Vec<Array>, Fault> {
    let all: Vec<Array> = c
        .sequence(at)?
        .iter()
        .map(|v| convert::to_array(&c.eval.budget, v, None))
        .collect::<Result<_, _>>()?;
    if all.is_empty() { Err(c.problem("needs at least one array")) } else { Ok(all) }
}

/// Joins arrays along an existing axis.
pub fn join(budget: &Budget, all: &[Array], axis: usize) -> Result<Array, Fault> {
    let Some(first) = all.first() else { return Err(Fault::value("there is nothing to join")) };
    let mut shape = first.shape().to_vec();
    let mut dtype = first.dtype();
    for other in &all[1..] {
        let fits = other.ndim() == shape.len()
            && (0..shape.len()).all(|a| a == axis || other.shape()[a] == shape[a]);
        if !fits || axis >= shape.len() {
            return Err(Fault::value(format!(
                "arrays of shapes {} and {} cannot be joined along axis {axis}",
                show(first.shape()),
                show(other.shape())
            )));
        }
        shape[axis] = shape[axis].saturating_add(other.shape()[axis]);
        dtype = dtype.promote(other.dtype());
    }
    if axis >= shape.len() {
        return Err(Fault::value("numbers cannot be joined; put them in lists"));
    }
    let count = budget.allocate_shape(&shape)?;
    let out = Array::floats_as(vec![0.0; count], dtype, shape);
    let mut at = 0;
    for part in all {
        let n = part.shape()[axis];
        out.slice(axis, at, 1, n).assign(part)?;
        at += n;
    }
    Ok(out)
}

fn along(c: &Call, all: Vec<Array>) -> Result<Value, Fault> {
    let flat = matches!(c.get(1), Ok(Value::None));
    let (all, axis) = if flat {
        (all.iter().map(|a| a.reshape(vec![a.size()])).collect(), 0)
    } else {
        let axis = normalize_axis(c.int_or(1, 0)?, all.first().map_or(0, Array::ndim))?;
        (all, axis)
    };
    let joined = join(&c.eval.budget, &all, axis)?;
    Ok(Value::Array(match c.dtype(2)? {
        Some(dtype) => joined.cast(dtype),
        None => joined,
    }))
}

fn append(c: &Call) -> Result<Value, Fault> {
    let (mut a, mut b) = (c.array(0)?, c.array(1)?);
    let axis = match c.axis(2, a.ndim())? {
        Some(axis) => axis,
        None => {
            (a, b) = (a.reshape(vec![a.size()]), b.reshape(vec![b.size()]));
            0
        }
    };
    join(&c.eval.budget, &[a, b], axis).map(Value::Array)
}

fn stack(c: &Call) -> Result<Value, Fault> {
    let all = arrays(c, 0)?;
    let ndim = all.first().map_or(0, Array::ndim);
    let axis = normalize_axis(c.int_or(1, 0)?, ndim + 1)?;
    if let Some(other) = all.iter().find(|a| a.shape() != all[0].shape()) {
        let (first, other) = (show(all[0].shape()), show(other.shape()));
        return Err(Fault::value(format!("stack() needs equal shapes, not {first} and {other}")));
    }
    convert::check_dimensions(vec![1; ndim + 1])?;
    let raised: Vec<Array> = all.iter().map(|a| a.insert_axis(axis)).collect();
    join(&c.eval.budget, &raised, axis).map(Value::Array)
}

fn raised(a: &Array, ndim: usize) -> Array {
    let mut a = a.clone();
    while a.ndim() < ndim {
        a = a.insert_axis(0);
    }
    a
}

fn vstack(c: &Call, axis: usize) -> Result<Value, Fault> {
    let all: Vec<Array> = arrays(c, 0)?.iter().map(|a| raised(a, 2)).collect();
    join(&c.eval.budget, &all, axis).map(Value::Array)
}

fn hstack(c: &Call) -> Result<Value, Fault> {
    let all: Vec<Array> = arrays(c, 0)?.iter().map(|a| raised(a, 1)).collect();
    let axis = usize::from(all.first().is_some_and(|a| a.ndim() > 1));
    join(&c.eval.budget, &all, axis).map(Value::Array)
}

fn dstack(c: &Call) -> Result<Value, Fault> {
    let deep = |a: &Array| {
        let a = raised(a, 2);
        if a.ndim() == 2 { a.insert_axis(2) } else { a }
    };
    let all: Vec<Array> = arrays(c, 0)?.iter().map(deep).collect();
    join(&c.eval.budget, &all, 2).map(Value::Array)
}

fn column_stack(c: &Call) -> Result<Value, Fault> {
    columns(&c.eval.budget, &arrays(c, 0)?)
}

/// Arrays side by side; those with one axis become columns.
pub fn columns(budget: &Budget, all: &[Array]) -> Result<Value, Fault> {
    let column = |a: &Array| {
        let a = raised(a, 1);
        if a.ndim() == 1 { a.insert_axis(1) } else { a }
    };
    let all: Vec<Array> = all.iter().map(column).collect();
    join(budget, &all, 1).map(Value::Array)
}

fn tile(c: &Call) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    let mut reps = c.shape(1)?;
    let ndim = a.ndim().max(reps.len());
    a = raised(&a, ndim);
    while reps.len() < ndim {
        reps.insert(0, 1);
    }
    for (axis, &times) in reps.iter().enumerate() {
        let mut shape = a.shape().to_vec();
        shape[axis] = shape[axis].saturating_mul(times);
        c.eval.budget.allocate_shape(&shape)?;
        if times == 0 {
            a = Array::floats_as(Vec::new(), a.dtype(), shape);
        } else {
            a = join(&c.eval.budget, &vec![a; times], axis)?;
        }
    }
    Ok(Value::Array(a.copy()))
}

fn repeat(c: &Call) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    let axis = match c.axis(2, a.ndim())? {
        Some(axis) => axis,
        None => {
            a = a.reshape(vec![a.size()]);
            0
        }
    };
    let n = a.shape()[axis];
    let mut counts = c.shape(1)?;
    if counts.len() == 1 {
        counts = vec![counts[0]; n];
    }
    if counts.len() != n {
        return Err(c.problem("`repeats` must be one count or one per element"));
    }
    let total = counts.iter().fold(0usize, |sum, &k| sum.saturating_add(k));
    let mut shape = a.shape().to_vec();
    shape[axis] = total;
    let size = c.eval.budget.allocate_shape(&shape)?;
    let out = Array::floats_as(vec![0.0; size], a.dtype(), shape);
    let mut at = 0;
    for (i, &count) in counts.iter().enumerate() {
        out.slice(axis, at, 1, count).assign(&a.slice(axis, i, 1, 1))?;
        at += count;
    }
    Ok(Value::Array(out))
}

fn split(c: &Call, axis: i64) -> Result<Value, Fault> {
    let a = c.array(0)?;
    let axis = normalize_axis(axis, a.ndim())?;
    let n = a.shape()[axis];
    let mut cuts = vec![0];
    match c.get(1)? {
        Value::Number(_) => {
            let parts = c.count(1)?;
            if parts == 0 || (n % parts != 0 && c.name != "array_split") {
                return Err(c.problem(format!("{n} elements cannot be split into {parts} equal parts")));
            }
            c.eval.budget.allocate(parts)?;
            (0..parts).for_each(|i| cuts.push(cuts[i] + n / parts + usize::from(i < n % parts)));
        }
        _ => {
            cuts.extend(c.shape(1)?.into_iter().map(|at| at.min(n)));
            cuts.push(n);
        }
    }
    let part = |w: &[usize]| Value::Array(a.slice(axis, w[0], 1, w[1].saturating_sub(w[0])));
    Ok(Value::list(cuts.windows(2).map(part).collect()))
}

/// The array flat along axis 0, unless an axis is given.
fn with_axis(c: &Call, at: usize) -> Result<(Array, usize), Fault> {
    let a = c.array(0)?;
    Ok(match c.axis(at, a.ndim())? {
        Some(axis) => (a, axis),
        None => (a.reshape(vec![a.size()]), 0),
    })
}

fn delete(c: &Call) -> Result<Value, Fault> {
    let (a, axis) = with_axis(c, 2)?;
    let n = a.shape()[axis];
    c.eval.budget.allocate(n)?;
    let mut keep = vec![true; n];
    if let Value::Slice(parts) = c.get(1)? {
        super::index::slice_positions(parts, n)?.iter().for_each(|i| keep[i] = false);
    } else if c.array(1)?.dtype() == Dtype::Bool {
        keep.iter_mut().zip(c.array(1)?.to_bools()).for_each(|(k, g)| *k = !g);
    } else {
        for i in c.array(1)?.to_ints() {
            keep[super::index::position(&Value::int(i), n, "axis")?] = false;
        }
    }
    let kept: Vec<Array> = (0..n).filter(|&i| keep[i]).map(|i| a.slice(axis, i, 1, 1)).collect();
    if kept.is_empty() {
        return Ok(Value::Array(a.slice(axis, 0, 1, 0).copy()));
    }
    join(&c.eval.budget, &kept, axis).map(Value::Array)
}

fn insert(c: &Call) -> Result<Value, Fault> {
    let (a, axis) = with_axis(c, 3)?;
    let n = a.shape()[axis];
    // Counted from the back, the last place is that in front of the last element.
    let at = |i: i64| {
        let i = if i < 0 { i.saturating_add(n as i64) } else { i };
        super::index::position(&Value::int(if i < 0 { i64::MAX } else { i }), n + 1, "axis")
    };
    let mut values = raised(&c.array(2)?, a.ndim());
    let places = match c.get(1)? {
        Value::Number(_) => {
            // The values stand along their first axis, however many they are.
            let mut order: Vec<usize> = (1..values.ndim()).collect();
            order.insert(axis.min(order.len()), 0);
            values = values.permute(&order);
            vec![at(c.int(1)?)?; values.shape()[axis]]
        }
        _ => c.array(1)?.to_ints().into_iter().map(at).collect::<Result<_, _>>()?,
    };
    let mut shape = a.shape().to_vec();
    shape[axis] = places.len();
    c.eval.budget.allocate_shape(&shape)?;
    let values = values.broadcast(&shape)?.cast(a.dtype());
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by_key(|&k| places[k]);
    let (mut parts, mut from) = (Vec::new(), 0);
    for k in order {
        parts.push(a.slice(axis, from, 1, places[k] - from));
        parts.push(values.slice(axis, k, 1, 1));
        from = places[k];
    }
    parts.push(a.slice(axis, from, 1, n - from));
    join(&c.eval.budget, &parts, axis).map(Value::Array)
}

/// An array with a margin along each axis: of one number, or of the array's own elements.
fn pad(c: &Call) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    let widths = c.array(1)?.broadcast(&[a.ndim(), 2])?.to_ints();
    let mode = if c.opt(2).is_some() { c.text(2)? } else { "constant" };
    let fill = if c.opt(3).is_some() { c.array(3)? } else { Array::ints(vec![0], Vec::new()) };
    let fill = fill.cast(a.dtype()).broadcast(&[a.ndim(), 2])?;
    for axis in 0..a.ndim() {
        let n = a.shape()[axis] as i64;
        let (before, after) = (widths[2 * axis], widths[2 * axis + 1]);
        if before < 0 || after < 0 {
            return Err(c.problem("the widths must not be negative"));
        }
        let mut shape = a.shape().to_vec();
        shape[axis] = usize::try_from(n.saturating_add(before).saturating_add(after)).unwrap_or(usize::MAX);
        c.eval.budget.allocate_shape(&shape)?;
        if mode == "constant" {
            let margin = |width: i64, side: usize| {
                let mut shape = a.shape().to_vec();
                shape[axis] = width as usize;
                fill.select(0, axis).select(0, side).broadcast(&shape)
            };
            a = join(&c.eval.budget, &[margin(before, 0)?, a.clone(), margin(after, 1)?], axis)?;
            continue;
        }
        if n == 0 {
            return Err(c.problem("an axis without elements can only be padded with a constant"));
        }
        let turned = |i: i64, period: i64| {
            let i = i.rem_euclid(period.max(1));
            if i < n { i } else { period - i }
        };
        let source = |i: i64| match mode {
            "edge" => Some(i.clamp(0, n - 1)),
            "wrap" => Some(i.rem_euclid(n)),
            "reflect" => Some(turned(i, 2 * (n - 1))),
            "symmetric" => Some({
                let i = i.rem_euclid(2 * n);
                if i < n { i } else { 2 * n - 1 - i }
            }),
            _ => None,
        };
        let all: Option<Vec<i64>> = (-before..n + after).map(source).collect();
        let all =
            all.ok_or_else(|| c.problem("`mode` must be constant, edge, wrap, reflect or symmetric"))?;
        let length = all.len();
        let index = Value::Array(Array::ints(all, vec![length]));
        a = convert::to_array(&c.eval.budget, &super::numpy_place::along(c, &a, axis, &index)?, None)?;
    }
    Ok(Value::array(a))
}
