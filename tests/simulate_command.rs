//! `donut simulate` as a user meets it: what a scene may be, and what it may not.

use std::path::Path;
use std::process::Output;

use ndarray::{Array2, Ix2};
use serde_json::{Value, json};

use crate::common::donut;
use donut::math::cloud::Point;
use donut::store::npz::{Reader, Writer, cloud_array};

const N: usize = 8;

/// A scene of few particles under tools, in a folder of its own.
struct Desk(tempfile::TempDir);

impl Desk {
    fn new(scene: &Value, arrays: &[(&str, Array2<f64>)]) -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        std::fs::write(desk.at("scene.json"), scene.to_string()).unwrap();
        let mut writer = Writer::new(Path::new(&desk.at("scene.npz")));
        arrays.iter().for_each(|(name, array)| writer.add(name, array).unwrap());
        writer.finish().unwrap();
        desk
    }

    fn at(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    fn simulate(&self, flags: &[&str]) -> Output {
        donut().args(["simulate", "scene.json"]).args(flags).current_dir(self.0.path()).output().unwrap()
    }

    fn errors(&self, flags: &[&str]) -> (i32, String) {
        let output = self.simulate(flags);
        (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
    }
}

/// A cube of particles a hand's breadth above the floor.
fn cube() -> Array2<f64> {
    let corner = |i: usize| -> Point { [i & 1, i >> 1 & 1, i >> 2].map(|b| 0.2 + 0.01 * b as f64) };
    cloud_array(&(0..N).map(corner).collect::<Vec<_>>())
}

fn scene(tool: Value) -> Value {
    json!({
        "arrays": "scene.npz",
        "grid": {"nodes": 64, "dt": 1e-4, "substeps": 20},
        "material": {"youngs_modulus": 5000.0, "poisson_ratio": 0.15, "yield_stress": 150.0},
        "gravity": [0.0, -300.0, 0.0],
        "ground_friction": 0.5, "lower_bound": 1.0, "softness": 666.0,
        "tools": [tool],
    })
}

fn gripper() -> Value {
    json!({
        "kind": "gripper", "half_extents": [0.01, 0.03, 0.03], "minimal_gap": 0.08, "maximal_gap": 0.2,
        "position": [0.5, 0.4, 0.5], "rotation": [1.0, 0.0, 0.0, 0.0], "gap": 0.12, "friction": 0.9,
        "action_scale": [0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01],
        "lower_bound": [0.0, 0.0, 0.0], "upper_bound": [1.0, 1.0, 1.0],
    })
}

fn knife() -> Value {
    json!({
        "kind": "knife", "half_extents": [0.01, 0.03, 0.1], "prism_size": [0.15, 0.15],
        "prism_rotation": [1.0, 0.0, 0.0, 0.58], "position": [0.5, 0.4, 0.5], "rotation": [1.0, 0.0, 0.0, 0.0],
        "friction": 0.0, "action_scale": [0.01, 0.01, 0.01], "lower_bound": [0.0, 0.0, 0.0],
        "upper_bound": [1.0, 1.0, 1.0],
    })
}

/// The value with another one at a path of keys.
fn with(mut value: Value, path: &str, other: Value) -> Value {
    *value.pointer_mut(path).unwrap() = other;
    value
}

#[test]
fn values_that_make_no_sense_are_one_error_with_their_key() {
    let tool = |tool: Value, key: &str, value: Value| scene(with(tool, key, value));
    for (scene, key) in [
        (tool(gripper(), "/minimal_gap", json!(0.3)), "tools[0].minimal_gap"),
        (tool(gripper(), "/minimal_gap", json!(-0.1)), "tools[0].minimal_gap"),
        (tool(gripper(), "/friction", json!(-3.0)), "tools[0].friction"),
        (tool(knife(), "/prism_size", json!([0.0, 0.0])), "tools[0].prism_size"),
        (tool(knife(), "/prism_rotation", json!([0.0, 0.0, 0.0, 0.0])), "tools[0].prism_rotation"),
        (with(scene(knife()), "/lower_bound", json!(100.0)), "lower_bound"),
    ] {
        let width = if scene["tools"][0]["kind"] == "knife" { 3 } else { 7 };
        let desk = Desk::new(&scene, &[("x0", cube()), ("actions", Array2::zeros((1, width)))]);
        let (code, errors) = desk.errors(&["--out", "out.npz"]);
        assert_eq!((code, errors.lines().count()), (2, 1), "{errors}");
        assert!(
            errors.starts_with("error: scene.json: `") && errors.contains(&format!("`{key}` ")),
            "{errors}"
        );
        assert!(!Path::new(&desk.at("out.npz")).exists());
    }
}

#[test]
fn a_target_that_is_not_finite_is_refused() {
    let mut target = cube();
    target[[3, 1]] = f64::NAN;
    let arrays = [("x0", cube()), ("actions", Array2::zeros((1, 3))), ("target", target)];
    let (code, errors) = Desk::new(&scene(knife()), &arrays).errors(&["--gradient", "--out", "out.npz"]);
    assert!(code == 2 && errors.contains("`target`") && errors.contains("not a finite number"), "{errors}");
}

#[test]
fn what_is_hardly_meant_runs_with_a_warning() {
    let high = with(with(gripper(), "/gap", json!(0.5)), "/position", json!([0.5, 4.0, 0.5]));
    let arrays = [("x0", cube()), ("actions", Array2::zeros((1, 7))), ("f0", cube())];
    let (code, errors) = Desk::new(&scene(high), &arrays).errors(&["--out", "out.npz"]);
    assert_eq!((code, errors.lines().count()), (0, 3), "{errors}");
    for part in ["`tools[0].position` is out of", "`tools[0].gap` is out of", "`f0` is no array of a scene"] {
        assert!(errors.contains(part), "{errors}");
    }
}

#[test]
fn the_gradient_of_no_step_has_the_shape_of_the_actions() {
    let arrays = [("x0", cube()), ("actions", Array2::zeros((0, 3))), ("target", cube())];
    let desk = Desk::new(&scene(knife()), &arrays);
    assert_eq!(desk.errors(&["--gradient", "--out", "out.npz"]), (0, String::new()));
    let mut out = Reader::open(Path::new(&desk.at("out.npz"))).unwrap();
    assert_eq!(out.array::<Ix2>("grad_actions").unwrap().shape(), [0, 3]);
}

#[test]
fn a_scene_is_not_overwritten_by_its_result() {
    let desk = Desk::new(&scene(knife()), &[("x0", cube()), ("actions", Array2::zeros((1, 3)))]);
    let before = std::fs::read(desk.at("scene.npz")).unwrap();
    for out in ["scene.npz", "./scene.json"] {
        let (code, errors) = desk.errors(&["--out", out]);
        assert!(code == 2 && errors.contains("the scene's own file"), "{errors}");
    }
    assert_eq!(std::fs::read(desk.at("scene.npz")).unwrap(), before);
}
