//! numpy functions that reduce axes: sums, means, extremes, and running sums.
//!
//! An array, an axis (or several, or none for all) and `keepdims` come in; an array with fewer elements
//! goes out. Sums over the last axis are pairwise, as numpy's are. Imports arguments, arrays, faults.

use super::args::{Call, Row, normalize_axis};
use super::array::Array;
use super::error::Fault;
use super::scalar::{Dtype, Scalar};
use super::value::Value;

/// The rows of this area.
pub const ROWS: &[Row] = &[
    Row::new("sum", "a axis? dtype? keepdims? initial? where?", |c| total(c, (0, i64::wrapping_add), sum)),
    Row::new("nansum", "a axis? dtype? keepdims?", |c| {
        total(c, (0, i64::wrapping_add), |v| sum(&not_nan(v)))
    }),
    Row::new("prod", "a axis? dtype? keepdims? initial? where?", |c| {
        total(c, (1, i64::wrapping_mul), |v| v.iter().product())
    }),
    Row::new("mean", "a axis? dtype? keepdims?", |c| floats(c, 3, mean)),
    Row::new("nanmean", "a axis? dtype? keepdims?", |c| floats(c, 3, |v| mean(&not_nan(v)))),
    Row::new("average", "a axis? weights?", average),
    Row::new("median", "a axis? keepdims?", |c| floats(c, 2, |v| quantile_of(v, 0.5))),
    Row::new("var", "a axis? ddof? keepdims?", |c| spread(c, |x| x)),
    Row::new("std", "a axis? ddof? keepdims?", |c| spread(c, f64::sqrt)),
    Row::new("min", "a axis? keepdims? initial?", |c| extreme(c, |a, b| a < b)),
    Row::new("max", "a axis? keepdims? initial?", |c| extreme(c, |a, b| a > b)),
    Row::new("amin", "a axis? keepdims? initial?", |c| extreme(c, |a, b| a < b)),
    Row::new("amax", "a axis? keepdims? initial?", |c| extreme(c, |a, b| a > b)),
    Row::new("nanmin", "a axis? keepdims?", |c| {
        floats(c, 2, |v| not_nan(v).into_iter().fold(f64::NAN, f64::min))
    }),
    Row::new("nanmax", "a axis? keepdims?", |c| {
        floats(c, 2, |v| not_nan(v).into_iter().fold(f64::NAN, f64::max))
    }),
    Row::new("ptp", "a axis? keepdims?", |c| {
        floats(c, 2, |v| extreme_of(v, |a, b| a > b) - extreme_of(v, |a, b| a < b))
    }),
    Row::new("argmin", "a axis? keepdims?", |c| place(c, |a, b| a < b)),
    Row::new("argmax", "a axis? keepdims?", |c| place(c, |a, b| a > b)),
    Row::new("any", "a axis? keepdims?", |c| flags(c, |v| v.iter().any(|&x| x != 0.0))),
    Row::new("all", "a axis? keepdims?", |c| flags(c, |v| v.iter().all(|&x| x != 0.0))),
    Row::new("count_nonzero", "a axis? keepdims?", count_nonzero),
    Row::new("percentile", "a q axis? keepdims? method?", |c| quantile(c, 0.01)),
    Row::new("quantile", "a q axis? keepdims? method?", |c| quantile(c, 1.0)),
    Row::new("cumsum", "a axis?", |c| running(c, |x, y| x + y)),
    Row::new("cumprod", "a axis?", |c| running(c, |x, y| x * y)),
    Row::new("diff", "a n? axis?", diff),
    Row::new("trapezoid", "y x? dx?", trapezoid),
    Row::new("trapz", "y x? dx?", trapezoid),
];

/// An array cut into lanes: the elements that are reduced to one stand together.
struct Lanes {
    /// The array with the reduced axes last.
    arranged: Array,
    /// The axes in that order.
    order: Vec<usize>,
    /// Elements in a lane.
    length: usize,
    /// Number of lanes.
    count: usize,
    /// Shape of the result.
    shape: Vec<usize>,
    dtype: Dtype,
}

