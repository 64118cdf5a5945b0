//! The paper's experiments: suites of trials, their results on disk, and the tables made of them.
//!
//! The name of a suite and a configuration come in; trials run, and rows beside the paper's figures go out.
//! Imports everything but the command line.
//!
//! | file | what it holds |
//! |---|---|
//! | `suite` | suites, their tasks, and what competes in them |
//! | `config` | what a trial depends on besides its number, and the hash of it |
//! | `trial` | one trial: a pure function of its spec |
//! | `results` | `results.jsonl`: appending, claiming, reading what a killed process left |
//! | `schedule` | running many trials, some at once |
//! | `statistics` | means, deviations and 95 % intervals |
//! | `summary` | the rows of a table, and `summary.json` |
//! | `paper` | what the paper prints |
//! | `table`, `chart` | Markdown, CSV, SVG |
//! | `targets` | the generated targets, for others to use |

pub mod chart;
pub mod config;
pub mod paper;
pub mod results;
pub mod schedule;
pub mod statistics;
pub mod suite;
pub mod summary;
pub mod table;
pub mod targets;
pub mod trial;

pub use config::Config;
pub use results::{ResultsDir, ResultsError};
pub use suite::{Contender, Suite};
pub use summary::Summary;
pub use trial::{Spec, Trial};
