//! The evaluator: what it holds while code runs, and the statements.
//!
//! A syntax tree and a scope come in; variables change, and a [`Flow`] says how the block ended. Nothing
//! reaches outside: there are no files, no network, no imports but those that `imports.rs` lists. Imports everything of
//! `stagecode`.

use std::cell::{Cell, RefCell};
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use ruff_python_ast::{Expr, Stmt, StmtFor, StmtFunctionDef, StmtIf, StmtWhile};
use ruff_text_size::Ranged;

use super::args::Arguments;
use super::builtins;
use super::error::{Fault, Raised};
use super::iterate::Steps;
use super::limits::{Budget, Limits};
use super::random::Random;
use super::source::Source;
use super::value::{Body, Function, Value};

/// Variables, and where to look further.
#[derive(Default)]
pub struct Scope {
    /// Variables of this scope.
    pub variables: RefCell<HashMap<String, Value>>,
    /// The scope around it.
    pub parent: Option<Rc<Scope>>,
    /// Names that a `global` or `nonlocal` statement gave to an outer scope.
    outer: RefCell<HashSet<String>>,
    /// Whether it is a comprehension's, which holds its loop variables alone.
    comprehension: bool,
}

impl Scope {
    /// An empty scope inside another.
    pub fn inside(parent: &Rc<Self>) -> Rc<Self> {
        Rc::new(Self::within(parent, false))
    }

    fn within(parent: &Rc<Self>, comprehension: bool) -> Self {
        let (variables, outer) = Default::default();
        Self { variables, parent: Some(parent.clone()), outer, comprehension }
    }

    /// An empty scope of a comprehension.
    pub fn of_comprehension(parent: &Rc<Self>) -> Rc<Self> {
        Rc::new(Self::within(parent, true))
    }

    /// The scope in which `name := value` binds: the innermost that is no comprehension's.
    pub fn binding(self: &Rc<Self>) -> Rc<Self> {
        let mut scope = self;
        while let (true, Some(parent)) = (scope.comprehension, &scope.parent) {
            scope = parent;
        }
        scope.clone()
    }

    /// The variable's value here or further out.
    pub fn get(&self, name: &str) -> Option<Value> {
        let mut scope = self;
        loop {
            if let Some(value) = scope.variables.borrow().get(name) {
                return Some(value.clone());
            }
            scope = scope.parent.as_deref()?;
        }
    }

    /// Sets a variable: here, or where a `global` statement said.
    pub fn set(&self, name: &str, value: Value) {
        let mut scope = self;
        if self.outer.borrow().contains(name) {
            while let Some(parent) = scope.parent.as_deref() {
                scope = parent;
                if scope.variables.borrow().contains_key(name) {
                    break;
                }
            }
        }
        let old = scope.variables.borrow_mut().insert(name.to_owned(), value);
        drop(old);
    }
}

/// How a block of statements ended.
pub(super) enum Flow {
    /// At its end.
    Next,
    /// At a `break`.
    Break,
    /// At a `continue`.
    Continue,
    /// At a `return`.
    Return(Value),
}

/// The state of one program.
pub struct Evaluator {
    /// What the program may still use.
    pub budget: Budget,
    /// Module-level variables.
    pub globals: Rc<Scope>,
    /// The generator behind `np.random.rand` and its like.
    pub random: Rc<RefCell<Random>>,
    /// The generator behind Python's `random`.
    pub pythons_random: Rc<RefCell<Random>>,
    /// How many generators were made without a seed.
    unseeded: Cell<u64>,
    /// The exceptions whose handlers are running, the innermost last.
    pub(super) handling: RefCell<Vec<Raised>>,
    /// The text that is running.
    pub(super) source: RefCell<Rc<Source>>,
}

impl Evaluator {
    /// A program without variables.
    pub fn new(limits: &Limits) -> Self {
        Self {
            budget: Budget::new(limits),
            globals: Rc::default(),
            random: Rc::new(RefCell::new(Random::legacy(0))),
            pythons_random: Rc::new(RefCell::new(Random::python(0))),
            unseeded: Cell::new(0),
            handling: RefCell::default(),
            source: RefCell::new(Rc::new(Source::new("", 1, 0))),
        }
    }

