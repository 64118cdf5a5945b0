//! Operations element by element: promotion of types, stretching of shapes, and the arithmetic itself.
//!
//! Two operands and an [`Op`] come in, a new array (or a number, where neither has dimensions) goes out.
//! Integer arithmetic wraps and division by zero gives infinities, as in numpy; Python's own numbers are
//! treated in `operators`. Imports arrays, values, limits, faults.

use super::array::{Array, broadcast_shapes};
use super::convert::to_array;
use super::error::Fault;
use super::limits::Budget;
use super::scalar::{Dtype, Scalar};
use super::value::Value;

/// What to do with each pair of elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // The names are numpy's.
pub enum Op {
    Add,
    Subtract,
    Multiply,
    Divide,
    FloorDivide,
    Remainder,
    Power,
    Maximum,
    Minimum,
    Fmod,
    Arctan2,
    Hypot,
    Copysign,
    BitAnd,
    BitOr,
    BitXor,
    ShiftLeft,
    ShiftRight,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    LogicalAnd,
    LogicalOr,
    LogicalXor,
}

/// One side of an operation. A Python number is weak: it takes the type of the array it meets.
pub struct Operand {
    array: Array,
    weak: bool,
}

impl Operand {
    /// The operand that a value is.
    pub fn of(budget: &Budget, value: &Value) -> Result<Self, Fault> {
        Ok(Self { array: to_array(budget, value, None)?, weak: matches!(value, Value::Number(_)) })
    }
}

/// Applies `f` to every element, as a float.
pub fn unary(budget: &Budget, f: fn(f64) -> f64, array: &Array) -> Result<Value, Fault> {
    budget.allocate(array.size())?;
    let dtype = if array.dtype() == Dtype::F32 { Dtype::F32 } else { Dtype::F64 };
    let values = array.to_floats().into_iter().map(f).collect();
    Ok(Value::array(Array::floats_as(values, dtype, array.shape().to_vec())))
}

/// Applies `op` to two values that are numbers, arrays, or nested lists of numbers.
pub fn binary_values(budget: &Budget, op: Op, a: &Value, b: &Value) -> Result<Value, Fault> {
    let (a, b) = (Operand::of(budget, a)?, Operand::of(budget, b)?);
    binary(budget, op, &a, &b).map(Value::array)
}

/// Applies `op` to two operands.
pub fn binary(budget: &Budget, op: Op, a: &Operand, b: &Operand) -> Result<Array, Fault> {
    let shape = broadcast_shapes(a.array.shape(), b.array.shape())?;
    let pair = Pair { a: &a.array, b: &b.array, count: budget.allocate_shape(&shape)?, shape };
    let dtype = promoted(a, b);
    if let Some(test) = comparison(op) {
        return pair.compare(test, dtype);
    }
    match op {
        Op::LogicalAnd => pair.bools(|x, y| x && y),
        Op::LogicalOr => pair.bools(|x, y| x || y),
        Op::LogicalXor => pair.bools(|x, y| x != y),
        Op::BitAnd | Op::BitOr | Op::BitXor | Op::ShiftLeft | Op::ShiftRight => pair.bits(op, dtype),
        Op::Divide | Op::Arctan2 | Op::Hypot | Op::Copysign => {
            pair.floats(float_function(op), if dtype == Dtype::F32 { dtype } else { Dtype::F64 })
        }
        _ if dtype.is_float() => pair.floats(float_function(op), dtype),
        Op::Add | Op::Maximum if dtype == Dtype::Bool => pair.bools(|x, y| x || y),
        Op::Multiply | Op::Minimum if dtype == Dtype::Bool => pair.bools(|x, y| x && y),
        Op::Subtract if dtype == Dtype::Bool => {
            Err(Fault::kind("truth values cannot be subtracted; use ^ or np.logical_xor"))
        }
        _ => pair.ints(op),
    }
}

/// Applies the operation of an operator to two numbers of which numpy made one.
pub fn numbers(op: Op, x: Scalar, y: Scalar) -> Result<Scalar, Fault> {
    let floats = x.dtype().is_float() || y.dtype().is_float();
    match op {
        Op::BitAnd | Op::BitOr | Op::BitXor | Op::ShiftLeft | Op::ShiftRight if floats => {
            Err(Fault::kind(NO_BITS))
        }
        _ if floats || op == Op::Divide => Ok(Scalar::Float64(float_function(op)(x.float(), y.float()))),
        Op::Power if y.int() < 0 => Err(Fault::value(NEGATIVE_POWER)),
        _ => Ok(Scalar::Int64(int_function(op)(x.int(), y.int()))),
    }
}

const NEGATIVE_POWER: &str = "integers to negative integer powers are not allowed; use a float";
const NO_BITS: &str =
    "&, |, ^ and shifts take truth values or integers, not floats: put comparisons in parentheses";

