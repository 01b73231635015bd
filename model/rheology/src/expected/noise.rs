//! Noise of a measurement, and unknowns other than the body.

use super::ExpectedError;
use palpate_model::units::{Newtons, Seconds};
use serde::Serialize;

/// Force noise expected of every sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeasurementNoise {
    /// Standard deviation in N of what is independent from sample to sample.
    pub white: Newtons,
    /// Slow noise on top, if any.
    pub memory: Option<CorrelatedNoise>,
}

/// Noise whose autocorrelation decays exponentially: its covariance over a lag `t` is `sd^2 exp(-t / time)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CorrelatedNoise {
    /// Standard deviation in N.
    pub sd: Newtons,
    /// Correlation time in s.
    pub time: Seconds,
}

impl MeasurementNoise {
    /// Independent noise alone, standard deviation in N.
    #[must_use]
    pub fn white(sd: Newtons) -> Self {
        Self { white: sd, memory: None }
    }

    pub(super) fn check(&self) -> Result<(), ExpectedError> {
        let bad = |what, value| Err(ExpectedError::BadNumber { what, value });
        let is_size = |value: f64| value >= 0.0 && value.is_finite();
        if !is_size(self.white.0) {
            return bad("noise in N", self.white.0);
        }
        match self.memory {
            Some(memory) if !is_size(memory.sd.0) => bad("slow noise in N", memory.sd.0),
            Some(memory) if !(memory.time.0 > 0.0 && memory.time.is_finite()) => {
                bad("correlation time in s", memory.time.0)
            }
            Some(memory) if memory.sd.0 + self.white.0 > 0.0 => Ok(()),
            None if self.white.0 > 0.0 => Ok(()),
            _ => bad("noise in N", 0.0),
        }
    }
}

/// Offsets that a fit leaves free, besides the five parameters of the body.
///
/// Both widen the intervals of the body; a known offset makes the interval of mu1 two to three times
/// narrower.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct FreeOffsets {
    /// The force at the start of every press, in a body that was not quite at rest.
    pub f0: bool,
    /// An offset of the load cell during every press.
    pub f_offset: bool,
}

impl Default for FreeOffsets {
    /// Those that [`crate::fit::FitOptions`] frees by default.
    fn default() -> Self {
        Self { f0: true, f_offset: true }
    }
}
