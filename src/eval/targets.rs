//! The generated targets of an experiment, for others to use.
//!
//! Specs with generated targets come in; `targets.json` with the exact solids and, for each target that was run, an
//! `.npz` with the clouds go out. Imports store and task.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};

use super::config::Config;
use super::trial::{Clouds, Source, Spec};
use crate::store::{StoreError, npz, run_dir};
use crate::task::generate::drawn;
use crate::task::{Solid, Target};

/// The file with the solids.
pub const TARGETS: &str = "targets.json";
/// The folder with the clouds.
pub const FOLDER: &str = "targets";

/// Writes `targets.json`, unless no target is generated: for each task and number the title, the seed, and the
/// solids, in the world's coordinates, m.
pub fn write_targets(dir: &Path, specs: &[Spec], config: &Config) -> Result<(), StoreError> {
    let mut tasks: BTreeMap<&str, BTreeMap<String, Value>> = BTreeMap::new();
    for spec in specs {
        let Source::Target(index) = spec.source else { continue };
        let scene = config.scene(spec.task);
        let Target::Generated { tool, generator } = &scene.target else { continue };
        let (title, pieces) = drawn(generator, &scene.dough, spec.seed, index);
        let solid = |(name, solid, center): &(&str, Solid, [f64; 3])| {
            let shape = match solid {
                Solid::Ball { radius } => json!({ "ball": { "radius_m": radius } }),
                Solid::Box { size } => json!({ "box": { "size_m": size } }),
                Solid::Disc { radius, height } => {
                    json!({ "disc": { "radius_m": radius, "height_m": height } })
                }
            };
            json!({ "name": name, "shape": shape, "center_m": center })
        };
        let entry = json!({
            "title": title,
            "tool": tool,
            "seed": spec.seed,
            "target": index,
            "pieces": pieces.iter().map(solid).collect::<Vec<_>>(),
        });
        tasks.entry(spec.task).or_default().insert(index.to_string(), entry);
    }
    if tasks.is_empty() {
        return Ok(());
    }
    let path = dir.join(TARGETS);
    // A narrower run must not take away what a wider one has written.
    let mut all: BTreeMap<String, BTreeMap<String, Value>> =
        if path.is_file() { run_dir::read_json(&path)? } else { BTreeMap::new() };
    for (task, targets) in tasks {
        all.entry(task.to_owned()).or_default().extend(targets);
    }
    run_dir::write_json(&path, &all)
}

/// Writes `targets/TASK-NUMBER.npz` with the clouds `initial` and `goal`, unless it is there: they are the same for
/// all methods.
pub fn write_target(dir: &Path, spec: &Spec, clouds: &Clouds) -> Result<(), StoreError> {
    let Source::Target(index) = spec.source else { return Ok(()) };
    let folder = dir.join(FOLDER);
    let path = folder.join(format!("{}-{index}.npz", spec.task));
    if path.is_file() {
        return Ok(());
    }
    std::fs::create_dir_all(&folder).map_err(StoreError::write(&folder))?;
    let mut writer = npz::Writer::new(&path);
    writer.add("initial", &npz::cloud_array(&clouds.initial))?;
    writer.add("goal", &npz::cloud_array(&clouds.goal))?;
    writer.finish()
}
