//! The uncertainty budget of a fit in words: which source has which share of the variance, and what would reduce the
//! largest.

use palpate_rheology::fit::{BudgetEntry, FittedParameter};
use std::fmt::Write;

/// Smaller shares of a variance are not printed, in percent.
const SHARE_MIN: f64 = 1.0;

/// One line for each parameter whose sources are told apart, largest source first, and one on what reduces the
/// largest sources; none without.
#[must_use]
pub fn budget_lines(parameters: &[FittedParameter]) -> Vec<String> {
    let mut lines = Vec::new();
    let mut largest: Vec<&str> = Vec::new();
    for one in parameters.iter().filter(|one| !one.budget.is_empty()) {
        let shares = shares(&one.budget);
        let mut line = format!("  {:<10} ", one.name);
        for (source, percent) in shares.iter().filter(|(_, percent)| *percent >= SHARE_MIN) {
            let _ = write!(line, "{source} {percent:.0} %, ");
        }
        lines.push(line.trim_end_matches(", ").to_owned());
        if let Some((source, _)) = shares.first().filter(|(source, _)| !largest.contains(source)) {
            largest.push(source);
        }
    }
    if lines.is_empty() {
        return lines;
    }
    lines.insert(0, "sources of the uncertainty, in shares of the variance".to_owned());
    let remedies = largest.into_iter().filter_map(|source| Some((source, remedy(source)?)));
    lines.extend(
        remedies
            .map(|(source, remedy)| format!("- to reduce the contribution of {source}, {remedy}")),
    );
    lines
}

/// Sources with their shares of the variance in percent, the largest first.
fn shares(budget: &[BudgetEntry]) -> Vec<(&str, f64)> {
    let whole: f64 = budget.iter().map(|one| one.error.powi(2)).sum();
    let share = |one: &BudgetEntry| 100.0 * one.error.powi(2) / whole;
    let mut shares: Vec<(&str, f64)> =
        budget.iter().map(|one| (one.source.as_str(), share(one))).collect();
    shares.sort_by(|one, other| other.1.total_cmp(&one.1));
    shares
}

fn remedy(source: &str) -> Option<&'static str> {
    Some(match source {
        "noise" => "hold longer, or take more samples a second",
        "drift" => {
            "let the load cell warm up, and record it for longer out of contact, before and after"
        }
        "contact position" => "search for contact more slowly",
        "tolerance of the weights" => "calibrate with weights of a better class",
        "repeatability" => "repeat the weight steps of the calibration more often",
        "digits of the readings" => "record the readings of the calibration with more digits",
        "hysteresis" => "use a load cell with less hysteresis",
        "zero drift" => "calibrate when the load cell has warmed up",
        "interpolation" => "calibrate with more weights between those that were used",
        "machine compliance" => "measure the machine compliance again, with more presses",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::calibration::UncertaintyTerm;

    #[test]
    fn shares_add_up_and_the_largest_source_has_a_remedy() {
        let entry = |source: &str, error: f64| BudgetEntry { source: source.into(), error };
        let parameter = FittedParameter {
            name: "tau_eps".into(),
            value: 1.0,
            unit: "s".into(),
            std_error: Some(0.05),
            ci95: None,
            is_fixed: false,
            systematic_error: None,
            total95: None,
            budget: vec![entry("noise", 0.3), entry("drift", 0.4), entry("contact position", 0.01)],
        };
        let lines = budget_lines(&[parameter]);
        assert_eq!(lines[1], "  tau_eps    drift 64 %, noise 36 %");
        assert!(lines[2].contains("out of contact"), "{lines:?}");
        assert!(budget_lines(&[]).is_empty());
    }

    #[test]
    fn every_source_has_a_remedy() {
        let terms = UncertaintyTerm::ALL.map(|term| term.name());
        let own = ["noise", "drift", "contact position", "machine compliance"];
        assert!(terms.iter().chain(&own).all(|source| remedy(source).is_some()));
    }
}
