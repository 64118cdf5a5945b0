//! Assignment: to names, items, attributes, and several targets at once.
//!
//! A target and a value come in, the scope or the object changes. Imports the evaluator.

use std::rc::Rc;

use ruff_python_ast::{Expr, StmtAugAssign};
use ruff_text_size::Ranged;

use super::error::{Fault, Raised};
use super::eval::{Evaluator, Scope};
use super::value::{Module, Value};
use super::{attribute, index, operators};

impl Evaluator {
    /// Assigns a value to a target.
    pub(super) fn assign(&self, target: &Expr, value: Value, scope: &Rc<Scope>) -> Result<(), Raised> {
        match target {
            Expr::Name(name) => {
                scope.set(&name.id, value);
                Ok(())
            }
            Expr::Tuple(t) => self.unpack(&t.elts, &value, scope).map_err(|e| e.at(target.range())),
            Expr::List(t) => self.unpack(&t.elts, &value, scope).map_err(|e| e.at(target.range())),
            Expr::Subscript(t) => {
                let (owner, at) = (self.expr(&t.value, scope)?, self.expr(&t.slice, scope)?);
                index::set(self, &owner, &at, value).map_err(|f| Raised::from(f).at(target.range()))
            }
            Expr::Attribute(t) => {
                let owner = self.expr(&t.value, scope)?;
                if let Value::Module(Module::Pictures) = owner {
                    return Ok(());
                }
                let name = t.attr.as_str();
                Err(attribute::refuse_assignment(&owner, name).into())
            }
            _ => Err(Fault::Syntax("this cannot be assigned to".into()).into()),
        }
    }

    fn unpack(&self, targets: &[Expr], value: &Value, scope: &Rc<Scope>) -> Result<(), Raised> {
        let mut items = match value {
            // `fig, ax = plt.subplots()`
            Value::Module(Module::Pictures) => vec![value.clone(); targets.len()],
            _ => self.collect(value)?,
        };
        let star = targets.iter().position(|t| matches!(t, Expr::Starred(_)));
        let enough =
            if star.is_some() { items.len() + 1 >= targets.len() } else { items.len() == targets.len() };
        if !enough {
            let wanted = targets.len() - usize::from(star.is_some());
            return Err(Fault::value(format!("{wanted} targets for {} values", items.len())).into());
        }
        if let Some(at) = star {
            let count = items.len() + 1 - targets.len();
            let middle = items.splice(at..at + count, [Value::None]).collect();
            items[at] = Value::list(middle);
        }
        for (target, item) in targets.iter().zip(items) {
            let target = if let Expr::Starred(s) = target { &*s.value } else { target };
            self.assign(target, item, scope)?;
        }
        Ok(())
    }

    /// `target op= value`. Arrays and lists change in place, so that other names for them see it.
    pub(super) fn augment(&self, s: &StmtAugAssign, scope: &Rc<Scope>) -> Result<(), Raised> {
        let apply = |old: Value, value: &Value| -> Result<Value, Fault> {
            match (&old, value) {
                (Value::Array(a), _) => {
                    operators::in_place(&self.budget, s.op, a, value)?;
                    Ok(old)
                }
                (Value::List(items), _) if s.op == ruff_python_ast::Operator::Add => {
                    let more = self.collect(value)?;
                    self.budget.allocate_items(items.0.borrow().len() + more.len())?;
                    items.0.borrow_mut().extend(more);
                    items.measure();
                    Ok(old)
                }
                (Value::Dict(dict), Value::Dict(more)) if s.op == ruff_python_ast::Operator::BitOr => {
                    let more = more.0.borrow().entries().to_vec();
                    self.budget.allocate(more.len())?;
                    more.into_iter().try_for_each(|(k, v)| dict.0.borrow_mut().insert(&k, v).map(drop))?;
                    Ok(old)
                }
                _ => operators::binary(&self.budget, s.op, &old, value),
            }
        };
        match &*s.target {
            Expr::Subscript(t) => {
                let (owner, at) = (self.expr(&t.value, scope)?, self.expr(&t.slice, scope)?);
                let old = index::get(self, &owner, &at)?;
                let new = apply(old, &self.expr(&s.value, scope)?)?;
                Ok(index::set(self, &owner, &at, new)?)
            }
            target => {
                let old = self.expr(target, scope)?;
                let new = apply(old, &self.expr(&s.value, scope)?)?;
                self.assign(target, new, scope)
            }
        }
    }

    /// `del target`.
    pub(super) fn delete(&self, target: &Expr, scope: &Rc<Scope>) -> Result<(), Raised> {
        match target {
            Expr::Name(name) => {
                let old = scope.variables.borrow_mut().remove(name.id.as_str());
                old.map(drop).ok_or_else(|| {
                    Raised::from(Fault::UnknownName { name: name.id.to_string(), hint: None })
                        .at(target.range())
                })
            }
            Expr::Subscript(t) => {
                let (owner, at) = (self.expr(&t.value, scope)?, self.expr(&t.slice, scope)?);
                self.budget.charge(owner.extent())?;
                index::delete(&owner, &at).map_err(|f| Raised::from(f).at(target.range()))
            }
            Expr::Tuple(t) => t.elts.iter().try_for_each(|one| self.delete(one, scope)),
            _ => Err(Fault::Syntax("this cannot be deleted".into()).into()),
        }
    }
}
