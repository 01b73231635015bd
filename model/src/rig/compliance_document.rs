//! The document of a rig's compliance: the value, from which run, and over which forces. It is
//! never edited, only superseded.

use super::compliance::{Compliance, ComplianceError, StiffSample, fit_compliance};
use crate::units::{Newtons, Position};
use serde::{Deserialize, Serialize};

/// Version of the document's form.
pub const COMPLIANCE_FORMAT: u32 = 1;

/// A rig's compliance with its origin.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RigCompliance {
    pub format: u32,
    /// The rig that gives way.
    pub rig: String,
    /// When the surface was pressed, RFC 3339.
    pub taken_at: String,
    #[serde(default)]
    pub operator: String,
    /// The session it was found in.
    pub session_id: String,
    /// CRC-32 of that session's raw samples, eight hexadecimal digits.
    pub session_checksum: String,
    /// Version of the program that found it.
    pub software_version: String,
    /// Way of the axis per force, in mm/N: rig, cell, probe and the surface itself.
    pub mm_per_n: f64,
    /// Its standard uncertainty in mm/N: of the noise about the line or of the differences between presses,
    /// whichever is greater.
    pub std_error_mm_per_n: f64,
    /// The surface, from home, in mm.
    pub surface_mm: f64,
    /// Its standard uncertainty in mm.
    pub surface_std_error_mm: f64,
    /// Standard deviation of the forces about the line in N, each by its weight.
    pub rmse_n: f64,
    /// Samples in the line: all on the way in from where it reaches the seating force.
    pub samples: usize,
    /// Force in N from which the surfaces count as seated.
    pub seating_n: f64,
    /// Highest force in the line, in N.
    pub force_max_n: f64,
    /// Every press by itself.
    pub presses: Vec<PressCompliance>,
    /// Id of the document that this one takes the place of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supersedes: Option<String>,
}

/// Compliance from one press alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PressCompliance {
    /// Number of the press, from 1.
    pub press: u32,
    /// Way of the axis per force, in mm/N.
    pub mm_per_n: f64,
    /// Its standard uncertainty in mm/N from the noise about its own line.
    pub std_error_mm_per_n: f64,
    /// Samples in its line.
    pub samples: usize,
}

impl RigCompliance {
    /// Compliance from presses onto a stiff surface, `(number, samples on the way in)` each. The caller adds rig,
    /// session and date.
    ///
    /// One line goes through all presses, and one through each: noise is not all that makes them differ. A
    /// surface that settles and a slide with play do too, and that shows only between presses.
    pub fn of_presses(
        presses: &[(u32, Vec<StiffSample>)],
        seating: Newtons,
    ) -> Result<Self, ComplianceError> {
        let all: Vec<StiffSample> = presses.iter().flat_map(|(_, one)| one).copied().collect();
        let found = fit_compliance(&all, seating)?;
        let own = presses.iter().map(|(press, samples)| {
            let line = fit_compliance(samples, seating)?;
            Ok(PressCompliance {
                press: *press,
                mm_per_n: line.mm_per_newton,
                std_error_mm_per_n: line.std_error,
                samples: line.samples,
            })
        });
        let own: Vec<PressCompliance> = own.collect::<Result<_, ComplianceError>>()?;
        let scatter = std_error_of_mean(&own).unwrap_or(0.0);
        let forces = all.iter().map(|sample| sample.force.0);
        Ok(Self {
            format: COMPLIANCE_FORMAT,
            mm_per_n: found.mm_per_newton,
            std_error_mm_per_n: found.std_error.max(scatter),
            surface_mm: found.surface.0,
            surface_std_error_mm: found.surface_std_error_mm,
            rmse_n: found.rmse_n,
            samples: found.samples,
            seating_n: seating.0,
            force_max_n: forces.fold(0.0, f64::max),
            presses: own,
            ..Self::default()
        })
    }

    /// The same presses with a line through all of them that was found more exactly. How the presses differ stays.
    #[must_use]
    pub fn improved(self, line: &Compliance) -> Self {
        let scatter = std_error_of_mean(&self.presses).unwrap_or(0.0);
        Self {
            mm_per_n: line.mm_per_newton,
            std_error_mm_per_n: line.std_error.max(scatter),
            surface_mm: line.surface.0,
            surface_std_error_mm: line.surface_std_error_mm,
            ..self
        }
    }

