//! NumPy's `.npy` and `.npz` files, written so that `numpy.load` reads them without pickle.
//!
//! `ndarray` arrays come in and go out; files are little-endian, uncompressed, and written whole or
//! not at all. Imports only `store::atomic`.
//!
//! Reading an `.npz` is forgiving in the element type (any float, signed integer, `u8` or `bool` becomes
//! `f64`) and strict in the number of dimensions; a single `.npy` holds floats.

use std::fs::File;
use std::io::{BufReader, BufWriter, Cursor, Read};
use std::path::{Path, PathBuf};

use ndarray::{Array, Array2, ArrayD, Dimension, Ix2};
use ndarray_npy::{ReadNpyError, ReadNpyExt, WriteNpyExt};
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::atomic;
use super::error::StoreError;
use crate::math::cloud::Point;

/// Writes one array to `path`.
pub fn write_npy<T: WriteNpyExt + ?Sized>(path: &Path, array: &T) -> Result<(), StoreError> {
    let mut bytes = Vec::new();
    array.write_npy(&mut bytes).map_err(|e| StoreError::write(path)(std::io::Error::other(e)))?;
    atomic::write(path, &bytes)
}

/// Reads a cloud, an array (n, 3) of float32 or float64, from `path`.
pub fn read_cloud(path: &Path) -> Result<Vec<Point>, StoreError> {
    let array = read_floats(path)?;
    let shape = array.shape().to_vec();
    let [_, 3] = shape[..] else {
        let remedy = if let [3, _] = shape[..] { "transpose it" } else { "give one point per row" };
        let reason = format!("its shape is {shape:?}, but a cloud has the shape (n, 3); {remedy}");
        return Err(StoreError::Format { path: path.to_owned(), reason });
    };
    Ok(array.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect())
}

/// Reads one number a row, an array (n,) of float32 or float64, from `path`.
pub fn read_vector(path: &Path) -> Result<Vec<f64>, StoreError> {
    let array = read_floats(path)?;
    if array.ndim() != 1 {
        let reason = format!("its shape is {:?}, not (n,); flatten it with array.ravel()", array.shape());
        return Err(StoreError::Format { path: path.to_owned(), reason });
    }
    Ok(array.iter().copied().collect())
}

/// The one array of a `.npy` file. Integers are refused: as coordinates they are more likely a mistake.
fn read_floats(path: &Path) -> Result<ArrayD<f64>, StoreError> {
    let bytes = std::fs::read(path).map_err(StoreError::read(path))?;
    let found = match ArrayD::<f64>::read_npy(&bytes[..]) {
        Err(ReadNpyError::WrongDescriptor(_)) => {
            ArrayD::<f32>::read_npy(&bytes[..]).map(|array| array.mapv(f64::from))
        }
        found => found,
    };
    found.map_err(|error| {
        let reason = match error {
            ReadNpyError::WrongDescriptor(descriptor) => format!(
                "its element type is {descriptor}; save float32 or float64, for example array.astype(float)"
            ),
            other => format!("{other}; write it with numpy.save"),
        };
        StoreError::Format { path: path.to_owned(), reason }
    })
}

/// A cloud as an array (n, 3).
pub fn cloud_array(cloud: &[Point]) -> Array2<f64> {
    Array2::from_shape_fn((cloud.len(), 3), |(i, a)| cloud[i][a])
}

/// Tries the element types in the order of their likelihood until one fits the bytes of a `.npy` file.
fn decode<D: Dimension>(bytes: &[u8]) -> Result<Array<f64, D>, String> {
    macro_rules! attempt {
        ($($t:ty => $to_f64:expr),+) => {$(
            match Array::<$t, D>::read_npy(bytes) {
                Err(ReadNpyError::WrongDescriptor(_)) => {}
                other => return other.map(|a| a.mapv($to_f64)).map_err(|e| e.to_string()),
            }
        )+};
    }
    attempt!(f64 => |v| v, f32 => f64::from, i64 => |v| v as f64, i32 => f64::from,
             u8 => f64::from, bool => |v| f64::from(u8::from(v)));
    Err("its element type is none of f64, f32, i64, i32, u8, bool".to_owned())
}

/// The rows of an (n, 3) array.
fn points(array: Array2<f64>) -> Result<Vec<Point>, String> {
    if array.ncols() != 3 {
        return Err(format!("its shape is {:?}, but a cloud has the shape (n, 3)", array.shape()));
    }
    Ok(array.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect())
}

/// Collects arrays, then writes them as one `.npz` file.
pub struct Writer {
    path: PathBuf,
    zip: ZipWriter<Cursor<Vec<u8>>>,
}

