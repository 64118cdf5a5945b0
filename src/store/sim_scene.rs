//! Scenes of `donut simulate`: a JSON file with its arrays beside it, and the arrays that come out.
//!
//! Text and arrays come in, checked simulator inputs go out; unknown keys are refused. Imports npz and the
//! simulator's types.

use std::path::{Path, PathBuf};

use ndarray::{Array2, Array3, Ix2, Ix3};
use serde::Deserialize;

use super::error::StoreError;
use super::npz;
use crate::math::cloud::Point;
use crate::sim::gradcheck::Case;
use crate::sim::particles::IDENTITY;
use crate::sim::tool::{Motion, Shape, Tool, ToolPose};
use crate::sim::{Params, ParticleState};

/// A scene, checked and ready to run.
#[derive(Clone, Debug)]
pub struct SimScene {
    pub params: Params,
    pub tools: Vec<Tool>,
    /// Start poses, one a tool.
    pub poses: Vec<ToolPose>,
    pub start: ParticleState,
    /// Control steps x components of all tools.
    pub actions: Vec<Vec<f64>>,
    /// Where the loss wants the particles, if the scene says so.
    pub target: Option<Vec<Point>>,
    /// The file of its arrays.
    pub arrays: PathBuf,
    /// What is possible but hardly meant, a sentence each.
    pub warnings: Vec<String>,
}

impl SimScene {
    /// The scene as a rollout whose gradient can be checked, if it has a target.
    pub fn gradient_case(&self) -> Option<Case> {
        let target = self.target.clone()?;
        let Self { params, tools, poses, start, actions, .. } = self.clone();
        Some(Case { params, tools, poses, start, actions, target })
    }
}

/// A scene that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The arrays could not be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Not JSON, an unknown key, a missing key, a wrong type.
    #[error("{} is no scene", path.display())]
    Json { path: PathBuf, source: serde_json::Error },
    /// A value that makes no sense.
    #[error("{}: `{key}` {problem}", path.display())]
    Value { path: PathBuf, key: String, problem: String },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    arrays: PathBuf,
    grid: GridTable,
    material: MaterialTable,
    gravity: [f64; 3],
    ground_friction: f64,
    lower_bound: f64,
    softness: f64,
    tools: Vec<ToolTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GridTable {
    nodes: usize,
    dt: f64,
    substeps: usize,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialTable {
    youngs_modulus: f64,
    poisson_ratio: f64,
    yield_stress: f64,
}

#[derive(Deserialize, Clone, Copy, PartialEq, Debug)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Capsule,
    RollingPin,
    Box,
    Knife,
    Gripper,
    Sphere,
    Cylinder,
    Torus,
}

impl Kind {
    /// As in the file.
    fn name(self) -> &'static str {
        match self {
            Self::Capsule => "capsule",
            Self::RollingPin => "rolling_pin",
            Self::Box => "box",
            Self::Knife => "knife",
            Self::Gripper => "gripper",
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
            Self::Torus => "torus",
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolTable {
    kind: Kind,
    radius: Option<f64>,
    length: Option<f64>,
    tube_radius: Option<f64>,
    half_extents: Option<[f64; 3]>,
    prism_size: Option<[f64; 2]>,
    prism_rotation: Option<[f64; 4]>,
    minimal_gap: Option<f64>,
    maximal_gap: Option<f64>,
    position: [f64; 3],
    rotation: [f64; 4],
    gap: Option<f64>,
    friction: f64,
    action_scale: Vec<f64>,
    lower_bound: [f64; 3],
    upper_bound: [f64; 3],
}

/// What the arrays' file may hold.
const ARRAYS: [&str; 6] = ["x0", "v0", "F0", "C0", "actions", "target"];

/// Names a key of a tool in messages.
struct At<'a> {
    path: &'a Path,
    prefix: String,
}

impl At<'_> {
    fn problem(&self, key: &str, problem: impl Into<String>) -> SceneError {
        let key = format!("{}{key}", self.prefix);
        SceneError::Value { path: self.path.to_owned(), key, problem: problem.into() }
    }

    fn need<T>(&self, key: &str, value: Option<T>) -> Result<T, SceneError> {
        value.ok_or_else(|| self.problem(key, "is missing; this kind of tool needs it"))
    }

