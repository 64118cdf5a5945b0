//! Methods of dicts and sets, and the `dict` builtin.
//!
//! Each row takes the dict or set as its first argument. Imports arguments, dicts, faults, values.

use super::args::{Call, Row};
use super::dict::{Dict, Key};
use super::error::Fault;
use super::value::{Table, Value};

/// Methods of dicts.
pub const DICT: &[Row] = &[
    Row::new("keys", "self", |c| parts(c, |k, _| k.clone())),
    Row::new("values", "self", |c| parts(c, |_, v| v.clone())),
    Row::new("items", "self", |c| parts(c, |k, v| Value::tuple(vec![k.clone(), v.clone()]))),
    Row::new("get", "self key default?", |c| {
        let found = table(c)?.0.borrow().get(&Key::of(c.get(1)?)?).cloned();
        Ok(found.or_else(|| c.opt(2).cloned()).unwrap_or(Value::None))
    }),
    Row::new("setdefault", "self key default?", |c| {
        let found = table(c)?.0.borrow().get(&Key::of(c.get(1)?)?).cloned();
        if let Some(value) = found {
            return Ok(value);
        }
        let value = c.opt(2).cloned().unwrap_or(Value::None);
        c.eval.budget.charge(1)?;
        table(c)?.0.borrow_mut().insert(c.get(1)?, value.clone())?;
        Ok(value)
    }),
    Row::new("pop", "self key default?", |c| {
        c.eval.budget.charge(c.get(0)?.extent())?;
        let found = table(c)?.0.borrow_mut().remove(&Key::of(c.get(1)?)?);
        found
            .or_else(|| c.get(2).ok().cloned())
            .ok_or_else(|| Fault::Key(super::format::repr(c.get(1).unwrap_or(&Value::None))))
    }),
    Row::new("update", "self other? **named", |c| {
        let mut entries = match c.opt(1) {
            None => Vec::new(),
            Some(Value::Dict(other)) => other.0.borrow().entries().to_vec(),
            Some(_) => return Err(c.problem("takes a dict")),
        };
        entries.extend(c.named.iter().map(|(k, v)| (Value::str(k.clone()), v.clone())));
        c.eval.budget.allocate_items(entries.len())?;
        entries.into_iter().try_for_each(|(k, v)| table(c)?.0.borrow_mut().insert(&k, v).map(drop))?;
        Ok(Value::None)
    }),
    Row::new("clear", "self", clear),
    Row::new("most_common", "self n?", |c| {
        let mut entries = table(c)?.0.borrow().entries().to_vec();
        c.eval.budget.allocate_items(entries.len())?;
        entries.sort_by_key(|(_, count)| std::cmp::Reverse(count.as_int()));
        entries.truncate(if c.opt(1).is_some() { c.count(1)? } else { usize::MAX });
        Ok(Value::list(entries.into_iter().map(|(k, v)| Value::tuple(vec![k, v])).collect()))
    }),
    Row::new("copy", "self", |c| {
        let entries = table(c)?.0.borrow().entries().to_vec();
        c.eval.budget.allocate_items(entries.len())?;
        made(entries).map(Value::dict)
    }),
];

