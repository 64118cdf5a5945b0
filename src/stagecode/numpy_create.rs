//! numpy functions that make arrays: from lists, constants, and ranges.
//!
//! Bound arguments come in, arrays go out; sizes are charged before anything is allocated. Imports
//! arguments, arrays, conversions, faults.

use super::args::{Call, Row};
use super::array::Array;
use super::convert;
use super::error::Fault;
use super::scalar::{Dtype, Scalar};
use super::value::{Value, range_len};

/// The rows of this area.
pub const ROWS: &[Row] = &[
    Row::new("array", "object dtype? copy? ndmin? order? subok?", array),
    Row::new("asarray", "a dtype? order? copy?", asarray),
    Row::new("asanyarray", "a dtype? order?", asarray),
    Row::new("ascontiguousarray", "a dtype?", asarray),
    Row::new("copy", "a order?", copy),
    Row::new("zeros", "shape dtype? order?", |c| filled(c, Scalar::Float(0.0), 1)),
    Row::new("ones", "shape dtype? order?", |c| filled(c, Scalar::Float(1.0), 1)),
    Row::new("empty", "shape dtype? order?", |c| filled(c, Scalar::Float(0.0), 1)),
    Row::new("full", "shape fill_value dtype? order?", full),
    Row::new("zeros_like", "a dtype? shape?", |c| like(c, Scalar::Int(0))),
    Row::new("ones_like", "a dtype? shape?", |c| like(c, Scalar::Int(1))),
    Row::new("empty_like", "a dtype? shape?", |c| like(c, Scalar::Int(0))),
    Row::new("full_like", "a fill_value dtype? shape?", full_like),
    Row::new("arange", "start stop? step? dtype?", arange),
    Row::new("linspace", "start stop num? endpoint? retstep? dtype? axis?", linspace),
    Row::new("logspace", "start stop num? endpoint? base?", logspace),
    Row::new("geomspace", "start stop num? endpoint?", geomspace),
    Row::new("eye", "N M? k? dtype?", eye),
    Row::new("identity", "n dtype?", |c| diagonal_ones(c, c.count(0)?, c.count(0)?, 0, 1)),
    Row::new("diag", "v k?", diag),
    Row::new("tril", "m k?", |c| triangle(c, |row, column, k| column <= row + k)),
    Row::new("triu", "m k?", |c| triangle(c, |row, column, k| column >= row + k)),
    Row::new("tri", "N M? k? dtype?", |c| {
        let rows = c.count(0)?;
        let columns = if c.opt(1).is_some() { c.count(1)? } else { rows };
        let k = c.int_or(2, 0)?;
        c.eval.budget.allocate_shape(&[rows, columns])?;
        let one = |i: usize, j: usize| f64::from(u8::from(j as i64 <= (i as i64).saturating_add(k)));
        let all = (0..rows).flat_map(|i| (0..columns).map(move |j| one(i, j))).collect();
        Ok(Value::Array(Array::floats_as(all, c.dtype(3)?.unwrap_or(Dtype::F64), vec![rows, columns])))
    }),
    Row::new("fromiter", "iter dtype? count?", |c| {
        Ok(Value::Array(convert::to_array(&c.eval.budget, c.get(0)?, c.dtype(1)?)?))
    }),
    Row::new("ndarray", "*args", |_| {
        Err(Fault::unsupported("making an ndarray by its class", "use np.array, np.zeros or np.empty"))
    }),
    Row::new("finfo", "dtype", |c| Ok(Value::Dtype(convert::to_dtype(c.get(0)?)?))),
    Row::new("iinfo", "dtype", |c| Ok(Value::Dtype(convert::to_dtype(c.get(0)?)?))),
    Row::new("set_printoptions", "*args precision? suppress? threshold? linewidth?", |_| Ok(Value::None)),
    Row::new("seterr", "all? divide? over? under? invalid?", |_| Ok(Value::None)),
];

fn array(c: &Call) -> Result<Value, Fault> {
    let made = convert::to_array(&c.eval.budget, c.get(0)?, c.dtype(1)?)?;
    c.eval.budget.allocate(made.size())?;
    let mut made = made.copy();
    let wanted = usize::try_from(c.int_or(3, 0)?).unwrap_or(0).min(convert::MAX_DIMENSIONS);
    while made.ndim() < wanted {
        made = made.insert_axis(0);
    }
    // A number stays an array only where it is asked for; as a value both behave alike.
    Ok(Value::array(made))
}

fn asarray(c: &Call) -> Result<Value, Fault> {
    Ok(Value::array(convert::to_array(&c.eval.budget, c.get(0)?, c.dtype(1)?)?))
}

fn copy(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    c.eval.budget.allocate(a.size())?;
    Ok(Value::array(a.copy()))
}

