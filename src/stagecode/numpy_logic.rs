//! numpy functions that choose, test and round: `where`, `clip`, `isclose`, `round` and their like.
//!
//! Arrays come in, masks and chosen elements go out. Imports arguments, arrays, faults.

use super::args::{Arguments, Call, Row};
use super::array::{Array, broadcast_shapes};
use super::array_index::nonzero;
use super::convert::to_array;
use super::elementwise::{self, Op, binary_values, keep_ints};
use super::error::{Fault, Raised};
use super::scalar::{Dtype, Scalar};
use super::value::Value;

/// The rows of this area.
pub const ROWS: &[Row] = &[
    Row::new("where", "condition x? y?", choose),
    Row::new("select", "condlist choicelist default?", select),
    Row::new("clip", "a a_min? a_max? out? where? dtype? min? max?", clip),
    Row::each("isnan", |c| test(c, f64::is_nan)),
    Row::each("isfinite", |c| test(c, f64::is_finite)),
    Row::each("isinf", |c| test(c, f64::is_infinite)),
    Row::each("signbit", |c| test(c, f64::is_sign_negative)),
    Row::each("logical_not", |c| test(c, |x| x == 0.0)),
    Row::each("invert", |c| elementwise::invert(&c.eval.budget, &c.array(0)?).map(Value::array)),
    Row::each("bitwise_not", |c| elementwise::invert(&c.eval.budget, &c.array(0)?).map(Value::array)),
    Row::new("isclose", "a b rtol? atol? equal_nan?", isclose),
    Row::new("allclose", "a b rtol? atol? equal_nan?", allclose),
    Row::new("array_equal", "a1 a2", array_equal),
    Row::each("abs", |c| elementwise::absolute(&c.eval.budget, &c.array(0)?).map(Value::array)),
    Row::each("absolute", |c| elementwise::absolute(&c.eval.budget, &c.array(0)?).map(Value::array)),
    Row::each("negative", |c| elementwise::negate(&c.eval.budget, &c.array(0)?).map(Value::array)),
    Row::each("positive", |c| c.array(0).map(Value::array)),
    Row::each("square", |c| binary_values(&c.eval.budget, Op::Multiply, c.get(0)?, c.get(0)?)),
    Row::each("sign", |c| keep(c, |x| if x == 0.0 || x.is_nan() { x } else { x.signum() }, i64::signum)),
    Row::each("floor", |c| keep_ints(&c.eval.budget, c.get(0)?, f64::floor)),
    Row::each("ceil", |c| keep_ints(&c.eval.budget, c.get(0)?, f64::ceil)),
    Row::each("trunc", |c| keep_ints(&c.eval.budget, c.get(0)?, f64::trunc)),
    Row::each("fix", |c| keep_ints(&c.eval.budget, c.get(0)?, f64::trunc)),
    Row::each("rint", |c| keep_ints(&c.eval.budget, c.get(0)?, f64::round_ties_even)),
    Row::new("round", "a decimals? out?", |c| super::ufunc::put(c, round(c)?, 2)),
    Row::new("around", "a decimals? out?", |c| super::ufunc::put(c, round(c)?, 2)),
    Row::new("nan_to_num", "x copy? nan? posinf? neginf?", nan_to_num),
    Row::new("nonzero", "a", |c| Ok(Value::tuple(places(c)?.into_iter().map(Value::Array).collect()))),
    Row::new("flatnonzero", "a", flatnonzero),
    Row::new("argwhere", "a", argwhere),
    Row::new("isscalar", "element", |c| {
        Ok(Value::bool(matches!(c.get(0)?, Value::Number(_) | Value::Str(_))))
    }),
    Row::new("interp", "x xp fp left? right? period?", interp),
    Row::new("vectorize", "pyfunc otypes? doc? excluded? cache?", |c| {
        // In a tuple, which is taken apart without recursion however deep it is.
        let function = Value::tuple(vec![c.get(0)?.clone()]);
        Ok(Value::Method(std::rc::Rc::new((function, &VECTORIZED))))
    }),
    Row::back("piecewise", "x condlist funclist", piecewise),
    Row::each("isreal", |c| test(c, |_| true)),
    Row::each("real", |c| c.array(0).map(Value::array)),
    Row::back("apply_along_axis", "func1d axis arr", apply_along_axis),
];

