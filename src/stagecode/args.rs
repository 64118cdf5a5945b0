//! The rows of the function tables, and how the arguments of a call are bound to a row's parameters.
//!
//! A row is a name, a signature in words, and a Rust function. The signature `"a axis? *rest"` has the
//! required parameter `a`, the optional `axis`, and takes further positional arguments as `rest`; `**named` takes
//! further keyword arguments. Imports
//! values, arrays, faults and the evaluator (for rows that call back).

use super::array::Array;
use super::convert;
use super::elementwise::{self, Op};
use super::error::{Fault, Raised};
use super::eval::Evaluator;
use super::scalar::{Dtype, Scalar};
use super::ufunc;
use super::value::Value;

/// What a row runs.
#[derive(Clone, Copy)]
pub enum Run {
    /// Element by element on floats.
    Unary(fn(f64) -> f64),
    /// Element by element on two operands that stretch to each other.
    Binary(Op),
    /// Element by element in a way of its own.
    Each(fn(&Call) -> Result<Value, Fault>),
    /// Anything else.
    Call(fn(&Call) -> Result<Value, Fault>),
    /// A function that runs functions of the code.
    Back(fn(&Call) -> Result<Value, Raised>),
}

/// One function of a table.
pub struct Row {
    /// The name in Python.
    pub name: &'static str,
    /// Parameters, separated by spaces; `?` marks an optional one, `*` the one that takes the rest.
    pub signature: &'static str,
    /// What it runs.
    pub run: Run,
}

impl Row {
    /// A row that computes its value.
    pub const fn new(
        name: &'static str,
        signature: &'static str,
        call: fn(&Call) -> Result<Value, Fault>,
    ) -> Self {
        Self { name, signature, run: Run::Call(call) }
    }

    /// A row that runs functions of the code.
    pub const fn back(
        name: &'static str,
        signature: &'static str,
        call: fn(&Call) -> Result<Value, Raised>,
    ) -> Self {
        Self { name, signature, run: Run::Back(call) }
    }

    /// A row that works on every element as a float.
    pub const fn unary(name: &'static str, f: fn(f64) -> f64) -> Self {
        Self { name, signature: "x out? where? dtype?", run: Run::Unary(f) }
    }

    /// A row that works on pairs of elements.
    pub const fn binary(name: &'static str, op: Op) -> Self {
        Self { name, signature: "x1 x2 out? where? dtype?", run: Run::Binary(op) }
    }

    /// A row that works on every element in a way of its own.
    pub const fn each(name: &'static str, call: fn(&Call) -> Result<Value, Fault>) -> Self {
        Self { name, signature: "x out? where? dtype?", run: Run::Each(call) }
    }
}

/// Positional and keyword arguments as the call gave them.
#[derive(Default)]
pub struct Arguments {
    /// In order.
    pub positional: Vec<Value>,
    /// By name.
    pub keyword: Vec<(String, Value)>,
}

/// A call with its arguments bound to a row's parameters.
pub struct Call<'a> {
    /// For the budget, and for calling back.
    pub eval: &'a Evaluator,
    /// The function's name.
    pub name: &'static str,
    parameters: Vec<&'static str>,
    slots: Vec<Option<Value>>,
    /// Further positional arguments, where the signature takes them.
    pub rest: Vec<Value>,
    /// Further keyword arguments, where the signature takes them.
    pub named: Vec<(String, Value)>,
}

impl Row {
    /// Binds the arguments and runs the row.
    pub fn call(&'static self, eval: &Evaluator, arguments: Arguments) -> Result<Value, Raised> {
        let call = Call::bind(eval, self, arguments)?;
        match self.run {
            Run::Unary(f) => Ok(ufunc::put(&call, elementwise::unary(&eval.budget, f, &call.array(0)?)?, 1)?),
            Run::Binary(op) => {
                let made = elementwise::binary_values(&eval.budget, op, call.get(0)?, call.get(1)?)?;
                Ok(ufunc::put(&call, made, 2)?)
            }
            Run::Each(f) => Ok(ufunc::put(&call, f(&call)?, 1)?),
            Run::Call(f) => Ok(f(&call)?),
            Run::Back(f) => {
                // Functions that run functions can be put into each other without end.
                eval.budget.enter()?;
                let value = f(&call);
                eval.budget.leave();
                value
            }
        }
    }
}

impl<'a> Call<'a> {
    fn bind(eval: &'a Evaluator, row: &'static Row, arguments: Arguments) -> Result<Self, Fault> {
        let mut parameters: Vec<&'static str> = row.signature.split_whitespace().collect();
        let takes_named = parameters.pop_if(|p| p.starts_with("**")).is_some();
        let takes_rest = parameters.iter().position(|p| p.starts_with('*'));
        let plain = takes_rest.unwrap_or(parameters.len());
        let slots = vec![None; parameters.len()];
        let mut call = Self { eval, name: row.name, slots, parameters, rest: Vec::new(), named: Vec::new() };
        for (at, value) in arguments.positional.into_iter().enumerate() {
            if at < plain {
                call.slots[at] = Some(value);
            } else if takes_rest.is_some() {
                call.rest.push(value);
            } else {
                return Err(call.problem(format!("takes at most {plain} arguments")));
            }
        }
        for (name, value) in arguments.keyword {
            let at = call.parameters.iter().position(|p| p.trim_end_matches('?') == name);
            match at.and_then(|at| call.slots.get_mut(at)) {
                Some(slot @ None) => *slot = Some(value),
                Some(_) => return Err(call.problem(format!("got `{name}` twice"))),
                None if takes_named => call.named.push((name, value)),
                None => {
                    let taken: Vec<&str> = call.parameters.iter().map(|p| p.trim_end_matches('?')).collect();
                    let taken = taken.join(", ");
                    return Err(
                        call.problem(format!("the argument `{name}` is not supported; it takes {taken}"))
                    );
                }
            }
        }
        let missing = |(p, slot): (&&'static str, &Option<Value>)| {
            slot.is_none() && !p.ends_with('?') && !p.starts_with('*')
        };
        if let Some((name, _)) = call.parameters.iter().zip(&call.slots).find(|&(p, s)| missing((p, s))) {
            return Err(call.problem(format!("the argument `{name}` is missing")));
        }
        Ok(call)
    }

