//! A run directory on disk: the files of the contract, their keys, and reading them back.

use std::fs;

use donut::store::run_dir::{read_run, write_and_commit, write_run};
use donut::store::{RunDir, StoreError};
use donut::view::report;

use crate::common;

#[test]
fn a_run_comes_back_from_disk() {
    let dir = tempfile::tempdir().unwrap();
    let mut run = common::squashed_ball(200);
    run.plan.stages[0].segments[1].losses[3] = f64::NAN;
    write_run(dir.path(), &run, &report::html(&run)).unwrap();
    let mut back = read_run(dir.path()).unwrap();
    let losses = &mut back.plan.stages[0].segments[1].losses;
    assert!(losses[3].is_nan(), "JSON has no NaN, but the record has");
    losses[3] = 0.0;
    run.plan.stages[0].segments[1].losses[3] = 0.0;
    assert_eq!(back, run);
}

#[test]
fn a_run_of_several_tools_comes_back_with_each_tools_own_actions() {
    let dir = tempfile::tempdir().unwrap();
    let run = common::cut_bar::cut_bar(50);
    write_run(dir.path(), &run, "").unwrap();
    let mut back = read_run(dir.path()).unwrap();
    assert!(back.trajectory.emd[0].is_nan());
    back.trajectory.emd[0] = 0.0;
    let mut expected = run.clone();
    expected.trajectory.emd[0] = 0.0;
    assert_eq!(back, expected);
    assert_eq!(report::html(&read_run(dir.path()).unwrap()), report::html(&run));
}

#[test]
fn files_of_different_runs_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    write_run(dir.path(), &common::squashed_ball(50), "").unwrap();
    common::cut_bar::cut_bar(50).trajectory.write(&dir.path().join("trajectory.npz")).unwrap();
    let error = read_run(dir.path()).unwrap_err().to_string();
    assert!(error.contains("plan.json") && error.contains("tool 1"), "{error}");
}

#[test]
fn the_files_and_keys_are_those_others_rely_on() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("runs/spread");
    let run = common::squashed_ball(100);
    write_and_commit(RunDir::claim(&out).unwrap(), &run, &report::html(&run)).unwrap();
    for file in ["summary.json", "trajectory.npz", "plan.json", "report.html"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    for key in [
        "task",
        "seed",
        "method",
        "score",
        "threshold",
        "success",
        "emd_initial",
        "emd_final",
        "seconds",
        "particles",
        "stages",
    ] {
        assert!(summary.get(key).is_some(), "summary.json lacks {key}");
    }
    for key in ["tool", "steps", "resets", "score", "emd_initial", "emd_final", "seconds"] {
        assert!(summary["stages"][0].get(key).is_some(), "a stage of summary.json lacks {key}");
    }
    let mut npz = donut::store::npz::Reader::open(&out.join("trajectory.npz")).unwrap();
    let shape = |a: ndarray::ArrayD<f64>| a.shape().to_vec();
    let frames = common::STEPS + 1;
    assert_eq!(npz.array::<ndarray::Ix3>("positions").unwrap().dim(), (frames, 100, 3));
    assert_eq!(npz.array::<ndarray::Ix2>("tool_pose").unwrap().dim(), (frames, 8));
    assert_eq!(npz.array::<ndarray::Ix2>("actions").unwrap().dim(), (frames - 1, 4));
    for name in ["tool", "stage"] {
        assert_eq!(shape(npz.array::<ndarray::IxDyn>(name).unwrap()), [frames], "{name}");
    }
    for name in ["initial", "target", "subgoal_0"] {
        assert_eq!(npz.cloud(name).unwrap().len(), 100, "{name}");
    }
}

#[test]
fn an_unfinished_run_is_named_as_such() {
    let dir = tempfile::tempdir().unwrap();
    write_run(dir.path(), &common::squashed_ball(10), "").unwrap();
    fs::remove_file(dir.path().join("summary.json")).unwrap();
    let error = read_run(dir.path()).unwrap_err();
    assert!(matches!(error, StoreError::Incomplete { missing: "summary.json", .. }));
    assert!(error.to_string().contains("donut plan"), "{error}");
}

#[test]
fn the_same_run_makes_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["a", "b"] {
        let run = common::squashed_ball(50);
        let claimed = RunDir::claim(&dir.path().join(name)).unwrap();
        write_and_commit(claimed, &run, &report::html(&run)).unwrap();
    }
    for file in ["summary.json", "trajectory.npz", "plan.json", "report.html"] {
        let bytes = |name: &str| fs::read(dir.path().join(name).join(file)).unwrap();
        assert_eq!(bytes("a"), bytes("b"), "{file}");
    }
}
