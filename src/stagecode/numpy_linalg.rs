//! Products of vectors and matrices, and `np.linalg`.
//!
//! Arrays come in, their products, norms, inverses go out; a product is charged for every multiplication.
//! Imports arguments, arrays, limits, faults.

use super::args::{Call, Row, normalize_axis};
use super::array::{Array, broadcast_shapes, show};
use super::convert::to_array;
use super::elementwise::{Op, binary_values};
use super::error::Fault;
use super::limits::Budget;
use super::numpy_reduce::sum;
use super::value::Value;

/// The rows of `np`.
pub const ROWS: &[Row] = &[
    Row::new("dot", "a b", dot),
    Row::new("matmul", "a b", |c| matmul(&c.eval.budget, c.get(0)?, c.get(1)?)),
    Row::new("inner", "a b", inner),
    Row::new("vdot", "a b", flat_dot),
    Row::new("outer", "a b", outer),
    Row::new("cross", "a b axis?", cross),
    Row::new("trace", "a", trace),
    Row::new("kron", "a b", kron),
    Row::new("einsum", "subscripts *operands", super::einsum::einsum),
];

/// The rows of `np.linalg`.
pub const LINALG: &[Row] = &[
    Row::new("norm", "x ord? axis? keepdims?", norm),
    Row::new("det", "a", |c| Ok(Value::float64(eliminate(c, matrix(c, 0)?.0, Vec::new())?.0))),
    Row::new("inv", "a", inverse),
    Row::new("solve", "a b", solve),
    Row::new("matmul", "a b", |c| matmul(&c.eval.budget, c.get(0)?, c.get(1)?)),
    Row::new("cross", "a b axis?", cross),
];

/// `a @ b`: vectors, matrices, and stacks of them.
pub fn matmul(budget: &Budget, a: &Value, b: &Value) -> Result<Value, Fault> {
    let (a, b) = (to_array(budget, a, None)?, to_array(budget, b, None)?);
    if a.ndim() == 0 || b.ndim() == 0 {
        return Err(Fault::value("@ takes vectors and matrices; use * for numbers"));
    }
    let (row, column) = (a.ndim() == 1, b.ndim() == 1);
    let (a, b) = (if row { a.insert_axis(0) } else { a }, if column { b.insert_axis(1) } else { b });
    let ([stack_a @ .., n, k], [stack_b @ .., k2, m]) = (a.shape(), b.shape()) else {
        return Err(Fault::value("@ takes vectors and matrices"));
    };
    if k != k2 {
        let (a, b) = (show(a.shape()), show(b.shape()));
        return Err(Fault::value(format!("matrices of shapes {a} and {b} cannot be multiplied")));
    }
    let stack = broadcast_shapes(stack_a, stack_b)?;
    let count = budget.allocate_shape(&[&stack[..], &[*n, *m]].concat())?;
    budget.charge(count.saturating_mul(*k))?;
    budget.allocate_shape(&[&stack[..], &[*n, *k]].concat())?;
    budget.allocate_shape(&[&stack[..], &[*k, *m]].concat())?;
    let x = a.broadcast(&[&stack[..], &[*n, *k]].concat())?.to_floats();
    let y = b.broadcast(&[&stack[..], &[*k, *m]].concat())?.to_floats();
    let mut out = Vec::with_capacity(count);
    for s in 0..stack.iter().product() {
        for i in 0..*n {
            for j in 0..*m {
                out.push((0..*k).map(|l| x[(s * n + i) * k + l] * y[(s * k + l) * m + j]).sum());
            }
        }
    }
    let mut made = Array::floats_as(out, a.dtype().promote(b.dtype()), [&stack[..], &[*n, *m]].concat());
    if column {
        made = made.remove_axis(made.ndim() - 1);
    }
    if row {
        made = made.remove_axis(made.ndim() - usize::from(!column) - 1);
    }
    Ok(Value::array(made))
}

fn dot(c: &Call) -> Result<Value, Fault> {
    let (a, b) = (c.array(0)?, c.array(1)?);
    if a.ndim() == 0 || b.ndim() == 0 {
        return binary_values(&c.eval.budget, Op::Multiply, c.get(0)?, c.get(1)?);
    }
    if b.ndim() > 2 {
        return Err(c.problem("is supported for vectors and matrices; use np.einsum or @"));
    }
    matmul(&c.eval.budget, c.get(0)?, c.get(1)?)
}

fn inner(c: &Call) -> Result<Value, Fault> {
    let (a, b) = (c.array(0)?, c.array(1)?);
    if a.ndim() > 2 || b.ndim() > 2 {
        return Err(c.problem("is supported for vectors and matrices; use np.einsum"));
    }
    // Sums over the last axis of both.
    let turned: Vec<usize> = (0..b.ndim()).rev().collect();
    if a.ndim() == 0 || b.ndim() == 0 {
        return dot(c);
    }
    matmul(&c.eval.budget, &Value::Array(a), &Value::Array(b.permute(&turned)))
}