/// What `np.vectorize` returns: called with arrays, it runs the function on each element.
static VECTORIZED: Row = Row::back("vectorized", "pyfunc *args", vectorized);

fn choose(c: &Call) -> Result<Value, Fault> {
    if c.opt(1).is_none() || c.opt(2).is_none() {
        return Ok(Value::tuple(places(c)?.into_iter().map(Value::Array).collect()));
    }
    let (condition, x, y) = (c.array(0)?, c.array(1)?, c.array(2)?);
    let weak = |v: &Value| matches!(v, Value::Number(_));
    // A Python number takes the type of the array on the other side.
    let dtype = match (weak(c.get(1)?), weak(c.get(2)?)) {
        (true, false) if y.dtype() == Dtype::F32 => Dtype::F32,
        (false, true) if x.dtype() == Dtype::F32 => Dtype::F32,
        _ => x.dtype().promote(y.dtype()),
    };
    let shape = broadcast_shapes(condition.shape(), &broadcast_shapes(x.shape(), y.shape())?)?;
    c.eval.budget.allocate_shape(&shape)?;
    let (x, y) = (x.broadcast(&shape)?.to_scalars(), y.broadcast(&shape)?.to_scalars());
    let mask = condition.broadcast(&shape)?.to_bools();
    let all: Vec<Scalar> =
        mask.into_iter().zip(x.into_iter().zip(y)).map(|(m, (x, y))| if m { x } else { y }).collect();
    Ok(Value::array(Array::from_scalars(&all, dtype, shape)))
}

fn select(c: &Call) -> Result<Value, Fault> {
    let budget = &c.eval.budget;
    let (conditions, choices) = (c.sequence(0)?, c.sequence(1)?);
    let mut out = to_array(budget, c.opt(2).unwrap_or(&Value::int(0)), None)?;
    for (condition, choice) in conditions.iter().zip(&choices).rev() {
        let (mask, choice) = (to_array(budget, condition, None)?, to_array(budget, choice, None)?);
        let shape = broadcast_shapes(mask.shape(), &broadcast_shapes(choice.shape(), out.shape())?)?;
        budget.allocate_shape(&shape)?;
        let dtype = choice.dtype().promote(out.dtype());
        let (yes, no) = (choice.broadcast(&shape)?.to_scalars(), out.broadcast(&shape)?.to_scalars());
        let mask = mask.broadcast(&shape)?.to_bools();
        let all: Vec<Scalar> =
            mask.iter().enumerate().map(|(i, &m)| if m { yes[i] } else { no[i] }).collect();
        out = Array::from_scalars(&all, dtype, shape);
    }
    Ok(Value::array(out))
}

fn clip(c: &Call) -> Result<Value, Fault> {
    let mut value = Value::array(c.array(0)?);
    if let Some(low) = c.opt(1).or(c.opt(6)) {
        value = binary_values(&c.eval.budget, Op::Maximum, &value, low)?;
    }
    if let Some(high) = c.opt(2).or(c.opt(7)) {
        value = binary_values(&c.eval.budget, Op::Minimum, &value, high)?;
    }
    super::ufunc::put(c, value, 3)
}

fn test(c: &Call, f: fn(f64) -> bool) -> Result<Value, Fault> {
    let a = c.array(0)?;
    c.eval.budget.allocate(a.size())?;
    let all = a.to_floats().into_iter().map(f).collect();
    Ok(Value::array(Array::bools(all, a.shape().to_vec())))
}

/// Applies one function to floats and another to integers.
fn keep(c: &Call, floats: fn(f64) -> f64, ints: fn(i64) -> i64) -> Result<Value, Fault> {
    let a = c.array(0)?;
    if a.dtype().is_float() {
        return keep_ints(&c.eval.budget, c.get(0)?, floats);
    }
    c.eval.budget.allocate(a.size())?;
    Ok(Value::array(Array::ints(a.to_ints().into_iter().map(ints).collect(), a.shape().to_vec())))
}

