//! How large an error of force may be: the word that the trade and the selection of a model share.

use crate::units::Newtons;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// Smallest change of force that people notice, as a share of the force: about a tenth. Fingers and
/// hands resolve 5 to 10 % from 2.5 to 10 N (Pang, Tan & Durlach, Perception & Psychophysics 49 (1991)
/// 531-540), arms 7 % (Jones, Perception 18 (1989) 681-687); the coarse end, since most of what is
/// felt in a procedure is felt in passing.
pub const WEBER_FRACTION: f64 = 0.1;

/// How large an error of force may be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Tolerance {
    /// So many newtons.
    Newtons(f64),
    /// So many percent of the largest force.
    PercentOfPeak(f64),
    /// So many percent of the smallest change that a person notices at the largest force.
    PercentOfThreshold(f64),
}

/// A text that is no tolerance.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "'{0}' is not a tolerance; give newtons as 0.05N, percent of the peak force as 1%, or percent of what a person notices as 10%jnd, above zero"
)]
pub struct ToleranceError(String);

impl Tolerance {
    /// The error allowed in N where the largest force has this size.
    #[must_use]
    pub fn in_newtons(self, peak: Newtons) -> Newtons {
        let share = |percent: f64| Newtons(percent / 100.0 * peak.0.abs());
        match self {
            Self::Newtons(value) => Newtons(value),
            Self::PercentOfPeak(percent) => share(percent),
            Self::PercentOfThreshold(percent) => share(percent * WEBER_FRACTION),
        }
    }
}

impl FromStr for Tolerance {
    type Err = ToleranceError;

    fn from_str(text: &str) -> Result<Self, ToleranceError> {
        let lower = text.trim().to_lowercase();
        let kinds: [(&str, fn(f64) -> Self); 3] = [
            ("%jnd", Self::PercentOfThreshold),
            ("%", Self::PercentOfPeak),
            ("n", Self::Newtons),
        ];
        kinds
            .iter()
            .find_map(|(unit, kind)| {
                let value: f64 = lower.strip_suffix(unit)?.trim_end().parse().ok()?;
                (value > 0.0 && value.is_finite()).then(|| kind(value))
            })
            .ok_or_else(|| ToleranceError(text.to_owned()))
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Newtons(value) => write!(f, "{value}N"),
            Self::PercentOfPeak(percent) => write!(f, "{percent}%"),
            Self::PercentOfThreshold(percent) => write!(f, "{percent}%jnd"),
        }
    }
}

impl TryFrom<String> for Tolerance {
    type Error = ToleranceError;

    fn try_from(text: String) -> Result<Self, ToleranceError> {
        text.parse()
    }
}

impl From<Tolerance> for String {
    fn from(tolerance: Tolerance) -> Self {
        tolerance.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_are_read_and_written_alike() {
        for (text, tolerance, at_6_n) in [
            ("0.05N", Tolerance::Newtons(0.05), 0.05),
            ("1%", Tolerance::PercentOfPeak(1.0), 0.06),
            ("10%jnd", Tolerance::PercentOfThreshold(10.0), 0.06),
        ] {
            assert_eq!(text.parse(), Ok(tolerance));
            assert_eq!(tolerance.to_string(), text);
            for force in [6.0, -6.0] {
                let newtons = tolerance.in_newtons(Newtons(force)).0;
                assert!((newtons - at_6_n).abs() < 1e-15, "{text}: {newtons}");
            }
        }
        assert_eq!(" 20 %JND ".parse(), Ok(Tolerance::PercentOfThreshold(20.0)));
        assert_eq!("5e-3 n".parse(), Ok(Tolerance::Newtons(5e-3)));
    }

    #[test]
    fn anything_else_is_refused_with_examples() {
        for text in [
            "", "1", "N", "%", "0%", "-1N", "NaN%", "infN", "1 mN", "5%peak", "1%%",
        ] {
            let refusal = text.parse::<Tolerance>().unwrap_err().to_string();
            assert!(
                refusal.contains("0.05N") && refusal.contains("10%jnd"),
                "{refusal}"
            );
        }
    }
}
