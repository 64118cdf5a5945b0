//! The values that foreign code computes with.
//!
//! A [`Value`] is cheap to clone: containers and arrays are shared, as in Python. Containers are taken
//! apart without recursion when the last owner goes, so that no nesting can exhaust the stack. Imports
//! arrays, dicts, faults and the rows of the function tables.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use ruff_python_ast::{Expr, Parameters, Stmt};

use super::args::Row;
use super::array::Array;
use super::dict::Dict;
use super::error::Fault;
use super::eval::Scope;
use super::memory::Held;
use super::random::Random;
use super::scalar::{Dtype, Scalar};
use super::source::Source;

/// Anything a variable can hold.
#[derive(Clone)]
pub enum Value {
    /// `None`.
    None,
    /// `...`
    Ellipsis,
    /// A truth value, integer or float, Python's or numpy's.
    Number(Scalar),
    /// `5j`, the number of points in `np.mgrid[0:1:5j]`; no arithmetic.
    Imaginary(f64),
    /// Text.
    Str(Rc<str>),
    /// A numpy array.
    Array(Array),
    /// A list.
    List(Rc<Items>),
    /// A tuple; never changed after it is made.
    Tuple(Rc<Items>),
    /// A dict.
    Dict(Rc<Table>),
    /// A set: the keys of a dict.
    Set(Rc<Table>),
    /// `range(start, stop, step)`.
    Range(i64, i64, i64),
    /// `start:stop:step` between brackets.
    Slice(Rc<[Value; 3]>),
    /// What `zip`, `map` or a generator expression gives: items, each handed out once.
    Iter(Rc<Iter>),
    /// A function that the code defined.
    Function(Rc<Function>),
    /// A row of a function table.
    Builtin(&'static Row),
    /// A row of a method table with the value it belongs to.
    Method(Rc<(Value, &'static Row)>),
    /// A module.
    Module(Module),
    /// An element type such as `np.float64`.
    Dtype(Dtype),
    /// `np.c_`, `np.r_` and their like.
    Indexer(Indexer),
    /// A random generator.
    Random(Rc<RefCell<Random>>),
    /// A type that is good for nothing but its name: that of `None` or of a function, and what `typing` has.
    Type(&'static str),
    /// An exception class or instance: its name and message.
    Exception(Rc<(String, String)>),
}

/// The modules there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Module {
    /// `numpy`
    Numpy,
    /// `numpy.linalg`
    Linalg,
    /// `numpy.random`
    Random,
    /// `math`
    Math,
    /// One of the standard library, by its name.
    Standard(&'static str),
    /// Whatever draws pictures, its functions and what they return: nothing comes of it.
    Pictures,
}

/// The objects of numpy that are used with brackets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Indexer {
    /// `np.c_`: columns.
    Columns,
    /// `np.r_`: rows.
    Rows,
    /// `np.mgrid`: dense grids.
    Mgrid,
    /// `np.ogrid`: open grids.
    Ogrid,
    /// `np.s_`: the index itself.
    Slices,
}

/// A list's or tuple's items.
pub struct Items(pub RefCell<Vec<Value>>, Held);

impl Items {
    fn new(items: Vec<Value>) -> Self {
        let held = Held::new(items.len() * size_of::<Value>());
        Self(RefCell::new(items), held)
    }

    /// Takes note of the length, after it changed.
    pub fn measure(&self) {
        self.1.set(self.0.borrow().len() * size_of::<Value>());
    }
}

/// A dict or set.
pub struct Table(pub RefCell<Dict>);

/// Items handed out one by one.
pub struct Iter {
    /// All of them.
    pub items: Vec<Value>,
    /// How many have gone.
    pub next: Cell<usize>,
    _held: Held,
}

/// A `def` or `lambda`.
pub struct Function {
    /// Its name, or `<lambda>`.
    pub name: String,
    /// The parameters as written.
    pub parameters: Option<Box<Parameters>>,
    /// Values of the defaults, by parameter name.
    pub defaults: Vec<(String, Value)>,
    /// What it runs.
    pub body: Body,
    /// Where free names are looked up.
    pub scope: Rc<Scope>,
    /// The text it stands in, for places of errors.
    pub source: Rc<Source>,
}

/// The body of a function.
pub enum Body {
    /// Of a `def`.
    Block(Vec<Stmt>),
    /// Of a `lambda`.
    Expression(Box<Expr>),
}

impl Value {
    /// A float.
    pub fn float(value: f64) -> Self {
        Self::Number(Scalar::Float(value))
    }

    /// An integer.
    pub fn int(value: i64) -> Self {
        Self::Number(Scalar::Int(value))
    }

    /// A length or count.
    pub fn count(value: usize) -> Self {
        Self::int(i64::try_from(value).unwrap_or(i64::MAX))
    }

    /// A truth value.
    pub fn bool(value: bool) -> Self {
        Self::Number(Scalar::Bool(value))
    }

    /// Text.
    pub fn str(text: impl AsRef<str>) -> Self {
        Self::Str(Rc::from(text.as_ref()))
    }

    /// A list.
    pub fn list(items: Vec<Self>) -> Self {
        Self::List(Rc::new(Items::new(items)))
    }

    /// A tuple.
    pub fn tuple(items: Vec<Self>) -> Self {
        Self::Tuple(Rc::new(Items::new(items)))
    }

    /// A tuple of lengths.
    pub fn shape(shape: &[usize]) -> Self {
        Self::tuple(shape.iter().map(|&n| Self::count(n)).collect())
    }

    /// A dict.
    pub fn dict(dict: Dict) -> Self {
        Self::Dict(Rc::new(Table(RefCell::new(dict))))
    }

    /// A set.
    pub fn set(keys: Dict) -> Self {
        Self::Set(Rc::new(Table(RefCell::new(keys))))
    }

    /// Items to be handed out once.
    pub fn iter(items: Vec<Self>) -> Self {
        let _held = Held::new(items.len() * size_of::<Self>());
        Self::Iter(Rc::new(Iter { items, next: Cell::new(0), _held }))
    }

    /// A float that numpy made.
    pub fn float64(value: f64) -> Self {
        Self::Number(Scalar::Float64(value))
    }

    /// An array, or the number in it where it has no dimensions: numpy's operations return numbers too.
    pub fn array(array: Array) -> Self {
        match array.first() {
            Some(value) if array.ndim() == 0 => Self::Number(value.numpys()),
            _ => Self::Array(array),
        }
    }

    /// The name of its type, for messages and `isinstance`.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::None => "NoneType",
            Self::Ellipsis => "ellipsis",
            Self::Number(Scalar::Bool(_)) => "bool",
            Self::Number(Scalar::Int(_) | Scalar::Int64(_)) => "int",
            Self::Number(Scalar::Float(_) | Scalar::Float64(_)) => "float",
            Self::Imaginary(_) => "complex",
            Self::Str(_) => "str",
            Self::Array(_) => "ndarray",
            Self::List(_) => "list",
            Self::Tuple(_) => "tuple",
            Self::Dict(_) => "dict",
            Self::Set(_) => "set",
            Self::Range(..) => "range",
            Self::Slice(_) => "slice",
            Self::Iter(_) => "iterator",
            Self::Function(_) | Self::Builtin(_) | Self::Method(_) => "function",
            Self::Module(_) => "module",
            Self::Dtype(_) | Self::Type(_) => "type",
            Self::Indexer(_) => "indexer",
            Self::Random(_) => "Generator",
            Self::Exception(_) => "Exception",
        }
    }

    /// Whether it counts as true.
    pub fn truth(&self) -> Result<bool, Fault> {
        Ok(match self {
            Self::None => false,
            Self::Number(n) => n.truth(),
            Self::Str(s) => !s.is_empty(),
            Self::List(v) | Self::Tuple(v) => !v.0.borrow().is_empty(),
            Self::Dict(d) | Self::Set(d) => d.0.borrow().len() > 0,
            Self::Range(a, b, s) => range_len(*a, *b, *s) > 0,
            Self::Array(a) => match (a.size(), a.first()) {
                (1, Some(value)) => value.truth(),
                (0, _) => false,
                _ => {
                    return Err(Fault::value(
                        "an array with several elements has no truth value; use .any() or .all()",
                    ));
                }
            },
            _ => true,
        })
    }

    /// The number, if it is one or an array of exactly one, as Python's.
    pub fn as_scalar(&self) -> Option<Scalar> {
        match self {
            Self::Number(n) => Some(n.plain()),
            Self::Array(a) if a.size() == 1 => a.first(),
            _ => None,
        }
    }

    /// The integer, if it is one (a float is not).
    pub fn as_int(&self) -> Option<i64> {
        match self.as_scalar()? {
            Scalar::Float(_) => None,
            other => Some(other.int()),
        }
    }

    /// How many items a container holds; 0 for anything else.
    pub fn extent(&self) -> usize {
        match self {
            Self::List(v) | Self::Tuple(v) => v.0.borrow().len(),
            Self::Dict(d) | Self::Set(d) => d.0.borrow().len(),
            Self::Array(a) => a.shape().first().copied().unwrap_or(0),
            _ => 0,
        }
    }

    /// A copy of the items of a list or tuple.
    pub fn items(&self) -> Option<Vec<Self>> {
        match self {
            Self::List(v) | Self::Tuple(v) => Some(v.0.borrow().clone()),
            _ => None,
        }
    }
}

/// Number of steps of a range.
pub fn range_len(start: i64, stop: i64, step: i64) -> usize {
    let span =
        if step > 0 { i128::from(stop) - i128::from(start) } else { i128::from(start) - i128::from(stop) };
    let stride = i128::from(step).abs().max(1);
    usize::try_from((span.max(0) + stride - 1) / stride).unwrap_or(usize::MAX)
}

thread_local! {
    /// Values whose owner has gone; `None` while nothing is being taken apart.
    static GRAVEYARD: RefCell<Option<Vec<Value>>> = const { RefCell::new(None) };
}

/// Drops values one after the other: containers met on the way add theirs to the queue, not to the stack.
fn bury(values: Vec<Value>) {
    let first = GRAVEYARD.with(|g| match g.borrow_mut().as_mut() {
        Some(queue) => {
            queue.extend(values);
            None
        }
        None => Some(values),
    });
    let Some(values) = first else { return };
    GRAVEYARD.with(|g| *g.borrow_mut() = Some(values));
    while let Some(value) = GRAVEYARD.with(|g| g.borrow_mut().as_mut().and_then(Vec::pop)) {
        drop(value);
    }
    GRAVEYARD.with(|g| *g.borrow_mut() = None);
}

impl Drop for Items {
    fn drop(&mut self) {
        bury(std::mem::take(self.0.get_mut()));
    }
}

impl Drop for Table {
    fn drop(&mut self) {
        bury(self.0.get_mut().take_values());
    }
}

impl Drop for Iter {
    fn drop(&mut self) {
        bury(std::mem::take(&mut self.items));
    }
}

impl Drop for Scope {
    fn drop(&mut self) {
        bury(self.variables.get_mut().drain().map(|(_, value)| value).collect());
    }
}

impl Drop for Function {
    fn drop(&mut self) {
        bury(self.defaults.drain(..).map(|(_, value)| value).collect());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_nested_lists_are_dropped_without_recursion() {
        let mut value = Value::None;
        for _ in 0..1_000_000 {
            value = Value::list(vec![value]);
        }
        drop(value);
    }

    #[test]
    fn range_lengths_do_not_overflow() {
        assert_eq!(range_len(0, 10, 3), 4);
        assert_eq!(range_len(10, 0, -3), 4);
        assert_eq!(range_len(i64::MIN, i64::MAX, 1), usize::MAX);
    }
}
