//! report.html

use crate::store::record::RunRecord;

/// The report of a run.
pub fn html(_run: &RunRecord) -> String {
    String::new()
}
