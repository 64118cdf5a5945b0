//! Brackets: reading, writing and deleting items of lists, dicts, text and arrays.
//!
//! A container and an index value come in, an item (or a view) goes out. Array indices are `array_index`'s.
//! Imports the evaluator's budget, values, arrays, faults.

use super::args::Arguments;
use super::array_index;
use super::dict::Key;
use super::error::Fault;
use super::eval::Evaluator;
use super::numpy_grid;
use super::scalar::Scalar;
use super::value::{Module, Value, range_len};

/// `owner[at]`.
pub fn get(eval: &Evaluator, owner: &Value, at: &Value) -> Result<Value, Fault> {
    match owner {
        Value::Array(a) => array_index::get(&eval.budget, a, at),
        // `a[()]` and `a[...]` of an array without dimensions.
        Value::Number(_)
            if matches!(at, Value::Ellipsis) || matches!(at.items(), Some(none) if none.is_empty()) =>
        {
            Ok(owner.clone())
        }
        Value::List(items) | Value::Tuple(items) => {
            let items = items.0.borrow();
            if let Value::Slice(parts) = at {
                let picked = slice_positions(parts, items.len())?;
                eval.budget.allocate_items(picked.len())?;
                let picked = picked.iter().map(|i| items[i].clone()).collect();
                return Ok(if matches!(owner, Value::List(_)) {
                    Value::list(picked)
                } else {
                    Value::tuple(picked)
                });
            }
            Ok(items[position(at, items.len(), owner.type_name())?].clone())
        }
        Value::Dict(dict) => {
            let (found, default) =
                (dict.0.borrow().get(&Key::of(at)?).cloned(), dict.0.borrow().default.clone());
            match (found, default) {
                (Some(value), _) => Ok(value),
                (None, Some(number @ Value::Number(_))) => Ok(number),
                (None, Some(factory)) => {
                    let made = eval.call(&factory, Arguments::default()).map_err(|raised| raised.fault)?;
                    set(eval, owner, at, made.clone())?;
                    Ok(made)
                }
                (None, None) => Err(Fault::Key(super::format::repr(at))),
            }
        }
        Value::Str(s) => text_item(eval, s, at),
        Value::Range(start, stop, step) => {
            let count = range_len(*start, *stop, *step);
            match at {
                Value::Slice(parts) => {
                    let picked = slice_positions(parts, count)?;
                    eval.budget.allocate_items(picked.len())?;
                    let item = |i: usize| Value::int(start.wrapping_add(step.wrapping_mul(i as i64)));
                    Ok(Value::list(picked.iter().map(item).collect()))
                }
                _ => Ok(Value::int(
                    start.wrapping_add(step.wrapping_mul(position(at, count, "range")? as i64)),
                )),
            }
        }
        Value::Indexer(kind) => numpy_grid::indexer(eval, *kind, at),
        // `list[float]` and the like stand in annotations.
        Value::Builtin(_) | Value::Type(_) | Value::Module(Module::Pictures) => Ok(owner.clone()),
        other => Err(Fault::kind(format!("a {} has no items to take by index", other.type_name()))),
    }
}

fn text_item(eval: &Evaluator, s: &str, at: &Value) -> Result<Value, Fault> {
    eval.budget.text(s.len())?;
    let letters: Vec<char> = s.chars().collect();
    Ok(match at {
        Value::Slice(parts) => {
            Value::str(slice_positions(parts, letters.len())?.iter().map(|i| letters[i]).collect::<String>())
        }
        _ => Value::str(letters[position(at, letters.len(), "text")?].to_string()),
    })
}

/// `owner[at] = value`.
pub fn set(eval: &Evaluator, owner: &Value, at: &Value, value: Value) -> Result<(), Fault> {
    match owner {
        Value::Array(a) => array_index::set(&eval.budget, a, at, &value),
        Value::List(items) => {
            if let Value::Slice(parts) = at {
                return set_slice(eval, items, parts, &value);
            }
            let at = position(at, items.0.borrow().len(), "list")?;
            let old = std::mem::replace(&mut items.0.borrow_mut()[at], value);
            drop(old);
            Ok(())
        }
        Value::Dict(dict) => {
            eval.budget.charge(1)?;
            dict.0.borrow_mut().insert(at, value).map(drop)
        }
        Value::Module(Module::Pictures) => Ok(()),
        other => Err(Fault::kind(format!("items of a {} cannot be set", other.type_name()))),
    }
}

