//! One number, and what type of elements arrays have.
//!
//! Elements are of the three plain kinds; a number by itself remembers whether numpy made it, since the two
//! differ where there is no result. A cast is numpy's. Imports nothing.

/// Element types. The order is that of promotion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Dtype {
    /// True or false.
    Bool,
    /// 64-bit integers; narrower ones are held as these.
    Int,
    /// Single precision: held in double, rounded after every operation.
    F32,
    /// Double precision.
    F64,
}

impl Dtype {
    /// numpy's name for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::Int => "int64",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }

    /// Whether elements are floating point.
    pub fn is_float(self) -> bool {
        self >= Self::F32
    }

    /// The type that holds both.
    pub fn promote(self, other: Self) -> Self {
        match (self, other) {
            (Self::Int, Self::F32) | (Self::F32, Self::Int) => Self::F64,
            (a, b) => a.max(b),
        }
    }
}

/// One element, or a Python number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar {
    /// A truth value.
    Bool(bool),
    /// An integer.
    Int(i64),
    /// A float.
    Float(f64),
    /// An integer that numpy made: its arithmetic wraps, and division by zero is no error.
    Int64(i64),
    /// A float that numpy made: division by zero gives infinities, and roots of negative numbers NaN.
    Float64(f64),
}

impl Scalar {
    /// As numpy's number.
    pub fn numpys(self) -> Self {
        match self {
            Self::Int(i) => Self::Int64(i),
            Self::Float(f) => Self::Float64(f),
            other => other,
        }
    }

    /// As Python's number.
    pub fn plain(self) -> Self {
        match self {
            Self::Int64(i) => Self::Int(i),
            Self::Float64(f) => Self::Float(f),
            other => other,
        }
    }

    /// Whether numpy made it.
    pub fn is_numpys(self) -> bool {
        matches!(self, Self::Int64(_) | Self::Float64(_))
    }

    /// As a float.
    pub fn float(self) -> f64 {
        match self {
            Self::Bool(b) => f64::from(u8::from(b)),
            Self::Int(i) | Self::Int64(i) => i as f64,
            Self::Float(f) | Self::Float64(f) => f,
        }
    }

    /// As an integer, cutting off a fraction as numpy's casts do.
    pub fn int(self) -> i64 {
        match self {
            Self::Bool(b) => i64::from(b),
            Self::Int(i) | Self::Int64(i) => i,
            Self::Float(f) | Self::Float64(f) => f as i64,
        }
    }

    /// Whether it counts as true.
    pub fn truth(self) -> bool {
        match self {
            Self::Bool(b) => b,
            Self::Int(i) | Self::Int64(i) => i != 0,
            Self::Float(f) | Self::Float64(f) => f != 0.0,
        }
    }

    /// Its element type.
    pub fn dtype(self) -> Dtype {
        match self {
            Self::Bool(_) => Dtype::Bool,
            Self::Int(_) | Self::Int64(_) => Dtype::Int,
            Self::Float(_) | Self::Float64(_) => Dtype::F64,
        }
    }
}
