//! Tolerated error of force: in newtons, of the peak, or of the smallest change that a hand notices.

use palpate_model::units::Newtons;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// Smallest change of force that a hand notices, as a share of the force: about 10 % between 2 and 10 N
/// (Pang, Tan & Durlach, "Manual discrimination of force using active finger motion", Percept.
/// Psychophys. 49 (1991) 531-540, 5 to 10 %; Jones, "Matching forces: constant errors and differential
/// thresholds", Perception 18 (1989) 681-687, 7 %).
pub const THRESHOLD_SHARE: f64 = 0.1;

/// A tolerated error of force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    Newtons(Newtons),
    /// So many percent of the peak force.
    PercentOfPeak(f64),
    /// So many percent of the smallest change that a hand notices at the peak force.
    PercentOfThreshold(f64),
}

/// A text that is no tolerance.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "'{text}' is not a tolerance of force; write a number above zero in newtons (0.05N), percent of the peak force (1%) or percent of the smallest change that a hand notices (10%jnd)"
)]
pub struct BadTolerance {
    pub text: String,
}

impl Tolerance {
    /// The tolerance where the peak force is `peak`.
    #[must_use]
    pub fn in_newtons(self, peak: Newtons) -> Newtons {
        match self {
            Self::Newtons(newtons) => newtons,
            Self::PercentOfPeak(percent) => Newtons(0.01 * percent * peak.0.abs()),
            Self::PercentOfThreshold(percent) => {
                Newtons(0.01 * percent * THRESHOLD_SHARE * peak.0.abs())
            }
        }
    }
}

/// How a text ends and what its number is.
type Kind = (&'static str, fn(f64) -> Tolerance);

impl FromStr for Tolerance {
    type Err = BadTolerance;

    fn from_str(text: &str) -> Result<Self, BadTolerance> {
        let bad = || BadTolerance { text: text.to_owned() };
        let compact: String = text.split_whitespace().collect();
        let kinds: [Kind; 3] = [
            ("%jnd", Self::PercentOfThreshold),
            ("%", Self::PercentOfPeak),
            ("N", |newtons| Self::Newtons(Newtons(newtons))),
        ];
        let (number, kind) = kinds
            .into_iter()
            .find_map(|(ending, kind)| Some((compact.strip_suffix(ending)?, kind)))
            .ok_or_else(bad)?;
        let value: f64 = number.parse().map_err(|_| bad())?;
        if value > 0.0 && value.is_finite() { Ok(kind(value)) } else { Err(bad()) }
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Newtons(newtons) => write!(f, "{} N", newtons.0),
            Self::PercentOfPeak(percent) => write!(f, "{percent} % of the peak force"),
            Self::PercentOfThreshold(percent) => {
                write!(
                    f,
                    "{percent} % of the smallest change that a hand notices at the peak force"
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerance_is_parsed_in_newtons_percent_of_peak_and_of_threshold() {
        let newtons = |text: &str| {
            let tolerance: Tolerance = text.parse().unwrap();
            tolerance.in_newtons(Newtons(-4.0)).0
        };
        assert!((newtons("0.05N") - 0.05).abs() < 1e-15);
        assert!((newtons("1%") - 0.04).abs() < 1e-15);
        assert!((newtons("10 % jnd") - 0.04).abs() < 1e-15);
        for text in ["", "5", "N", "-1%", "0N", "inf%", "nanN", "1 kg", "%jnd"] {
            assert!(text.parse::<Tolerance>().is_err(), "{text}");
        }
    }
}
