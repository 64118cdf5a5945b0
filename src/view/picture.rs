//! An RGB picture: pixels, joining pictures side by side, captions, and the PNG file.
//!
//! Pixels come in from `render`; files go out, whole or not at all. Imports `store::atomic` and `font`.

use std::path::Path;

use super::font;
use crate::store::{StoreError, atomic};

/// An 8-bit sRGB picture, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    /// `height * width` pixels.
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// A picture of one colour.
    pub fn filled(width: usize, height: usize, color: [u8; 3]) -> Self {
        Self { width, height, pixels: vec![color; width * height] }
    }

    /// The pixel in column `x` of row `y`.
    pub fn at(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.width + x]
    }

    /// Pictures of equal height side by side, `gap` white pixels between them.
    pub fn side_by_side(panels: &[Self], gap: usize) -> Self {
        let height = panels.iter().map(|p| p.height).max().unwrap_or(0);
        let width = panels.iter().map(|p| p.width + gap).sum::<usize>().saturating_sub(gap);
        let mut strip = Self::filled(width, height, [255; 3]);
        let mut left = 0;
        for panel in panels {
            for y in 0..panel.height {
                let start = y * width + left;
                let row = &panel.pixels[y * panel.width..(y + 1) * panel.width];
                strip.pixels[start..start + panel.width].copy_from_slice(row);
            }
            left += panel.width + gap;
        }
        strip
    }

    /// Pictures one below another, `gap` white pixels between them, from the left edge.
    pub fn one_below_another(rows: &[Self], gap: usize) -> Self {
        let width = rows.iter().map(|p| p.width).max().unwrap_or(0);
        let height = rows.iter().map(|p| p.height + gap).sum::<usize>().saturating_sub(gap);
        let mut sheet = Self::filled(width, height, [255; 3]);
        let mut top = 0;
        for row in rows {
            for y in 0..row.height {
                let start = (top + y) * width;
                sheet.pixels[start..start + row.width]
                    .copy_from_slice(&row.pixels[y * row.width..(y + 1) * row.width]);
            }
            top += row.height + gap;
        }
        sheet
    }

    /// Writes `text` near the lower edge, in the middle, at a size that follows the picture's.
    pub fn caption(&mut self, text: &str, color: [u8; 3]) {
        let fitting = self.width / (font::advance(text) + 8).max(1);
        let scale = (self.height / 220).clamp(1, fitting.max(1));
        let left = self.width.saturating_sub(font::advance(text) * scale) / 2;
        let top = self.height.saturating_sub((font::HEIGHT + 6) * scale);
        self.text(left, top, text, color, scale);
    }

    /// Pixels that a text takes across, at scale 1.
    pub fn text_width(text: &str) -> usize {
        font::advance(text)
    }

    /// Writes `text` with its upper left corner at (`left`, `top`), a dot of the font `scale` pixels wide.
    pub fn text(&mut self, left: usize, top: usize, text: &str, color: [u8; 3], scale: usize) {
        for (x, y) in font::dots(text) {
            for (dx, dy) in (0..scale * scale).map(|k| (k % scale, k / scale)) {
                let (px, py) = (left + x * scale + dx, top + y * scale + dy);
                if px < self.width && py < self.height {
                    self.pixels[py * self.width + px] = color;
                }
            }
        }
    }

    /// The picture as the bytes of a PNG file.
    pub fn to_png(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(self.pixels.as_flattened()))
            .expect("a picture of non-zero size goes into memory");
        bytes
    }

    /// Writes a PNG file.
    pub fn write_png(&self, path: &Path) -> Result<(), StoreError> {
        atomic::write(path, &self.to_png())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_stand_side_by_side_with_a_white_gap() {
        let strip = Picture::side_by_side(&[Picture::filled(2, 2, [9; 3]), Picture::filled(3, 2, [5; 3])], 1);
        assert_eq!((strip.width, strip.height), (6, 2));
        assert_eq!(
            [strip.at(1, 1), strip.at(2, 1), strip.at(3, 0), strip.at(5, 1)],
            [[9; 3], [255; 3], [5; 3], [5; 3]]
        );
    }

    #[test]
    fn a_png_file_reads_back_as_the_picture() {
        let mut picture = Picture::filled(70, 30, [200, 100, 50]);
        picture.caption("stage 1", [0; 3]);
        assert!(picture.pixels.contains(&[0; 3]), "the caption is there");
        let bytes = picture.to_png();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, picture.pixels.as_flattened());
    }
}
