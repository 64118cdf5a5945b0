//! Methods of values: arrays, lists, text, random generators.
//!
//! A value comes in, the rows of its methods go out; each takes the value as its first argument. Most
//! methods of arrays are the numpy functions of the same name. Imports the tables, arguments, faults.

use super::args::{Call, Row};
use super::error::Fault;
use super::scalar::Dtype;
use super::value::Value;
use super::{builtins, convert, methods_dict, numpy, operators, python_random, random_table, ufunc};

/// numpy functions that are methods of arrays too.
const SHARED: &[&str] = &[
    "sum",
    "prod",
    "mean",
    "std",
    "var",
    "min",
    "max",
    "argmin",
    "argmax",
    "any",
    "all",
    "ptp",
    "cumsum",
    "cumprod",
    "reshape",
    "ravel",
    "flatten",
    "transpose",
    "swapaxes",
    "squeeze",
    "repeat",
    "clip",
    "round",
    "argsort",
    "dot",
    "nonzero",
    "copy",
    "trace",
    "searchsorted",
    "take",
    "diagonal",
];

/// Methods that only arrays (and numbers taken from them) have.
const ARRAY: &[Row] = &[
    Row::new("astype", "self dtype order? casting? subok? copy?", |c| {
        let a = c.array(0)?;
        c.eval.budget.allocate(a.size())?;
        Ok(Value::array(a.cast(c.dtype(1)?.unwrap_or(Dtype::F64))))
    }),
    Row::new("tolist", "self", |c| convert::to_list(&c.eval.budget, &c.array(0)?)),
    Row::new("item", "self *args", builtins::item),
    Row::new("fill", "self value", |c| {
        let Value::Array(a) = c.get(0)? else { return Err(c.problem("takes an array")) };
        c.eval.budget.charge(a.size())?;
        a.assign(&c.array(1)?).map(|()| Value::None)
    }),
    Row::new("sort", "self axis?", |c| {
        let Value::Array(a) = c.get(0)? else { return Err(c.problem("takes an array")) };
        let sorted = super::numpy_sort::sorted(c, a, 1)?;
        a.assign(&sorted).map(|()| Value::None)
    }),
    Row::new("compress", "self condition axis?", |c| super::numpy_place::compressed(c, 1, 0)),
    Row::new("is_integer", "self", |c| Ok(Value::bool(c.float(0)?.fract() == 0.0))),
];

const LIST: &[Row] = &[
    Row::new("append", "self item", |c| {
        let Value::List(items) = c.get(0)? else { return Err(c.problem("takes a list")) };
        c.eval.budget.grow(items.0.borrow().len())?;
        items.0.borrow_mut().push(c.get(1)?.clone());
        items.measure();
        Ok(Value::None)
    }),
    Row::new("extend", "self items", |c| {
        let Value::List(items) = c.get(0)? else { return Err(c.problem("takes a list")) };
        let more = c.sequence(1)?;
        c.eval.budget.allocate_items(items.0.borrow().len().saturating_add(more.len()))?;
        items.0.borrow_mut().extend(more);
        items.measure();
        Ok(Value::None)
    }),
    Row::new("insert", "self at item", |c| {
        let Value::List(items) = c.get(0)? else { return Err(c.problem("takes a list")) };
        let n = items.0.borrow().len() as i64;
        c.eval.budget.allocate_items(n as usize + 1)?;
        let at = c.int(1)?;
        let at = if at < 0 { at.saturating_add(n) } else { at }.clamp(0, n);
        items.0.borrow_mut().insert(at as usize, c.get(2)?.clone());
        items.measure();
        Ok(Value::None)
    }),
    Row::new("pop", "self at?", |c| {
        let Value::List(items) = c.get(0)? else { return Err(c.problem("takes a list")) };
        let at = super::index::position(&Value::int(c.int_or(1, -1)?), items.0.borrow().len(), "list")?;
        c.eval.budget.charge(items.0.borrow().len() - at)?;
        let item = items.0.borrow_mut().remove(at);
        items.measure();
        Ok(item)
    }),
    Row::new("remove", "self item", |c| {
        let Value::List(items) = c.get(0)? else { return Err(c.problem("takes a list")) };
        let all = items.0.borrow().clone();
        c.eval.budget.charge(all.len())?;
        for (at, item) in all.iter().enumerate() {
            if operators::equal(&c.eval.budget, item, c.get(1)?, 0)? {
                items.0.borrow_mut().remove(at);
                items.measure();
                return Ok(Value::None);
            }
        }
        Err(Fault::value("the item is not in the list"))
    }),
    Row::new("clear", "self", |c| {
        let Value::List(items) = c.get(0)? else { return Err(c.problem("takes a list")) };
        let old = std::mem::take(&mut *items.0.borrow_mut());
        items.measure();
        drop(old);
        Ok(Value::None)
    }),
    Row::new("reverse", "self", |c| {
        let Value::List(items) = c.get(0)? else { return Err(c.problem("takes a list")) };
        c.eval.budget.charge(items.0.borrow().len())?;
        items.0.borrow_mut().reverse();
        Ok(Value::None)
    }),
    Row::back("sort", "self key? reverse?", |c| {
        let Value::List(items) = c.get(0)? else { return Err(c.problem("takes a list").into()) };
        let sorted = builtins::sort(c, c.sequence(0)?, 1, 2)?;
        let old = std::mem::replace(&mut *items.0.borrow_mut(), sorted);
        items.measure();
        drop(old);
        Ok(Value::None)
    }),
    Row::new("copy", "self", |c| Ok(Value::list(c.sequence(0)?))),
];

