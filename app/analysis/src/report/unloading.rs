//! The modulus of an unloading as people read it.

use super::material::{force, indenter_words, length, named, press_sections, specimen_words};
use super::property::PropertySections;
use crate::unloading::UnloadingReport;
use palpate_figures::uncertain::significant;

const HALF_SPACE: &str = "elastic: the unloading must be faster than the tissue relaxes, and the specimen much thicker than the contact is wide";

pub(super) fn sections(report: &UnloadingReport) -> PropertySections {
    let press = &report.press;
    let unloading = format!(
        "from {}, {} samples; slope {} N/mm, exponent {}; residuals {}",
        length(press.depth_mm),
        press.samples,
        significant(report.stiffness_n_per_mm, 4),
        significant(report.exponent, 3),
        force(press.residual_n),
    );
    let contact = format!(
        "{} deep, area {} mm²",
        length(report.contact_depth_mm),
        significant(report.contact_area_mm2, 4),
    );
    PropertySections {
        assumptions: named([
            ("method", "Oliver and Pharr (1992) on the unloading, on a half-space".into()),
            ("indenter", indenter_words(&press.indenter)),
            ("specimen", specimen_words(&press.specimen)),
            ("unloading", unloading),
            ("contact", contact),
        ]),
        remarks: vec![HALF_SPACE],
        ..press_sections(press)
    }
}
