//! The simulator against results of an independent implementation (tests/data/mpm, see its README), against
//! finite differences, closed forms, and itself: threads, precisions, memory limits.

mod batch;
mod conservation;
mod contact;
mod determinism;
mod gradient;
mod primitives;
mod scenes;
mod units;

use std::path::PathBuf;

use donut::store::npz::Reader;
use donut::store::sim_scene::{self, SimScene};

/// Scenes with their expected results.
pub const SCENES: [&str; 9] = [
    "s1-fall",
    "s2-pin",
    "s3-knife",
    "s4-gripper",
    "s5-pole",
    "s6-boxrot",
    "s8b-gf1p5",
    "s8c-gf100",
    "s11-elastic-F0",
];

/// Those with a tool.
pub const TOOL_SCENES: [&str; 5] = ["s2-pin", "s3-knife", "s4-gripper", "s5-pole", "s6-boxrot"];

pub fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/mpm").join(name)
}

pub fn scene(name: &str) -> SimScene {
    sim_scene::read(&data(name).join("scene.json")).unwrap()
}

pub fn expected(name: &str) -> Reader {
    Reader::open(&data(name).join("expected.npz")).unwrap()
}

/// Largest absolute difference.
pub fn worst<'a>(a: impl IntoIterator<Item = &'a f64>, b: impl IntoIterator<Item = &'a f64>) -> f64 {
    let mut b = b.into_iter();
    let worst = a.into_iter().map(|x| (x - b.next().expect("as many")).abs()).fold(0.0, f64::max);
    assert!(b.next().is_none(), "as many");
    worst
}
