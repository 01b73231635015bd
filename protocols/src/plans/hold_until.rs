//! A rule that ends a hold early: when a parameter is known well enough.

use palpate_model::units::Seconds;
use serde::{Deserialize, Serialize};
use std::fmt;

palpate_model::named! {
    /// A parameter of the body that a rule can wait for.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum BodyParameter {
        TauEps = "tau_eps",
        Mu1 = "mu1",
        Mu2 = "mu2",
        Mu3 = "mu3",
        TauSig = "tau_sig",
    }
}

/// End the hold once the 95 % interval of a parameter is narrow enough. The planned duration stays
/// the longest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HoldUntil {
    pub parameter: BodyParameter,
    /// Half of its interval as a share of its value.
    pub relative: f64,
    /// Shortest time at depth: the first answers of a hold know little of the memory of the noise.
    pub at_least: Seconds,
}

impl HoldUntil {
    /// A rule with the usual shortest hold of 5 s, five relaxation times of pig stomach.
    #[must_use]
    pub const fn new(parameter: BodyParameter, relative: f64) -> Self {
        Self { parameter, relative, at_least: Seconds(5.0) }
    }

    pub fn check(&self) -> Result<(), String> {
        if !(self.relative > 0.0 && self.relative < 1.0) {
            return Err(format!(
                "a share of {} % of the value is not possible; give a share above 0 and below 100 %",
                self.relative * 100.0
            ));
        }
        if !(self.at_least.0 >= 0.0 && self.at_least.is_finite()) {
            return Err(format!(
                "a shortest hold of {} is not possible; give 0 s or more",
                self.at_least
            ));
        }
        Ok(())
    }

    /// Reads `tau=1%` or `mu1=0.02`; `tau` is short for `tau_eps`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let form = "write the rule in the form tau=1% or tau_eps=0.01";
        let Some((name, share)) = text.split_once('=') else {
            return Err(format!("'{text}' has no '='; {form}"));
        };
        let name = match name.trim() {
            "tau" => "tau_eps",
            other => other,
        };
        let Some(parameter) = BodyParameter::ALL.into_iter().find(|p| p.name() == name) else {
            let known = BodyParameter::ALL.map(BodyParameter::name).join(", ");
            return Err(format!("the model has no parameter '{name}'; choose from {known}"));
        };
        let share = share.trim();
        let (number, unit) = match share.strip_suffix('%') {
            Some(number) => (number.trim_end(), 0.01),
            None => (share, 1.0),
        };
        let relative = match number.parse::<f64>() {
            Ok(value) => value * unit,
            Err(_) => return Err(format!("'{share}' is not a share of a value; {form}")),
        };
        let rule = Self::new(parameter, relative);
        rule.check().map(|()| rule)
    }
}

impl fmt::Display for HoldUntil {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is known to within {} %", self.parameter.name(), percent(self.relative))
    }
}

/// A share in percent with at most three significant digits, as people write it.
#[must_use]
pub fn percent(share: f64) -> String {
    let value = share * 100.0;
    let decimals = if value >= 10.0 {
        1
    } else if value >= 1.0 {
        2
    } else {
        3
    };
    let text = format!("{value:.decimals$}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_read_as_people_write_them() {
        for (text, parameter, relative) in [
            ("tau=1%", BodyParameter::TauEps, 0.01),
            ("tau_eps = 0.02", BodyParameter::TauEps, 0.02),
            ("mu3= 2.5 %", BodyParameter::Mu3, 0.025),
        ] {
            let rule = HoldUntil::parse(text).unwrap();
            assert_eq!(rule.parameter, parameter, "{text}");
            assert!((rule.relative - relative).abs() < 1e-15, "{text}");
        }
        for (text, words) in [
            ("tau", "tau=1%"),
            ("mu9=1%", "no parameter 'mu9'"),
            ("tau=much", "'much'"),
            ("tau=0%", "above 0"),
            ("tau=-1%", "above 0"),
            ("tau=100%", "below 100 %"),
            ("tau=nan", "above 0"),
        ] {
            let reason = HoldUntil::parse(text).unwrap_err();
            assert!(reason.contains(words), "{text}: {reason}");
        }
    }

    #[test]
    fn hold_rule_prints_as_a_sentence() {
        let rule = HoldUntil::new(BodyParameter::TauEps, 0.01);
        assert_eq!(rule.to_string(), "tau_eps is known to within 1 %");
        assert_eq!(percent(0.12345), "12.3");
        assert_eq!(percent(0.002), "0.2");
        assert_eq!(percent(0.2), "20");
    }
}
