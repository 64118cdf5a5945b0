//! The array: a shared buffer seen through shape and strides, as numpy's.
//!
//! Views (slices, transposes, broadcasts) share their buffer, so that `a[:, 1] *= 2` and `x = a[:, 0]; x += 1`
//! change `a`, which a copying array type would not. Data comes in as vectors in C order and goes out the
//! same way; the sizes are charged by the callers. Imports scalars and the faults.

use std::cell::RefCell;
use std::rc::Rc;

use super::error::Fault;
use super::memory::Held;
use super::scalar::{Dtype, Scalar};

/// The elements of an array, in the order of its buffer.
#[derive(Clone, Debug, PartialEq)]
pub enum Buffer {
    /// Truth values.
    Bool(Vec<bool>),
    /// Integers.
    Int(Vec<i64>),
    /// Floats of either precision.
    Float(Vec<f64>),
}

impl Buffer {
    fn bytes(&self) -> usize {
        match self {
            Self::Bool(v) => v.len(),
            Self::Int(v) => 8 * v.len(),
            Self::Float(v) => 8 * v.len(),
        }
    }

    fn get(&self, at: usize) -> Scalar {
        match self {
            Self::Bool(v) => Scalar::Bool(v[at]),
            Self::Int(v) => Scalar::Int(v[at]),
            Self::Float(v) => Scalar::Float(v[at]),
        }
    }

    fn set(&mut self, at: usize, value: Scalar, dtype: Dtype) {
        match self {
            Self::Bool(v) => v[at] = value.truth(),
            Self::Int(v) => v[at] = value.int(),
            Self::Float(v) => v[at] = round_to(dtype, value.float()),
        }
    }
}

/// `value` as an element of type `dtype` holds it.
fn round_to(dtype: Dtype, value: f64) -> f64 {
    if dtype == Dtype::F32 { f64::from(value as f32) } else { value }
}

/// A buffer that arrays share.
#[derive(Debug)]
struct Shared {
    data: RefCell<Buffer>,
    _held: Held,
}

/// An n-dimensional array, possibly a view into another's buffer.
#[derive(Clone, Debug)]
pub struct Array {
    buffer: Rc<Shared>,
    dtype: Dtype,
    shape: Vec<usize>,
    strides: Vec<isize>,
    offset: isize,
}

/// Strides of a C-ordered array of this shape, in elements.
fn c_strides(shape: &[usize]) -> Vec<isize> {
    let mut strides = vec![1isize; shape.len()];
    for axis in (1..shape.len()).rev() {
        strides[axis - 1] = strides[axis] * shape[axis].max(1) as isize;
    }
    strides
}

impl Array {
    /// An array over `buffer` in C order. The length must be the product of `shape`.
    pub fn new(buffer: Buffer, dtype: Dtype, shape: Vec<usize>) -> Self {
        let _held = Held::new(buffer.bytes());
        let buffer = Rc::new(Shared { data: RefCell::new(buffer), _held });
        Self { buffer, dtype, strides: c_strides(&shape), shape, offset: 0 }
    }

    /// Doubles in C order.
    pub fn floats(values: Vec<f64>, shape: Vec<usize>) -> Self {
        Self::new(Buffer::Float(values), Dtype::F64, shape)
    }

    /// Floats of the given precision in C order; other types are cast.
    pub fn floats_as(values: Vec<f64>, dtype: Dtype, shape: Vec<usize>) -> Self {
        let buffer = match dtype {
            Dtype::Bool => Buffer::Bool(values.into_iter().map(|v| v != 0.0).collect()),
            Dtype::Int => Buffer::Int(values.into_iter().map(|v| v as i64).collect()),
            Dtype::F32 => Buffer::Float(values.into_iter().map(|v| round_to(dtype, v)).collect()),
            Dtype::F64 => Buffer::Float(values),
        };
        Self::new(buffer, dtype, shape)
    }

