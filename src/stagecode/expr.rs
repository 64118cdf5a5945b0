//! Expressions: from a node of the syntax tree to a value.
//!
//! Every node is charged before it is evaluated, and a fault is given the place of the innermost node it
//! came from. Imports everything of `stagecode`.

use std::rc::Rc;

use ruff_python_ast::{
    BoolOp, Comprehension, Expr, ExprCompare, ExprFString, ExprLambda, ExprSlice, ExprSubscript, FStringPart,
    InterpolatedStringElement, Number,
};
use ruff_text_size::Ranged;

use super::dict::Dict;
use super::error::{Fault, Raised};
use super::eval::{Evaluator, Scope};
use super::iterate::Steps;
use super::value::{Body, Function, Value};
use super::{attribute, format, index, operators};

/// What a syntax tree takes for a byte of its text, as operations.
pub(super) const TREE_BYTES: usize = 10;

/// What a comprehension does in its innermost loop.
type Each<'a> = dyn FnMut(&Evaluator, &Rc<Scope>) -> Result<(), Raised> + 'a;

impl Evaluator {
    /// The value of an expression.
    pub(super) fn expr(&self, expr: &Expr, scope: &Rc<Scope>) -> Result<Value, Raised> {
        let here = |fault: Fault| Raised::from(fault).at(expr.range());
        self.budget.charge(1).map_err(here)?;
        self.budget.enter().map_err(here)?;
        let value = self.node(expr, scope);
        self.budget.leave();
        value.map_err(|e| e.at(expr.range()))
    }

    fn node(&self, expr: &Expr, scope: &Rc<Scope>) -> Result<Value, Raised> {
        Ok(match expr {
            Expr::Name(e) => self.name(&e.id, scope)?,
            Expr::NumberLiteral(e) => number(&e.value)?,
            Expr::StringLiteral(e) => Value::str(e.value.to_str()),
            Expr::BooleanLiteral(e) => Value::bool(e.value),
            Expr::NoneLiteral(_) => Value::None,
            Expr::EllipsisLiteral(_) => Value::Ellipsis,
            Expr::FString(e) => self.f_string(e, scope)?,
            Expr::BinOp(e) => {
                let (left, right) = (self.expr(&e.left, scope)?, self.expr(&e.right, scope)?);
                operators::binary(&self.budget, e.op, &left, &right)?
            }
            Expr::UnaryOp(e) => operators::unary(&self.budget, e.op, &self.expr(&e.operand, scope)?)?,
            Expr::BoolOp(e) => self.bool_op(e.op, &e.values, scope)?,
            Expr::Compare(e) => self.comparison(e, scope)?,
            Expr::If(e) if self.test(&e.test, scope)? => self.expr(&e.body, scope)?,
            Expr::If(e) => self.expr(&e.orelse, scope)?,
            Expr::Named(e) => {
                let value = self.expr(&e.value, scope)?;
                self.assign(&e.target, value.clone(), &scope.binding())?;
                value
            }
            Expr::Call(e) => self.call_expr(e, scope)?,
            Expr::Attribute(e) => {
                let owner = self.expr(&e.value, scope)?;
                attribute::get(self, &owner, &e.attr)?
            }
            Expr::Subscript(e) => self.subscript(e, scope)?,
            Expr::Slice(e) => self.slice(e, scope)?,
            Expr::List(e) => Value::list(self.sequence(&e.elts, scope)?),
            Expr::Tuple(e) => Value::tuple(self.sequence(&e.elts, scope)?),
            Expr::Set(e) => keys(self.sequence(&e.elts, scope)?)?,
            Expr::Dict(e) => self.dict(&e.items, scope)?,
            Expr::Lambda(e) => self.lambda(e, scope)?,
            Expr::ListComp(e) => Value::list(self.comprehension(&e.elt, &e.generators, scope)?),
            Expr::SetComp(e) => keys(self.comprehension(&e.elt, &e.generators, scope)?)?,
            Expr::Generator(e) => Value::iter(self.comprehension(&e.elt, &e.generators, scope)?),
            Expr::DictComp(e) => self.dict_comprehension(e, scope)?,
            _ => return Err(unsupported(expr).into()),
        })
    }

    /// Whether an expression counts as true.
    pub(super) fn test(&self, expr: &Expr, scope: &Rc<Scope>) -> Result<bool, Raised> {
        self.expr(expr, scope)?.truth().map_err(|f| Raised::from(f).at(expr.range()))
    }

