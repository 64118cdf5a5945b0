//! `np.linalg` where a matrix is taken apart: singular values, eigenvalues of symmetric matrices, QR, least squares.
//!
//! Matrices come in, their parts go out. Singular vectors and eigenvectors are LAPACK's up to their signs, which no
//! definition fixes; the work is charged first and stops after a number of sweeps. Imports arguments, arrays, faults.

use nalgebra::{DMatrix, DVector, SVD, SymmetricEigen};

use super::args::{Call, Row};
use super::array::Array;
use super::error::Fault;
use super::value::Value;

/// The rows of `np.linalg`.
pub const ROWS: &[Row] = &[
    Row::new("svd", "a full_matrices? compute_uv? hermitian?", svd),
    Row::new("svdvals", "x", |c| Ok(vector(&decomposed(c, matrix(c, 0)?)?.1))),
    Row::new("eigh", "a UPLO?", |c| eigen(c).map(|(values, vectors)| Value::tuple(vec![values, vectors]))),
    Row::new("eigvalsh", "a UPLO?", |c| eigen(c).map(|(values, _)| values)),
    Row::new("eig", "a", |c| symmetric(c).and_then(|()| eigen(c)).map(|(w, v)| Value::tuple(vec![w, v]))),
    Row::new("eigvals", "a", |c| symmetric(c).and_then(|()| eigen(c)).map(|(values, _)| values)),
    Row::new("qr", "a mode?", qr),
    Row::new("pinv", "a rcond? hermitian? rtol?", pinv),
    Row::new("lstsq", "a b rcond?", lstsq),
    Row::new("matrix_rank", "A tol?", |c| {
        let a = matrix(c, 0)?;
        let longest = a.nrows().max(a.ncols()) as f64;
        let values = decomposed(c, a)?.1;
        let limit = c.float_or(1, values.first().unwrap_or(&0.0) * longest * EPSILON)?;
        Ok(Value::count(values.iter().filter(|&&s| s > limit).count()))
    }),
    Row::new("cond", "x", |c| {
        let values = decomposed(c, matrix(c, 0)?)?.1;
        Ok(Value::float64(values.first().unwrap_or(&f64::NAN) / values.last().unwrap_or(&f64::NAN)))
    }),
    Row::new("cholesky", "a", cholesky),
];

/// The relative precision of a double.
pub const EPSILON: f64 = f64::EPSILON;
/// Sweeps after which an iteration has failed: some tens do for any matrix.
pub const SWEEPS: usize = 10_000;

/// Charges a decomposition of a matrix with these sides.
pub fn work(c: &Call, rows: usize, columns: usize) -> Result<(), Fault> {
    c.eval.budget.allocate_shape(&[rows, columns])?;
    let cube = rows.saturating_mul(columns).saturating_mul(rows.min(columns));
    c.eval.budget.charge(cube.saturating_mul(8))
}

fn matrix(c: &Call, at: usize) -> Result<DMatrix<f64>, Fault> {
    let a = c.array(at)?;
    let [rows, columns] = *a.shape() else { return Err(c.problem("takes a matrix")) };
    work(c, rows, columns)?;
    let all = a.to_floats();
    if rows == 0 || columns == 0 || all.iter().any(|x| !x.is_finite()) {
        return Err(Fault::Singular(format!("{}(): the matrix is empty or not finite", c.name)));
    }
    Ok(DMatrix::from_row_slice(rows, columns, &all))
}

fn array(m: &DMatrix<f64>) -> Value {
    Value::Array(Array::floats(m.transpose().as_slice().to_vec(), vec![m.nrows(), m.ncols()]))
}

fn vector(v: &[f64]) -> Value {
    Value::Array(Array::floats(v.to_vec(), vec![v.len()]))
}

fn no_result(c: &Call) -> Fault {
    Fault::Singular(format!("{}(): no result for this matrix", c.name))
}

type Parts = (DMatrix<f64>, Vec<f64>, DMatrix<f64>);

/// `u`, the singular values from the largest, and `v` transposed, both thin.
fn decomposed(c: &Call, a: DMatrix<f64>) -> Result<Parts, Fault> {
    let mut svd = SVD::try_new_unordered(a, true, true, EPSILON, SWEEPS).ok_or_else(|| no_result(c))?;
    svd.sort_by_singular_values();
    let values = svd.singular_values.as_slice().to_vec();
    match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) => Ok((u, values, v_t)),
        _ => Err(no_result(c)),
    }
}

