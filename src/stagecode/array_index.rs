//! Indexing of arrays: integers, slices, `...`, new axes, masks and arrays of indices, in any mixture.
//!
//! An array and an index value come in. Without masks or index arrays a view goes out, as in numpy; with
//! them the picked elements are copied. Imports arrays, values, limits, faults.

use super::array::{Array, broadcast_shapes, show};
use super::convert::{MAX_DIMENSIONS, to_array};
use super::error::Fault;
use super::index::{position, slice_positions};
use super::limits::Budget;
use super::scalar::{Dtype, Scalar};
use super::value::Value;

/// `array[index]`.
pub fn get(budget: &Budget, array: &Array, index: &Value) -> Result<Value, Fault> {
    let plan = Plan::new(budget, array, index)?;
    if plan.picks.is_empty() {
        return Ok(Value::array(plan.view));
    }
    let (positions, shape) = plan.positions(budget)?;
    Ok(Value::array(array.pick(&positions, shape)))
}

/// The places in the buffer that an index picks, and their shape.
pub fn places(budget: &Budget, array: &Array, index: &Value) -> Result<(Vec<usize>, Vec<usize>), Fault> {
    let plan = Plan::new(budget, array, index)?;
    if plan.picks.is_empty() {
        budget.allocate(plan.view.size())?;
        return Ok((plan.view.positions(), plan.view.shape().to_vec()));
    }
    plan.positions(budget)
}

/// `array[index] = value`.
pub fn set(budget: &Budget, array: &Array, index: &Value, value: &Value) -> Result<(), Fault> {
    let source = to_array(budget, value, None)?;
    let plan = Plan::new(budget, array, index)?;
    if plan.picks.is_empty() {
        budget.charge(plan.view.size())?;
        return plan.view.assign(&strip(source, plan.view.ndim()));
    }
    let (positions, shape) = plan.positions(budget)?;
    let values = if source.size() == 1 {
        source.to_scalars()
    } else {
        strip(source, shape.len()).broadcast(&shape)?.to_scalars()
    };
    array.scatter(&positions, &values);
    Ok(())
}

/// numpy drops leading axes of length one of what is assigned.
fn strip(mut source: Array, ndim: usize) -> Array {
    while source.ndim() > ndim && source.shape()[0] == 1 {
        source = source.remove_axis(0);
    }
    source
}

/// An index taken apart: the plain part as a view, and the axes of it from which elements are picked.
struct Plan {
    view: Array,
    /// Axis of the view and the indices along it.
    picks: Vec<(usize, Array)>,
    /// Where the picked axes go in the result.
    front: usize,
}

impl Plan {
    fn new(budget: &Budget, array: &Array, index: &Value) -> Result<Self, Fault> {
        let items = expand(budget, array, index)?;
        let picking = items.iter().any(|i| matches!(i, Value::Array(_)));
        let mut plan = Self { view: array.clone(), picks: Vec::new(), front: 0 };
        let mut axis = 0;
        let (mut last_pick, mut split) = (None, false);
        for (at, item) in items.iter().enumerate() {
            let length = plan.view.shape().get(axis).copied();
            match item {
                Value::None => {
                    if plan.view.ndim() >= MAX_DIMENSIONS {
                        return Err(Fault::limit("dimensions of an array", MAX_DIMENSIONS as u64));
                    }
                    plan.view = plan.view.insert_axis(axis);
                    axis += 1;
                }
                Value::Slice(parts) => {
                    let picked = slice_positions(parts, length.unwrap_or(0))?;
                    plan.view = plan.view.slice(axis, picked.start, picked.step, picked.len());
                    axis += 1;
                }
                Value::Number(_) if !picking => {
                    let at = position(item, length.unwrap_or(0), "axis")?;
                    plan.view = plan.view.select(axis, at);
                }
                _ => {
                    let indices = to_array(budget, item, None)?;
                    if plan.picks.is_empty() {
                        plan.front = axis;
                    }
                    split |= last_pick.is_some_and(|last| last + 1 != at);
                    last_pick = Some(at);
                    plan.picks.push((axis, checked(budget, &indices, length.unwrap_or(0))?));
                    axis += 1;
                }
            }
        }
        if split {
            plan.front = 0;
        }
        Ok(plan)
    }