    /// Items of a list or tuple display, with `*more` taken apart.
    pub(super) fn sequence(&self, elements: &[Expr], scope: &Rc<Scope>) -> Result<Vec<Value>, Raised> {
        let mut items = Vec::with_capacity(elements.len());
        for element in elements {
            match element {
                Expr::Starred(e) => {
                    items.extend(self.collect(&self.expr(&e.value, scope)?)?);
                    self.budget.allocate_items(items.len())?;
                }
                _ => items.push(self.expr(element, scope)?),
            }
        }
        Ok(items)
    }

    fn dict(&self, items: &[ruff_python_ast::DictItem], scope: &Rc<Scope>) -> Result<Value, Raised> {
        let mut dict = Dict::default();
        for item in items {
            let value = self.expr(&item.value, scope)?;
            match (&item.key, &value) {
                (Some(key), _) => drop(dict.insert(&self.expr(key, scope)?, value)?),
                (None, Value::Dict(more)) => {
                    for (key, value) in more.0.borrow().entries() {
                        self.budget.charge(1)?;
                        dict.insert(key, value.clone())?;
                    }
                }
                _ => return Err(Fault::kind("** takes a dict").into()),
            }
        }
        Ok(Value::dict(dict))
    }

    fn bool_op(&self, op: BoolOp, values: &[Expr], scope: &Rc<Scope>) -> Result<Value, Raised> {
        let mut last = Value::None;
        for value in values {
            last = self.expr(value, scope)?;
            if last.truth().map_err(|f| Raised::from(f).at(value.range()))? == (op == BoolOp::Or) {
                break;
            }
        }
        Ok(last)
    }

    fn comparison(&self, e: &ExprCompare, scope: &Rc<Scope>) -> Result<Value, Raised> {
        let mut left = self.expr(&e.left, scope)?;
        let mut result = Value::bool(true);
        for (at, (op, right)) in e.ops.iter().zip(&e.comparators).enumerate() {
            let right = self.expr(right, scope)?;
            result = operators::compare(&self.budget, *op, &left, &right)?;
            if at + 1 < e.ops.len() && !result.truth()? {
                break;
            }
            left = right;
        }
        Ok(result)
    }

    fn subscript(&self, e: &ExprSubscript, scope: &Rc<Scope>) -> Result<Value, Raised> {
        let (owner, at) = (self.expr(&e.value, scope)?, self.expr(&e.slice, scope)?);
        Ok(index::get(self, &owner, &at)?)
    }

    /// A slice holds numbers only, so that slices cannot be nested in each other.
    fn slice(&self, e: &ExprSlice, scope: &Rc<Scope>) -> Result<Value, Raised> {
        let part = |part: Option<&Expr>| -> Result<Value, Raised> {
            let Some(part) = part else { return Ok(Value::None) };
            match self.expr(part, scope)? {
                value @ (Value::None | Value::Imaginary(_)) => Ok(value),
                value => value.as_scalar().map(Value::Number).ok_or_else(|| {
                    Raised::from(Fault::kind("the parts of a slice must be integers")).at(part.range())
                }),
            }
        };
        let parts = [part(e.lower.as_deref())?, part(e.upper.as_deref())?, part(e.step.as_deref())?];
        Ok(Value::Slice(Rc::new(parts)))
    }

    fn lambda(&self, e: &ExprLambda, scope: &Rc<Scope>) -> Result<Value, Raised> {
        self.budget.charge(e.range.len().to_usize().saturating_mul(TREE_BYTES))?;
        let defaults = match &e.parameters {
            Some(parameters) => self.defaults(parameters, scope)?,
            None => Vec::new(),
        };
        Ok(Value::Function(Rc::new(Function {
            name: "<lambda>".into(),
            parameters: e.parameters.clone(),
            defaults,
            body: Body::Expression(e.body.clone()),
            scope: scope.clone(),
            source: self.source.borrow().clone(),
        })))
    }

    /// The items of a comprehension, in a scope of its own.
    fn comprehension(
        &self,
        item: &Expr,
        loops: &[Comprehension],
        scope: &Rc<Scope>,
    ) -> Result<Vec<Value>, Raised> {
        let mut out = Vec::new();
        self.run_loops(loops, &Scope::of_comprehension(scope), &mut |eval, inner| {
            eval.budget.grow(out.len())?;
            out.push(eval.expr(item, inner)?);
            Ok(())
        })?;
        Ok(out)
    }

