//! report.html in a browser: it loads without errors, frames change when scrubbed, overlays and colours are drawn.
//!
//! Needs Chromium or Chrome, named by DONUT_CHROMIUM or found in PATH; without one the tests say so and pass. Nothing
//! is loaded but the file, and nobody called but this test.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use donut::store::record::RunRecord;
use donut::view::report;
use serde_json::Value;

use crate::common;

/// Works the page like a reader, and leaves what it saw in an element of its own.
const PROBE: &str = include_str!("data/report_probe.js");

fn browser() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("DONUT_CHROMIUM") {
        return Some(path.into());
    }
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    std::env::split_paths(&path).flat_map(|dir| names.map(|name| dir.join(name))).find(|file| file.is_file())
}

/// How long the page may take where there is neither a graphics card nor an idle processor.
const PATIENCE: Duration = Duration::from_secs(240);

/// What the probe saw; the browser's console must have said nothing.
fn probed(run: &RunRecord, more: &[&str]) -> Option<Value> {
    let Some(browser) = browser() else {
        eprintln!("skipped: there is no Chromium; name one with DONUT_CHROMIUM");
        return None;
    };
    let folder = tempfile::tempdir().unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let here = format!("http://{}", listener.local_addr().unwrap());
    let page = folder.path().join("report.html");
    let probe = format!("<script>const here = \"{here}\";\n{PROBE}</script></body>");
    // The report may call nobody; the probe has to call this test.
    let html = report::html(run).replacen(
        "default-src 'none';",
        &format!("default-src 'none'; connect-src {here};"),
        1,
    );
    std::fs::write(&page, html.replacen("</body>", &probe, 1)).unwrap();
    let log = folder.path().join("log");
    let mut running = Command::new(browser)
        .args(["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        .args(["--enable-logging=stderr", "--window-size=320,320"])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .args(more)
        .arg(format!("file://{}", page.display()))
        .stdout(Stdio::null())
        .stderr(File::create(&log).unwrap())
        .spawn()
        .unwrap();
    let said = posted(&listener);
    running.kill().unwrap();
    running.wait().unwrap();
    let log = std::fs::read_to_string(log).unwrap();
    // Reading pixels back is slow, which the driver remarks on.
    let console: Vec<&str> =
        log.lines().filter(|line| line.contains("CONSOLE") && !line.contains("GL Driver Message")).collect();
    assert!(console.is_empty(), "{console:#?}");
    let said = said.unwrap_or_else(|| panic!("the probe did not end within {PATIENCE:?}: {log}"));
    Some(serde_json::from_str(&said).unwrap())
}

/// The body of the first request, if it comes in time.
fn posted(listener: &TcpListener) -> Option<String> {
    listener.set_nonblocking(true).unwrap();
    let begin = Instant::now();
    let stream = loop {
        match listener.accept() {
            Ok((stream, _)) => break stream,
            Err(_) if begin.elapsed() > PATIENCE => return None,
            Err(_) => std::thread::sleep(Duration::from_millis(50)),
        }
    };
    stream.set_nonblocking(false).unwrap();
    let mut reader = BufReader::new(&stream);
    let mut length = 0;
    for line in reader.by_ref().lines().map(Result::unwrap).take_while(|line| !line.is_empty()) {
        if let Some((name, value)) = line.split_once(": ")
            && name.eq_ignore_ascii_case("content-length")
        {
            length = value.parse().unwrap();
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).unwrap();
    (&stream).write_all(b"HTTP/1.1 204 Thanks\r\nConnection: close\r\n\r\n").unwrap();
    Some(String::from_utf8(body).unwrap())
}

#[test]
fn it_loads_without_errors_and_shows_other_frames_when_scrubbed() {
    let Some(seen) = probed(&common::cut_bar::cut_bar(400), &[]) else { return };
    assert_eq!(seen["errors"], serde_json::json!([]), "{seen:#}");
    assert_eq!(seen["notice"], "", "{seen:#}");
    assert_ne!(seen["start"], seen["middle"], "scrubbing shows another frame");
    assert_eq!(seen["start"], seen["back"], "and back again the same");
    assert!(
        seen["cursorInTheMiddle"].as_f64() > seen["cursorAtStart"].as_f64(),
        "the plots follow: {seen:#}"
    );
    assert_ne!(seen["key"], seen["start"]);
    assert_eq!(seen["frame"], "1", "an arrow key steps");
    for change in [
        "target",
        "subgoal",
        "initial",
        "reachable",
        "tool",
        "displacement",
        "height",
        "distance",
        "body",
        "turned",
    ] {
        assert_ne!(seen[change], seen["middle"], "{change} changes nothing");
    }
    assert_eq!(seen["home"], seen["middle"], "the view can be reset");
    assert_eq!(seen["now"], "30 / 40 · stage 2 · gripper");
    assert!(seen["said"].as_str().unwrap().starts_with("step 30 of 40, stage 2, gripper, EMD "), "{seen:#}");
    assert_eq!(seen["stageRows"], 2);
    assert_eq!(seen["plots"].as_array().unwrap().len(), 3);
    assert!(seen["plots"][0].as_str().unwrap().contains("stage 2 from 30 to"), "{seen:#}");
    assert!(seen["played"].as_f64().unwrap() > 30.0 && seen["paused"] == "Play", "{seen:#}");
    assert_eq!(seen["unnamed"], serde_json::json!([]), "every control has a name for screen readers");
}

#[test]
fn a_run_without_steps_and_a_dark_page_load_too() {
    let Some(seen) = probed(&common::without_steps(50), &["--force-dark-mode"]) else { return };
    assert_eq!(seen["notice"], "", "{seen:#}");
    // Nothing to step to, nothing to switch: but nothing breaks either.
    assert_eq!(seen["errors"], serde_json::json!([]), "{seen:#}");
    assert_eq!(seen["start"], seen["middle"]);
}
