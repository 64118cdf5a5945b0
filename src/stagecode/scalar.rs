//! One number, and what type of elements arrays have.
//!
//! Python's numbers and numpy's elements come in and go out as the same three kinds; a cast is numpy's. Imports nothing.

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
}

impl Scalar {
    /// As a float.
    pub fn float(self) -> f64 {
        match self {
            Self::Bool(b) => f64::from(u8::from(b)),
            Self::Int(i) => i as f64,
            Self::Float(f) => f,
        }
    }

    /// As an integer, cutting off a fraction as numpy's casts do.
    pub fn int(self) -> i64 {
        match self {
            Self::Bool(b) => i64::from(b),
            Self::Int(i) => i,
            Self::Float(f) => f as i64,
        }
    }

    /// Whether it counts as true.
    pub fn truth(self) -> bool {
        match self {
            Self::Bool(b) => b,
            Self::Int(i) => i != 0,
            Self::Float(f) => f != 0.0,
        }
    }

    /// Its element type.
    pub fn dtype(self) -> Dtype {
        match self {
            Self::Bool(_) => Dtype::Bool,
            Self::Int(_) => Dtype::Int,
            Self::Float(_) => Dtype::F64,
        }
    }
}
