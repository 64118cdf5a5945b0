//! Python's operators on any two values: numbers, text, sequences, sets, and arrays.
//!
//! Python's numbers follow Python (division by zero is a fault, integers do not wrap); anything with an array
//! or a number of numpy's in it goes to `elementwise`. Imports values, arrays, limits, faults.

use std::cmp::Ordering;

use ruff_python_ast::{CmpOp, Operator, UnaryOp};

use super::array::Array;
use super::dict::{Dict, Key};
use super::elementwise::{self, Op};
use super::error::Fault;
use super::limits::Budget;
use super::scalar::Scalar;
use super::value::{Value, range_len};

/// `a op b`.
pub fn binary(budget: &Budget, op: Operator, a: &Value, b: &Value) -> Result<Value, Fault> {
    match (a, b) {
        (Value::Number(x), Value::Number(y))
            if (x.is_numpys() || y.is_numpys()) && op != Operator::MatMult =>
        {
            elementwise::numbers(array_op(op), *x, *y).map(Value::Number)
        }
        (Value::Number(x), Value::Number(y)) => numbers(op, *x, *y),
        (Value::Array(_), Value::Array(_) | Value::Number(_) | Value::List(_) | Value::Tuple(_))
        | (Value::Number(_) | Value::List(_) | Value::Tuple(_), Value::Array(_)) => match op {
            Operator::MatMult => super::numpy_linalg::matmul(budget, a, b),
            _ => elementwise::binary_values(budget, array_op(op), a, b),
        },
        // A number of numpy's makes an array of the list that it meets; a product would repeat the list.
        (Value::Number(n), Value::List(_) | Value::Tuple(_))
        | (Value::List(_) | Value::Tuple(_), Value::Number(n))
            if n.is_numpys() && !matches!(op, Operator::Mult | Operator::MatMult) =>
        {
            elementwise::binary_values(budget, array_op(op), a, b)
        }
        (Value::Str(x), Value::Str(y)) if op == Operator::Add => {
            budget.text(x.len() + y.len())?;
            Ok(Value::str(format!("{x}{y}")))
        }
        (Value::Str(template), values) if op == Operator::Mod => {
            let text = super::format::percent(template, values)?;
            budget.text(text.len())?;
            Ok(Value::str(text))
        }
        (Value::Str(s), Value::Number(n)) | (Value::Number(n), Value::Str(s)) if op == Operator::Mult => {
            let times = usize::try_from(n.int()).unwrap_or(0);
            budget.text(s.len().saturating_mul(times))?;
            Ok(Value::str(s.repeat(times)))
        }
        (Value::List(_) | Value::Tuple(_), Value::List(_) | Value::Tuple(_)) if op == Operator::Add => {
            concatenate(budget, a, b)
        }
        (Value::List(_) | Value::Tuple(_), Value::Number(n))
        | (Value::Number(n), Value::List(_) | Value::Tuple(_))
            if op == Operator::Mult =>
        {
            repeat(budget, if matches!(a, Value::Number(_)) { b } else { a }, *n)
        }
        (Value::Dict(x), Value::Dict(y)) if op == Operator::BitOr => {
            budget.allocate(x.0.borrow().len().saturating_add(y.0.borrow().len()))?;
            let entries = [x.0.borrow().entries(), y.0.borrow().entries()].concat();
            super::methods_dict::made(entries).map(Value::dict)
        }
        // `float | None` stands in the names of types.
        (Value::Type(_) | Value::Builtin(_) | Value::Dtype(_), _)
        | (_, Value::Type(_) | Value::Builtin(_) | Value::Dtype(_))
            if op == Operator::BitOr =>
        {
            Ok(Value::Type("object"))
        }
        (Value::Set(x), Value::Set(y)) => sets(budget, op, &x.0.borrow(), &y.0.borrow()),
        _ => Err(mismatch(op.as_str(), a, b)),
    }
}

fn mismatch(op: &str, a: &Value, b: &Value) -> Fault {
    Fault::kind(format!("`{op}` does not work between {} and {}", a.type_name(), b.type_name()))
}

