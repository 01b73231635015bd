//! A relaxation modulus as people read it: the numbers first, and every assumption under them.

use super::material::{
    alone, force, in_kpa, indenter_words, kpa, law_words, length, named, specimen_words,
};
use super::property::{NumberInPrint, NumberLine, PropertySections};
use crate::relaxation::{
    RelaxationBudgetRow, RelaxationReport, TermCandidate, TermChoice, UncertainNumber,
};
use palpate_figures::uncertain::{error_alone, significant};

const POISSON: &str = "assumed: Poisson's ratio is the same at all times";
/// Hu, Zhao, Vlassak and Suo, Appl. Phys. Lett. 96 (2010) 121904: the time of flow grows with the square of the contact radius.
const FLOW: &str = "one record cannot tell: a fluid that flows out of the specimen relaxes the force as viscoelasticity does; a second radius tells them apart";

pub(super) fn sections(report: &RelaxationReport) -> PropertySections {
    let lack = report.lack_of_fit.map(|lack| ("lack of fit".to_owned(), lack_words(lack)));
    let instantaneous = match report.exponent {
        Some(_) => "what is faster is extrapolated, as the instantaneous G",
        None => {
            "what relaxes faster is in no number, and the instantaneous G is the sum of the terms"
        }
    };
    let seen = format!("{} s on: {instantaneous}", significant(report.seen_from_s, 2));
    let mut assumptions = named([
        ("seen from", seen),
        ("law", law_words(report.law).to_owned()),
        ("indenter", indenter_words(&report.indenter)),
        ("specimen", specimen_words(&report.specimen)),
        ("record", record_words(report)),
    ]);
    let fractional = "of the fractional Zener model: relaxation and creep by the Mittag-Leffler function of the exponent";
    assumptions.extend(report.exponent.map(|_| ("term".to_owned(), fractional.to_owned())));
    let choice = report.term_choice.as_ref();
    assumptions.extend(choice.map(|choice| ("terms".to_owned(), choice_words(choice))));
    PropertySections {
        title: "Relaxation modulus",
        numbers: number_lines(report),
        warnings: lack.into_iter().collect(),
        assumptions,
        validity: report.validity.clone(),
        budget: report.budget.iter().map(budget_row).collect(),
        not_included: report.not_included.clone(),
        remarks: vec![POISSON, FLOW],
    }
}

fn number_lines(report: &RelaxationReport) -> Vec<NumberLine> {
    let mut lines = vec![
        alone("G instantaneous", in_kpa("", report.instantaneous_mpa)),
        alone("G equilibrium", in_kpa("", report.equilibrium_mpa)),
    ];
    let terms = report.terms.iter().zip(&report.creep.terms).enumerate();
    lines.extend(terms.map(|(index, (term, creep))| NumberLine {
        name: format!("term {}", index + 1),
        numbers: vec![
            in_kpa("G", term.modulus_mpa),
            in_seconds("relaxation time", term.time_s),
            per_kpa(creep.compliance_per_mpa),
            in_seconds("retardation time", creep.time_s),
        ],
    }));
    lines.extend(report.exponent.map(|exponent| NumberLine {
        name: "exponent".to_owned(),
        numbers: vec![NumberInPrint { name: "", number: exponent, unit: "" }],
    }));
    let times = report.modulus.iter().zip(&report.creep.compliance);
    lines.extend(times.map(|(modulus, compliance)| NumberLine {
        name: format!("at {} s", modulus.t_s),
        numbers: vec![in_kpa("G", modulus.mpa), per_kpa(compliance.per_mpa)],
    }));
    lines
}

fn in_seconds(name: &'static str, number: UncertainNumber) -> NumberInPrint {
    NumberInPrint { name, number, unit: "s" }
}

fn per_kpa(per_mpa: UncertainNumber) -> NumberInPrint {
    NumberInPrint { name: "J", number: per_mpa.scaled(1e-3), unit: "/kPa" }
}

fn budget_row(row: &RelaxationBudgetRow) -> Vec<String> {
    let [instantaneous, equilibrium] =
        [row.instantaneous_mpa, row.equilibrium_mpa].map(|mpa| error_alone(kpa(mpa)));
    vec![
        row.source.to_owned(),
        format!("instantaneous {instantaneous} kPa"),
        format!("equilibrium {equilibrium} kPa"),
    ]
}

fn lack_words(residual_over_noise: f64) -> String {
    format!(
        "residuals are {} times the noise; the intervals allow for their autocorrelation, not for a wrong law",
        significant(residual_over_noise, 3),
    )
}

fn choice_words(choice: &TermChoice) -> String {
    let candidate =
        |one: &TermCandidate| format!("{} with {}", significant(one.bic_above, 3), one.terms);
    let candidates: Vec<String> = choice.candidates.iter().map(candidate).collect();
    let refused = choice.refused.as_ref().map(|reason| format!("; more are refused: {reason}"));
    format!(
        "by the Bayesian criterion above its lowest: {}{}",
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
