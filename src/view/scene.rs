//! What is in a picture: dough, tools, the table, taken from a frame of a run or from its target.
//!
//! A [`RunRecord`] comes in, [`RenderScene`]s go out. Imports `store`'s record types and `view::mesh`.

use crate::math::cloud::{self, Bounds, Point};
use crate::store::record::RunRecord;
use crate::view::mesh::{self, Mesh};

/// What a tool is made of, for its looks only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Material {
    Wood,
    Metal,
}

/// Everything that a picture shows, in the world, m.
#[derive(Clone, Debug)]
pub struct RenderScene {
    /// The particles.
    pub dough: Vec<[f32; 3]>,
    /// The piece that each particle belongs to; pieces have different shades.
    pub piece: Vec<i32>,
    /// Distance between neighbouring particles.
    pub spacing: f32,
    /// Height of the table's top.
    pub table: f32,
    /// The tools in place.
    pub tools: Vec<(Mesh, Material)>,
    /// What the camera has to have in view.
    pub bounds: Bounds,
}

/// The scene at a frame of a run; `None` if there is no such frame.
pub fn of_frame(run: &RunRecord, frame: usize) -> Option<RenderScene> {
    let dough = run.trajectory.positions.get(frame)?.clone();
    let mut scene = without_tools(run, dough, run.trajectory.piece.clone());
    if let Some((index, pose)) = run.trajectory.tool_at(frame) {
        let tool = &run.plan.tools[index];
        let surface = Mesh::of(&tool.shape);
        let bodies = mesh::bodies(tool, &pose);
        scene.tools = bodies.iter().map(|body| (surface.moved(body), material(&tool.name))).collect();
    }
    Some(scene)
}

/// The scene at a frame with the tool taken away; `None` if there is no such frame.
pub fn of_dough(run: &RunRecord, frame: usize) -> Option<RenderScene> {
    let dough = run.trajectory.positions.get(frame)?.clone();
    Some(without_tools(run, dough, run.trajectory.piece.clone()))
}

/// The task's target as if it were dough.
pub fn of_target(run: &RunRecord) -> RenderScene {
    let dough = single(&run.trajectory.target);
    let piece = vec![0; dough.len()];
    without_tools(run, dough, piece)
}

fn without_tools(run: &RunRecord, dough: Vec<[f32; 3]>, piece: Vec<i32>) -> RenderScene {
    let table = table_height(run);
    RenderScene {
        spacing: spacing(&dough),
        dough,
        piece,
        table,
        tools: Vec::new(),
        bounds: bounds(run, f64::from(table)),
    }
}

/// Height of the table's top: where the dough lies lowest, but for the lowest in a thousand particles, and
/// a little into it, since the body that is drawn is rounded at its edges.
pub fn table_height(run: &RunRecord) -> f32 {
    let trajectory = &run.trajectory;
    let lowest = |frame: &[[f32; 3]]| {
        let mut heights: Vec<f32> = frame.iter().map(|p| p[1]).filter(|y| y.is_finite()).collect();
        let rank = heights.len() / 1000;
        if heights.is_empty() {
            f32::INFINITY
        } else {
            *heights.select_nth_unstable_by(rank, f32::total_cmp).1
        }
    };
    let first = trajectory.positions.first().map_or(0.0, |f| lowest(f));
    let last = trajectory.positions.last().map_or(0.0, |f| lowest(f));
    let low = first.min(last);
    let into = 0.5 * trajectory.positions.first().map_or(0.0, |f| spacing(f));
    if low.is_finite() { low + into } else { 0.0 }
}

/// All the dough of a run's frames and its target, and room for the tools' ends.
fn bounds(run: &RunRecord, table: f64) -> Bounds {
    let trajectory = &run.trajectory;
    let frames = [trajectory.positions.first(), trajectory.positions.last()];
    let stages = (0..run.plan.stages.len()).filter_map(|k| trajectory.last_frame_of(k));
    let mut all = Bounds::of(&trajectory.target);
    for frame in frames.into_iter().flatten().chain(stages.map(|t| &trajectory.positions[t])) {
        let points: Vec<Point> = frame.iter().map(|p| p.map(f64::from)).collect();
        if let Some(found) = Bounds::of(&points) {
            all = Some(all.map_or(found, |b| b.union(&found)));
        }
    }
    let mut all = all.unwrap_or(Bounds { min: [0.4; 3], max: [0.6; 3] });
    all.min[1] = all.min[1].min(table);
    all
}

/// The edge of the cube that each particle has to itself: from the median distance to the eighth
/// neighbour, which says how densely dough is sampled whether in a lattice or at random.
pub fn spacing(dough: &[[f32; 3]]) -> f32 {
    const NEIGHBOURS: usize = 8;
    const PROBES: usize = 60;
    if dough.len() <= NEIGHBOURS {
        return 0.01;
    }
    let mut reaches: Vec<f64> = (0..PROBES)
        .map(|k| {
            let probe = dough[k * dough.len() / PROBES].map(f64::from);
            let mut distances: Vec<f64> =
                dough.iter().map(|p| cloud::distance(p.map(f64::from), probe)).collect();
            *distances.select_nth_unstable_by(NEIGHBOURS, f64::total_cmp).1
        })
        .collect();
    let median = *reaches.select_nth_unstable_by(PROBES / 2, f64::total_cmp).1;
    // A ball of that radius holds eight particles: 4/3 pi r^3 = 8 spacing^3.
    (median / 1.24).clamp(5e-4, 0.05) as f32
}

/// Rolling pins and poles are wooden, blades and plates of metal.
pub fn material(tool: &str) -> Material {
    if tool.contains("pin") || tool.contains("pole") { Material::Wood } else { Material::Metal }
}

fn single(cloud: &[Point]) -> Vec<[f32; 3]> {
    cloud.iter().map(|p| p.map(|v| v as f32)).collect()
}
