//! A run as an animated GIF: the same run gives the same bytes.
//!
//! A [`RunRecord`] and settings come in, the bytes of a GIF file go out. Imports `view`'s renderer and `store`'s record
//! types.
//!
//! All pictures share one palette, and each holds only what has changed since the one before, which keeps files small.

use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder, Frame, Repeat};

use super::picture::Picture;
use super::render::{CAPTION, render};
use super::scene::{self, RenderScene};
use crate::store::record::RunRecord;

/// What a film looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Film {
    /// Pixels across.
    pub width: u16,
    /// Pixels down.
    pub height: u16,
    /// Show every so many control steps, and fewer while no tool is in use; the last frame is always shown.
    pub every: usize,
    /// Pictures a second, at most 50.
    pub fps: u16,
}

/// Colours of the palette, but for the see-through one.
const COLORS: usize = 255;
/// The palette's entry for "as before".
const AS_BEFORE: u8 = COLORS as u8;
/// Pixels that the palette is learnt from, at most.
const SAMPLES: usize = 400_000;
/// A change of a channel by less than this is not seen, and not stored.
const UNSEEN: u8 = 4;
/// Bits of a channel that the choice of a palette's colour goes by.
const BITS: u32 = 6;
/// Every so often the palette's colours move to the mean of what they stand for (Lloyd's algorithm): the net that finds them
/// does not reach the rarest colours.
const REFINEMENTS: usize = 4;
/// How much faster time passes where no tool is in use.
const FREE_PACE: usize = 3;
/// How long the first and the last picture stay, hundredths of a second.
const HOLD: [u16; 2] = [60, 200];

/// The frames that a film shows: the first, every so many, and the last. Where the tool is away and the dough settles,
/// time passes [`FREE_PACE`] times as fast.
fn frames(run: &RunRecord, every: usize) -> Vec<usize> {
    let last = run.trajectory.positions.len().saturating_sub(1);
    let mut shown = vec![0];
    let mut passed = 0;
    for frame in 1..last {
        passed += if run.trajectory.tool_at(frame).is_some() { FREE_PACE } else { 1 };
        if passed >= FREE_PACE * every {
            shown.push(frame);
            passed = 0;
        }
    }
    shown.extend((last > 0).then_some(last));
    shown
}

/// The least `every` with which a film of the run has at most `most` pictures.
pub fn every_for(run: &RunRecord, most: usize) -> usize {
    let least = run.trajectory.steps().div_ceil(FREE_PACE * most.max(1)).max(1);
    (least..).find(|&every| frames(run, every).len() <= most.max(2)).unwrap_or(least)
}

/// The film of a run as the bytes of a GIF file. `on_picture` hears how many of its pictures are drawn, and of how many.
///
/// # Panics
/// If the run has no frame, or the film no pixel.
pub fn gif(run: &RunRecord, film: &Film, mut on_picture: impl FnMut(usize, usize)) -> Vec<u8> {
    let (width, height) = (usize::from(film.width), usize::from(film.height));
    let spacing = scene::of_dough(run, 0).expect("a run has a first frame").spacing;
    let frames = frames(run, film.every);
    let pictures: Vec<Picture> = frames
        .iter()
        .enumerate()
        .map(|(drawn, &frame)| {
            on_picture(drawn, frames.len());
            // One spacing for all: an estimate for each frame would make the surface tremble.
            let scene = scene::of_frame(run, frame).expect("the frame is one of the run's");
            let mut picture = render(&RenderScene { spacing, ..scene }, width, height);
            picture.caption(&caption(run, frame), CAPTION);
            picture
        })
        .collect();
    encoded(&pictures, film)
}

/// Who is at work: "2: pole".
fn caption(run: &RunRecord, frame: usize) -> String {
    let trajectory = &run.trajectory;
    let name = |tool: usize| run.plan.tools[tool].name.as_str();
    match trajectory.tool_at(frame) {
        _ if frame == 0 => "before".to_owned(),
        Some((tool, _)) => format!("{}: {}", trajectory.stage[frame] + 1, name(tool)),
        None if frame + 1 == trajectory.positions.len() => "after".to_owned(),
        // Between strokes the tool is away for a moment; the caption need not flicker.
        None => usize::try_from(trajectory.stage[frame])
            .ok()
            .and_then(|k| Some((k, run.plan.stages.get(k)?.tool)))
            .map_or_else(String::new, |(k, tool)| format!("{}: {}", k + 1, name(tool))),
    }
}

fn encoded(pictures: &[Picture], film: &Film) -> Vec<u8> {
    let palette = Palette::learnt(pictures);
    let delay = (100 / film.fps.clamp(1, 50)).max(2);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, film.width, film.height, &palette.colors)
        .expect("writing into memory does not fail");
    encoder.set_repeat(Repeat::Infinite).expect("writing into memory does not fail");
    let mut seen: Option<Picture> = None;
    for (k, picture) in pictures.iter().enumerate() {
        let hold = if k + 1 == pictures.len() { HOLD[1] } else { HOLD[0] };
        let delay = if k == 0 || k + 1 == pictures.len() { hold } else { delay };
        let frame = Frame { delay, dispose: DisposalMethod::Keep, ..palette.changes(seen.as_ref(), picture) };
        encoder.write_frame(&frame).expect("writing into memory does not fail");
        seen = Some(remembered(seen, picture));
    }
    drop(encoder);
    bytes
}

/// What is on the screen, as exact colours: pixels whose change is not seen keep the colour they had.
fn remembered(seen: Option<Picture>, now: &Picture) -> Picture {
    let Some(mut seen) = seen else { return now.clone() };
    for (old, new) in seen.pixels.iter_mut().zip(&now.pixels) {
        if is_seen(*old, *new) {
            *old = *new;
        }
    }
    seen
}

