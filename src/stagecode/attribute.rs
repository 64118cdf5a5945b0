//! Attributes: names of modules, properties and methods of values.
//!
//! A value and a name come in, another value or a fault with a suggestion goes out. Only what the tables
//! list exists; names with two underscores never do. Imports the tables.

use std::f64::consts;
use std::rc::Rc;

use super::args::Row;
use super::array::Array;
use super::error::Fault;
use super::eval::Evaluator;
use super::nearest::nearest;
use super::scalar::{Dtype, Scalar};
use super::value::{Indexer, Module, Value};
use super::{convert, math_module, methods, numpy, random_table, standard, standard_itertools};

/// `owner.name`.
pub fn get(eval: &Evaluator, owner: &Value, name: &str) -> Result<Value, Fault> {
    match owner {
        Value::Module(module) => return of_module(eval, *module, name),
        Value::Builtin(Row { name: "chain", .. }) if name == "from_iterable" => {
            return Ok(Value::Builtin(&standard_itertools::FROM_ITERABLE));
        }
        _ => {}
    }
    if let ("__name__", Some(own)) = (name, own_name(owner)) {
        return Ok(Value::str(own));
    }
    if name.starts_with("__") {
        let hint = Some("attributes with two underscores are closed".to_owned());
        return Err(Fault::UnknownAttribute { owner: owner.type_name().into(), name: name.into(), hint });
    }
    let property = match owner {
        Value::Array(a) => of_array(eval, a, name)?,
        Value::Number(n) => of_number(*n, name),
        Value::Dtype(dtype) => of_dtype(*dtype, name),
        Value::Exception(e) if name == "args" => Some(Value::tuple(vec![Value::str(&e.1)])),
        _ => None,
    };
    if let Some(value) = property {
        return Ok(value);
    }
    let table = methods::of(owner);
    match table.clone().find(|row| row.name == name) {
        Some(row) => Ok(Value::Method(Rc::new((owner.clone(), row)))),
        None => {
            let mut fault = unknown(owner.type_name(), name, table.map(|row| row.name));
            if let (Fault::UnknownAttribute { hint, .. }, Value::Array(_) | Value::Random(_)) =
                (&mut fault, owner)
            {
                let instead = if let Value::Random(_) = owner { Module::Random } else { Module::Numpy };
                hint.get_or_insert_with(|| elsewhere(instead).to_owned());
            }
            Err(fault)
        }
    }
}

/// The `__name__` of functions and classes.
fn own_name(owner: &Value) -> Option<&str> {
    Some(match owner {
        Value::Function(function) => &function.name,
        Value::Builtin(row) => row.name,
        Value::Method(method) => method.1.name,
        Value::Dtype(dtype) => dtype.name(),
        Value::Type(name) => name,
        Value::Exception(e) => &e.0,
        _ => return None,
    })
}

/// Attributes cannot be assigned to; the fault says what to do instead.
pub fn refuse_assignment(owner: &Value, name: &str) -> Fault {
    let instead = match name {
        "shape" => "use a.reshape(..)",
        "T" => "use a.T on the right-hand side",
        _ => "use a variable of its own",
    };
    Fault::unsupported(format!("assigning to `.{name}` of a {}", owner.type_name()), instead)
}

fn unknown<'a>(owner: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Fault {
    let hint = nearest(name, known).map(|near| format!("did you mean `{near}`?"));
    Fault::UnknownAttribute { owner: owner.into(), name: name.into(), hint }
}

fn of_array(eval: &Evaluator, a: &Array, name: &str) -> Result<Option<Value>, Fault> {
    Ok(Some(match name {
        "shape" => Value::shape(a.shape()),
        "ndim" => Value::count(a.ndim()),
        "size" => Value::count(a.size()),
        "dtype" => Value::Dtype(a.dtype()),
        "T" => Value::Array(a.permute(&(0..a.ndim()).rev().collect::<Vec<_>>())),
        "real" => Value::Array(a.clone()),
        "imag" => {
            eval.budget.allocate(a.size())?;
            Value::Array(Array::floats_as(vec![0.0; a.size()], a.dtype(), a.shape().to_vec()))
        }
        "flat" => {
            eval.budget.allocate(a.size())?;
            Value::Array(a.reshape(vec![a.size()]))
        }
        _ => return Ok(None),
    }))
}

