//! Gradients of whole rollouts against central finite differences of the forward pass, against the reference,
//! and f32 against f64.

use donut::sim::gradcheck::{Case, HORIZON, Summary};
use ndarray::Ix2;

use super::{TOOL_SCENES, expected, scene};

/// Entries of the actions that are tried in each scene; `donut gradcheck` tries as many as one likes.
const ENTRIES: usize = 12;

fn case(name: &str) -> Case {
    scene(name).gradient_case().unwrap()
}

#[test]
fn actions_agree_with_finite_differences_of_the_forward_pass() {
    for name in TOOL_SCENES {
        let summary = Summary::of(&case(name).entries(0, ENTRIES, 1).unwrap());
        assert!(summary.unconverged.len() * 2 <= ENTRIES, "{name}: {summary:?}");
        assert!(summary.passes(), "{name}: {summary:?}");
    }
}

#[test]
fn actions_agree_with_the_reference_implementation() {
    // Its own adjoint clamps the SVD, so it is right only where deformation is generic: hence the bound.
    for name in TOOL_SCENES {
        let gradient = case(name).gradient::<f64>().unwrap();
        let reference = expected(name).array::<Ix2>("grad_actions_reference").unwrap();
        let scale = reference.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let off = super::worst(gradient.iter().flatten(), &reference) / scale;
        assert!(off < 1e-5, "{name}: {off:e} off");
    }
}

#[test]
fn single_precision_gradients_follow_double() {
    for name in TOOL_SCENES {
        let off = case(name).single_precision_error(0).unwrap();
        assert!(off < 1e-4, "{name}: {off:e} off");
    }
}

#[test]
fn single_precision_gradients_follow_double_over_a_horizon_of_the_planner() {
    // These two amplify rounding most: the bound asked for is 1e-3.
    for name in ["s3-knife", "s5-pole"] {
        let off = case(name).over(HORIZON).single_precision_error(0).unwrap();
        assert!(off < 1e-4, "{name}: {off:e} off");
    }
}
