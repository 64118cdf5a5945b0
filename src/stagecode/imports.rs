//! `import` statements: numpy, math and parts of the standard library under any name, modules that draw pictures as something
//! that does nothing, and nothing else.
//!
//! A statement and a scope come in; names in the scope, or a fault that says what to do, go out. Imports
//! attributes of modules, values, faults.

use ruff_python_ast::{Alias, Stmt};

use super::error::Fault;
use super::eval::{Evaluator, Scope};
use super::value::{Module, Value};
use super::{attribute, standard};

/// Runs an `import` or `from ... import` statement.
pub fn import(eval: &Evaluator, statement: &Stmt, scope: &Scope) -> Result<(), Fault> {
    match statement {
        Stmt::Import(s) => s.names.iter().try_for_each(|alias| whole(alias, scope)),
        Stmt::ImportFrom(s) => {
            let name = s.module.as_ref().map_or("", |m| m.as_str());
            if name == "__future__" {
                return Ok(());
            }
            let module = if s.level == 0 { module_named(name) } else { None };
            let module = module.ok_or_else(|| refusal(name))?;
            s.names.iter().try_for_each(|alias| part(eval, module, alias, scope))
        }
        _ => Ok(()),
    }
}

fn whole(alias: &Alias, scope: &Scope) -> Result<(), Fault> {
    let module = module_named(&alias.name).ok_or_else(|| refusal(&alias.name))?;
    match &alias.asname {
        Some(name) => scope.set(name, Value::Module(module)),
        // `import numpy.random` binds `numpy`.
        None => {
            let root = alias.name.split('.').next().unwrap_or_default();
            scope.set(root, Value::Module(module_named(root).unwrap_or(module)));
        }
    }
    Ok(())
}

fn part(eval: &Evaluator, module: Module, alias: &Alias, scope: &Scope) -> Result<(), Fault> {
    if alias.name.as_str() == "*" && module == Module::Math {
        return attribute::names_of_math().try_for_each(|name| {
            scope.set(name, attribute::of_module(eval, module, name)?);
            Ok(())
        });
    }
    if alias.name.as_str() == "*" {
        return Err(Fault::unsupported("`import *`", "import numpy as np and write np. before its names"));
    }
    let value = attribute::of_module(eval, module, &alias.name).map_err(|fault| {
        let instead = fault.hint().unwrap_or_else(|| "write it with the names that are there".into());
        let what = format!("importing `{}` from that module", alias.name);
        Fault::Import { what, instead, exception: "ImportError" }
    })?;
    scope.set(alias.asname.as_ref().unwrap_or(&alias.name), value);
    Ok(())
}

fn module_named(name: &str) -> Option<Module> {
    Some(match name {
        "numpy" => Module::Numpy,
        "numpy.random" => Module::Random,
        "numpy.linalg" => Module::Linalg,
        "math" => Module::Math,
        _ if PICTURES.contains(&name.split('.').next().unwrap_or(name)) => Module::Pictures,
        _ => return standard::module(name),
    })
}

/// Packages that draw pictures. Answers show their clouds with them, and only the clouds count.
const PICTURES: &[&str] = &["matplotlib", "mpl_toolkits", "plotly", "pylab", "seaborn"];

fn refusal(name: &str) -> Fault {
    let instead = match name {
        "scipy" | "scipy.spatial" | "scipy.spatial.transform" => {
            "write the formula with numpy; np.linalg has norm, inv and det"
        }
        "open3d" | "trimesh" | "pyvista" => "leave pictures out; only the clouds count",
        "dataclasses" => "use tuples and dicts",
        _ => "only numpy, math and harmless parts of the standard library can be imported",
    };
    let what = format!("importing `{name}`");
    Fault::Import { what, instead: instead.into(), exception: "ModuleNotFoundError" }
}