/// Numbers taken from arrays have the properties of arrays without dimensions.
fn of_number(n: Scalar, name: &str) -> Option<Value> {
    Some(match name {
        "shape" => Value::tuple(Vec::new()),
        "ndim" => Value::int(0),
        "size" => Value::int(1),
        "dtype" => Value::Dtype(n.dtype()),
        "real" | "T" => Value::Number(n),
        "imag" => Value::Number(if n.dtype().is_float() { Scalar::Float(0.0) } else { Scalar::Int(0) }),
        _ => return None,
    })
}

fn of_dtype(dtype: Dtype, name: &str) -> Option<Value> {
    Some(match (name, dtype) {
        ("name", _) => Value::str(dtype.name()),
        ("eps", Dtype::F32) => Value::float(f64::from(f32::EPSILON)),
        ("eps", _) => Value::float(f64::EPSILON),
        ("tiny", _) => Value::float(f64::MIN_POSITIVE),
        ("max", Dtype::Int) => Value::int(i64::MAX),
        ("min", Dtype::Int) => Value::int(i64::MIN),
        ("max", _) => Value::float(f64::MAX),
        ("min", _) => Value::float(f64::MIN),
        _ => return None,
    })
}

/// A name of a module.
pub fn of_module(eval: &Evaluator, module: Module, name: &str) -> Result<Value, Fault> {
    let constant = match module {
        Module::Standard(title) => return standard::attribute(eval, title, name),
        Module::Numpy => numpy_constant(name),
        Module::Math => math_constant(name),
        Module::Linalg if name == "LinAlgError" => {
            Some(Value::Exception(Rc::new((name.to_owned(), String::new()))))
        }
        Module::Random | Module::Linalg | Module::Pictures => None,
    };
    if let Some(value) = constant {
        return Ok(value);
    }
    let (title, row, names): (_, Option<&'static Row>, Vec<&'static str>) = match module {
        Module::Standard(title) => (title, None, Vec::new()),
        Module::Numpy => ("np", numpy::named(name), numpy::names().collect()),
        Module::Linalg => {
            let table = super::numpy_linalg::LINALG.iter().chain(super::numpy_decompose::ROWS);
            ("np.linalg", table.clone().find(|r| r.name == name), table.map(|r| r.name).collect())
        }
        Module::Random => {
            if let Some(row) = random_table::methods(true).find(|r| r.name == name) {
                return Ok(Value::Method(Rc::new((Value::Random(eval.random.clone()), row))));
            }
            let names = random_table::methods(true).chain(random_table::makers()).map(|r| r.name).collect();
            ("np.random", random_table::makers().find(|r| r.name == name), names)
        }
        Module::Math => {
            let table = math_module::ROWS;
            ("math", table.iter().find(|r| r.name == name), table.iter().map(|r| r.name).collect())
        }
        Module::Pictures => return Ok(Value::Module(module)),
    };
    if let Some(row) = row {
        return Ok(Value::Builtin(row));
    }
    let mut fault = unknown(title, name, names.into_iter());
    if let Fault::UnknownAttribute { hint, .. } = &mut fault {
        let instead = instead_of(module, name).map(str::to_owned).or(hint.take());
        *hint = instead.or_else(|| Some(elsewhere(module).to_owned()));
    }
    Err(fault)
}

