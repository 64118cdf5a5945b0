//! The table of numpy: one row a function, gathered from the areas of the library.
//!
//! A name comes in, its row goes out; a name without a row does not exist. Rows of one area stand in that
//! area's file; the element-by-element functions stand here. Imports the areas.

use std::collections::HashMap;
use std::sync::LazyLock;

use super::args::Row;
use super::elementwise::Op;
use super::{
    numpy_create, numpy_grid, numpy_join, numpy_linalg, numpy_logic, numpy_place, numpy_reduce, numpy_series,
    numpy_shape, numpy_sort,
};

/// Functions that work on every element, and on every pair of elements.
const ELEMENTWISE: &[Row] = &[
    Row::unary("sin", f64::sin),
    Row::unary("cos", f64::cos),
    Row::unary("tan", f64::tan),
    Row::unary("arcsin", f64::asin),
    Row::unary("arccos", f64::acos),
    Row::unary("arctan", f64::atan),
    Row::unary("asin", f64::asin),
    Row::unary("acos", f64::acos),
    Row::unary("atan", f64::atan),
    Row::unary("sinh", f64::sinh),
    Row::unary("cosh", f64::cosh),
    Row::unary("tanh", f64::tanh),
    Row::unary("arcsinh", f64::asinh),
    Row::unary("arccosh", f64::acosh),
    Row::unary("arctanh", f64::atanh),
    Row::unary("exp", f64::exp),
    Row::unary("exp2", f64::exp2),
    Row::unary("expm1", f64::exp_m1),
    Row::unary("log", f64::ln),
    Row::unary("log2", f64::log2),
    Row::unary("log10", f64::log10),
    Row::unary("log1p", f64::ln_1p),
    Row::unary("sqrt", f64::sqrt),
    Row::unary("cbrt", f64::cbrt),
    Row::unary("reciprocal", |x| 1.0 / x),
    Row::unary("fabs", f64::abs),
    Row::unary("deg2rad", |x| x * (std::f64::consts::PI / 180.0)),
    Row::unary("radians", |x| x * (std::f64::consts::PI / 180.0)),
    Row::unary("rad2deg", |x| x * (180.0 / std::f64::consts::PI)),
    Row::unary("degrees", |x| x * (180.0 / std::f64::consts::PI)),
    Row::unary("sinc", sinc),
    Row::binary("add", Op::Add),
    Row::binary("subtract", Op::Subtract),
    Row::binary("multiply", Op::Multiply),
    Row::binary("divide", Op::Divide),
    Row::binary("true_divide", Op::Divide),
    Row::binary("floor_divide", Op::FloorDivide),
    Row::binary("mod", Op::Remainder),
    Row::binary("remainder", Op::Remainder),
    Row::binary("fmod", Op::Fmod),
    Row::binary("power", Op::Power),
    Row::binary("pow", Op::Power),
    Row::binary("float_power", Op::Power),
    Row::binary("maximum", Op::Maximum),
    Row::binary("minimum", Op::Minimum),
    Row::binary("fmax", Op::Maximum),
    Row::binary("fmin", Op::Minimum),
    Row::binary("arctan2", Op::Arctan2),
    Row::binary("atan2", Op::Arctan2),
    Row::binary("hypot", Op::Hypot),
    Row::binary("copysign", Op::Copysign),
    Row::binary("equal", Op::Equal),
    Row::binary("not_equal", Op::NotEqual),
    Row::binary("less", Op::Less),
    Row::binary("less_equal", Op::LessEqual),
    Row::binary("greater", Op::Greater),
    Row::binary("greater_equal", Op::GreaterEqual),
    Row::binary("logical_and", Op::LogicalAnd),
    Row::binary("logical_or", Op::LogicalOr),
    Row::binary("logical_xor", Op::LogicalXor),
    Row::binary("bitwise_and", Op::BitAnd),
    Row::binary("bitwise_or", Op::BitOr),
    Row::binary("bitwise_xor", Op::BitXor),
    Row::binary("left_shift", Op::ShiftLeft),
    Row::binary("right_shift", Op::ShiftRight),
];

fn sinc(x: f64) -> f64 {
    let y = std::f64::consts::PI * x;
    if y == 0.0 { 1.0 } else { y.sin() / y }
}

/// All areas.
const TABLES: &[&[Row]] = &[
    ELEMENTWISE,
    numpy_create::ROWS,
    numpy_shape::ROWS,
    numpy_join::ROWS,
    numpy_grid::ROWS,
    numpy_reduce::ROWS,
    numpy_logic::ROWS,
    numpy_sort::ROWS,
    numpy_place::ROWS,
    numpy_series::ROWS,
    numpy_linalg::ROWS,
];

static BY_NAME: LazyLock<HashMap<&'static str, &'static Row>> =
    LazyLock::new(|| TABLES.iter().flat_map(|t| t.iter()).map(|row| (row.name, row)).collect());

/// The row of a name.
pub fn named(name: &str) -> Option<&'static Row> {
    BY_NAME.get(name).copied()
}

/// All names, for suggestions.
pub fn names() -> impl Iterator<Item = &'static str> {
    TABLES.iter().flat_map(|t| t.iter()).map(|row| row.name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_has_two_rows() {
        let mut all: Vec<&str> = names().collect();
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count);
    }

    #[test]
    fn required_parameters_stand_before_optional_ones() {
        for row in TABLES.iter().flat_map(|t| t.iter()) {
            let parameters: Vec<&str> = row.signature.split_whitespace().collect();
            let first_optional = parameters.iter().position(|p| p.ends_with('?')).unwrap_or(parameters.len());
            let late = parameters[first_optional..].iter().find(|p| !p.ends_with('?') && !p.starts_with('*'));
            assert!(late.is_none(), "{}: {:?}", row.name, late);
        }
    }
}
