//! `donut emd` as people and scripts call it.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use donut::math::cloud::Point;
use ndarray::{Array1, Array2, Array3, array};
use ndarray_npy::{WritableElement, WriteNpyExt, read_npy, write_npy};
use serde_json::Value;
use tempfile::TempDir;

use super::clouds::cube;
use super::golden::Golden;

/// A folder with files in it, and `donut emd` run there.
struct Desk(TempDir);

impl Desk {
    fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn cloud(&self, name: &str, points: &[Point]) {
        let rows = Array2::from_shape_fn((points.len(), 3), |(i, a)| points[i][a]);
        write_npy(self.path(name), &rows).unwrap();
    }

    fn numbers<T: WritableElement + Clone>(&self, name: &str, values: &[T]) {
        Array1::from(values.to_vec()).write_npy(std::fs::File::create(self.path(name)).unwrap()).unwrap();
    }

    fn emd(&self, arguments: &str) -> Command {
        let mut command = Command::cargo_bin("donut").unwrap();
        command.current_dir(self.0.path()).arg("emd").args(arguments.split_whitespace());
        command
    }

    fn json(&self, arguments: &str) -> Value {
        let output = self.emd(&format!("{arguments} --json")).assert().success().get_output().stdout.clone();
        serde_json::from_slice(&output).unwrap()
    }

    /// Runs what must fail with code 2 and leave nothing behind; returns the message.
    fn error(&self, arguments: &str) -> String {
        let files = |folder: &Path| folder.read_dir().unwrap().count();
        let before = files(self.0.path());
        let output = self.emd(arguments).assert().code(2).get_output().clone();
        assert!(output.stdout.is_empty(), "{arguments}");
        assert_eq!(files(self.0.path()), before, "{arguments}");
        String::from_utf8(output.stderr).unwrap()
    }
}

#[test]
fn golden_cases_come_out_of_the_command() {
    for mut case in Golden::all() {
        if !["box_boxes_250x900", "p2_weighted_200x220_s09", "diameter1_300"].contains(&case.name.as_str()) {
            continue;
        }
        let desk = Desk::new();
        desk.cloud("x.npy", &case.cloud("x"));
        desk.cloud("y.npy", &case.cloud("y"));
        desk.numbers("a.npy", &case.array("a"));
        desk.numbers("b.npy", &case.array("b"));
        let given = case.number("diameter_given");
        let diameter = if given.is_nan() { String::new() } else { format!("--diameter {given}") };
        let common = format!("x.npy y.npy --source-weights a.npy --target-weights b.npy --p {}", case.p());
        let sinkhorn = format!(
            "{common} --blur {} --scaling {} {diameter} --gradient g.npy",
            case.number("blur"),
            case.number("scaling")
        );

        let found = desk.json(&sinkhorn);
        let value = case.number("value_debiased");
        assert!(
            (found["value"].as_f64().unwrap() - value).abs() < 1e-9 + 1e-6 * value.abs(),
            "{}",
            case.name
        );
        assert_eq!(found["method"], "sinkhorn");
        assert!(found["iterations"].as_u64().unwrap() > 3 && found["seconds"].is_f64());
        let gradient: Array2<f64> = read_npy(desk.path("g.npy")).unwrap();
        let expected = case.array("grad_x_debiased");
        assert!(gradient.iter().zip(&expected).all(|(g, e)| (g - e).abs() < 1e-9), "{}", case.name);

        let biased = desk.json(&format!("{sinkhorn} --no-debias"))["value"].as_f64().unwrap();
        assert!((biased - case.number("value_biased")).abs() < 1e-9);
        let single = desk.json(&format!("{sinkhorn} --precision f32"))["value"].as_f64().unwrap();
        assert!((single - value).abs() < 1e-6 + 1e-4 * value.abs());
        let exact = desk.json(&format!("{common} --exact"));
        assert!((exact["value"].as_f64().unwrap() - case.number("exact_emd")).abs() < 1e-9);
        assert_eq!(exact["method"], "exact");
    }
}

#[test]
fn a_matching_by_squares_is_written_and_no_swap_makes_it_cheaper() {
    let desk = Desk::new();
    let (x, y) = (cube(40, 1), cube(40, 2));
    desk.cloud("x.npy", &x);
    desk.cloud("y.npy", &y);
    let value = desk.json("x.npy y.npy --exact --p 2 --match m.npy")["value"].as_f64().unwrap();
    let matched: Array1<i64> = read_npy(desk.path("m.npy")).unwrap();
    let cost =
        |i: usize, j: usize| 0.5 * (0..3).map(|a| (x[i][a] - y[matched[j] as usize][a]).powi(2)).sum::<f64>();
    let mean = (0..40).map(|i| cost(i, i)).sum::<f64>() / 40.0;
    assert!((mean - value).abs() < 1e-12, "{mean} {value}");
    let mut targets = matched.to_vec();
    targets.sort_unstable();
    assert_eq!(targets, (0..40).collect::<Vec<_>>());
    let swaps = (0..40).flat_map(|i| (0..i).map(move |j| (i, j)));
    for (i, j) in swaps {
        assert!(cost(i, i) + cost(j, j) <= cost(i, j) + cost(j, i) + 1e-12, "{i} {j}");
    }
}

#[test]
fn a_matching_is_written() {
    let desk = Desk::new();
    let x = cube(50, 1);
    desk.cloud("x.npy", &x);
    desk.cloud("y.npy", &x.iter().rev().copied().collect::<Vec<_>>());
    assert_eq!(desk.json("x.npy y.npy --exact --match m.npy")["value"], 0.0);
    let matched: Array1<i64> = read_npy(desk.path("m.npy")).unwrap();
    assert!(matched.iter().enumerate().all(|(i, &j)| i as i64 + j == 49));
    assert_eq!(desk.0.path().read_dir().unwrap().count(), 3);
}