fn is_seen(old: [u8; 3], new: [u8; 3]) -> bool {
    (0..3).any(|c| old[c].abs_diff(new[c]) >= UNSEEN)
}

struct Palette {
    /// Red, green, blue of 256 entries.
    colors: Vec<u8>,
    /// The entry for each colour, by the upper bits of its channels.
    index: Vec<u8>,
}

impl Palette {
    fn learnt(pictures: &[Picture]) -> Self {
        let pixels = || pictures.iter().flat_map(|p| &p.pixels);
        let step = (pixels().count() / SAMPLES).max(1);
        let samples: Vec<u8> = pixels().step_by(step).flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        let mut colors = NeuQuant::new(3, COLORS, &samples).color_map_rgb();
        colors.resize(3 * 256, 0);
        for _ in 0..REFINEMENTS {
            let palette = Self::of_colors(colors.clone());
            let mut sums = vec![[0u64; 4]; COLORS];
            for &[r, g, b, _] in samples.as_chunks().0 {
                let sum = &mut sums[usize::from(palette.of([r, g, b]))];
                [r, g, b, 1].into_iter().zip(sum).for_each(|(v, sum)| *sum += u64::from(v));
            }
            for (color, [r, g, b, count]) in colors.as_chunks_mut::<3>().0.iter_mut().zip(sums) {
                if count > 0 {
                    *color = [r, g, b].map(|sum| (sum / count) as u8);
                }
            }
        }
        Self::of_colors(colors)
    }

    /// Finds for every colour the nearest of these.
    fn of_colors(colors: Vec<u8>) -> Self {
        let channel = |bin: usize| ((bin << (8 - BITS)) | (1 << (7 - BITS))) as u8;
        let mask = (1 << BITS) - 1;
        let index = (0..1usize << (3 * BITS))
            .map(|bin| nearest(&colors, [bin >> (2 * BITS), bin >> BITS & mask, bin & mask].map(channel)))
            .collect();
        Self { colors, index }
    }

    /// The entry for a colour.
    fn of(&self, [r, g, b]: [u8; 3]) -> u8 {
        let bin = |c: u8| usize::from(c) >> (8 - BITS);
        self.index[(bin(r) << (2 * BITS)) | (bin(g) << BITS) | bin(b)]
    }

    /// The part of a picture that is not on the screen yet.
    fn changes(&self, seen: Option<&Picture>, now: &Picture) -> Frame<'static> {
        let changed = |x: usize, y: usize| seen.is_none_or(|seen| is_seen(seen.at(x, y), now.at(x, y)));
        let (mut low, mut high) = ([now.width, now.height], [0, 0]);
        for y in 0..now.height {
            for x in (0..now.width).filter(|&x| changed(x, y)) {
                (low, high) = ([low[0].min(x), low[1].min(y)], [high[0].max(x + 1), high[1].max(y + 1)]);
            }
        }
        if high == [0, 0] {
            // A picture has to have a pixel.
            (low, high) = ([0, 0], [1, 1]);
        }
        let pixel = |x, y| if changed(x, y) { self.of(now.at(x, y)) } else { AS_BEFORE };
        let buffer: Vec<u8> =
            (low[1]..high[1]).flat_map(|y| (low[0]..high[0]).map(move |x| pixel(x, y))).collect();
        Frame {
            left: low[0] as u16,
            top: low[1] as u16,
            width: (high[0] - low[0]) as u16,
            height: (high[1] - low[1]) as u16,
            transparent: Some(AS_BEFORE),
            buffer: buffer.into(),
            ..Frame::default()
        }
    }
}

/// The palette's entry that is nearest to a colour.
fn nearest(colors: &[u8], color: [u8; 3]) -> u8 {
    let entries = colors.as_chunks::<3>().0[..COLORS].iter().zip(0..);
    let squared =
        |entry: &[u8; 3]| (0..3).map(|c| u32::from(entry[c].abs_diff(color[c])).pow(2)).sum::<u32>();
    entries.min_by_key(|(entry, _)| squared(entry)).map_or(0, |(_, index)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_come_back_nearly_and_only_changes_are_kept() {
        let shade = |x: usize, y: usize| [2 * x as u8, 3 * y as u8, 120];
        let mut first = Picture::filled(64, 40, [0; 3]);
        for (k, pixel) in first.pixels.iter_mut().enumerate() {
            *pixel = shade(k % 64, k / 64);
        }
        let mut second = first.clone();
        second.pixels[5 * 64 + 7] = [250, 10, 10];
        second.pixels[9 * 64 + 8] = shade(8, 9).map(|c| c + 1);
        let palette = Palette::learnt(&[first.clone(), second.clone()]);
        for (k, &pixel) in first.pixels.iter().enumerate() {
            let entry = 3 * usize::from(palette.of(pixel));
            let found = &palette.colors[entry..entry + 3];
            assert!((0..3).all(|c| found[c].abs_diff(pixel[c]) < 14), "{k}: {pixel:?} {found:?}");
        }
        let frame = palette.changes(Some(&first), &second);
        assert_eq!(
            (frame.left, frame.top, frame.width, frame.height),
            (7, 5, 1, 1),
            "one pixel has changed visibly"
        );
        let frame = palette.changes(Some(&second), &second);
        assert_eq!((frame.buffer[..].to_vec(), frame.width), (vec![AS_BEFORE], 1));
        let seen = remembered(Some(first.clone()), &second);
        assert_eq!(seen.at(8, 9), first.at(8, 9), "what is not seen is not taken for shown");
    }
}