fn set_slice(
    eval: &Evaluator,
    items: &super::value::Items,
    parts: &[Value; 3],
    value: &Value,
) -> Result<(), Fault> {
    let new = eval.collect(value)?;
    let length = items.0.borrow().len();
    let picked = slice_positions(parts, length)?;
    if picked.step != 1 {
        return Err(Fault::unsupported(
            "assigning to a stepped slice of a list",
            "use a numpy array or a loop",
        ));
    }
    eval.budget.allocate_items(length + new.len())?;
    let start = picked.start.min(length);
    let old: Vec<Value> = items.0.borrow_mut().splice(start..start + picked.len(), new).collect();
    items.measure();
    drop(old);
    Ok(())
}

/// `del owner[at]`.
pub fn delete(owner: &Value, at: &Value) -> Result<(), Fault> {
    match owner {
        Value::List(items) => {
            let length = items.0.borrow().len();
            let mut places: Vec<usize> = match at {
                Value::Slice(parts) => slice_positions(parts, length)?.iter().collect(),
                _ => vec![position(at, length, "list")?],
            };
            places.sort_unstable();
            let mut gone = places.into_iter().peekable();
            let mut old = Vec::new();
            let all = std::mem::take(&mut *items.0.borrow_mut());
            for (at, item) in all.into_iter().enumerate() {
                let kept = gone.next_if_eq(&at).is_none();
                if kept { items.0.borrow_mut().push(item) } else { old.push(item) }
            }
            items.measure();
            drop(old);
            Ok(())
        }
        Value::Dict(dict) => {
            let old = dict.0.borrow_mut().remove(&Key::of(at)?);
            old.map(drop).ok_or_else(|| Fault::Key(super::format::repr(at)))
        }
        other => Err(Fault::kind(format!("items of a {} cannot be deleted", other.type_name()))),
    }
}

/// The place of an index in a sequence, counted from the front.
pub fn position(at: &Value, length: usize, what: &str) -> Result<usize, Fault> {
    let index = match at.as_scalar() {
        Some(Scalar::Float(_)) | None => {
            return Err(Fault::kind(format!(
                "an index of a {what} must be an integer, not {}",
                at.type_name()
            )));
        }
        Some(n) => n.int(),
    };
    let fixed = if index < 0 { index.saturating_add(length as i64) } else { index };
    usize::try_from(fixed)
        .ok()
        .filter(|&i| i < length)
        .ok_or_else(|| Fault::Index(format!("index {index} is outside a {what} of length {length}")))
}

/// The places that a slice picks.
pub struct Picked {
    /// The first.
    pub start: usize,
    /// From one to the next.
    pub step: isize,
    count: usize,
}

impl Picked {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// One after the other.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.count as isize).map(|i| (self.start as isize + i * self.step) as usize)
    }
}

/// The places that `start:stop:step` picks from `length` items.
pub fn slice_positions(parts: &[Value; 3], length: usize) -> Result<Picked, Fault> {
    let part = |at: usize| match &parts[at] {
        Value::None => Ok(None),
        other => other.as_int().map(Some).ok_or_else(|| Fault::kind("the parts of a slice must be integers")),
    };
    let step = part(2)?.unwrap_or(1);
    if step == 0 {
        return Err(Fault::value("the step of a slice must not be zero"));
    }
    let n = length as i64;
    let (low, high) = if step > 0 { (0, n) } else { (-1, n - 1) };
    let clamp = |index: i64| if index < 0 { index.saturating_add(n) } else { index }.clamp(low, high);
    let start = part(0)?.map_or(if step > 0 { low } else { high }, clamp);
    let stop = part(1)?.map_or(if step > 0 { high } else { low }, clamp);
    let count = range_len(start, stop, step);
    // With at most one place the step does not matter; a huge one would overflow.
    let step = if count > 1 { step as isize } else { 1 };
    Ok(Picked { start: start.max(0) as usize, step, count })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_pick_what_python_picks() {
        let places = |a: Option<i64>, b: Option<i64>, s: Option<i64>| -> Vec<usize> {
            let part = |p: Option<i64>| p.map_or(Value::None, Value::int);
            slice_positions(&[part(a), part(b), part(s)], 5).unwrap().iter().collect()
        };
        assert_eq!(places(None, None, Some(-2)), [4, 2, 0]);
        assert_eq!(places(Some(-2), None, None), [3, 4]);
        assert_eq!(places(Some(9), None, None), Vec::<usize>::new());
        assert_eq!(places(Some(9), Some(1), Some(-1)), [4, 3, 2]);
        assert_eq!(places(Some(i64::MIN), Some(i64::MAX), Some(i64::MAX)), [0]);
    }
}