/// The type of the result of arithmetic on two operands.
fn promoted(a: &Operand, b: &Operand) -> Dtype {
    let weak = |strong: Dtype, weak: Dtype| match (strong, weak) {
        (Dtype::F32, Dtype::F64 | Dtype::Int) => Dtype::F32,
        (s, w) => s.promote(w),
    };
    match (a.weak, b.weak) {
        (true, false) => weak(b.array.dtype(), a.array.dtype()),
        (false, true) => weak(a.array.dtype(), b.array.dtype()),
        _ => a.array.dtype().promote(b.array.dtype()),
    }
}

/// What an ordering of two elements must be; `None` if `op` does not compare.
fn comparison(op: Op) -> Option<fn(Option<std::cmp::Ordering>) -> bool> {
    Some(match op {
        Op::Equal => |o| o.is_some_and(std::cmp::Ordering::is_eq),
        Op::NotEqual => |o| !o.is_some_and(std::cmp::Ordering::is_eq),
        Op::Less => |o| o.is_some_and(std::cmp::Ordering::is_lt),
        Op::LessEqual => |o| o.is_some_and(std::cmp::Ordering::is_le),
        Op::Greater => |o| o.is_some_and(std::cmp::Ordering::is_gt),
        Op::GreaterEqual => |o| o.is_some_and(std::cmp::Ordering::is_ge),
        _ => return None,
    })
}

/// Two arrays about to be combined, and the shape of the result.
struct Pair<'a> {
    a: &'a Array,
    b: &'a Array,
    shape: Vec<usize>,
    count: usize,
}

impl Pair<'_> {
    /// Combines the elements read by `read`; an operand of one element is not stretched in memory.
    fn zip<T: Copy, R>(&self, read: fn(&Array) -> Vec<T>, f: impl Fn(T, T) -> R) -> Result<Vec<R>, Fault> {
        let side = |array: &Array| -> Result<Vec<T>, Fault> {
            if array.size() == 1 { Ok(read(array)) } else { Ok(read(&array.broadcast(&self.shape)?)) }
        };
        let (a, b) = (side(self.a)?, side(self.b)?);
        let (last_a, last_b) = (a.len().saturating_sub(1), b.len().saturating_sub(1));
        Ok((0..self.count).map(|i| f(a[i.min(last_a)], b[i.min(last_b)])).collect())
    }

    fn bools(&self, f: impl Fn(bool, bool) -> bool) -> Result<Array, Fault> {
        Ok(Array::bools(self.zip(Array::to_bools, f)?, self.shape.clone()))
    }

    fn floats(&self, f: fn(f64, f64) -> f64, dtype: Dtype) -> Result<Array, Fault> {
        Ok(Array::floats_as(self.zip(Array::to_floats, f)?, dtype, self.shape.clone()))
    }

    fn compare(&self, test: fn(Option<std::cmp::Ordering>) -> bool, dtype: Dtype) -> Result<Array, Fault> {
        let values = if dtype.is_float() {
            self.zip(Array::to_floats, |x, y| test(x.partial_cmp(&y)))?
        } else {
            self.zip(Array::to_ints, |x, y| test(Some(x.cmp(&y))))?
        };
        Ok(Array::bools(values, self.shape.clone()))
    }

    fn bits(&self, op: Op, dtype: Dtype) -> Result<Array, Fault> {
        match (dtype, op) {
            (Dtype::Bool, Op::BitAnd) => self.bools(|x, y| x && y),
            (Dtype::Bool, Op::BitOr) => self.bools(|x, y| x || y),
            (Dtype::Bool, Op::BitXor) => self.bools(|x, y| x != y),
            (Dtype::Bool | Dtype::Int, _) => self.ints(op),
            _ => Err(Fault::kind(NO_BITS)),
        }
    }

    fn ints(&self, op: Op) -> Result<Array, Fault> {
        if op == Op::Power && self.b.to_ints().iter().any(|&e| e < 0) {
            return Err(Fault::value(NEGATIVE_POWER));
        }
        let f = int_function(op);
        Ok(Array::ints(self.zip(Array::to_ints, f)?, self.shape.clone()))
    }
}

fn float_function(op: Op) -> fn(f64, f64) -> f64 {
    match op {
        Op::Add => |x, y| x + y,
        Op::Subtract => |x, y| x - y,
        Op::Multiply => |x, y| x * y,
        Op::Divide => |x, y| x / y,
        Op::FloorDivide => floor_divide,
        Op::Remainder => remainder,
        Op::Power => power,
        // Both pass on NaN, as np.maximum and np.minimum do.
        Op::Maximum => |x, y| if x >= y || x.is_nan() { x } else { y },
        Op::Minimum => |x, y| if x <= y || x.is_nan() { x } else { y },
        Op::Fmod => |x, y| x % y,
        Op::Arctan2 => f64::atan2,
        Op::Hypot => f64::hypot,
        Op::Copysign => f64::copysign,
        _ => |_, _| f64::NAN,
    }
}

