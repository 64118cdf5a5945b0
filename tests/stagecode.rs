//! The evaluator against CPython and numpy: snippets whose assertions hold there, diagnostics, limits.

use std::fs;
use std::path::Path;

use donut::stagecode::{Captured, CodeError, Fault, Limits, evaluate};

fn run_within(code: &str, limits: &Limits) -> Result<(), CodeError> {
    evaluate(limits, |session| session.run(code, 1, 0))
}

fn run(code: &str) -> Result<(), CodeError> {
    run_within(code, &Limits::default())
}

/// The variable `x` after the code, flat.
fn values(code: &str) -> Vec<f64> {
    let captured =
        evaluate(&Limits::default(), |session| session.run(code, 1, 0).map(|()| session.capture("x")));
    match captured.unwrap() {
        Captured::Array { values, .. } => values,
        other => panic!("x is {other:?}"),
    }
}

#[test]
fn snippets_hold_as_they_do_in_python() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snippets");
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if let Err(error) = run(&fs::read_to_string(&path).unwrap()) {
            panic!("{}: {error}", path.display());
        }
        count += 1;
    }
    assert!(count >= 3);
}

/// Code, line, column, a part of the message, a part of the hint.
const DIAGNOSTICS: &[(&str, usize, usize, &str, &str)] = &[
    ("a = 1\nb = a + radus", 2, 9, "`radus` is not defined", "define it"),
    ("radius = 1\nb = radus", 2, 5, "`radus` is not defined", "did you mean `radius`"),
    ("x = np.linspce(0, 1, 5)", 1, 5, "`np` has no `linspce`", "did you mean `linspace`"),
    ("import scipy", 1, 1, "importing `scipy` is not supported", "numpy"),
    ("import os", 1, 1, "importing `os`", "only numpy, math and harmless parts"),
    ("from numpy import linspce", 1, 1, "importing `linspce`", "did you mean `linspace`"),
    ("import itertools\nx = itertools.cycle([1])", 2, 5, "`itertools` has no `cycle`", "product"),
    ("x = np.roots([1, 0, 1])", 1, 5, "complex roots", "halve"),
    ("x = np.linalg.eig(np.array([[0, 1], [-1, 0]]))", 1, 5, "not symmetric", "svd"),
    ("x = np.add([1], [0.5], out=np.zeros(1, dtype=int))", 1, 5, "do not fit an `out` of int64", ""),
    ("import random\nrandom.seed('x')", 2, 1, "seed(): is supported with an integer", ""),
    ("def f():\n    raise\nf()", 2, 5, "RuntimeError", ""),
    ("try:\n    x = [1][2]\nexcept IndexError:\n    raise", 2, 9, "outside a list of length 1", ""),
    ("raise 'no'", 1, 1, "a str cannot be raised", ""),
    ("def f(n): return f(n + 1)\nf(0)", 1, 20, "levels of nested", "loop"),
    ("x = np.zeros((2**40, 3))", 1, 5, "elements in one array", "part by part"),
    ("from numpy import *", 1, 1, "`import *`", "import numpy as np"),
    ("x = (1).__class__", 1, 5, "`int` has no `__class__`", "two underscores"),
    ("x = np.__dict__", 1, 5, "`np` has no `__dict__`", ""),
    ("open('x')", 1, 1, "`open` is not defined", ""),
    ("eval('1')", 1, 1, "`eval` is not defined", ""),
    ("class A: pass", 1, 1, "a class is not supported", "arrays"),
    ("with x: pass", 1, 1, "`with` is not supported", ""),
    ("def f():\n    yield 1\nf()", 2, 5, "a generator is not supported", "list"),
    ("x = 1 +\n", 1, 8, "syntax error", ""),
    ("x = np.zeros((2, 3)) + np.zeros((3, 2))", 1, 5, "shapes (2, 3) and (3, 2) do not fit", ""),
    ("x = np.zeros((2, 3))\ny = x[2, 0]", 2, 5, "index 2 is outside", ""),
    ("x = np.zeros(3)\nx[np.array([True, False])]", 2, 1, "a mask of shape (2,)", ""),
    ("x = 1 / 0", 1, 5, "division by zero", ""),
    ("d = {'a': 1}\nd['b']", 2, 1, "key 'b'", ""),
    ("np.sum([1], axes=0)", 1, 1, "sum(): the argument `axes` is not supported", ""),
    ("np.zeros()", 1, 1, "zeros(): the argument `shape` is missing", ""),
    ("if np.array([1, 2]) > 1: pass", 1, 4, "several elements", ""),
    ("def f(r):\n    return r / 0\n\nx = 1\nf(1)", 2, 12, "division by zero", ""),
    ("assert 1 == 2, 'no'", 1, 1, "AssertionError: no", ""),
    ("x = np.random.default_rng(0).rand(3)", 1, 5, "`Generator` has no `rand`", ""),
    ("x = 2 ** 100", 1, 5, "beyond 64 bits", "float"),
    ("m = (1.0 < 2) & np.array([1.5])", 1, 5, "parentheses", ""),
    ("x = (-8) ** (1/3)", 1, 5, "complex", ""),
    ("return 3", 1, 1, "", ""),
    ("a, b = 1, 2, 3", 1, 1, "2 targets for 3 values", ""),
    ("x = [np.zeros(2), np.zeros(3)]\ny = np.array(x)", 2, 5, "same shape", ""),
];

