//! The frames and clouds of a run in few bytes, for the report to carry.
//!
//! Clouds come in; base64 text goes out: 16-bit coordinates, differences between frames, deflated part by part, the
//! parts a line each. Imports `math` only.
//!
//! The bytes before deflating: for every frame and then every cloud, the low bytes of all x, all y, all
//! z, then their high bytes in the same order. A frame holds the differences to the frame before
//! (the first one, and every cloud, to zero), wrapped to 16 bits and folded so that small ones of either
//! sign are small: d -> (d << 1) ^ (d >> 15). `report.js` does the reverse.

use std::io::Write;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use crate::math::cloud::Bounds;

/// Bytes that are deflated by themselves, on any thread: many times what deflating looks back, 32 KiB.
const PART: usize = 1 << 20;

/// Collects frames and clouds; all coordinates are fractions of one box.
pub struct Packer {
    bounds: Bounds,
    bytes: Vec<u8>,
    /// The frame before, as 16-bit coordinates, axis by axis.
    before: Vec<u16>,
}

impl Packer {
    /// A packer of points within `bounds`; what lies outside is moved to its surface.
    pub fn new(bounds: Bounds) -> Self {
        Self { bounds, bytes: Vec::new(), before: Vec::new() }
    }

    /// Adds the next frame; every frame has the same number of points.
    pub fn frame(&mut self, points: impl Iterator<Item = [f32; 3]> + Clone) {
        let coordinates = self.quantised(points);
        self.before.resize(coordinates.len(), 0);
        let before = std::mem::replace(&mut self.before, coordinates);
        let folded = self.before.iter().zip(&before).map(|(&now, &then)| fold(now.wrapping_sub(then)));
        put(&mut self.bytes, folded);
    }

    /// Adds a cloud of its own.
    pub fn cloud(&mut self, points: impl Iterator<Item = [f32; 3]> + Clone) {
        let coordinates = self.quantised(points);
        put(&mut self.bytes, coordinates.into_iter().map(fold));
    }

    /// All of it as base64.
    pub fn finish(self) -> String {
        let parts: Vec<String> = self.bytes.par_chunks(PART).map(deflated).collect();
        parts.join("\n")
    }

    /// 16-bit coordinates: all x, then all y, then all z. What is not a number becomes the box's corner.
    fn quantised(&self, points: impl Iterator<Item = [f32; 3]> + Clone) -> Vec<u16> {
        let (low, size) = (self.bounds.min, self.bounds.size());
        let axis = |a: usize| {
            points.clone().map(move |p| ((f64::from(p[a]) - low[a]) / size[a] * 65535.0).round() as u16)
        };
        axis(0).chain(axis(1)).chain(axis(2)).collect()
    }
}

/// Small differences of either sign as small numbers.
fn fold(difference: u16) -> u16 {
    let d = difference as i16;
    ((d << 1) ^ (d >> 15)) as u16
}

/// A zlib stream as base64.
fn deflated(bytes: &[u8]) -> String {
    let mut out = ZlibEncoder::new(Vec::new(), Compression::new(5));
    let written = out.write_all(bytes).and_then(|()| out.finish());
    BASE64_STANDARD.encode(written.expect("writing into memory does not fail"))
}

fn put(out: &mut Vec<u8>, numbers: impl Iterator<Item = u16> + Clone) {
    out.extend(numbers.clone().map(|v| v as u8).chain(numbers.map(|v| (v >> 8) as u8)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// What the viewer does, in Rust.
    fn unpack(text: &str, frames: usize, points: usize) -> Vec<Vec<u16>> {
        let mut bytes = Vec::new();
        for part in text.lines() {
            let deflated = BASE64_STANDARD.decode(part).unwrap();
            flate2::read::ZlibDecoder::new(&deflated[..]).read_to_end(&mut bytes).unwrap();
        }
        let mut before = vec![0u16; 3 * points];
        (0..frames)
            .map(|f| {
                let at = &bytes[f * 6 * points..];
                for i in 0..3 * points {
                    let z = u16::from(at[i]) | u16::from(at[3 * points + i]) << 8;
                    before[i] = before[i].wrapping_add((z >> 1) ^ (z & 1).wrapping_neg());
                }
                before.clone()
            })
            .collect()
    }

    #[test]
    fn frames_come_back_to_half_a_step() {
        let bounds = Bounds { min: [0.0; 3], max: [1.0, 2.0, 4.0] };
        let frames = [[[0.0, 0.5, 4.0], [1.0, 2.0, 0.0]], [[0.9, 0.4, 0.1], [0.2, 1.7, f32::NAN]]];
        let mut packer = Packer::new(bounds);
        frames.iter().for_each(|f| packer.frame(f.iter().copied()));
        for (packed, frame) in unpack(&packer.finish(), 2, 2).iter().zip(frames) {
            for (i, p) in frame.iter().enumerate() {
                for a in 0..3 {
                    let value = f64::from(packed[a * 2 + i]) / 65535.0 * bounds.max[a];
                    let expected = if p[a].is_nan() { 0.0 } else { f64::from(p[a]) };
                    assert!((value - expected).abs() <= bounds.max[a] / 65535.0, "{value} {expected}");
                }
            }
        }
    }

    #[test]
    fn what_is_deflated_in_parts_comes_back_whole() {
        let bounds = Bounds { min: [0.0; 3], max: [1.0; 3] };
        let points = PART / 16;
        let at = |i: usize, f: usize| ((i * 37 + f * 11) % 1000) as f32 / 999.0;
        let mut packer = Packer::new(bounds);
        for f in 0..5 {
            packer.frame((0..points).map(|i| [at(i, f), at(i, f + 1), at(i, f + 2)]));
        }
        let text = packer.finish();
        assert_eq!(text.lines().count(), 2);
        for (f, frame) in unpack(&text, 5, points).iter().enumerate() {
            for a in 0..3 {
                let off = |i: usize| f64::from(frame[a * points + i]) / 65535.0 - f64::from(at(i, f + a));
                assert!((0..points).all(|i| off(i).abs() < 1e-5), "frame {f}, axis {a}");
            }
        }
    }
}
