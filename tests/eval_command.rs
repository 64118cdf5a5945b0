//! `donut eval` as a user meets it.

use std::path::Path;
use std::process::Output;

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

fn table(folder: &Path, args: &[&str]) -> Output {
    Command::cargo_bin("donut")
        .unwrap()
        .args(["eval", "table"])
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn tables_in_documents_are_generated_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let document = folder.path().join("README.md");
    let write = |text: &str| std::fs::write(&document, text).unwrap();
    let run = Command::cargo_bin("donut")
        .unwrap()
        .args(["eval", "--suite", "volume", "--task", "baguette", "--trials", "2", "--out", "results/volume"])
        .current_dir(folder.path())
        .assert();
    let printed = String::from_utf8(run.success().get_output().stdout.clone()).unwrap();
    assert!(printed.contains("| baguette | full | 2 |") && !printed.contains("donut"), "{printed}");
    assert_eq!(table(folder.path(), &["results/volume"]).stdout, printed.as_bytes());

    write("Before.\n\n<!-- donut eval table results/volume -->\nold\n<!-- end of table -->\nAfter.\n");
    let stale = table(folder.path(), &["--check", "README.md"]);
    assert_eq!(stale.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&stale.stderr).contains("--update README.md"));
    assert!(table(folder.path(), &["--update", "README.md"]).status.success());
    let expected = format!(
        "Before.\n\n<!-- donut eval table results/volume -->\n{printed}<!-- end of table -->\nAfter.\n"
    );
    assert_eq!(std::fs::read_to_string(&document).unwrap(), expected);
    assert!(table(folder.path(), &["--check", "README.md"]).status.success());

    for (text, complaint) in [
        ("No table.\n", "no place"),
        ("<!-- donut eval table results/volume -->\n", "no end"),
        ("<!-- donut eval table results/none -->\n<!-- end of table -->\n", "none"),
    ] {
        write(text);
        let error = table(folder.path(), &["--update", "README.md"]);
        assert_eq!(error.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&error.stderr).contains(complaint), "{error:?}");
        assert_eq!(std::fs::read_to_string(&document).unwrap(), text, "nothing was written");
    }
}

#[test]
fn documents_have_the_tables_that_their_results_give() {
    for document in ["README.md", "docs/results.md"] {
        let checked = table(Path::new(env!("CARGO_MANIFEST_DIR")), &["--check", document]);
        assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    }
}

#[test]
fn an_unknown_suite_is_refused() {
    let run = Command::cargo_bin("donut").unwrap().args(["eval", "--suite", "pastry"]).assert().code(2);
    assert!(String::from_utf8_lossy(&run.get_output().stderr).contains("volume"));
}
