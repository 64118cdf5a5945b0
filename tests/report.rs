//! report.html: what it holds, that nothing in it can break out of it, and how large it gets.

use donut::store::record::RunRecord;
use donut::store::trajectory::Step;
use donut::view::report;

use crate::common;

/// The element's text: between its opening tag and its closing tag.
fn element<'a>(html: &'a str, opening: &str) -> &'a str {
    let from = html.find(opening).unwrap_or_else(|| panic!("no {opening}")) + opening.len();
    &html[from..from + html[from..].find("</script>").unwrap()]
}

fn data(html: &str) -> serde_json::Value {
    serde_json::from_str(element(html, r#"<script type="application/json" id="data">"#)).unwrap()
}

#[test]
fn it_carries_the_run_and_calls_for_nothing_else() {
    let html = report::html(&common::cut_bar::cut_bar(300));
    let data = data(&html);
    assert_eq!(data["frames"], 41);
    assert_eq!(data["particles"], 300);
    assert_eq!(data["overlays"].as_array().unwrap().len(), 3, "target and two subgoals");
    assert_eq!(data["reachable"], serde_json::json!({"every": 1, "count": 300, "frames": [0, 20]}));
    assert_eq!(data["tools"][1]["gripper"], true);
    assert_eq!(data["pose"].as_array().unwrap().len(), 41 * 8);
    assert_eq!(data["stages"][1]["title"], "Carry one half away");
    assert_eq!(data["command"], "donut plan --task spread --seed 3");
    for call in ["src=", "@import", "fetch(", "XMLHttpRequest", "import("] {
        assert!(!html.contains(call), "{call}");
    }
    assert!(!html.contains("{{"), "every placeholder is filled");
}

#[test]
fn text_from_files_cannot_become_markup() {
    let mut run = common::squashed_ball(20);
    run.summary.task = "</title><script>alert(0)</script>".into();
    let html = report::html(&run);
    assert!(!html.contains("<script>alert"), "markup from the run's text");
    assert_eq!(html.matches("</script>").count(), 3, "frames, data, program");
    assert_eq!(data(&html)["stages"][0]["code"], run.plan.stages[0].code.as_str(), "the text is unchanged");
    assert_eq!(data(&html)["task_file"], run.plan.task_file.as_str());
}

#[test]
fn numbers_that_are_not_finite_do_not_break_it() {
    let mut run = common::squashed_ball(20);
    run.trajectory.emd[3] = f64::NAN;
    run.trajectory.positions[5][0] = [f32::NAN; 3];
    run.summary.score = f64::NAN;
    let data = data(&report::html(&run));
    assert!(data["emd"][3].is_null() && data["summary"]["score"].is_null());
}

#[test]
fn a_run_that_made_no_step_still_has_a_report() {
    let data = data(&report::html(&common::without_steps(20)));
    assert_eq!(data["frames"], 1);
    assert_eq!(data["stages"][0]["segments"].as_array().unwrap().len(), 0);
}

/// A long run in which every particle trembles, which is harder to compress than dough at rest.
fn long_run(particles: usize, frames: usize) -> RunRecord {
    let mut run = common::squashed_ball(particles);
    let last = run.trajectory.positions.len() - 1;
    let mut rng = donut::math::rng::seeded(1, "tremble");
    let rest: Vec<[f64; 3]> = run.trajectory.positions[last].iter().map(|p| p.map(f64::from)).collect();
    for _ in run.trajectory.positions.len()..frames {
        let positions: Vec<[f64; 3]> =
            rest.iter().map(|p| p.map(|v| v + 1e-3 * donut::math::rng::uniform(&mut rng))).collect();
        let (tool_pose, action) = (run.trajectory.tool_pose[last], &[0.0; 4]);
        run.trajectory.push(Step {
            positions: &positions,
            tool: 0,
            tool_pose,
            stage: 0,
            action,
            emd: f64::NAN,
        });
    }
    run
}

#[test]
fn five_thousand_particles_and_four_hundred_steps_stay_below_fifteen_megabytes() {
    let html = report::html(&long_run(5000, 401));
    assert!(html.len() < 15_000_000, "{} bytes", html.len());
    assert_eq!(data(&html)["stride"], 1, "all particles are shown");
}

#[test]
fn a_larger_run_shows_fewer_particles_instead_of_growing() {
    let html = report::html(&long_run(30_000, 161));
    assert!(html.len() < 15_000_000, "{} bytes", html.len());
    let data = data(&html);
    assert!(data["stride"].as_u64().unwrap() > 1);
    assert!(data["particles"].as_u64().unwrap() < 30_000);
}
