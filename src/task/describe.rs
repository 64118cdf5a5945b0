//! A new task from one line of text: where its dough, its scale and its tools come from.
//!
//! A description such as "The dough is initially a round ball at (0, 0, 0) with radius 1. Make a bagel." and the
//! stages of an answer come in; a task file goes out, which then is judged like any other. Tools, world and planner
//! are those of the task `donut`; the dough gets its volume. Imports this module's words, shapes and sources.

use toml::{Table, Value};

use super::error::TaskError;
use super::shapes::Solid;
use super::source::TaskSource;
use super::words::dough_in_words;
use crate::llm::stage::Stage;
use crate::math::cloud::{Bounds, Point};
use crate::math::volume::measure_volume;

/// The task that lends everything but the dough.
const TEMPLATE: &str = "donut";
/// Score from which a run is a success: the middle one of the paper's thresholds for several tools.
const THRESHOLD: f64 = 0.5;
/// A plan that does not fit the table is shrunk, but not below this share of the usual length: tools and grid would be
/// too coarse for the dough.
const LEAST_SCALE: f64 = 0.5;
/// Of the workspace, a shrunk plan takes this share.
const FILL: f64 = 0.98;
/// How far the share of its box that a cloud fills may be off that of the shape it is taken for.
const FILL_TOLERANCE: f64 = 0.12;
/// How far the sides of a ball's or a disc's box may be apart.
const SIDE_TOLERANCE: f64 = 0.1;

/// Dough in the model's units, as a description or an answer gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenDough {
    /// Lengths are the model's units here, not m.
    pub solid: Solid,
    pub center: Point,
}

/// A task in one line of text.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// The line, as the language model gets it.
    pub text: String,
    /// The dough that it states, if it does.
    pub dough: Option<GivenDough>,
}

impl Description {
    /// Reads the dough out of the text.
    ///
    /// # Errors
    /// [`TaskError::Description`] if there is no text, or it gives dough an impossible size.
    pub fn new(text: &str) -> Result<Self, TaskError> {
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        if text.is_empty() {
            return Err(complaint("is empty; write for example \"The dough is a ball. Make a bagel.\""));
        }
        let dough = dough_in_words(&text).map_err(complaint)?;
        Ok(Self { text, dough })
    }

    /// What reports and directories call the task: the words from "make" on, or the first ones.
    pub fn name(&self) -> String {
        let lower = self.text.to_lowercase();
        let from = ["make ", "form ", "shape "].into_iter().filter_map(|verb| lower.rfind(verb)).max();
        let words = lower[from.unwrap_or(0)..].split(|c: char| !c.is_alphanumeric() && c != '.');
        let words = words.map(|w| w.trim_matches('.')).filter(|w| !w.is_empty());
        let mut words: Vec<&str> = words.take(5).collect();
        while words.last().is_some_and(|w| ["a", "an", "the", "of", "with", "and", "in", "to"].contains(w)) {
            words.pop();
        }
        let name = words.join("-");
        if name.is_empty() { "described".to_owned() } else { name }
    }

    /// The task file for an answer's stages. The dough is that of the description, or else the one that the answer
    /// builds before its first tool, or else a ball of radius 1 at the origin.
    pub fn task(&self, stages: &[Stage]) -> Result<TaskSource, TaskError> {
        let dough = match (self.dough, built_dough(stages)) {
            (Some(dough), _) => dough,
            (None, Some(cloud)) => fitted(cloud)?,
            (None, None) => GivenDough { solid: Solid::Ball { radius: 1.0 }, center: [0.0; 3] },
        };
        let template = TaskSource::find(TEMPLATE)?;
        let scene = template.scene()?;
        let floor = scene.nominal_floor();
        let workspace = scene.params.workspace();
        let usual = (scene.dough.solid.volume() / dough.solid.volume()).cbrt();
        let (unit, origin) = placed(&dough, stages, usual, &workspace, floor)?;

        let mut file: Table = template.text.parse().expect("the template is a task file");
        let numbers = |xs: &[f64]| Value::Array(xs.iter().map(|x| Value::Float(rounded(*x))).collect());
        for key in ["description", "task_line"] {
            file.insert(key.into(), Value::String(self.text.clone()));
        }
        file.insert("name".into(), Value::String(self.name()));
        let shape = match dough.solid {
            Solid::Ball { radius } => table("ball", [("radius_m", Value::Float(rounded(unit * radius)))]),
            Solid::Box { size } => table("box", [("size_m", numbers(&size.map(|s| unit * s)))]),
            Solid::Disc { radius, height } => {
                let lengths = [("radius_m", unit * radius), ("height_m", unit * height)];
                table("disc", lengths.map(|(key, x)| (key, Value::Float(rounded(x)))))
            }
        };
        let [x, _, z] = dough.center;
        let height = unit * dough.solid.size()[1];
        let center = [origin[0] + unit * x, floor + 0.5 * height, origin[1] + unit * z];
        let given = file["dough"].as_table_mut().expect("a table");
        given.insert("shape".into(), shape);
        given.insert("center_m".into(), numbers(&center));
        let frame = [("llm_unit_m", Value::Float(unit)), ("center_xz_m", numbers(&origin))];
        file.insert("target".into(), table("stages", frame));
        file.insert("score".into(), Value::Table(Table::from_iter([key("threshold", THRESHOLD.into())])));
        let text = format!(
            "# Made from a description. `donut tasks --show donut` explains every key.\n\n{}",
            toml::to_string(&file).expect("a table can be written")
        );
        Ok(TaskSource { label: "the task of --describe".into(), text })
    }
}