    /// A seed for a generator that was asked for without one: another for each, the same on every run.
    pub fn next_unseeded(&self) -> u64 {
        self.unseeded.set(self.unseeded.get() + 1);
        self.unseeded.get()
    }

    /// Runs statements one after the other.
    pub(super) fn block(&self, statements: &[Stmt], scope: &Rc<Scope>) -> Result<Flow, Raised> {
        for statement in statements {
            self.budget.charge(1).map_err(|f| Raised::from(f).at(statement.range()))?;
            let flow = self.statement(statement, scope).map_err(|e| e.at(statement.range()))?;
            if !matches!(flow, Flow::Next) {
                return Ok(flow);
            }
        }
        Ok(Flow::Next)
    }

    fn statement(&self, statement: &Stmt, scope: &Rc<Scope>) -> Result<Flow, Raised> {
        match statement {
            Stmt::Expr(s) => drop(self.expr(&s.value, scope)?),
            Stmt::Assign(s) => {
                let value = self.expr(&s.value, scope)?;
                for target in &s.targets {
                    self.assign(target, value.clone(), scope)?;
                }
            }
            Stmt::AnnAssign(s) => {
                if let Some(value) = &s.value {
                    self.assign(&s.target, self.expr(value, scope)?, scope)?;
                }
            }
            Stmt::AugAssign(s) => self.augment(s, scope)?,
            Stmt::Return(s) => {
                let value = s.value.as_deref().map_or(Ok(Value::None), |v| self.expr(v, scope))?;
                return Ok(Flow::Return(value));
            }
            Stmt::If(s) => return self.if_statement(s, scope),
            Stmt::For(s) => return self.for_statement(s, scope),
            Stmt::While(s) => return self.while_statement(s, scope),
            Stmt::FunctionDef(s) => self.define(s, scope)?,
            Stmt::Pass(_) => {}
            Stmt::Break(_) => return Ok(Flow::Break),
            Stmt::Continue(_) => return Ok(Flow::Continue),
            Stmt::Delete(s) => s.targets.iter().try_for_each(|t| self.delete(t, scope))?,
            Stmt::Import(_) | Stmt::ImportFrom(_) => super::imports::import(self, statement, scope)?,
            Stmt::Global(s) => scope.outer.borrow_mut().extend(s.names.iter().map(ToString::to_string)),
            Stmt::Nonlocal(s) => scope.outer.borrow_mut().extend(s.names.iter().map(ToString::to_string)),
            Stmt::Assert(s) => {
                if !self.test(&s.test, scope)? {
                    let text = s.msg.as_deref().map(|m| self.expr(m, scope)).transpose()?;
                    return Err(self.exception("AssertionError", text.as_ref()).into());
                }
            }
            Stmt::Raise(s) => return Err(self.raised(s.exc.as_deref(), scope)?),
            Stmt::Try(s) => return super::exceptions::try_statement(self, s, scope),
            // Nothing is printed and no warning given, so that these change nothing.
            Stmt::With(s) if s.items.iter().all(|item| is_quiet(&item.context_expr)) => {
                return self.block(&s.body, scope);
            }
            _ => return Err(unsupported(statement).into()),
        }
        Ok(Flow::Next)
    }

    /// The fault of a `raise` statement.
    fn raised(&self, exception: Option<&Expr>, scope: &Rc<Scope>) -> Result<Raised, Raised> {
        let Some(exception) = exception else {
            let again = self.handling.borrow().last().cloned();
            let none =
                || self.exception("RuntimeError", Some(&Value::str("there is no exception to raise again")));
            return Ok(again.unwrap_or_else(|| none().into()));
        };
        Ok(match self.expr(exception, scope)? {
            Value::Exception(e) => Fault::Raised { exception: e.0.clone(), message: e.1.clone() }.into(),
            other => return Err(Fault::kind(format!("a {} cannot be raised", other.type_name())).into()),
        })
    }

    fn exception(&self, name: &str, message: Option<&Value>) -> Fault {
        let message = message.map(super::format::text).unwrap_or_default();
        Fault::Raised { exception: name.into(), message }
    }

