//! A calibration as people read it: a list, a page of text, and the answer of a check. Its picture is in
//! [`super::calibration_plot`].

pub use super::calibration_plot::picture;
use super::text::table;
use palpate_model::calibration::{
    Calibration, CalibrationError, CalibrationQuality, CurveCandidate, CurveKind, ForceUncertainty,
    UncertaintyTerm, WeightCheck, assess_curve_kind, curve_candidates,
};
use palpate_model::units::Newtons;
use palpate_sessions::calibrations::{CalibrationStore, StoredCalibration};
use serde::Serialize;
use std::path::Path;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CalibrationEntry {
    pub id: String,
    pub name: String,
    pub rig: String,
    /// Serial number.
    pub cell: String,
    pub taken_at: Option<String>,
    pub age_days: Option<i64>,
    pub valid_days: u32,
    pub is_in_force: bool,
    pub superseded_by: Option<String>,
}

impl CalibrationEntry {
    /// Of a stored calibration.
    #[must_use]
    pub fn of(shelf: &CalibrationStore, kept: &StoredCalibration, age_days: Option<i64>) -> Self {
        let document = &kept.document;
        let in_force = shelf.in_force(&document.rig);
        Self {
            id: kept.id.clone(),
            age_days,
            is_in_force: in_force.is_some_and(|one| one.id == kept.id),
            superseded_by: shelf.successor(&kept.id).map(str::to_owned),
            ..Self::built_in(document)
        }
    }

    /// Of the calibration that comes with a rig and is in no library.
    #[must_use]
    pub fn built_in(document: &Calibration) -> Self {
        Self {
            id: format!("{} (built in)", document.name),
            name: document.name.clone(),
            rig: document.rig.clone(),
            cell: document.cell.clone(),
            taken_at: document.taken_at.clone(),
            age_days: None,
            valid_days: document.valid_days(),
            is_in_force: false,
            superseded_by: None,
        }
    }

    /// Whether it is in force, superseded, expired or only older, in words.
    pub fn state(&self) -> String {
        let is_old = self.age_days.is_some_and(|age| age > i64::from(self.valid_days));
        match (&self.superseded_by, is_old, self.is_in_force) {
            (Some(by), _, _) => format!("superseded by {by}"),
            (None, true, _) => "expired".to_owned(),
            (None, false, true) => "in force".to_owned(),
            (None, false, false) => "older than the calibration in force".to_owned(),
        }
    }
}

#[must_use]
pub fn list(entries: &[CalibrationEntry], folder: &Path) -> String {
    if entries.is_empty() {
        return format!("no calibration in {}", folder.display());
    }
    let row = |one: &CalibrationEntry| {
        let age = one.age_days.map_or("not stated".to_owned(), |age| format!("{age} d"));
        vec![one.id.clone(), one.name.clone(), one.rig.clone(), one.cell.clone(), age, one.state()]
    };
    table("id | name | rig | cell | age | state", entries.iter().map(row))
}

/// Uncertainty budget of one force.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Budget {
    pub force_n: f64,
    /// All terms together; null where nothing is stated.
    pub uncertainty_n: Option<f64>,
    /// Every term; null where it is not stated.
    pub terms: Vec<BudgetTerm>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BudgetTerm {
    pub term: UncertaintyTerm,
    /// Its standard uncertainty in N; null where it is not stated.
    pub uncertainty_n: Option<f64>,
}

/// Quality, candidate curves and uncertainty of a calibration.
#[derive(Clone, Debug, Serialize)]
pub struct CalibrationDetails {
    pub quality: CalibrationQuality,
    /// Every curve tried, the best first.
    pub candidates: Vec<CurveCandidate>,
    pub chosen: Option<CurveCandidate>,
    /// Uncertainty at each weight and half-way to the next.
    pub budget: Vec<Budget>,
    #[serde(skip)]
    pub uncertainty: ForceUncertainty,
}

