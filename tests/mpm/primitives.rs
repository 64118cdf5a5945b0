//! The plain primitives as tools: read from a scene, pressed into dough, and their gradients.

use donut::math::cloud::Point;
use donut::sim::gradcheck::Summary;
use donut::sim::{Motion, Shape};
use donut::store::npz::{Writer, cloud_array};
use donut::store::sim_scene::{self, SimScene};
use ndarray::Array2;

use super::conservation::block;

const STEPS: usize = 6;

/// A scene in which the tool comes down on a block of dough from just above it.
fn scene(kind: &str, geometry: &str, height: f64, action: &[f64]) -> SimScene {
    let folder = tempfile::tempdir().unwrap();
    let scale = vec![0.01; action.len()];
    let json = format!(
        r#"{{ "arrays": "scene.npz", "grid": {{"nodes": 64, "dt": 1e-4, "substeps": 20}},
        "material": {{"youngs_modulus": 5000, "poisson_ratio": 0.15, "yield_stress": 150}},
        "gravity": [0, -300, 0], "ground_friction": 0.5, "lower_bound": 1.0, "softness": 666,
        "tools": [ {{"kind": "{kind}", {geometry}, "position": [0.5, {height}, 0.5], "rotation": [0.98, 0.1, 0.0, 0.17],
        "friction": 0.9, "action_scale": {scale:?}, "lower_bound": [0, 0, 0], "upper_bound": [1, 1, 1]}} ] }}"#
    );
    let path = folder.path().join("scene.json");
    std::fs::write(&path, json).unwrap();
    let dough = block(7, [0.476, 0.04, 0.476], 0.008);
    let target: Vec<Point> = dough.iter().map(|p| [p[0] + 0.01, 0.5 * p[1], p[2]]).collect();
    let mut writer = Writer::new(&folder.path().join("scene.npz"));
    writer.add("x0", &cloud_array(&dough)).unwrap();
    writer.add("target", &cloud_array(&target)).unwrap();
    writer.add("actions", &Array2::from_shape_fn((STEPS, action.len()), |(_, c)| action[c])).unwrap();
    writer.finish().unwrap();
    sim_scene::read(&path).unwrap()
}

#[test]
fn gradients_of_all_primitives_agree_with_finite_differences() {
    // The block's top is at 0.089 m; each tool's lowest point starts there.
    let press = [0.1, -0.4, -0.15];
    let turn = [0.1, -0.4, -0.15, 0.2, -0.3, 0.1];
    let cases = [
        ("sphere", r#""radius": 0.04"#, 0.13, &press[..]),
        ("cylinder", r#""radius": 0.04, "length": 0.06"#, 0.127, &press),
        ("torus", r#""radius": 0.02, "tube_radius": 0.01"#, 0.105, &press),
        ("box", r#""half_extents": [0.015, 0.03, 0.03]"#, 0.128, &turn),
    ];
    for (kind, geometry, height, action) in cases {
        let scene = scene(kind, geometry, height, action);
        assert_eq!(scene.tools[0].name, kind);
        let summary = Summary::of(&scene.gradient_case().unwrap().entries(0, 10, 3).unwrap());
        assert!(summary.passes() && summary.unconverged.len() <= 3, "{kind}: {summary:?}");
    }
}

#[test]
fn cylinder_and_torus_translate() {
    let press = [0.1, -0.4, -0.15];
    let cylinder = scene("cylinder", r#""radius": 0.04, "length": 0.06"#, 0.127, &press);
    assert_eq!(cylinder.tools[0].shape, Shape::Cylinder { radius: 0.04, length: 0.06 });
    let torus = scene("torus", r#""radius": 0.02, "tube_radius": 0.01"#, 0.105, &press);
    assert_eq!(torus.tools[0].shape, Shape::Torus { radius: 0.02, tube_radius: 0.01 });
    assert_eq!([&cylinder.tools[0].motion, &torus.tools[0].motion], [&Motion::Translation; 2]);
}
