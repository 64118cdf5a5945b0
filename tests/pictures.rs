//! Pictures of a run: they are the same every time and show what they should.

use std::path::Path;

use donut::view::{Picture, key_frames, render, scene};

use crate::common;

#[test]
fn dough_is_in_the_middle_on_a_grey_table_and_the_bytes_repeat() {
    let run = common::squashed_ball(2000);
    let scene = scene::of_dough(&run, common::STEPS).unwrap();
    let picture = render(&scene, 160, 120);
    let [r, g, b] = picture.at(80, 66);
    assert!(r > g && g > b && r > 120 && r - b > 40, "dough-coloured: {:?}", [r, g, b]);
    let [r, g, b] = picture.at(4, 116);
    assert!(r.abs_diff(b) < 30 && g > 100, "table-coloured: {:?}", [r, g, b]);
    assert_eq!(render(&scene, 160, 120), picture);
}

#[test]
fn the_rolling_pin_is_seen_above_the_dough() {
    let run = common::squashed_ball(500);
    let with = render(&scene::of_frame(&run, 40).unwrap(), 96, 72);
    let without = render(&scene::of_dough(&run, 40).unwrap(), 96, 72);
    let changed = with.pixels.iter().zip(&without.pixels).filter(|(a, b)| a != b).count();
    assert!(changed > 96 * 72 / 20, "{changed} pixels");
}

/// The picture of a file beside the tests. Other machines round sines and roots differently in the last bit, so that a
/// few pixels may be off by a little. DONUT_BLESS=1 makes the file anew.
fn snapshot(name: &str, picture: &Picture) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/pictures").join(name);
    if std::env::var_os("DONUT_BLESS").is_some() {
        picture.write_png(&file).unwrap();
    }
    let bytes = std::fs::read(&file).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut expected = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut expected).unwrap();
    assert_eq!((info.width as usize, info.height as usize), (picture.width, picture.height), "{name}");
    let off = |(a, b): &(&u8, &u8)| a.abs_diff(**b) > 4;
    let count = expected.iter().zip(picture.pixels.as_flattened()).filter(off).count();
    assert!(count * 200 < expected.len(), "{name}: {count} of {} values are off", expected.len());
}

#[test]
fn pictures_are_those_that_were_looked_at() {
    let (ball, bar) = (common::squashed_ball(2000), common::cut_bar::cut_bar(2000));
    snapshot("rolling-pin.png", &render(&scene::of_frame(&ball, 30).unwrap(), 160, 120));
    snapshot("gripper.png", &render(&scene::of_frame(&bar, 40).unwrap(), 160, 120));
    snapshot("key-frames.png", &key_frames(&bar, 120, 90));
}

#[test]
fn key_frames_are_before_stages_after_and_goal() {
    let strip = key_frames(&common::squashed_ball(300), 60, 40);
    assert_eq!((strip.width, strip.height), (4 * 60 + 3 * 4, 40));
    // Where the dough has settled with the tool away, the last stage's panel shows it.
    let mut settled = common::squashed_ball(300);
    let last =
        settled.trajectory.positions.last().unwrap().iter().map(|p| p.map(f64::from)).collect::<Vec<_>>();
    settled.trajectory.push_free(&last, 0, f64::NAN);
    assert_eq!(key_frames(&settled, 60, 40).width, 3 * 60 + 2 * 4);
    let strip = key_frames(&common::without_steps(300), 60, 40);
    assert_eq!(strip.width, 3 * 60 + 2 * 4, "no stage has a frame");
}

/// Writes made-up runs for looking at: `cargo test --release --test all pictures -- --ignored`.
#[test]
#[ignore = "writes target/made-up-runs, to be looked at"]
fn write_made_up_runs() {
    let out = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("target/made-up-runs");
    let runs = [
        ("ball", common::squashed_ball(5000)),
        ("bar", common::cut_bar::cut_bar(5000)),
        ("nothing", common::without_steps(500)),
    ];
    for (name, run) in runs {
        let dir = donut::store::RunDir::claim(&out.join(name)).unwrap();
        donut::store::run_dir::write_and_commit(dir, &run, &donut::view::report::html(&run)).unwrap();
    }
}
