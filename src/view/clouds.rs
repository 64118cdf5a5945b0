//! Pictures of the clouds of a plan: one panel a cloud, as points in a box with a scale.
//!
//! Named clouds in any unit come in, a [`Picture`] goes out. All panels show the same box, so that sizes compare.
//! Imports `math`, and `view`'s camera and picture.

use super::camera::{Camera, V};
use super::picture::Picture;
use crate::math::cloud::{Bounds, Point};

/// One panel.
#[derive(Clone, Debug)]
pub struct Panel<'a> {
    /// What stands above it, a line each.
    pub captions: Vec<String>,
    /// The points.
    pub points: &'a [Point],
    /// Which colour they have: panels of one number look alike.
    pub color: usize,
}

/// Pixels of a panel, and how many stand in a row.
const WIDTH: usize = 380;
const HEIGHT: usize = 330;
const PER_ROW: usize = 4;
/// Pixels above the box, for the captions.
const HEAD: usize = 44;
/// Samples per pixel along each axis.
const OVERSAMPLING: usize = 3;
/// Intervals between the marks on the longest edge, at most.
const INTERVALS: f64 = 5.0;

const PAPER: [u8; 3] = [255, 255, 255];
const INK: [u8; 3] = [40, 44, 52];
const FAINT: [u8; 3] = [112, 120, 132];
const WALL: [f32; 3] = [244.0, 245.0, 247.0];
const LINE: [f32; 3] = [208.0, 212.0, 218.0];

/// Colours of the clouds, sRGB, apart from each other also for those who see few colours (after Okabe and Ito).
const COLORS: [[f32; 3]; 6] = [
    [178.0, 124.0, 60.0],
    [0.0, 114.0, 178.0],
    [0.0, 158.0, 115.0],
    [204.0, 90.0, 40.0],
    [170.0, 90.0, 140.0],
    [100.0, 110.0, 120.0],
];

/// All panels, in rows. Clouds without a finite point stay empty.
pub fn picture(panels: &[Panel<'_>]) -> Picture {
    let finite = |p: &&Point| p.iter().all(|x| x.is_finite());
    let all: Vec<Point> = panels.iter().flat_map(|p| p.points.iter().filter(finite)).copied().collect();
    let frame = Frame::around(Bounds::of(&all).unwrap_or(Bounds { min: [-1.0; 3], max: [1.0; 3] }));
    let drawn: Vec<Picture> = panels.iter().map(|panel| draw(panel, &frame)).collect();
    let rows: Vec<Picture> = drawn.chunks(PER_ROW).map(|row| Picture::side_by_side(row, 4)).collect();
    Picture::one_below_another(&rows, 4)
}

/// The box that all panels show.
struct Frame {
    bounds: Bounds,
    /// Distance between marks.
    step: f64,
}

impl Frame {
    /// The box around `inner` whose faces stand on marks.
    fn around(inner: Bounds) -> Self {
        let longest = inner.size().into_iter().fold(0.0, f64::max);
        let longest = if longest > 0.0 && longest.is_finite() { longest } else { 1.0 };
        let rough = longest / INTERVALS;
        let power = 10f64.powf(rough.log10().floor());
        let step = power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * power >= rough).unwrap_or(10.0);
        // A hair more than the points, and no mark more for a rounding error.
        let bounds = Bounds {
            min: inner.min.map(|x| ((x / step) + 1e-6).floor() * step),
            max: std::array::from_fn(|a| {
                let low = ((inner.min[a] / step) + 1e-6).floor();
                ((inner.max[a] / step) - 1e-6).ceil().max(low + 1.0) * step
            }),
        };
        Self { bounds, step }
    }

    /// Marks along an axis.
    fn marks(&self, axis: usize) -> impl Iterator<Item = f64> + '_ {
        let (min, max) = (self.bounds.min[axis], self.bounds.max[axis]);
        let count = ((max - min) / self.step).round() as usize;
        (0..=count).map(move |k| min + k as f64 * self.step)
    }

    fn label(&self, value: f64) -> String {
        let digits = (-self.step.log10().floor()).clamp(0.0, 6.0) as usize;
        let text = format!("{value:.digits$}");
        if text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.')) { "0".into() } else { text }
    }
}

