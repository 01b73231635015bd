//! The choice of a family, or the reason why there is none.

use super::run::ModelCandidate;
use serde::Serialize;

/// A difference of BIC below this is "not worth more than a bare mention" (Kass & Raftery, J. Am. Stat.
/// Assoc. 90 (1995) 773-795, section 3.2).
const BARE_MENTION: f64 = 2.0;
/// Costs within this share are the same cost.
const SAME_COST: f64 = 0.05;
/// Residuals worth fewer independent samples than this for each record, and than [`WHITE_SHARE`] of all,
/// wander over the record as a wrong model's do: a hundred pieces are what makes a curve, not noise.
const PIECES: usize = 100;
/// See [`PIECES`].
const WHITE_SHARE: f64 = 0.5;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SelectionOutcome {
    /// One family is recommended.
    Recommended,
    /// Several do equally well; the simplest of them is the choice to use.
    NoWinner,
    /// No family is within the tolerance.
    NoneWithin,
    /// No family describes the records to their noise.
    NoneAdequate,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SelectionVerdict {
    pub outcome: SelectionOutcome,
    /// The family to use; null where none is within the tolerance or adequate.
    pub family: Option<String>,
    /// The families that are as good, itself included; or the nearest where none is good enough.
    pub among: Vec<String>,
    /// Sentences, the choice first.
    pub sentences: Vec<String>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct SampleCounts {
    pub records: usize,
    pub samples: usize,
    pub effective: f64,
}

impl SampleCounts {
    /// Whether what the best fit leaves is a curve rather than noise.
    fn is_curve(self) -> bool {
        let pieces = (PIECES * self.records) as f64;
        self.effective < pieces.min(WHITE_SHARE * self.samples as f64)
    }
}

pub(super) fn decide(
    candidates: &[ModelCandidate],
    tolerance_n: Option<f64>,
    is_predicted: bool,
    counts: SampleCounts,
) -> SelectionVerdict {
    match tolerance_n {
        Some(tolerance) => choose_within(candidates, tolerance, is_predicted),
        None => choose_by_criterion(candidates, counts),
    }
}

/// By fewer numbers, then by cost.
fn simplest<'a>(candidates: &[&'a ModelCandidate]) -> Option<&'a ModelCandidate> {
    let order = |one: &&&ModelCandidate| (one.free, one.cost);
    candidates.iter().min_by_key(order).copied()
}

/// The lowest BIC, if no other family comes near it and it describes the records.
fn choose_by_criterion(candidates: &[ModelCandidate], counts: SampleCounts) -> SelectionVerdict {
    let near: Vec<&ModelCandidate> =
        candidates.iter().filter(|one| one.bic_above < BARE_MENTION).collect();
    let among: Vec<String> = near.iter().map(|one| one.family.clone()).collect();
    let chosen = simplest(&near);
    let (outcome, sentence) = match chosen {
        Some(_) if counts.is_curve() => {
            let closest = candidates.iter().min_by(|a, b| a.rms_n.total_cmp(&b.rms_n));
            let residuals = closest.map_or("the residuals".to_owned(), |one| {
                format!("the residuals of {}, {} rms,", one.family, newtons(one.rms_n))
            });
            (
                SelectionOutcome::NoneAdequate,
                format!(
                    "no winner: every family shows lack of fit; {residuals} are autocorrelated ({} samples carry the information of {:.0} independent ones), so the lowest BIC is no evidence; to choose by the size of the error, state a tolerance, which is the largest error that you accept",
                    counts.samples, counts.effective
                ),
            )
        }
        Some(one) if near.len() > 1 => (
            SelectionOutcome::NoWinner,
            format!(
                "no winner among {}: their BIC values differ by less than {BARE_MENTION}; use {}, the simplest of them",
                list(&among),
                one.family
            ),
        ),
        Some(one) => {
            let next = candidates
                .iter()
                .filter(|other| other.family != one.family)
                .map(|other| other.bic_above)
                .fold(f64::INFINITY, f64::min);
            let lead = if next.is_finite() {
                format!(": it has the lowest BIC, {next:.1} below the next")
            } else {
                ", the only family compared".to_owned()
            };
            (SelectionOutcome::Recommended, format!("use {} ({}){lead}", one.family, one.name))
        }
        None => (
            SelectionOutcome::NoneAdequate,
            "no family has a finite BIC; check the units of force and depth".to_owned(),
        ),
    };
    let is_chosen = matches!(outcome, SelectionOutcome::Recommended | SelectionOutcome::NoWinner);
    SelectionVerdict {
        outcome,
        family: chosen.filter(|_| is_chosen).map(|one| one.family.clone()),
        among,
        sentences: vec![sentence],
    }
}

