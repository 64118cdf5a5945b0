//! Calls: the arguments, functions that the code defined, and everything else that can be called.
//!
//! A callable and arguments come in, its value goes out. Imports the evaluator.

use std::rc::Rc;

use ruff_python_ast::{ExprCall, Parameters};
use ruff_text_size::{Ranged, TextSize};

use super::args::Arguments;
use super::convert;
use super::dict::Dict;
use super::error::{Fault, Raised};
use super::eval::{Evaluator, Flow, Scope};
use super::value::{Body, Function, Module, Value};

impl Evaluator {
    /// The value of a call expression.
    pub(super) fn call_expr(&self, e: &ExprCall, scope: &Rc<Scope>) -> Result<Value, Raised> {
        let function = self.expr(&e.func, scope)?;
        if matches!(&function, Value::Builtin(row) if row.name == "locals") {
            return Ok(super::builtins::variables(self, &scope.binding())?);
        }
        let mut arguments =
            Arguments { positional: self.sequence(&e.arguments.args, scope)?, keyword: Vec::new() };
        for keyword in &e.arguments.keywords {
            let value = self.expr(&keyword.value, scope)?;
            match (&keyword.arg, &value) {
                (Some(name), _) => arguments.keyword.push((name.to_string(), value)),
                (None, Value::Dict(dict)) => {
                    for (name, value) in dict.0.borrow().entries() {
                        let Value::Str(name) = name else { return Err(Fault::kind("** takes names").into()) };
                        arguments.keyword.push((name.to_string(), value.clone()));
                    }
                }
                _ => return Err(Raised::from(Fault::kind("** takes a dict")).at(keyword.range())),
            }
        }
        self.call(&function, arguments)
    }

    /// Calls a value.
    pub fn call(&self, function: &Value, mut arguments: Arguments) -> Result<Value, Raised> {
        match function {
            Value::Builtin(row) => row.call(self, arguments),
            Value::Method(method) => {
                arguments.positional.insert(0, method.0.clone());
                method.1.call(self, arguments)
            }
            Value::Function(function) => self.call_function(function, arguments),
            Value::Module(Module::Pictures) => Ok(function.clone()),
            Value::Dtype(dtype) => {
                let value = arguments.positional.first().cloned().unwrap_or_else(|| Value::int(0));
                Ok(Value::array(convert::to_array(&self.budget, &value, Some(*dtype))?))
            }
            Value::Exception(e) => {
                let message = arguments.positional.first().map(super::format::text).unwrap_or_default();
                Ok(Value::Exception(Rc::new((e.0.clone(), message))))
            }
            other => Err(Fault::kind(format!("a {} cannot be called", other.type_name())).into()),
        }
    }

    fn call_function(&self, function: &Rc<Function>, arguments: Arguments) -> Result<Value, Raised> {
        self.budget.enter()?;
        let outer = self.source.replace(function.source.clone());
        let result = self.run_function(function, arguments);
        // The place is one in the function's own text, which may be another block than the caller's.
        let result = result.map_err(|mut raised| {
            if let (None, Some(range)) = (raised.place, raised.range) {
                raised.place = Some(function.source.place(range.start()));
            }
            raised
        });
        self.source.replace(outer);
        self.budget.leave();
        result
    }

    fn run_function(&self, function: &Rc<Function>, arguments: Arguments) -> Result<Value, Raised> {
        let scope = Scope::inside(&function.scope);
        bind(function, arguments, &scope)?;
        match &function.body {
            Body::Expression(expr) => self.expr(expr, &scope),
            Body::Block(statements) => match self.block(statements, &scope)? {
                Flow::Return(value) => Ok(value),
                _ => Ok(Value::None),
            },
        }
    }

    /// Values of the parameters' defaults, where the function is defined.
    pub(super) fn defaults(&self, p: &Parameters, scope: &Rc<Scope>) -> Result<Vec<(String, Value)>, Raised> {
        let all = p.posonlyargs.iter().chain(&p.args).chain(&p.kwonlyargs);
        all.filter_map(|p| p.default.as_deref().map(|d| (p.name().to_string(), d)))
            .map(|(name, default)| Ok((name, self.expr(default, scope)?)))
            .collect()
    }
}

/// Sets the parameters of a function in its scope.
fn bind(function: &Function, arguments: Arguments, scope: &Scope) -> Result<(), Fault> {
    let problem = |problem: String| Fault::Arguments { function: function.name.clone(), problem };
    let Some(p) = &function.parameters else {
        let none = arguments.positional.is_empty() && arguments.keyword.is_empty();
        return if none { Ok(()) } else { Err(problem("takes no arguments".into())) };
    };
    let mut positional = arguments.positional.into_iter();
    let mut keyword = arguments.keyword;
    for (at, parameter) in p.posonlyargs.iter().chain(&p.args).chain(&p.kwonlyargs).enumerate() {
        let name = parameter.name().as_str();
        let by_position = if at < p.posonlyargs.len() + p.args.len() { positional.next() } else { None };
        let by_name = keyword.iter().position(|(k, _)| k == name).map(|at| keyword.swap_remove(at).1);
        if by_position.is_some() && by_name.is_some() {
            return Err(problem(format!("got `{name}` twice")));
        }
        let default = || function.defaults.iter().find(|(d, _)| d == name).map(|(_, value)| value.clone());
        let value = by_position.or(by_name).or_else(default);
        scope.set(name, value.ok_or_else(|| problem(format!("the argument `{name}` is missing")))?);
    }
    let rest: Vec<Value> = positional.collect();
    match &p.vararg {
        Some(name) => scope.set(name.name(), Value::tuple(rest)),
        None if rest.is_empty() => {}
        None => return Err(problem("got too many arguments".into())),
    }
    match (&p.kwarg, keyword.first()) {
        (Some(name), _) => {
            let mut dict = Dict::default();
            for (key, value) in keyword {
                dict.insert(&Value::str(key), value)?;
            }
            scope.set(name.name(), Value::dict(dict));
        }
        (None, Some((name, _))) => return Err(problem(format!("has no argument `{name}`"))),
        (None, None) => {}
    }
    Ok(())
}

/// Line and column of a fault that reached the top of a block.
pub(super) fn place_of(eval: &Evaluator, raised: &Raised) -> (usize, usize) {
    let start = raised.range.map_or(TextSize::new(0), |range| range.start());
    raised.place.unwrap_or_else(|| eval.source.borrow().place(start))
}