    /// Integers in C order.
    pub fn ints(values: Vec<i64>, shape: Vec<usize>) -> Self {
        Self::new(Buffer::Int(values), Dtype::Int, shape)
    }

    /// Truth values in C order.
    pub fn bools(values: Vec<bool>, shape: Vec<usize>) -> Self {
        Self::new(Buffer::Bool(values), Dtype::Bool, shape)
    }

    /// An array without dimensions.
    pub fn scalar(value: Scalar) -> Self {
        Self::from_scalars(&[value], value.dtype(), Vec::new())
    }

    /// Elements in C order, cast to `dtype`.
    pub fn from_scalars(values: &[Scalar], dtype: Dtype, shape: Vec<usize>) -> Self {
        let buffer = match dtype {
            Dtype::Bool => Buffer::Bool(values.iter().map(|v| v.truth()).collect()),
            Dtype::Int => Buffer::Int(values.iter().map(|v| v.int()).collect()),
            _ => Buffer::Float(values.iter().map(|v| round_to(dtype, v.float())).collect()),
        };
        Self::new(buffer, dtype, shape)
    }

    /// An array of `count` times one element.
    pub fn constant(value: Scalar, count: usize, dtype: Dtype, shape: Vec<usize>) -> Self {
        let buffer = match dtype {
            Dtype::Bool => Buffer::Bool(vec![value.truth(); count]),
            Dtype::Int => Buffer::Int(vec![value.int(); count]),
            _ => Buffer::Float(vec![round_to(dtype, value.float()); count]),
        };
        Self::new(buffer, dtype, shape)
    }

    /// Element type.
    pub fn dtype(&self) -> Dtype {
        self.dtype
    }

    /// Extent along each axis.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Number of axes.
    pub fn ndim(&self) -> usize {
        self.shape.len()
    }

    /// Distance in the buffer between neighbours along `axis`.
    pub fn stride(&self, axis: usize) -> isize {
        self.strides[axis]
    }