    /// As depths are corrected with it.
    pub fn compliance(&self) -> Compliance {
        Compliance {
            mm_per_newton: self.mm_per_n,
            std_error: self.std_error_mm_per_n,
            surface: Position(self.surface_mm),
            surface_std_error_mm: self.surface_std_error_mm,
            rmse_n: self.rmse_n,
            samples: self.samples,
        }
    }

    /// Why it cannot be used, in words.
    pub fn check(&self) -> Result<(), String> {
        if self.format > COMPLIANCE_FORMAT {
            return Err(format!(
                "the machine compliance has format {}, but this version of palpate reads up to format {COMPLIANCE_FORMAT}; update palpate",
                self.format
            ));
        }
        let is_possible = |value: f64, least: f64| value.is_finite() && value >= least;
        if !(is_possible(self.mm_per_n, f64::MIN_POSITIVE)
            && is_possible(self.std_error_mm_per_n, 0.0))
        {
            return Err(format!(
                "a machine compliance of {} ± {} mm/N is not possible; measure it again",
                self.mm_per_n, self.std_error_mm_per_n
            ));
        }
        Ok(())
    }
}

/// Standard error of the mean of the presses by how they differ; `None` for one press.
fn std_error_of_mean(presses: &[PressCompliance]) -> Option<f64> {
    let count = presses.len() as f64;
    let mean = presses.iter().map(|one| one.mm_per_n).sum::<f64>() / count;
    let squares = presses.iter().map(|one| (one.mm_per_n - mean).powi(2));
    (presses.len() > 1).then(|| (squares.sum::<f64>() / (count - 1.0) / count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn press(mm_per_n: f64) -> Vec<StiffSample> {
        let sample = |i: u32| {
            let x = f64::from(i) * 1e-4;
            StiffSample {
                position: Position(50.0 + x),
                force: Newtons(x / mm_per_n),
                sigma: Newtons(1.0),
            }
        };
        (0..1000).map(sample).collect()
    }

    #[test]
    fn presses_that_differ_are_less_certain_than_their_noise() {
        let presses = [(1, press(0.0198)), (2, press(0.02)), (3, press(0.0202))];
        let found = RigCompliance::of_presses(&presses, Newtons(1.0)).unwrap();
        assert!((found.mm_per_n / 0.02 - 1.0).abs() < 1e-3, "{found:?}");
        // By hand: standard deviation 0.0002, of the mean of three 0.0002 / sqrt(3).
        let wanted = 2e-4 / 3f64.sqrt();
        assert!((found.std_error_mm_per_n / wanted - 1.0).abs() < 1e-6);
        assert!(found.presses.iter().all(|one| one.std_error_mm_per_n < 1e-9));
        let sum: usize = found.presses.iter().map(|one| one.samples).sum();
        assert!(found.samples.abs_diff(sum) < 10, "{found:?}");
        found.check().unwrap();
        let text = serde_json::to_string(&found).unwrap();
        let back: RigCompliance = serde_json::from_str(&text).unwrap();
        assert_eq!(back, found);
    }

    #[test]
    fn one_bad_press_refuses_all_and_an_impossible_document_is_refused() {
        let tissue: Vec<StiffSample> = press(0.02)
            .iter()
            .map(|one| StiffSample { force: Newtons(one.force.0.powi(2) / 5.0), ..*one })
            .collect();
        let refused = RigCompliance::of_presses(&[(1, tissue)], Newtons(1.0));
        assert!(matches!(refused, Err(ComplianceError::Curved { .. })));
        let none = RigCompliance::of_presses(&[], Newtons(1.0));
        assert!(matches!(none, Err(ComplianceError::TooShort { .. })));
        let good = RigCompliance::of_presses(&[(1, press(0.02))], Newtons(1.0)).unwrap();
        for bad in [0.0, -0.02, f64::NAN, f64::INFINITY] {
            let bad = RigCompliance { mm_per_n: bad, ..good.clone() };
            assert!(bad.check().is_err(), "{bad:?}");
        }
        let newer = RigCompliance { format: 2, ..good };
        assert!(newer.check().unwrap_err().contains("update palpate"));
    }
}
