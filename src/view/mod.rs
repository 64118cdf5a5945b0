//! Looking at a run: `report.html` and pictures.

pub mod report;