    /// Number of elements.
    pub fn size(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether both are the same view of the same buffer.
    pub fn same(&self, other: &Self) -> bool {
        Rc::ptr_eq(&self.buffer, &other.buffer)
            && (&self.shape, &self.strides, self.offset) == (&other.shape, &other.strides, other.offset)
    }

    /// Position in the buffer of every element, in C order.
    pub fn positions(&self) -> Vec<usize> {
        let size = self.size();
        let mut out = Vec::with_capacity(size);
        if size == 0 {
            return out;
        }
        let mut index = vec![0usize; self.ndim()];
        let mut at = self.offset;
        for _ in 0..size {
            out.push(at as usize);
            for axis in (0..index.len()).rev() {
                index[axis] += 1;
                at += self.strides[axis];
                if index[axis] < self.shape[axis] {
                    break;
                }
                at -= self.strides[axis] * self.shape[axis] as isize;
                index[axis] = 0;
            }
        }
        out
    }

    /// Whether the elements lie in C order without gaps.
    fn is_contiguous(&self) -> bool {
        let plain = c_strides(&self.shape);
        self.shape.iter().zip(&self.strides).zip(plain).all(|((&n, &s), p)| n <= 1 || s == p)
    }

    /// The elements in C order, in a buffer of their own.
    pub fn gather(&self) -> Buffer {
        let buffer = self.buffer.data.borrow();
        if self.is_contiguous() {
            let part = self.offset as usize..self.offset as usize + self.size();
            let part = if part.start == part.end { 0..0 } else { part };
            return match &*buffer {
                Buffer::Bool(v) => Buffer::Bool(v[part].to_vec()),
                Buffer::Int(v) => Buffer::Int(v[part].to_vec()),
                Buffer::Float(v) => Buffer::Float(v[part].to_vec()),
            };
        }
        let at = self.positions();
        match &*buffer {
            Buffer::Bool(v) => Buffer::Bool(at.into_iter().map(|i| v[i]).collect()),
            Buffer::Int(v) => Buffer::Int(at.into_iter().map(|i| v[i]).collect()),
            Buffer::Float(v) => Buffer::Float(at.into_iter().map(|i| v[i]).collect()),
        }
    }

    /// The elements in C order as floats.
    pub fn to_floats(&self) -> Vec<f64> {
        match self.gather() {
            Buffer::Bool(v) => v.into_iter().map(|b| f64::from(u8::from(b))).collect(),
            Buffer::Int(v) => v.into_iter().map(|i| i as f64).collect(),
            Buffer::Float(v) => v,
        }
    }

    /// The elements in C order as integers; fractions are cut off.
    pub fn to_ints(&self) -> Vec<i64> {
        match self.gather() {
            Buffer::Bool(v) => v.into_iter().map(i64::from).collect(),
            Buffer::Int(v) => v,
            Buffer::Float(v) => v.into_iter().map(|f| f as i64).collect(),
        }
    }

    /// The elements in C order as truth values.
    pub fn to_bools(&self) -> Vec<bool> {
        match self.gather() {
            Buffer::Bool(v) => v,
            Buffer::Int(v) => v.into_iter().map(|i| i != 0).collect(),
            Buffer::Float(v) => v.into_iter().map(|f| f != 0.0).collect(),
        }
    }

    /// The elements in C order.
    pub fn to_scalars(&self) -> Vec<Scalar> {
        let buffer = self.buffer.data.borrow();
        self.positions().into_iter().map(|at| buffer.get(at)).collect()
    }

    /// The first element, if there is one.
    pub fn first(&self) -> Option<Scalar> {
        (self.size() > 0).then(|| self.buffer.data.borrow().get(self.offset as usize))
    }

    /// A copy with elements of another type.
    pub fn cast(&self, dtype: Dtype) -> Self {
        let buffer = match dtype {
            Dtype::Bool => Buffer::Bool(self.to_bools()),
            Dtype::Int => Buffer::Int(self.to_ints()),
            _ => return Self::floats_as(self.to_floats(), dtype, self.shape.clone()),
        };
        Self::new(buffer, dtype, self.shape.clone())
    }

    /// A copy with a buffer of its own.
    pub fn copy(&self) -> Self {
        Self::new(self.gather(), self.dtype, self.shape.clone())
    }

    /// A view along `axis`: `count` elements from `start` in steps of `step`. The caller checks the range.
    pub fn slice(&self, axis: usize, start: usize, step: isize, count: usize) -> Self {
        let mut view = self.clone();
        if count > 0 {
            view.offset += start as isize * self.strides[axis];
        }
        view.strides[axis] = self.strides[axis].saturating_mul(if count > 1 { step } else { 1 });
        view.shape[axis] = count;
        view
    }

    /// A view without `axis`, at `index` along it. The caller checks the range.
    pub fn select(&self, axis: usize, index: usize) -> Self {
        let mut view = self.slice(axis, index, 1, 1);
        view.shape.remove(axis);
        view.strides.remove(axis);
        view
    }

    /// A view with a new axis of length one before `axis`.
    pub fn insert_axis(&self, axis: usize) -> Self {
        let mut view = self.clone();
        view.shape.insert(axis, 1);
        view.strides.insert(axis, 0);
        view
    }

    /// A view without `axis`, which has length one.
    pub fn remove_axis(&self, axis: usize) -> Self {
        self.select(axis, 0)
    }

    /// A view with the axes in another order.
    pub fn permute(&self, order: &[usize]) -> Self {
        let mut view = self.clone();
        view.shape = order.iter().map(|&a| self.shape[a]).collect();
        view.strides = order.iter().map(|&a| self.strides[a]).collect();
        view
    }

    /// The same elements in another shape of the same size: a view where the elements lie in order.
    pub fn reshape(&self, shape: Vec<usize>) -> Self {
        let mut view = if self.is_contiguous() { self.clone() } else { self.copy() };
        view.strides = c_strides(&shape);
        view.shape = shape;
        view
    }

    /// A view stretched to `shape`.
    pub fn broadcast(&self, shape: &[usize]) -> Result<Self, Fault> {
        let mismatch =
            || Fault::value(format!("shape {} does not fit shape {}", show(&self.shape), show(shape)));
        let missing = shape.len().checked_sub(self.ndim()).ok_or_else(mismatch)?;
        let mut view = self.clone();
        view.strides = vec![0; shape.len()];
        for axis in 0..self.ndim() {
            let (have, want) = (self.shape[axis], shape[axis + missing]);
            if have == want {
                view.strides[axis + missing] = self.strides[axis];
            } else if have != 1 {
                return Err(mismatch());
            }
        }
        view.shape = shape.to_vec();
        Ok(view)
    }

    /// Overwrites every element of this view with those of `source`, stretched and cast to fit.
    pub fn assign(&self, source: &Self) -> Result<(), Fault> {
        let source = source.broadcast(&self.shape)?;
        self.scatter(&self.positions(), &source.to_scalars());
        Ok(())
    }

    /// Writes `values` (one, or one per position) at positions of the buffer.
    pub fn scatter(&self, positions: &[usize], values: &[Scalar]) {
        let mut buffer = self.buffer.data.borrow_mut();
        if let [value] = values {
            positions.iter().for_each(|&at| buffer.set(at, *value, self.dtype));
        } else {
            positions.iter().zip(values).for_each(|(&at, &value)| buffer.set(at, value, self.dtype));
        }
    }

    /// New array of the elements at positions of the buffer.
    pub fn pick(&self, positions: &[usize], shape: Vec<usize>) -> Self {
        let buffer = match &*self.buffer.data.borrow() {
            Buffer::Bool(v) => Buffer::Bool(positions.iter().map(|&i| v[i]).collect()),
            Buffer::Int(v) => Buffer::Int(positions.iter().map(|&i| v[i]).collect()),
            Buffer::Float(v) => Buffer::Float(positions.iter().map(|&i| v[i]).collect()),
        };
        Self::new(buffer, self.dtype, shape)
    }
}

/// The shape to which both stretch.
pub fn broadcast_shapes(a: &[usize], b: &[usize]) -> Result<Vec<usize>, Fault> {
    let n = a.len().max(b.len());
    let at = |s: &[usize], axis: usize| (axis + s.len()).checked_sub(n).map_or(1, |i| s[i]);
    (0..n)
        .map(|axis| match (at(a, axis), at(b, axis)) {
            (x, y) if x == y => Ok(x),
            (1, y) => Ok(y),
            (x, 1) => Ok(x),
            _ => Err(Fault::value(format!("shapes {} and {} do not fit together", show(a), show(b)))),
        })
        .collect()
}

/// A shape as Python prints it.
pub fn show(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => format!("({})", shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_share_the_buffer() {
        let a = Array::floats((0..6).map(f64::from).collect(), vec![2, 3]);
        let column = a.select(1, 1);
        column.assign(&Array::scalar(Scalar::Float(9.0))).unwrap();
        assert_eq!(a.to_floats(), [0.0, 9.0, 2.0, 3.0, 9.0, 5.0]);
        assert_eq!(a.permute(&[1, 0]).to_floats(), [0.0, 3.0, 9.0, 9.0, 2.0, 5.0]);
        assert_eq!(a.slice(1, 2, -2, 2).to_floats(), [2.0, 0.0, 5.0, 3.0]);
    }

    #[test]
    fn broadcasting_follows_numpy() {
        assert_eq!(broadcast_shapes(&[4, 1], &[3]).unwrap(), [4, 3]);
        assert!(broadcast_shapes(&[4], &[3]).is_err());
        assert_eq!(broadcast_shapes(&[], &[2, 0]).unwrap(), [2, 0]);
    }
}
