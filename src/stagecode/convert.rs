//! From Python values to arrays, shapes and element types, and back to nested lists.
//!
//! Values come in, arrays go out; every element is charged first. Imports values, arrays, limits, faults.

use super::array::Array;
use super::error::Fault;
use super::limits::Budget;
use super::scalar::{Dtype, Scalar};
use super::value::{Value, range_len};

/// numpy allows 64 axes; nobody needs more than these.
pub const MAX_DIMENSIONS: usize = 16;

/// The array of a value: an array itself (shared), a number, or nested lists and tuples of numbers.
pub fn to_array(budget: &Budget, value: &Value, dtype: Option<Dtype>) -> Result<Array, Fault> {
    let array = match value {
        Value::Array(a) => a.clone(),
        Value::Number(n) => Array::scalar(*n),
        _ => from_nested(budget, value)?,
    };
    Ok(match dtype {
        Some(dtype) if dtype != array.dtype() => {
            budget.allocate(array.size())?;
            array.cast(dtype)
        }
        _ => array,
    })
}

/// Elements, common type and shape while nested lists are read.
struct Reading<'a> {
    budget: &'a Budget,
    elements: Vec<Scalar>,
    dtype: Option<Dtype>,
}

fn from_nested(budget: &Budget, value: &Value) -> Result<Array, Fault> {
    let mut reading = Reading { budget, elements: Vec::new(), dtype: None };
    let shape = reading.read(value, 0)?;
    let dtype = reading.dtype.unwrap_or(Dtype::F64);
    Ok(Array::from_scalars(&reading.elements, dtype, shape))
}

impl Reading<'_> {
    /// Reads one value and returns its shape.
    fn read(&mut self, value: &Value, depth: usize) -> Result<Vec<usize>, Fault> {
        if depth > MAX_DIMENSIONS {
            return Err(Fault::limit("dimensions of an array", MAX_DIMENSIONS as u64));
        }
        match value {
            Value::Number(n) => self.push(&[*n], n.dtype(), Vec::new()),
            Value::Array(a) => self.push(&a.to_scalars(), a.dtype(), a.shape().to_vec()),
            Value::Range(start, stop, step) => {
                let count = range_len(*start, *stop, *step);
                self.budget.allocate(count)?;
                let all: Vec<Scalar> = (0..count as i64)
                    .map(|i| Scalar::Int(start.wrapping_add(i.wrapping_mul(*step))))
                    .collect();
                self.push(&all, Dtype::Int, vec![count])
            }
            Value::List(items) | Value::Tuple(items) => self.read_items(&items.0.borrow(), depth),
            Value::Iter(iter) => self.read_items(&iter.items, depth),
            other => Err(Fault::kind(format!("a {} cannot be part of an array", other.type_name()))),
        }
    }

    fn read_items(&mut self, items: &[Value], depth: usize) -> Result<Vec<usize>, Fault> {
        let mut inner: Option<Vec<usize>> = None;
        for item in items {
            let shape = self.read(item, depth + 1)?;
            match &inner {
                Some(first) if *first != shape => {
                    return Err(Fault::value("the rows of an array must all have the same shape"));
                }
                _ => inner = Some(shape),
            }
        }
        let mut shape = vec![items.len()];
        shape.extend(inner.unwrap_or_default());
        Ok(shape)
    }

    fn push(&mut self, all: &[Scalar], dtype: Dtype, shape: Vec<usize>) -> Result<Vec<usize>, Fault> {
        self.budget.charge(all.len())?;
        if self.elements.len() + all.len() > self.budget.limits().elements {
            return self.budget.allocate(usize::MAX).map(|()| shape);
        }
        self.elements.extend_from_slice(all);
        self.dtype = Some(self.dtype.map_or(dtype, |d| d.promote(dtype)));
        Ok(shape)
    }
}

/// A shape from an integer or a sequence of integers.
pub fn to_shape(value: &Value) -> Result<Vec<usize>, Fault> {
    let length = |v: &Value| {
        v.as_int()
            .and_then(|n| usize::try_from(n).ok())
            .ok_or_else(|| Fault::kind("a shape consists of integers that are not negative"))
    };
    match value {
        Value::List(items) | Value::Tuple(items) => {
            let shape: Vec<usize> = items.0.borrow().iter().map(length).collect::<Result<_, _>>()?;
            check_dimensions(shape)
        }
        Value::Array(a) if a.ndim() == 1 && a.dtype() == Dtype::Int => check_dimensions(
            a.to_ints().into_iter().map(|n| length(&Value::int(n))).collect::<Result<_, _>>()?,
        ),
        other => Ok(vec![length(other)?]),
    }
}

/// Refuses shapes with more axes than an array may have.
pub fn check_dimensions(shape: Vec<usize>) -> Result<Vec<usize>, Fault> {
    if shape.len() > MAX_DIMENSIONS {
        return Err(Fault::limit("dimensions of an array", MAX_DIMENSIONS as u64));
    }
    Ok(shape)
}

/// An element type from `float`, `np.float32`, `"int"` and their like.
pub fn to_dtype(value: &Value) -> Result<Dtype, Fault> {
    let name = match value {
        Value::Dtype(dtype) => return Ok(*dtype),
        Value::Str(s) => s.as_ref(),
        Value::Builtin(row) => row.name,
        _ => "",
    };
    dtype_named(name).ok_or_else(|| {
        Fault::unsupported("this element type", "use float, np.float32, int or bool as the element type")
    })
}

/// The element type of a name, numpy's or Python's.
pub fn dtype_named(name: &str) -> Option<Dtype> {
    Some(match name {
        "bool" | "bool_" | "?" => Dtype::Bool,
        "int" | "int_" | "int8" | "int16" | "int32" | "int64" | "intp" | "uint8" | "uint16" | "uint32"
        | "uint64" | "uint" | "i4" | "i8" | "integer" => Dtype::Int,
        "float32" | "f4" | "single" | "float16" | "half" => Dtype::F32,
        "float" | "float64" | "f8" | "float_" | "double" | "floating" => Dtype::F64,
        _ => return None,
    })
}

/// Nested lists of Python numbers.
pub fn to_list(budget: &Budget, array: &Array) -> Result<Value, Fault> {
    budget.allocate_items(array.size())?;
    if array.ndim() == 0 {
        return Ok(array.first().map_or(Value::None, Value::Number));
    }
    if array.ndim() == 1 {
        return Ok(Value::list(array.to_scalars().into_iter().map(Value::Number).collect()));
    }
    budget.charge(array.shape()[0])?;
    let rows = (0..array.shape()[0]).map(|i| to_list(budget, &array.select(0, i)));
    Ok(Value::list(rows.collect::<Result<_, _>>()?))
}