/// Whether pairs are equal to within `atol + rtol |b|`.
fn close(c: &Call) -> Result<Array, Fault> {
    let (rtol, atol) = (c.float_or(2, 1e-5)?, c.float_or(3, 1e-8)?);
    let (a, b) = (c.array(0)?, c.array(1)?);
    let shape = broadcast_shapes(a.shape(), b.shape())?;
    c.eval.budget.allocate_shape(&shape)?;
    let (a, b) = (a.broadcast(&shape)?.to_floats(), b.broadcast(&shape)?.to_floats());
    let nan = c.flag(4, false)?;
    let near = |(x, y): (f64, f64)| {
        x == y || nan && x.is_nan() && y.is_nan() || (x - y).abs() <= atol + rtol * y.abs()
    };
    Ok(Array::bools(a.into_iter().zip(b).map(near).collect(), shape))
}

fn isclose(c: &Call) -> Result<Value, Fault> {
    close(c).map(Value::array)
}

fn allclose(c: &Call) -> Result<Value, Fault> {
    Ok(Value::bool(close(c)?.to_bools().into_iter().all(|b| b)))
}

fn array_equal(c: &Call) -> Result<Value, Fault> {
    let (a, b) = (c.array(0)?, c.array(1)?);
    c.eval.budget.charge(a.size())?;
    Ok(Value::bool(a.shape() == b.shape() && a.to_floats() == b.to_floats()))
}

/// Rounds halves to even, after scaling by a power of ten, as numpy does.
fn round(c: &Call) -> Result<Value, Fault> {
    let decimals = c.int_or(1, 0)?.clamp(-300, 300) as i32;
    let scale = 10f64.powi(decimals.abs());
    let rounded = move |x: f64| {
        if decimals >= 0 {
            (x * scale).round_ties_even() / scale
        } else {
            (x / scale).round_ties_even() * scale
        }
    };
    let a = c.array(0)?;
    if decimals < 0 && a.dtype() == Dtype::Int {
        c.eval.budget.allocate(a.size())?;
        let tens = a.to_ints().into_iter().map(|x| rounded(x as f64) as i64).collect();
        return Ok(Value::array(Array::ints(tens, a.shape().to_vec())));
    }
    keep_ints(&c.eval.budget, c.get(0)?, rounded)
}

fn nan_to_num(c: &Call) -> Result<Value, Fault> {
    let (nan, high, low) = (c.float_or(2, 0.0)?, c.float_or(3, f64::MAX)?, c.float_or(4, f64::MIN)?);
    let finite = move |x: f64| match x {
        f64::INFINITY => high,
        f64::NEG_INFINITY => low,
        x if x.is_nan() => nan,
        x => x,
    };
    keep_ints(&c.eval.budget, c.get(0)?, finite)
}

fn places(c: &Call) -> Result<Vec<Array>, Fault> {
    let a = c.array(0)?;
    nonzero(&c.eval.budget, &if a.ndim() == 0 { a.insert_axis(0) } else { a })
}

fn flatnonzero(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    c.eval.budget.allocate(a.size())?;
    let found = nonzero(&c.eval.budget, &a.reshape(vec![a.size()]))?;
    Ok(found.into_iter().next().map_or(Value::None, Value::Array))
}

fn argwhere(c: &Call) -> Result<Value, Fault> {
    super::numpy_join::columns(&c.eval.budget, &places(c)?)
}

fn interp(c: &Call) -> Result<Value, Fault> {
    let (x, xp, fp) = (c.array(0)?, c.floats(1)?, c.floats(2)?);
    if xp.is_empty() || xp.len() != fp.len() {
        return Err(c.problem("`xp` and `fp` must have the same length and not be empty"));
    }
    if c.opt(5).is_some() {
        return Err(
            c.problem("`period` is not supported; take x % period, and repeat the first point at the end")
        );
    }
    c.eval.budget.allocate(x.size())?;
    let last = xp.len() - 1;
    let (left, right) = (c.float_or(3, fp[0])?, c.float_or(4, fp[last])?);
    let at = |x: f64| {
        let i = xp.partition_point(|&p| p <= x);
        if i == 0 {
            left
        } else if i > last {
            if x > xp[last] { right } else { fp[last] }
        } else {
            (fp[i] - fp[i - 1]) / (xp[i] - xp[i - 1]) * (x - xp[i - 1]) + fp[i - 1]
        }
    };
    Ok(Value::array(Array::floats(x.to_floats().into_iter().map(at).collect(), x.shape().to_vec())))
}

