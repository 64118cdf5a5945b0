//! `donut bench` and `--memory-limit` on the command line: what other programs read, and that no bit depends on memory.

use std::path::Path;

use serde_json::Value;

use crate::common::donut;

fn bench(case: &str) -> Value {
    let out = donut().args(["bench", "--runs", "1", "--json", "--case", case]).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

fn keys(object: &Value) -> Vec<&str> {
    object.as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn a_case_has_the_fields_that_other_programs_rely_on() {
    let result = bench("A");
    assert_eq!(result["threads"], 1);
    let [case] = &result["cases"].as_array().unwrap()[..] else { panic!("one case: {result}") };
    assert_eq!(
        keys(case),
        [
            "name",
            "particles",
            "grid_nodes",
            "substeps",
            "forward_seconds",
            "forward_backward_seconds",
            "forward_ns_per_particle_substep",
            "forward_backward_ns_per_particle_substep"
        ]
    );
    assert_eq!(case["name"], "A");
    assert_eq!(
        (&case["particles"], &case["grid_nodes"], &case["substeps"]),
        (&5000.into(), &64.into(), &800.into())
    );
}

#[test]
fn a_batch_says_how_many_rollouts_it_makes_in_a_second() {
    let result = bench("R1");
    let [batch] = &result["batches"].as_array().unwrap()[..] else { panic!("one batch: {result}") };
    assert_eq!(keys(batch), ["name", "particles", "substeps", "rollouts_per_second", "gradients_per_second"]);
    assert!(batch["rollouts_per_second"].as_f64().unwrap() > 0.0);
    assert!(batch["gradients_per_second"].as_f64().unwrap() > 0.0);
}

#[test]
fn an_unknown_case_is_refused_with_those_there_are() {
    let out = donut().args(["bench", "--case", "F"]).output().unwrap();
    assert_eq!(out.status.code(), Some(2));
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(said.contains("`F`") && said.contains("A to D"), "{said}");
}

#[test]
fn simulate_gives_the_same_bits_with_any_memory_limit() {
    let dir = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/mpm/s2-pin/scene.json");
    let with = |limit: &str| {
        let out = dir.path().join(format!("{limit}.npz"));
        donut()
            .args(["simulate", "--gradient", "--precision", "f32", "--memory-limit", limit])
            .arg(&scene)
            .arg("--out")
            .arg(&out)
            .assert()
            .success();
        std::fs::read(out).unwrap()
    };
    assert!(with("0MiB") == with("4GiB"));
    donut().args(["simulate", "--memory-limit", "100"]).arg(&scene).args(["--out", "x.npz"]).assert().code(2);
}
