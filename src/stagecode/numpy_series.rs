//! numpy functions on series of numbers: gradients, polynomials, smoothing, statistics of several series.
//!
//! Arrays come in, arrays go out; every product is charged. Imports arguments, arrays, linear algebra, faults.

use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::args::{Call, Row, normalize_axis};
use super::array::Array;
use super::convert::to_array;
use super::error::Fault;
use super::numpy_create::spaced;
use super::numpy_decompose::{EPSILON, SWEEPS, work};
use super::numpy_reduce::{mean, sum};
use super::scalar::Dtype;
use super::value::Value;

/// The rows of this area.
pub const ROWS: &[Row] = &[
    Row::new("gradient", "f *varargs axis? edge_order?", gradient),
    Row::new("polyval", "p x", polyval),
    Row::new("polyfit", "x y deg rcond? full? w? cov?", polyfit),
    Row::new("poly1d", "c_or_r", |c| {
        let coefficients = Value::Array(c.array(0)?);
        Ok(Value::Method(Rc::new((coefficients, &POLYNOMIAL))))
    }),
    Row::new("roots", "p", roots),
    Row::new("convolve", "a v mode?", convolve),
    Row::new("cov", "m y? rowvar? bias? ddof?", |c| {
        let (made, n) = covariance(c)?;
        Ok(Value::array(squeezed(made, n)))
    }),
    Row::new("corrcoef", "x y? rowvar?", |c| {
        let (made, n) = covariance(c)?;
        let widths: Vec<f64> = (0..n).map(|i| made[i * n + i].sqrt()).collect();
        let all = (0..n * n).map(|k| (made[k] / widths[k / n] / widths[k % n]).clamp(-1.0, 1.0)).collect();
        Ok(Value::array(squeezed(all, n)))
    }),
    Row::new("histogram", "a bins? range? density? weights?", histogram),
];

/// What `np.poly1d` returns: called with numbers, it gives the polynomial's values.
static POLYNOMIAL: Row = Row::new("polynomial", "p x", polyval);

/// A function of the lanes of an array along an axis that gives lanes of the same length.
fn lanes(a: &Array, axis: usize, f: impl Fn(&[f64]) -> Vec<f64>, dtype: Dtype) -> Array {
    let mut order: Vec<usize> = (0..a.ndim()).filter(|&x| x != axis).collect();
    order.push(axis);
    let arranged = a.permute(&order);
    let all = arranged.to_floats().chunks(a.shape()[axis].max(1)).flat_map(f).collect();
    let mut back: Vec<usize> = (0..a.ndim() - 1).collect();
    back.insert(axis, a.ndim() - 1);
    Array::floats_as(all, dtype, arranged.shape().to_vec()).permute(&back).copy()
}

/// Differences of the second order inside and of the first or second at the ends, as numpy takes them.
fn gradient(c: &Call) -> Result<Value, Fault> {
    let f = c.array(0)?;
    let axes: Vec<usize> = match c.opt(2) {
        None => (0..f.ndim()).collect(),
        Some(Value::Tuple(_) | Value::List(_)) => {
            let whole = |v: &Value| v.as_int().ok_or_else(|| c.problem("axes are integers"));
            c.sequence(2)?.iter().map(|v| normalize_axis(whole(v)?, f.ndim())).collect::<Result<_, _>>()?
        }
        Some(_) => vec![normalize_axis(c.int(2)?, f.ndim())?],
    };
    let spacings: Vec<Array> =
        c.rest.iter().map(|v| to_array(&c.eval.budget, v, None)).collect::<Result<_, _>>()?;
    let single = matches!(&spacings[..], [one] if one.ndim() == 0);
    if !(spacings.is_empty() || single || spacings.len() == axes.len()) {
        return Err(c.problem("takes one spacing for all axes, or one for each"));
    }
    let edge = usize::try_from(c.int_or(3, 1)?).unwrap_or(0);
    if !(1..=2).contains(&edge) {
        return Err(c.problem("`edge_order` must be 1 or 2"));
    }
    let dtype = if f.dtype() == Dtype::F32 { Dtype::F32 } else { Dtype::F64 };
    let mut out = Vec::with_capacity(axes.len());
    for (at, &axis) in axes.iter().enumerate() {
        let n = f.shape()[axis];
        if n <= edge {
            return Err(c.problem(format!("needs more than {edge} numbers along the axis, not {n}")));
        }
        c.eval.budget.allocate(f.size().saturating_mul(2))?;
        let steps = steps(c, spacings.get(if single { 0 } else { at }), n)?;
        out.push(Value::Array(lanes(&f, axis, |lane| slopes(lane, &steps, edge), dtype)));
    }
    Ok(if out.len() == 1 { out.swap_remove(0) } else { Value::tuple(out) })
}

