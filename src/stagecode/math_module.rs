//! The `math` module: functions of single numbers.
//!
//! Numbers come in, numbers go out; where Python raises an error for a number outside the domain, so do
//! these. Imports arguments, faults, values.

use super::args::{Call, Row};
use super::error::Fault;
use super::operators;
use super::scalar::Scalar;
use super::value::Value;

/// The rows of the module.
pub const ROWS: &[Row] = &[
    Row::new("sqrt", "x", |c| float(c, f64::sqrt)),
    Row::new("cbrt", "x", |c| float(c, f64::cbrt)),
    Row::new("sin", "x", |c| float(c, f64::sin)),
    Row::new("cos", "x", |c| float(c, f64::cos)),
    Row::new("tan", "x", |c| float(c, f64::tan)),
    Row::new("asin", "x", |c| float(c, f64::asin)),
    Row::new("acos", "x", |c| float(c, f64::acos)),
    Row::new("atan", "x", |c| float(c, f64::atan)),
    Row::new("sinh", "x", |c| float(c, f64::sinh)),
    Row::new("cosh", "x", |c| float(c, f64::cosh)),
    Row::new("tanh", "x", |c| float(c, f64::tanh)),
    Row::new("exp", "x", |c| float(c, f64::exp)),
    Row::new("log", "x base?", log),
    Row::new("log2", "x", |c| float(c, f64::log2)),
    Row::new("log10", "x", |c| float(c, f64::log10)),
    Row::new("log1p", "x", |c| float(c, f64::ln_1p)),
    Row::new("fabs", "x", |c| float(c, f64::abs)),
    Row::new("radians", "x", |c| float(c, |x| x * (std::f64::consts::PI / 180.0))),
    Row::new("degrees", "x", |c| float(c, |x| x * (180.0 / std::f64::consts::PI))),
    Row::new("atan2", "y x", |c| Ok(Value::float(c.float(0)?.atan2(c.float(1)?)))),
    Row::new("pow", "x y", |c| Ok(Value::float(c.float(0)?.powf(c.float(1)?)))),
    Row::new("fmod", "x y", |c| Ok(Value::float(c.float(0)? % c.float(1)?))),
    Row::new("copysign", "x y", |c| Ok(Value::float(c.float(0)?.copysign(c.float(1)?)))),
    Row::new("hypot", "x y? *more", |c| {
        let more = c.rest.iter().filter_map(Value::as_scalar).map(Scalar::float);
        Ok(Value::float(more.fold(c.float(0)?.hypot(c.float_or(1, 0.0)?), f64::hypot)))
    }),
    Row::new("expm1", "x", |c| float(c, f64::exp_m1)),
    Row::new("modf", "x", |c| {
        let x = c.float(0)?;
        Ok(Value::tuple(vec![Value::float(x.fract()), Value::float(x.trunc())]))
    }),
    Row::new("dist", "p q", dist),
    Row::new("floor", "x", |c| whole(c, f64::floor)),
    Row::new("ceil", "x", |c| whole(c, f64::ceil)),
    Row::new("trunc", "x", |c| whole(c, f64::trunc)),
    Row::new("isqrt", "n", |c| Ok(Value::int(c.count(0)?.isqrt() as i64))),
    Row::new("asinh", "x", |c| float(c, f64::asinh)),
    Row::new("acosh", "x", |c| float(c, f64::acosh)),
    Row::new("atanh", "x", |c| float(c, f64::atanh)),
    Row::new("exp2", "x", |c| float(c, f64::exp2)),
    Row::new("gcd", "a b", |c| Ok(Value::int(gcd(c.int(0)?, c.int(1)?)))),
    Row::new("factorial", "n", factorial),
    Row::new("comb", "n k", comb),
    Row::new("prod", "iterable start?", |c| {
        let mut product = c.opt(1).cloned().unwrap_or(Value::int(1));
        for item in c.sequence(0)? {
            product = operators::binary(&c.eval.budget, ruff_python_ast::Operator::Mult, &product, &item)?;
        }
        Ok(product)
    }),
    Row::new("fsum", "seq", |c| {
        Ok(Value::float(c.sequence(0)?.iter().filter_map(Value::as_scalar).map(Scalar::float).sum()))
    }),
    Row::new("isnan", "x", |c| Ok(Value::bool(c.float(0)?.is_nan()))),
    Row::new("isfinite", "x", |c| Ok(Value::bool(c.float(0)?.is_finite()))),
    Row::new("isinf", "x", |c| Ok(Value::bool(c.float(0)?.is_infinite()))),
    Row::new("isclose", "a b rel_tol? abs_tol?", isclose),
];

