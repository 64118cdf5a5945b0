//! The table of the pieces that a plan makes, with stated and measured volumes.
//!
//! Stages come in, a table goes out. Imports `llm`.

use comfy_table::Table;

use crate::llm::stage::Stage;
use crate::math::cloud::{Bounds, centroid};

/// One row for each cloud, in the plan's own units.
pub fn pieces_table(stages: &[Stage]) -> Table {
    let mut table = Table::new();
    table.set_header([
        "step",
        "tool",
        "made of",
        "piece",
        "points",
        "centre",
        "size",
        "stated vol.",
        "measured",
    ]);
    for stage in stages {
        for output in &stage.outputs {
            let shown = |p: [f64; 3]| format!("{:.3} {:.3} {:.3}", p[0], p[1], p[2]);
            table.add_row([
                stage.step.to_string(),
                stage.tool.clone().unwrap_or_else(|| "none".into()),
                stage.inputs.join(", "),
                output.name.clone(),
                output.points.len().to_string(),
                shown(centroid(&output.points)),
                Bounds::of(&output.points).map(|b| shown(b.size())).unwrap_or_default(),
                stage.stated_volume.get(&output.name).map(|v| format!("{v:.5}")).unwrap_or_default(),
                format!("{:.5}", output.measured_volume()),
            ]);
        }
    }
    table
}