fn vectorized(c: &Call) -> Result<Value, Raised> {
    let budget = &c.eval.budget;
    let all: Vec<Array> = c.rest.iter().map(|v| to_array(budget, v, None)).collect::<Result<_, _>>()?;
    let shape = all.iter().try_fold(Vec::new(), |s, a| broadcast_shapes(&s, a.shape()))?;
    let count = budget.allocate_shape(&shape)?;
    let columns: Vec<Vec<Scalar>> =
        all.iter().map(|a| Ok(a.broadcast(&shape)?.to_scalars())).collect::<Result<_, Fault>>()?;
    let held = c.get(0)?.items().unwrap_or_default();
    let [function] = &held[..] else { return Err(c.problem("lost its function").into()) };
    let mut results = Vec::with_capacity(count);
    for i in 0..count {
        let positional = columns.iter().map(|column| Value::Number(column[i])).collect();
        results.push(c.eval.call(function, Arguments { positional, keyword: Vec::new() })?);
    }
    let flat = to_array(budget, &Value::list(results), None)?;
    Ok(Value::array(if flat.ndim() == 1 { flat.reshape(shape) } else { flat }))
}

/// Each element by the function or number of the last condition that it meets, or by one more where it meets none.
fn piecewise(c: &Call) -> Result<Value, Raised> {
    let x = c.array(0)?;
    let masks: Vec<Array> = match c.get(1)? {
        Value::List(_) | Value::Tuple(_) => {
            let parts = c.sequence(1)?;
            let arrays = parts.iter().map(|v| to_array(&c.eval.budget, v, Some(Dtype::Bool)));
            let arrays: Vec<Array> = arrays.collect::<Result<_, _>>()?;
            // A single condition may stand without brackets.
            if arrays.iter().all(|a| a.ndim() == 0) && x.ndim() > 0 { vec![c.array(1)?] } else { arrays }
        }
        _ => vec![c.array(1)?],
    };
    let functions = c.sequence(2)?;
    let wrong = masks.iter().any(|m| m.shape() != x.shape());
    if wrong || functions.len() != masks.len() && functions.len() != masks.len() + 1 {
        return Err(c.problem("takes conditions of the shape of `x`, and a function for each").into());
    }
    c.eval.budget.allocate(x.size().saturating_mul(1 + masks.len()))?;
    let mut chosen: Vec<Option<usize>> =
        vec![(functions.len() > masks.len()).then_some(masks.len()); x.size()];
    for (at, mask) in masks.iter().enumerate() {
        chosen.iter_mut().zip(mask.to_bools()).filter(|(_, met)| *met).for_each(|(one, _)| *one = Some(at));
    }
    let (elements, mut out) = (x.to_floats(), vec![0.0; x.size()]);
    for (at, function) in functions.iter().enumerate() {
        let places: Vec<usize> = (0..out.len()).filter(|&i| chosen[i] == Some(at)).collect();
        let given = places.iter().map(|&i| elements[i]).collect();
        let made = if let Value::Number(_) = function {
            function.clone()
        } else if places.is_empty() {
            continue;
        } else {
            let given = Value::Array(Array::floats_as(given, x.dtype(), vec![places.len()]));
            c.eval.call(function, Arguments { positional: vec![given], keyword: Vec::new() })?
        };
        let made = to_array(&c.eval.budget, &made, None)?.broadcast(&[places.len()])?.to_floats();
        places.into_iter().zip(made).for_each(|(i, value)| out[i] = value);
    }
    Ok(Value::array(Array::floats_as(out, x.dtype(), x.shape().to_vec())))
}

fn apply_along_axis(c: &Call) -> Result<Value, Raised> {
    let a = c.array(2)?;
    let axis = super::args::normalize_axis(c.int(1)?, a.ndim())?;
    if a.ndim() != 2 {
        return Err(c.problem("is supported for arrays with two axes; use a loop").into());
    }
    let mut results = Vec::new();
    for i in 0..a.shape()[1 - axis] {
        let lane = Value::Array(a.select(1 - axis, i));
        results.push(c.eval.call(c.get(0)?, Arguments { positional: vec![lane], keyword: Vec::new() })?);
    }
    let made = to_array(&c.eval.budget, &Value::list(results), None)?;
    Ok(Value::Array(if axis == 0 && made.ndim() == 2 { made.permute(&[1, 0]) } else { made }))
}
