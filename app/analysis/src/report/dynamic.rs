//! Dynamic moduli as people read them: a table over the frequency first, and every assumption under it.

use super::material::{in_kpa, indenter_words, kpa, law_words, length, named, specimen_words};
use super::property::{NamedWords, NumberInPrint, NumberLine, PropertySections};
use crate::dynamic::{DynamicBudgetRow, DynamicModuli, DynamicReport};
use palpate_figures::uncertain::{error_alone, significant};

const POISSON: &str = "assumed: Poisson's ratio is the same at all frequencies";

pub(super) fn sections(report: &DynamicReport) -> PropertySections {
    let remarks = report.sines.iter().filter_map(|sine| Some((at(sine), sine.remark.clone()?)));
    let mut assumptions = named([
        ("law", law_words(report.law).to_owned()),
        ("indenter", indenter_words(&report.indenter)),
        ("specimen", specimen_words(&report.specimen)),
    ]);
    assumptions.extend(report.sines.iter().map(|sine| ("sine".to_owned(), sine_words(sine))));
    assumptions.extend(report.sines.iter().filter_map(predicted_words));
    let refused = report.prediction_refused.as_ref();
    assumptions.extend(refused.map(|reason| {
        ("not predicted".to_owned(), format!("from the relaxation before: {reason}"))
    }));
    PropertySections {
        title: "Dynamic moduli",
        numbers: report.sines.iter().map(number_line).collect(),
        warnings: remarks.collect(),
        assumptions,
        validity: report.validity.clone(),
        budget: report.sines.iter().flat_map(budget_rows).collect(),
        not_included: report.not_included.clone(),
        remarks: vec![POISSON],
    }
}

fn at(sine: &DynamicModuli) -> String {
    format!("at {} Hz", hertz(sine))
}

/// In four digits: that of a session is its controller's to the last one.
fn hertz(sine: &DynamicModuli) -> String {
    let frequency = sine.frequency_hz;
    let rounded: f64 = format!("{frequency:.3e}").parse().unwrap_or(frequency);
    rounded.to_string()
}

/// Young's moduli, by which the sine was measured, before the shear moduli that follow from them.
fn number_line(sine: &DynamicModuli) -> NumberLine {
    NumberLine {
        name: at(sine),
        numbers: vec![
            in_kpa("E'", sine.storage_mpa),
            in_kpa("E''", sine.loss_mpa),
            NumberInPrint { name: "tan delta", number: sine.tan_delta, unit: "" },
            in_kpa("G'", sine.shear_storage_mpa),
            in_kpa("G''", sine.shear_loss_mpa),
        ],
    }
}

fn sine_words(sine: &DynamicModuli) -> String {
    format!(
        "{} Hz, {} cycles, {} about {}, distortion {} %",
        hertz(sine),
        sine.cycles,
        length(sine.depth_amplitude_mm),
        length(sine.depth_mean_mm),
        significant(sine.distortion_percent, 2),
    )
}

/// Of the sources that add a hundredth of a variance or more.
fn budget_rows(sine: &DynamicModuli) -> Vec<Vec<String>> {
    let is_shown = |row: &&DynamicBudgetRow| {
        let pairs = [
            (row.storage_mpa, sine.storage_mpa),
            (row.loss_mpa, sine.loss_mpa),
            (row.tan_delta, sine.tan_delta),
        ];
        pairs.iter().any(|(part, all)| *part >= 0.1 * all.standard_uncertainty && *part > 0.0)
    };
    let cells = |row: &DynamicBudgetRow| {
        vec![
            format!("{} {}", row.source, at(sine)),
            format!("E' {} kPa", error_alone(kpa(row.storage_mpa))),
            format!("E'' {} kPa", error_alone(kpa(row.loss_mpa))),
            format!("tan delta {}", error_alone(row.tan_delta)),
        ]
    };
    sine.budget.iter().filter(is_shown).map(cells).collect()
}

fn predicted_words(sine: &DynamicModuli) -> Option<NamedWords> {
    let [storage, loss] = sine.predicted_shear_mpa?.map(|mpa| significant(kpa(mpa), 4));
    let at = at(sine);
    let words = format!("G' {storage} kPa, G'' {loss} kPa {at} from the relaxation before");
    Some(("predicted".to_owned(), words))
}