fn draw(panel: &Panel<'_>, frame: &Frame) -> Picture {
    let mut canvas = Canvas::new(frame);
    let Bounds { min, max } = frame.bounds;
    for axis in 0..3 {
        for mark in frame.marks(axis) {
            let at = |point: [f64; 3]| -> Point {
                let mut p = point;
                p[axis] = mark;
                p
            };
            // The three faces behind the cloud meet in the corner of the least x, y and z.
            for end in (0..3).filter(|&a| a != axis) {
                let mut far = min;
                far[end] = max[end];
                canvas.line(at(min), at(far));
            }
        }
    }
    let base = COLORS[panel.color % COLORS.len()];
    let mut points: Vec<[f32; 3]> = panel
        .points
        .iter()
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .map(|p| canvas.camera.project(vector(*p)))
        .collect();
    points.sort_by(|a, b| b[2].total_cmp(&a[2]));
    let (far, near) = (points.first().map_or(1.0, |p| p[2]), points.last().map_or(0.0, |p| p[2]));
    let radius = OVERSAMPLING as f32 * if points.len() > 1500 { 1.2 } else { 1.8 };
    for [x, y, depth] in points {
        let nearness = if far > near { (far - depth) / (far - near) } else { 1.0 };
        canvas.dot(x, y, radius, base, nearness);
    }
    let mut picture = canvas.developed();
    for (k, caption) in panel.captions.iter().enumerate() {
        let (scale, color) = if k == 0 { (2, INK) } else { (1, FAINT) };
        let scale = if Picture::text_width(caption) * scale > WIDTH - 16 { 1 } else { scale };
        picture.text(8, 6 + if k == 0 { 0 } else { 12 + 10 * k }, caption, color, scale);
    }
    label_edges(&mut picture, &canvas, frame);
    picture
}

/// Numbers along the three edges that face the camera, and the names of the axes.
fn label_edges(picture: &mut Picture, canvas: &Canvas, frame: &Frame) {
    let Bounds { min, max } = frame.bounds;
    // For each axis a corner of its edge, and where its labels stand beside the edge, pixels.
    let edges = [
        ([min[0], min[1], max[2]], [0.0, 9.0]),
        ([min[0], min[1], max[2]], [-14.0, 0.0]),
        ([max[0], min[1], min[2]], [14.0, 5.0]),
    ];
    for (axis, (corner, aside)) in edges.into_iter().enumerate() {
        let place = |value: f64| {
            let mut p = corner;
            p[axis] = value;
            let [x, y, _] = canvas.camera.project(vector(p));
            [x / OVERSAMPLING as f32 + aside[0], y / OVERSAMPLING as f32 + HEAD as f32 + aside[1]]
        };
        let marks: Vec<f64> = frame.marks(axis).collect();
        // The lowest mark of the height stands where that of the depth would.
        for &mark in marks.iter().skip(usize::from(axis == 1)) {
            let text = frame.label(mark);
            centered(picture, place(mark), &text, FAINT);
        }
        let middle = place(0.5 * (marks[0] + marks[marks.len() - 1]));
        let away = [[0.0, 11.0], [-18.0, 0.0], [20.0, 7.0]][axis];
        centered(picture, [middle[0] + away[0], middle[1] + away[1]], ["x", "y", "z"][axis], INK);
    }
}

fn centered(picture: &mut Picture, [x, y]: [f32; 2], text: &str, color: [u8; 3]) {
    let left = (x - 0.5 * Picture::text_width(text) as f32).max(0.0);
    let room = picture.width.saturating_sub(Picture::text_width(text));
    picture.text((left as usize).min(room), (y - 3.0).max(0.0) as usize, text, color, 1);
}

fn vector(p: Point) -> V {
    V::from(p.map(|x| x as f32))
}

/// The part of a panel below its captions, in fine pixels.
struct Canvas {
    camera: Camera,
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
}

impl Canvas {
    fn new(frame: &Frame) -> Self {
        let (width, height) = (WIDTH * OVERSAMPLING, (HEIGHT - HEAD) * OVERSAMPLING);
        let Bounds { min, max } = frame.bounds;
        // Room for the labels.
        let room = 0.16 * frame.bounds.diagonal();
        let wide = Bounds { min: min.map(|x| x - room), max: max.map(|x| x + room) };
        let camera = Camera::framing(&wide, width, height);
        let mut canvas = Self { camera, width, height, pixels: vec![PAPER.map(f32::from); width * height] };
        for axis in 0..3 {
            canvas.face(axis, &frame.bounds);
        }
        canvas
    }

    /// The face of the box on which `axis` is least.
    fn face(&mut self, axis: usize, bounds: &Bounds) {
        let corner = |s: usize, t: usize| {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut p = bounds.min;
            p[a] = if s == 1 { bounds.max[a] } else { p[a] };
            p[b] = if t == 1 { bounds.max[b] } else { p[b] };
            let [x, y, _] = self.camera.project(vector(p));
            [x, y]
        };
        let outline = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        for row in 0..self.height {
            for column in 0..self.width {
                if contains(&outline, [column as f32 + 0.5, row as f32 + 0.5]) {
                    self.pixels[row * self.width + column] = WALL;
                }
            }
        }
    }