/// Methods of sets.
pub const SET: &[Row] = &[
    Row::new("add", "self item", |c| {
        c.eval.budget.charge(1)?;
        table(c)?.0.borrow_mut().insert(c.get(1)?, Value::None)?;
        Ok(Value::None)
    }),
    Row::new("remove", "self item", |c| {
        c.eval.budget.charge(c.get(0)?.extent())?;
        let old = table(c)?.0.borrow_mut().remove(&Key::of(c.get(1)?)?);
        old.map(|_| Value::None)
            .ok_or_else(|| Fault::Key(super::format::repr(c.get(1).unwrap_or(&Value::None))))
    }),
    Row::new("update", "self *others", |c| {
        for other in &c.rest {
            for item in c.eval.collect(other)? {
                table(c)?.0.borrow_mut().insert(&item, Value::None)?;
            }
        }
        Ok(Value::None)
    }),
    Row::new("clear", "self", clear),
    Row::new("copy", "self", |c| set_operation(c, ruff_python_ast::Operator::BitOr)),
    Row::new("issubset", "self other", |c| contains_all(c, &super::expr::keys(c.sequence(1)?)?, c.get(0)?)),
    Row::new("issuperset", "self other", |c| contains_all(c, c.get(0)?, &super::expr::keys(c.sequence(1)?)?)),
    Row::new("isdisjoint", "self other", |c| {
        set_operation(c, ruff_python_ast::Operator::BitAnd)?.truth().map(|shared| Value::bool(!shared))
    }),
    Row::new("symmetric_difference", "self other", |c| set_operation(c, ruff_python_ast::Operator::BitXor)),
    Row::new("discard", "self item", |c| {
        c.eval.budget.charge(c.get(0)?.extent())?;
        let old = table(c)?.0.borrow_mut().remove(&Key::of(c.get(1)?)?);
        drop(old);
        Ok(Value::None)
    }),
    Row::new("union", "self other", |c| set_operation(c, ruff_python_ast::Operator::BitOr)),
    Row::new("intersection", "self other", |c| set_operation(c, ruff_python_ast::Operator::BitAnd)),
    Row::new("difference", "self other", |c| set_operation(c, ruff_python_ast::Operator::Sub)),
];

fn table<'a>(c: &'a Call) -> Result<&'a Table, Fault> {
    match c.get(0)? {
        Value::Dict(table) | Value::Set(table) => Ok(table),
        other => Err(c.problem(format!("does not work on a {}", other.type_name()))),
    }
}

/// A dict of entries.
pub fn made(entries: Vec<(Value, Value)>) -> Result<Dict, Fault> {
    let mut dict = Dict::default();
    entries.into_iter().try_for_each(|(k, v)| dict.insert(&k, v).map(drop))?;
    Ok(dict)
}

/// Keys, values or both as a list, in order.
fn parts(c: &Call, f: fn(&Value, &Value) -> Value) -> Result<Value, Fault> {
    let table = table(c)?.0.borrow();
    c.eval.budget.allocate_items(table.len())?;
    Ok(Value::list(table.entries().iter().map(|(k, v)| f(k, v)).collect()))
}

fn clear(c: &Call) -> Result<Value, Fault> {
    let old = table(c)?.0.borrow_mut().take_values();
    drop(old);
    Ok(Value::None)
}

/// Whether the first set holds every key of the second.
fn contains_all(c: &Call, whole: &Value, part: &Value) -> Result<Value, Fault> {
    let rest = super::operators::binary(&c.eval.budget, ruff_python_ast::Operator::Sub, part, whole)?;
    rest.truth().map(|left_over| Value::bool(!left_over))
}

fn set_operation(c: &Call, op: ruff_python_ast::Operator) -> Result<Value, Fault> {
    let other = super::expr::keys(if c.get(1).is_ok() { c.sequence(1)? } else { Vec::new() })?;
    super::operators::binary(&c.eval.budget, op, c.get(0)?, &other)
}

/// `dict()` of another dict or of pairs, and of keyword arguments.
pub fn dict(c: &Call) -> Result<Value, Fault> {
    made(pairs(c, 0)?).map(Value::dict)
}

/// The entries of the dict or the pairs at `at`, and those given by keyword; charged.
pub fn pairs(c: &Call, at: usize) -> Result<Vec<(Value, Value)>, Fault> {
    let mut entries: Vec<(Value, Value)> = match c.opt(at) {
        None => Vec::new(),
        Some(Value::Dict(other)) => other.0.borrow().entries().to_vec(),
        Some(_) => c
            .sequence(at)?
            .iter()
            .map(|pair| match pair.items().as_deref() {
                Some([key, value]) => Ok((key.clone(), value.clone())),
                _ => Err(c.problem("takes pairs of key and value")),
            })
            .collect::<Result<_, _>>()?,
    };
    entries.extend(c.named.iter().map(|(k, v)| (Value::str(k.clone()), v.clone())));
    c.eval.budget.allocate_items(entries.len())?;
    Ok(entries)
}