/// Methods of lists and tuples.
const SEQUENCE: &[Row] = &[
    Row::new("index", "self item", |c| {
        for (at, item) in c.sequence(0)?.iter().enumerate() {
            if operators::equal(&c.eval.budget, item, c.get(1)?, 0)? {
                return Ok(Value::count(at));
            }
        }
        Err(Fault::value("the item is not in the list"))
    }),
    Row::new("count", "self item", |c| {
        let mut count = 0;
        for item in c.sequence(0)? {
            count += usize::from(operators::equal(&c.eval.budget, &item, c.get(1)?, 0)?);
        }
        Ok(Value::count(count))
    }),
];

const TEXT: &[Row] = &[
    Row::new("upper", "self", |c| text(c, |s| s.to_uppercase())),
    Row::new("lower", "self", |c| text(c, |s| s.to_lowercase())),
    Row::new("strip", "self chars?", |c| stripped(c, true, true)),
    Row::new("lstrip", "self chars?", |c| stripped(c, true, false)),
    Row::new("rstrip", "self chars?", |c| stripped(c, false, true)),
    Row::new("ljust", "self width fillchar?", |c| padded(c, |_, _| 0)),
    Row::new("rjust", "self width fillchar?", |c| padded(c, |missing, _| missing)),
    Row::new("center", "self width fillchar?", |c| {
        padded(c, |missing, width| missing / 2 + (missing & width & 1))
    }),
    Row::new("zfill", "self width", |c| {
        let (s, width) = (c.text(0)?, c.count(1)?);
        c.eval.budget.text(s.len().max(width))?;
        let (sign, digits) = s.split_at(usize::from(s.starts_with(['+', '-'])));
        Ok(Value::str(format!("{sign}{}{digits}", "0".repeat(width.saturating_sub(s.chars().count())))))
    }),
    Row::new("splitlines", "self", |c| {
        c.eval.budget.allocate(c.text(0)?.len())?;
        Ok(Value::list(c.text(0)?.lines().map(Value::str).collect()))
    }),
    Row::new("isalpha", "self", |c| {
        let s = c.text(0)?;
        Ok(Value::bool(!s.is_empty() && s.chars().all(char::is_alphabetic)))
    }),
    Row::new("title", "self", |c| text(c, titled)),
    Row::new("capitalize", "self", |c| {
        text(c, |s| {
            let mut rest = s.chars();
            let first = rest.next().map(|ch| ch.to_uppercase().to_string()).unwrap_or_default();
            first + &rest.as_str().to_lowercase()
        })
    }),
    Row::new("count", "self sub", |c| {
        let (s, part) = (c.text(0)?, c.text(1)?);
        c.eval.budget.text(s.len())?;
        let between = s.chars().count() + 1;
        Ok(Value::count(if part.is_empty() { between } else { s.matches(part).count() }))
    }),
    Row::new("find", "self sub", |c| Ok(place(c)?.map_or(Value::int(-1), Value::count))),
    Row::new("index", "self sub", |c| {
        place(c)?.map(Value::count).ok_or_else(|| Fault::value("the text does not hold that"))
    }),
    Row::new("isdigit", "self", |c| {
        let s = c.text(0)?;
        Ok(Value::bool(!s.is_empty() && s.chars().all(|ch| ch.is_ascii_digit())))
    }),
    Row::new("replace", "self old new", |c| {
        let (s, old, new) = (c.text(0)?, c.text(1)?, c.text(2)?);
        c.eval.budget.text(s.len().saturating_add((s.len() + 1).saturating_mul(new.len())))?;
        Ok(Value::str(s.replace(old, new)))
    }),
    Row::new("split", "self sep?", |c| {
        let s = c.text(0)?;
        c.eval.budget.allocate(s.len())?;
        let parts = match c.opt(1) {
            Some(_) if c.text(1)?.is_empty() => return Err(c.problem("the separator must not be empty")),
            Some(_) => s.split(c.text(1)?).map(Value::str).collect(),
            None => s.split_whitespace().map(Value::str).collect(),
        };
        Ok(Value::list(parts))
    }),
    Row::new("join", "self items", |c| {
        let mut out = String::new();
        for (at, item) in c.sequence(1)?.iter().enumerate() {
            let Value::Str(part) = item else { return Err(c.problem("takes a list of text")) };
            c.eval.budget.text(out.len() + c.text(0)?.len() + part.len())?;
            out.push_str(if at > 0 { c.text(0)? } else { "" });
            out.push_str(part);
        }
        Ok(Value::str(out))
    }),
    Row::new("startswith", "self prefix", |c| Ok(Value::bool(c.text(0)?.starts_with(c.text(1)?)))),
    Row::new("endswith", "self suffix", |c| Ok(Value::bool(c.text(0)?.ends_with(c.text(1)?)))),
    Row::new("format", "self *values **named", |c| {
        let made = super::format::filled(c.text(0)?, &c.rest, &c.named)?;
        c.eval.budget.text(made.len())?;
        Ok(Value::str(made))
    }),
];

