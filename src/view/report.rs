//! report.html: one file that shows a run moving, opens offline, and carries all that it shows.
//!
//! A [`RunRecord`] comes in, HTML text goes out. Imports `store`'s record types and `view`'s mesh, pack
//! and scene.
//!
//! The page is `report/page.html`; its style and scripts stand beside it. Everything that comes from a
//! file or a language model enters as JSON, and the scripts put it on the page as text only.

use serde_json::{Value, json};

use super::mesh::Mesh;
use super::pack::Packer;
use super::scene::{self, Material};
use crate::math::cloud::{Bounds, Point};
use crate::sim::tool::{Motion, Tool};
use crate::store::record::RunRecord;

const PAGE: &str = include_str!("report/page.html");
const STYLE: &str = include_str!("report/style.css");
const MATHS: &str = include_str!("report/maths.js");
const SHADERS: &str = include_str!("report/shaders.js");
const BODY: &str = include_str!("report/body.js");
const VIEWER: &str = include_str!("report/viewer.js");
const PLOTS: &str = include_str!("report/plots.js");
const MAIN: &str = include_str!("report/main.js");

/// Bytes of base64 that the frames may take; above, the viewer shows every second, third, .. particle.
const BUDGET: usize = 13_000_000;
/// Points of an overlay at most.
const OVERLAY_POINTS: usize = 3000;
/// Particles at most whose way to the next reachable cloud is drawn.
const LINES: usize = 700;

/// The report of a run.
pub fn html(run: &RunRecord) -> String {
    let bounds = quantisation_box(run);
    let (stride, frames) = packed_within(run, &bounds, BUDGET);
    let data = escaped(&data(run, &bounds, stride));
    PAGE.replace("{{title}}", &text(&format!("{} · donut", run.summary.task)))
        .replace("{{style}}", STYLE)
        .replace("{{scripts}}", &[MATHS, SHADERS, BODY, VIEWER, PLOTS, MAIN].join("\n"))
        // Last, and frames before data: what was put in is not searched for placeholders of later steps.
        .replace("{{frames}}", &frames)
        .replacen("{{data}}", &data, 1)
}

/// JSON that can stand in a script element: no `<` can end it early.
fn escaped(data: &Value) -> String {
    data.to_string().replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}

