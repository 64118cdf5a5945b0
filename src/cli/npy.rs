//! Clouds and weights as `.npy` files, with errors that name the file and the remedy.
//!
//! Paths come in, checked shapes of `f64` go out; results are written whole or not at all. Imports
//! [`crate::math`].

use std::fs::{self, File};
use std::io::{BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use ndarray::{ArrayBase, ArrayD, Dimension, OwnedRepr};
use ndarray_npy::{ReadNpyError, ReadNpyExt, WritableElement, WriteNpyExt};

use crate::math::cloud::Point;

/// Reads an array of shape (n, 3) of float32 or float64.
pub fn read_cloud(path: &Path) -> Result<Vec<Point>> {
    let array = read(path)?;
    let [_, 3] = array.shape() else {
        bail!("{}: the array has shape {:?}; a cloud needs shape (n, 3)", path.display(), array.shape());
    };
    let values: Vec<f64> = array.iter().copied().collect();
    Ok(values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
}

/// Reads an array of shape (n,) of float32 or float64.
pub fn read_weights(path: &Path) -> Result<Vec<f64>> {
    let array = read(path)?;
    if array.ndim() != 1 {
        bail!("{}: the array has shape {:?}; weights need shape (n,)", path.display(), array.shape());
    }
    Ok(array.iter().copied().collect())
}

/// Writes an array to a temporary file beside `path`, then renames it.
pub fn write<T: WritableElement, D: Dimension>(
    path: &Path,
    array: &ArrayBase<OwnedRepr<T>, D>,
) -> Result<()> {
    let temporary = temporary_beside(path);
    let written = write_to(&temporary, array).and_then(|()| Ok(fs::rename(&temporary, path)?));
    if written.is_err() {
        // The write's own error is the one to report.
        let _ = fs::remove_file(&temporary);
    }
    written.with_context(|| format!("cannot write {}", path.display()))
}

fn read(path: &Path) -> Result<ArrayD<f64>> {
    let open =
        || File::open(path).map(BufReader::new).with_context(|| format!("cannot open {}", path.display()));
    let found = match ArrayD::<f64>::read_npy(open()?) {
        Err(ReadNpyError::WrongDescriptor(_)) => {
            ArrayD::<f32>::read_npy(open()?).map(|array| array.mapv(f64::from))
        }
        found => found,
    };
    match found {
        Ok(array) => Ok(array),
        Err(ReadNpyError::WrongDescriptor(descriptor)) => bail!(
            "{}: the array has dtype {descriptor}; save it as float32 or float64, for example with \
             numpy.save(path, array.astype(float))",
            path.display()
        ),
        Err(error) => Err(error).with_context(|| {
            format!("{} is not a .npy file that can be read; write it with numpy.save", path.display())
        }),
    }
}

fn write_to<T: WritableElement, D: Dimension>(path: &Path, array: &ArrayBase<OwnedRepr<T>, D>) -> Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    array.write_npy(&mut file)?;
    Ok(file.flush()?)
}

fn temporary_beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}