#[test]
fn diagnostics_name_the_place_the_thing_and_the_way_out() {
    for &(code, line, column, message, hint) in DIAGNOSTICS {
        let error = run(code).expect_err(code);
        assert_eq!((error.line, error.column), (line, column), "{code}: {error}");
        assert!(error.fault.to_string().contains(message), "{code}: {error}");
        assert!(error.fault.hint().unwrap_or_default().contains(hint), "{code}: {:?}", error.fault.hint());
    }
}

#[test]
fn places_count_from_the_line_and_indent_of_the_block() {
    let error = evaluate(&Limits::default(), |s| s.run("a = 1\nb = c\n", 41, 2)).unwrap_err();
    assert_eq!((error.line, error.column), (42, 7));
}

#[test]
fn a_fault_in_a_function_is_placed_in_the_block_that_defines_it() {
    let error = evaluate(&Limits::default(), |s| {
        s.run("def f(n):\n    return n + missing\n", 10, 0)?;
        s.run("x = f(1)\n", 50, 0)
    });
    assert_eq!(error.unwrap_err().line, 11);
}

fn limited(code: &str, limits: &Limits, what: &str) {
    match run_within(code, limits) {
        Err(CodeError { fault: Fault::Limit { what: found, .. }, .. }) => assert_eq!(found, what, "{code}"),
        other => panic!("{code}: {other:?}"),
    }
}

