//! The evaluator for the Python and numpy that language models write.
//!
//! Source text comes in, block after block into one namespace; arrays of that namespace go out, or a
//! [`CodeError`] with line, column and a way out. The syntax tree is `ruff`'s, everything that runs is
//! here: no file, no network, no import but numpy and harmless parts of the standard library, and nothing
//! beyond the [`Limits`]. [`Python`]
//! runs what is beyond the subset, shut in by the system instead. Imports nothing of donut.
//!
//! | looking for | open |
//! |---|---|
//! | what may be used up | `limits.rs`, `memory.rs` |
//! | statements, expressions, calls | `eval.rs`, `expr.rs`, `assign.rs`, `calls.rs` |
//! | numbers, arrays and their indexing | `scalar.rs`, `array.rs`, `array_index.rs`, `elementwise.rs` |
//! | the table of numpy functions | `numpy.rs` and `numpy_*.rs` |
//! | random numbers | `random.rs`, `random_table.rs`, `python_random.rs` |
//! | modules besides numpy | `math_module.rs`, `standard.rs` |
//! | names without an import, methods | `builtins.rs`, `methods.rs` |
//! | CPython instead, in a sandbox | `python.rs`, `sandbox.rs`, `harness.py` |

mod args;
mod array;
mod array_index;
mod assign;
mod attribute;
mod builtins;
mod calls;
mod convert;
mod dict;
mod einsum;
mod elementwise;
mod error;
mod eval;
mod exceptions;
mod expr;
mod format;
mod imports;
mod index;
mod iterate;
mod limits;
mod math_module;
mod memory;
mod methods;
mod methods_dict;
mod nearest;
mod numpy;
mod numpy_create;
mod numpy_decompose;
mod numpy_grid;
mod numpy_join;
mod numpy_linalg;
mod numpy_logic;
mod numpy_place;
mod numpy_reduce;
mod numpy_series;
mod numpy_shape;
mod numpy_sort;
mod operators;
mod python;
mod python_random;
mod random;
mod random_choice;
mod random_table;
mod sandbox;
mod scalar;
mod session;
mod source;
mod standard;
mod standard_itertools;
mod ufunc;
mod value;
mod ziggurat_tables;

pub use error::{CodeError, Fault};
pub use limits::Limits;
pub use python::Python;
pub use sandbox::EngineError;
pub use session::{Captured, Interpreter, Session, evaluate};
pub use source::is_python;