fn int_function(op: Op) -> fn(i64, i64) -> i64 {
    match op {
        Op::Add => i64::wrapping_add,
        Op::Subtract => i64::wrapping_sub,
        Op::Multiply => i64::wrapping_mul,
        // numpy gives 0 where the divisor is 0.
        Op::FloorDivide => |x, y| if y == 0 { 0 } else { int_floor_divide(x, y) },
        Op::Remainder => {
            |x, y| if y == 0 { 0 } else { x.wrapping_sub(int_floor_divide(x, y).wrapping_mul(y)) }
        }
        Op::Fmod => |x, y| if y == 0 { 0 } else { x.wrapping_rem(y) },
        Op::Power => |x, y| x.wrapping_pow(u32::try_from(y).unwrap_or(u32::MAX)),
        Op::Maximum => i64::max,
        Op::Minimum => i64::min,
        Op::BitAnd => |x, y| x & y,
        Op::BitOr => |x, y| x | y,
        Op::BitXor => |x, y| x ^ y,
        Op::ShiftLeft => |x, y| u32::try_from(y).ok().and_then(|y| x.checked_shl(y)).unwrap_or(0),
        Op::ShiftRight => |x, y| x >> y.clamp(0, 63),
        _ => |_, _| 0,
    }
}

/// `x // y` of integers, `y` not 0; the result is rounded down.
pub fn int_floor_divide(x: i64, y: i64) -> i64 {
    let q = x.wrapping_div(y);
    if x.wrapping_rem(y) != 0 && (x < 0) != (y < 0) { q - 1 } else { q }
}

/// `x % y` with the sign of `y`, as Python and numpy define it.
pub fn remainder(x: f64, y: f64) -> f64 {
    let r = x % y;
    if r == 0.0 {
        0.0f64.copysign(y)
    } else if (r < 0.0) != (y < 0.0) {
        r + y
    } else {
        r
    }
}

/// `x // y`, rounded down the way Python and numpy round it.
pub fn floor_divide(x: f64, y: f64) -> f64 {
    if y == 0.0 {
        return x / y;
    }
    let quotient = (x - remainder(x, y)) / y;
    let floor = quotient.floor();
    if quotient - floor > 0.5 { floor + 1.0 } else { floor }
}

/// `x ** y` with numpy's short cuts for common exponents.
pub fn power(x: f64, y: f64) -> f64 {
    if y == 2.0 {
        x * x
    } else if y == 0.5 {
        x.sqrt()
    } else {
        x.powf(y)
    }
}

/// The negative of every element.
pub fn negate(budget: &Budget, array: &Array) -> Result<Array, Fault> {
    if array.dtype() == Dtype::Bool {
        return Err(Fault::kind("truth values have no negative; use ~ to invert a mask"));
    }
    budget.allocate(array.size())?;
    let shape = array.shape().to_vec();
    Ok(match array.dtype() {
        Dtype::Int => Array::ints(array.to_ints().into_iter().map(i64::wrapping_neg).collect(), shape),
        dtype => Array::floats_as(array.to_floats().into_iter().map(|x| -x).collect(), dtype, shape),
    })
}

/// Every element inverted: masks logically, integers by bits.
pub fn invert(budget: &Budget, array: &Array) -> Result<Array, Fault> {
    budget.allocate(array.size())?;
    let shape = array.shape().to_vec();
    match array.dtype() {
        Dtype::Bool => Ok(Array::bools(array.to_bools().into_iter().map(|b| !b).collect(), shape)),
        Dtype::Int => Ok(Array::ints(array.to_ints().into_iter().map(|i| !i).collect(), shape)),
        _ => Err(Fault::kind("~ takes a mask or integers, not floats")),
    }
}

/// The absolute value of every element, of the same type.
pub fn absolute(budget: &Budget, array: &Array) -> Result<Array, Fault> {
    budget.allocate(array.size())?;
    let shape = array.shape().to_vec();
    Ok(match array.dtype() {
        Dtype::Bool => array.copy(),
        Dtype::Int => Array::ints(array.to_ints().into_iter().map(i64::wrapping_abs).collect(), shape),
        dtype => Array::floats_as(array.to_floats().into_iter().map(f64::abs).collect(), dtype, shape),
    })
}

/// Applies a float function to a number or array and keeps integers as they are (`floor`, `round`).
pub fn keep_ints(budget: &Budget, value: &Value, f: impl Fn(f64) -> f64) -> Result<Value, Fault> {
    let array = to_array(budget, value, None)?;
    if !array.dtype().is_float() {
        return Ok(Value::array(array));
    }
    budget.allocate(array.size())?;
    let values = array.to_floats().into_iter().map(f).collect();
    Ok(Value::array(Array::floats_as(values, array.dtype(), array.shape().to_vec())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn division_rounds_down_with_the_sign_of_the_divisor() {
        assert_eq!(remainder(-7.0, 3.0), 2.0);
        assert_eq!(remainder(7.0, -3.0), -2.0);
        assert_eq!(floor_divide(-7.0, 2.0), -4.0);
        assert_eq!(int_floor_divide(-7, 2), -4);
        assert_eq!(floor_divide(1.0, 0.1), 9.0);
    }
}
