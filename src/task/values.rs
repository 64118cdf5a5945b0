//! Checks of single values at the border: each returns the value, or a complaint that names its key.
//!
//! A dotted key and a value as written come in; the value goes out. Imports this module's errors.

use std::ops::RangeInclusive;

use super::error::Complaint;

/// `value` if it is finite and `fits`; `want` completes "must be ..".
pub fn number(key: &str, value: f64, fits: impl Fn(f64) -> bool, want: &str) -> Result<f64, Complaint> {
    if value.is_finite() && fits(value) {
        return Ok(value);
    }
    Err(Complaint::new(key, format!("is {value}, but must be {want}")))
}

/// `value` if it is above 0.
pub fn positive(key: &str, value: f64) -> Result<f64, Complaint> {
    number(key, value, |x| x > 0.0, "a positive number")
}

/// `value` if it is 0 or more.
pub fn not_negative(key: &str, value: f64) -> Result<f64, Complaint> {
    number(key, value, |x| x >= 0.0, "a number that is not negative")
}

/// `values` if none is infinite or not a number.
pub fn all_finite<const N: usize>(key: &str, values: [f64; N]) -> Result<[f64; N], Complaint> {
    values.iter().try_for_each(|v| number(key, *v, |_| true, "finite numbers").map(drop))?;
    Ok(values)
}

/// `values` if all are above 0.
pub fn all_positive<const N: usize>(key: &str, values: [f64; N]) -> Result<[f64; N], Complaint> {
    values.iter().try_for_each(|v| positive(key, *v).map(drop))?;
    Ok(values)
}

/// A count in `limits`.
pub fn count(key: &str, value: usize, limits: RangeInclusive<usize>) -> Result<usize, Complaint> {
    if limits.contains(&value) {
        return Ok(value);
    }
    let problem = format!("is {value}, but must be from {} to {}", limits.start(), limits.end());
    Err(Complaint::new(key, problem))
}

/// A quaternion (w, x, y, z) that can be normalised.
pub fn quaternion(key: &str, q: [f64; 4]) -> Result<[f64; 4], Complaint> {
    let length = all_finite(key, q)?.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length < 1e-6 {
        return Err(Complaint::new(key, "is zero, but must be a rotation; [1, 0, 0, 0] turns nothing"));
    }
    Ok(q)
}

/// A range `[low, high]` within the limits.
pub fn range(key: &str, [low, high]: [f64; 2], limits: [f64; 2]) -> Result<[f64; 2], Complaint> {
    if low <= high && low >= limits[0] && high <= limits[1] {
        return Ok([low, high]);
    }
    let problem = format!(
        "is [{low}, {high}], but must be [low, high] with {} <= low <= high <= {}",
        limits[0], limits[1]
    );
    Err(Complaint::new(key, problem))
}
