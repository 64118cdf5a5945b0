//! Grids: `meshgrid`, `indices`, and the objects used with brackets: `mgrid`, `ogrid`, `c_`, `r_`, `s_`.
//!
//! Axes, as arrays or slices, come in; coordinate arrays go out. Imports arguments, arrays, faults.

use super::args::{Call, Row};
use super::array::Array;
use super::convert;
use super::error::Fault;
use super::eval::Evaluator;
use super::limits::Budget;
use super::numpy_create::{counted, spaced};
use super::numpy_join;
use super::scalar::Scalar;
use super::value::{Indexer, Value};

/// The rows of this area.
pub const ROWS: &[Row] = &[
    Row::new("meshgrid", "*xi indexing? sparse? copy?", meshgrid),
    Row::new("indices", "dimensions", indices),
    Row::new("ix_", "*args", ix),
    Row::new("broadcast_arrays", "*args", broadcast_arrays),
];

fn meshgrid(c: &Call) -> Result<Value, Fault> {
    let axes: Vec<Array> =
        c.rest.iter().map(|v| convert::to_array(&c.eval.budget, v, None)).collect::<Result<_, _>>()?;
    let xy = c.opt(1).is_none() || c.text(1)? == "xy";
    let n = axes.len();
    let mut order: Vec<usize> = (0..n).collect();
    if xy && n >= 2 {
        order.swap(0, 1);
    }
    let open = open_grid(&axes, &order)?;
    if c.flag(2, false)? {
        return Ok(Value::list(open.into_iter().map(Value::Array).collect()));
    }
    let shape: Vec<usize> = order.iter().map(|&axis| axes[axis].size()).collect();
    Ok(Value::list(dense(&c.eval.budget, &open, &shape)?.into_iter().map(Value::Array).collect()))
}

/// Each axis as an array that is long in its own place of `order` and of length one elsewhere.
fn open_grid(axes: &[Array], order: &[usize]) -> Result<Vec<Array>, Fault> {
    convert::check_dimensions(vec![1; axes.len()])?;
    let lengthened = axes.iter().enumerate().map(|(axis, values)| {
        let shape = order.iter().map(|&o| if o == axis { values.size() } else { 1 }).collect();
        values.reshape(shape)
    });
    Ok(lengthened.collect())
}

fn dense(budget: &Budget, open: &[Array], shape: &[usize]) -> Result<Vec<Array>, Fault> {
    open.iter()
        .map(|a| {
            budget.allocate_shape(shape)?;
            Ok(a.broadcast(shape)?.copy())
        })
        .collect()
}

fn indices(c: &Call) -> Result<Value, Fault> {
    let shape = c.shape(0)?;
    let axes = shape
        .iter()
        .map(|&n| counted(&c.eval.budget, Scalar::Int(0), Scalar::Int(n as i64), Scalar::Int(1)))
        .collect::<Result<Vec<_>, _>>()?;
    stacked(&c.eval.budget, &axes)
}

/// The dense grid of some axes as one array with the axis number first.
fn stacked(budget: &Budget, axes: &[Array]) -> Result<Value, Fault> {
    let order: Vec<usize> = (0..axes.len()).collect();
    convert::check_dimensions(vec![1; axes.len() + 1])?;
    let shape: Vec<usize> = axes.iter().map(Array::size).collect();
    let grids = dense(budget, &open_grid(axes, &order)?, &shape)?;
    let raised: Vec<Array> = grids.iter().map(|g| g.insert_axis(0)).collect();
    numpy_join::join(budget, &raised, 0).map(Value::Array)
}

fn ix(c: &Call) -> Result<Value, Fault> {
    let axes: Vec<Array> =
        c.rest.iter().map(|v| convert::to_array(&c.eval.budget, v, None)).collect::<Result<_, _>>()?;
    let order: Vec<usize> = (0..axes.len()).collect();
    Ok(Value::tuple(open_grid(&axes, &order)?.into_iter().map(Value::Array).collect()))
}

fn broadcast_arrays(c: &Call) -> Result<Value, Fault> {
    let all: Vec<Array> =
        c.rest.iter().map(|v| convert::to_array(&c.eval.budget, v, None)).collect::<Result<_, _>>()?;
    let shape = all.iter().try_fold(Vec::new(), |s, a| super::array::broadcast_shapes(&s, a.shape()))?;
    Ok(Value::list(dense(&c.eval.budget, &all, &shape)?.into_iter().map(Value::Array).collect()))
}

/// `np.mgrid[..]` and the others.
pub fn indexer(eval: &Evaluator, kind: Indexer, at: &Value) -> Result<Value, Fault> {
    let budget = &eval.budget;
    let parts = if let Value::Tuple(_) = at { at.items().unwrap_or_default() } else { vec![at.clone()] };
    let axes = || parts.iter().map(|p| axis(budget, p)).collect::<Result<Vec<_>, _>>();
    match kind {
        Indexer::Slices => Ok(at.clone()),
        Indexer::Columns => numpy_join::columns(budget, &axes()?),
        Indexer::Rows => {
            let all: Vec<Array> =
                axes()?.into_iter().map(|a| if a.ndim() == 0 { a.insert_axis(0) } else { a }).collect();
            numpy_join::join(budget, &all, 0).map(Value::Array)
        }
        Indexer::Mgrid => match &axes()?[..] {
            [only] if !matches!(at, Value::Tuple(_)) => Ok(Value::Array(only.clone())),
            all => stacked(budget, all),
        },
        Indexer::Ogrid => {
            let axes = axes()?;
            let order: Vec<usize> = (0..axes.len()).collect();
            Ok(Value::list(open_grid(&axes, &order)?.into_iter().map(Value::Array).collect()))
        }
    }
}

/// One part between the brackets: a slice counts, `start:stop:5j` takes that many, arrays stay.
fn axis(budget: &Budget, part: &Value) -> Result<Array, Fault> {
    let Value::Slice(parts) = part else { return convert::to_array(budget, part, None) };
    let number = |at: usize, default: i64| parts[at].as_scalar().unwrap_or(Scalar::Int(default));
    let (start, stop) = (number(0, 0), number(1, 0));
    if let Value::Imaginary(count) = parts[2] {
        let count = count.abs().min(1e15) as usize;
        budget.allocate(count)?;
        return Ok(Array::floats(spaced(start.float(), stop.float(), count, true), vec![count]));
    }
    counted(budget, start, stop, number(2, 1))
}