/// A float function; a result that is not a number from one that is means "outside the domain".
fn float(c: &Call, f: fn(f64) -> f64) -> Result<Value, Fault> {
    let x = c.float(0)?;
    let y = f(x);
    if y.is_nan() && !x.is_nan() || y == f64::NEG_INFINITY && x.is_finite() {
        return Err(Fault::value(format!("math.{}({x}) is not defined", c.name)));
    }
    Ok(Value::float(y))
}

fn log(c: &Call) -> Result<Value, Fault> {
    let base = c.float_or(1, std::f64::consts::E)?;
    let x = c.float(0)?;
    if x <= 0.0 || base <= 0.0 || base == 1.0 {
        return Err(Fault::value(format!("math.log({x}) is not defined")));
    }
    Ok(Value::float(if c.opt(1).is_some() { x.ln() / base.ln() } else { x.ln() }))
}

/// A float function whose result becomes an integer.
pub fn whole(c: &Call, f: fn(f64) -> f64) -> Result<Value, Fault> {
    match c.scalar(0)? {
        Scalar::Float(x) if x.is_finite() && x.abs() < 9e18 => Ok(Value::int(f(x) as i64)),
        Scalar::Float(x) => Err(Fault::value(format!("{x} cannot become an integer"))),
        n => Ok(Value::int(n.int())),
    }
}

fn dist(c: &Call) -> Result<Value, Fault> {
    let (p, q) = (c.floats(0)?, c.floats(1)?);
    if p.len() != q.len() {
        return Err(c.problem("both points must have the same number of coordinates"));
    }
    Ok(Value::float(p.iter().zip(&q).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()))
}

fn gcd(a: i64, b: i64) -> i64 {
    let (mut a, mut b) = (a.unsigned_abs(), b.unsigned_abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    i64::try_from(a).unwrap_or(i64::MAX)
}

fn factorial(c: &Call) -> Result<Value, Fault> {
    let n = c.count(0)?;
    if n > 20 {
        return Err(Fault::unsupported("an integer beyond 64 bits", "use math.factorial up to 20"));
    }
    Ok(Value::int((1..=n as i64).product()))
}

/// Ways to choose `k` of `n`: a product that stays whole after each factor.
fn comb(c: &Call) -> Result<Value, Fault> {
    let (n, k) = (c.count(0)?, c.count(1)?);
    let beyond = || Fault::unsupported("an integer beyond 64 bits", "use a smaller n");
    let k = k.min(n.checked_sub(k).unwrap_or(usize::MAX));
    if k == usize::MAX || k > n {
        return Ok(Value::int(0));
    }
    c.eval.budget.charge(k)?;
    let mut ways: i128 = 1;
    for i in 0..k {
        ways = ways.checked_mul((n - i) as i128).ok_or_else(beyond)? / (i as i128 + 1);
    }
    i64::try_from(ways).map(Value::int).map_err(|_| beyond())
}

fn isclose(c: &Call) -> Result<Value, Fault> {
    let (a, b) = (c.float(0)?, c.float(1)?);
    let (relative, absolute) = (c.float_or(2, 1e-9)?, c.float_or(3, 0.0)?);
    Ok(Value::bool(a == b || (a - b).abs() <= (relative * a.abs().max(b.abs())).max(absolute)))
}