    fn positive(&self, key: &str, value: f64) -> Result<f64, SceneError> {
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            Err(self.problem(key, format!("is {value}; it must be a positive number")))
        }
    }

    fn not_negative(&self, key: &str, value: f64) -> Result<f64, SceneError> {
        if value.is_finite() && value >= 0.0 {
            Ok(value)
        } else {
            Err(self.problem(key, format!("is {value}; it must be a number that is not negative")))
        }
    }

    /// A quaternion need not be normalised, but it must turn something.
    fn rotation(&self, key: &str, wxyz: [f64; 4]) -> Result<(), SceneError> {
        let norm = wxyz.iter().map(|v| v * v).sum::<f64>().sqrt();
        if norm.is_finite() && norm > 0.0 {
            Ok(())
        } else {
            Err(self.problem(
                key,
                format!("has the norm {norm}; give a quaternion w, x, y, z, such as [1, 0, 0, 0]"),
            ))
        }
    }
}

/// Reads and checks a scene.
///
/// # Errors
/// [`SceneError`], naming file and key or array.
pub fn read(path: &Path) -> Result<SimScene, SceneError> {
    let text = std::fs::read_to_string(path).map_err(StoreError::read(path))?;
    let file: SceneFile =
        serde_json::from_str(&text).map_err(|source| SceneError::Json { path: path.to_owned(), source })?;
    let params = check_params(path, &file)?;
    let (mut tools, mut poses, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
    for (i, table) in file.tools.iter().enumerate() {
        let at = At { path, prefix: format!("tools[{i}].") };
        let (tool, pose) = check_tool(&at, table)?;
        let odd = out_of_bounds(&tool, &pose).into_iter();
        warnings.extend(odd.map(|what| format!("{}: `tools[{i}].{what}", path.display())));
        tools.push(tool);
        poses.push(pose);
    }
    let arrays = path.parent().unwrap_or(Path::new("")).join(&file.arrays);
    let mut reader = npz::Reader::open(&arrays)?;
    let unknown = reader.names().iter().filter(|name| !ARRAYS.contains(&name.as_str()));
    warnings.extend(unknown.map(|name| {
        format!(
            "{}: `{name}` is no array of a scene and is not used; those are {}",
            arrays.display(),
            ARRAYS.join(", ")
        )
    }));
    let start = read_start(&mut reader)?;
    let width: usize = tools.iter().map(Tool::action_len).sum();
    let actions = read_actions(&mut reader, width)?;
    let target = if reader.has("target") { Some(reader.cloud("target")?) } else { None };
    if let Some(target) = &target {
        if target.len() != start.len() {
            let reason = format!("has {} points for {} particles", target.len(), start.len());
            return Err(reader.entry_error("target", reason).into());
        }
        check_finite(&reader, "target", target.as_flattened())?;
    }
    Ok(SimScene { params, tools, poses, start, actions, target, arrays, warnings })
}

/// Which of a tool's own bounds its start pose is out of: the first substep moves it there at once.
fn out_of_bounds(tool: &Tool, pose: &ToolPose) -> Vec<&'static str> {
    let mut out = Vec::new();
    if (0..3).any(|a| !(tool.lower_bound[a]..=tool.upper_bound[a]).contains(&pose.position[a])) {
        out.push("position` is out of the tool's bounds; its first motion takes it to them at once");
    }
    if let Motion::Gripper { minimal_gap, maximal_gap } = tool.motion
        && !(minimal_gap..=maximal_gap).contains(&pose.gap)
    {
        out.push("gap` is out of the gripper's range; its first motion takes it there at once");
    }
    out
}

