//! What forces and depths were read with, as fits need it to tell their systematic errors.

use crate::compliance::Correction;
use palpate_model::calibration::{Calibration, CalibrationError, ForceUncertainty};
use palpate_rheology::fit::{FitSample, Traced};

/// Calibration and compliance of one source, both by name and with their uncertainty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    calibration: Option<(String, ForceUncertainty)>,
    compliance: Option<(String, f64)>,
}

impl Origin {
    /// Of forces read with this calibration, if with any, and depths from which this was taken, if anything was.
    pub fn of(
        calibration: Option<&Calibration>,
        compliance: Option<&Correction>,
    ) -> Result<Self, CalibrationError> {
        let stated = |one: &Calibration| {
            ForceUncertainty::of(one).map(|uncertainty| (one.name.clone(), uncertainty))
        };
        let applied = compliance.filter(|one| one.is_applied);
        Ok(Self {
            calibration: calibration.map(stated).transpose()?,
            compliance: applied.map(|one| (one.id.clone(), one.std_error_mm_per_n)),
        })
    }

    /// Whether anything is known.
    pub fn is_known(&self) -> bool {
        self.calibration.is_some() || self.compliance.is_some()
    }

    /// A record of this origin.
    #[must_use]
    pub fn traced<'a>(&'a self, name: &'a str, samples: &'a [FitSample]) -> Traced<'a> {
        let calibration = self.calibration.as_ref();
        let compliance = self.compliance.as_ref();
        Traced {
            name,
            samples,
            calibration: calibration.map(|(name, uncertainty)| (name.as_str(), uncertainty)),
            compliance: compliance.map(|(name, error)| (name.as_str(), *error)),
        }
    }
}