/// The element-by-element operation of an operator.
fn array_op(op: Operator) -> Op {
    match op {
        Operator::Add => Op::Add,
        Operator::Sub => Op::Subtract,
        Operator::Mult | Operator::MatMult => Op::Multiply,
        Operator::Div => Op::Divide,
        Operator::FloorDiv => Op::FloorDivide,
        Operator::Mod => Op::Remainder,
        Operator::Pow => Op::Power,
        Operator::LShift => Op::ShiftLeft,
        Operator::RShift => Op::ShiftRight,
        Operator::BitOr => Op::BitOr,
        Operator::BitXor => Op::BitXor,
        Operator::BitAnd => Op::BitAnd,
    }
}

fn numbers(op: Operator, x: Scalar, y: Scalar) -> Result<Value, Fault> {
    use Operator as O;
    if let (Scalar::Bool(x), Scalar::Bool(y)) = (x, y) {
        match op {
            O::BitAnd => return Ok(Value::bool(x & y)),
            O::BitOr => return Ok(Value::bool(x | y)),
            O::BitXor => return Ok(Value::bool(x ^ y)),
            _ => {}
        }
    }
    match (x, y) {
        (Scalar::Float(_), _) | (_, Scalar::Float(_)) => floats(op, x.float(), y.float()),
        _ if op == O::Div => floats(op, x.float(), y.float()),
        _ => ints(op, x.int(), y.int()),
    }
}

fn floats(op: Operator, x: f64, y: f64) -> Result<Value, Fault> {
    use Operator as O;
    if matches!(op, O::Div | O::FloorDiv | O::Mod) && y == 0.0 || op == O::Pow && x == 0.0 && y < 0.0 {
        return Err(Fault::ZeroDivision);
    }
    Ok(Value::float(match op {
        O::Add => x + y,
        O::Sub => x - y,
        O::Mult => x * y,
        O::Div => x / y,
        O::FloorDiv => elementwise::floor_divide(x, y),
        O::Mod => elementwise::remainder(x, y),
        O::Pow if x < 0.0 && y.fract() != 0.0 && y.is_finite() => {
            return Err(Fault::value(
                "a negative number to a fractional power is complex; use np.cbrt or abs",
            ));
        }
        O::Pow => x.powf(y),
        _ => return Err(Fault::kind(format!("`{}` does not work on floats", op.as_str()))),
    }))
}

fn ints(op: Operator, x: i64, y: i64) -> Result<Value, Fault> {
    use Operator as O;
    if matches!(op, O::FloorDiv | O::Mod) && y == 0 {
        return Err(Fault::ZeroDivision);
    }
    let shift = || u32::try_from(y).map_err(|_| Fault::value("a shift must not be negative"));
    let result = match op {
        O::Add => x.checked_add(y),
        O::Sub => x.checked_sub(y),
        O::Mult => x.checked_mul(y),
        O::FloorDiv => (x != i64::MIN || y != -1).then(|| elementwise::int_floor_divide(x, y)),
        O::Mod => Some(x.wrapping_rem(y)).map(|r| if r != 0 && (r < 0) != (y < 0) { r + y } else { r }),
        O::Pow if y < 0 => return floats(op, x as f64, y as f64),
        O::Pow => u32::try_from(y).ok().and_then(|y| x.checked_pow(y)),
        O::BitAnd => Some(x & y),
        O::BitOr => Some(x | y),
        O::BitXor => Some(x ^ y),
        O::LShift => 1i64.checked_shl(shift()?).filter(|&f| f > 0).and_then(|f| x.checked_mul(f)),
        O::RShift => Some(x >> shift()?.min(63)),
        O::Div | O::MatMult => return Err(Fault::kind(format!("`{}` does not work here", op.as_str()))),
    };
    result.map(Value::int).ok_or_else(|| {
        Fault::unsupported("an integer beyond 64 bits", "write one of the numbers as a float, such as 10.0")
    })
}

