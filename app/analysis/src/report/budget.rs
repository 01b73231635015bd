//! The uncertainty budget of a fit (JCGM 100:2008): the sources of each parameter's uncertainty, and what would reduce
//! the largest. Text, pages and the window show these rows.

use palpate_figures::uncertain::error_alone;
use palpate_rheology::fit::{BudgetEntry, FittedParameter};

pub const BUDGET_TITLE: &str = "Uncertainty budget";

/// Smaller shares of a variance are left out where a line or a panel is narrow, in percent.
const SHARE_MIN: f64 = 1.0;

/// Of every parameter whose sources are told apart; empty without any.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UncertaintyBudget<'a> {
    pub parameters: Vec<ParameterBudget<'a>>,
    /// How to reduce the largest source of each parameter, in words.
    pub remedies: Vec<String>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct ParameterBudget<'a> {
    pub parameter: &'a FittedParameter,
    /// The largest first.
    pub rows: Vec<BudgetRow<'a>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BudgetRow<'a> {
    pub source: &'a str,
    /// Standard uncertainty in the unit of the parameter.
    pub error: f64,
    /// Share of the variance.
    pub percent: f64,
}

impl<'a> UncertaintyBudget<'a> {
    #[must_use]
    pub fn of(parameters: &'a [FittedParameter]) -> Self {
        let known = parameters.iter().filter(|one| !one.budget.is_empty());
        let known = known.map(|one| ParameterBudget { parameter: one, rows: rows(&one.budget) });
        let parameters: Vec<_> = known.collect();
        let mut largest: Vec<&str> = Vec::new();
        for source in parameters.iter().filter_map(|one| Some(one.rows.first()?.source)) {
            if !largest.contains(&source) {
                largest.push(source);
            }
        }
        let sentence = |source| {
            remedy(source).map(|remedy| format!("to reduce the contribution of {source}, {remedy}"))
        };
        Self { remedies: largest.into_iter().filter_map(sentence).collect(), parameters }
    }

    /// Every source once, in the order of the fit.
    #[must_use]
    pub fn sources(&self) -> Vec<&'a str> {
        let mut sources: Vec<&str> = Vec::new();
        for entry in self.parameters.iter().flat_map(|one| &one.parameter.budget) {
            if !sources.contains(&entry.source.as_str()) {
                sources.push(&entry.source);
            }
        }
        sources
    }
}

impl ParameterBudget<'_> {
    /// The sources that are worth a line.
    pub fn main_rows(&self) -> impl Iterator<Item = &BudgetRow<'_>> {
        self.rows.iter().filter(|row| row.percent >= SHARE_MIN)
    }
}

impl BudgetRow<'_> {
    /// Share of the variance, `63 %`.
    #[must_use]
    pub fn share(&self) -> String {
        match self.percent < SHARE_MIN {
            true => format!("< {SHARE_MIN} %"),
            false => format!("{:.0} %", self.percent),
        }
    }

    /// Standard uncertainty, `0.037`.
    #[must_use]
    pub fn uncertainty(&self) -> String {
        error_alone(self.error)
    }
}

fn rows(budget: &[BudgetEntry]) -> Vec<BudgetRow<'_>> {
    let whole: f64 = budget.iter().map(|one| one.error.powi(2)).sum();
    let rows = budget.iter().map(|BudgetEntry { source, error }| BudgetRow {
        source,
        error: *error,
        percent: 100.0 * error.powi(2) / whole,
    });
    let mut rows: Vec<BudgetRow<'_>> = rows.collect();
    rows.sort_by(|one, other| other.percent.total_cmp(&one.percent));
    rows
}

/// One line for each parameter, and one for each remedy; none without a budget.
#[must_use]
pub fn budget_lines(parameters: &[FittedParameter]) -> Vec<String> {
    let budget = UncertaintyBudget::of(parameters);
    if budget.parameters.is_empty() {
        return Vec::new();
    }
    let mut lines = vec![format!("{}, in shares of the variance", BUDGET_TITLE.to_lowercase())];
    for one in &budget.parameters {
        let shares = one.main_rows().map(|row| format!("{} {}", row.source, row.share()));
        let shares: Vec<String> = shares.collect();
        lines.push(format!("  {:<10} {}", one.parameter.name, shares.join(", ")));
    }
    lines.extend(budget.remedies.iter().map(|sentence| format!("- {sentence}")));
    lines
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
        let parameters = [parameter];
        let lines = budget_lines(&parameters);
        assert_eq!(lines[1], "  tau_eps    drift 64 %, noise 36 %");
        assert!(lines[2].contains("out of contact"), "{lines:?}");
        assert!(budget_lines(&[]).is_empty());
        let budget = UncertaintyBudget::of(&parameters);
        assert_eq!(budget.sources(), ["noise", "drift", "contact position"]);
        let words = budget.parameters[0].rows.iter();
        let words: Vec<_> = words.map(|row| (row.source, row.uncertainty(), row.share())).collect();
        let row = |source, error: &str, share: &str| (source, error.to_owned(), share.to_owned());
        let expected = [
            row("drift", "0.40", "64 %"),
            row("noise", "0.30", "36 %"),
            row("contact position", "0.010", "< 1 %"),
        ];
        assert_eq!(words, expected);
    }

    #[test]
    fn every_source_has_a_remedy() {
        let terms = UncertaintyTerm::ALL.map(|term| term.name());
        let own = ["noise", "drift", "contact position", "machine compliance"];
        assert!(terms.iter().chain(&own).all(|source| remedy(source).is_some()));
    }
}
