//! The rows of a suite as Markdown and as CSV.
//!
//! A [`Summary`] comes in, text goes out. Imports summary.

use std::fmt::Write as _;

use serde_json::Value;

use super::summary::{Row, Summary};

/// What table.md says below its tables.
const NOTES: &str = "Score: normalised decrease of the EMD, by exact matching over all particles of settled dough; \
    mean ± standard deviation over the trials. In brackets: 95 % intervals, Student's t for mean scores and Wilson's for \
    success rates. Ceiling: what a second sample of the goal itself would score. GeomLoss: the score by the paper's \
    estimator. Paper: what the paper prints.";

/// table.md: scores beside the paper's, then shape and cost.
pub fn markdown(summary: &Summary) -> String {
    let mut text =
        format!("# {}\n\n{}\n{}\n", summary.suite.name(), scores(&summary.rows), costs(&summary.rows));
    let _ = writeln!(text, "{NOTES}\n");
    let _ =
        writeln!(text, "Made with donut {}, on {}.", summary.builds.join("; "), summary.machines.join("; "));
    text
}

/// The scores beside the paper's.
pub fn scores(rows: &[Row]) -> String {
    let mut text = String::from(
        "| task | method | trials | score | 95 % | paper | success | 95 % | paper | ceiling |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for r in rows {
        let failed = if r.failed > 0 { format!(" ({} failed)", r.failed) } else { String::new() };
        let _ = writeln!(
            text,
            "| {} | {} | {}{failed} | {:.3} ± {:.3} | {} | {} | {} | {} | {} | {} |",
            r.task,
            r.method,
            r.trials,
            r.score_mean,
            r.score_std,
            interval(r.score_low, r.score_high, |v| format!("{v:.3}")),
            number(r.paper_score, 3),
            percent(Some(r.success_rate)),
            interval(r.success_low, r.success_high, |v| format!("{:.0}", 100.0 * v)),
            percent(r.paper_success_rate),
            number(r.score_ceiling_mean, 3),
        );
    }
    text
}

/// Shape and cost.
fn costs(rows: &[Row]) -> String {
    let mut text = String::from(
        "| task | method | GeomLoss | pieces as in the goal | hole radius / goal's, mean (least) | dough in the hole | steps | \
         resets | rollouts | gradients | seconds |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for r in rows {
        let hole = match (r.hole_radius_share_mean, r.hole_radius_share_least) {
            (Some(mean), Some(least)) => format!("{mean:.2} ({least:.2})"),
            _ => "-".to_owned(),
        };
        let membrane = r.membrane_mean.map_or("-".to_owned(), |m| format!("{:.2} %", 100.0 * m));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {hole} | {membrane} | {:.0} | {:.1} | {:.0} | {:.0} | {:.0} |",
            r.task,
            r.method,
            number(r.score_sinkhorn_mean, 3),
            percent(r.pieces_as_goal_rate),
            r.steps_mean,
            r.resets_mean,
            r.rollouts_mean,
            r.gradient_iterations_mean,
            r.seconds_mean,
        );
    }
    text
}

/// results.csv: a line for each row, with the fields of summary.json.
pub fn csv(rows: &[Row]) -> String {
    let mut text = String::new();
    for row in rows {
        let Ok(Value::Object(fields)) = serde_json::to_value(row) else { continue };
        if text.is_empty() {
            let names: Vec<&str> = fields.keys().map(String::as_str).collect();
            let _ = writeln!(text, "{}", names.join(","));
        }
        let cell = |value: &Value| match value {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let cells: Vec<String> = fields.values().map(cell).collect();
        let _ = writeln!(text, "{}", cells.join(","));
    }
    text
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |v| format!("{v:.digits$}"))
}

fn percent(share: Option<f64>) -> String {
    share.map_or("-".to_owned(), |s| format!("{:.0} %", 100.0 * s))
}

fn interval(low: Option<f64>, high: Option<f64>, shown: impl Fn(f64) -> String) -> String {
    match (low, high) {
        (Some(low), Some(high)) => format!("[{}, {}]", shown(low), shown(high)),
        _ => "-".to_owned(),
    }
}
