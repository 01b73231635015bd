//! Conditions a plan watches on every sample, beside the interlocks and after them.

use palpate_model::units::Seconds;
use serde::{Deserialize, Serialize};

/// One condition: what trips it, when it counts as past, and what happens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Monitor {
    pub source: MonitorSource,
    /// Whether values above the threshold trip it, or values below.
    pub side: ThresholdSide,
    /// The value that trips it, in the source's unit.
    pub threshold: f64,
    pub resume: f64,
    /// How long it must be past before a paused run goes on.
    pub settle: Seconds,
    pub action: MonitorAction,
    pub message: String,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MonitorSource {
    /// Force above tare, in N.
    Force,
    /// Depth from contact, in mm.
    Depth,
    /// Raw signal, in V.
    Volts,
    /// Machine position from home, in mm.
    Position,
    /// A channel of the rig's sensors by its name, in its own unit.
    Channel(String),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ThresholdSide {
    Above,
    Below,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MonitorAction {
    Note,
    /// Pause; go on by itself once it is past, where going on is sound.
    Pause,
    Stop,
    Retract,
    Halt,
}

impl MonitorSource {
    #[must_use]
    pub const fn unit(&self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Depth | Self::Position => "mm",
            Self::Volts => "V",
            Self::Channel(_) => "in the unit of the sensor",
        }
    }
}

impl Monitor {
    pub fn is_tripped_by(&self, value: f64) -> bool {
        match self.side {
            ThresholdSide::Above => value >= self.threshold,
            ThresholdSide::Below => value <= self.threshold,
        }
    }

    pub fn is_past_at(&self, value: f64) -> bool {
        match self.side {
            ThresholdSide::Above => value <= self.resume,
            ThresholdSide::Below => value >= self.resume,
        }
    }

    pub fn check(&self) -> Result<(), String> {
        if !(self.threshold.is_finite() && self.resume.is_finite()) {
            return Err("a monitor's threshold and resume value must be numbers".into());
        }
        let (is_apart, side, reset) = match self.side {
            ThresholdSide::Above => (self.resume <= self.threshold, "above", "less"),
            ThresholdSide::Below => (self.resume >= self.threshold, "below", "more"),
        };
        if !is_apart {
            let (threshold, resume, unit) = (self.threshold, self.resume, self.source.unit());
            return Err(format!(
                "a monitor that trips {side} {threshold} {unit} cannot reset at {resume} {unit}; give a 'resume' of {threshold} {unit} or {reset}"
            ));
        }
        if !(0.0..=3600.0).contains(&self.settle.0) {
            return Err(format!(
                "a monitor cannot have a settle time of {}; give 0 to 3600 s",
                self.settle
            ));
        }
        if self.message.trim().is_empty() {
            return Err("a monitor has no message; write the text that the operator reads".into());
        }
        Ok(())
    }
}
