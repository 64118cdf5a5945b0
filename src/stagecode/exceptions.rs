//! `try`, `except` and `finally`, and which clause catches what.
//!
//! A statement comes in, runs, and ends in a flow or in the fault that no clause caught. A used-up limit
//! is caught by nothing. Imports the evaluator and faults.

use std::rc::Rc;

use ruff_python_ast::{ExceptHandler, Expr, StmtTry};

use super::calls::place_of;
use super::error::{Fault, Raised};
use super::eval::{Evaluator, Flow, Scope};
use super::value::Value;

/// The names of exceptions that code may catch or raise.
pub const EXCEPTIONS: &[&str] = &[
    "Exception",
    "BaseException",
    "ValueError",
    "TypeError",
    "IndexError",
    "KeyError",
    "NameError",
    "AttributeError",
    "ZeroDivisionError",
    "ArithmeticError",
    "LookupError",
    "RuntimeError",
    "NotImplementedError",
    "RecursionError",
    "OverflowError",
    "FloatingPointError",
    "AssertionError",
    "StopIteration",
    "ImportError",
    "ModuleNotFoundError",
    "Warning",
    "UserWarning",
    "RuntimeWarning",
    "FutureWarning",
    "DeprecationWarning",
];

/// Runs a `try` statement.
pub(super) fn try_statement(eval: &Evaluator, s: &StmtTry, scope: &Rc<Scope>) -> Result<Flow, Raised> {
    let outcome = match eval.block(&s.body, scope) {
        Ok(Flow::Next) => eval.block(&s.orelse, scope),
        Ok(flow) => Ok(flow),
        Err(raised) => handle(eval, s, raised, scope),
    };
    if matches!(&outcome, Err(e) if e.fault.exception().is_none()) {
        return outcome;
    }
    match eval.block(&s.finalbody, scope)? {
        Flow::Next => outcome,
        flow => Ok(flow),
    }
}

fn handle(eval: &Evaluator, s: &StmtTry, mut raised: Raised, scope: &Rc<Scope>) -> Result<Flow, Raised> {
    let Some(name) = raised.fault.exception().map(str::to_owned) else { return Err(raised) };
    for ExceptHandler::ExceptHandler(handler) in &s.handlers {
        if !handler.type_.as_deref().is_none_or(|wanted| catches(wanted, &name)) {
            continue;
        }
        if let Some(variable) = &handler.name {
            let message = match &raised.fault {
                Fault::Raised { message, .. } => message.clone(),
                other => other.to_string(),
            };
            scope.set(variable, Value::Exception(Rc::new((name.clone(), message))));
        }
        // A bare `raise` in the handler raises the same again, from the place where it came from.
        raised.place = Some(place_of(eval, &raised));
        eval.handling.borrow_mut().push(raised);
        let outcome = eval.block(&handler.body, scope);
        eval.handling.borrow_mut().pop();
        return outcome;
    }
    Err(raised)
}

/// Whether the clause `except wanted` catches an exception of this name.
fn catches(wanted: &Expr, name: &str) -> bool {
    match wanted {
        Expr::Tuple(all) => all.elts.iter().any(|one| catches(one, name)),
        Expr::Attribute(one) => one.attr.as_str() == "LinAlgError" && name == "LinAlgError",
        Expr::Name(one) => is_a(name, &one.id),
        _ => false,
    }
}

/// Whether an exception of this name is one of the class.
pub fn is_a(name: &str, class: &str) -> bool {
    match class {
        // numpy's LinAlgError is a ValueError.
        "ValueError" => matches!(name, "ValueError" | "LinAlgError"),
        "Exception" | "BaseException" => true,
        "ArithmeticError" => {
            matches!(name, "ArithmeticError" | "ZeroDivisionError" | "OverflowError" | "FloatingPointError")
        }
        "ImportError" => matches!(name, "ImportError" | "ModuleNotFoundError"),
        "RuntimeError" => matches!(name, "RuntimeError" | "NotImplementedError" | "RecursionError"),
        "LookupError" => matches!(name, "LookupError" | "IndexError" | "KeyError"),
        other => other == name,
    }
}