fn flat_dot(c: &Call) -> Result<Value, Fault> {
    let (a, b) = (c.floats(0)?, c.floats(1)?);
    if a.len() != b.len() {
        return Err(c.problem("both must have the same number of elements"));
    }
    c.eval.budget.charge(a.len())?;
    Ok(Value::float64(a.iter().zip(&b).map(|(x, y)| x * y).sum()))
}

fn outer(c: &Call) -> Result<Value, Fault> {
    let (a, b) = (c.array(0)?, c.array(1)?);
    let (a, b) = (a.reshape(vec![a.size(), 1]), b.reshape(vec![1, b.size()]));
    binary_values(&c.eval.budget, Op::Multiply, &Value::Array(a), &Value::Array(b))
}

fn cross(c: &Call) -> Result<Value, Fault> {
    let (mut a, mut b) = (c.array(0)?, c.array(1)?);
    if a.ndim() == 0 || b.ndim() == 0 {
        return Err(c.problem("takes vectors of two or three numbers"));
    }
    // The vectors go along the last axis of both.
    for side in [&mut a, &mut b] {
        let axis = normalize_axis(c.int_or(2, -1)?, side.ndim())?;
        let order: Vec<usize> = (0..side.ndim()).filter(|&x| x != axis).chain([axis]).collect();
        *side = side.permute(&order);
    }
    let lengths = (a.shape()[a.ndim() - 1], b.shape()[b.ndim() - 1]);
    if !matches!(lengths, (2 | 3, 2 | 3)) {
        return Err(c.problem("takes vectors of two or three numbers"));
    }
    let stack = broadcast_shapes(&a.shape()[..a.ndim() - 1], &b.shape()[..b.ndim() - 1])?;
    let shape = [&stack[..], &[3]].concat();
    c.eval.budget.allocate_shape(&shape)?;
    let side = |a: &Array, n: usize| -> Result<Vec<f64>, Fault> {
        Ok(a.broadcast(&[&stack[..], &[n]].concat())?.to_floats())
    };
    let (x, y) = (side(&a, lengths.0)?, side(&b, lengths.1)?);
    let dtype = a.dtype().promote(b.dtype());
    let pairs = x.chunks_exact(lengths.0).zip(y.chunks_exact(lengths.1));
    if lengths == (2, 2) {
        let all = pairs.map(|(u, v)| u[0] * v[1] - u[1] * v[0]).collect();
        return Ok(Value::array(Array::floats_as(all, dtype, stack)));
    }
    let third = |u: &[f64]| u.get(2).copied().unwrap_or(0.0);
    let product = |(u, v): (&[f64], &[f64])| {
        let (w, z) = (third(u), third(v));
        [u[1] * z - w * v[1], w * v[0] - u[0] * z, u[0] * v[1] - u[1] * v[0]]
    };
    let made = Array::floats_as(pairs.flat_map(product).collect(), dtype, shape);
    let axis = normalize_axis(c.int_or(2, -1)?, made.ndim())?;
    let mut back: Vec<usize> = (0..made.ndim() - 1).collect();
    back.insert(axis, made.ndim() - 1);
    Ok(Value::Array(made.permute(&back)))
}

fn trace(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    let [rows, columns] = *a.shape() else { return Err(c.problem("takes a matrix")) };
    c.eval.budget.charge(a.size())?;
    let all = a.to_floats();
    let diagonal = (0..rows.min(columns)).map(|i| all[i * columns + i]).sum();
    Ok(Value::array(Array::floats_as(vec![diagonal], a.dtype(), Vec::new())))
}

/// Every element of one matrix times the whole of the other.
fn kron(c: &Call) -> Result<Value, Fault> {
    let (a, b) = (c.array(0)?, c.array(1)?);
    let ([n, m], [p, q]) = (a.shape(), b.shape()) else { return Err(c.problem("takes two matrices")) };
    let shape = vec![n.saturating_mul(*p), m.saturating_mul(*q)];
    c.eval.budget.allocate_shape(&shape)?;
    let (x, y) = (a.reshape(vec![*n, 1, *m, 1]), b.reshape(vec![1, *p, 1, *q]));
    let made = binary_values(&c.eval.budget, Op::Multiply, &Value::Array(x), &Value::Array(y))?;
    Ok(Value::array(to_array(&c.eval.budget, &made, None)?.reshape(shape)))
}