fn svd(c: &Call) -> Result<Value, Fault> {
    let (mut u, values, mut v_t) = decomposed(c, matrix(c, 0)?)?;
    if !c.flag(2, true)? {
        return Ok(vector(&values));
    }
    if c.flag(1, true)? {
        u = completed(c, u)?;
        v_t = completed(c, v_t.transpose())?.transpose();
    }
    Ok(Value::tuple(vec![array(&u), vector(&values), array(&v_t)]))
}

/// The reflections that make a matrix upper triangular one after the other, and what they make of it. As in
/// LAPACK a column that has nothing below its diagonal is left as it is.
fn reflected(mut a: DMatrix<f64>) -> (Vec<DVector<f64>>, DMatrix<f64>) {
    let mut mirrors = Vec::new();
    for j in 0..a.ncols().min(a.nrows()) {
        let mut mirror = a.column(j).into_owned();
        mirror.rows_mut(0, j).fill(0.0);
        if mirror.rows_range(j + 1..).iter().all(|x| *x == 0.0) {
            mirror.fill(0.0);
        } else {
            mirror[j] += mirror.norm().copysign(mirror[j]);
            mirror.normalize_mut();
        }
        reflect(&mut a, &mirror);
        mirrors.push(mirror);
    }
    a.fill_lower_triangle(0.0, 1);
    (mirrors, a)
}

fn reflect(a: &mut DMatrix<f64>, mirror: &DVector<f64>) {
    let along = a.tr_mul(mirror);
    a.ger(-2.0, mirror, &along, 1.0);
}

/// The first columns of the product of reflections.
fn product(mirrors: &[DVector<f64>], rows: usize, columns: usize) -> DMatrix<f64> {
    let mut q = DMatrix::identity(rows, columns);
    mirrors.iter().rev().for_each(|mirror| reflect(&mut q, mirror));
    q
}

/// Charges the product of `count` reflections.
fn square_work(c: &Call, rows: usize, count: usize) -> Result<(), Fault> {
    c.eval.budget.allocate_shape(&[rows, rows])?;
    c.eval.budget.charge(rows.saturating_mul(rows).saturating_mul(count).saturating_mul(2))
}

/// A matrix with orthonormal columns, and more behind them up to a square.
fn completed(c: &Call, thin: DMatrix<f64>) -> Result<DMatrix<f64>, Fault> {
    let (n, k) = (thin.nrows(), thin.ncols());
    if n == k {
        return Ok(thin);
    }
    square_work(c, n, k)?;
    let mut square = product(&reflected(thin.clone()).0, n, n);
    square.columns_mut(0, k).copy_from(&thin);
    Ok(square)
}

/// Eigenvalues in rising order, and the vectors as columns.
fn eigen(c: &Call) -> Result<(Value, Value), Fault> {
    let a = matrix(c, 0)?;
    if !a.is_square() {
        return Err(c.problem("takes a square matrix"));
    }
    // Only the lower triangle counts, as in numpy.
    let lower = DMatrix::from_fn(a.nrows(), a.nrows(), |i, j| a[(i.max(j), i.min(j))]);
    let made = SymmetricEigen::try_new(lower, EPSILON, SWEEPS).ok_or_else(|| no_result(c))?;
    let mut order: Vec<usize> = (0..a.nrows()).collect();
    order.sort_by(|&i, &j| made.eigenvalues[i].total_cmp(&made.eigenvalues[j]));
    let values: Vec<f64> = order.iter().map(|&i| made.eigenvalues[i]).collect();
    let columns: Vec<_> = order.iter().map(|&i| made.eigenvectors.column(i)).collect();
    Ok((vector(&values), array(&DMatrix::from_columns(&columns))))
}

/// `eig` is supported where it is `eigh`.
fn symmetric(c: &Call) -> Result<(), Fault> {
    let a = matrix(c, 0)?;
    let size = a.amax();
    if a.is_square() && (&a - a.transpose()).amax() <= 1e-12 * size {
        return Ok(());
    }
    Err(Fault::unsupported(
        format!("np.linalg.{} of a matrix that is not symmetric", c.name),
        "use np.linalg.svd or np.linalg.eigh",
    ))
}