fn check_params(path: &Path, file: &SceneFile) -> Result<Params, SceneError> {
    let at = At { path, prefix: String::new() };
    let nu = file.material.poisson_ratio;
    if !(0.0..0.5).contains(&nu) {
        return Err(at.problem("material.poisson_ratio", format!("is {nu}; it must be in [0, 0.5)")));
    }
    if file.grid.nodes < 8 || file.grid.nodes > 1024 {
        return Err(at.problem("grid.nodes", format!("is {}; 8 to 1024 are possible", file.grid.nodes)));
    }
    if file.grid.substeps == 0 {
        return Err(at.problem("grid.substeps", "is 0; at least one is needed"));
    }
    for (key, value) in [
        ("ground_friction", file.ground_friction),
        ("lower_bound", file.lower_bound),
        ("softness", file.softness),
    ] {
        at.not_negative(key, value)?;
    }
    if file.gravity.iter().any(|g| !g.is_finite()) {
        return Err(at.problem("gravity", "holds a value that is not a finite number"));
    }
    let params = Params {
        nodes: file.grid.nodes,
        dt: at.positive("grid.dt", file.grid.dt)?,
        substeps: file.grid.substeps,
        youngs_modulus: at.positive("material.youngs_modulus", file.material.youngs_modulus)?,
        poisson_ratio: nu,
        yield_stress: at.positive("material.yield_stress", file.material.yield_stress)?,
        gravity: file.gravity,
        ground_friction: file.ground_friction,
        lower_bound: file.lower_bound,
        softness: file.softness,
    };
    let (low, high) = params.cell_bounds();
    if low >= high {
        let problem =
            format!("is {low}; the grid's upper bound is at {high} nodes, and this must be below it");
        return Err(at.problem("lower_bound", problem));
    }
    Ok(params)
}

fn check_tool(at: &At<'_>, t: &ToolTable) -> Result<(Tool, ToolPose), SceneError> {
    let radius = || at.need("radius", t.radius).and_then(|r| at.positive("radius", r));
    let half_extents = || {
        let h = at.need("half_extents", t.half_extents)?;
        h.iter().try_for_each(|v| at.positive("half_extents", *v).map(drop)).map(|()| h)
    };
    let shape = match t.kind {
        Kind::Capsule | Kind::RollingPin => {
            let length = at.not_negative("length", at.need("length", t.length)?)?;
            Shape::Capsule { radius: radius()?, length }
        }
        Kind::Sphere => Shape::Sphere { radius: radius()? },
        Kind::Cylinder => {
            let length = at.need("length", t.length)?;
            Shape::Cylinder { radius: radius()?, length: at.positive("length", length)? }
        }
        Kind::Torus => {
            let tube_radius = at.need("tube_radius", t.tube_radius)?;
            Shape::Torus { radius: radius()?, tube_radius: at.positive("tube_radius", tube_radius)? }
        }
        Kind::Box | Kind::Gripper => Shape::Box { half_extents: half_extents()? },
        Kind::Knife => {
            let prism_size = at.need("prism_size", t.prism_size)?;
            prism_size.iter().try_for_each(|v| at.positive("prism_size", *v).map(drop))?;
            let prism_rotation = at.need("prism_rotation", t.prism_rotation)?;
            at.rotation("prism_rotation", prism_rotation)?;
            Shape::Knife { half_extents: half_extents()?, prism_size, prism_rotation }
        }
    };
    let motion = match t.kind {
        Kind::RollingPin => Motion::RollingPin,
        Kind::Capsule | Kind::Knife | Kind::Sphere | Kind::Cylinder | Kind::Torus => Motion::Translation,
        Kind::Box => Motion::Rigid,
        Kind::Gripper => {
            let minimal_gap = at.not_negative("minimal_gap", at.need("minimal_gap", t.minimal_gap)?)?;
            let maximal_gap = at.not_negative("maximal_gap", at.need("maximal_gap", t.maximal_gap)?)?;
            if minimal_gap > maximal_gap {
                return Err(at.problem("minimal_gap", "is above maximal_gap; swap them"));
            }
            Motion::Gripper { minimal_gap, maximal_gap }
        }
    };
    let gap = if t.kind == Kind::Gripper { at.need("gap", t.gap)? } else { 0.0 };
    if t.action_scale.len() != motion.action_len() {
        let problem = format!("has {} entries, not {}", t.action_scale.len(), motion.action_len());
        return Err(at.problem("action_scale", problem));
    }
    at.rotation("rotation", t.rotation)?;
    at.not_negative("friction", t.friction)?;
    if (0..3).any(|a| t.lower_bound[a] > t.upper_bound[a]) {
        return Err(at.problem("lower_bound", "is above upper_bound on some axis"));
    }
    let tool = Tool {
        name: t.kind.name().to_owned(),
        shape,
        motion,
        friction: t.friction,
        action_scale: t.action_scale.clone(),
        lower_bound: t.lower_bound,
        upper_bound: t.upper_bound,
    };
    Ok((tool, ToolPose { position: t.position, rotation: t.rotation, gap }))
}