fn norm(c: &Call) -> Result<Value, Fault> {
    let a = c.array(0)?;
    c.eval.budget.allocate_shape(a.shape())?;
    let kind = match c.opt(1) {
        None => 2.0,
        Some(Value::Str(s)) if &**s == "fro" => 2.0,
        Some(_) => c.float(1)?,
    };
    let axis = c.axis(2, a.ndim())?;
    if c.opt(1).is_some_and(|v| !matches!(v, Value::Str(_))) && axis.is_none() && a.ndim() > 1 {
        return Err(c.problem("`ord` of a matrix is not supported; give an axis"));
    }
    let length = |lane: &[f64]| -> f64 {
        if kind == 2.0 {
            sum(&lane.iter().map(|x| x * x).collect::<Vec<_>>()).sqrt()
        } else if kind == 1.0 {
            sum(&lane.iter().map(|x| x.abs()).collect::<Vec<_>>())
        } else if kind == f64::INFINITY {
            lane.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
        } else {
            lane.iter().map(|x| x.abs().powf(kind)).sum::<f64>().powf(1.0 / kind)
        }
    };
    let keep = c.flag(3, false)?;
    let Some(axis) = axis else {
        let shape = if keep { vec![1; a.ndim()] } else { Vec::new() };
        return Ok(Value::array(Array::floats(vec![length(&a.to_floats())], shape)));
    };
    let mut order: Vec<usize> = (0..a.ndim()).filter(|&x| x != axis).collect();
    let mut shape: Vec<usize> = order.iter().map(|&x| a.shape()[x]).collect();
    order.push(axis);
    let n = a.shape()[axis];
    let elements = a.permute(&order).to_floats();
    let lanes = shape.iter().product();
    let all = (0..lanes).map(|i: usize| length(&elements[i * n..(i + 1) * n])).collect();
    if keep {
        shape.insert(axis, 1);
    }
    Ok(Value::array(Array::floats(all, shape)))
}

/// A square matrix as rows, and its side.
fn matrix(c: &Call, at: usize) -> Result<(Vec<Vec<f64>>, usize), Fault> {
    let a = c.array(at)?;
    let &[n, m] = a.shape() else { return Err(c.problem("takes a square matrix")) };
    if n != m || n == 0 {
        return Err(c.problem("takes a square matrix"));
    }
    c.eval.budget.charge(n.saturating_mul(n).saturating_mul(n))?;
    Ok((a.to_floats().chunks(n).map(<[f64]>::to_vec).collect(), n))
}

/// Gauss's elimination with row exchanges: the determinant, and the solution for each right-hand side.
fn eliminate(c: &Call, mut a: Vec<Vec<f64>>, mut b: Vec<Vec<f64>>) -> Result<(f64, Vec<Vec<f64>>), Fault> {
    let n = a.len();
    let mut determinant = 1.0;
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap_or(k);
        if a[pivot][k] == 0.0 {
            let singular = || Fault::Singular(format!("{}(): the matrix is singular", c.name));
            return if b.is_empty() { Ok((0.0, b)) } else { Err(singular()) };
        }
        determinant *= if pivot == k { a[k][k] } else { -a[pivot][k] };
        a.swap(k, pivot);
        b.iter_mut().for_each(|side| side.swap(k, pivot));
        let top = a[k].clone();
        for i in k + 1..n {
            let factor = a[i][k] / top[k];
            a[i].iter_mut().zip(&top).skip(k).for_each(|(x, t)| *x -= factor * t);
            b.iter_mut().for_each(|side| side[i] -= factor * side[k]);
        }
    }
    for side in &mut b {
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|j| a[i][j] * side[j]).sum();
            side[i] = (side[i] - known) / a[i][i];
        }
    }
    Ok((determinant, b))
}

fn inverse(c: &Call) -> Result<Value, Fault> {
    let (a, n) = matrix(c, 0)?;
    let unit = |i: usize| (0..n).map(|j| f64::from(u8::from(i == j))).collect();
    let columns = eliminate(c, a, (0..n).map(unit).collect())?.1.concat();
    Ok(Value::Array(Array::floats(columns, vec![n, n]).permute(&[1, 0]).copy()))
}

fn solve(c: &Call) -> Result<Value, Fault> {
    let (a, n) = matrix(c, 0)?;
    let b = c.array(1)?;
    if b.ndim() == 0 || b.ndim() > 2 || b.shape()[0] != n {
        return Err(c.problem("the right-hand side must have as many rows as the matrix"));
    }
    let sides = b.size() / n;
    c.eval.budget.charge(n.saturating_mul(n).saturating_mul(sides))?;
    let columns = if b.ndim() == 1 { b.insert_axis(0) } else { b.permute(&[1, 0]) };
    let right = columns.to_floats().chunks(n).map(<[f64]>::to_vec).collect();
    let solved = Array::floats(eliminate(c, a, right)?.1.concat(), vec![sides, n]).permute(&[1, 0]);
    Ok(Value::Array(if b.ndim() == 1 { solved.remove_axis(1) } else { solved }))
}