fn qr(c: &Call) -> Result<Value, Fault> {
    let a = matrix(c, 0)?;
    let mode = if c.opt(1).is_some() { c.text(1)? } else { "reduced" };
    if !matches!(mode, "reduced" | "r" | "complete") {
        return Err(c.problem("`mode` must be 'reduced', 'complete' or 'r'"));
    }
    let (n, thin) = (a.nrows(), a.nrows().min(a.ncols()));
    let columns = if mode == "complete" { n } else { thin };
    square_work(c, columns, thin)?;
    let (mirrors, r) = reflected(a);
    let r = array(&r.rows(0, columns).into_owned());
    Ok(if mode == "r" { r } else { Value::tuple(vec![array(&product(&mirrors, n, columns)), r]) })
}

fn pinv(c: &Call) -> Result<Value, Fault> {
    let a = matrix(c, 0)?;
    let longest = a.nrows().max(a.ncols()) as f64;
    let (u, values, v_t) = decomposed(c, a)?;
    let share = c.float_or(1, c.float_or(3, longest * EPSILON)?)?;
    let limit = share * values.first().unwrap_or(&0.0);
    let inverse = |s: &f64| if *s > limit { 1.0 / s } else { 0.0 };
    let scaled = DMatrix::from_diagonal(&DVector::from_iterator(values.len(), values.iter().map(inverse)));
    Ok(array(&(v_t.transpose() * scaled * u.transpose())))
}

/// The shortest solution of the least squares, where singular values below `share` of the largest are nothing.
pub fn least_squares(c: &Call, a: DMatrix<f64>, b: &DVector<f64>, share: f64) -> Result<DVector<f64>, Fault> {
    if a.iter().chain(b.iter()).any(|x| !x.is_finite()) {
        return Err(no_result(c));
    }
    let (u, values, v_t) = decomposed(c, a)?;
    let limit = share * values.first().unwrap_or(&0.0);
    let mut along = u.tr_mul(b);
    along.iter_mut().zip(&values).for_each(|(x, s)| *x = if *s > limit { *x / s } else { 0.0 });
    Ok(v_t.tr_mul(&along))
}

fn lstsq(c: &Call) -> Result<Value, Fault> {
    let (a, b) = (matrix(c, 0)?, c.array(1)?);
    let (rows, columns) = (a.nrows(), a.ncols());
    if !(1..=2).contains(&b.ndim()) || b.shape()[0] != rows {
        return Err(c.problem("the right-hand side must have as many rows as the matrix"));
    }
    let sides = b.size() / rows;
    c.eval.budget.charge(rows.saturating_mul(columns).saturating_mul(sides))?;
    let share = c.float_or(2, rows.max(columns) as f64 * EPSILON)?;
    let share = if share < 0.0 { EPSILON } else { share };
    let values = decomposed(c, a.clone())?.1;
    let rank = values.iter().filter(|&&s| s > share * values[0]).count();
    let right = DMatrix::from_row_slice(rows, sides, &b.to_floats());
    let (mut solution, mut residuals) = (Vec::new(), Vec::new());
    for side in right.column_iter() {
        let side = side.into_owned();
        work(c, rows, columns)?;
        let solved = least_squares(c, a.clone(), &side, share)?;
        residuals.push((&a * &solved - side).norm_squared());
        solution.push(solved);
    }
    let solved =
        Array::floats(solution.iter().flat_map(|s| s.iter().copied()).collect(), vec![sides, columns]);
    let solved = if b.ndim() == 1 { solved.reshape(vec![columns]) } else { solved.permute(&[1, 0]).copy() };
    if rank < columns || rows <= columns {
        residuals.clear();
    }
    let parts = vec![Value::Array(solved), vector(&residuals), Value::count(rank), vector(&values)];
    Ok(Value::tuple(parts))
}

fn cholesky(c: &Call) -> Result<Value, Fault> {
    let a = matrix(c, 0)?;
    let none = || Fault::Singular("cholesky(): the matrix is not positive definite".into());
    let factor = if a.is_square() { a.cholesky() } else { None };
    factor.map(|f| array(&f.l())).ok_or_else(none)
}
