//! Methods of the functions of two operands: `np.add.outer`, `np.maximum.reduce`, `np.add.accumulate`.
//!
//! Each row takes the function first. Imports arguments, arrays, faults.

use super::args::{Call, Row, Run};
use super::array::Array;
use super::convert::{check_dimensions, to_array};
use super::elementwise::{Op, binary_values};
use super::error::Fault;
use super::numpy_place::first_axis;
use super::value::Value;

/// The methods.
pub const ROWS: &[Row] = &[
    Row::new("outer", "self A B", outer),
    Row::new("reduce", "self array axis?", |c| {
        folded(c)?.pop().ok_or_else(|| c.problem("needs at least one element"))
    }),
    Row::new("accumulate", "self array axis?", |c| {
        let all = folded(c)?;
        to_array(&c.eval.budget, &Value::list(all), None).map(Value::array)
    }),
];

/// The operation that the first argument stands for.
fn operation(c: &Call) -> Result<Op, Fault> {
    match c.get(0)? {
        Value::Builtin(Row { run: Run::Binary(op), .. }) => Ok(*op),
        _ => Err(c.problem("belongs to functions of two arrays, such as np.add")),
    }
}

fn outer(c: &Call) -> Result<Value, Fault> {
    let (a, b) = (c.array(1)?, c.array(2)?);
    let shape = check_dimensions([a.shape(), &vec![1; b.ndim()][..]].concat())?;
    c.eval.budget.allocate(a.size())?;
    let stretched: Array = a.reshape(shape);
    binary_values(&c.eval.budget, operation(c)?, &Value::Array(stretched), &Value::Array(b))
}

/// The running results along the first axis.
fn folded(c: &Call) -> Result<Vec<Value>, Fault> {
    let op = operation(c)?;
    first_axis(c, 2, c.array(1)?.ndim())?;
    let mut all: Vec<Value> = Vec::new();
    for row in c.sequence(1)? {
        let next = match all.last() {
            Some(so_far) => binary_values(&c.eval.budget, op, so_far, &row)?,
            None => row,
        };
        all.push(next);
    }
    Ok(all)
}
