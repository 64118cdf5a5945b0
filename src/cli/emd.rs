//! `donut emd`: the earth mover's distance between two clouds in files.
//!
//! Two `.npy` files and settings come in; the distance goes to standard output, gradient and matching
//! to files if asked for. Imports `emd`, `math` and `store`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use ndarray::{Array1, Array2};
use serde_json::json;
use tracing::warn;

use super::stdout;
use crate::emd::Measure;
use crate::emd::exact::assign;
use crate::emd::schedule::{Power, Settings};
use crate::emd::sinkhorn::divergence;
use crate::emd::transport::transport;
use crate::math::cloud::Point;
use crate::store::npz;

/// Earth mover's distance between two point clouds.
///
/// The default is the debiased Sinkhorn divergence as GeomLoss computes it; --exact solves the
/// transport problem itself.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    donut emd a.npy b.npy                                   Sinkhorn divergence, p = 1\n  \
    donut emd a.npy b.npy --p 2 --gradient gradient.npy     and its gradient in the points of a.npy\n  \
    donut emd a.npy b.npy --exact --match match.npy         exact, and who goes where")]
pub struct EmdArgs {
    /// Cloud that is moved: .npy, shape (n, 3), float32 or float64
    source: PathBuf,
    /// Cloud that it is moved to: .npy, shape (m, 3)
    target: PathBuf,
    /// Exponent of the cost: 1 for |u - v|, 2 for |u - v|^2 / 2
    #[arg(long, default_value = "1", value_parser = power)]
    p: Power,
    /// Sinkhorn: length below which mass is not told apart, in the clouds' unit
    #[arg(long, default_value_t = Settings::default().blur, allow_negative_numbers = true)]
    blur: f64,
    /// Sinkhorn: ratio of successive length scales, between 0 and 1
    #[arg(long, default_value_t = Settings::default().scaling, allow_negative_numbers = true)]
    scaling: f64,
    /// Sinkhorn: first length scale [default: diagonal of the joint bounding box]
    #[arg(long, allow_negative_numbers = true)]
    diameter: Option<f64>,
    /// Sinkhorn: keep the entropic bias, so that equal clouds are not at 0
    #[arg(long)]
    no_debias: bool,
    /// Sinkhorn: floating-point type to compute in
    #[arg(long, value_enum, default_value = "f64")]
    precision: Precision,
    /// Sinkhorn: write the gradient in the source points to this .npy, shape (n, 3), float64
    #[arg(long, value_name = "OUT.npy", conflicts_with = "exact")]
    gradient: Option<PathBuf>,
    /// Optimal transport instead of a Sinkhorn divergence
    #[arg(long)]
    exact: bool,
    /// Write the index of the matched target of each source point to this .npy, shape (n,), int64
    #[arg(long = "match", value_name = "OUT.npy", requires = "exact")]
    matched: Option<PathBuf>,
    /// Weights of the source points: .npy, shape (n,), summing to 1 [default: equal]
    #[arg(long, value_name = "A.npy")]
    source_weights: Option<PathBuf>,
    /// Weights of the target points: .npy, shape (m,), summing to 1 [default: equal]
    #[arg(long, value_name = "B.npy")]
    target_weights: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Precision {
    F32,
    F64,
}

fn power(text: &str) -> Result<Power, String> {
    match text {
        "1" => Ok(Power::One),
        "2" => Ok(Power::Two),
        _ => Err("p must be 1 or 2".into()),
    }
}

/// What was found, whatever the method.
struct Outcome {
    value: f64,
    method: &'static str,
    iterations: usize,
    /// Part of the mass that the plan brings to wrong targets, where the method leaves any.
    misplaced: Option<f64>,
}

/// Runs the subcommand.
pub fn run(args: &EmdArgs) -> Result<ExitCode> {
    let (x, a) = read_measure(&args.source, args.source_weights.as_deref())?;
    let (y, b) = read_measure(&args.target, args.target_weights.as_deref())?;
    let source = Measure { points: &x, weights: a.as_deref() };
    let target = Measure { points: &y, weights: b.as_deref() };
    let settings = Settings {
        power: args.p,
        blur: args.blur,
        scaling: args.scaling,
        diameter: args.diameter,
        debias: !args.no_debias,
    };
    settings.check()?;
    let start = Instant::now();
    let outcome =
        if args.exact { exact(args, source, target)? } else { sinkhorn(args, &settings, source, target)? };
    print(args, &outcome, start.elapsed().as_secs_f64())?;
    Ok(ExitCode::SUCCESS)
}

/// Reads and checks a cloud and its weights.
fn read_measure(path: &Path, weights: Option<&Path>) -> Result<(Vec<Point>, Option<Vec<f64>>)> {
    let points = npz::read_cloud(path)?;
    Measure::uniform(&points).check().with_context(|| path.display().to_string())?;
    let Some(weights_path) = weights else { return Ok((points, None)) };
    let weights = npz::read_vector(weights_path)?;
    let measure = Measure { points: &points, weights: Some(&weights) };
    measure.check().with_context(|| weights_path.display().to_string())?;
    Ok((points, Some(weights)))
}

fn exact(args: &EmdArgs, source: Measure, target: Measure) -> Result<Outcome> {
    let (n, m) = (source.points.len(), target.points.len());
    let is_assignment = n == m && source.weights.is_none() && target.weights.is_none();
    if args.matched.is_some() && !is_assignment {
        bail!(
            "--match needs as many source as target points, and no weights; these are {n} and {m} points: give \
             equally many without weights, or leave out --match"
        );
    }
    if is_assignment && args.p == Power::One {
        let found = assign(source.points, target.points);
        write_match(args, &found.target_of)?;
        return Ok(Outcome { value: found.mean_distance, method: "exact", iterations: 0, misplaced: None });
    }
    let found = transport(source, target, args.p)?;
    if !found.optimal {
        bail!(
            "exact transport did not end within {} pivots; take fewer points, or leave out --exact",
            found.pivots
        );
    }
    if is_assignment {
        // Between equally many equal points an optimal vertex ships each one whole; shipments are in the order of sources.
        let target_of: Vec<usize> = found.plan.iter().map(|shipment| shipment.target).collect();
        write_match(args, &target_of)?;
    }
    Ok(Outcome { value: found.value, method: "exact", iterations: found.pivots, misplaced: None })
}

fn write_match(args: &EmdArgs, target_of: &[usize]) -> Result<()> {
    let Some(path) = &args.matched else { return Ok(()) };
    let indices: Array1<i64> = target_of.iter().map(|&j| j as i64).collect();
    Ok(npz::write_npy(path, &indices)?)
}

fn sinkhorn(args: &EmdArgs, settings: &Settings, source: Measure, target: Measure) -> Result<Outcome> {
    let found = match args.precision {
        Precision::F32 => divergence::<f32>(source, target, settings)?,
        Precision::F64 => divergence::<f64>(source, target, settings)?,
    };
    if let Some(path) = &args.gradient {
        let rows = Array2::from_shape_fn((found.gradient.len(), 3), |(i, axis)| found.gradient[i][axis]);
        npz::write_npy(path, &rows)?;
    }
    // Mass that is missing in one place is too much in another: half the marginal error is misplaced.
    let misplaced = 0.5 * found.marginal_error;
    if !found.converged {
        warn!(
            "the iteration has not converged, {:.0} % of the mass is misplaced; a --scaling \
             nearer to 1 brings it closer, --exact does without",
            100.0 * misplaced
        );
    }
    Ok(Outcome {
        value: found.value,
        method: "sinkhorn",
        iterations: found.iterations,
        misplaced: Some(misplaced),
    })
}

fn print(args: &EmdArgs, outcome: &Outcome, seconds: f64) -> std::io::Result<()> {
    let Outcome { value, method, iterations, misplaced } = outcome;
    if args.json {
        let mut object = json!({
            "value": value, "method": method, "iterations": iterations, "seconds": seconds,
        });
        if let Some(misplaced) = misplaced {
            object["misplaced_mass"] = json!(misplaced);
        }
        stdout::line(object)
    } else {
        stdout::line(format_args!(
            "{:<10} {:>16} {:>10} {:>10}",
            "method", "value", "iterations", "seconds"
        ))?;
        stdout::line(format_args!("{method:<10} {value:>16.9} {iterations:>10} {seconds:>10.4}"))
    }
}
