//! The content of a stored analysis in words.

use crate::analysed_session::ForceChange;
use palpate_rheology::fit::FittedParameter;
use palpate_sessions::analyses::{Analyses, AnalysisContent};
use serde::Deserialize;
use serde_json::Value;

/// The parameters that a kept fit found; those that cannot be understood are left out.
#[must_use]
pub fn parameters(results: &Value) -> Vec<FittedParameter> {
    let parameter = |one: &Value| {
        let mut one = one.clone();
        // Fits of other families were once stored without it.
        one.as_object_mut()?.entry("is_fixed").or_insert(false.into());
        FittedParameter::deserialize(one).ok()
    };
    results["parameters"].as_array().into_iter().flatten().filter_map(parameter).collect()
}

/// Warnings and findings of a stored fit.
#[must_use]
pub fn sentences(results: &Value) -> Vec<String> {
    let lists = ["warnings", "findings"].map(|name| results[name].as_array());
    lists.into_iter().flatten().flatten().filter_map(Value::as_str).map(str::to_owned).collect()
}

#[must_use]
pub fn describe_force_change(change: &ForceChange) -> String {
    let newtons = |force: Option<f64>| force.map_or("-".to_owned(), |it| format!("{it:.3} N"));
    format!(
        "{} forces change by {:.4} N rms and at most {:.4} N; the peak is {} instead of {}",
        change.samples,
        change.rms_n,
        change.max_n,
        newtons(change.peak_after_n),
        newtons(change.peak_before_n),
    )
}

#[must_use]
pub fn describe_analysis(what: &AnalysisContent) -> String {
    match what {
        AnalysisContent::Fit { based_on, results, .. } => {
            let family = results["name"].as_str().or(results["model"].as_str());
            let family = family.unwrap_or("a model").to_owned();
            match based_on {
                Some(name) => format!("{family}, read as '{name}'"),
                None => family,
            }
        }
        // The number is their first line.
        AnalysisContent::Material { words, .. } => {
            words.lines().next().unwrap_or_default().to_owned()
        }
        AnalysisContent::Recalibration { calibration, results } => {
            let name = calibration["name"].as_str().unwrap_or("another");
            match ForceChange::deserialize(results) {
                Ok(found) => format!("calibration {name}: {}", describe_force_change(&found)),
                Err(_) => format!("calibration {name}"),
            }
        }
        AnalysisContent::Mask { left_out_s } => {
            let spans = left_out_s.iter();
            let spans: Vec<String> = spans.map(|[a, b]| format!("{a} to {b} s")).collect();
            format!("left out: {}", spans.join(", "))
        }
        AnalysisContent::Withdrawal => "withdrawn".to_owned(),
    }
}

/// Author and reason of a withdrawal; `None` while the analysis counts.
#[must_use]
pub fn describe_withdrawal(analyses: &Analyses, name: &str) -> Option<String> {
    let by = analyses.withdrawal(name)?;
    Some(format!(
        "withdrawn by {} at {}: {}",
        by.by,
        super::session_text::format_utc(&by.at),
        by.reason
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn fits_of_every_family_are_read_back() {
        let results = json!({
            "parameters": [
                {"name": "tau", "value": 1.5, "unit": "s", "std_error": 0.1, "ci95": [1.3, 1.7], "is_fixed": false,
                 "total95": [1.2, 1.9], "budget": [{"source": "noise", "error": 0.1}]},
                {"name": "k", "value": 2.0, "unit": "N/mm", "std_error": 0.2},
                {"name": "unreadable"},
            ],
            "warnings": ["beware"],
        });
        let found = parameters(&results);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].ci95, Some([1.3, 1.7]));
        assert_eq!((found[0].total95, found[0].budget[0].error), (Some([1.2, 1.9]), 0.1));
        assert_eq!((found[1].ci95, found[1].is_fixed), (None, false));
        assert!(found[1].total95.is_none() && found[1].budget.is_empty());
        assert_eq!(sentences(&results), ["beware"]);
        assert!(parameters(&Value::Null).is_empty() && sentences(&Value::Null).is_empty());
    }

    #[test]
    fn an_analysis_is_described_by_its_content() {
        let mask = AnalysisContent::Mask { left_out_s: vec![[1.0, 2.5], [3.0, 4.0]] };
        assert_eq!(describe_analysis(&mask), "left out: 1 to 2.5 s, 3 to 4 s");
        let change = ForceChange { samples: 7, peak_after_n: Some(2.0), ..ForceChange::default() };
        let other = AnalysisContent::Recalibration {
            calibration: json!({"name": "June"}),
            results: serde_json::to_value(change).unwrap(),
        };
        let words = describe_analysis(&other);
        assert!(words.starts_with("calibration June: 7 forces"), "{words}");
        assert!(words.ends_with("peak is 2.000 N instead of -"), "{words}");
    }
}
