//! The pictures of the tools in GUIDE.md: `cargo run --release --example tool_pictures`.
//!
//! Each tool of the task `donut`, and each plain primitive, is pressed into the task's dough and drawn by donut's own
//! renderer; docs/pictures/tools/NAME.png is what comes out, the same bytes every time. Imports donut's library.

use std::path::Path;

use anyhow::Result;
use donut::math::cloud::Bounds;
use donut::sim::tool::{Motion, Shape, Tool, ToolPose};
use donut::sim::{Options, SimdLevel, Simulator};
use donut::task::gradcheck::cases;
use donut::task::{ToolSetup, load_scene};
use donut::view::mesh::{self, Mesh};
use donut::view::render;
use donut::view::scene::{self, RenderScene};

const SIZE: [usize; 2] = [300, 225];
/// Control steps that the tool has pressed for.
const STEPS: usize = 30;
const PARTICLES: usize = 4000;

fn main() -> Result<()> {
    let mut scene = load_scene("donut")?;
    scene.tools.extend(primitives());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/pictures/tools");
    std::fs::create_dir_all(&folder)?;
    for (name, case) in cases(&scene, PARTICLES, 1, |_| true)? {
        let (params, tools) = (case.params.clone(), case.tools.clone());
        // The instructions that every machine has: others round differently in the last bit.
        let options = Options { simd: SimdLevel::Scalar, ..Options::default() };
        let mut sim = Simulator::<f32>::new(params, tools, options);
        sim.rollout(&case.start, &case.poses, &case.actions[..STEPS])?;
        let drawn = picture(&sim.positions(STEPS), &case.tools[0], &sim.poses(STEPS)[0]);
        let file = folder.join(format!("{}.png", name.replace(' ', "-")));
        render(&drawn, SIZE[0], SIZE[1]).write_png(&file)?;
        println!("{}", file.display());
    }
    Ok(())
}

/// The primitives that no task of the paper uses, above the dough and free to go where they like.
fn primitives() -> Vec<ToolSetup> {
    let shapes = [
        ("pusher", Shape::Box { half_extents: [0.015, 0.05, 0.1] }, Motion::Rigid),
        ("sphere", Shape::Sphere { radius: 0.04 }, Motion::Translation),
        ("cylinder", Shape::Cylinder { radius: 0.04, length: 0.1 }, Motion::Translation),
        ("torus", Shape::Torus { radius: 0.05, tube_radius: 0.015 }, Motion::Translation),
    ];
    let setup = |(name, shape, motion): (&str, Shape, Motion)| ToolSetup {
        tool: Tool {
            name: name.into(),
            shape,
            friction: 0.9,
            action_scale: [[0.01; 3], [0.025; 3]].concat()[..motion.action_len()].to_vec(),
            motion,
            lower_bound: [0.0, 0.05, 0.0],
            upper_bound: [1.0; 3],
        },
        rest: ToolPose { position: [0.5, 0.4, 0.5], rotation: [1.0, 0.0, 0.0, 0.0], gap: 0.0 },
    };
    shapes.into_iter().map(setup).collect()
}

fn picture(dough: &[[f64; 3]], tool: &Tool, pose: &ToolPose) -> RenderScene {
    let dough: Vec<[f32; 3]> = dough.iter().map(|p| p.map(|v| v as f32)).collect();
    let spacing = scene::spacing(&dough);
    let low = dough.iter().map(|p| p[1]).fold(f32::INFINITY, f32::min);
    let surface = Mesh::of(&tool.shape);
    let bodies = mesh::bodies(tool, pose);
    RenderScene {
        piece: vec![0; dough.len()],
        spacing,
        table: low + 0.5 * spacing,
        tools: bodies.iter().map(|body| (surface.moved(body), scene::material(&tool.name))).collect(),
        bounds: Bounds { min: [0.39, 0.04, 0.39], max: [0.61, 0.24, 0.61] },
        dough,
    }
}
