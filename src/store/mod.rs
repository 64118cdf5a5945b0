//! What a run leaves on disk, and NumPy's array files.
//!
//! The planner's results come in as a [`record::RunRecord`]; a run directory goes out, and back in.
//! Imports `math` and the types of `sim`, `llm` and `plan`.
//!
//! | file | what it holds |
//! |---|---|
//! | `npz` | `.npy` and `.npz` files that `numpy.load` reads |
//! | `atomic` | files and run directories that appear whole or not at all |
//! | `record` | what a run is, as plain data: summary, plan, segments |
//! | `trajectory` | the frames of a run and their arrays in `trajectory.npz` |
//! | `run_dir` | a record to a directory and back |
//! | `exchange` | recorded exchanges with language models |

pub mod atomic;
pub mod error;
pub mod exchange;
pub mod npz;
pub mod record;
pub mod run_dir;
pub mod sim_scene;
pub mod trajectory;

pub use atomic::RunDir;
pub use error::StoreError;