impl Lanes {
    /// Lanes along the axis argument at `axis`; `keepdims` is the argument that keeps them as ones.
    fn of(c: &Call, axis: usize, keepdims: Option<usize>) -> Result<Self, Fault> {
        let a = c.array(0)?;
        c.eval.budget.allocate_shape(a.shape())?;
        let axes = match c.opt(axis) {
            None => (0..a.ndim()).collect(),
            Some(Value::Tuple(_) | Value::List(_)) => {
                let all = c.sequence(axis)?;
                let one = |v: &Value| v.as_int().ok_or_else(|| c.problem("axes are integers"));
                all.iter().map(|v| normalize_axis(one(v)?, a.ndim())).collect::<Result<Vec<_>, _>>()?
            }
            Some(_) => c.axis(axis, a.ndim())?.into_iter().collect(),
        };
        let keep = keepdims.map_or(Ok(false), |at| c.flag(at, false))?;
        let kept: Vec<usize> = (0..a.ndim()).filter(|x| !axes.contains(x)).collect();
        let gone: Vec<usize> = (0..a.ndim()).filter(|x| axes.contains(x)).collect();
        let lengths = a.shape();
        let shape = if keep {
            (0..a.ndim()).map(|x| if axes.contains(&x) { 1 } else { lengths[x] }).collect()
        } else {
            kept.iter().map(|&x| lengths[x]).collect()
        };
        Ok(Self {
            length: gone.iter().map(|&x| lengths[x]).product(),
            count: kept.iter().map(|&x| lengths[x]).product(),
            arranged: a.permute(&[&kept[..], &gone[..]].concat()),
            order: [kept, gone].concat(),
            dtype: a.dtype(),
            shape,
        })
    }

    /// Puts `instead` in the place of elements where the mask at the argument `at` is false.
    fn leave_out(&mut self, c: &Call, at: usize, instead: i64) -> Result<(), Fault> {
        let a = c.array(0)?;
        let mask = c.array(at)?.broadcast(a.shape())?.permute(&self.order).to_bools();
        c.eval.budget.allocate(mask.len().saturating_mul(2))?;
        let mut all = self.arranged.to_scalars();
        all.iter_mut().zip(mask).filter(|(_, kept)| !kept).for_each(|(x, _)| *x = Scalar::Int(instead));
        self.arranged = Array::from_scalars(&all, self.dtype, vec![self.count, self.length]);
        Ok(())
    }

    /// Puts one more element in front of every lane.
    fn lengthen(&mut self, c: &Call, first: Scalar) -> Result<(), Fault> {
        c.eval.budget.allocate_shape(&[self.count, self.length + 1])?;
        let lanes = self.arranged.reshape(vec![self.count, self.length]);
        let first = Array::scalar(first).broadcast(&[self.count, 1])?;
        self.arranged = super::numpy_join::join(&c.eval.budget, &[first, lanes], 1)?;
        self.length += 1;
        self.dtype = self.arranged.dtype();
        Ok(())
    }

    /// Applies `f` to every lane.
    fn map<T: Clone, R>(&self, elements: &[T], f: impl Fn(&[T]) -> R) -> Vec<R> {
        (0..self.count).map(|i| f(&elements[i * self.length..(i + 1) * self.length])).collect()
    }
}

/// The sum of a lane: pairwise in blocks of 128, with eight running sums in a block (numpy's scheme).
pub fn sum(lane: &[f64]) -> f64 {
    let n = lane.len();
    if n < 8 {
        return lane.iter().fold(0.0, |s, x| s + x);
    }
    if n > 128 {
        let half = n / 2 - (n / 2) % 8;
        return sum(&lane[..half]) + sum(&lane[half..]);
    }
    let mut r = [0.0; 8];
    let blocks = lane.chunks_exact(8);
    let rest = blocks.remainder();
    for block in blocks {
        r.iter_mut().zip(block).for_each(|(r, x)| *r += x);
    }
    let eight = ((r[0] + r[1]) + (r[2] + r[3])) + ((r[4] + r[5]) + (r[6] + r[7]));
    rest.iter().fold(eight, |s, x| s + x)
}

/// The arithmetic mean of a lane.
pub fn mean(lane: &[f64]) -> f64 {
    sum(lane) / lane.len() as f64
}

fn not_nan(lane: &[f64]) -> Vec<f64> {
    lane.iter().copied().filter(|x| !x.is_nan()).collect()
}