fn numpy_constant(name: &str) -> Option<Value> {
    Some(match name {
        "pi" => Value::float(consts::PI),
        "e" => Value::float(consts::E),
        "inf" | "Inf" | "infty" => Value::float(f64::INFINITY),
        "nan" | "NaN" => Value::float(f64::NAN),
        "euler_gamma" => Value::float(0.577_215_664_901_532_9),
        "newaxis" => Value::None,
        "random" => Value::Module(Module::Random),
        "linalg" => Value::Module(Module::Linalg),
        "typing" => Value::Module(Module::Standard("numpy.typing")),
        "c_" => Value::Indexer(Indexer::Columns),
        "r_" => Value::Indexer(Indexer::Rows),
        "mgrid" => Value::Indexer(Indexer::Mgrid),
        "ogrid" => Value::Indexer(Indexer::Ogrid),
        "s_" | "index_exp" => Value::Indexer(Indexer::Slices),
        _ => return convert::dtype_named(name).filter(|_| name.len() > 2).map(Value::Dtype),
    })
}

/// All names of `math`.
pub fn names_of_math() -> impl Iterator<Item = &'static str> {
    MATH_CONSTANTS.iter().map(|(name, _)| *name).chain(math_module::ROWS.iter().map(|row| row.name))
}

const MATH_CONSTANTS: &[(&str, f64)] =
    &[("pi", consts::PI), ("e", consts::E), ("tau", consts::TAU), ("inf", f64::INFINITY), ("nan", f64::NAN)];

fn math_constant(name: &str) -> Option<Value> {
    MATH_CONSTANTS.iter().find(|(known, _)| *known == name).map(|(_, value)| Value::float(*value))
}

/// What there is in a module, for names of which nothing better is known.
fn elsewhere(module: Module) -> &'static str {
    match module {
        Module::Numpy => "use other functions of np, or a loop; `--engine python` runs what is beyond these",
        Module::Linalg => "np.linalg has norm, det, inv, solve, lstsq, pinv, svd, eigh, qr and cholesky",
        Module::Random => "use uniform, normal, exponential, integers, choice, permutation or shuffle",
        Module::Math | Module::Standard(_) => {
            "write it with the functions of math that are there, or with those of np"
        }
        Module::Pictures => "leave pictures out; only the clouds count",
    }
}

/// What to use instead of names that models write and that do not exist here.
fn instead_of(module: Module, name: &str) -> Option<&'static str> {
    Some(match (module, name) {
        (Module::Numpy, "float128" | "complex128" | "complex64" | "complex") => "use np.float64",
        (Module::Numpy, "save" | "savez" | "load" | "savetxt" | "loadtxt" | "fromfile") => {
            "there are no files; leave the cloud in its variable"
        }
        (Module::Numpy, "fft" | "polynomial" | "ma") => "write the formula with plain arrays",
        (Module::Numpy, "tensordot" | "kron") => "use np.einsum or @",
        (Module::Numpy, "divmod") => "use // and %",
        (Module::Numpy, "modf") => "use a % 1 and np.floor(a)",
        (Module::Numpy, "block") => "use np.concatenate, np.vstack and np.hstack",
        (Module::Numpy, "resize") => "use np.tile and a slice",
        (Module::Numpy, "fromfunction" | "nditer") => "use np.indices, or loops over range",
        (Module::Numpy, "rollaxis") => "use np.moveaxis",
        (Module::Numpy, "histogramdd" | "histogram2d") => "use np.digitize and np.bincount",
        (Module::Numpy, "choose" | "heaviside") => "use np.where or np.select",
        (Module::Numpy, "extract") => "use a[mask]",
        (Module::Numpy, "copyto" | "put" | "putmask" | "place" | "put_along_axis") => "use a[mask] = values",
        (Module::Numpy, "frompyfunc") => "use np.vectorize",
        (Module::Numpy, "errstate") => "leave it out; no warnings are given",
        (Module::Random, "SeedSequence" | "MT19937" | "get_state" | "set_state") => {
            "use np.random.default_rng(seed) or np.random.RandomState(seed)"
        }
        _ => return None,
    })
}