fn concatenate(budget: &Budget, a: &Value, b: &Value) -> Result<Value, Fault> {
    let (Some(mut all), Some(more)) = (a.items(), b.items()) else { return Err(mismatch("+", a, b)) };
    budget.allocate_items(all.len() + more.len())?;
    all.extend(more);
    match (a, b) {
        (Value::List(_), Value::List(_)) => Ok(Value::list(all)),
        (Value::Tuple(_), Value::Tuple(_)) => Ok(Value::tuple(all)),
        _ => Err(mismatch("+", a, b)),
    }
}

fn repeat(budget: &Budget, sequence: &Value, times: Scalar) -> Result<Value, Fault> {
    if times.dtype().is_float() {
        return Err(Fault::kind("a list can only be multiplied by an integer"));
    }
    let items = sequence.items().unwrap_or_default();
    // Nothing, however often, is nothing; it must not be counted out.
    let times = if items.is_empty() { 0 } else { usize::try_from(times.int()).unwrap_or(0) };
    budget.allocate_items(items.len().saturating_mul(times))?;
    let all = std::iter::repeat_n(items, times).flatten().collect();
    Ok(if matches!(sequence, Value::List(_)) { Value::list(all) } else { Value::tuple(all) })
}

fn sets(budget: &Budget, op: Operator, a: &Dict, b: &Dict) -> Result<Value, Fault> {
    budget.allocate(a.len() + b.len())?;
    let mut out = Dict::default();
    let keys = |d: &Dict| d.entries().iter().map(|(k, _)| k.clone()).collect::<Vec<_>>();
    let holds = |d: &Dict, key: &Value| Key::of(key).is_ok_and(|k| d.get(&k).is_some());
    for key in keys(a) {
        let keep = match op {
            Operator::BitOr => true,
            Operator::BitAnd => holds(b, &key),
            Operator::Sub | Operator::BitXor => !holds(b, &key),
            _ => return Err(Fault::kind(format!("`{}` does not work between sets", op.as_str()))),
        };
        if keep {
            out.insert(&key, Value::None)?;
        }
    }
    if matches!(op, Operator::BitOr | Operator::BitXor) {
        for key in keys(b) {
            if op == Operator::BitOr || !holds(a, &key) {
                out.insert(&key, Value::None)?;
            }
        }
    }
    Ok(Value::set(out))
}

/// `-a`, `+a`, `~a`, `not a`.
pub fn unary(budget: &Budget, op: UnaryOp, value: &Value) -> Result<Value, Fault> {
    match (op, value) {
        (UnaryOp::Not, _) => value.truth().map(|t| Value::bool(!t)),
        (UnaryOp::USub, Value::Number(n)) => match n {
            Scalar::Float(f) => Ok(Value::float(-f)),
            Scalar::Float64(f) => Ok(Value::float64(-f)),
            Scalar::Int64(i) => Ok(Value::Number(Scalar::Int64(i.wrapping_neg()))),
            _ => ints(Operator::Sub, 0, n.int()),
        },
        (UnaryOp::USub, Value::Array(a)) => elementwise::negate(budget, a).map(Value::array),
        (UnaryOp::Invert, Value::Array(a)) => elementwise::invert(budget, a).map(Value::array),
        // A truth value out of a mask inverts logically; ~True on a Python bool is never meant.
        (UnaryOp::Invert, Value::Number(Scalar::Bool(b))) => Ok(Value::bool(!b)),
        (UnaryOp::Invert, Value::Number(Scalar::Int(i) | Scalar::Int64(i))) => Ok(Value::int(!i)),
        (UnaryOp::UAdd, Value::Array(a)) => {
            budget.allocate(a.size())?;
            Ok(Value::Array(a.copy()))
        }
        (UnaryOp::UAdd, Value::Number(_)) => Ok(value.clone()),
        _ => Err(Fault::kind(format!("`{}` does not work on {}", op.as_str(), value.type_name()))),
    }
}