/// The cheapest within the tolerance.
fn choose_within(
    candidates: &[ModelCandidate],
    tolerance: f64,
    is_predicted: bool,
) -> SelectionVerdict {
    let error = |one: &ModelCandidate| one.error(is_predicted).unwrap_or(f64::INFINITY);
    let what = if is_predicted { "predicts the held-out data" } else { "describes the records" };
    let good: Vec<&ModelCandidate> =
        candidates.iter().filter(|one| error(one) <= tolerance).collect();
    let by_cost = |one: &&&ModelCandidate| (one.cost, one.free);
    let Some(cheapest) = good.iter().min_by_key(by_cost) else {
        let nearest = candidates.iter().min_by(|a, b| error(a).total_cmp(&error(b)));
        let nearest = nearest.filter(|one| error(one).is_finite());
        let sentence = match nearest {
            Some(one) => format!(
                "no winner: no family {what} within {}; the nearest is {} with an error of {} rms",
                newtons(tolerance),
                one.family,
                newtons(error(one))
            ),
            None => {
                "no winner: with the held-out data set aside, no family can be fitted to the rest; add records"
                    .into()
            }
        };
        return SelectionVerdict {
            outcome: SelectionOutcome::NoneWithin,
            family: None,
            among: nearest.map(|one| one.family.clone()).into_iter().collect(),
            sentences: vec![sentence],
        };
    };
    let cost_max = cheapest.cost.operations as f64 * (1.0 + SAME_COST);
    let equals: Vec<&ModelCandidate> = good
        .iter()
        .filter(|one| one.cost.operations as f64 <= cost_max && are_equal(one, cheapest))
        .copied()
        .collect();
    let among: Vec<String> = equals.iter().map(|one| one.family.clone()).collect();
    let chosen = simplest(&equals).unwrap_or(cheapest);
    let first = format!(
        "{} ({}): it {what} within {}, with an error of {} rms and {} at worst, for {} operations per evaluation",
        chosen.family,
        chosen.name,
        newtons(tolerance),
        newtons(error(chosen)),
        newtons(worst(chosen, is_predicted)),
        chosen.cost.operations
    );
    let mut sentences = vec![if equals.len() > 1 {
        format!(
            "no winner among {}, which have equal costs and equal errors; use the simplest, {first}",
            list(&among)
        )
    } else {
        format!("use {first}")
    }];
    sentences.extend(remarks(candidates, chosen, tolerance, is_predicted));
    SelectionVerdict {
        outcome: if equals.len() > 1 {
            SelectionOutcome::NoWinner
        } else {
            SelectionOutcome::Recommended
        },
        family: Some(chosen.family.clone()),
        among,
        sentences,
    }
}

/// Whether two families do equally well: by their predictions over records, or else by their BIC.
fn are_equal(one: &ModelCandidate, other: &ModelCandidate) -> bool {
    let by_records = one
        .prediction
        .as_ref()
        .zip(other.prediction.as_ref())
        .and_then(|(a, b)| Some((a.rms_n - b.rms_n, a.difference_error(b)?)));
    match by_records {
        Some((difference, error)) => difference.abs() <= error,
        None => (one.bic - other.bic).abs() < BARE_MENTION,
    }
}

fn worst(one: &ModelCandidate, is_predicted: bool) -> f64 {
    match &one.prediction {
        Some(prediction) if is_predicted => prediction.worst_n,
        _ => one.worst_n,
    }
}

fn remarks(
    candidates: &[ModelCandidate],
    chosen: &ModelCandidate,
    tolerance: f64,
    is_predicted: bool,
) -> Vec<String> {
    let mut remarks = Vec::new();
    let error = |one: &ModelCandidate| one.error(is_predicted).unwrap_or(f64::INFINITY);
    if worst(chosen, is_predicted) > tolerance {
        remarks.push(format!(
            "the tolerance holds on average but not everywhere; the error of single samples is up to {}",
            newtons(worst(chosen, is_predicted))
        ));
    }
    let spread = chosen.prediction.as_ref().and_then(|one| one.std_error_n);
    if let Some(spread) = spread.filter(|spread| error(chosen) + spread > tolerance) {
        remarks.push(format!(
            "the error of {} varies between records by {} (standard error), more than the margin to the tolerance; another record may exceed the tolerance",
            chosen.family,
            newtons(spread)
        ));
    }
    let lowest = candidates.iter().map(error).fold(f64::INFINITY, f64::min);
    if let Some(best) = candidates.iter().find(|one| error(one) <= lowest)
        && best.family != chosen.family
    {
        remarks.push(format!(
            "{} reduces the error to {} for {} operations per evaluation",
            best.family,
            newtons(lowest),
            best.cost.operations
        ));
    }
    remarks
}

/// Three digits, in the unit that suits them.
fn newtons(value: f64) -> String {
    match value {
        value if value >= 9.995 => format!("{value:.1} N"),
        value if value >= 0.9995 => format!("{value:.2} N"),
        value if value >= 0.0995 => format!("{:.0} mN", 1e3 * value),
        value if value >= 0.00995 => format!("{:.1} mN", 1e3 * value),
        value => format!("{:.2} mN", 1e3 * value),
    }
}

fn list(names: &[String]) -> String {
    match names {
        [rest @ .., last] if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        names => names.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newtons_have_three_digits() {
        let texts = [12.34, 1.234, 0.1234, 0.012_34, 0.001_234].map(newtons);
        assert_eq!(texts, ["12.3 N", "1.23 N", "123 mN", "12.3 mN", "1.23 mN"]);
    }

    #[test]
    fn noise_with_short_correlation_is_not_lack_of_fit() {
        let counts = |samples, effective| SampleCounts { records: 2, samples, effective };
        // A filter's memory of fifty samples in a minute at 1 kHz; a short record of white noise.
        assert!(!counts(60_000, 1200.0).is_curve());
        assert!(!counts(100, 90.0).is_curve());
        assert!(counts(60_000, 150.0).is_curve() && counts(100, 30.0).is_curve());
    }
}
