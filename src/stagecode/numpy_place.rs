//! numpy functions that take elements out by place, treat arrays as sets, and a few on series of numbers.
//!
//! Arrays come in, arrays go out. Imports arguments, arrays, faults.

use super::args::{Call, Row, normalize_axis};
use super::array::Array;
use super::array_index;
use super::error::Fault;
use super::numpy_sort::order;
use super::scalar::Dtype;
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
    Row::new("rot90", "m k?", rot90),
    Row::new("union1d", "ar1 ar2", |c| combined(c, |_, _| true)),
    Row::new("intersect1d", "ar1 ar2", |c| combined(c, |a, b| a && b)),
    Row::new("setdiff1d", "ar1 ar2", |c| combined(c, |a, b| a && !b)),
    Row::new("polyval", "p x", polyval),
    Row::new("gradient", "f *varargs", gradient),
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
    c.eval.budget.charge(count.saturating_mul(16))?;
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

/// Horner's rule, the highest power first.
fn polyval(c: &Call) -> Result<Value, Fault> {
    let (p, x) = (c.array(0)?, c.array(1)?);
    c.eval.budget.allocate(x.size())?;
    c.eval.budget.charge(x.size().saturating_mul(p.size()))?;
    let coefficients = p.to_floats();
    let at = |x: f64| coefficients.iter().fold(0.0, |y, a| y * x + a);
    let values = x.to_floats().into_iter().map(at).collect();
    let dtype = p.dtype().promote(x.dtype());
    Ok(Value::array(Array::floats_as(values, dtype, x.shape().to_vec())))
}

/// Central differences, one-sided at both ends, along the only axis.
fn gradient(c: &Call) -> Result<Value, Fault> {
    let f = c.floats(0)?;
    let n = f.len();
    if c.array(0)?.ndim() != 1 || n < 2 {
        return Err(c.problem("is supported for two or more numbers in a row; use np.diff"));
    }
    let h = c.rest.first().map_or(Ok(1.0), |v| {
        v.as_scalar().map(|s| s.float()).ok_or_else(|| c.problem("the spacing must be one number"))
    })?;
    c.eval.budget.allocate(n)?;
    let at = |i: usize| match i {
        0 => (f[1] - f[0]) / h,
        _ if i == n - 1 => (f[n - 1] - f[n - 2]) / h,
        _ => (f[i + 1] - f[i - 1]) / (2.0 * h),
    };
    Ok(Value::Array(Array::floats_as((0..n).map(at).collect(), Dtype::F64, vec![n])))
}

/// Checks an axis of rows that are folded.
pub fn first_axis(c: &Call, at: usize, ndim: usize) -> Result<(), Fault> {
    match normalize_axis(c.int_or(at, 0)?, ndim)? {
        0 => Ok(()),
        _ => Err(c.problem("is supported along the first axis; use np.sum and its like")),
    }
}
