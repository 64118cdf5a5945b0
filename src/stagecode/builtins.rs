//! Python's builtin functions, and the names that are there without an import.
//!
//! A name comes in, a row, module or constant goes out. `np`, `numpy` and `math` are there too: many
//! answers leave the imports out. Imports arguments, values, operators, faults.

use std::rc::Rc;

use super::args::{Arguments, Call, Row};
use super::dict::Dict;
use super::error::{Fault, Raised};
use super::eval::{Evaluator, Scope};
use super::exceptions::EXCEPTIONS;
use super::expr::keys;
use super::iterate::Steps;
use super::scalar::Scalar;
use super::value::{Module, Value};
use super::{attribute, convert, elementwise, format, math_module, operators};

/// The value of a builtin name.
pub fn named(name: &str) -> Option<Value> {
    Some(match name {
        "np" | "numpy" => Value::Module(Module::Numpy),
        "math" => Value::Module(Module::Math),
        "plt" => Value::Module(Module::Pictures),
        "__name__" => Value::str("__main__"),
        _ if EXCEPTIONS.contains(&name) => Value::Exception(Rc::new((name.to_owned(), String::new()))),
        _ => return ROWS.iter().find(|row| row.name == name).map(Value::Builtin),
    })
}

const ROWS: &[Row] = &[
    Row::new("print", "*args sep? end? file? flush?", print),
    Row::new("len", "obj", len),
    Row::new("range", "start stop? step?", range),
    Row::new("enumerate", "iterable start?", enumerate),
    Row::new("zip", "*iterables strict?", zip),
    Row::new("reversed", "sequence", |c| {
        let mut items = c.sequence(0)?;
        items.reverse();
        Ok(Value::iter(items))
    }),
    Row::back("sorted", "iterable key? reverse?", |c| Ok(Value::list(sort(c, c.sequence(0)?, 1, 2)?))),
    Row::back("map", "function *iterables", map),
    Row::back("filter", "function iterable", filter),
    Row::back("min", "first *others key? default?", |c| extreme(c, std::cmp::Ordering::Less)),
    Row::back("max", "first *others key? default?", |c| extreme(c, std::cmp::Ordering::Greater)),
    Row::new("sum", "iterable start?", sum),
    Row::new("any", "iterable", |c| quantify(c, true)),
    Row::new("all", "iterable", |c| quantify(c, false)),
    Row::new("abs", "x", abs),
    Row::new("round", "number ndigits?", round),
    Row::new("pow", "base exp", |c| {
        operators::binary(&c.eval.budget, ruff_python_ast::Operator::Pow, c.get(0)?, c.get(1)?)
    }),
    Row::new("divmod", "a b", |c| {
        let part = |op| operators::binary(&c.eval.budget, op, c.get(0)?, c.get(1)?);
        Ok(Value::tuple(vec![
            part(ruff_python_ast::Operator::FloorDiv)?,
            part(ruff_python_ast::Operator::Mod)?,
        ]))
    }),
    Row::new("int", "x?", int),
    Row::new("float", "x?", float),
    Row::new("bool", "x?", |c| Ok(Value::bool(c.flag(0, false)?))),
    Row::new("str", "x?", |c| {
        let text = c.opt(0).map_or_else(|| c.get(0).map_or(String::new(), format::text), format::text);
        c.eval.budget.text(text.len())?;
        Ok(Value::str(text))
    }),
    Row::new("repr", "x", |c| Ok(Value::str(format::repr(c.get(0)?)))),
    Row::new("format", "value spec?", |c| {
        let spec = if c.opt(1).is_some() { c.text(1)? } else { "" };
        Ok(Value::str(format::formatted(c.get(0)?, spec)?))
    }),
    Row::new("list", "iterable?", |c| {
        Ok(Value::list(if c.opt(0).is_some() { c.sequence(0)? } else { Vec::new() }))
    }),
    Row::new("tuple", "iterable?", |c| {
        Ok(Value::tuple(if c.opt(0).is_some() { c.sequence(0)? } else { Vec::new() }))
    }),
    Row::new("set", "iterable?", |c| keys(if c.opt(0).is_some() { c.sequence(0)? } else { Vec::new() })),
    Row::new("dict", "items? **named", super::methods_dict::dict),
    Row::new("slice", "start stop? step?", slice),
    Row::new("iter", "iterable", |c| Ok(Value::iter(c.sequence(0)?))),
    Row::new("next", "iterator default?", next),
    Row::new("isinstance", "obj class", isinstance),
    Row::new("callable", "obj", |c| Ok(Value::bool(matches!(c.get(0)?.type_name(), "function" | "type")))),
    Row::new("type", "obj", |c| Ok(type_of(c.get(0)?))),
    Row::new("hasattr", "obj name", |c| attribute_of(c).map(|found| Value::bool(found.is_some()))),
    Row::new("getattr", "obj name default?", |c| match (attribute_of(c)?, c.get(2)) {
        (Some(value), _) => Ok(value),
        (None, Ok(default)) => Ok(default.clone()),
        (None, Err(_)) => attribute::get(c.eval, c.get(0)?, c.text(1)?),
    }),
    Row::new("globals", "", |c| variables(c.eval, &c.eval.globals)),
    Row::new("locals", "", |c| variables(c.eval, &c.eval.globals)),
    Row::new("ord", "c", |c| {
        let first = c.text(0)?.chars().next().ok_or_else(|| c.problem("needs one letter"))?;
        Ok(Value::int(i64::from(u32::from(first))))
    }),
    Row::new("chr", "i", |c| {
        let letter = u32::try_from(c.int(0)?).ok().and_then(char::from_u32);
        letter.map(|l| Value::str(l.to_string())).ok_or_else(|| c.problem("is not the number of a letter"))
    }),
];

