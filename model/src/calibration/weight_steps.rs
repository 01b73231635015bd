//! Weights laid on the load cell and the voltages read: the document a calibration is kept as.

use super::curve::Curve;
use crate::units::{Newtons, Volts};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Standard acceleration of gravity in m/s^2 (3rd General Conference on Weights and Measures, 1901).
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// One calibration point: a mass resting on the load cell and the signal it gives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeightStep {
    /// Total mass on the cell in grams, the platform included.
    pub mass_g: f64,
    /// Signal at that mass.
    pub volts: Volts,
}

impl WeightStep {
    /// The weight of the mass in N under [`STANDARD_GRAVITY`].
    #[must_use]
    pub fn newtons(&self) -> Newtons {
        Newtons(self.mass_g * 1e-3 * STANDARD_GRAVITY)
    }
}

/// A load-cell calibration as it is kept: the weights, the voltages and where they come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// What people call it.
    pub name: String,
    /// When it was taken, as text for people; `None` where that is not known.
    #[serde(default)]
    pub taken_at: Option<String>,
    /// The points, in order of increasing mass.
    pub steps: Vec<WeightStep>,
    /// Who measured it on what, or the document it is copied from.
    #[serde(default)]
    pub source: String,
}

/// The weight steps do not make a calibration.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// One point or none.
    #[error(
        "the calibration has {count} weight step(s); take at least two, the first without a weight"
    )]
    TooFewSteps {
        /// Steps given.
        count: usize,
    },
    /// NaN, infinite, or a negative mass.
    #[error(
        "weight step {step} has mass {mass_g} g and signal {volts} V; both must be finite and the mass not negative, take this step again"
    )]
    NotANumber {
        /// Step, counted from 1.
        step: usize,
        /// Its mass in g.
        mass_g: f64,
        /// Its signal in V.
        volts: f64,
    },
    /// Masses out of order.
    #[error(
        "weight step {step} has {mass_g} g after {before_g} g; masses must increase from step to step, remove or reorder it"
    )]
    MassNotIncreasing {
        /// Step, counted from 1.
        step: usize,
        /// Its mass in g.
        mass_g: f64,
        /// The mass of the step before in g.
        before_g: f64,
    },
    /// More mass did not give more volts.
    #[error(
        "weight step {step} reads {volts} V after {before_volts} V; the signal must rise with every weight, check the wiring and take this step again"
    )]
    VoltsNotIncreasing {
        /// Step, counted from 1.
        step: usize,
        /// Its signal in V.
        volts: f64,
        /// The signal of the step before in V.
        before_volts: f64,
    },
}

impl Calibration {
    /// The eleven points published for an Entran ELFM-B1-50N in the thesis this project implements
    /// (Nanyang Technological University, force feedback for endoscopic surgery, chapter 3).
    #[must_use]
    pub fn thesis() -> Self {
        const GRAMS_VOLTS: [(f64, f64); 11] = [
            (0.0, 1.28),
            (140.0, 1.60),
            (240.0, 1.73),
            (340.0, 1.78),
            (440.0, 1.79),
            (540.0, 1.80),
            (640.0, 1.87),
            (740.0, 2.04),
            (840.0, 2.55),
            (940.0, 2.69),
            (1040.0, 2.84),
        ];
        Self {
            name: "Thesis load cell".to_owned(),
            taken_at: None,
            steps: GRAMS_VOLTS
                .iter()
                .map(|&(mass_g, volts)| WeightStep {
                    mass_g,
                    volts: Volts(volts),
                })
                .collect(),
            source: "Entran ELFM-B1-50N, 140 g platform and 100 g weights, thesis chapter 3"
                .to_owned(),
        }
    }