#[test]
fn every_limit_stops_the_program() {
    let usual = Limits::default();
    let few = Limits { operations: 10_000, ..usual.clone() };
    limited("while True: pass", &few, "operations");
    limited("x = np.ones(20000)", &few, "operations");
    limited("x = sum(range(20000))", &few, "operations");
    limited("x = np.ones((200, 50)) @ np.ones((50, 200))", &few, "operations");
    let small = Limits { elements: 1000, ..usual.clone() };
    for code in [
        "x = np.zeros(1001)",
        "x = np.zeros((2**40, 2**40))",
        "x = [0] * 1001",
        "x = list(range(1001))",
        "x = [i for i in range(1001)]",
        "x = np.arange(100)[:, None] * np.arange(100)",
        "x = np.tile([1, 2], 1000)",
        "x = np.random.rand(10, 10, 11)",
        "x = np.mgrid[0:40, 0:40]",
        "x = np.zeros((2**60, 0))",
        "x = np.zeros((0, 3)).reshape(2**60, 0)",
        "x = np.linspace([], [], 2**60)",
    ] {
        limited(code, &small, "elements in one array or list");
    }
    let little = Limits { memory_bytes: 1_000_000, ..usual.clone() };
    for code in [
        "x = np.zeros(200000)",
        "x = []\nwhile True: x.append(np.ones(1000))",
        "x = []\nwhile True: x.append([0] * 100)",
        "x = []\nwhile True: x += [()]",
        "d = {}\nfor i in range(10**9): d[i] = i",
        "x = [0] * 20000",
    ] {
        limited(code, &little, "bytes of arrays and lists");
    }
    run_within("for i in range(1000): x = np.ones(10000)", &little).unwrap();
    limited("x = [0] * 4000001", &usual, "elements in one array or list");
    limited("def f(n): return f(n + 1)\nf(0)", &usual, "levels of nested expressions and calls");
    let quiet = Limits { output_bytes: 100, ..usual.clone() };
    limited("for i in range(100): print('hello')", &quiet, "bytes of text");
    limited("x = 'ab' * 51", &quiet, "bytes of text");
    let short = Limits { source_bytes: 10, ..usual.clone() };
    limited("x = 1 + 2 + 3", &short, "bytes of source code");
    let hasty = Limits { seconds: 0.05, operations: u64::MAX, ..usual.clone() };
    limited("while True: pass", &hasty, "seconds of run time");
    let deep = format!("x = {}1{}", "(".repeat(300), ")".repeat(300));
    limited(&deep, &usual, "brackets and operators nested in each other");
}

#[test]
fn a_limit_cannot_be_caught() {
    let few = Limits { operations: 10_000, ..Limits::default() };
    limited("while True:\n    try:\n        while True: pass\n    except: pass", &few, "operations");
}

#[test]
fn nothing_nested_exhausts_the_stack() {
    let n = 100_000;
    for code in [
        format!("x = {}1", "-".repeat(n)),
        format!("x = {}1", "not ".repeat(n)),
        format!("x = 1{}", "+1".repeat(n / 2)),
        format!("x = 1{}", "**1".repeat(n / 3)),
        format!("x = {}1", "lambda: ".repeat(n / 8)),
        format!("x = a{}", ".b".repeat(n / 2)),
        format!("x = {}", "[".repeat(n)),
        format!("x = {}1", "lambda a=1,: ".repeat(n / 13)),
        format!("x = {}1", "1 if 1 else ".repeat(n / 12)),
    ] {
        assert!(run(&code).is_err());
    }
    let lists = "x = []\nfor i in range(200000): x = [x]\ny = x == x\n";
    assert!(run(lists).is_err());
    assert!(run("x = []\nx.append(x)\nprint(x)\ny = np.array(x)").is_err());
    run("f = lambda: 0\nfor i in range(100000): f = (lambda g: lambda: g)(f)").unwrap();
    for wrapper in ["np.vectorize", "functools.partial"] {
        let code = format!("import functools\nf = abs\nfor i in range(200000): f = {wrapper}(f)\n");
        run(&code).unwrap();
        limited(&(code + "f(1)"), &Limits::default(), "levels of nested expressions and calls");
    }
}

#[test]
fn an_empty_list_repeated_without_end_takes_no_time() {
    run("x = [] * 2**62\nassert x == [] and '' * 2**62 == ''").unwrap();
}

#[test]
fn unseeded_draws_are_the_same_on_every_run() {
    let code = "x = np.concatenate([np.random.rand(3), np.random.default_rng().random(3)])";
    assert_eq!(values(code), values(code));
    let two = values("x = np.array([np.random.default_rng().random(), np.random.default_rng().random()])");
    assert_ne!(two[0], two[1]);
}

#[test]
fn ordinary_large_clouds_are_within_the_limits() {
    let code = "g = np.linspace(-1, 1, 150)\nX, Y, Z = np.meshgrid(g, g, g, indexing='ij')\n\
                inside = X**2 + Y**2 + Z**2 <= 1\nx = np.stack([X[inside], Y[inside], Z[inside]], axis=1).shape[0] / 150**3\n";
    assert!((values(code)[0] * 8.0 - 4.0 / 3.0 * std::f64::consts::PI).abs() < 0.1);
}