    fn dict_comprehension(
        &self,
        e: &ruff_python_ast::ExprDictComp,
        scope: &Rc<Scope>,
    ) -> Result<Value, Raised> {
        let mut dict = Dict::default();
        let Some(key) = &e.key else {
            return Err(Fault::unsupported("** in a dict comprehension", "use a loop").into());
        };
        self.run_loops(&e.generators, &Scope::of_comprehension(scope), &mut |eval, inner| {
            let key = eval.expr(key, inner)?;
            dict.insert(&key, eval.expr(&e.value, inner)?)?;
            Ok(())
        })?;
        Ok(Value::dict(dict))
    }

    /// Runs the `for` and `if` clauses of a comprehension and `each` in the innermost.
    fn run_loops(
        &self,
        loops: &[Comprehension],
        scope: &Rc<Scope>,
        each: &mut Each<'_>,
    ) -> Result<(), Raised> {
        let Some((first, rest)) = loops.split_first() else { return each(self, scope) };
        let steps =
            Steps::of(&self.expr(&first.iter, scope)?).map_err(|f| Raised::from(f).at(first.iter.range()))?;
        self.budget.charge(steps.cloned_items())?;
        'items: for value in steps {
            self.budget.charge(1)?;
            self.assign(&first.target, value, scope)?;
            for condition in &first.ifs {
                if !self.test(condition, scope)? {
                    continue 'items;
                }
            }
            self.run_loops(rest, scope, each)?;
        }
        Ok(())
    }

    fn f_string(&self, e: &ExprFString, scope: &Rc<Scope>) -> Result<Value, Raised> {
        let mut text = String::new();
        for part in e.value.iter() {
            match part {
                FStringPart::Literal(literal) => text.push_str(literal),
                FStringPart::FString(f) => {
                    f.elements.iter().try_for_each(|element| self.interpolate(element, scope, &mut text))?;
                }
            }
        }
        Ok(Value::str(text))
    }

    fn interpolate(
        &self,
        element: &InterpolatedStringElement,
        scope: &Rc<Scope>,
        text: &mut String,
    ) -> Result<(), Raised> {
        match element {
            InterpolatedStringElement::Literal(literal) => text.push_str(&literal.value),
            InterpolatedStringElement::Interpolation(e) => {
                let value = self.expr(&e.expression, scope)?;
                let mut spec = String::new();
                for element in e.format_spec.iter().flat_map(|s| s.elements.iter()) {
                    self.interpolate(element, scope, &mut spec)?;
                }
                // `{n=}` shows its own text, and the value as `repr` does unless a format is given.
                let debug = e.debug_text.as_ref();
                text.push_str(debug.map_or("", |d| d.as_str()));
                let repr = e.conversion == ruff_python_ast::ConversionFlag::Repr
                    || debug.is_some() && e.format_spec.is_none();
                let shown = if repr { Value::str(format::repr(&value)) } else { value };
                text.push_str(&format::formatted(&shown, &spec).map_err(|f| Raised::from(f).at(e.range()))?);
            }
        }
        Ok(self.budget.text(text.len())?)
    }
}

fn number(number: &Number) -> Result<Value, Fault> {
    match number {
        Number::Int(i) => i.as_i64().map(Value::int).ok_or_else(|| {
            Fault::unsupported("an integer beyond 64 bits", "write it as a float, such as 1e20")
        }),
        Number::Float(f) => Ok(Value::float(*f)),
        Number::Complex { imag, .. } => Ok(Value::Imaginary(*imag)),
    }
}

/// A set of the items.
pub(super) fn keys(items: Vec<Value>) -> Result<Value, Fault> {
    let mut keys = Dict::default();
    for item in items {
        keys.insert(&item, Value::None)?;
    }
    Ok(Value::set(keys))
}

fn unsupported(expr: &Expr) -> Fault {
    match expr {
        Expr::Yield(_) | Expr::YieldFrom(_) => {
            Fault::unsupported("a generator", "collect the items in a list")
        }
        Expr::Await(_) => Fault::unsupported("`await`", "use plain calls"),
        Expr::BytesLiteral(_) => Fault::unsupported("bytes", "use text in quotes"),
        Expr::Starred(_) => Fault::Syntax("a starred expression cannot stand here".into()),
        _ => Fault::unsupported("this expression", "use plain arithmetic, calls and indexing"),
    }
}
