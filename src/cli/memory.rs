//! `--memory-limit`, shared by the commands that simulate.
//!
//! A size with its unit comes in, bytes go out. Imports clap.

use clap::Args;

/// Units of a size and their bytes.
const UNITS: [(&str, f64); 6] =
    [("KiB", 1024.0), ("MiB", 1048576.0), ("GiB", 1073741824.0), ("kB", 1e3), ("MB", 1e6), ("GB", 1e9)];

/// How much memory gradients may take.
#[derive(Args, Clone, Copy, Debug)]
pub struct MemoryArgs {
    /// Memory for the substeps that a gradient goes back through, as 600MiB or 2GiB. Control steps beyond it are
    /// run a second time, which takes a third longer and changes no bit of the result.
    #[arg(long, value_name = "SIZE", default_value = "4GiB", value_parser = bytes)]
    pub memory_limit: usize,
}

/// Bytes of a size such as `600MiB`, `1.5 GiB` or `0MiB`.
fn bytes(size: &str) -> Result<usize, String> {
    let known = || UNITS.map(|(unit, _)| unit).join(", ");
    let (number, scale) = UNITS
        .iter()
        .find_map(|(unit, scale)| size.strip_suffix(unit).map(|number| (number.trim_end(), scale)))
        .ok_or_else(|| format!("a size needs a unit, one of {}: 600MiB", known()))?;
    match number.parse::<f64>() {
        Ok(count) if count >= 0.0 && count.is_finite() => Ok((count * scale) as usize),
        _ => Err(format!("`{number}` is not a number of bytes")),
    }
}

#[cfg(test)]
mod tests {
    use super::bytes;

    #[test]
    fn sizes_have_units() {
        assert_eq!(bytes("600MiB"), Ok(600 << 20));
        assert_eq!(bytes("1.5 GiB"), Ok(3 << 29));
        assert_eq!(bytes("20kB"), Ok(20_000));
        assert_eq!(bytes("0MiB"), Ok(0));
        for wrong in ["600", "MiB", "-1GiB", "1 TiB", "infGiB", "NaNMiB", "4gib"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }
}