fn read_start(reader: &mut npz::Reader) -> Result<ParticleState, SceneError> {
    let x = reader.cloud("x0")?;
    let n = x.len();
    check_finite(reader, "x0", x.as_flattened())?;
    if n == 0 {
        return Err(reader.entry_error("x0", "holds no particle").into());
    }
    let v = if reader.has("v0") { reader.cloud("v0")? } else { vec![[0.0; 3]; n] };
    if v.len() != n {
        return Err(reader.entry_error("v0", format!("has {} rows, x0 has {n}", v.len())).into());
    }
    check_finite(reader, "v0", v.as_flattened())?;
    let c = read_matrices(reader, "C0", n, [0.0; 9])?;
    let f = read_matrices(reader, "F0", n, IDENTITY)?;
    Ok(ParticleState { x, v, c, f })
}

fn read_matrices(
    reader: &mut npz::Reader,
    name: &str,
    n: usize,
    default: [f64; 9],
) -> Result<Vec<[f64; 9]>, SceneError> {
    if !reader.has(name) {
        return Ok(vec![default; n]);
    }
    let m = reader.array::<Ix3>(name)?;
    if m.shape() != [n, 3, 3] {
        let reason = format!("has shape {:?}, not ({n}, 3, 3)", m.shape());
        return Err(reader.entry_error(name, reason).into());
    }
    let matrices: Vec<[f64; 9]> = (0..n).map(|i| std::array::from_fn(|k| m[[i, k / 3, k % 3]])).collect();
    check_finite(reader, name, matrices.as_flattened())?;
    Ok(matrices)
}

fn check_finite(reader: &npz::Reader, name: &str, values: &[f64]) -> Result<(), SceneError> {
    if values.iter().any(|v| !v.is_finite()) {
        return Err(reader.entry_error(name, "holds a value that is not a finite number").into());
    }
    Ok(())
}

fn read_actions(reader: &mut npz::Reader, width: usize) -> Result<Vec<Vec<f64>>, SceneError> {
    let a = reader.array::<Ix2>("actions")?;
    if a.ncols() != width {
        let reason = format!("has {} columns, the scene's tools take {width}", a.ncols());
        return Err(reader.entry_error("actions", reason).into());
    }
    if a.iter().any(|v| !v.is_finite()) {
        return Err(reader.entry_error("actions", "holds a value that is not a finite number").into());
    }
    Ok(a.rows().into_iter().map(|r| r.to_vec()).collect())
}

/// What `donut simulate` writes.
#[derive(Clone, Debug)]
pub struct SimResult {
    /// Positions at the start and after every control step.
    pub positions: Vec<Vec<Point>>,
    /// Poses of all tools, likewise.
    pub poses: Vec<Vec<ToolPose>>,
    /// Velocities at the end.
    pub velocities: Vec<Point>,
    /// Loss and its gradient by the actions, control steps x components, if asked for.
    pub gradient: Option<(f64, Array2<f64>)>,
}

/// Writes a result as `.npz`.
///
/// # Errors
/// [`StoreError`] if the file cannot be written.
pub fn write_result(path: &Path, result: &SimResult) -> Result<(), StoreError> {
    let (frames, n) = (result.positions.len(), result.velocities.len());
    let tools = result.poses.first().map_or(0, Vec::len);
    let mut writer = npz::Writer::new(path);
    let positions = Array3::from_shape_fn((frames, n, 3), |(t, i, a)| result.positions[t][i][a]);
    writer.add("positions", &positions)?;
    let poses = Array3::from_shape_fn((frames, tools, 8), |(t, i, k)| {
        let p = &result.poses[t][i];
        match k {
            0..3 => p.position[k],
            3..7 => p.rotation[k - 3],
            _ => p.gap,
        }
    });
    writer.add("tool_poses", &poses)?;
    writer.add("velocities", &npz::cloud_array(&result.velocities))?;
    if let Some((loss, grad)) = &result.gradient {
        writer.add("loss", &ndarray::arr0(*loss))?;
        writer.add("grad_actions", grad)?;
    }
    writer.finish()
}