    fn line(&mut self, from: Point, to: Point) {
        let [a, b] = [from, to].map(|p| self.camera.project(vector(p)));
        let steps = ((b[0] - a[0]).abs().max((b[1] - a[1]).abs())).ceil().max(1.0) as usize;
        for k in 0..=steps {
            let t = k as f32 / steps as f32;
            self.fill(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), 0.5 * OVERSAMPLING as f32, |_| {
                LINE
            });
        }
    }

    /// A little ball, lighter at its upper left; what is far is paler.
    fn dot(&mut self, x: f32, y: f32, radius: f32, base: [f32; 3], nearness: f32) {
        let haze = 0.45 * (1.0 - nearness);
        self.fill(x, y, radius, |[dx, dy]| {
            let light =
                0.82 - 0.25 * (dx + 1.4 * dy) / radius - 0.15 * (dx * dx + dy * dy) / (radius * radius);
            base.map(|c| {
                let c = (c * light.clamp(0.45, 1.25)).min(255.0);
                c + (235.0 - c) * haze
            })
        });
    }

    /// Colours the fine pixels within a radius.
    fn fill(&mut self, x: f32, y: f32, radius: f32, color: impl Fn([f32; 2]) -> [f32; 3]) {
        let range = |c: f32, end: usize| {
            let clamp = |v: f32| v.clamp(0.0, end as f32) as usize;
            clamp((c - radius).floor())..clamp((c + radius).ceil() + 1.0)
        };
        for row in range(y, self.height) {
            for column in range(x, self.width) {
                let [dx, dy] = [column as f32 + 0.5 - x, row as f32 + 0.5 - y];
                if dx * dx + dy * dy <= radius * radius {
                    self.pixels[row * self.width + column] = color([dx, dy]);
                }
            }
        }
    }

    /// The panel in whole pixels, with room for captions above.
    fn developed(&self) -> Picture {
        let mut picture = Picture::filled(WIDTH, HEIGHT, PAPER);
        for i in 0..WIDTH * (HEIGHT - HEAD) {
            let (x, y) = (i % WIDTH, i / WIDTH);
            let mut sum = [0.0; 3];
            for k in 0..OVERSAMPLING * OVERSAMPLING {
                let (dx, dy) = (k % OVERSAMPLING, k / OVERSAMPLING);
                let fine = self.pixels[(y * OVERSAMPLING + dy) * self.width + x * OVERSAMPLING + dx];
                sum = std::array::from_fn(|c| sum[c] + fine[c]);
            }
            let count = (OVERSAMPLING * OVERSAMPLING) as f32;
            picture.pixels[(y + HEAD) * WIDTH + x] = sum.map(|c| (c / count + 0.5) as u8);
        }
        picture
    }
}

/// Whether a convex outline holds a point.
fn contains(outline: &[[f32; 2]; 4], p: [f32; 2]) -> bool {
    let side = |k: usize| {
        let ([ax, ay], [bx, by]) = (outline[k], outline[(k + 1) % 4]);
        (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax)
    };
    let sides: [f32; 4] = std::array::from_fn(side);
    sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_cover_the_clouds() {
        let frame = Frame::around(Bounds { min: [-1.24, -0.4, 0.0], max: [1.24, 0.4, 0.0] });
        assert_eq!(frame.step, 0.5);
        assert_eq!((frame.bounds.min, frame.bounds.max), ([-1.5, -0.5, 0.0], [1.5, 0.5, 0.5]));
        let labels: Vec<String> = frame.marks(0).map(|m| frame.label(m)).collect();
        assert_eq!(labels, ["-1.5", "-1.0", "-0.5", "0", "0.5", "1.0", "1.5"]);
    }

    #[test]
    fn panels_stand_in_rows_and_each_has_its_colour() {
        let cloud: Vec<Point> =
            (0..400).map(|i| [f64::from(i % 20) / 20.0, 0.1, f64::from(i / 20) / 20.0]).collect();
        let panel =
            |color| Panel { captions: vec!["1: knife".into(), "half_left".into()], points: &cloud, color };
        let drawn = picture(&[panel(0), panel(1), panel(1), panel(0), panel(2)]);
        assert_eq!((drawn.width, drawn.height), (4 * WIDTH + 12, 2 * HEIGHT + 4));
        let blue = |x: usize| {
            let is_blue = |i: &usize| {
                let [r, _, b] = drawn.at(x + i % WIDTH, i / WIDTH);
                b > r.saturating_add(60)
            };
            (0..WIDTH * HEIGHT).filter(is_blue).count()
        };
        assert_eq!(blue(0), 0);
        assert!(blue(WIDTH + 4) > 500);
        assert_eq!(picture(&[panel(0)]), picture(&[panel(0)]));
    }

    #[test]
    fn points_that_are_not_finite_or_all_the_same_do_no_harm() {
        for points in [vec![], vec![[f64::NAN; 3]], vec![[1.0; 3]; 5], vec![[1e300; 3], [-1e300; 3]]] {
            picture(&[Panel { captions: vec![], points: &points, color: 0 }]);
        }
    }
}
