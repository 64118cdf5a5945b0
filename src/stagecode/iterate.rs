//! Going through a value item by item: lists, ranges, the rows of arrays, the keys of dicts.
//!
//! A value comes in, its items come out one at a time, so that a long range costs nothing until it is
//! walked. Imports values, arrays, faults and the evaluator's budget.

use super::array::Array;
use super::error::Fault;
use super::eval::Evaluator;
use super::value::{Iter, Module, Value, range_len};

/// The items of a value, one at a time.
pub enum Steps {
    /// Items held already.
    Items(std::vec::IntoIter<Value>),
    /// Numbers still to be counted: next, step, how many remain.
    Range(i64, i64, usize),
    /// Rows of an array, from the given one.
    Rows(Array, usize),
    /// Items that are handed out once, shared with other users of the iterator.
    Shared(std::rc::Rc<Iter>),
}

impl Steps {
    /// The items of a value, or a fault where it has none.
    pub fn of(value: &Value) -> Result<Self, Fault> {
        Ok(match value {
            Value::List(_) | Value::Tuple(_) => Self::Items(value.items().unwrap_or_default().into_iter()),
            Value::Dict(d) | Value::Set(d) => {
                let keys: Vec<Value> = d.0.borrow().entries().iter().map(|(k, _)| k.clone()).collect();
                Self::Items(keys.into_iter())
            }
            Value::Range(start, stop, step) => Self::Range(*start, *step, range_len(*start, *stop, *step)),
            Value::Array(a) if a.ndim() > 0 => Self::Rows(a.clone(), 0),
            Value::Str(s) => {
                let letters: Vec<Value> = s.chars().map(|c| Value::str(c.to_string())).collect();
                Self::Items(letters.into_iter())
            }
            Value::Iter(iter) => Self::Shared(iter.clone()),
            Value::Module(Module::Pictures) => Self::Items(Vec::new().into_iter()),
            other => return Err(Fault::kind(format!("a {} has no items to go through", other.type_name()))),
        })
    }

    /// How many items were cloned to go through them.
    pub fn cloned_items(&self) -> usize {
        if let Self::Items(items) = self { items.len() } else { 0 }
    }

    /// How many items are left.
    pub fn remaining(&self) -> usize {
        match self {
            Self::Items(items) => items.len(),
            Self::Range(_, _, left) => *left,
            Self::Rows(a, next) => a.shape()[0] - next,
            Self::Shared(iter) => iter.items.len() - iter.next.get(),
        }
    }
}

impl Iterator for Steps {
    type Item = Value;

    fn next(&mut self) -> Option<Value> {
        match self {
            Self::Items(items) => items.next(),
            Self::Range(next, step, left) => {
                *left = left.checked_sub(1)?;
                let value = *next;
                *next = next.wrapping_add(*step);
                Some(Value::int(value))
            }
            Self::Rows(a, next) => {
                let at = *next;
                *next += usize::from(at < a.shape()[0]);
                (at < a.shape()[0]).then(|| Value::array(a.select(0, at)))
            }
            Self::Shared(iter) => {
                let value = iter.items.get(iter.next.get())?.clone();
                iter.next.set(iter.next.get() + 1);
                Some(value)
            }
        }
    }
}

impl Evaluator {
    /// All items of a value, charged before they are made.
    pub fn collect(&self, value: &Value) -> Result<Vec<Value>, Fault> {
        let steps = Steps::of(value)?;
        self.budget.allocate_items(steps.remaining())?;
        Ok(steps.collect())
    }
}