/// An array of one value; `dtype` is the argument that may name its type.
fn filled(c: &Call, value: Scalar, dtype: usize) -> Result<Value, Fault> {
    let shape = c.shape(0)?;
    make(c, shape, value, c.dtype(dtype)?.unwrap_or(value.dtype()))
}

fn make(c: &Call, shape: Vec<usize>, value: Scalar, dtype: Dtype) -> Result<Value, Fault> {
    let count = c.eval.budget.allocate_shape(&shape)?;
    Ok(Value::array(Array::constant(value, count, dtype, shape)))
}

fn full(c: &Call) -> Result<Value, Fault> {
    let fill = c.array(1)?;
    let dtype = c.dtype(2)?.unwrap_or(fill.dtype());
    let shape = c.shape(0)?;
    if let (0, Some(value)) = (fill.ndim(), fill.first()) {
        return make(c, shape, value, dtype);
    }
    c.eval.budget.allocate_shape(&shape)?;
    Ok(Value::array(fill.broadcast(&shape)?.cast(dtype)))
}

fn like(c: &Call, value: Scalar) -> Result<Value, Fault> {
    let a = c.array(0)?;
    let shape = if c.opt(2).is_some() { c.shape(2)? } else { a.shape().to_vec() };
    make(c, shape, value, c.dtype(1)?.unwrap_or(a.dtype()))
}

fn full_like(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    let shape = if c.opt(3).is_some() { c.shape(3)? } else { a.shape().to_vec() };
    make(c, shape, c.scalar(1)?, c.dtype(2)?.unwrap_or(a.dtype()))
}

/// The numbers of `arange`, shared with the grids of `np.mgrid` and `np.r_`.
pub fn counted(c: &super::limits::Budget, start: Scalar, stop: Scalar, step: Scalar) -> Result<Array, Fault> {
    if let [Scalar::Int(a), Scalar::Int(b), Scalar::Int(s)] = [start, stop, step].map(int_if_bool) {
        if s == 0 {
            return Err(Fault::ZeroDivision);
        }
        let count = range_len(a, b, s);
        c.allocate(count)?;
        return Ok(Array::ints(
            (0..count as i64).map(|i| a.wrapping_add(i.wrapping_mul(s))).collect(),
            vec![count],
        ));
    }
    let (start, stop, step) = (start.float(), stop.float(), step.float());
    let count = ((stop - start) / step).ceil();
    if !count.is_finite() {
        return Err(Fault::value("arange() needs finite numbers and a step that is not zero"));
    }
    let count = count.max(0.0) as usize;
    c.allocate(count)?;
    // numpy computes the step from the first two elements.
    let delta = (start + step) - start;
    Ok(Array::floats((0..count).map(|i| start + i as f64 * delta).collect(), vec![count]))
}

fn int_if_bool(n: Scalar) -> Scalar {
    if let Scalar::Bool(_) = n { Scalar::Int(n.int()) } else { n }
}

fn arange(c: &Call) -> Result<Value, Fault> {
    let first = c.scalar(0)?;
    let (start, stop) = if c.opt(1).is_some() { (first, c.scalar(1)?) } else { (Scalar::Int(0), first) };
    let step = if c.opt(2).is_some() { c.scalar(2)? } else { Scalar::Int(1) };
    let made = counted(&c.eval.budget, start, stop, step)?;
    Ok(Value::Array(match c.dtype(3)? {
        // numpy steps in single precision then, from the first two elements.
        Some(Dtype::F32) => {
            let (first, next) = (start.float() as f32, (start.float() + step.float()) as f32);
            let at = |i: usize| f64::from(first + i as f32 * (next - first));
            Array::floats_as((0..made.size()).map(at).collect(), Dtype::F32, vec![made.size()])
        }
        Some(dtype) if dtype != made.dtype() => made.cast(dtype),
        _ => made,
    }))
}

/// `num` numbers from `start` to `stop`.
pub fn spaced(start: f64, stop: f64, num: usize, endpoint: bool) -> Vec<f64> {
    let parts = if endpoint { num.saturating_sub(1) } else { num };
    let step = (stop - start) / parts.max(1) as f64;
    let mut all: Vec<f64> = (0..num).map(|i| i as f64 * step + start).collect();
    if let (true, [_, .., last]) = (endpoint, &mut all[..]) {
        *last = stop;
    }
    all
}