    fn if_statement(&self, s: &StmtIf, scope: &Rc<Scope>) -> Result<Flow, Raised> {
        if self.test(&s.test, scope)? {
            return self.block(&s.body, scope);
        }
        for clause in &s.elif_else_clauses {
            if clause.test.as_ref().map_or(Ok(true), |test| self.test(test, scope))? {
                return self.block(&clause.body, scope);
            }
        }
        Ok(Flow::Next)
    }

    fn for_statement(&self, s: &StmtFor, scope: &Rc<Scope>) -> Result<Flow, Raised> {
        let steps = Steps::of(&self.expr(&s.iter, scope)?).map_err(|f| Raised::from(f).at(s.iter.range()))?;
        self.budget.charge(steps.cloned_items())?;
        for value in steps {
            self.budget.charge(1)?;
            self.assign(&s.target, value, scope)?;
            match self.block(&s.body, scope)? {
                Flow::Break => return Ok(Flow::Next),
                Flow::Return(value) => return Ok(Flow::Return(value)),
                Flow::Next | Flow::Continue => {}
            }
        }
        self.block(&s.orelse, scope)
    }

    fn while_statement(&self, s: &StmtWhile, scope: &Rc<Scope>) -> Result<Flow, Raised> {
        while self.test(&s.test, scope)? {
            self.budget.charge(1)?;
            match self.block(&s.body, scope)? {
                Flow::Break => return Ok(Flow::Next),
                Flow::Return(value) => return Ok(Flow::Return(value)),
                Flow::Next | Flow::Continue => {}
            }
        }
        self.block(&s.orelse, scope)
    }

    fn define(&self, s: &StmtFunctionDef, scope: &Rc<Scope>) -> Result<(), Raised> {
        if s.is_async {
            return Err(Fault::unsupported("an async function", "write a plain def").into());
        }
        let decorators: Vec<Value> =
            s.decorator_list.iter().map(|d| self.expr(&d.expression, scope)).collect::<Result<_, _>>()?;
        // The body is copied; a definition in a loop pays for its length.
        self.budget.charge(s.range.len().to_usize().saturating_mul(super::expr::TREE_BYTES))?;
        let function = Function {
            name: s.name.to_string(),
            parameters: Some(s.parameters.clone()),
            defaults: self.defaults(&s.parameters, scope)?,
            body: Body::Block(s.body.to_vec()),
            scope: scope.clone(),
            source: self.source.borrow().clone(),
        };
        let mut made = Value::Function(Rc::new(function));
        for decorator in decorators.iter().rev() {
            made = self.call(decorator, Arguments { positional: vec![made], keyword: Vec::new() })?;
        }
        scope.set(&s.name, made);
        Ok(())
    }

    /// The value of a name: a variable, a builtin, or numpy itself.
    pub(super) fn name(&self, name: &str, scope: &Scope) -> Result<Value, Fault> {
        if let Some(value) = scope.get(name).or_else(|| builtins::named(name)) {
            return Ok(value);
        }
        let mut known: Vec<String> = Vec::new();
        let mut next = Some(scope);
        while let Some(scope) = next {
            known.extend(scope.variables.borrow().keys().cloned());
            next = scope.parent.as_deref();
        }
        known.sort_unstable();
        let near = super::nearest::nearest(name, known.iter().map(String::as_str));
        let hint = near.map_or_else(
            || "define it in this step or in a step before it".to_owned(),
            |near| format!("did you mean `{near}`?"),
        );
        Err(Fault::UnknownName { name: name.into(), hint: Some(hint) })
    }
}

/// Whether a context is `np.errstate(..)`, `np.printoptions(..)` or `warnings.catch_warnings(..)`.
fn is_quiet(context: &Expr) -> bool {
    let Expr::Call(call) = context else { return false };
    let Expr::Attribute(named) = &*call.func else { return false };
    matches!(named.attr.as_str(), "errstate" | "printoptions" | "catch_warnings")
}

fn unsupported(statement: &Stmt) -> Fault {
    match statement {
        Stmt::ClassDef(_) => Fault::unsupported("a class", "use arrays and plain variables"),
        Stmt::With(_) => Fault::unsupported("`with`", "there are no files or contexts; use plain statements"),
        Stmt::Match(_) => Fault::unsupported("`match`", "use if and elif"),
        _ => Fault::unsupported("this statement", "use plain assignments, loops and functions"),
    }
}