/// The attribute of the first argument that the second names, if there is one.
fn attribute_of(c: &Call) -> Result<Option<Value>, Fault> {
    match attribute::get(c.eval, c.get(0)?, c.text(1)?) {
        Err(Fault::UnknownAttribute { .. }) => Ok(None),
        found => found.map(Some),
    }
}

/// The class of a value.
fn type_of(value: &Value) -> Value {
    match value {
        Value::Number(n) if n.is_numpys() => Value::Dtype(n.dtype()),
        Value::Exception(e) => Value::Exception(Rc::new((e.0.clone(), String::new()))),
        Value::Array(_) => super::numpy::named("ndarray").map_or(Value::None, Value::Builtin),
        other => named(other.type_name()).unwrap_or(Value::Type(other.type_name())),
    }
}

/// The names of a scope as a dict, in alphabetical order.
pub fn variables(eval: &Evaluator, scope: &Scope) -> Result<Value, Fault> {
    let variables = scope.variables.borrow();
    eval.budget.allocate(variables.len())?;
    let mut names: Vec<&String> = variables.keys().collect();
    names.sort_unstable();
    let mut dict = Dict::default();
    names
        .into_iter()
        .try_for_each(|name| dict.insert(&Value::str(name), variables[name].clone()).map(drop))?;
    Ok(Value::dict(dict))
}

fn abs(c: &Call) -> Result<Value, Fault> {
    let made = elementwise::absolute(&c.eval.budget, &c.array(0)?).map(Value::array)?;
    Ok(match (c.get(0)?, made) {
        (Value::Number(n), Value::Number(size)) if !n.is_numpys() => Value::Number(size.plain()),
        (_, made) => made,
    })
}

fn print(c: &Call) -> Result<Value, Fault> {
    for value in &c.rest {
        c.eval.budget.print(format::text(value).len() + 1)?;
    }
    Ok(Value::None)
}

fn slice(c: &Call) -> Result<Value, Fault> {
    let part = |at: usize| c.opt(at).cloned().unwrap_or(Value::None);
    // One argument is where the slice stops.
    let alone = c.get(1).is_err();
    let (start, stop) = if alone { (Value::None, part(0)) } else { (part(0), part(1)) };
    Ok(Value::Slice(Rc::new([start, stop, part(2)])))
}

fn len(c: &Call) -> Result<Value, Fault> {
    let value = c.get(0)?;
    if let Value::Str(s) = value {
        c.eval.budget.text(s.len())?;
        return Ok(Value::count(s.chars().count()));
    }
    if matches!(value, Value::Iter(_)) {
        return Err(c.problem("an iterator has no length; make a list of it"));
    }
    if !matches!(value, Value::Range(..)) && (value.extent() > 0 || value.items().is_some()) {
        return Ok(Value::count(value.extent()));
    }
    Steps::of(value)
        .map(|steps| Value::count(steps.remaining()))
        .map_err(|_| c.problem(format!("a {} has no length", value.type_name())))
}

fn range(c: &Call) -> Result<Value, Fault> {
    let (start, stop) = if c.opt(1).is_some() { (c.int(0)?, c.int(1)?) } else { (0, c.int(0)?) };
    match c.int_or(2, 1)? {
        0 => Err(c.problem("the step must not be zero")),
        step => Ok(Value::Range(start, stop, step)),
    }
}

