//! What can go wrong in foreign code: the [`Fault`] itself, and the [`CodeError`] that says where.
//!
//! Functions of the evaluator return faults; the evaluator adds the place as the fault passes the innermost
//! expression, and the session turns it into line and column. Imports nothing of donut.

use ruff_text_size::TextRange;

/// What went wrong, without the place.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// The text is not Python.
    #[error("syntax error: {0}")]
    Syntax(String),
    /// A name that nothing has defined.
    #[error("name `{name}` is not defined")]
    UnknownName {
        /// The name as written.
        name: String,
        /// A name that may have been meant.
        hint: Option<String>,
    },
    /// An attribute or function that its owner does not have here.
    #[error("`{owner}` has no `{name}` here")]
    UnknownAttribute {
        /// The module or type.
        owner: String,
        /// The attribute as written.
        name: String,
        /// What to use instead.
        hint: Option<String>,
    },
    /// Python that the evaluator does not run.
    #[error("{what} is not supported")]
    Unsupported {
        /// The construct or name.
        what: String,
        /// What to use instead.
        instead: String,
    },
    /// An import of something that is not there; code may catch it and do without.
    #[error("{what} is not supported")]
    Import {
        /// What was to be imported.
        what: String,
        /// What to use instead.
        instead: String,
        /// `ModuleNotFoundError`, or `ImportError` for a name in a module that is there.
        exception: &'static str,
    },
    /// A wrong set of arguments.
    #[error("{function}(): {problem}")]
    Arguments {
        /// The function called.
        function: String,
        /// What is wrong with the arguments.
        problem: String,
    },
    /// A value of the wrong type.
    #[error("{0}")]
    Type(String),
    /// A value of the right type that cannot be used.
    #[error("{0}")]
    Value(String),
    /// A matrix that has no inverse.
    #[error("{0}")]
    Singular(String),
    /// An index outside its range.
    #[error("{0}")]
    Index(String),
    /// A key that the dict does not hold.
    #[error("key {0} is not in the dict")]
    Key(String),
    /// Division of Python numbers by zero.
    #[error("division by zero")]
    ZeroDivision,
    /// An exception that the code raised itself.
    #[error("the code raised {exception}: {message}")]
    Raised {
        /// Its name.
        exception: String,
        /// Its text.
        message: String,
    },
    /// One of the [`super::Limits`] is used up.
    #[error("the code needs more than the allowed {allowed} {what}")]
    Limit {
        /// What is limited.
        what: &'static str,
        /// How much is allowed.
        allowed: u64,
    },
}

impl Fault {
    /// A limit that is used up.
    pub fn limit(what: &'static str, allowed: u64) -> Self {
        Self::Limit { what, allowed }
    }

    /// A value of the wrong type.
    pub fn kind(message: impl Into<String>) -> Self {
        Self::Type(message.into())
    }

    /// A value that cannot be used.
    pub fn value(message: impl Into<String>) -> Self {
        Self::Value(message.into())
    }

    /// A construct outside the subset, with its replacement.
    pub fn unsupported(what: impl Into<String>, instead: impl Into<String>) -> Self {
        Self::Unsupported { what: what.into(), instead: instead.into() }
    }

    /// The way out, where one is known.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::UnknownName { hint, .. } | Self::UnknownAttribute { hint, .. } => hint.clone(),
            Self::Unsupported { instead, .. } | Self::Import { instead, .. } => Some(instead.clone()),
            Self::Limit { what, .. } => Some(way_within(what).into()),
            Self::Singular(_) => Some("check np.linalg.det, or leave out what makes two rows alike".into()),
            _ => None,
        }
    }

    /// The name of the Python exception that this fault is to an `except` clause; `None` cannot be caught.
    pub fn exception(&self) -> Option<&str> {
        Some(match self {
            Self::UnknownName { .. } => "NameError",
            Self::UnknownAttribute { .. } => "AttributeError",
            Self::Arguments { .. } | Self::Type(_) => "TypeError",
            Self::Value(_) => "ValueError",
            Self::Singular(_) => "LinAlgError",
            Self::Index(_) => "IndexError",
            Self::Key(_) => "KeyError",
            Self::ZeroDivision => "ZeroDivisionError",
            Self::Raised { exception, .. } => exception,
            Self::Import { exception, .. } => exception,
            Self::Syntax(_) | Self::Unsupported { .. } | Self::Limit { .. } => return None,
        })
    }
}

/// How code stays within a limit.
fn way_within(what: &str) -> &'static str {
    match what {
        "operations" => "use whole-array numpy operations and 2000 to 4000 points a piece",
        "seconds of run time" => "see that every loop ends, and use whole-array numpy operations",
        "levels of nested expressions and calls" => "use a loop instead of a function that calls itself",
        "brackets and operators nested in each other" => "give parts of the expression names of their own",
        "levels of nested lists" => "use flat lists or arrays",
        "dimensions of an array" => "use arrays with fewer axes; a cloud has two",
        "bytes of text" => "print less; only the clouds count",
        "bytes of source code" => "compute the points instead of writing them out",
        _ => "2000 to 4000 points a piece are enough; go through larger arrays part by part",
    }
}

/// A fault with its place in the text that was run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}, column {column}: {fault}")]
pub struct CodeError {
    /// Line, counted from the first line that the caller named.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What went wrong.
    pub fault: Fault,
}

/// A fault on its way up through the evaluator.
#[derive(Clone, Debug)]
pub(super) struct Raised {
    pub fault: Fault,
    /// Where in the current source, once known.
    pub range: Option<TextRange>,
    /// Line and column, once the source is known.
    pub place: Option<(usize, usize)>,
}

impl From<Fault> for Raised {
    fn from(fault: Fault) -> Self {
        Self { fault, range: None, place: None }
    }
}

impl Raised {
    /// Notes the place, unless an inner expression already did.
    pub fn at(mut self, range: TextRange) -> Self {
        if self.place.is_none() {
            self.range.get_or_insert(range);
        }
        self
    }
}
