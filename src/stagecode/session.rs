//! A session: one namespace into which blocks of code are run, and from which arrays are read.
//!
//! Blocks come in as text with the line they start on; variables go out as plain numbers. The work is done
//! on a thread with a large stack of its own, so that deep but permitted nesting never exhausts the
//! caller's. Imports the evaluator.

use std::rc::Rc;

use ruff_python_ast::Stmt;

use super::array::Array;
use super::calls::place_of;
use super::convert;
use super::error::CodeError;
use super::eval::{Evaluator, Flow, Scope};
use super::limits::Limits;
use super::scalar::Dtype;
use super::source::Source;
use super::value::Value;

/// Stack of the evaluating thread: [`Limits::depth`] levels take a small part of it.
const STACK_BYTES: usize = 256 << 20;

/// A variable, read out of a session.
#[derive(Clone, Debug, PartialEq)]
pub enum Captured {
    /// Nothing has this name.
    Missing,
    /// An array of numbers in C order.
    Array {
        /// Extent along each axis.
        shape: Vec<usize>,
        /// The elements.
        values: Vec<f64>,
    },
    /// A value of another type, by the type's name.
    Other(String),
}

/// What runs the code of an answer, block after block into one namespace.
pub trait Interpreter {
    /// Runs a block whose first line is line `first_line` of its file and whose lines had `indent`
    /// characters taken off.
    fn run(&mut self, code: &str, first_line: usize, indent: usize) -> Result<(), CodeError>;
    /// The number that a formula such as `4/3 * pi` stands for, worked out without touching the namespace.
    fn formula(&mut self, text: &str) -> Option<f64>;
    /// The variable of a name; a list of points, (x, y, z) each, counts as the array of them.
    fn capture(&mut self, name: &str) -> Captured;
    /// Names of all variables that hold an array of points, (n, 3), in alphabetical order.
    fn clouds(&mut self) -> Vec<String>;
}

/// One namespace and the budget of all code that runs in it.
pub struct Session {
    eval: Evaluator,
}

/// Runs `job` with a fresh session on a thread of its own, and returns what it returns.
pub fn evaluate<T: Send>(limits: &Limits, job: impl FnOnce(&mut Session) -> T + Send) -> T {
    let work = || {
        let mut session = Session { eval: Evaluator::new(limits) };
        let result = job(&mut session);
        session.clear();
        result
    };
    std::thread::scope(|scope| {
        let spawned = std::thread::Builder::new()
            .name("stage code".into())
            .stack_size(STACK_BYTES)
            .spawn_scoped(scope, work);
        match spawned.map(std::thread::ScopedJoinHandle::join) {
            Ok(Ok(result)) => result,
            // A panic is a fault of the evaluator itself: it goes on in the caller.
            Ok(Err(panic)) => std::panic::resume_unwind(panic),
            Err(error) => panic!("the system gives no thread to run the code on: {error}"),
        }
    })
}

impl Session {
    /// Runs a block whose first line is line `first_line` of its file and whose lines had `indent`
    /// characters taken off.
    pub fn run(&mut self, code: &str, first_line: usize, indent: usize) -> Result<(), CodeError> {
        let source = Rc::new(Source::new(code, first_line, indent));
        self.eval.source.replace(source.clone());
        let statements = source.parse(self.eval.budget.limits())?;
        match self.eval.block(&statements, &self.eval.globals) {
            Ok(Flow::Next) => Ok(()),
            Ok(_) => {
                let fault =
                    super::Fault::Syntax("break, continue and return belong in loops and functions".into());
                Err(CodeError { line: first_line, column: indent + 1, fault })
            }
            Err(raised) => {
                let (line, column) = place_of(&self.eval, &raised);
                Err(CodeError { line, column, fault: raised.fault })
            }
        }
    }

    /// The number that a formula such as `4/3 * pi` stands for, worked out without touching the namespace.
    pub fn formula(&self, text: &str) -> Option<f64> {
        let source = Source::new(text, 1, 0);
        let statements = source.parse(self.eval.budget.limits()).ok()?;
        let [Stmt::Expr(statement)] = &statements[..] else { return None };
        let scope = Scope::inside(&self.eval.globals);
        scope.set("pi", Value::float(std::f64::consts::PI));
        Some(self.eval.expr(&statement.value, &scope).ok()?.as_scalar()?.float())
    }

    /// The variable of a name. A list of points counts as the array of them.
    pub fn capture(&self, name: &str) -> Captured {
        match self.eval.globals.variables.borrow().get(name) {
            None => Captured::Missing,
            Some(Value::Array(a)) if a.dtype() != Dtype::Bool => {
                Captured::Array { shape: a.shape().to_vec(), values: a.to_floats() }
            }
            Some(Value::Number(n)) => Captured::Array { shape: Vec::new(), values: vec![n.float()] },
            Some(other) => match self.list_of_points(other) {
                Some(a) => Captured::Array { shape: a.shape().to_vec(), values: a.to_floats() },
                None => Captured::Other(other.type_name().to_owned()),
            },
        }
    }

    /// Names of all variables that hold an array of points, (n, 3), in alphabetical order.
    pub fn clouds(&self) -> Vec<String> {
        let variables = self.eval.globals.variables.borrow();
        let cloud = |v: &Value| matches!(v, Value::Array(a) if a.ndim() == 2 && a.shape()[1] == 3 && a.dtype() != Dtype::Bool);
        let mut names: Vec<String> =
            variables.iter().filter(|(_, v)| cloud(v)).map(|(k, _)| k.clone()).collect();
        names.sort_unstable();
        names
    }

    /// The array of a list of points that `np.array` was not called on.
    fn list_of_points(&self, value: &Value) -> Option<Array> {
        if !matches!(value, Value::List(_) | Value::Tuple(_)) {
            return None;
        }
        let array = convert::to_array(&self.eval.budget, value, None).ok()?;
        (array.ndim() == 2 && array.shape()[1] == 3 && array.dtype() != Dtype::Bool).then_some(array)
    }

    /// Breaks the circles in which functions hold the namespace that holds them.
    fn clear(&mut self) {
        let variables = std::mem::take(&mut *self.eval.globals.variables.borrow_mut());
        drop(variables);
    }
}

impl Interpreter for Session {
    fn run(&mut self, code: &str, first_line: usize, indent: usize) -> Result<(), CodeError> {
        Session::run(self, code, first_line, indent)
    }

    fn formula(&mut self, text: &str) -> Option<f64> {
        Session::formula(self, text)
    }

    fn capture(&mut self, name: &str) -> Captured {
        Session::capture(self, name)
    }

    fn clouds(&mut self) -> Vec<String> {
        Session::clouds(self)
    }
}
