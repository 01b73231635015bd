//! Numbers of settings and the ranges they must be in.

use std::fmt;
use thiserror::Error;

/// A setting outside its range.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("{subject} with {name} = {value}{unit} is not possible; {name} must be {range}")]
pub struct SettingError {
    /// Whose setting it is, such as `a motor drive`.
    pub subject: &'static str,
    pub name: &'static str,
    pub value: f64,
    /// The unit with a blank before it; empty where the name ends with it or there is none.
    pub unit: &'static str,
    pub range: SettingRange,
}

/// What a number may be. Nothing contains NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettingRange {
    /// Finite and above zero.
    Positive,
    /// Above zero, up to a largest number.
    PositiveUpTo(f64),
    /// From zero to a largest number.
    UpTo(f64),
    /// Finite and zero or more.
    NotNegative,
    /// Zero or more; infinite where that means never or without an end.
    MayBeInfinite,
}

impl SettingRange {
    fn contains(self, value: f64) -> bool {
        match self {
            Self::Positive => value > 0.0 && value.is_finite(),
            Self::PositiveUpTo(most) => value > 0.0 && value <= most,
            Self::UpTo(most) => (0.0..=most).contains(&value),
            Self::NotNegative => value >= 0.0 && value.is_finite(),
            Self::MayBeInfinite => value >= 0.0,
        }
    }

    /// Refuses the first of some settings, `(name, value, unit)` each, that is outside this range.
    pub(crate) fn check(
        self,
        subject: &'static str,
        settings: &[(&'static str, f64, &'static str)],
    ) -> Result<(), SettingError> {
        let outside = settings.iter().find(|(_, value, _)| !self.contains(*value));
        outside.map_or(Ok(()), |&(name, value, unit)| {
            Err(SettingError { subject, name, value, unit, range: self })
        })
    }
}

impl fmt::Display for SettingRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Positive => write!(f, "a finite number above zero"),
            Self::PositiveUpTo(most) => write!(f, "above 0 and up to {most}"),
            Self::UpTo(most) => write!(f, "from 0 to {most}"),
            Self::NotNegative => write!(f, "a finite number, zero or more"),
            Self::MayBeInfinite => write!(f, "zero or more, and may be infinite"),
        }
    }
}
