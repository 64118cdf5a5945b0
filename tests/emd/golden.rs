//! The golden cases: inputs and results of GeomLoss 0.3.1 (float64) and POT 0.9.7.

use std::fs::File;
use std::path::{Path, PathBuf};

use donut::math::cloud::Point;
use ndarray::{ArrayD, IxDyn, OwnedRepr};
use ndarray_npy::NpzReader;

pub struct Golden {
    pub name: String,
    reader: NpzReader<File>,
}

impl Golden {
    /// Every case under tests/data/emd, by name.
    pub fn all() -> Vec<Self> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/emd");
        let mut paths: Vec<PathBuf> = folder.read_dir().unwrap().map(|e| e.unwrap().path()).collect();
        paths.sort();
        assert!(paths.len() >= 21, "golden cases are missing");
        paths
            .into_iter()
            .map(|path| Self {
                name: path.file_stem().unwrap().to_string_lossy().into_owned(),
                reader: NpzReader::new(File::open(path).unwrap()).unwrap(),
            })
            .collect()
    }

    pub fn array(&mut self, key: &str) -> Vec<f64> {
        let name = &self.name;
        let array: ArrayD<f64> = self
            .reader
            .by_name::<OwnedRepr<f64>, IxDyn>(key)
            .unwrap_or_else(|e| panic!("{name}: {key}: {e}"));
        array.iter().copied().collect()
    }

    pub fn cloud(&mut self, key: &str) -> Vec<Point> {
        self.array(key).chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
    }

    pub fn number(&mut self, key: &str) -> f64 {
        self.array(key)[0]
    }

    pub fn p(&mut self) -> u8 {
        let p = self.reader.by_name::<OwnedRepr<i64>, IxDyn>("p").unwrap();
        u8::try_from(p[IxDyn(&[])]).unwrap()
    }

    pub fn is_weighted(&mut self) -> bool {
        self.reader.by_name::<OwnedRepr<bool>, IxDyn>("weighted").unwrap().iter().any(|&w| w)
    }
}
