//! numpy functions that sort, search and count.
//!
//! Arrays come in, sorted arrays, places and counts go out. NaN sorts last. Imports arguments, arrays, faults.

use super::args::{Call, Row, normalize_axis};
use super::array::Array;
use super::error::Fault;
use super::scalar::Dtype;
use super::value::Value;

/// The rows of this area.
pub const ROWS: &[Row] = &[
    Row::new("sort", "a axis? kind? order? stable?", |c| sorted(c, &c.array(0)?, 1).map(Value::Array)),
    Row::new("argsort", "a axis? kind? order? stable?", |c| {
        let places = |lane: &[f64]| order(lane).into_iter().map(|i| i as f64).collect();
        lanes(c, &c.array(0)?, 1, places, Some(Dtype::Int)).map(Value::Array)
    }),
    Row::new("argpartition", "a kth axis?", |c| {
        // Sorted is partitioned around every place at once; the axis is the third argument.
        let places = |lane: &[f64]| order(lane).into_iter().map(|i| i as f64).collect();
        lanes(c, &c.array(0)?, 2, places, Some(Dtype::Int)).map(Value::Array)
    }),
    Row::new("partition", "a kth axis?", |c| sorted(c, &c.array(0)?, 2).map(Value::Array)),
    Row::new("lexsort", "keys", lexsort),
    Row::new("unique", "ar return_index? return_inverse? return_counts? axis?", unique),
    Row::new("searchsorted", "a v side?", searchsorted),
    Row::new("digitize", "x bins right?", digitize),
    Row::new("bincount", "x weights? minlength?", bincount),
    Row::new("isin", "element test_elements", isin),
    Row::new("in1d", "element test_elements", isin),
];

/// What sorting takes for an element, as operations.
const SORTING: usize = 32;

/// Places of the elements of a lane in rising order; equal elements keep theirs.
pub fn order(lane: &[f64]) -> Vec<usize> {
    let mut at: Vec<usize> = (0..lane.len()).collect();
    at.sort_by(|&i, &j| {
        lane[i].partial_cmp(&lane[j]).unwrap_or_else(|| lane[i].is_nan().cmp(&lane[j].is_nan()))
    });
    at
}

/// Every lane in rising order; `axis` is the argument that names the axis.
pub fn sorted(c: &Call, a: &Array, axis: usize) -> Result<Array, Fault> {
    lanes(c, a, axis, |lane| order(lane).into_iter().map(|i| lane[i]).collect(), None)
}

/// Rearranges every lane along an axis (the last, if it is not given).
fn lanes(
    c: &Call,
    a: &Array,
    axis: usize,
    f: impl Fn(&[f64]) -> Vec<f64>,
    dtype: Option<Dtype>,
) -> Result<Array, Fault> {
    let mut a = a.clone();
    c.eval.budget.charge(a.size().saturating_mul(SORTING))?;
    c.eval.budget.allocate(a.size())?;
    let axis = if matches!(c.get(axis), Ok(Value::None)) {
        a = a.reshape(vec![a.size()]);
        0
    } else {
        normalize_axis(c.int_or(axis, -1)?, a.ndim())?
    };
    let mut order: Vec<usize> = (0..a.ndim()).filter(|&x| x != axis).collect();
    order.push(axis);
    let arranged = a.permute(&order);
    let all = arranged.to_floats().chunks(a.shape()[axis].max(1)).flat_map(f).collect();
    let out = Array::floats_as(all, dtype.unwrap_or(a.dtype()), arranged.shape().to_vec());
    let mut back: Vec<usize> = (0..a.ndim() - 1).collect();
    back.insert(axis, a.ndim() - 1);
    Ok(out.permute(&back).copy())
}

fn lexsort(c: &Call) -> Result<Value, Fault> {
    let keys: Vec<Vec<f64>> = c
        .sequence(0)?
        .iter()
        .map(|v| super::convert::to_array(&c.eval.budget, v, None).map(|a| a.to_floats()))
        .collect::<Result<_, _>>()?;
    let n = keys.first().map_or(0, Vec::len);
    if keys.iter().any(|k| k.len() != n) {
        return Err(c.problem("all keys must have the same length"));
    }
    c.eval.budget.charge(n.saturating_mul(SORTING * keys.len()))?;
    let mut at: Vec<usize> = (0..n).collect();
    for key in &keys {
        at.sort_by(|&i, &j| (key[i] + 0.0).total_cmp(&(key[j] + 0.0)));
    }
    Ok(Value::Array(Array::ints(at.into_iter().map(|i| i as i64).collect(), vec![n])))
}

