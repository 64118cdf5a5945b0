//! The parts of Python's standard library that go with arrays and loops: `random`, `itertools`, `functools`,
//! `collections`, `copy`, `time`, `warnings`, `sys`, and the names of `typing`.
//!
//! A module's name and an attribute come in, a row or constant goes out. The clock stands still and warnings are
//! nothing, so that every run is the same. Imports the tables, arguments, values.

use std::rc::Rc;

use super::args::{Arguments, Call, Row};
use super::array::Array;
use super::dict::Dict;
use super::error::{Fault, Raised};
use super::eval::Evaluator;
use super::scalar::Dtype;
use super::value::{Module, Value};
use super::{methods_dict, python_random, standard_itertools};

/// The modules and their functions.
const MODULES: &[(&str, &[Row])] = &[
    ("random", python_random::ROWS),
    ("itertools", standard_itertools::ROWS),
    ("functools", FUNCTOOLS),
    ("collections", COLLECTIONS),
    ("copy", COPY),
    ("time", TIME),
    ("warnings", WARNINGS),
    ("sys", SYS),
    ("typing", TYPING),
    ("typing_extensions", TYPING),
    ("collections.abc", TYPING),
    ("numpy.typing", TYPING),
];

/// The module of a name.
pub fn module(name: &str) -> Option<Module> {
    MODULES.iter().find(|(known, _)| *known == name).map(|(known, _)| Module::Standard(known))
}

/// A name of a module.
pub fn attribute(eval: &Evaluator, module: &'static str, name: &str) -> Result<Value, Fault> {
    let rows = MODULES.iter().find(|(known, _)| *known == module).map_or(&[][..], |(_, rows)| rows);
    let row = rows.iter().find(|row| row.name == name);
    match (module, name, row) {
        ("random", "Random", _) => Ok(Value::Builtin(&python_random::MAKER)),
        ("random", _, Some(row)) => {
            Ok(Value::Method(Rc::new((Value::Random(eval.pythons_random.clone()), row))))
        }
        (_, _, Some(row)) => Ok(Value::Builtin(row)),
        ("typing", "TYPE_CHECKING", _) => Ok(Value::bool(false)),
        ("sys", "maxsize", _) => Ok(Value::int(i64::MAX)),
        ("sys", "stdout" | "stderr", _) => Ok(Value::None),
        ("sys", "float_info", _) => Ok(Value::Dtype(Dtype::F64)),
        ("collections", "abc", _) => Ok(Value::Module(Module::Standard("collections.abc"))),
        ("collections", "OrderedDict", _) => {
            super::builtins::named("dict").ok_or_else(|| Fault::value("dict"))
        }
        // Annotations are never evaluated; names for them only have to be there.
        ("typing" | "typing_extensions" | "collections.abc" | "numpy.typing", _, None)
            if !name.starts_with('_') =>
        {
            Ok(Value::Type("object"))
        }
        _ => {
            let names: Vec<&str> = rows.iter().map(|row| row.name).collect();
            let hint = Some(format!("{module} has {} here", names.join(", ")));
            Err(Fault::UnknownAttribute { owner: module.into(), name: name.into(), hint })
        }
    }
}

const FUNCTOOLS: &[Row] = &[
    Row::back("reduce", "function iterable initial?", reduce),
    Row::new("partial", "func *args **keywords", |c| {
        let mut keywords = Dict::default();
        c.named.iter().try_for_each(|(k, v)| keywords.insert(&Value::str(k), v.clone()).map(drop))?;
        let held = vec![c.get(0)?.clone(), Value::tuple(c.rest.clone()), Value::dict(keywords)];
        Ok(Value::Method(Rc::new((Value::tuple(held), &PARTIAL))))
    }),
    // A cache changes nothing but the time.
    Row::new("lru_cache", "maxsize? typed?", |c| match c.opt(0) {
        Some(function @ Value::Function(_)) => Ok(function.clone()),
        _ => Ok(Value::Builtin(&ITSELF)),
    }),
    Row::new("cache", "user_function", |c| c.get(0).cloned()),
    Row::new("wraps", "wrapped", |_| Ok(Value::Builtin(&ITSELF))),
];

/// What `functools.partial` returns; its owner holds the function and the arguments given already.
static PARTIAL: Row = Row::back("partial", "self *args **keywords", |c| {
    let held = c.get(0)?.items().unwrap_or_default();
    let [function, first, Value::Dict(named)] = &held[..] else {
        return Err(c.problem("lost its function").into());
    };
    let mut positional = first.items().unwrap_or_default();
    positional.extend(c.rest.iter().cloned());
    let mut keyword = c.named.clone();
    for (name, value) in named.0.borrow().entries() {
        let name = super::format::text(name);
        if !keyword.iter().any(|(given, _)| *given == name) {
            keyword.push((name, value.clone()));
        }
    }
    c.eval.call(function, Arguments { positional, keyword })
});

