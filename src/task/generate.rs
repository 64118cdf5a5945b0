//! Generated targets: what single-tool tasks aim at, drawn from a seed and an index.
//!
//! The initial dough and ranges come in; one [`Stage`] in the world's own units goes out, so that the rest
//! of the program cannot tell it from a language model's. Imports math and llm's stage type.

use std::collections::BTreeMap;

use super::error::Complaint;
use super::file::GeneratorTable;
use super::shapes::{Dough, Solid};
use super::values::range;
use crate::llm::stage::{NamedCloud, Stage};
use crate::math::cloud::Point;
use crate::math::rng::{Pcg64, seeded, uniform};

/// Points in a generated cloud; a subgoal resamples them to its own number.
const POINTS: usize = 4000;

/// A family of targets. Pairs are the ends of ranges, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Generator {
    /// A disc with the dough's volume, `height` high, its centre moved by `shift` in x and in z.
    Flatten { height: [f64; 2], shift: [f64; 2] },
    /// The box cut at `cut_x`, and one of the two sides (drawn) slid outward by `slide`.
    Cut { cut_x: [f64; 2], slide: [f64; 2] },
    /// The dough moved to `x`, and by `z_offset` to either side (drawn) in z.
    Move { x: [f64; 2], z_offset: [f64; 2] },
}

impl Generator {
    /// Judges the ranges of a `[target.generated] shape` table for this dough.
    pub fn check(table: &GeneratorTable, dough: &Dough) -> Result<Self, Complaint> {
        let at = |name: &str| format!("target.generated.shape.{name}");
        Ok(match *table {
            GeneratorTable::Flatten { height_m, shift_m } => {
                if height_m[0] <= 0.0 {
                    return Err(Complaint::new(
                        at("flatten.height_m"),
                        format!("starts at {}, but a height must be positive", height_m[0]),
                    ));
                }
                Self::Flatten {
                    height: range(&at("flatten.height_m"), height_m, [0.0, 1.0])?,
                    shift: range(&at("flatten.shift_m"), shift_m, [-1.0, 1.0])?,
                }
            }
            GeneratorTable::Cut { cut_x_m, slide_m } => {
                let Solid::Box { size } = dough.solid else {
                    return Err(Complaint::new(
                        at("cut"),
                        "needs dough in the shape of a box; change [dough]",
                    ));
                };
                // Leave something on either side of the cut.
                let inside = [dough.center[0] - 0.49 * size[0], dough.center[0] + 0.49 * size[0]];
                Self::Cut {
                    cut_x: range(&at("cut.cut_x_m"), cut_x_m, inside)?,
                    slide: range(&at("cut.slide_m"), slide_m, [0.0, 1.0])?,
                }
            }
            GeneratorTable::Move { x_m, z_offset_m } => Self::Move {
                x: range(&at("move.x_m"), x_m, [0.0, 1.0])?,
                z_offset: range(&at("move.z_offset_m"), z_offset_m, [0.0, 1.0])?,
            },
        })
    }
}

/// Target number `index` under `seed`, as a plan of one stage with `tool` that turns the piece `dough`
/// into the target. Coordinates are the world's; heights above the table are left to the subgoals.
pub fn generate(generator: &Generator, tool: &str, dough: &Dough, seed: u64, index: u64) -> Stage {
    let (title, pieces) = drawn(generator, dough, seed, index);
    let cloud = |(name, solid, center): &(&str, Solid, Point)| NamedCloud {
        name: (*name).to_string(),
        points: solid.fill(*center, POINTS, seed ^ index),
    };
    Stage {
        step: 1,
        title,
        tool: Some(tool.to_string()),
        inputs: vec!["dough".to_string()],
        outputs: pieces.iter().map(cloud).collect(),
        stated_location: pieces.iter().map(|(name, _, center)| ((*name).to_string(), *center)).collect(),
        stated_volume: pieces
            .iter()
            .map(|(name, solid, _)| ((*name).to_string(), solid.volume()))
            .collect::<BTreeMap<_, _>>(),
        code: String::new(),
    }
}