impl Writer {
    /// A writer of `path`; nothing is on disk before [`Writer::finish`].
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), zip: ZipWriter::new(Cursor::default()) }
    }

    /// Adds one array. `name` may contain `/`.
    pub fn add<T: WriteNpyExt + ?Sized>(&mut self, name: &str, array: &T) -> Result<(), StoreError> {
        // Zip's own time stamp stays at 1980: the same run gives the same bytes.
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        self.zip
            .start_file(format!("{name}.npy"), options.large_file(true))
            .map_err(|e| e.to_string())
            .and_then(|()| array.write_npy(BufWriter::new(&mut self.zip)).map_err(|e| e.to_string()))
            .map_err(|reason| StoreError::Entry { path: self.path.clone(), entry: name.to_owned(), reason })
    }

    /// Writes the file, whole or not at all.
    pub fn finish(self) -> Result<(), StoreError> {
        let Self { path, zip } = self;
        let bytes = zip.finish().map_err(|e| StoreError::write(&path)(e.into()))?;
        atomic::write(&path, &bytes.into_inner())
    }
}

/// An `.npz` file opened for reading.
pub struct Reader {
    path: PathBuf,
    names: Vec<String>,
    zip: ZipArchive<BufReader<File>>,
}

impl Reader {
    /// Opens `path` and lists what it holds.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        let file = File::open(path).map_err(StoreError::read(path))?;
        let zip = ZipArchive::new(BufReader::new(file))
            .map_err(|e| StoreError::Format { path: path.to_owned(), reason: e.to_string() })?;
        let names = zip.file_names().map(|n| n.strip_suffix(".npy").unwrap_or(n).to_owned()).collect();
        Ok(Self { path: path.to_owned(), names, zip })
    }

    /// The names of the arrays, in file order, without `.npy`.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Whether there is an array of that name.
    pub fn has(&self, name: &str) -> bool {
        self.names.iter().any(|n| n == name)
    }

    /// Reads an array as `f64`; the number of dimensions has to be `D`'s.
    pub fn array<D: Dimension>(&mut self, name: &str) -> Result<Array<f64, D>, StoreError> {
        if !self.has(name) {
            return Err(StoreError::MissingEntry {
                path: self.path.clone(),
                entry: name.to_owned(),
                available: self.names.join(", "),
            });
        }
        let bytes = self.bytes(name).map_err(|e| self.entry_error(name, e.to_string()))?;
        decode(&bytes).map_err(|reason| self.entry_error(name, reason))
    }

    fn bytes(&mut self, name: &str) -> Result<Vec<u8>, ZipError> {
        let mut bytes = Vec::new();
        self.zip.by_name(&format!("{name}.npy"))?.read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    /// Reads a cloud, an array (n, 3).
    pub fn cloud(&mut self, name: &str) -> Result<Vec<Point>, StoreError> {
        let array = self.array::<Ix2>(name)?;
        points(array).map_err(|reason| self.entry_error(name, reason))
    }

    /// An error about one array of this file.
    pub fn entry_error(&self, name: &str, reason: impl Into<String>) -> StoreError {
        StoreError::Entry { path: self.path.clone(), entry: name.to_owned(), reason: reason.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array1, Array3, Ix1, Ix3, arr0};

    #[test]
    fn arrays_come_back_whatever_their_type_and_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        let positions = Array3::<f32>::from_shape_fn((2, 4, 3), |(t, i, a)| (t * 12 + i * 3 + a) as f32);
        let mut w = Writer::new(&path);
        w.add("step1/dough", &positions).unwrap();
        w.add("tool", &Array1::<i32>::from(vec![-1, 0, 1])).unwrap();
        w.add("loss", &arr0(2.5f64)).unwrap();
        w.finish().unwrap();

        let mut r = Reader::open(&path).unwrap();
        assert_eq!(r.names(), ["step1/dough", "tool", "loss"]);
        assert_eq!(r.array::<Ix3>("step1/dough").unwrap(), positions.mapv(f64::from));
        assert_eq!(r.array::<Ix1>("tool").unwrap().to_vec(), [-1.0, 0.0, 1.0]);
        assert_eq!(r.array::<ndarray::Ix0>("loss").unwrap()[()], 2.5);
    }

    #[test]
    fn fortran_order_is_read_as_the_same_array() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("f.npy");
        let cloud = cloud_array(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        let mut fortran = Array2::<f64>::zeros(ndarray::ShapeBuilder::f((2, 3)));
        fortran.assign(&cloud);
        write_npy(&path, &fortran).unwrap();
        assert_eq!(read_cloud(&path).unwrap(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    }

    #[test]
    fn errors_name_the_file_and_the_entry() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        let mut w = Writer::new(&path);
        w.add("x0", &Array1::<f64>::zeros(3)).unwrap();
        w.finish().unwrap();
        let mut r = Reader::open(&path).unwrap();
        let missing = r.cloud("target").unwrap_err().to_string();
        assert!(missing.contains("a.npz") && missing.contains("`target`") && missing.contains("x0"));
        let flat = r.cloud("x0").unwrap_err().to_string();
        assert!(flat.contains("`x0`") && flat.contains("ndim"), "{flat}");
        std::fs::write(&path, b"not a zip").unwrap();
        assert!(Reader::open(&path).err().unwrap().to_string().contains("a.npz"));
        let absent = read_cloud(&dir.path().join("none.npy")).unwrap_err().to_string();
        assert!(absent.contains("none.npy"), "{absent}");
    }
}