impl CalibrationDetails {
    pub fn of(calibration: &Calibration) -> Result<Self, CalibrationError> {
        let points = calibration.points()?;
        let uncertainty = ForceUncertainty::of(calibration)?;
        let mut forces: Vec<f64> = points.iter().map(|point| point.newtons.0).collect();
        forces.extend(points.windows(2).map(|pair| 0.5 * (pair[0].newtons.0 + pair[1].newtons.0)));
        forces.sort_by(f64::total_cmp);
        let budget = |&force_n: &f64| Budget {
            force_n,
            uncertainty_n: uncertainty.sigma(Newtons(force_n)).map(|sigma| sigma.0),
            terms: UncertaintyTerm::ALL
                .map(|term| BudgetTerm {
                    term,
                    uncertainty_n: uncertainty
                        .term_sigma(term, Newtons(force_n))
                        .map(|sigma| sigma.0),
                })
                .to_vec(),
        };
        Ok(Self {
            quality: calibration.quality()?,
            candidates: curve_candidates(&points),
            chosen: assess_curve_kind(&calibration.curve, &points),
            budget: forces.iter().map(budget).collect(),
            uncertainty,
        })
    }
}

#[must_use]
pub fn calibration_page(
    calibration: &Calibration,
    id: Option<&str>,
    details: &CalibrationDetails,
    doubts: &[String],
) -> String {
    let sentences = details.quality.findings.iter().chain(doubts);
    let sentences: Vec<String> = sentences.map(|one| format!("- {one}")).collect();
    let mut parts = vec![
        head(calibration, id),
        points(&details.quality),
        curves(calibration, details),
        spread(&details.quality),
        budget(details),
        sentences.join("\n"),
    ];
    parts.retain(|part| !part.is_empty());
    parts.join("\n\n")
}

fn head(calibration: &Calibration, id: Option<&str>) -> String {
    let mut lines = vec![calibration.name.clone()];
    let mut fact = |name: &str, value: String| {
        if !value.is_empty() {
            lines.push(format!("  {name:<12} {value}"));
        }
    };
    fact("id", id.unwrap_or_default().to_owned());
    fact("source", calibration.source.clone());
    fact("taken", calibration.taken_at.clone().unwrap_or_default());
    fact("operator", calibration.operator.clone());
    fact("rig", calibration.rig.clone());
    fact("cell", calibration.cell.clone());
    fact("excitation", calibration.excitation.map_or(String::new(), |volts| volts.to_string()));
    fact("supersedes", calibration.supersedes.clone().unwrap_or_default());
    fact("curve", calibration.curve.to_string());
    lines.join("\n")
}

fn points(quality: &CalibrationQuality) -> String {
    let some = |value: Option<f64>, digits: usize| {
        value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
    };
    let rows = quality.points.iter().map(|one| {
        vec![
            format!("{:.1}", one.mass_g),
            format!("{:.3}", one.force_n),
            format!("{:.5}", one.signal_v),
            one.readings.to_string(),
            // A curve that meets its points leaves nothing but rounding.
            format!("{:.1}", one.residual_n * 1e3 + 0.0),
            format!("{:.4}", one.sensitivity_v_per_n),
            some(one.hysteresis_v.map(|volts| volts * 1e3), 2),
            some(one.uncertainty_n, 3),
        ]
    });
    let head = "mass (g) | force (N) | signal (V) | readings | residual (mN) | V/N | load - unload (mV) | u (N)";
    table(head, rows)
}

fn curves(calibration: &Calibration, details: &CalibrationDetails) -> String {
    let newtons = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
    let is_chosen = |one: &CurveCandidate| one.curve == calibration.curve;
    let own = details.chosen.iter().filter(|_| !details.candidates.iter().any(is_chosen));
    let rows = details.candidates.iter().chain(own).map(|one| {
        if let Some(reason) = &one.refused {
            return vec![one.name.clone(), reason.clone()];
        }
        let square: f64 = one.residuals_n.iter().map(|residual| residual * residual).sum();
        let count = one.residuals_n.len().max(1) as f64;
        let through = match &one.curve {
            CurveKind::Segments { through_g } => {
                let masses: Vec<String> = through_g.iter().map(|mass| mass.to_string()).collect();
                format!("through {} g", masses.join(", "))
            }
            _ => String::new(),
        };
        let mark = if is_chosen(one) { "in use " } else { "" };
        vec![
            one.name.clone(),
            newtons(one.left_out_rms_n),
            newtons(one.left_out_worst_n),
            newtons(one.left_out_ends_rms_n),
            format!("{:.1}", (square / count).sqrt() * 1e3),
            format!("{mark}{through}"),
        ]
    });
    table(
        "curve | leave-one-out, rms (N) | leave-one-out, worst (N) | end weights left out, rms (N) | residuals, rms (mN) | ",
        rows,
    )
}

