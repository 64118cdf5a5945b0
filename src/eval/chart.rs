//! A bar chart like the paper's ablation figures, as SVG.
//!
//! Rows come in; two panels go out, scores and success rates, a group of bars for each task, with 95 % intervals and
//! the paper's values as marks. Imports summary.

use std::fmt::Write as _;

use super::summary::Row;

const WIDTH: f64 = 460.0;
const HEIGHT: f64 = 300.0;
/// Room around a panel: left, top, right, bottom.
const MARGIN: [f64; 4] = [44.0, 30.0, 12.0, 26.0];
const LEGEND_LINE: f64 = 18.0;
/// Share of a group's width that is left free.
const GAP: f64 = 0.2;
/// Colours that differ in lightness as well, for prints and for the colour-blind (Okabe and Ito).
const COLOURS: [&str; 8] =
    ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#999999", "#f0e442"];

/// One panel's numbers.
struct Panel {
    title: &'static str,
    value: fn(&Row) -> f64,
    interval: fn(&Row) -> Option<[f64; 2]>,
    paper: fn(&Row) -> Option<f64>,
}

const PANELS: [Panel; 2] = [
    Panel {
        title: "Normalised decrease of the EMD",
        value: |r| r.score_mean,
        interval: |r| Some([r.score_low?, r.score_high?]),
        paper: |r| r.paper_score,
    },
    Panel {
        title: "Success rate",
        value: |r| r.success_rate,
        interval: |r| Some([r.success_low?, r.success_high?]),
        paper: |r| r.paper_success_rate,
    },
];

/// The chart.
pub fn svg(rows: &[Row]) -> String {
    let tasks = distinct(rows, |r| &r.task);
    let methods = distinct(rows, |r| &r.method);
    let height = HEIGHT + LEGEND_LINE * ((methods.len() as f64 / 3.0).ceil() + 1.8);
    let width = WIDTH * PANELS.len() as f64;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (k, panel) in PANELS.iter().enumerate() {
        draw(&mut out, panel, rows, &tasks, &methods, WIDTH * k as f64);
    }
    for (k, method) in methods.iter().enumerate() {
        let (x, y) = (MARGIN[0] + (k % 3) as f64 * 290.0, HEIGHT + LEGEND_LINE * (1 + k / 3) as f64);
        let _ = writeln!(
            out,
            "<rect x=\"{x}\" y=\"{:.1}\" width=\"11\" height=\"11\" fill=\"{}\"/><text x=\"{:.1}\" y=\"{y}\">{method}</text>",
            y - 10.0,
            colour(k),
            x + 16.0,
        );
    }
    let y = height - 5.0;
    let _ = writeln!(
        out,
        "<path d=\"M{0} {1:.1}h14\" stroke=\"black\" stroke-width=\"2.5\"/><text x=\"{2}\" y=\"{y}\">the paper's value; \
         whiskers: 95 % intervals</text>\n</svg>",
        MARGIN[0],
        y - 4.0,
        MARGIN[0] + 20.0,
    );
    out
}

fn draw(out: &mut String, panel: &Panel, rows: &[Row], tasks: &[&str], methods: &[&str], left: f64) {
    let lows = rows.iter().flat_map(|r| [(panel.value)(r), (panel.paper)(r).unwrap_or(0.0)]);
    // Down to the next tenth below the lowest value, but not for whiskers.
    let floor = (lows.fold(0.0, f64::min) * 10.0).floor() / 10.0;
    let (x0, x1) = (left + MARGIN[0], left + WIDTH - MARGIN[2]);
    let (y0, y1) = (HEIGHT - MARGIN[3], MARGIN[1]);
    let y = |v: f64| y0 - (v.clamp(floor, 1.0) - floor) / (1.0 - floor) * (y0 - y1);
    let _ = writeln!(out, "<text x=\"{x0}\" y=\"18\" font-weight=\"bold\">{}</text>", panel.title);
    for tick in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let _ = writeln!(
            out,
            "<path d=\"M{x0} {0:.1}H{x1}\" stroke=\"#ddd\"/><text x=\"{1:.1}\" y=\"{2:.1}\" text-anchor=\"end\">{tick}</text>",
            y(tick),
            x0 - 5.0,
            y(tick) + 4.0,
        );
    }
    let group = (x1 - x0) / tasks.len().max(1) as f64;
    let bar = group * (1.0 - GAP) / methods.len().max(1) as f64;
    for (g, task) in tasks.iter().enumerate() {
        let middle = x0 + group * (g as f64 + 0.5);
        let _ = writeln!(
            out,
            "<text x=\"{middle:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{task}</text>",
            HEIGHT - 8.0
        );
        for (m, method) in methods.iter().enumerate() {
            let Some(row) = rows.iter().find(|r| r.task == *task && r.method == *method) else { continue };
            let x = x0 + group * (g as f64 + GAP / 2.0) + bar * m as f64;
            let (top, bottom) = (y((panel.value)(row).max(0.0)), y((panel.value)(row).min(0.0)));
            let _ = writeln!(
                out,
                "<rect x=\"{x:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\"><title>{task}, {method}: \
                 {:.3}</title></rect>",
                bar * 0.9,
                bottom - top,
                colour(m),
                (panel.value)(row),
            );
            let centre = x + 0.45 * bar;
            if let Some([low, high]) = (panel.interval)(row) {
                let _ =
                    writeln!(out, "<path d=\"M{centre:.1} {:.1}V{:.1}\" stroke=\"#444\"/>", y(low), y(high));
            }
            if let Some(value) = (panel.paper)(row) {
                let _ = writeln!(
                    out,
                    "<path d=\"M{x:.1} {:.1}h{:.1}\" stroke=\"black\" stroke-width=\"2.5\"/>",
                    y(value),
                    bar * 0.9
                );
            }
        }
    }
    let _ = writeln!(out, "<path d=\"M{x0} {0:.1}H{x1}\" stroke=\"black\"/>", y(0.0));
}

fn colour(index: usize) -> &'static str {
    COLOURS[index % COLOURS.len()]
}

/// The different names, in the order in which they come.
fn distinct(rows: &[Row], of: fn(&Row) -> &String) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        let name = of(row).as_str();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}