fn unique(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    c.eval.budget.charge(a.size().saturating_mul(SORTING))?;
    c.eval.budget.allocate(a.size())?;
    let (width, shape) = match c.axis(4, a.ndim())? {
        None => (1, None),
        Some(0) if a.ndim() == 2 => (a.shape()[1], Some(a.shape()[1])),
        Some(_) => return Err(c.problem("`axis` is supported for the rows of a matrix only")),
    };
    // -0.0 and 0.0 are equal, and NaN is equal to NaN, as in numpy.
    let all: Vec<f64> = a.to_floats().into_iter().map(|x| x + 0.0).collect();
    let row = |i: usize| &all[i * width..(i + 1) * width];
    let count = if shape.is_some() { a.shape()[0] } else { all.len() };
    let compare = |x: &[f64], y: &[f64]| {
        x.iter().zip(y).map(|(p, q)| p.total_cmp(q)).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    };
    let mut at: Vec<usize> = (0..count).collect();
    at.sort_by(|&i, &j| compare(row(i), row(j)));
    let (mut first, mut counts, mut inverse) = (Vec::<usize>::new(), Vec::<i64>::new(), vec![0i64; count]);
    for &i in &at {
        if first.last().is_none_or(|&f| compare(row(f), row(i)).is_ne()) {
            first.push(i);
            counts.push(0);
        }
        inverse[i] = first.len() as i64 - 1;
        if let Some(n) = counts.last_mut() {
            *n += 1;
        }
    }
    let n = first.len();
    let values = first.iter().flat_map(|&i| row(i).to_vec()).collect();
    let shape = shape.map_or(vec![n], |width| vec![n, width]);
    let mut out = vec![Value::Array(Array::floats_as(values, a.dtype(), shape))];
    let ints = |v: Vec<i64>| {
        Value::Array(Array::new(super::array::Buffer::Int(v.clone()), Dtype::Int, vec![v.len()]))
    };
    if c.flag(1, false)? {
        out.push(ints(first.iter().map(|&i| i as i64).collect()));
    }
    if c.flag(2, false)? {
        out.push(ints(inverse));
    }
    if c.flag(3, false)? {
        out.push(ints(counts));
    }
    Ok(if out.len() == 1 { out.swap_remove(0) } else { Value::tuple(out) })
}

/// Where each value belongs in sorted `edges`.
fn places(c: &Call, values: &Array, edges: &[f64], right: bool) -> Result<Value, Fault> {
    c.eval.budget.allocate(values.size())?;
    let place = |x: f64| edges.partition_point(|&e| if right { e <= x } else { e < x }) as i64;
    let all = values.to_floats().into_iter().map(place).collect();
    Ok(Value::array(Array::ints(all, values.shape().to_vec())))
}

fn searchsorted(c: &Call) -> Result<Value, Fault> {
    let right = c.opt(2).is_some() && c.text(2)? == "right";
    places(c, &c.array(1)?, &c.floats(0)?, right)
}

fn digitize(c: &Call) -> Result<Value, Fault> {
    places(c, &c.array(0)?, &c.floats(1)?, !c.flag(2, false)?)
}

fn bincount(c: &Call) -> Result<Value, Fault> {
    let x = c.array(0)?.to_ints();
    let weights = if c.opt(1).is_some() { Some(c.floats(1)?) } else { None };
    if x.iter().any(|&i| i < 0) || weights.as_ref().is_some_and(|w| w.len() != x.len()) {
        return Err(c.problem("takes integers that are not negative, and one weight for each"));
    }
    let least = usize::try_from(c.int_or(2, 0)?).unwrap_or(0);
    let bins = x.iter().max().map_or(0, |&m| (m as usize).saturating_add(1)).max(least);
    c.eval.budget.allocate(bins)?;
    let mut out = vec![0.0; bins];
    x.iter().enumerate().for_each(|(at, &i)| out[i as usize] += weights.as_ref().map_or(1.0, |w| w[at]));
    let dtype = if weights.is_some() { Dtype::F64 } else { Dtype::Int };
    Ok(Value::Array(Array::floats_as(out, dtype, vec![bins])))
}

fn isin(c: &Call) -> Result<Value, Fault> {
    let (a, mut wanted) = (c.array(0)?, c.floats(1)?);
    c.eval.budget.allocate(a.size())?;
    c.eval.budget.charge(wanted.len().saturating_mul(SORTING))?;
    wanted.iter_mut().for_each(|w| *w += 0.0);
    wanted.sort_unstable_by(f64::total_cmp);
    let found = |x: f64| wanted.binary_search_by(|w| w.total_cmp(&(x + 0.0))).is_ok();
    Ok(Value::array(Array::bools(a.to_floats().into_iter().map(found).collect(), a.shape().to_vec())))
}