/// Text that can stand in HTML.
fn text(raw: &str) -> String {
    raw.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The frames of every `stride`-th particle with the smallest stride that keeps within the budget.
fn packed_within(run: &RunRecord, bounds: &Bounds, budget: usize) -> (usize, String) {
    let raw = run.trajectory.positions.len() * run.trajectory.particles() * 6;
    // Deflating saves a factor of about two: do not try what cannot fit.
    let mut stride = (raw / (8 * budget)).max(1);
    loop {
        let packed = packed(run, bounds, stride);
        if packed.len() <= budget || stride > run.trajectory.particles() {
            return (stride, packed);
        }
        stride = (stride * packed.len()).div_ceil(budget).max(stride + 1);
    }
}

fn packed(run: &RunRecord, bounds: &Bounds, stride: usize) -> String {
    let mut packer = Packer::new(*bounds);
    for frame in &run.trajectory.positions {
        packer.frame(frame.iter().step_by(stride).copied());
    }
    for (_, cloud) in overlays(run) {
        packer.cloud(thinned(cloud).map(|p| p.map(|v| v as f32)));
    }
    for reachable in &run.trajectory.reachable {
        packer.cloud(reachable.cloud.iter().step_by(stride * line_stride(run, stride)).copied());
    }
    packer.finish()
}

/// The clouds that can be laid over the dough.
fn overlays(run: &RunRecord) -> impl Iterator<Item = (String, &Vec<Point>)> {
    let subgoals = run.trajectory.subgoals.iter().enumerate().map(|(k, c)| (format!("subgoal {k}"), c));
    std::iter::once(("target".to_owned(), &run.trajectory.target)).chain(subgoals)
}

/// Every so many of the particles that are shown has a line.
fn line_stride(run: &RunRecord, stride: usize) -> usize {
    run.trajectory.particles().div_ceil(stride).div_ceil(LINES).max(1)
}

fn thinned(cloud: &[Point]) -> impl ExactSizeIterator<Item = Point> + Clone {
    cloud.iter().step_by(cloud.len().div_ceil(OVERLAY_POINTS).max(1)).copied()
}

/// A box around everything, not flat in any direction.
fn quantisation_box(run: &RunRecord) -> Bounds {
    let trajectory = &run.trajectory;
    let frames = trajectory.positions.iter().map(|f| f.iter().map(|p| p.map(f64::from)).collect());
    let aims = trajectory.reachable.iter().map(|r| r.cloud.iter().map(|p| p.map(f64::from)).collect());
    let clouds = overlays(run).map(|(_, cloud)| cloud.clone());
    let around = |points: Vec<Point>| {
        let finite: Vec<Point> = points.into_iter().filter(|p| p.iter().all(|v| v.is_finite())).collect();
        Bounds::of(&finite)
    };
    let mut all = frames
        .chain(clouds)
        .chain(aims)
        .filter_map(around)
        .reduce(|a, b| a.union(&b))
        .unwrap_or(Bounds { min: [0.0; 3], max: [1.0; 3] });
    for a in 0..3 {
        all.max[a] = all.max[a].max(all.min[a] + 1e-3);
    }
    all
}

/// Everything but the frames.
fn data(run: &RunRecord, bounds: &Bounds, stride: usize) -> Value {
    let (trajectory, plan) = (&run.trajectory, &run.plan);
    let spacing = trajectory.positions.first().map_or(0.01, |f| scene::spacing(f));
    let pieces: Vec<i32> = trajectory.piece.iter().step_by(stride).copied().collect();
    let overlays: Vec<Value> =
        overlays(run).map(|(name, cloud)| json!({"name": name, "count": thinned(cloud).len()})).collect();
    json!({
        "summary": run.summary,
        "command": plan.command,
        "task_file": plan.task_file,
        "params": plan.params,
        "planner": plan.planner,
        "search": plan.search,
        "response": plan.response,
        "tools": plan.tools.iter().map(tool).collect::<Vec<_>>(),
        "stages": plan.stages,
        "low": bounds.min,
        "size": bounds.size(),
        "frames": trajectory.positions.len(),
        "particles": pieces.len(),
        "all_particles": trajectory.particles(),
        "stride": stride,
        // Fewer particles have to be larger to close the surface.
        "spacing": spacing * (stride as f32).cbrt(),
        "table": scene::table_height(run),
        "piece": pieces,
        "overlays": overlays,
        "reachable": {
            "every": line_stride(run, stride),
            "count": pieces.len().div_ceil(line_stride(run, stride)),
            "frames": trajectory.reachable.iter().map(|r| r.frame).collect::<Vec<_>>(),
        },
        "tool": trajectory.tool,
        "stage": trajectory.stage,
        "pose": poses(run),
        "emd": trajectory.emd.iter().map(|e| e.is_finite().then_some(rounded(*e))).collect::<Vec<_>>(),
        "actions": trajectory.actions.iter().map(|a| a.iter().map(|v| rounded(*v)).collect()).collect::<Vec<Vec<_>>>(),
    })
}

/// Eight numbers a frame: position, rotation (w, x, y, z), gap.
fn poses(run: &RunRecord) -> Vec<f64> {
    run.trajectory
        .tool_pose
        .iter()
        .flat_map(|p| p.position.into_iter().chain(p.rotation).chain([p.gap]))
        .map(rounded)
        .collect()
}

/// A tool's name, looks and triangles.
fn tool(tool: &Tool) -> Value {
    let mesh = Mesh::of(&tool.shape);
    let flat = |vectors: &[[f32; 3]]| -> Vec<f64> {
        vectors.as_flattened().iter().map(|v| rounded(f64::from(*v))).collect()
    };
    json!({
        "name": tool.name,
        "wooden": scene::material(&tool.name) == Material::Wood,
        "gripper": matches!(tool.motion, Motion::Gripper { .. }),
        "actions": action_names(&tool.motion),
        "positions": flat(&mesh.positions),
        "normals": flat(&mesh.normals),
        "triangles": mesh.triangles.as_flattened(),
    })
}

/// What the components of an action do.
fn action_names(motion: &Motion) -> &'static [&'static str] {
    match motion {
        Motion::RollingPin => &["roll", "yaw", "rise", "slide"],
        Motion::Translation => &["x", "y", "z"],
        Motion::Rigid => &["x", "y", "z", "turn x", "turn y", "turn z"],
        Motion::Gripper { .. } => &["x", "y", "z", "turn x", "turn y", "turn z", "gap"],
    }
}

/// Five decimals: a hundredth of a millimetre in the world, a few bytes in the file.
fn rounded(v: f64) -> f64 {
    (v * 1e5).round() / 1e5
}