/// Every word with a capital, the rest small.
fn titled(s: &str) -> String {
    let mut inside = false;
    s.chars()
        .map(|ch| {
            let first = ch.is_alphabetic() && !inside;
            inside = ch.is_alphabetic();
            if first { ch.to_ascii_uppercase() } else { ch.to_ascii_lowercase() }
        })
        .collect()
}

/// Where a text first holds another, in characters.
fn place(c: &Call) -> Result<Option<usize>, Fault> {
    let s = c.text(0)?;
    c.eval.budget.text(s.len())?;
    Ok(s.find(c.text(1)?).map(|at| s[..at].chars().count()))
}

/// The text without spaces, or without the letters that the second argument lists, at its ends.
fn stripped(c: &Call, left: bool, right: bool) -> Result<Value, Fault> {
    let s = c.text(0)?;
    c.eval.budget.text(s.len())?;
    let chars = if c.opt(1).is_some() { Some(c.text(1)?) } else { None };
    let gone = |ch: char| chars.map_or(ch.is_whitespace(), |chars| chars.contains(ch));
    let s = if left { s.trim_start_matches(gone) } else { s };
    Ok(Value::str(if right { s.trim_end_matches(gone) } else { s }))
}

/// The text filled up to a width; `before` is how many of the missing letters go in front.
fn padded(c: &Call, before: fn(usize, usize) -> usize) -> Result<Value, Fault> {
    let (s, width) = (c.text(0)?, c.count(1)?);
    let fill = if c.opt(2).is_some() { c.text(2)? } else { " " };
    c.eval.budget.text(s.len().saturating_add(width.saturating_mul(fill.len())))?;
    let missing = width.saturating_sub(s.chars().count());
    let front = before(missing, width);
    Ok(Value::str(format!("{}{s}{}", fill.repeat(front), fill.repeat(missing - front))))
}

fn text(c: &Call, f: fn(&str) -> String) -> Result<Value, Fault> {
    let s = c.text(0)?;
    c.eval.budget.text(s.len().saturating_mul(2))?;
    Ok(Value::str(f(s)))
}

/// The rows of a value's methods.
pub fn of(owner: &Value) -> impl Iterator<Item = &'static Row> + Clone {
    let (own, more): (&'static [Row], &'static [Row]) = match owner {
        Value::Array(_) | Value::Number(_) => (ARRAY, &[]),
        Value::List(_) => (LIST, SEQUENCE),
        Value::Tuple(_) => (&[], SEQUENCE),
        Value::Str(_) => (TEXT, &[]),
        Value::Dict(_) => (methods_dict::DICT, &[]),
        Value::Set(_) => (methods_dict::SET, &[]),
        Value::Builtin(row) if matches!(row.run, super::args::Run::Binary(_)) => (ufunc::ROWS, &[]),
        _ => (&[], &[]),
    };
    let is_array = matches!(owner, Value::Array(_) | Value::Number(_));
    let shared: &'static [&'static str] = if is_array { SHARED } else { &[] };
    let pythons = matches!(owner, Value::Random(r) if r.borrow().is_pythons());
    let (own, random) = match owner {
        Value::Random(_) if pythons => (python_random::ROWS, None),
        Value::Random(r) => (own, Some(r.borrow().is_legacy())),
        _ => (own, None),
    };
    own.iter()
        .chain(more)
        .chain(shared.iter().filter_map(|name| numpy::named(name)))
        .chain(random.into_iter().flat_map(random_table::methods))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shared_method_is_a_numpy_function() {
        for name in SHARED {
            assert!(numpy::named(name).is_some(), "{name}");
        }
    }
}