fn total(c: &Call, ints: (i64, fn(i64, i64) -> i64), floats: fn(&[f64]) -> f64) -> Result<Value, Fault> {
    let mut lanes = Lanes::of(c, 1, Some(3))?;
    let dtype = c.dtype(2)?.unwrap_or(lanes.dtype.max(Dtype::Int));
    if c.opt(5).is_some() {
        lanes.leave_out(c, 5, ints.0)?;
    }
    if c.opt(4).is_some() {
        // One number more in each lane stands for the initial value.
        lanes.lengthen(c, c.scalar(4)?)?;
    }
    if !dtype.is_float() {
        let all = lanes.map(&lanes.arranged.to_ints(), |v| v.iter().fold(ints.0, |s, &x| (ints.1)(s, x)));
        return Ok(Value::array(Array::ints(all, lanes.shape)));
    }
    let all = lanes.map(&lanes.arranged.to_floats(), floats);
    Ok(Value::array(Array::floats_as(all, dtype, lanes.shape)))
}

fn floats(c: &Call, keepdims: usize, f: impl Fn(&[f64]) -> f64) -> Result<Value, Fault> {
    let lanes = Lanes::of(c, 1, Some(keepdims))?;
    let dtype = if lanes.dtype == Dtype::F32 { Dtype::F32 } else { Dtype::F64 };
    let all = lanes.map(&lanes.arranged.to_floats(), f);
    Ok(Value::array(Array::floats_as(all, dtype, lanes.shape)))
}

fn flags(c: &Call, f: impl Fn(&[f64]) -> bool) -> Result<Value, Fault> {
    let lanes = Lanes::of(c, 1, Some(2))?;
    Ok(Value::array(Array::bools(lanes.map(&lanes.arranged.to_floats(), f), lanes.shape)))
}

fn count_nonzero(c: &Call) -> Result<Value, Fault> {
    let lanes = Lanes::of(c, 1, Some(2))?;
    let all = lanes.map(&lanes.arranged.to_bools(), |v| v.iter().filter(|&&b| b).count() as i64);
    Ok(Value::array(Array::ints(all, lanes.shape)))
}

fn average(c: &Call) -> Result<Value, Fault> {
    if c.opt(2).is_none() {
        return floats(c, usize::MAX, mean);
    }
    let weights = c.array(2)?;
    let lanes = Lanes::of(c, 1, None)?;
    let per_lane = weights.to_floats();
    if per_lane.len() != lanes.length {
        return Err(c.problem("there must be one weight per element along the axis"));
    }
    let weighted = |v: &[f64]| v.iter().zip(&per_lane).map(|(x, w)| x * w).sum::<f64>() / sum(&per_lane);
    let all = lanes.map(&lanes.arranged.to_floats(), weighted);
    Ok(Value::array(Array::floats(all, lanes.shape)))
}

fn spread(c: &Call, last: fn(f64) -> f64) -> Result<Value, Fault> {
    let ddof = c.float_or(2, 0.0)?;
    floats(c, 3, |v| {
        let middle = mean(v);
        let squares: Vec<f64> = v.iter().map(|x| (x - middle) * (x - middle)).collect();
        last(sum(&squares) / (v.len() as f64 - ddof).max(0.0))
    })
}

/// The element of a lane that `beats` all others; NaN beats everything, as in numpy.
fn extreme_of(lane: &[f64], beats: fn(f64, f64) -> bool) -> f64 {
    lane[place_of(lane, beats)]
}

fn place_of(lane: &[f64], beats: fn(f64, f64) -> bool) -> usize {
    let better =
        |best: usize, i: usize| !lane[best].is_nan() && (beats(lane[i], lane[best]) || lane[i].is_nan());
    (0..lane.len()).fold(0, |best, i| if better(best, i) { i } else { best })
}

fn not_empty(c: &Call, lanes: &Lanes) -> Result<(), Fault> {
    if lanes.length == 0 && lanes.count > 0 {
        return Err(Fault::value(format!("{}() of an empty array", c.name)));
    }
    Ok(())
}

