//! `donut eval` as a user meets it.

use assert_cmd::Command;
use serde_json::Value;

#[test]
fn the_table_of_volume_change_stands_beside_the_papers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("volume");
    let run = Command::cargo_bin("donut")
        .unwrap()
        .args(["eval", "--suite", "volume", "--json", "--out"])
        .arg(&out)
        .assert();
    let printed: Value = serde_json::from_slice(&run.success().get_output().stdout).unwrap();
    let written: Value = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    assert_eq!(written["suite"], "volume");
    let rows = written["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 6);
    for row in rows {
        assert_eq!((row["trials"].as_u64(), row["failed"].as_u64()), (Some(4), Some(0)), "{row}");
        if row["method"] == "full" {
            // The answers derive the volume to five digits; what is left is what a measurement may be off.
            assert!(row["volume_change_mean"].as_f64().unwrap() < 0.1, "{row}");
        }
    }
    assert_eq!(rows[0]["paper_volume_change"], 0.739);
    let lines = std::fs::read_to_string(out.join("results.jsonl")).unwrap();
    assert_eq!(lines.lines().count(), 24);
    let first: Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    assert!((first["volume_of_dough"].as_f64().unwrap() - 4.18879).abs() < 1e-5);
    assert!(std::fs::read_to_string(out.join("table.md")).unwrap().contains("| donut | full | 4 |"));
}

#[test]
fn an_unknown_suite_is_refused() {
    let run = Command::cargo_bin("donut").unwrap().args(["eval", "--suite", "pastry"]).assert().code(2);
    assert!(String::from_utf8_lossy(&run.get_output().stderr).contains("volume"));
}