/// A decorator that returns the function as it is.
static ITSELF: Row = Row::new("decorator", "function", |c| c.get(0).cloned());

fn reduce(c: &Call) -> Result<Value, Raised> {
    let mut items = c.sequence(1)?.into_iter();
    let first = c.get(2).cloned().ok().or_else(|| items.next());
    let mut result = first.ok_or_else(|| Fault::kind("reduce() of nothing without an initial value"))?;
    for item in items {
        let positional = vec![result, item];
        result = c.eval.call(c.get(0)?, Arguments { positional, keyword: Vec::new() })?;
    }
    Ok(result)
}

const COLLECTIONS: &[Row] = &[
    Row::new("defaultdict", "default_factory? items? **named", |c| {
        let mut dict = methods_dict::made(methods_dict::pairs(c, 1)?)?;
        dict.default = c.opt(0).cloned();
        Ok(Value::dict(dict))
    }),
    Row::new("Counter", "iterable?", |c| {
        let mut dict = if let Some(Value::Dict(_)) = c.opt(0) {
            methods_dict::made(methods_dict::pairs(c, 0)?)?
        } else {
            let mut dict = Dict::default();
            for item in if c.opt(0).is_some() { c.sequence(0)? } else { Vec::new() } {
                let seen = dict.get(&super::dict::Key::of(&item)?).and_then(Value::as_int).unwrap_or(0);
                dict.insert(&item, Value::int(seen + 1))?;
            }
            dict
        };
        dict.default = Some(Value::int(0));
        Ok(Value::dict(dict))
    }),
];

const COPY: &[Row] = &[
    Row::new("copy", "x", |c| copied(c, c.get(0)?, false)),
    Row::new("deepcopy", "x memo?", |c| copied(c, c.get(0)?, true)),
];

fn copied(c: &Call, value: &Value, deep: bool) -> Result<Value, Fault> {
    let inner = |value: &Value| {
        if !deep {
            return Ok(value.clone());
        }
        c.eval.budget.enter()?;
        let made = copied(c, value, true);
        c.eval.budget.leave();
        made
    };
    Ok(match value {
        Value::Array(a) => {
            c.eval.budget.allocate(a.size())?;
            Value::Array(Array::copy(a))
        }
        Value::List(_) => Value::list(c.eval.collect(value)?.iter().map(inner).collect::<Result<_, _>>()?),
        Value::Tuple(_) => Value::tuple(c.eval.collect(value)?.iter().map(inner).collect::<Result<_, _>>()?),
        Value::Dict(table) | Value::Set(table) => {
            let (entries, default) = (table.0.borrow().entries().to_vec(), table.0.borrow().default.clone());
            c.eval.budget.allocate_items(entries.len())?;
            let entries = entries.into_iter().map(|(k, v)| Ok((k, inner(&v)?)));
            let mut dict = methods_dict::made(entries.collect::<Result<_, Fault>>()?)?;
            dict.default = default;
            if let Value::Dict(_) = value { Value::dict(dict) } else { Value::set(dict) }
        }
        other => other.clone(),
    })
}

const TIME: &[Row] = &[
    Row::new("time", "", |_| Ok(Value::float(0.0))),
    Row::new("perf_counter", "", |_| Ok(Value::float(0.0))),
    Row::new("process_time", "", |_| Ok(Value::float(0.0))),
    Row::new("monotonic", "", |_| Ok(Value::float(0.0))),
    Row::new("sleep", "secs", |_| Ok(Value::None)),
];

const WARNINGS: &[Row] = &[
    Row::new("filterwarnings", "*args **named", |_| Ok(Value::None)),
    Row::new("simplefilter", "*args **named", |_| Ok(Value::None)),
    Row::new("warn", "*args **named", |_| Ok(Value::None)),
    Row::new("catch_warnings", "**named", |_| Ok(Value::None)),
];

const SYS: &[Row] = &[Row::new("setrecursionlimit", "limit", |_| Ok(Value::None))];

const TYPING: &[Row] = &[
    Row::new("cast", "typ val", |c| c.get(1).cloned()),
    Row::new("NewType", "name tp", |c| c.get(1).cloned()),
    Row::new("TypeVar", "name *constraints **named", |_| Ok(Value::Type("object"))),
];
