//! Programs as language models write them, against the values that CPython and numpy give.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use donut::stagecode::{Captured, Limits, evaluate};
use serde_json::Value;

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs")
}

/// Whether two numbers agree to 1e-12, relative where they are large.
fn agree(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * b.abs().max(1.0)
}

#[test]
fn programs_give_the_values_of_numpy() {
    let text = fs::read_to_string(folder().join("expected.json")).unwrap();
    let expected: BTreeMap<String, Value> = serde_json::from_str(&text).unwrap();
    let (mut failures, mut count) = (Vec::new(), 0);
    for file in ["arrays", "clouds", "draws", "functions", "language", "library"] {
        let programs = fs::read_to_string(folder().join(format!("{file}.py"))).unwrap();
        let mut line = 1;
        for block in programs.split_inclusive("\n#%% ").flat_map(|b| b.strip_suffix("#%% ").or(Some(b))) {
            let block = block.strip_prefix("#%% ").unwrap_or(block);
            let (name, code) = block.split_once('\n').unwrap();
            let name = format!("{file}: {name}");
            let wanted = &expected[&name];
            let found = evaluate(&Limits::default(), |s| s.run(code, line + 1, 0).map(|()| s.capture("out")));
            line += block.matches('\n').count();
            count += 1;
            let wanted_values: Vec<f64> =
                wanted["values"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
            match found {
                Err(error) => failures.push(format!("{name}: {error}, {:?}", error.fault.hint())),
                Ok(Captured::Array { shape, values }) => {
                    if serde_json::json!(shape) != wanted["shape"] {
                        failures.push(format!("{name}: shape {shape:?}, not {}", wanted["shape"]));
                    }
                    let mut pairs = values.iter().zip(&wanted_values).enumerate();
                    if let Some((i, (a, b))) = pairs.find(|(_, (a, b))| !agree(**a, **b)) {
                        failures.push(format!("{name}: [{i}] is {a}, not {b}"));
                    }
                }
                Ok(other) => failures.push(format!("{name}: {other:?}")),
            }
        }
    }
    assert!(failures.is_empty(), "{} of {count}\n{}", failures.len(), failures.join("\n"));
    assert_eq!(count, expected.len());
}