fn enumerate(c: &Call) -> Result<Value, Fault> {
    let start = c.int_or(1, 0)?;
    let items = c.sequence(0)?.into_iter().enumerate();
    let pair = |(i, v): (usize, Value)| Value::tuple(vec![Value::int(start.saturating_add(i as i64)), v]);
    Ok(Value::iter(items.map(pair).collect()))
}

fn zip(c: &Call) -> Result<Value, Fault> {
    let mut all: Vec<Steps> = c.rest.iter().map(Steps::of).collect::<Result<_, _>>()?;
    let count = all.iter().map(Steps::remaining).min().unwrap_or(0);
    c.eval.budget.allocate_items(count.saturating_mul(all.len()))?;
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        out.push(Value::tuple(all.iter_mut().filter_map(Iterator::next).collect()));
    }
    Ok(Value::iter(out))
}

/// Calls a function of the code with plain arguments.
fn run(c: &Call, function: &Value, positional: Vec<Value>) -> Result<Value, Raised> {
    c.eval.call(function, Arguments { positional, keyword: Vec::new() })
}

/// Sorted items; `key` and `reverse` are the places of those arguments.
pub fn sort(c: &Call, items: Vec<Value>, key: usize, reverse: usize) -> Result<Vec<Value>, Raised> {
    let mut pairs = Vec::with_capacity(items.len());
    for item in items {
        let by = c.opt(key).map_or(Ok(item.clone()), |f| run(c, f, vec![item.clone()]))?;
        pairs.push((by, item));
    }
    let mut fault = None;
    let backwards = c.flag(reverse, false)?;
    merge_sort(&mut pairs, &mut |a, b| {
        operators::order(&c.eval.budget, &a.0, &b.0)
            .map(|o| if backwards { o.map(std::cmp::Ordering::reverse) } else { o })
            .unwrap_or_else(|f| {
                fault.get_or_insert(f);
                None
            })
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    fault.map_or(Ok(()), Err)?;
    Ok(pairs.into_iter().map(|(_, item)| item).collect())
}

/// A stable sort that bears an order which contradicts itself, as NaN makes one; the standard library's
/// may panic on it.
fn merge_sort<T: Clone>(items: &mut Vec<T>, compare: &mut impl FnMut(&T, &T) -> std::cmp::Ordering) {
    if items.len() < 2 {
        return;
    }
    let mut right = items.split_off(items.len() / 2);
    let mut left = std::mem::take(items);
    merge_sort(&mut left, compare);
    merge_sort(&mut right, compare);
    let (mut left, mut right) = (left.into_iter().peekable(), right.into_iter().peekable());
    while let (Some(a), Some(b)) = (left.peek(), right.peek()) {
        let next = if compare(b, a).is_lt() { right.next() } else { left.next() };
        items.extend(next);
    }
    items.extend(left);
    items.extend(right);
}

fn map(c: &Call) -> Result<Value, Raised> {
    let mut all: Vec<Steps> = c.rest.iter().map(Steps::of).collect::<Result<_, _>>()?;
    let count = all.iter().map(Steps::remaining).min().unwrap_or(0);
    c.eval.budget.allocate_items(count)?;
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        out.push(run(c, c.get(0)?, all.iter_mut().filter_map(Iterator::next).collect())?);
    }
    Ok(Value::iter(out))
}

fn filter(c: &Call) -> Result<Value, Raised> {
    let mut out = Vec::new();
    for item in c.sequence(1)? {
        let keep = match c.opt(0) {
            Some(function) => run(c, function, vec![item.clone()])?.truth()?,
            None => item.truth()?,
        };
        if keep {
            out.push(item);
        }
    }
    Ok(Value::iter(out))
}

fn extreme(c: &Call, wanted: std::cmp::Ordering) -> Result<Value, Raised> {
    let items = if c.rest.is_empty() {
        c.sequence(0)?
    } else {
        std::iter::once(c.get(0)?).chain(&c.rest).cloned().collect()
    };
    let mut best: Option<(Value, Value)> = None;
    for item in items {
        let by = c.opt(2).map_or(Ok(item.clone()), |f| run(c, f, vec![item.clone()]))?;
        let better = match &best {
            None => true,
            Some((so_far, _)) => operators::order(&c.eval.budget, &by, so_far)? == Some(wanted),
        };
        if better {
            best = Some((by, item));
        }
    }
    match (best, c.get(3)) {
        (Some((_, item)), _) => Ok(item),
        (None, Ok(default)) => Ok(default.clone()),
        (None, Err(_)) => Err(Fault::value(format!("{}() of nothing", c.name)).into()),
    }
}

fn sum(c: &Call) -> Result<Value, Fault> {
    let mut total = c.opt(1).cloned().unwrap_or(Value::int(0));
    for item in c.sequence(0)? {
        total = operators::binary(&c.eval.budget, ruff_python_ast::Operator::Add, &total, &item)?;
    }
    Ok(total)
}

/// `any` looks for a true item, `all` for a false one.
fn quantify(c: &Call, looked_for: bool) -> Result<Value, Fault> {
    for item in c.sequence(0)? {
        if item.truth()? == looked_for {
            return Ok(Value::bool(looked_for));
        }
    }
    Ok(Value::bool(!looked_for))
}

fn round(c: &Call) -> Result<Value, Fault> {
    if let Value::Array(_) = c.get(0)? {
        return elementwise::keep_ints(&c.eval.budget, c.get(0)?, f64::round_ties_even);
    }
    if c.opt(1).is_none() {
        return math_module::whole(c, f64::round_ties_even);
    }
    let digits = c.int(1)?;
    match c.scalar(0)? {
        // Rust prints the exact value rounded correctly, which is what Python's round does.
        Scalar::Float(x) if (0..=300).contains(&digits) => {
            Ok(Value::float(format!("{x:.*}", digits as usize).parse().unwrap_or(x)))
        }
        Scalar::Float(x) => {
            let scale = 10f64.powi(digits.clamp(-400, 400).unsigned_abs() as i32);
            Ok(Value::float(if digits < 0 { (x / scale).round_ties_even() * scale } else { x }))
        }
        n => Ok(Value::Number(n)),
    }
}

fn int(c: &Call) -> Result<Value, Fault> {
    match c.opt(0) {
        None => Ok(Value::int(0)),
        Some(Value::Str(s)) => {
            let number = s.trim().parse().map_err(|_| Fault::value(format!("'{s}' is not an integer")));
            number.map(Value::int)
        }
        Some(_) => math_module::whole(c, f64::trunc),
    }
}

fn float(c: &Call) -> Result<Value, Fault> {
    match c.opt(0) {
        None => Ok(Value::float(0.0)),
        Some(Value::Str(s)) => {
            let number = s.trim().parse().map_err(|_| Fault::value(format!("'{s}' is not a number")));
            number.map(Value::float)
        }
        Some(_) => c.float(0).map(Value::float),
    }
}

fn next(c: &Call) -> Result<Value, Fault> {
    let Value::Iter(iter) = c.get(0)? else { return Err(c.problem("takes an iterator; use iter(..)")) };
    match (Steps::Shared(iter.clone()).next(), c.get(1)) {
        (Some(item), _) => Ok(item),
        (None, Ok(default)) => Ok(default.clone()),
        (None, Err(_)) => Err(Fault::Raised { exception: "StopIteration".into(), message: String::new() }),
    }
}

fn isinstance(c: &Call) -> Result<Value, Fault> {
    let value = c.get(0)?;
    let is = |class: &Value| match class {
        Value::Builtin(row) => {
            row.name == value.type_name() || row.name == "int" && value.type_name() == "bool"
        }
        Value::Exception(class) => {
            matches!(value, Value::Exception(e) if super::exceptions::is_a(&e.0, &class.0))
        }
        Value::Dtype(wanted) => value.as_scalar().is_some_and(|n| n.dtype() == *wanted),
        _ => false,
    };
    let classes = c.get(1)?;
    Ok(Value::bool(classes.items().map_or_else(|| is(classes), |all| all.iter().any(is))))
}

/// `tolist` and its like need numbers of Python, which numbers of numpy already are.
pub fn item(c: &Call) -> Result<Value, Fault> {
    let mut a = convert::to_array(&c.eval.budget, c.get(0)?, None)?;
    for index in &c.rest {
        // One index counts through all elements, several take one axis each.
        let flat = if c.rest.len() == 1 { a.reshape(vec![a.size()]) } else { a };
        c.eval.budget.charge(flat.size())?;
        let one = super::array_index::get(&c.eval.budget, &flat, index)?;
        a = convert::to_array(&c.eval.budget, &one, None)?;
    }
    a.first()
        .filter(|_| a.size() == 1)
        .map(Value::Number)
        .ok_or_else(|| c.problem("needs an array of exactly one element"))
}
