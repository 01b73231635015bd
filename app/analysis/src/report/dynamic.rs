//! Dynamic moduli as people read them: a table over the frequency first, and every assumption under it.

use super::material::{
    indenter_words, kpa, law_words, length, not_included_line, specimen_words, validity_line,
};
use crate::dynamic::{DynamicBudgetRow, DynamicModuli, DynamicReport};
use crate::relaxation::UncertainNumber;
use palpate_figures::uncertain::{error_alone, significant, with_error};

const POISSON: &str = "assumed: Poisson's ratio is the same at all frequencies";

#[must_use]
pub fn dynamic_text(report: &DynamicReport) -> String {
    let mut lines = Vec::new();
    for sine in &report.sines {
        lines.push(sine_words(sine));
        lines.extend(sine.predicted_shear_mpa.map(predicted_words));
    }
    lines.extend(report.sines.iter().filter_map(|sine| sine.remark.clone()));
    if let Some(reason) = &report.prediction_refused {
        lines.push(format!("not predicted    from the relaxation before: {reason}"));
    }
    lines.push(format!("law              {}", law_words(report.law)));
    lines.push(format!("indenter         {}", indenter_words(&report.indenter)));
    lines.push(format!("specimen         {}", specimen_words(&report.specimen)));
    for sine in &report.sines {
        lines.push(format!(
            "sine             {} Hz, {} cycles, {} about {}, distortion {} %",
            sine.frequency_hz,
            sine.cycles,
            length(sine.depth_amplitude_mm),
            length(sine.depth_mean_mm),
            significant(sine.distortion_percent, 2),
        ));
    }
    lines.extend(report.validity.iter().map(validity_line));
    lines.extend(report.sines.iter().flat_map(budget_words));
    lines.extend(not_included_line(&report.not_included));
    lines.push(POISSON.into());
    lines.join("\n")
}

fn sine_words(sine: &DynamicModuli) -> String {
    let modulus =
        |number: UncertainNumber| with_error(kpa(number.value), kpa(number.standard_uncertainty));
    format!(
        "{:<16} E' {} kPa, E'' {} kPa, G' {} kPa, G'' {} kPa, tan delta {}",
        format!("at {} Hz", sine.frequency_hz),
        modulus(sine.storage_mpa),
        modulus(sine.loss_mpa),
        modulus(sine.shear_storage_mpa),
        modulus(sine.shear_loss_mpa),
        with_error(sine.tan_delta.value, sine.tan_delta.standard_uncertainty),
    )
}

/// Of the sources that add a hundredth of a variance or more.
fn budget_words(sine: &DynamicModuli) -> Vec<String> {
    let is_shown = |row: &&DynamicBudgetRow| {
        let pairs = [
            (row.storage_mpa, sine.storage_mpa),
            (row.loss_mpa, sine.loss_mpa),
            (row.tan_delta, sine.tan_delta),
        ];
        pairs.iter().any(|(part, all)| *part >= 0.1 * all.standard_uncertainty && *part > 0.0)
    };
    let words = |row: &DynamicBudgetRow| {
        format!(
            "uncertainty      {:<8} {:<18} E' {:>8} kPa, E'' {:>8} kPa, tan delta {:>8}",
            format!("{} Hz", sine.frequency_hz),
            row.source,
            error_alone(kpa(row.storage_mpa)),
            error_alone(kpa(row.loss_mpa)),
            error_alone(row.tan_delta),
        )
    };
    sine.budget.iter().filter(is_shown).map(words).collect()
}

fn predicted_words([storage, loss]: [f64; 2]) -> String {
    format!(
        "predicted        G' {} kPa, G'' {} kPa from the relaxation before",
        significant(kpa(storage), 4),
        significant(kpa(loss), 4),
    )
}
