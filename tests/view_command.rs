//! `donut view` as a user calls it.

mod common;

use assert_cmd::Command;
use donut::store::run_dir::write_run;
use donut::view::report;

fn donut() -> Command {
    Command::cargo_bin("donut").unwrap()
}

#[test]
fn it_draws_key_frames_and_one_frame_and_writes_the_report_again() {
    let dir = tempfile::tempdir().unwrap();
    let run = common::squashed_ball(200);
    write_run(dir.path(), &run, "").unwrap();
    let out = |name: &str| dir.path().join(name);
    let view = |flags: &[&str], name: &str| {
        donut().arg("view").arg(dir.path()).args(flags).arg(out(name)).assert().success().stdout("");
        std::fs::read(out(name)).unwrap()
    };
    let strip = view(&["--width", "40", "--height", "30", "--png"], "strip.png");
    let one = view(&["--width", "40", "--height", "30", "--frame", "40", "--png"], "one.png");
    assert!(strip.starts_with(b"\x89PNG") && one.starts_with(b"\x89PNG"));
    // Width and height stand in the header's first block.
    assert_eq!(strip[16..24], [0, 0, 0, 172, 0, 0, 0, 30]);
    assert_eq!(one[16..24], [0, 0, 0, 40, 0, 0, 0, 30]);
    assert_eq!(view(&["--html"], "again.html"), report::html(&run).as_bytes());
}

#[test]
fn mistakes_are_named_and_exit_with_2() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |args: &[&str], says: &str| {
        let output = donut().arg("view").args(args).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(says), "{error}");
    };
    let path = dir.path().to_str().unwrap();
    refused(&[path], "--png");
    refused(&[path, "--png", "x.png"], "not a finished donut run");
    write_run(dir.path(), &common::squashed_ball(20), "").unwrap();
    refused(&[path, "--png", "x.png", "--frame", "81"], "0 to 80");
    refused(&[path, "--html", &format!("{path}/none/x.html")], "cannot write");
}
