//! What can go wrong with files: one error type for arrays, run directories and records.
//!
//! A cause is part of its message (and not chained, which would print it twice). Every message names the file (and the entry in it) and, where there is one, the way out.
//! Imports nothing of donut.

use std::io;
use std::path::{Path, PathBuf};

/// An error of reading or writing a file of donut's.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The operating system refused to read.
    #[error("cannot read {}: {reason}; check that the path exists and is readable", path.display())]
    Read { path: PathBuf, reason: io::Error },
    /// The operating system refused to write.
    #[error(
        "cannot write {}: {reason}; choose another place, or make this one writable",
        path.display()
    )]
    Write { path: PathBuf, reason: io::Error },
    /// The file is not a readable `.npy` or `.npz` file.
    #[error("{} is not a NumPy array file that donut can read: {reason}", path.display())]
    Format { path: PathBuf, reason: String },
    /// An entry of an `.npz` file is missing.
    #[error("{} has no array `{entry}`; it holds: {available}", path.display())]
    MissingEntry { path: PathBuf, entry: String, available: String },
    /// An array has another type, shape or length than it must have.
    #[error("array `{entry}` of {}: {reason}", path.display())]
    Entry { path: PathBuf, entry: String, reason: String },
    /// A JSON file does not parse or has other keys than expected.
    #[error("{} is not what donut writes: {reason}; was it edited or made by another version?", path.display())]
    Json { path: PathBuf, reason: serde_json::Error },
    /// The output directory holds something that donut did not write.
    #[error(
        "{} exists and is not a donut run; choose another --out, or empty that directory first",
        path.display()
    )]
    NotARun { path: PathBuf },
    /// A file that must not be replaced is there already.
    #[error("{} exists and is not replaced; choose another name, or remove it first", path.display())]
    Exists { path: PathBuf },
    /// A directory for new files has something in it.
    #[error("{} has something in it; choose another directory, or empty that one first", path.display())]
    NotEmpty { path: PathBuf },
    /// A directory to be read is not a complete run.
    #[error(
        "{} is not a finished donut run ({missing} is missing); make one with `donut plan --out DIR`",
        path.display()
    )]
    Incomplete { path: PathBuf, missing: &'static str },
}

impl StoreError {
    /// For `map_err` on reads: remembers the path.
    pub(crate) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |reason| Self::Read { path, reason }
    }

    /// For `map_err` on writes: remembers the path.
    pub(crate) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |reason| Self::Write { path, reason }
    }
}