/// `a op b` for a comparison.
pub fn compare(budget: &Budget, op: CmpOp, a: &Value, b: &Value) -> Result<Value, Fault> {
    let elementwise_op = match op {
        CmpOp::Is => return Ok(Value::bool(identical(a, b))),
        CmpOp::IsNot => return Ok(Value::bool(!identical(a, b))),
        CmpOp::In => return contains(budget, b, a).map(Value::bool),
        CmpOp::NotIn => return contains(budget, b, a).map(|found| Value::bool(!found)),
        CmpOp::Eq => Op::Equal,
        CmpOp::NotEq => Op::NotEqual,
        CmpOp::Lt => Op::Less,
        CmpOp::LtE => Op::LessEqual,
        CmpOp::Gt => Op::Greater,
        CmpOp::GtE => Op::GreaterEqual,
    };
    let text = |v: &Value| matches!(v, Value::Str(_) | Value::None);
    if (matches!(a, Value::Array(_)) || matches!(b, Value::Array(_))) && !text(a) && !text(b) {
        return elementwise::binary_values(budget, elementwise_op, a, b);
    }
    match op {
        CmpOp::Eq => return equal(budget, a, b, 0).map(Value::bool),
        CmpOp::NotEq => return equal(budget, a, b, 0).map(|same| Value::bool(!same)),
        _ => {}
    }
    let order = order(budget, a, b)?;
    Ok(Value::bool(order.is_some_and(|o| match op {
        CmpOp::Lt => o.is_lt(),
        CmpOp::LtE => o.is_le(),
        CmpOp::Gt => o.is_gt(),
        _ => o.is_ge(),
    })))
}

fn identical(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::None, Value::None) => true,
        (Value::Number(x), Value::Number(y)) => x.plain() == y.plain(),
        (Value::Str(x), Value::Str(y)) => x == y,
        (Value::Array(x), Value::Array(y)) => x.same(y),
        (Value::List(x), Value::List(y)) | (Value::Tuple(x), Value::Tuple(y)) => std::rc::Rc::ptr_eq(x, y),
        (Value::Dict(x), Value::Dict(y)) | (Value::Set(x), Value::Set(y)) => std::rc::Rc::ptr_eq(x, y),
        (Value::Builtin(x), Value::Builtin(y)) => std::ptr::eq(*x, *y),
        (Value::Dtype(x), Value::Dtype(y)) => x == y,
        _ => false,
    }
}

/// Lists compared with themselves inside themselves would never end.
const MAX_COMPARE_DEPTH: usize = 64;

/// `a == b` as one truth value.
pub fn equal(budget: &Budget, a: &Value, b: &Value, depth: usize) -> Result<bool, Fault> {
    budget.charge(1)?;
    if depth > MAX_COMPARE_DEPTH {
        return Err(Fault::limit("levels of nested lists", MAX_COMPARE_DEPTH as u64));
    }
    match (a, b) {
        (Value::Number(x), Value::Number(y)) if x.dtype().is_float() || y.dtype().is_float() => {
            Ok(x.float() == y.float())
        }
        (Value::Number(x), Value::Number(y)) => Ok(x.int() == y.int()),
        (Value::List(x), Value::List(y)) | (Value::Tuple(x), Value::Tuple(y)) => {
            let (x, y) = (x.0.borrow().clone(), y.0.borrow().clone());
            if x.len() != y.len() {
                return Ok(false);
            }
            x.iter().zip(&y).try_fold(true, |same, (p, q)| Ok(same && equal(budget, p, q, depth + 1)?))
        }
        (Value::Range(a, b, s), Value::Range(c, d, t)) => {
            Ok((a, b, s) == (c, d, t) || range_len(*a, *b, *s) == 0 && range_len(*c, *d, *t) == 0)
        }
        (Value::Set(x), Value::Set(y)) => {
            let (x, y) = (x.0.borrow(), y.0.borrow());
            let held = |k: &Value| Key::of(k).is_ok_and(|k| y.get(&k).is_some());
            Ok(x.len() == y.len() && x.entries().iter().all(|(k, _)| held(k)))
        }
        (Value::Dict(x), Value::Dict(y)) => {
            let (x, y) = (x.0.borrow().entries().to_vec(), y.0.borrow().entries().to_vec());
            let list =
                |d: Vec<(Value, Value)>| Value::list(d.into_iter().flat_map(|(k, v)| [k, v]).collect());
            equal(budget, &list(x), &list(y), depth + 1)
        }
        (Value::Array(x), _) | (_, Value::Array(x)) if x.size() == 1 => {
            Ok(a.as_scalar().zip(b.as_scalar()).is_some_and(|(p, q)| p.float() == q.float()))
        }
        // `a.dtype == float`
        (Value::Dtype(x), Value::Builtin(_) | Value::Str(_)) => {
            Ok(super::convert::to_dtype(b).ok() == Some(*x))
        }
        (Value::Builtin(_) | Value::Str(_), Value::Dtype(y)) => {
            Ok(super::convert::to_dtype(a).ok() == Some(*y))
        }
        (Value::Array(_), Value::Array(_)) => {
            elementwise::binary_values(budget, Op::Equal, a, b).and_then(|v| v.truth())
        }
        _ => Ok(identical(a, b)),
    }
}

