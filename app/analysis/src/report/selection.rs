//! A selection in words: the table, the ladder and the verdict.

use super::text::{head, in_columns};
use palpate_rheology::select::{HeldOutKind, ModelCandidate, ModelSelection, SelectionOutcome};

/// The whole selection, the verdict last.
#[must_use]
pub fn selection_text(selection: &ModelSelection) -> String {
    let mut parts = vec![records(selection), in_columns(&table(selection))];
    let refused = selection.refused.iter();
    let refused: Vec<String> =
        refused.map(|one| format!("{} is left out: {}", one.family, one.reason)).collect();
    if !refused.is_empty() {
        parts.push(refused.join("\n"));
    }
    let unpredicted = |one: &ModelCandidate| {
        let reason = one.prediction_refused.as_ref()?;
        Some(format!("{} predicts nothing: {reason}", one.family))
    };
    let unpredicted: Vec<String> = selection.candidates.iter().filter_map(unpredicted).collect();
    if !unpredicted.is_empty() {
        parts.push(unpredicted.join("\n"));
    }
    let ladder = ladder(selection);
    if ladder.len() > 1 {
        parts.push(format!("Effect of each extra term:\n{}", in_columns(&ladder)));
    }
    parts.push(tested(selection));
    parts.push(selection.verdict.sentences.join("\n"));
    parts.join("\n\n")
}

/// The records, one line each.
#[must_use]
pub fn records(selection: &ModelSelection) -> String {
    let lines = selection.records.iter().map(|one| {
        format!(
            "{}: {:.4} mm deep at {:.3} mm/s, peak {:.3} N, {} samples",
            one.record, one.depth_mm, one.speed_mm_per_s, one.peak_n, one.samples
        )
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Rows of the comparison, the head first.
#[must_use]
pub fn table(selection: &ModelSelection) -> Vec<Vec<String>> {
    let mut names = head(
        "family | fitted values | rms (mN) | worst (mN) | dAICc | dBIC | predicted (mN) | scaled (mN) | state variables | operations",
    );
    names.extend(selection.tolerance_n.map(|_| "within".to_owned()));
    std::iter::once(names).chain(selection.candidates.iter().map(row)).collect()
}

fn row(one: &ModelCandidate) -> Vec<String> {
    let milli = |newtons: f64| digits(1e3 * newtons);
    let none = || "-".to_owned();
    let prediction = one.prediction.as_ref();
    let mut cells = vec![
        one.family.clone(),
        one.free.to_string(),
        milli(one.rms_n),
        milli(one.worst_n),
        one.aicc_above.map_or_else(none, |value| format!("{value:.1}")),
        format!("{:.1}", one.bic_above),
        prediction.map_or_else(none, |known| match known.std_error_n {
            Some(error) => format!("{} ± {}", milli(known.rms_n), milli(error)),
            None => milli(known.rms_n),
        }),
        prediction.map_or_else(none, |known| milli(known.scaled_rms_n)),
        one.cost.states.to_string(),
        one.cost.operations.to_string(),
    ];
    cells.extend(one.is_within.map(|yes| if yes { "yes" } else { "no" }.to_owned()));
    cells
}

/// Rows of the ladder, the head first.
#[must_use]
pub fn ladder(selection: &ModelSelection) -> Vec<Vec<String>> {
    let mut rows = vec![head("step | adds | rms (mN) | predicted (mN) | dBIC | operations")];
    let change =
        |[before, after]: [f64; 2]| format!("{} > {}", digits(1e3 * before), digits(1e3 * after));
    rows.extend(selection.steps.iter().map(|step| {
        vec![
            format!("{} > {}", step.from, step.to),
            step.adds.to_owned(),
            change(step.rms_n),
            step.prediction_rms_n.map_or("-".into(), change),
            format!("{:+.1}", step.bic_change),
            format!("{} > {}", step.cost[0].operations, step.cost[1].operations),
        ]
    }));
    rows
}

/// Held-out records, and the sample counts of the criteria.
#[must_use]
pub fn tested(selection: &ModelSelection) -> String {
    let known = selection.candidates.iter().find_map(|one| one.prediction.as_ref());
    let what = known.map_or_else(
        || "No record was held out, so the errors are those of the fit itself.".to_owned(),
        |prediction| {
            let has = |unseen: HeldOutKind| prediction.records.iter().any(|one| one.unseen == unseen);
            if has(HeldOutKind::Rest) {
                return "There is only one record, so each family is fitted to the ramp and the first third of the time after it, and predicts the rest. This tests prediction in time only; add a second speed, depth or specimen to test those.".to_owned();
            }
            let kinds = [HeldOutKind::Speed, HeldOutKind::Depth, HeldOutKind::SpeedAndDepth, HeldOutKind::Specimen];
            let kinds = kinds.into_iter().filter(|kind| has(*kind)).map(|kind| {
                let count = prediction.records.iter().filter(|one| one.unseen == kind).count();
                format!("{} in {count}", kind.name())
            });
            let kinds: Vec<String> = kinds.collect();
            format!(
                "Each of {} records is held out in turn and predicted by a fit to the other records ({}). Only the sensor offset is fitted to the held-out record; for 'scaled', a common factor of the model force is fitted too.",
                prediction.records.len(),
                kinds.join(", ")
            )
        },
    );
    let tolerance = selection
        .tolerance_n
        .map_or(String::new(), |tolerance| format!(" Tolerance: {} mN.", digits(1e3 * tolerance)));
    format!(
        "{what}{tolerance} The criteria use an effective sample size of {:.0} for {} autocorrelated samples.",
        selection.effective_samples, selection.samples
    )
}

/// Three digits or, above a hundred, none behind the point.
pub(super) fn digits(value: f64) -> String {
    match value.abs() {
        size if size >= 1e6 => format!("{value:.2e}"),
        size if size >= 99.95 => format!("{value:.0}"),
        size if size >= 9.995 => format!("{value:.1}"),
        size if size >= 0.9995 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

pub(super) fn is_chosen(selection: &ModelSelection, family: &str) -> bool {
    selection.verdict.outcome != SelectionOutcome::NoneWithin
        && selection.verdict.family.as_deref() == Some(family)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        let texts = [1234.0, 123.4, 12.34, 1.234, 0.1234].map(digits);
        assert_eq!(texts, ["1234", "123", "12.3", "1.23", "0.123"]);
    }
}