#[test]
fn float32_and_tables_work_and_what_did_not_converge_is_said() {
    let desk = Desk::new();
    write_npy(desk.path("x.npy"), &array![[0.0_f32, 0.0, 0.0], [0.0, 1.0, 0.0]]).unwrap();
    write_npy(desk.path("y.npy"), &array![[2.0_f32, 0.0, 0.0], [2.0, 1.0, 0.0]]).unwrap();
    let output = desk.emd("x.npy y.npy --exact").assert().success().get_output().clone();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("exact") && text.contains("2.000000000"), "{text}");

    desk.cloud("c.npy", &cube(300, 1));
    desk.cloud("d.npy", &cube(300, 2));
    let output = desk.emd("c.npy d.npy").assert().success().get_output().clone();
    let warning = String::from_utf8(output.stderr).unwrap();
    assert!(warning.contains("not converged") && warning.contains("--exact"), "{warning}");
}

#[test]
fn column_order_and_byte_order_change_nothing() {
    let desk = Desk::new();
    let (x, y) = (cube(30, 1), cube(40, 2));
    desk.cloud("x.npy", &x);
    desk.cloud("y.npy", &y);
    let columns = Array2::from_shape_fn((3, x.len()), |(axis, i)| x[i][axis]);
    write_npy(desk.path("columns.npy"), &columns.t()).unwrap();
    let mut big = std::fs::read(desk.path("x.npy")).unwrap();
    let header = big.len() - 24 * x.len();
    let kind = big.windows(3).position(|w| w == b"<f8").unwrap();
    big[kind] = b'>';
    big[header..].chunks_exact_mut(8).for_each(<[u8]>::reverse);
    std::fs::write(desk.path("big.npy"), big).unwrap();
    for flags in ["", "--exact"] {
        let expected = desk.json(&format!("x.npy y.npy {flags}"));
        for file in ["columns.npy", "big.npy"] {
            assert_eq!(desk.json(&format!("{file} y.npy {flags}"))["value"], expected["value"], "{file}");
        }
    }
}

#[test]
fn bad_files_are_named() {
    let desk = Desk::new();
    desk.cloud("ok.npy", &cube(5, 1));
    desk.cloud("nan.npy", &[[0.0; 3], [0.0, f64::NAN, 0.0]]);
    desk.cloud("inf.npy", &[[f64::INFINITY, 0.0, 0.0]]);
    desk.cloud("empty.npy", &[]);
    desk.cloud("far.npy", &[[0.0; 3], [0.0; 3], [0.0, 1e300, 0.0]]);
    write_npy(desk.path("lying.npy"), &Array2::<f64>::zeros((3, 4))).unwrap();
    write_npy(desk.path("flat.npy"), &Array2::<f64>::zeros((4, 2))).unwrap();
    write_npy(desk.path("deep.npy"), &Array3::<f64>::zeros((4, 3, 3))).unwrap();
    write_npy(desk.path("int.npy"), &Array2::<i64>::zeros((4, 3))).unwrap();
    std::fs::write(desk.path("text.npy"), "0 1 2").unwrap();
    for (file, words) in [
        ("nan.npy", "row 1"),
        ("inf.npy", "row 0"),
        ("empty.npy", "empty"),
        ("far.npy", "row 2"),
        ("lying.npy", "transpose"),
        ("flat.npy", "(n, 3)"),
        ("deep.npy", "(n, 3)"),
        ("int.npy", "float64"),
        ("text.npy", "numpy.save"),
        ("none.npy", "cannot read"),
    ] {
        for arguments in [format!("ok.npy {file} --gradient g.npy"), format!("{file} ok.npy --exact")] {
            let message = desk.error(&arguments);
            assert!(message.contains(file) && message.contains(words), "{arguments}: {message}");
        }
    }
}

#[test]
fn bad_weights_and_settings_are_refused() {
    let desk = Desk::new();
    desk.cloud("x.npy", &cube(4, 1));
    desk.cloud("y.npy", &cube(5, 2));
    desk.numbers("short.npy", &[0.5, 0.5]);
    desk.numbers("negative.npy", &[0.5, -0.5, 0.5, 0.5]);
    desk.numbers("heavy.npy", &[0.5, 0.5, 0.5, 0.5]);
    desk.cloud("square.npy", &cube(4, 3));
    for (arguments, words) in [
        ("--source-weights short.npy", "short.npy"),
        ("--source-weights negative.npy", "row 1"),
        ("--source-weights heavy.npy", "sum to 2"),
        ("--source-weights square.npy", "(n,)"),
        ("--source-weights square.npy", "ravel"),
        ("--scaling 0.9999999999", "smaller scaling"),
        ("--p 2 --blur 1e-200 --precision f32 --gradient g.npy", "blur"),
        ("--exact --match m.npy", "4 and 5 points"),
        ("--blur 0", "blur"),
        ("--blur -1", "blur"),
        ("--blur nan", "blur"),
        ("--scaling 1", "scaling"),
        ("--scaling 0", "scaling"),
        ("--diameter 0", "diameter"),
        ("--p 3", "p must be 1 or 2"),
        ("--match m.npy", "--exact"),
        ("--exact --match m.npy", "--match"),
        ("--exact --gradient g.npy", "--gradient"),
        ("--gradient nowhere/g.npy", "nowhere"),
    ] {
        let message = desk.error(&format!("x.npy y.npy {arguments}"));
        assert!(message.contains(words), "{arguments}: {message}");
    }
}