/// From one point to the next along an axis: one step where all are equal.
fn steps(c: &Call, spacing: Option<&Array>, n: usize) -> Result<Vec<f64>, Fault> {
    let Some(spacing) = spacing else { return Ok(vec![1.0]) };
    let at = spacing.to_floats();
    match spacing.ndim() {
        0 => Ok(at),
        1 if at.len() == n => {
            let steps: Vec<f64> = at.windows(2).map(|w| w[1] - w[0]).collect();
            Ok(if steps.iter().all(|s| *s == steps[0]) { vec![steps[0]] } else { steps })
        }
        _ => Err(c.problem(format!("takes a number as the spacing, or the {n} places along the axis"))),
    }
}

fn slopes(f: &[f64], steps: &[f64], edge: usize) -> Vec<f64> {
    let n = f.len();
    let even = steps.len() == 1;
    let step = |i: usize| if even { steps[0] } else { steps[i] };
    let inside = |i: usize| {
        let (p, q) = (step(i - 1), step(i));
        if even {
            return (f[i + 1] - f[i - 1]) / (2.0 * p);
        }
        let (a, b, c) = (-q / (p * (p + q)), (q - p) / (p * q), p / (q * (p + q)));
        a * f[i - 1] + b * f[i] + c * f[i + 1]
    };
    let first = || {
        let (p, q) = (step(0), step(1.min(steps.len() - 1)));
        let (a, b, c) = if even {
            (-1.5 / p, 2.0 / p, -0.5 / p)
        } else {
            (-(2.0 * p + q) / (p * (p + q)), (p + q) / (p * q), -p / (q * (p + q)))
        };
        a * f[0] + b * f[1] + c * f[2]
    };
    let last = || {
        let (p, q) = (step(n.saturating_sub(3)), step(n - 2));
        let (a, b, c) = if even {
            (0.5 / p, -2.0 / p, 1.5 / p)
        } else {
            (q / (p * (p + q)), -(q + p) / (p * q), (2.0 * q + p) / (q * (p + q)))
        };
        a * f[n - 3] + b * f[n - 2] + c * f[n - 1]
    };
    (0..n)
        .map(|i| match (i, edge) {
            (0, 1) => (f[1] - f[0]) / step(0),
            (0, _) => first(),
            _ if i < n - 1 => inside(i),
            (_, 1) => (f[n - 1] - f[n - 2]) / step(n - 2),
            _ => last(),
        })
        .collect()
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

/// Least squares in the powers of `x`, each scaled to length one, as numpy does it.
fn polyfit(c: &Call) -> Result<Value, Fault> {
    let (x, y) = (c.floats(0)?, c.floats(1)?);
    let terms = c.count(2)?.saturating_add(1);
    let weights = if c.opt(5).is_some() { c.floats(5)? } else { vec![1.0; x.len()] };
    if x.is_empty() || y.len() != x.len() || weights.len() != x.len() || terms > x.len().max(64) {
        return Err(
            c.problem("takes as many `y` (and weights) as `x`, in a row, and more of them than powers")
        );
    }
    work(c, x.len(), terms)?;
    let mut powers = DMatrix::from_fn(x.len(), terms, |i, j| weights[i] * x[i].powi((terms - 1 - j) as i32));
    let scale: Vec<f64> = powers.column_iter().map(|column| column.norm()).collect();
    powers.column_iter_mut().zip(&scale).for_each(|(mut column, s)| column /= *s);
    let right = DVector::from_fn(x.len(), |i, _| weights[i] * y[i]);
    let solved = super::numpy_decompose::least_squares(c, powers, &right, x.len() as f64 * EPSILON)?;
    let all = (0..terms).map(|j| solved[j] / scale[j]).collect();
    Ok(Value::Array(Array::floats(all, vec![terms])))
}

/// Real roots, the largest in size first; a polynomial with complex roots is a fault.
fn roots(c: &Call) -> Result<Value, Fault> {
    let p = c.floats(0)?;
    let (Some(first), Some(last)) = (p.iter().position(|a| *a != 0.0), p.iter().rposition(|a| *a != 0.0))
    else {
        return Ok(Value::Array(Array::floats(Vec::new(), vec![0])));
    };
    let (zeros, p) = (p.len() - 1 - last, &p[first..=last]);
    let n = p.len() - 1;
    work(c, n, n)?;
    let companion = DMatrix::from_fn(n, n, |i, j| match i {
        0 => -p[j + 1] / p[0],
        _ => f64::from(u8::from(i == j + 1)),
    });
    let mut found = if n == 0 { Vec::new() } else { eigenvalues(c, companion)? };
    found.sort_by(|a, b| b.abs().total_cmp(&a.abs()));
    found.extend(vec![0.0; zeros]);
    let n = found.len();
    Ok(Value::Array(Array::floats(found, vec![n])))
}

fn eigenvalues(c: &Call, matrix: DMatrix<f64>) -> Result<Vec<f64>, Fault> {
    let none = || c.problem("has no result for these coefficients; halve an interval in a loop");
    if matrix.iter().any(|x| !x.is_finite()) {
        return Err(none());
    }
    let schur = nalgebra::Schur::try_new(matrix, EPSILON, SWEEPS).ok_or_else(none)?;
    let all = schur.complex_eigenvalues();
    // Rounding gives roots that coincide an imaginary part of the root of the precision.
    if let Some(complex) = all.iter().find(|z| z.im.abs() > 1e-7 * z.norm()) {
        let (re, im) = (complex.re, complex.im.abs());
        return Err(Fault::unsupported(
            format!("a polynomial with complex roots such as {re:.6} + {im:.6}j"),
            "halve an interval in a loop to find the real ones",
        ));
    }
    Ok(all.iter().map(|z| z.re).collect())
}

fn convolve(c: &Call) -> Result<Value, Fault> {
    let (a, v) = (c.array(0)?, c.array(1)?);
    let (x, y) = (a.to_floats(), v.to_floats());
    let (n, m) = (x.len().max(y.len()), x.len().min(y.len()));
    if m == 0 {
        return Err(c.problem("takes series that are not empty"));
    }
    let (from, count) = match if c.opt(2).is_some() { c.text(2)? } else { "full" } {
        "full" => (0, n + m - 1),
        "same" => ((m - 1) / 2, n),
        "valid" => (m - 1, n - m + 1),
        _ => return Err(c.problem("`mode` must be 'full', 'same' or 'valid'")),
    };
    c.eval.budget.allocate(count)?;
    c.eval.budget.charge(count.saturating_mul(m))?;
    let at = |k: usize| {
        let low = (k + 1).saturating_sub(y.len());
        (low..x.len().min(k + 1)).map(|i| x[i] * y[k - i]).sum()
    };
    let all = (from..from + count).map(at).collect();
    Ok(Value::Array(Array::floats_as(all, a.dtype().promote(v.dtype()), vec![count])))
}

/// The covariances of some series, row by row, and how many series there are.
fn covariance(c: &Call) -> Result<(Vec<f64>, usize), Fault> {
    let mut series = rows(c, 0)?;
    if c.opt(1).is_some() {
        series.extend(rows(c, 1)?);
    }
    let (n, length) = (series.len(), series.first().map_or(0, Vec::len));
    if n == 0 || length == 0 || series.iter().any(|s| s.len() != length) {
        return Err(c.problem("takes series of the same length that are not empty"));
    }
    c.eval.budget.allocate_shape(&[n, n])?;
    c.eval.budget.charge(n.saturating_mul(n).saturating_mul(length))?;
    let ddof = if c.name == "cov" { c.float_or(4, if c.flag(3, false)? { 0.0 } else { 1.0 })? } else { 1.0 };
    for s in &mut series {
        let middle = mean(s);
        s.iter_mut().for_each(|x| *x -= middle);
    }
    let product = |k: usize| {
        let (x, y) = (&series[k / n], &series[k % n]);
        sum(&x.iter().zip(y).map(|(x, y)| x * y).collect::<Vec<_>>()) / (length as f64 - ddof).max(0.0)
    };
    Ok(((0..n * n).map(product).collect(), n))
}

/// The series of an argument: its rows, or its columns where `rowvar` is false.
fn rows(c: &Call, at: usize) -> Result<Vec<Vec<f64>>, Fault> {
    let a = c.array(at)?;
    c.eval.budget.allocate(a.size())?;
    match *a.shape() {
        [_] => Ok(vec![a.to_floats()]),
        [_, _] => {
            let a = if c.flag(2, true)? { a } else { a.permute(&[1, 0]) };
            Ok(a.to_floats().chunks(a.shape()[1].max(1)).map(<[f64]>::to_vec).collect())
        }
        _ => Err(c.problem("takes series in a row, or as the rows of a matrix")),
    }
}

/// A square matrix, or the number in it.
fn squeezed(all: Vec<f64>, n: usize) -> Array {
    Array::floats(all, if n == 1 { Vec::new() } else { vec![n, n] })
}

fn histogram(c: &Call) -> Result<Value, Fault> {
    let x = c.floats(0)?;
    c.eval.budget.allocate(x.len())?;
    let weights = if c.opt(4).is_some() { Some(c.floats(4)?) } else { None };
    if weights.as_ref().is_some_and(|w| w.len() != x.len()) {
        return Err(c.problem("takes one weight for each number"));
    }
    let even = c.opt(1).is_none_or(|bins| matches!(bins, Value::Number(_)));
    let edges = if even { even_edges(c, &x)? } else { c.floats(1)? };
    if edges.len() < 2 || edges.windows(2).any(|w| w[0] > w[1]) {
        return Err(c.problem("needs bins whose edges rise"));
    }
    let bins = edges.len() - 1;
    let mut counts = vec![0.0; bins];
    for (at, &value) in x.iter().enumerate() {
        // The last bin holds its right edge too.
        if value >= edges[0] && value <= edges[bins] {
            let bin = edges.partition_point(|&e| e <= value).clamp(1, bins) - 1;
            counts[bin] += weights.as_ref().map_or(1.0, |w| w[at]);
        }
    }
    let density = c.flag(3, false)?;
    if density {
        let total = sum(&counts);
        counts.iter_mut().zip(edges.windows(2)).for_each(|(n, w)| *n = *n / (w[1] - w[0]) / total);
    }
    let dtype = if density || weights.is_some() { Dtype::F64 } else { Dtype::Int };
    let counts = Array::floats_as(counts, dtype, vec![bins]);
    Ok(Value::tuple(vec![Value::Array(counts), Value::Array(Array::floats(edges, vec![bins + 1]))]))
}

/// Edges of bins of one width, over the range given or that of the numbers.
fn even_edges(c: &Call, x: &[f64]) -> Result<Vec<f64>, Fault> {
    let bins = if c.opt(1).is_some() { c.count(1)? } else { 10 };
    c.eval.budget.allocate(bins.saturating_add(1))?;
    let (mut low, mut high) = match (c.opt(2), x.is_empty()) {
        (Some(_), _) => match c.floats(2)?[..] {
            [low, high] => (low, high),
            _ => return Err(c.problem("`range` must be two numbers")),
        },
        (None, true) => (0.0, 1.0),
        (None, false) => x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x))),
    };
    if bins == 0 || !low.is_finite() || !high.is_finite() || low > high {
        return Err(c.problem("needs at least one bin and a finite range that rises"));
    }
    if low == high {
        (low, high) = (low - 0.5, high + 0.5);
    }
    Ok(spaced(low, high, bins + 1, true))
}
