//! A relaxation modulus as people read it: the numbers first, and every assumption under them.

use super::material::{
    force, indenter_words, kpa, law_words, length, not_included_line, specimen_words, validity_line,
};
use crate::relaxation::{RelaxationReport, TermCandidate, TermChoice, UncertainNumber};
use palpate_figures::uncertain::{error_alone, significant, with_error};

const POISSON: &str = "assumed: Poisson's ratio is the same at all times";
/// Hu, Zhao, Vlassak and Suo, Appl. Phys. Lett. 96 (2010) 121904: the time of flow grows with the square of the contact radius.
const FLOW: &str = "one record cannot tell: a fluid that flows out of the specimen relaxes the force as viscoelasticity does; a second radius tells them apart";

#[must_use]
pub fn relaxation_text(report: &RelaxationReport) -> String {
    let mut lines = vec![
        modulus_line("G instantaneous", report.instantaneous_mpa),
        modulus_line("G equilibrium", report.equilibrium_mpa),
    ];
    for (number, term) in report.terms.iter().enumerate() {
        lines.push(format!(
            "{:<16} {} kPa with the relaxation time {} s",
            format!("term {}", number + 1),
            with_uncertainty(scaled(term.modulus_mpa, 1e3)),
            with_uncertainty(term.time_s),
        ));
    }
    lines.extend(report.exponent.map(exponent_words));
    let instantaneous = match report.exponent {
        Some(_) => "what is faster is extrapolated, as the instantaneous G",
        None => {
            "what relaxes faster is in no number, and the instantaneous G is the sum of the terms"
        }
    };
    let seen_from = significant(report.seen_from_s, 2);
    lines.push(format!("seen from        {seen_from} s on: {instantaneous}"));
    let both = report.modulus.iter().zip(&report.creep.compliance);
    lines.extend(both.map(|(modulus, compliance)| {
        format!(
            "{:<16} G {} kPa, J {} /kPa",
            format!("at {} s", modulus.t_s),
            with_uncertainty(scaled(modulus.mpa, 1e3)),
            with_uncertainty(scaled(compliance.per_mpa, 1e-3)),
        )
    }));
    for term in &report.creep.terms {
        lines.push(format!(
            "creep            {} /kPa with the retardation time {} s",
            with_uncertainty(scaled(term.compliance_per_mpa, 1e-3)),
            with_uncertainty(term.time_s),
        ));
    }
    lines.extend(report.lack_of_fit.map(lack_words));
    lines.extend(report.term_choice.as_ref().map(choice_words));
    lines.push(format!("law              {}", law_words(report.law)));
    lines.push(format!("indenter         {}", indenter_words(&report.indenter)));
    lines.push(format!("specimen         {}", specimen_words(&report.specimen)));
    lines.push(format!("record           {}", record_words(report)));
    lines.extend(report.validity.iter().map(validity_line));
    for row in &report.budget {
        lines.push(format!(
            "uncertainty      {:<18} instantaneous {:>8} kPa, equilibrium {:>8} kPa",
            row.source,
            error_alone(kpa(row.instantaneous_mpa)),
            error_alone(kpa(row.equilibrium_mpa)),
        ));
    }
    lines.extend(not_included_line(&report.not_included));
    lines.extend([POISSON, FLOW].map(String::from));
    lines.join("\n")
}

fn scaled(number: UncertainNumber, factor: f64) -> UncertainNumber {
    UncertainNumber {
        value: factor * number.value,
        standard_uncertainty: factor * number.standard_uncertainty,
        total95: number.total95.map(|end| factor * end),
    }
}

fn with_uncertainty(number: UncertainNumber) -> String {
    with_error(number.value, number.standard_uncertainty)
}

fn modulus_line(name: &str, mpa: UncertainNumber) -> String {
    let number = scaled(mpa, 1e3);
    format!(
        "{name:<16} {} kPa, 95 % interval {} to {} kPa",
        with_uncertainty(number),
        significant(number.total95[0], 4),
        significant(number.total95[1], 4),
    )
}

fn exponent_words(exponent: UncertainNumber) -> String {
    format!(
        "exponent         {} of the fractional Zener model: the term relaxes and creeps by the Mittag-Leffler function of this exponent",
        with_uncertainty(exponent)
    )
}

fn lack_words(residual_over_noise: f64) -> String {
    format!(
        "lack of fit      residuals are {} times the noise; the intervals allow for their autocorrelation, not for a wrong law",
        significant(residual_over_noise, 3),
    )
}

fn choice_words(choice: &TermChoice) -> String {
    let candidate =
        |one: &TermCandidate| format!("{} with {}", significant(one.bic_above, 3), one.terms);
    let candidates: Vec<String> = choice.candidates.iter().map(candidate).collect();
    let refused = choice.refused.as_ref().map(|reason| format!("; more are refused: {reason}"));
    format!(
        "number of terms  by the Bayesian criterion above its lowest: {}{}",
        candidates.join(", "),
        refused.unwrap_or_default()
    )
}

fn record_words(report: &RelaxationReport) -> String {
    let noise = report.noise_n.map(|noise| format!(", noise {}", force(noise)));
    format!(
        "to {} in {} s, {} s in all, {} samples worth {} independent ones; residuals {}{}",
        length(report.depth_mm),
        significant(report.ramp_s, 3),
        significant(report.record_s, 3),
        report.samples,
        significant(report.effective_samples, 3),
        force(report.residual_n),
        noise.unwrap_or_default(),
    )
}
