//! The modulus of an unloading as people read it.

use super::material::{
    budget_line, force, indenter_words, kpa, length, not_included_line, specimen_words,
    validity_line,
};
use crate::unloading::UnloadingReport;
use palpate_figures::uncertain::{significant, with_error};

const HALF_SPACE: &str = "elastic: the unloading must be faster than the tissue relaxes, and the specimen much thicker than the contact is wide";

#[must_use]
pub fn unloading_text(report: &UnloadingReport) -> String {
    let mut lines = vec![
        format!(
            "Young's modulus  {} kPa, 95 % interval {} to {} kPa",
            with_error(kpa(report.modulus_mpa), kpa(report.standard_uncertainty_mpa)),
            significant(kpa(report.total95_mpa[0]), 4),
            significant(kpa(report.total95_mpa[1]), 4),
        ),
        "method           Oliver and Pharr (1992) on the unloading, on a half-space".into(),
        format!("indenter         {}", indenter_words(&report.indenter)),
        format!("specimen         {}", specimen_words(&report.specimen)),
        format!(
            "unloading        from {}, {} samples; slope {} N/mm, exponent {}; residuals {}",
            length(report.depth_mm),
            report.samples,
            significant(report.stiffness_n_per_mm, 4),
            significant(report.exponent, 3),
            force(report.residual_n),
        ),
        format!(
            "contact          {} deep, area {} mm²",
            length(report.contact_depth_mm),
            significant(report.contact_area_mm2, 4),
        ),
    ];
    lines.extend(report.validity.iter().map(validity_line));
    lines.extend(report.budget.iter().map(budget_line));
    lines.extend(not_included_line(&report.not_included));
    lines.push(HALF_SPACE.into());
    lines.join("\n")
}