fn complaint(problem: impl Into<String>) -> TaskError {
    TaskError::Description { problem: problem.into() }
}

fn key(name: &str, value: Value) -> (String, Value) {
    (name.to_owned(), value)
}

fn table<const N: usize>(name: &str, entries: [(&str, Value); N]) -> Value {
    let inner = Table::from_iter(entries.map(|(k, v)| key(k, v)));
    Value::Table(Table::from_iter([key(name, Value::Table(inner))]))
}

/// To a micrometre: a file for people, and a ball of radius 1 is exactly that of the template.
fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

/// The cloud that an answer builds before its first tool.
fn built_dough(stages: &[Stage]) -> Option<&[Point]> {
    let before = stages.iter().take_while(|stage| stage.tool.is_none());
    before.flat_map(|stage| &stage.outputs).last().map(|cloud| &cloud.points[..])
}

/// The ball, disc or box that a cloud fills, told by how much of its box it fills.
fn fitted(cloud: &[Point]) -> Result<GivenDough, TaskError> {
    let unknown = || {
        complaint(
            "does not state the dough's size, and the cloud that the answer builds of it is no ball, box or \
             upright cylinder; begin it with, for example, \"The dough is a ball with radius 1.\"",
        )
    };
    let bounds = Bounds::of(cloud).ok_or_else(unknown)?;
    let [x, y, z] = bounds.size();
    let fill = measure_volume(cloud) / (x * y * z);
    let alike = |a: f64, b: f64| (a - b).abs() <= SIDE_TOLERANCE * a.max(b);
    let mut shapes = vec![(1.0, Solid::Box { size: [x, y, z] })];
    if alike(x, z) {
        shapes.push((std::f64::consts::FRAC_PI_4, Solid::Disc { radius: 0.25 * (x + z), height: y }));
        if alike(x, y) && alike(y, z) {
            shapes.push((std::f64::consts::FRAC_PI_6, Solid::Ball { radius: (x + y + z) / 6.0 }));
        }
    }
    let off = |share: f64| (fill - share).abs();
    let nearest = shapes.into_iter().min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
    let center = std::array::from_fn(|a| 0.5 * (bounds.min[a] + bounds.max[a]));
    nearest
        .filter(|(share, _)| off(*share) <= FILL_TOLERANCE)
        .map(|(_, solid)| GivenDough { solid, center })
        .ok_or_else(unknown)
}

