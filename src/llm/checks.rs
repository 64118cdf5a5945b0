//! What looks wrong in a stage that runs: warnings with the numbers that make them.
//!
//! Stages come in one by one, in order; sentences go out. Volumes are measured from the clouds
//! (`math::volume`). Imports `math` and `lineage`.

use super::lineage::LivePieces;
use super::stage::{NamedCloud, Stage};
use crate::math::cloud::{Bounds, centroid, distance};
use crate::math::hollow::share_on_sheets;

/// Stated volumes may differ from each other by this share before there is a warning.
const STATED_TOLERANCE: f64 = 0.05;
/// .. and those that are measured, from what is stated or from each other: twice what a measurement may be off.
const MEASURED_TOLERANCE: f64 = 0.2;
/// A cloud's mean may be off its stated location by this share of the cloud's diagonal.
const LOCATION_TOLERANCE: f64 = 0.1;
/// Clouds with fewer points than these are too thin to plan with.
const FEW_POINTS: usize = 200;
/// From this share of points on a sheet a cloud is only a surface.
const SURFACE_SHARE: f64 = 0.5;

/// The checks of one answer, and what they remember of the stages so far.
#[derive(Default)]
pub struct Checks {
    /// The pieces that there are, once there is a stage.
    live: Option<LivePieces>,
    /// Measured volume of each piece by its number; `None` if it has none that means something.
    measured: Vec<Option<f64>>,
    names: Vec<String>,
    steps: Vec<u32>,
    tool_used: bool,
}

impl Checks {
    /// Checks the next stage.
    pub fn stage(&mut self, stage: &Stage, warnings: &mut Vec<String>) {
        let step = stage.step;
        if self.steps.contains(&step) {
            warnings.push(format!("there are two steps with the number {step}"));
        }
        self.steps.push(step);
        let measured: Vec<Option<f64>> =
            stage.outputs.iter().map(|output| check_cloud(stage, output, warnings)).collect();
        let taken = self.follow(stage, &measured, warnings);
        check_stated_balance(stage, warnings);
        let before: Option<f64> = taken.iter().map(|&id| self.measured[id]).sum();
        let after: Option<f64> = measured.iter().copied().sum();
        if let (Some(before), Some(after), false) = (before, after, taken.is_empty())
            && differ(before, after, MEASURED_TOLERANCE)
        {
            warnings.push(format!(
                "step {step} changes the volume: the clouds measure {before:.4} before and {after:.4} after"
            ));
        }
    }

    /// Follows the pieces through a stage. Returns the numbers of those that it takes.
    fn follow(&mut self, stage: &Stage, measured: &[Option<f64>], warnings: &mut Vec<String>) -> Vec<usize> {
        let step = stage.step;
        let Some(tool) = &stage.tool else {
            if self.tool_used {
                warnings.push(format!("step {step} uses no tool, so that no plan can carry it out"));
            }
            self.begin(stage.outputs.last().map(|o| (o.name.as_str(), measured[measured.len() - 1])));
            return Vec::new();
        };
        self.tool_used |= !tool.is_empty();
        let first = self.live.is_none();
        if first {
            self.begin(stage.inputs.first().map(|name| (name.as_str(), None)));
        }
        let Some(live) = &mut self.live else { return Vec::new() };
        let strangers: Vec<&String> = stage.inputs.iter().filter(|n| live.named(n).is_none()).collect();
        let told: Vec<String> = strangers.iter().map(|n| live.unknown(step, n).to_string()).collect();
        let taken = live.take(step, &stage.inputs);
        match &taken {
            Err(error) => warnings.push(error.to_string()),
            Ok(_) if first => {}
            Ok(_) => warnings.extend(told),
        }
        let taken = taken.unwrap_or_default();
        for (output, volume) in stage.outputs.iter().zip(measured) {
            live.add(self.measured.len(), &output.name);
            self.measured.push(*volume);
            self.names.push(output.name.clone());
        }
        taken
    }

    /// The dough as it is given, under the name and with the volume that a step without a tool gives it.
    fn begin(&mut self, dough: Option<(&str, Option<f64>)>) {
        if self.tool_used && self.live.is_some() {
            return;
        }
        let (name, volume) = dough.unwrap_or(("dough", None));
        self.live = Some(LivePieces::initial(name));
        self.measured = vec![volume];
        self.names = vec![name.to_owned()];
    }
}

/// Whether two numbers differ by more than a share of the larger.
fn differ(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() > share * a.abs().max(b.abs())
}

/// Stated volumes before and after a step.
fn check_stated_balance(stage: &Stage, warnings: &mut Vec<String>) {
    let stated = |name: &String| stage.stated_volume.get(name).copied();
    let sum = |names: Vec<&String>| names.into_iter().map(stated).sum::<Option<f64>>();
    let (before, after) =
        (sum(stage.inputs.iter().collect()), sum(stage.outputs.iter().map(|o| &o.name).collect()));
    if let (Some(a), Some(b), false) = (before, after, stage.inputs.is_empty())
        && differ(a, b, STATED_TOLERANCE)
    {
        warnings.push(format!("step {} states a volume of {a} before and {b} after", stage.step));
    }
}

/// A cloud against what is stated about it. Returns its measured volume, if it is filled.
fn check_cloud(stage: &Stage, output: &NamedCloud, warnings: &mut Vec<String>) -> Option<f64> {
    let (step, name) = (stage.step, &output.name);
    if output.points.len() < FEW_POINTS {
        warnings.push(format!("step {step}: `{name}` has only {} points", output.points.len()));
    }
    let bounds = Bounds::of(&output.points)?;
    let middle = centroid(&output.points);
    if let Some(&place) = stage.stated_location.get(name)
        && distance(place, middle) > LOCATION_TOLERANCE * bounds.diagonal()
    {
        let shown = middle.map(|x| (x * 1000.0).round() / 1000.0);
        warnings.push(format!("step {step}: `{name}` is stated at {place:?}, its mean is {shown:?}"));
    }
    let share = share_on_sheets(&output.points);
    if share > SURFACE_SHARE {
        warnings.push(format!(
            "step {step}: `{name}` covers only a surface ({:.0} % of its points lie on a sheet); fill its inside",
            100.0 * share
        ));
        return None;
    }
    let measured = output.measured_volume();
    if let Some(&stated) = stage.stated_volume.get(name)
        && differ(stated, measured, MEASURED_TOLERANCE)
    {
        warnings.push(format!(
            "step {step}: `{name}` is stated to have a volume of {stated}, its points measure {measured:.4}"
        ));
    }
    Some(measured)
}