/// How two values stand in order; `None` with NaN.
pub fn order(budget: &Budget, a: &Value, b: &Value) -> Result<Option<Ordering>, Fault> {
    budget.charge(1)?;
    match (a, b) {
        (Value::Str(x), Value::Str(y)) => Ok(Some(x.cmp(y))),
        (Value::List(x), Value::List(y)) | (Value::Tuple(x), Value::Tuple(y)) => {
            let (x, y) = (x.0.borrow().clone(), y.0.borrow().clone());
            budget.enter()?;
            let first = x
                .iter()
                .zip(&y)
                .map(|(p, q)| order(budget, p, q))
                .find(|o| !matches!(o, Ok(Some(Ordering::Equal))));
            budget.leave();
            first.unwrap_or_else(|| Ok(Some(x.len().cmp(&y.len()))))
        }
        _ => match (a.as_scalar(), b.as_scalar()) {
            (Some(Scalar::Float(_)), Some(y)) => {
                Ok(a.as_scalar().and_then(|x| x.float().partial_cmp(&y.float())))
            }
            (Some(x), Some(Scalar::Float(y))) => Ok(x.float().partial_cmp(&y)),
            (Some(x), Some(y)) => Ok(Some(x.int().cmp(&y.int()))),
            _ => Err(Fault::kind(format!("{} and {} have no order", a.type_name(), b.type_name()))),
        },
    }
}

/// `item in container`.
fn contains(budget: &Budget, container: &Value, item: &Value) -> Result<bool, Fault> {
    match container {
        Value::Dict(d) | Value::Set(d) => Ok(d.0.borrow().get(&Key::of(item)?).is_some()),
        Value::Str(s) => match item {
            Value::Str(part) => Ok(s.contains(part.as_ref())),
            _ => Err(Fault::kind("only text can be in text")),
        },
        Value::Range(start, stop, step) => {
            let inside = |i: i64| {
                let ahead = if *step > 0 { (*start..*stop).contains(&i) } else { i <= *start && i > *stop };
                ahead && i.wrapping_sub(*start).wrapping_rem(*step) == 0
            };
            Ok(item.as_int().is_some_and(inside))
        }
        Value::Array(a) => {
            let found = elementwise::binary_values(budget, Op::Equal, &Value::Array(a.clone()), item)?;
            Ok(super::convert::to_array(budget, &found, None)?.to_bools().contains(&true))
        }
        other => match other.items() {
            Some(items) => items.iter().try_fold(false, |found, v| Ok(found || equal(budget, v, item, 0)?)),
            None => Err(Fault::kind(format!("`in` does not work on {}", other.type_name()))),
        },
    }
}

/// An in-place operator on an array: the result is written into the same buffer, as numpy does.
pub fn in_place(budget: &Budget, op: Operator, target: &Array, value: &Value) -> Result<(), Fault> {
    let result = binary(budget, op, &Value::Array(target.clone()), value)?;
    let result = super::convert::to_array(budget, &result, None)?;
    if result.dtype() > target.dtype() && !(result.dtype().is_float() && target.dtype().is_float()) {
        return Err(Fault::kind(format!(
            "a {} array cannot take {} results in place; write `a = a {} b`",
            target.dtype().name(),
            result.dtype().name(),
            op.as_str()
        )));
    }
    if result.ndim() > target.ndim() {
        return Err(Fault::value("an in-place operation cannot change the shape of an array"));
    }
    target.assign(&result)
}