/// Length of the unit and place of the origin in x and z, m. The origin is in the middle of the table and the unit
/// the usual one, if all clouds fit then; else the middle of the plan is in the middle of the table, and if that is
/// not enough, all is made smaller.
fn placed(
    dough: &GivenDough,
    stages: &[Stage],
    usual: f64,
    workspace: &Bounds,
    floor: f64,
) -> Result<(f64, [f64; 2]), TaskError> {
    let clouds = stages.iter().flat_map(|s| &s.outputs).filter_map(|cloud| Bounds::of(&cloud.points));
    let clouds: Vec<Bounds> = clouds.chain([dough.solid.bounds(dough.center)]).collect();
    // Every piece rests on the table: heights count each for itself.
    let height = clouds.iter().map(|b| b.size()[1]).fold(0.0, f64::max);
    let whole = clouds.iter().skip(1).fold(clouds[0], |all, b| all.union(b));
    let room = workspace.size();
    let size = whole.size();
    let most = [room[0] / size[0], (workspace.max[1] - floor) / height, room[2] / size[2]];
    let most = FILL * most.into_iter().fold(f64::INFINITY, f64::min);
    if most < LEAST_SCALE * usual {
        return Err(complaint(format!(
            "leads to a plan of {:.2} x {height:.2} x {:.2} units, too large for the table beside dough of that \
             size; ask for a smaller shape, or for pieces that lie closer together",
            size[0], size[2]
        )));
    }
    let unit = (usual.min(most) * 1e6).floor() / 1e6;
    let unit = if rounded(usual) <= most { rounded(usual) } else { unit };
    let origin = [0, 2].map(|a| {
        let middle = 0.5 * (workspace.min[a] + workspace.max[a]);
        let fits = middle + unit * whole.min[a] >= workspace.min[a]
            && middle + unit * whole.max[a] <= workspace.max[a];
        rounded(if fits { middle } else { middle - 0.5 * unit * (whole.min[a] + whole.max[a]) })
    });
    Ok((unit, origin))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::llm::recorded;
    use crate::llm::stages_from_answer;
    use crate::task::{Scene, StagePlan, Target, load_scene};

    fn scene(text: &str, stages: &[Stage]) -> Scene {
        Description::new(text).unwrap().task(stages).unwrap().scene().unwrap()
    }

    fn stages(set: &str) -> Vec<Stage> {
        stages_from_answer(recorded::recorded(set, 1).unwrap()).unwrap().stages
    }

    #[test]
    fn the_words_of_a_known_task_make_its_world() {
        for name in ["donut", "baguette"] {
            let known = load_scene(name).unwrap();
            let made = scene(&known.task_line, &stages(name));
            assert_eq!(made.dough, known.dough);
            assert_eq!(made.frame(), known.frame());
            assert_eq!(made.task_line, known.task_line);
            assert_eq!(made.tools, load_scene("donut").unwrap().tools);
        }
    }

    #[test]
    fn every_recorded_plan_fits_the_world_that_its_line_makes() {
        let manifest: serde_json::Value = serde_json::from_str(recorded::MANIFEST).unwrap();
        let line_and_task = |entry: &serde_json::Value| {
            ["task_line", "task"].map(|key| entry[key].as_str().unwrap().to_owned())
        };
        let lines: BTreeMap<String, String> =
            manifest.as_array().unwrap().iter().map(|entry| line_and_task(entry).into()).collect();
        assert_eq!(lines.len(), 9);
        for (line, task) in &lines {
            let stages = stages(task);
            let stated = scene(line, &stages);
            let plan = StagePlan::new(&stages, &stated.frame(), &stated.world(stated.nominal_floor()));
            assert!(plan.is_ok(), "{task}: {plan:?}");
            // The answer's own step 0 tells the same dough as the words, as far as samples can.
            let built = scene("Make it.", &stages).dough.solid;
            for (a, b) in built.size().into_iter().zip(stated.dough.solid.size()) {
                assert!((a - b).abs() < 0.05 * b, "{task}: {built:?}, stated {:?}", stated.dough);
            }
        }
    }

    #[test]
    fn dough_has_the_volume_of_the_donut_unless_its_plan_is_too_wide() {
        let usual = load_scene("donut").unwrap().dough.solid.volume();
        let made = scene("The dough is a box of size 1 x 0.5 x 1. Make a pizza.", &stages("pizza-base"));
        assert!((made.dough.solid.volume() / usual - 1.0).abs() < 1e-3);
        let wide = |spread: f64| {
            let mut stages = stages("donut");
            stages[1].outputs[0].points.push([spread, 0.0, 0.0]);
            Description::new("The dough is a ball.").unwrap().task(&stages)
        };
        let shrunk = wide(13.0).unwrap().scene().unwrap();
        assert!((0.3..0.9).contains(&(shrunk.dough.solid.volume() / usual)), "{:?}", shrunk.dough);
        let Target::Stages { frame, .. } = &shrunk.target else { panic!("stages") };
        assert!(frame.center_xz[0] < 0.3 && frame.center_xz[1] == 0.5, "{frame:?}");
        assert!(wide(30.0).unwrap_err().to_string().contains("smaller shape"));
    }

    #[test]
    fn without_words_or_a_step_0_it_is_the_usual_ball() {
        let mut stages = stages("donut");
        stages.retain(|stage| stage.tool.is_some());
        assert_eq!(scene("Make a donut.", &stages).dough, load_scene("donut").unwrap().dough);
    }

    #[test]
    fn dough_of_no_known_shape_is_refused() {
        let mut stages = stages("donut");
        let points = &mut stages[0].outputs[0].points;
        let moved: Vec<Point> = points.iter().map(|p| [p[0] + 5.0, p[1], p[2]]).collect();
        points.extend(moved);
        let refused = Description::new("Make a donut.").unwrap().task(&stages).unwrap_err().to_string();
        assert!(refused.contains("--describe") && refused.contains("The dough is a ball"), "{refused}");
    }

    #[test]
    fn names() {
        let name = |text| Description::new(text).unwrap().name();
        assert_eq!(name("The dough is a ball. Make a thick bagel."), "make-a-thick-bagel");
        assert_eq!(name("Carry it to (1, 0, 1) and make a pancake there."), "make-a-pancake-there");
        assert_eq!(name("A bagel, 0.5 wide!"), "a-bagel-0.5-wide");
        assert_eq!(name("../.."), "described");
        assert!(Description::new(" \n").is_err());
    }
}
