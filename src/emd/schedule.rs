//! The settings of a Sinkhorn divergence and the temperatures they lead through.
//!
//! Blur, scaling and diameter come in, the list of temperatures goes out. Imports nothing of the
//! other layers.

use serde::{Deserialize, Serialize};

use super::error::EmdError;

/// Most temperatures that are accepted: a scaling of 0.9999 for a diameter of 10000 times the blur.
const MOST_TEMPERATURES: usize = 100_000;

/// The exponent of the ground cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Power {
    /// |u - v|: the value has the unit of the coordinates.
    #[serde(rename = "1")]
    One,
    /// |u - v|^2 / 2: the value is about half the squared 2-Wasserstein distance.
    #[serde(rename = "2")]
    Two,
}

impl Power {
    /// p.
    pub fn exponent(self) -> i32 {
        match self {
            Self::One => 1,
            Self::Two => 2,
        }
    }
}

/// What GeomLoss calls the parameters of `SamplesLoss("sinkhorn")`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    pub power: Power,
    /// Length below which mass is not told apart, in the unit of the coordinates.
    pub blur: f64,
    /// Ratio of successive length scales, in (0, 1); nearer to 1 is slower and better converged.
    pub scaling: f64,
    /// The first length scale; the diagonal of the joint bounding box if left out.
    pub diameter: Option<f64>,
    /// Whether the clouds' distances to themselves are taken off, so that equal clouds are at 0.
    pub debias: bool,
}

impl Default for Settings {
    /// The paper's: p = 1, blur 0.001, scaling 0.5, debiased.
    fn default() -> Self {
        Self { power: Power::One, blur: 1e-3, scaling: 0.5, diameter: None, debias: true }
    }
}

impl Settings {
    /// Refuses settings that lead nowhere.
    pub fn check(&self) -> Result<(), EmdError> {
        if !(self.blur.is_finite() && self.blur > 0.0) {
            return Err(EmdError::Blur(self.blur));
        }
        if !(self.scaling > 0.0 && self.scaling < 1.0) {
            return Err(EmdError::Scaling(self.scaling));
        }
        match self.diameter {
            Some(diameter) if !(diameter.is_finite() && diameter > 0.0) => Err(EmdError::Diameter(diameter)),
            _ => Ok(()),
        }
    }

    /// The temperatures of epsilon scaling: `diameter^p` twice, then down by `scaling^p` while above
    /// `blur^p`, then `blur^p` (Feydy et al. 2019, GeomLoss's `epsilon_schedule`). Each is computed
    /// from its own exponent, so that no rounding adds up.
    pub fn temperatures(&self, diameter: f64) -> Vec<f64> {
        let p = f64::from(self.power.exponent());
        let (first, step) = (p * diameter.ln(), p * self.scaling.ln());
        let count = self.steps_down(diameter);
        let between = (0..count).map(|i| (first + i as f64 * step).exp());
        let ends = [diameter, self.blur].map(|length| length.powi(self.power.exponent()));
        std::iter::once(ends[0]).chain(between).chain(std::iter::once(ends[1])).collect()
    }

    /// Temperatures from `diameter^p` down, without the two at the ends.
    fn steps_down(&self, diameter: f64) -> usize {
        let p = f64::from(self.power.exponent());
        let (first, last, step) = (p * diameter.ln(), p * self.blur.ln(), p * self.scaling.ln());
        ((last - first) / step).ceil().max(0.0) as usize
    }

    /// Refuses a scaling so near to 1 that the iteration would not end in a reasonable time.
    pub fn check_count(&self, diameter: f64) -> Result<(), EmdError> {
        let (scaling, count) = (self.scaling, self.steps_down(diameter));
        let most = MOST_TEMPERATURES;
        if count > most { Err(EmdError::Temperatures { scaling, count, most }) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_diameter_stands_twice_and_the_blur_once() {
        let found = Settings { blur: 0.2, ..Settings::default() }.temperatures(1.0);
        let expected = [1.0, 1.0, 0.5, 0.25, 0.2];
        assert_eq!(found.len(), expected.len());
        assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-15), "{found:?}");
        assert_eq!(Settings { blur: 2.0, ..Settings::default() }.temperatures(1.0), [1.0, 2.0]);
        let squared = Settings { power: Power::Two, blur: 0.2, ..Settings::default() }.temperatures(1.0);
        assert!(squared.iter().zip(expected).all(|(f, e)| (f - e * e).abs() < 1e-15), "{squared:?}");
    }

    #[test]
    fn bad_settings_are_refused() {
        let ok = Settings::default();
        assert_eq!(ok.check(), Ok(()));
        for blur in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(Settings { blur, ..ok }.check(), Err(EmdError::Blur(_))));
        }
        for scaling in [0.0, 1.0, -0.5, f64::NAN] {
            assert!(matches!(Settings { scaling, ..ok }.check(), Err(EmdError::Scaling(_))));
        }
        for diameter in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                Settings { diameter: Some(diameter), ..ok }.check(),
                Err(EmdError::Diameter(_))
            ));
        }
    }
}