    /// Places in the buffer of all picked elements in the order of the result, and the result's shape.
    fn positions(&self, budget: &Budget) -> Result<(Vec<usize>, Vec<usize>), Fault> {
        let mut picked_shape = Vec::new();
        for (_, indices) in &self.picks {
            picked_shape = broadcast_shapes(&picked_shape, indices.shape())?;
        }
        let mut rest = self.view.clone();
        let picked_count = budget.allocate_shape(&picked_shape)?;
        let mut offsets = vec![0isize; picked_count];
        for (axis, indices) in &self.picks {
            let stride = self.view.stride(*axis);
            let all = indices.broadcast(&picked_shape)?.to_ints();
            offsets.iter_mut().zip(all).for_each(|(o, i)| *o += i as isize * stride);
        }
        for (axis, _) in self.picks.iter().rev() {
            rest = rest.remove_axis(*axis);
        }
        let shape = [&picked_shape[..], rest.shape()].concat();
        if shape.len() > MAX_DIMENSIONS {
            return Err(Fault::limit("dimensions of an array", MAX_DIMENSIONS as u64));
        }
        budget.allocate_shape(&shape)?;
        let base = rest.positions();
        let all: Vec<i64> =
            offsets.iter().flat_map(|o| base.iter().map(move |&b| (b as isize + o) as i64)).collect();
        // The picked axes stand in front so far; they go where the first of them stood.
        let picked = picked_shape.len();
        let order: Vec<usize> =
            (picked..picked + self.front).chain(0..picked).chain(picked + self.front..shape.len()).collect();
        let arranged = Array::ints(all, shape).permute(&order);
        let positions = arranged.to_ints().into_iter().map(|i| i as usize).collect();
        Ok((positions, arranged.shape().to_vec()))
    }
}

/// The index as one item per axis: `...` written out, lists turned to arrays, masks to index arrays.
fn expand(budget: &Budget, array: &Array, index: &Value) -> Result<Vec<Value>, Fault> {
    let items = match index {
        Value::Tuple(_) => index.items().unwrap_or_default(),
        other => vec![other.clone()],
    };
    let mut out = Vec::new();
    let (mut used, mut ellipsis) = (0, None);
    for item in items {
        match item {
            Value::None => out.push(item),
            Value::Ellipsis if ellipsis.is_none() => ellipsis = Some(out.len()),
            Value::Slice(_) => (used, _) = (used + 1, out.push(item)),
            Value::Number(Scalar::Bool(_)) => {
                return Err(Fault::unsupported("indexing with a single truth value", "use an if statement"));
            }
            Value::Number(Scalar::Float(_) | Scalar::Float64(_)) => {
                return Err(Fault::Index(
                    "an index must be an integer, not a float; use int(..) or //".into(),
                ));
            }
            Value::Number(_) => (used, _) = (used + 1, out.push(item)),
            Value::Array(_) | Value::List(_) | Value::Range(..) | Value::Tuple(_) => {
                let indices = to_array(budget, &item, None)?;
                used += push_picks(budget, array, &indices, used, &mut out)?;
            }
            other => return Err(Fault::Index(format!("a {} cannot index an array", other.type_name()))),
        }
    }
    let Some(missing) = array.ndim().checked_sub(used) else {
        return Err(Fault::Index(format!("{used} indices for an array of shape {}", show(array.shape()))));
    };
    let whole = Value::Slice(std::rc::Rc::new([Value::None, Value::None, Value::None]));
    let at = ellipsis.unwrap_or(out.len());
    out.splice(at..at, std::iter::repeat_n(whole, missing));
    Ok(out)
}

/// Adds the index arrays of a mask or index array; returns how many axes they take.
fn push_picks(
    budget: &Budget,
    array: &Array,
    indices: &Array,
    axis: usize,
    out: &mut Vec<Value>,
) -> Result<usize, Fault> {
    match indices.dtype() {
        Dtype::Bool => {
            let under = array.shape().get(axis..axis + indices.ndim()).unwrap_or_default();
            if under != indices.shape() {
                return Err(Fault::Index(format!(
                    "a mask of shape {} does not fit an array of shape {}",
                    show(indices.shape()),
                    show(array.shape())
                )));
            }
            let found = nonzero(budget, indices)?;
            let count = found.len();
            out.extend(found.into_iter().map(Value::Array));
            Ok(count)
        }
        Dtype::Int => {
            out.push(Value::Array(indices.clone()));
            Ok(1)
        }
        // An empty list is an array of floats.
        _ if indices.size() == 0 => {
            out.push(Value::Array(indices.cast(Dtype::Int)));
            Ok(1)
        }
        _ => Err(Fault::Index("an array of indices must hold integers or truth values, not floats".into())),
    }
}

/// Where a mask is true: one array of indices per axis.
pub fn nonzero(budget: &Budget, mask: &Array) -> Result<Vec<Array>, Fault> {
    budget.allocate(mask.size().saturating_mul(mask.ndim().max(1)))?;
    let flat: Vec<usize> = mask.to_bools().iter().enumerate().filter(|&(_, &b)| b).map(|(i, _)| i).collect();
    let mut below = mask.size();
    let per_axis = mask.shape().iter().map(|&n| {
        let above = below.max(1);
        below = below.checked_div(n).unwrap_or(0);
        let indices = flat.iter().map(|i| (i % above / below.max(1)) as i64).collect();
        Array::ints(indices, vec![flat.len()])
    });
    Ok(per_axis.collect())
}

/// Indices counted from the front and within an axis of this length.
fn checked(budget: &Budget, indices: &Array, length: usize) -> Result<Array, Fault> {
    budget.allocate(indices.size())?;
    let fixed =
        indices.to_ints().into_iter().map(|i| position(&Value::int(i), length, "axis").map(|i| i as i64));
    Ok(Array::ints(fixed.collect::<Result<_, _>>()?, indices.shape().to_vec()))
}
