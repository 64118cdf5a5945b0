//! `donut view` as a user calls it.

use donut::store::run_dir::write_run;
use donut::view::report;

use crate::common::{self, donut};

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

/// A GIF file's pictures as they are seen one after another, rows of RGB.
fn film(bytes: &[u8]) -> (usize, usize, Vec<Vec<[u8; 3]>>) {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let (width, height) = (usize::from(decoder.width()), usize::from(decoder.height()));
    let mut screen = vec![[0; 3]; width * height];
    let mut seen = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        for (k, rgba) in frame.buffer.chunks(4).enumerate().filter(|(_, rgba)| rgba[3] > 0) {
            let (x, y) = (k % usize::from(frame.width), k / usize::from(frame.width));
            screen[(usize::from(frame.top) + y) * width + usize::from(frame.left) + x] =
                [rgba[0], rgba[1], rgba[2]];
        }
        seen.push(screen.clone());
    }
    (width, height, seen)
}

#[test]
fn a_film_shows_what_the_pictures_show_in_few_bytes_and_is_the_same_every_time() {
    let dir = tempfile::tempdir().unwrap();
    let run = common::squashed_ball(300);
    write_run(dir.path(), &run, "").unwrap();
    let drawn = |name: &str, flags: &[&str]| {
        let out = dir.path().join(name);
        let size = ["--width", "80", "--height", "60"];
        donut().arg("view").arg(dir.path()).args(size).args(flags).arg("--gif").arg(&out).assert().success();
        std::fs::read(out).unwrap()
    };
    let bytes = drawn("a.gif", &["--every", "20"]);
    assert!(bytes == drawn("b.gif", &["--every", "20"]), "another file for the same run");
    let (width, height, seen) = film(&bytes);
    assert_eq!((width, height, seen.len()), (80, 60, 5), "steps 0, 20, 40, 60 and 80");
    for (k, picture) in seen.iter().enumerate() {
        let scene = donut::view::scene::of_frame(&run, 20 * k).unwrap();
        let exact = donut::view::render(&scene, width, height);
        // The caption stands in the lowest rows.
        let rows = width * (height - 16);
        let off =
            |(a, b): (&[u8; 3], &[u8; 3])| (0..3).map(|c| f64::from(a[c].abs_diff(b[c]))).sum::<f64>() / 3.0;
        let mean = picture[..rows].iter().zip(&exact.pixels[..rows]).map(off).sum::<f64>() / rows as f64;
        assert!(mean < 4.0, "picture {k} is off by {mean} of 255");
    }
    // A run that only settles is shown three times as fast.
    let mut free = common::squashed_ball(300);
    free.trajectory.tool.fill(-1);
    write_run(dir.path(), &free, "").unwrap();
    assert_eq!(film(&drawn("free.gif", &["--every", "20"])).2.len(), 3, "frames 0, 60 and 80");
    write_run(dir.path(), &run, "").unwrap();
    let small: usize = 3 * width * height * seen.len();
    assert!(bytes.len() < small / 3, "{} bytes", bytes.len());
}

#[test]
fn ply_files_hold_the_particles_and_the_tool() {
    let dir = tempfile::tempdir().unwrap();
    let run = common::cut_bar::cut_bar(50);
    write_run(dir.path(), &run, "").unwrap();
    let out = dir.path().join("frames");
    let view =
        |flags: &[&str]| donut().arg("view").arg(dir.path()).args(flags).arg("--ply").arg(&out).assert();
    view(&["--every", "20"]).success();
    let mut names: Vec<String> =
        std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let dough = ["dough_0000.ply", "dough_0020.ply", "dough_0040.ply"];
    assert_eq!(names, [&dough[..], &["target.ply", "tool_0020.ply", "tool_0040.ply"]].concat());

    let bytes = std::fs::read(out.join("dough_0020.ply")).unwrap();
    let (header, body) = ply_parts(&bytes);
    assert!(
        header.starts_with("ply\nformat binary_little_endian 1.0\n")
            && header.contains("element vertex 50\n")
    );
    assert_eq!(body.len(), 50 * (3 * 4 + 4 + 3));
    let float = |at: usize| f32::from_le_bytes(body[at..at + 4].try_into().unwrap());
    for (i, p) in run.trajectory.positions[20].iter().enumerate() {
        assert_eq!([0, 4, 8].map(|o| float(19 * i + o)), *p);
        assert_eq!(body[19 * i + 12..19 * i + 16], run.trajectory.piece[i].to_le_bytes());
    }
    // A gripper is two boxes: twice six faces of two triangles.
    let bytes = std::fs::read(out.join("tool_0040.ply")).unwrap();
    let (header, body) = ply_parts(&bytes);
    assert!(header.contains("element vertex 48\n") && header.contains("element face 24\n"), "{header}");
    assert_eq!(body.len(), 48 * 6 * 4 + 24 * 13);
    let corner = |k: usize| u32::from_le_bytes(body[48 * 24 + 1 + 4 * k..][..4].try_into().unwrap());
    assert!((0..3).all(|k| corner(k) < 48));

    let refused = view(&["--frame", "3"]).code(2);
    let error = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(error.contains("has something in it"), "{error}");
    std::fs::remove_dir_all(&out).unwrap();
    view(&["--frame", "3"]).success();
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 3);
}

fn ply_parts(bytes: &[u8]) -> (String, &[u8]) {
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    (String::from_utf8(bytes[..at].to_vec()).unwrap(), &bytes[at..])
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
