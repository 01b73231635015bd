//! A master curve as people read it: shift factors and laws first, then the curve.

use super::material::{indenter_words, kpa, law_words, specimen_words};
use crate::dynamic::{
    MasterCurveReport, MasterPoint, PairReport, SweepReport, WilliamsLandelFerryReport,
};
use crate::relaxation::UncertainNumber;
use palpate_figures::uncertain::{significant, with_error};

const SHIFT: &str = "assumed: temperature moves the frequencies and leaves the moduli; temperatures are exact, and Poisson's ratio is the same at all";

#[must_use]
pub fn master_curve_text(report: &MasterCurveReport) -> String {
    let reference = report.reference_temperature_c;
    let mut lines = vec![format!("reference        {reference} °C")];
    lines.extend(report.sweeps.iter().map(|sweep| sweep_words(sweep, reference)));
    lines.extend(report.pairs.iter().map(pair_words));
    lines.push(energy_words(report));
    lines.push(constants_words(report));
    lines.extend(report.curve.iter().map(point_words));
    lines.push(format!("law              {}", law_words(report.law)));
    lines.push(format!("indenter         {}", indenter_words(&report.indenter)));
    lines.push(format!("specimen         {}", specimen_words(&report.specimen)));
    if !report.not_included.is_empty() {
        lines.push(format!("not included     {}", report.not_included.join(", ")));
    }
    lines.push(SHIFT.into());
    lines.join("\n")
}

fn sweep_words(sweep: &SweepReport, reference_c: f64) -> String {
    let name = format!("at {} °C", sweep.temperature_c);
    let source = sweep.source.display();
    // Exactly one by definition; another sweep at the same temperature is measured against it.
    let is_reference =
        sweep.temperature_c == reference_c && sweep.log10_shift_factor.standard_uncertainty == 0.0;
    if is_reference {
        return format!("{name:<16} a_T 1, the reference, {source}");
    }
    let log = sweep.log10_shift_factor;
    format!(
        "{name:<16} a_T {}, log10 a_T {}, {source}",
        with_ends(sweep.shift_factor, sweep.shift_factor_total95),
        with_error(log.value, log.standard_uncertainty),
    )
}

fn with_ends(value: f64, ends: [f64; 2]) -> String {
    let [low, high] = ends.map(|end| significant(end, 4));
    format!("{}, 95 % interval {low} to {high}", significant(value, 4))
}

fn pair_words(pair: &PairReport) -> String {
    let lack = match pair.lack_of_fit {
        None => "to within the uncertainties".into(),
        Some(ratio) => format!(
            "but for residuals of {} times the uncertainties; the intervals are as much wider",
            significant(ratio, 3)
        ),
    };
    let (lower, upper) = (pair.lower_c, pair.upper_c);
    format!("one curve        {lower} and {upper} °C, {} sines in the overlap, {lack}", pair.sines)
}

fn energy_words(report: &MasterCurveReport) -> String {
    let law = match (report.activation_energy_kj_per_mol, &report.activation_energy_refused) {
        (Some(energy), _) => {
            let UncertainNumber { value, standard_uncertainty, total95: [low, high] } = energy;
            format!(
                "activation energy {} kJ/mol, 95 % interval {} to {} kJ/mol",
                with_error(value, standard_uncertainty),
                significant(low, 4),
                significant(high, 4),
            )
        }
        (None, reason) => reason.clone().unwrap_or_default(),
    };
    format!("Arrhenius        {law}")
}

fn constants_words(report: &MasterCurveReport) -> String {
    let law = match (report.williams_landel_ferry, &report.williams_landel_ferry_refused) {
        (Some(law), _) => {
            let WilliamsLandelFerryReport { c1, c1_total95, c2_kelvin, c2_total95 } = law;
            format!(
                "C1 {}; C2 in K {}",
                with_ends(c1, c1_total95),
                with_ends(c2_kelvin, c2_total95)
            )
        }
        (None, reason) => reason.clone().unwrap_or_default(),
    };
    format!("WLF              {law}")
}

fn point_words(point: &MasterPoint) -> String {
    let modulus =
        |number: UncertainNumber| with_error(kpa(number.value), kpa(number.standard_uncertainty));
    format!(
        "{:<16} E' {} kPa, E'' {} kPa, tan delta {}, from {} Hz at {} °C",
        format!("at {} Hz", significant(point.reduced_frequency_hz, 4)),
        modulus(point.storage_mpa),
        modulus(point.loss_mpa),
        with_error(point.tan_delta.value, point.tan_delta.standard_uncertainty),
        significant(point.frequency_hz, 4),
        point.temperature_c,
    )
}
