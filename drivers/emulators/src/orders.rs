//! Orders to a running emulator: a fault, or an action of a person at the bench.

use super::faults::{FaultError, ScheduledFault, kinds};
use palpate_model::Nanos;
use palpate_model::rig::HandAction;
use thiserror::Error;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EmulatorOrder {
    Fault(ScheduledFault),
    Hand(HandAction),
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum OrderError {
    /// Neither a fault nor an action.
    #[error(
        "'{text}' is not an order; give one of: load GRAMS, mount NUMBER, unmount, KIND or KIND:DURATION, where KIND is one of {kinds}",
        text = .0.text(), kinds = kinds()
    )]
    Unknown(FaultError),
    #[error("'{order}' is not a valid order; write {right}")]
    Number { order: String, right: &'static str },
}

impl EmulatorOrder {
    /// Reads `load GRAMS`, `mount NUMBER`, `unmount`, or `KIND[:DURATION]` of a fault.
    pub fn parse(text: &str, now: Nanos) -> Result<Self, OrderError> {
        let wrong = |right| OrderError::Number { order: text.to_owned(), right };
        let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
        let rest = rest.trim();
        match word {
            "load" => {
                let mass_g: f64 = rest.parse().unwrap_or(f64::NAN);
                // A tonne is beyond every load cell.
                if !(0.0..=1e6).contains(&mass_g) {
                    return Err(wrong("load and a mass in g, 0 for an empty load cell"));
                }
                Ok(Self::Hand(HandAction::LoadCell { mass_g }))
            }
            "mount" => {
                let specimen = rest.parse().map_err(|_| wrong("mount and a specimen number"))?;
                Ok(Self::Hand(HandAction::Mount { specimen }))
            }
            "unmount" if rest.is_empty() => Ok(Self::Hand(HandAction::Unmount)),
            _ => {
                ScheduledFault::parse(text, Some(now)).map(Self::Fault).map_err(OrderError::Unknown)
            }
        }
    }

    /// The sentence after it is carried out; none for a fault, which is reported when it begins.
    pub fn confirmation(&self) -> Option<String> {
        match self {
            Self::Fault(_) => None,
            Self::Hand(HandAction::LoadCell { mass_g }) => {
                Some(format!("a mass of {mass_g} g is on the load cell"))
            }
            Self::Hand(HandAction::Mount { specimen }) => {
                Some(format!("specimen {specimen} is mounted"))
            }
            Self::Hand(HandAction::Unmount) => Some("the specimen is unmounted".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_parsed_or_refused_with_the_right_form() {
        let parse = |text| EmulatorOrder::parse(text, Nanos(5));
        let load = HandAction::LoadCell { mass_g: 140.5 };
        assert_eq!(parse("load 140.5"), Ok(EmulatorOrder::Hand(load)));
        let mount = HandAction::Mount { specimen: 3 };
        assert_eq!(parse("mount 3"), Ok(EmulatorOrder::Hand(mount)));
        assert_eq!(parse("unmount"), Ok(EmulatorOrder::Hand(HandAction::Unmount)));
        assert!(matches!(parse("mute:2"), Ok(EmulatorOrder::Fault(_))));
        for (text, part) in [
            ("load", "a mass in g"),
            ("load -1", "a mass in g"),
            ("load nan", "a mass in g"),
            ("mount x", "specimen number"),
            ("unmount 3", "one of: load GRAMS"),
            ("melt", "garbage, drop"),
        ] {
            let err = parse(text).unwrap_err().to_string();
            assert!(err.contains(part) && err.contains(text), "{err}");
        }
    }
}