fn extreme(c: &Call, beats: fn(f64, f64) -> bool) -> Result<Value, Fault> {
    let mut lanes = Lanes::of(c, 1, Some(2))?;
    if c.opt(3).is_some() {
        lanes.lengthen(c, c.scalar(3)?)?;
    }
    not_empty(c, &lanes)?;
    let all = lanes.map(&lanes.arranged.to_floats(), |v| extreme_of(v, beats));
    Ok(Value::array(Array::floats_as(all, lanes.dtype, lanes.shape)))
}

fn place(c: &Call, beats: fn(f64, f64) -> bool) -> Result<Value, Fault> {
    let lanes = Lanes::of(c, 1, Some(2))?;
    not_empty(c, &lanes)?;
    let all = lanes.map(&lanes.arranged.to_floats(), |v| place_of(v, beats) as i64);
    Ok(Value::array(Array::ints(all, lanes.shape)))
}

/// The value below which the share `q` of a lane lies, interpolated.
fn quantile_of(lane: &[f64], q: f64) -> f64 {
    if lane.is_empty() || lane.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let mut sorted = lane.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let at = q.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let (low, high) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    low + (high - low) * at.fract()
}

fn quantile(c: &Call, unit: f64) -> Result<Value, Fault> {
    if c.opt(4).is_some() && c.text(4)? != "linear" {
        return Err(c.problem("`method` is supported as 'linear' only"));
    }
    let lanes = Lanes::of(c, 2, Some(3))?;
    let shares = c.array(1)?;
    let elements = lanes.arranged.to_floats();
    let mut all = Vec::new();
    for share in shares.to_floats() {
        c.eval.budget.allocate(elements.len())?;
        all.extend(lanes.map(&elements, |v| quantile_of(v, share * unit)));
    }
    Ok(Value::array(Array::floats(all, [shares.shape(), &lanes.shape[..]].concat())))
}

fn running(c: &Call, f: fn(f64, f64) -> f64) -> Result<Value, Fault> {
    let a = c.array(0)?;
    c.eval.budget.allocate(a.size())?;
    let (a, axis) = match c.axis(1, a.ndim())? {
        Some(axis) => (a, axis),
        None => (a.reshape(vec![a.size()]), 0),
    };
    let mut order: Vec<usize> = (0..a.ndim()).filter(|&x| x != axis).collect();
    order.push(axis);
    let arranged = a.permute(&order);
    let mut all = arranged.to_floats();
    for lane in all.chunks_mut(a.shape()[axis].max(1)) {
        (1..lane.len()).for_each(|i| lane[i] = f(lane[i - 1], lane[i]));
    }
    let out = Array::floats_as(all, a.dtype().max(Dtype::Int), arranged.shape().to_vec());
    let mut back: Vec<usize> = (0..a.ndim() - 1).collect();
    back.insert(axis, a.ndim() - 1);
    Ok(Value::array(out.permute(&back)))
}

fn diff(c: &Call) -> Result<Value, Fault> {
    let mut a = c.array(0)?;
    let axis = normalize_axis(c.int_or(2, -1)?, a.ndim())?;
    for _ in 0..c.int_or(1, 1)?.clamp(0, 16) {
        let n = a.shape()[axis].saturating_sub(1);
        let parts = [a.slice(axis, 1.min(a.shape()[axis]), 1, n), a.slice(axis, 0, 1, n)].map(Value::Array);
        let step = super::elementwise::binary_values(
            &c.eval.budget,
            super::elementwise::Op::Subtract,
            &parts[0],
            &parts[1],
        )?;
        a = super::convert::to_array(&c.eval.budget, &step, None)?;
    }
    Ok(Value::array(a))
}

fn trapezoid(c: &Call) -> Result<Value, Fault> {
    let y = c.floats(0)?;
    let x = if c.opt(1).is_some() { c.floats(1)? } else { Vec::new() };
    let dx = c.float_or(2, 1.0)?;
    if !x.is_empty() && x.len() != y.len() {
        return Err(c.problem("`x` and `y` must have the same length"));
    }
    let width = |i: usize| if x.is_empty() { dx } else { x[i] - x[i - 1] };
    Ok(Value::float64((1..y.len()).map(|i| width(i) * (y[i] + y[i - 1]) / 2.0).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairwise_sums_are_accurate() {
        let many = vec![0.1; 100_000];
        assert!((sum(&many) - 10_000.0).abs() < 1e-9);
        assert_eq!(sum(&[]), 0.0);
    }
}