    /// A straight line from `volts_at_zero` with a slope in V/N up to `newtons_max`, as two steps.
    ///
    /// The numbers are not judged here; [`Calibration::curve`] does.
    #[must_use]
    pub fn linear(
        name: &str,
        volts_at_zero: Volts,
        volts_per_newton: f64,
        newtons_max: Newtons,
    ) -> Self {
        let full = WeightStep {
            mass_g: newtons_max.0 / STANDARD_GRAVITY * 1e3,
            volts: Volts(volts_at_zero.0 + volts_per_newton * newtons_max.0),
        };
        let empty = WeightStep {
            mass_g: 0.0,
            volts: volts_at_zero,
        };
        Self {
            name: name.to_owned(),
            taken_at: None,
            steps: vec![empty, full],
            source: format!(
                "straight line, {volts_at_zero} at rest, {volts_per_newton} V/N up to {newtons_max}"
            ),
        }
    }

    /// The curve through the steps, or which step prevents one.
    pub fn curve(&self) -> Result<Curve, CalibrationError> {
        if self.steps.len() < 2 {
            return Err(CalibrationError::TooFewSteps {
                count: self.steps.len(),
            });
        }
        for (index, here) in self.steps.iter().enumerate() {
            let step = index + 1;
            let (mass_g, volts) = (here.mass_g, here.volts.0);
            if !mass_g.is_finite() || !volts.is_finite() || mass_g < 0.0 {
                return Err(CalibrationError::NotANumber {
                    step,
                    mass_g,
                    volts,
                });
            }
            let Some(before) = index.checked_sub(1).map(|i| self.steps[i]) else {
                continue;
            };
            if mass_g <= before.mass_g {
                return Err(CalibrationError::MassNotIncreasing {
                    step,
                    mass_g,
                    before_g: before.mass_g,
                });
            }
            if volts <= before.volts.0 {
                return Err(CalibrationError::VoltsNotIncreasing {
                    step,
                    volts,
                    before_volts: before.volts.0,
                });
            }
        }
        let points: Vec<(f64, f64)> = self
            .steps
            .iter()
            .map(|step| (step.newtons().0, step.volts.0))
            .collect();
        Ok(Curve::through(&points))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_step(index: usize, change: impl Fn(&mut WeightStep)) -> CalibrationError {
        let mut calibration = Calibration::thesis();
        change(&mut calibration.steps[index]);
        calibration.curve().unwrap_err()
    }

    #[test]
    fn errors_name_the_step() {
        let err = with_step(4, |step| step.volts = Volts(1.78));
        assert!(
            err.to_string().contains("weight step 5 reads 1.78 V"),
            "{err}"
        );
        let err = with_step(4, |step| step.mass_g = 340.0);
        assert!(err.to_string().contains("weight step 5 has 340 g"), "{err}");
        let err = with_step(0, |step| step.volts = Volts(f64::NAN));
        assert!(err.to_string().contains("weight step 1"), "{err}");
        let err = with_step(0, |step| step.mass_g = -1.0);
        assert!(err.to_string().contains("not negative"), "{err}");
    }

    #[test]
    fn one_step_is_not_a_calibration() {
        let mut calibration = Calibration::thesis();
        calibration.steps.truncate(1);
        assert_eq!(
            calibration.curve(),
            Err(CalibrationError::TooFewSteps { count: 1 })
        );
    }

    #[test]
    fn a_line_is_a_line_and_a_falling_line_is_refused() {
        let line = Calibration::linear("cell", Volts(0.5), 0.1, Newtons(50.0));
        let curve = line.curve().unwrap();
        for newtons in [-3.0, 0.0, 12.5, 50.0, 60.0] {
            let volts = curve.volts_from_newtons(Newtons(newtons)).0;
            assert!((volts - (0.5 + 0.1 * newtons)).abs() < 1e-13, "{newtons}");
        }
        let falling = Calibration::linear("cell", Volts(0.5), -0.1, Newtons(50.0));
        assert!(matches!(
            falling.curve(),
            Err(CalibrationError::VoltsNotIncreasing { step: 2, .. })
        ));
    }

    #[test]
    fn the_document_survives_json() {
        let calibration = Calibration::thesis();
        let text = serde_json::to_string(&calibration).unwrap();
        let back: Calibration = serde_json::from_str(&text).unwrap();
        assert_eq!(back, calibration);
    }
}