fn spread(quality: &CalibrationQuality) -> String {
    let hysteresis = match &quality.hysteresis {
        Some(one) => format!(
            "hysteresis: at most {:.2} mV ({:.3} N), rms {:.2} mV ({:.3} N)",
            one.max_v * 1e3,
            one.max_n,
            one.rms_v * 1e3,
            one.rms_n
        ),
        None => "hysteresis: not measured; to measure it, take the weights off one by one and read each step".to_owned(),
    };
    let repeatability = match quality.repeatability_v {
        Some(volts) => format!("repeatability: {:.2} mV from reading to reading", volts * 1e3),
        None => "repeatability: not measured; repeat the series".to_owned(),
    };
    let zero_shift = match (quality.zero_shift_v, quality.zero_shift_n) {
        (Some(volts), Some(newtons)) => {
            format!("zero shift: {:+.2} mV ({newtons:+.3} N)", volts * 1e3)
        }
        _ => {
            "zero shift: not measured; read the empty cell before and after the weights".to_owned()
        }
    };
    [hysteresis, repeatability, zero_shift].join("\n")
}

/// The uncertainty by its terms, as far as they are stated; empty without any.
fn budget(details: &CalibrationDetails) -> String {
    let missing = details.uncertainty.not_stated();
    let stated: Vec<UncertaintyTerm> =
        UncertaintyTerm::ALL.into_iter().filter(|term| !missing.contains(term)).collect();
    if !details.uncertainty.is_stated() {
        return String::new();
    }
    let names: String = stated.iter().map(|term| format!(" | {}", term.name())).collect();
    let rows = details.budget.iter().map(|one| {
        let number = |value: Option<f64>| format!("{:.4}", value.unwrap_or_default());
        let mut line = vec![format!("{:.3}", one.force_n), number(one.uncertainty_n)];
        let own = one.terms.iter().filter(|own| stated.contains(&own.term));
        line.extend(own.map(|own| number(own.uncertainty_n)));
        line
    });
    table(&format!("force (N) | u (N){names}"), rows)
}

#[must_use]
pub fn check(result: &WeightCheck) -> String {
    let verdict = if result.is_passed { "passed" } else { "FAILED" };
    let own = result.uncertainty_n.map_or("not stated by the calibration".to_owned(), |sigma| {
        format!("{sigma:.3} N from calibration and weight")
    });
    let mut lines = vec![
        format!("{verdict}: {}", result.sentence),
        format!("  standard uncertainty of this error: {own}"),
    ];
    lines.extend(result.doubts.iter().map(|doubt| format!("- {doubt}")));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::calibration::KnownWeight;
    use palpate_model::units::Volts;

    #[test]
    fn the_page_tells_every_weight_every_curve_and_every_finding() {
        let thesis = Calibration::thesis();
        let details = CalibrationDetails::of(&thesis).unwrap();
        let page = calibration_page(&thesis, Some("id-1"), &details, &["a doubt".into()]);
        for weight in &details.quality.points {
            assert!(page.contains(&format!("{:.1} ", weight.mass_g)), "{}", weight.mass_g);
        }
        for one in &details.candidates {
            assert!(page.contains(&one.name), "{}", one.name);
        }
        for sentence in &details.quality.findings {
            assert!(page.contains(sentence), "{sentence}");
        }
        assert!(page.contains("hysteresis: not measured") && page.contains("- a doubt"));
        assert!(page.contains("digits of the readings") && !page.contains("NaN"));
        assert_eq!(page.matches("in use").count(), 1);
    }

    #[test]
    fn a_straight_line_of_two_points_has_a_page_too() {
        let line = Calibration::linear("line", Volts(1.0), 0.1, Newtons(10.0));
        let details = CalibrationDetails::of(&line).unwrap();
        let page = calibration_page(&line, None, &details, &[]);
        assert!(page.contains("monotone interpolation") && !page.contains("NaN"), "{page}");
        assert!(!picture(&line, &details).contains("NaN"));
    }

    #[test]
    fn a_check_says_what_it_found() {
        let weight = KnownWeight {
            mass_g: 840.0,
            tolerance_g: Some(0.1),
            volts: Volts(2.60),
            tare: Volts(1.28),
            limit_percent: None,
        };
        let text = check(&Calibration::thesis().check(&weight).unwrap());
        assert!(text.starts_with("FAILED: 840 g reads"), "{text}");
        assert!(text.contains("from calibration and weight"), "{text}");
    }
}