fn linspace(c: &Call) -> Result<Value, Fault> {
    let num = if c.opt(2).is_some() { c.count(2)? } else { 50 };
    let endpoint = c.flag(3, true)?;
    let (from, to) = (c.array(0)?, c.array(1)?);
    let shape = super::array::broadcast_shapes(from.shape(), to.shape())?;
    let shape = convert::check_dimensions([&[num], &shape[..]].concat())?;
    c.eval.budget.allocate_shape(&shape)?;
    let (from, to) = (from.broadcast(&shape[1..])?.to_floats(), to.broadcast(&shape[1..])?.to_floats());
    let columns: Vec<Vec<f64>> = from.iter().zip(&to).map(|(&a, &b)| spaced(a, b, num, endpoint)).collect();
    let all = (0..num).flat_map(|i| columns.iter().map(move |column| column[i])).collect();
    let made = Value::Array(Array::floats_as(all, c.dtype(5)?.unwrap_or(Dtype::F64), shape));
    if !c.flag(4, false)? {
        return Ok(made);
    }
    let parts = if endpoint { num.saturating_sub(1) } else { num };
    let step = (c.float(1)? - c.float(0)?) / parts as f64;
    Ok(Value::tuple(vec![made, Value::float(step)]))
}

fn logspace(c: &Call) -> Result<Value, Fault> {
    let num = if c.opt(2).is_some() { c.count(2)? } else { 50 };
    c.eval.budget.allocate(num)?;
    let base = c.float_or(4, 10.0)?;
    let all =
        spaced(c.float(0)?, c.float(1)?, num, c.flag(3, true)?).into_iter().map(|x| base.powf(x)).collect();
    Ok(Value::Array(Array::floats(all, vec![num])))
}

fn geomspace(c: &Call) -> Result<Value, Fault> {
    let num = if c.opt(2).is_some() { c.count(2)? } else { 50 };
    c.eval.budget.allocate(num)?;
    let (start, stop) = (c.float(0)?, c.float(1)?);
    if start * stop <= 0.0 {
        return Err(c.problem("both ends must have the same sign and not be zero"));
    }
    let powers = spaced(0.0, (stop / start).log10(), num, c.flag(3, true)?);
    Ok(Value::Array(Array::floats(powers.into_iter().map(|x| start * 10f64.powf(x)).collect(), vec![num])))
}

fn eye(c: &Call) -> Result<Value, Fault> {
    let rows = c.count(0)?;
    let columns = if c.opt(1).is_some() { c.count(1)? } else { rows };
    diagonal_ones(c, rows, columns, c.int_or(2, 0)?, 3)
}

fn diagonal_ones(c: &Call, rows: usize, columns: usize, k: i64, dtype: usize) -> Result<Value, Fault> {
    let shape = vec![rows, columns];
    c.eval.budget.allocate_shape(&shape)?;
    let one = |i: usize, j: usize| f64::from(u8::from(j as i64 == (i as i64).saturating_add(k)));
    let all = (0..rows).flat_map(|i| (0..columns).map(move |j| one(i, j))).collect();
    Ok(Value::Array(Array::floats_as(all, c.dtype(dtype)?.unwrap_or(Dtype::F64), shape)))
}

fn diag(c: &Call) -> Result<Value, Fault> {
    let (a, k) = (c.array(0)?, c.int_or(1, 0)?);
    let offset = usize::try_from(k.unsigned_abs()).unwrap_or(usize::MAX);
    let (down, right) = if k < 0 { (offset, 0) } else { (0, offset) };
    c.eval.budget.charge(a.size())?;
    let all = a.to_floats();
    match *a.shape() {
        [n] => {
            let side = n.saturating_add(offset);
            c.eval.budget.allocate_shape(&[side, side])?;
            let mut out = vec![0.0; side * side];
            all.iter().enumerate().for_each(|(i, x)| out[(i + down) * side + i + right] = *x);
            Ok(Value::Array(Array::floats_as(out, a.dtype(), vec![side, side])))
        }
        [rows, columns] => {
            let n = rows.saturating_sub(down).min(columns.saturating_sub(right));
            let out = (0..n).map(|i| all[(i + down) * columns + i + right]).collect();
            Ok(Value::Array(Array::floats_as(out, a.dtype(), vec![n])))
        }
        _ => Err(c.problem("takes an array with one or two axes")),
    }
}

/// Keeps the elements of a matrix where `keep(row, column, k)` holds.
fn triangle(c: &Call, keep: fn(i64, i64, i64) -> bool) -> Result<Value, Fault> {
    let (a, k) = (c.array(0)?, c.int_or(1, 0)?.clamp(-1 << 40, 1 << 40));
    let [_, columns] = *a.shape() else { return Err(c.problem("takes a matrix")) };
    c.eval.budget.allocate(a.size())?;
    let at = |i: usize| ((i / columns) as i64, (i % columns) as i64);
    let zeroed = a.to_floats().into_iter().enumerate().map(|(i, x)| {
        let (row, column) = at(i);
        if keep(row, column, k) { x } else { 0.0 }
    });
    Ok(Value::Array(Array::floats_as(zeroed.collect(), a.dtype(), a.shape().to_vec())))
}