/// A title and the pieces of a target: name, solid, centre (m).
pub type Drawn = (String, Vec<(&'static str, Solid, Point)>);

/// Target number `index` under `seed` as solids, of which [`generate`] makes clouds.
pub fn drawn(generator: &Generator, dough: &Dough, seed: u64, index: u64) -> Drawn {
    let mut rng = seeded(seed, &format!("target {index}"));
    match generator {
        Generator::Flatten { height, shift } => flatten(dough, *height, *shift, &mut rng),
        Generator::Cut { cut_x, slide } => cut(dough, *cut_x, *slide, &mut rng),
        Generator::Move { x, z_offset } => move_to(dough, *x, *z_offset, &mut rng),
    }
}

fn draw(rng: &mut Pcg64, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * uniform(rng)
}

fn draw_sign(rng: &mut Pcg64) -> f64 {
    if uniform(rng) < 0.5 { -1.0 } else { 1.0 }
}

fn flatten(dough: &Dough, height: [f64; 2], shift: [f64; 2], rng: &mut Pcg64) -> Drawn {
    let height = draw(rng, height);
    let radius = (dough.solid.volume() / (std::f64::consts::PI * height)).sqrt();
    let [x, y, z] = dough.center;
    let center = [x + draw(rng, shift), y, z + draw(rng, shift)];
    let title = format!("flatten the dough to a disc {height:.3} m high");
    (title, vec![("disc", Solid::Disc { radius, height }, center)])
}

fn cut(dough: &Dough, cut_x: [f64; 2], slide: [f64; 2], rng: &mut Pcg64) -> Drawn {
    let size = dough.solid.size();
    let bounds = dough.solid.bounds(dough.center);
    let cut_x = draw(rng, cut_x);
    let slide = draw(rng, slide) * draw_sign(rng);
    let [_, y, z] = dough.center;
    let side = |from: f64, to: f64, moved: f64| {
        (Solid::Box { size: [to - from, size[1], size[2]] }, [0.5 * (from + to) + moved, y, z])
    };
    let (left, left_center) = side(bounds.min[0], cut_x, slide.min(0.0));
    let (right, right_center) = side(cut_x, bounds.max[0], slide.max(0.0));
    let moved = if slide < 0.0 { "left" } else { "right" };
    let title =
        format!("cut the dough at x = {cut_x:.3} m and slide the {moved} side {:.3} m away", slide.abs());
    (title, vec![("left", left, left_center), ("right", right, right_center)])
}

fn move_to(dough: &Dough, x: [f64; 2], z_offset: [f64; 2], rng: &mut Pcg64) -> Drawn {
    let x = draw(rng, x);
    let z = dough.center[2] + draw(rng, z_offset) * draw_sign(rng);
    let title = format!("move the dough to x = {x:.3} m, z = {z:.3} m");
    (title, vec![("moved", dough.solid, [x, dough.center[1], z])])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::cloud::Bounds;

    const BAR: Dough =
        Dough { solid: Solid::Box { size: [0.22, 0.08, 0.06] }, center: [0.5, 0.08, 0.5], particles: 500 };

    #[test]
    fn targets_differ_by_index_and_repeat_by_seed() {
        let generator = Generator::Cut { cut_x: [0.48, 0.52], slide: [0.1, 0.13] };
        let target = |seed, index| generate(&generator, "knife", &BAR, seed, index).outputs;
        assert_eq!(target(1, 0), target(1, 0));
        assert_ne!(target(1, 0), target(1, 1));
        assert_ne!(target(1, 0), target(2, 0));
    }

    #[test]
    fn cuts_keep_the_volume_and_slide_one_side_by_the_range() {
        let generator = Generator::Cut { cut_x: [0.48, 0.52], slide: [0.1, 0.13] };
        for index in 0..20 {
            let stage = generate(&generator, "knife", &BAR, 7, index);
            let volume: f64 = stage.stated_volume.values().sum();
            assert!((volume / BAR.solid.volume() - 1.0).abs() < 1e-12);
            let left = Bounds::of(&stage.outputs[0].points).unwrap();
            let right = Bounds::of(&stage.outputs[1].points).unwrap();
            let gap = right.min[0] - left.max[0];
            assert!((0.1..0.135).contains(&gap), "gap {gap}");
            let moved = [left.min[0] < 0.385, right.max[0] > 0.615];
            assert_eq!(moved.iter().filter(|m| **m).count(), 1, "one side moves");
        }
    }

    #[test]
    fn flattening_keeps_the_volume_and_moving_keeps_the_shape() {
        let ball = Dough { solid: Solid::Ball { radius: 0.07 }, ..BAR };
        let flatten = Generator::Flatten { height: [0.016, 0.04], shift: [-0.02, 0.02] };
        let disc = generate(&flatten, "rolling pin", &ball, 3, 0);
        assert!((disc.stated_volume["disc"] / ball.solid.volume() - 1.0).abs() < 1e-12);
        let height = Bounds::of(&disc.outputs[0].points).unwrap().size()[1];
        assert!((0.015..=0.04).contains(&height), "{height}");

        let piece =
            generate(&Generator::Move { x: [0.3, 0.7], z_offset: [0.3, 0.35] }, "gripper", &BAR, 3, 0);
        let z = piece.stated_location["moved"][2];
        assert!((0.3..=0.35).contains(&(z - 0.5).abs()), "{z}");
        let size = Bounds::of(&piece.outputs[0].points).unwrap().size();
        assert!((size[0] - 0.22).abs() < 0.01, "{size:?}");
    }

    #[test]
    fn a_ball_cannot_be_cut_into_two_boxes() {
        let ball = Dough { solid: Solid::Ball { radius: 0.07 }, ..BAR };
        let table = GeneratorTable::Cut { cut_x_m: [0.48, 0.52], slide_m: [0.1, 0.13] };
        assert!(Generator::check(&table, &ball).unwrap_err().problem.contains("box"));
    }
}