    /// A fault about this call's arguments.
    pub fn problem(&self, problem: impl Into<String>) -> Fault {
        Fault::Arguments { function: self.name.into(), problem: problem.into() }
    }

    /// A fault about the argument at `at`.
    fn wrong(&self, at: usize, wanted: &str, got: &Value) -> Fault {
        let name = self.parameters[at].trim_end_matches('?');
        self.problem(format!("`{name}` must be {wanted}, not {}", got.type_name()))
    }

    /// The argument, if it was given and is not `None`.
    pub fn opt(&self, at: usize) -> Option<&Value> {
        self.slots.get(at)?.as_ref().filter(|v| !matches!(v, Value::None))
    }

    /// The argument, given or a fault.
    pub fn get(&self, at: usize) -> Result<&Value, Fault> {
        self.slots
            .get(at)
            .and_then(Option::as_ref)
            .ok_or_else(|| self.problem(format!("argument {} is missing", at + 1)))
    }

    /// The argument as an array.
    pub fn array(&self, at: usize) -> Result<Array, Fault> {
        convert::to_array(&self.eval.budget, self.get(at)?, None)
    }

    /// The argument as floats.
    pub fn floats(&self, at: usize) -> Result<Vec<f64>, Fault> {
        let array = self.array(at)?;
        self.eval.budget.charge(array.size())?;
        Ok(array.to_floats())
    }

    /// The argument as one number.
    pub fn scalar(&self, at: usize) -> Result<Scalar, Fault> {
        let value = self.get(at)?;
        value.as_scalar().ok_or_else(|| self.wrong(at, "a number", value))
    }

    /// The argument as a float.
    pub fn float(&self, at: usize) -> Result<f64, Fault> {
        Ok(self.scalar(at)?.float())
    }

    /// The argument as a float, or a default.
    pub fn float_or(&self, at: usize, default: f64) -> Result<f64, Fault> {
        if self.opt(at).is_some() { self.float(at) } else { Ok(default) }
    }

    /// The argument as an integer; a float is a fault, as in Python.
    pub fn int(&self, at: usize) -> Result<i64, Fault> {
        let value = self.get(at)?;
        value.as_int().ok_or_else(|| self.wrong(at, "an integer", value))
    }

    /// The argument as an integer, or a default.
    pub fn int_or(&self, at: usize, default: i64) -> Result<i64, Fault> {
        if self.opt(at).is_some() { self.int(at) } else { Ok(default) }
    }

    /// The argument as a count.
    pub fn count(&self, at: usize) -> Result<usize, Fault> {
        usize::try_from(self.int(at)?).map_err(|_| self.problem("a count must not be negative"))
    }

    /// The argument as a truth value, or a default.
    pub fn flag(&self, at: usize, default: bool) -> Result<bool, Fault> {
        self.opt(at).map_or(Ok(default), Value::truth)
    }

    /// The argument as text.
    pub fn text(&self, at: usize) -> Result<&str, Fault> {
        match self.get(at)? {
            Value::Str(s) => Ok(s),
            other => Err(self.wrong(at, "text", other)),
        }
    }

    /// The argument as an axis of an array with `ndim` axes; `None` if it was not given.
    pub fn axis(&self, at: usize, ndim: usize) -> Result<Option<usize>, Fault> {
        self.opt(at).map(|_| self.int(at).and_then(|axis| normalize_axis(axis, ndim))).transpose()
    }

    /// The argument as a shape: an integer or a sequence of them.
    pub fn shape(&self, at: usize) -> Result<Vec<usize>, Fault> {
        convert::to_shape(self.get(at)?)
    }

    /// The argument as an element type, if it was given.
    pub fn dtype(&self, at: usize) -> Result<Option<Dtype>, Fault> {
        self.opt(at).map(convert::to_dtype).transpose()
    }

    /// The argument as a sequence of values: the items of a list or tuple, the rows of an array.
    pub fn sequence(&self, at: usize) -> Result<Vec<Value>, Fault> {
        self.eval.collect(self.get(at)?)
    }
}

/// An axis counted from the front.
pub fn normalize_axis(axis: i64, ndim: usize) -> Result<usize, Fault> {
    let n = ndim as i64;
    let fixed = if axis < 0 { axis.saturating_add(n) } else { axis };
    if (0..n).contains(&fixed) {
        Ok(fixed as usize)
    } else {
        Err(Fault::value(format!("axis {axis} does not exist in an array with {ndim} axes")))
    }
}
