//! `np.einsum` in its explicit and implicit forms. `...` stands for axes that stretch to each other, which get
//! letters of their own.
//!
//! A formula such as `"ij,kj->ki"` and operands come in, the contracted array goes out; every product is
//! charged. Imports arguments, arrays, conversions, faults.

use std::collections::BTreeMap;

use super::args::Call;
use super::array::Array;
use super::convert::{check_dimensions, to_array};
use super::error::Fault;
use super::value::Value;

/// Runs the call.
pub fn einsum(c: &Call) -> Result<Value, Fault> {
    let operands: Vec<Array> =
        c.rest.iter().map(|v| to_array(&c.eval.budget, v, None)).collect::<Result<_, _>>()?;
    let formula: String = c.text(0)?.chars().filter(|ch| !ch.is_whitespace()).collect();
    let formula = spelt_out(c, &formula, &operands)?;
    let (inputs, output) = match formula.split_once("->") {
        Some((inputs, output)) => (inputs.to_owned(), output.to_owned()),
        None => (formula.clone(), implicit_output(&formula)),
    };
    if !formula
        .chars()
        .all(|ch| ch.is_ascii_alphabetic() || matches!(ch, ',' | '-' | '>') || STRETCHED.contains(ch))
    {
        return Err(c.problem("the formula may hold letters, commas, ... and -> only"));
    }
    let terms: Vec<&str> = inputs.split(',').collect();
    if terms.len() != c.rest.len() {
        return Err(c.problem(format!("{} terms for {} operands", terms.len(), c.rest.len())));
    }
    let lengths = lengths(c, &terms, &operands)?;
    let summed: Vec<char> = lengths.keys().copied().filter(|ch| !output.contains(*ch)).collect();
    let letters: Vec<char> = output.chars().chain(summed.iter().copied()).collect();
    if let Some(unknown) = output.chars().find(|ch| !lengths.contains_key(ch)) {
        return Err(c.problem(format!("`{unknown}` stands in the result only")));
    }
    check_dimensions(vec![1; letters.len()])?;
    let shape: Vec<usize> = letters.iter().map(|ch| lengths[ch]).collect();
    c.eval.budget.allocate_shape(&shape)?;
    let mut product: Option<Vec<f64>> = None;
    for (term, operand) in terms.iter().zip(&operands) {
        let stretched = aligned(operand, term, &letters).broadcast(&shape)?.to_floats();
        product = Some(match product {
            None => stretched,
            Some(all) => all.into_iter().zip(stretched).map(|(x, y)| x * y).collect(),
        });
    }
    let lane: usize = summed.iter().map(|ch| lengths[ch]).product();
    let shape = shape[..output.len()].to_vec();
    let count = shape.iter().product();
    let product = product.unwrap_or_default();
    let all = (0..count).map(|i: usize| product[i * lane..(i + 1) * lane].iter().sum()).collect();
    let dtype =
        operands.iter().map(Array::dtype).reduce(|a, b| a.promote(b)).unwrap_or(super::scalar::Dtype::F64);
    Ok(Value::array(Array::floats_as(all, dtype, shape)))
}

/// Letters for the axes of `...`, the last axis first; they sort before those that may be written.
const STRETCHED: &str = "987654321";

/// The formula with letters in the place of every `...`.
fn spelt_out(c: &Call, formula: &str, operands: &[Array]) -> Result<String, Fault> {
    if !formula.contains("...") {
        return Ok(formula.to_owned());
    }
    if formula.chars().any(|ch| ch.is_ascii_digit()) {
        return Err(c.problem("the formula may hold letters, commas, ... and -> only"));
    }
    let (inputs, output) = formula.split_once("->").map_or((formula, None), |(i, o)| (i, Some(o)));
    let letters = |count: usize| STRETCHED[..count].chars().rev().collect::<String>();
    let (mut terms, mut most) = (Vec::new(), 0);
    for (term, operand) in inputs.split(',').zip(operands) {
        let written = term.chars().filter(|ch| *ch != '.').count();
        let axes = operand.ndim().saturating_sub(written);
        if axes > STRETCHED.len() {
            return Err(c.problem(format!("`...` is supported for up to {} axes", STRETCHED.len())));
        }
        most = if term.contains("...") { axes.max(most) } else { most };
        terms.push(term.replacen("...", &letters(axes), 1));
    }
    if inputs.split(',').count() != operands.len() {
        return Err(c.problem(format!(
            "{} terms for {} operands",
            inputs.split(',').count(),
            operands.len()
        )));
    }
    let terms = terms.join(",");
    let output = match output {
        Some(output) => output.replacen("...", &letters(most), 1),
        // The stretched axes stand in front of the letters that stand once.
        None => letters(most) + &implicit_output(&inputs.replace("...", "")),
    };
    Ok(format!("{terms}->{output}"))
}

/// Without `->` the result has the letters that stand once, in alphabetical order.
fn implicit_output(formula: &str) -> String {
    let mut count = BTreeMap::new();
    formula.chars().filter(|ch| *ch != ',').for_each(|ch| *count.entry(ch).or_insert(0) += 1);
    count.into_iter().filter(|&(_, n)| n == 1).map(|(ch, _)| ch).collect()
}

fn lengths(c: &Call, terms: &[&str], operands: &[Array]) -> Result<BTreeMap<char, usize>, Fault> {
    let mut lengths = BTreeMap::new();
    for (term, operand) in terms.iter().zip(operands) {
        if term.len() != operand.ndim() {
            return Err(c.problem(format!("`{term}` does not fit an array with {} axes", operand.ndim())));
        }
        for (ch, &n) in term.chars().zip(operand.shape()) {
            if term.matches(ch).count() > 1 {
                return Err(c.problem("a letter may stand once in a term; use np.trace or np.diag"));
            }
            let known = lengths.entry(ch).or_insert(n);
            if STRETCHED.contains(ch) && *known == 1 {
                *known = n;
            }
            if *known != n && !(STRETCHED.contains(ch) && n == 1) {
                return Err(c.problem(format!("`{ch}` stands for axes of different lengths")));
            }
        }
    }
    Ok(lengths)
}

/// The operand with its axes in the order of `letters`, and axes of length one for those it lacks.
fn aligned(operand: &Array, term: &str, letters: &[char]) -> Array {
    let order: Vec<usize> = letters.iter().filter_map(|&ch| term.find(ch)).collect();
    let mut out = operand.permute(&order);
    for (at, &ch) in letters.iter().enumerate() {
        if !term.contains(ch) {
            out = out.insert_axis(at);
        }
    }
    out
}
