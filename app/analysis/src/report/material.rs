//! A modulus as people read it, and the words that every property of a press has.

use super::property::{NumberInPrint, NumberLine, PropertySections};
use crate::material::{LoadingLackOfFit, MaterialReport};
use crate::press_modulus::{MaterialBudgetRow, PressModulus};
use crate::relaxation::UncertainNumber;
use palpate_figures::uncertain::{error_alone, significant, with_error};
use palpate_indentation::{
    Base, ContactLaw, Indenter, PoissonBasis, PyramidFaces, Quantity, Specimen,
};

/// What no budget has.
const RELAXES: &str = "elastic: tissue that relaxes is stiffer the faster it is pressed, so state the loading time with the modulus";

pub(super) fn sections(report: &MaterialReport) -> PropertySections {
    let lack = report.lack_of_fit.map(|lack| ("lack of fit".to_owned(), lack_words(lack)));
    PropertySections {
        warnings: lack.into_iter().collect(),
        assumptions: named([
            ("law", law_words(report.law).to_owned()),
            ("indenter", indenter_words(&report.press.indenter)),
            ("specimen", specimen_words(&report.press.specimen)),
            ("loading", loading_words(report)),
            ("contact", contact_words(report)),
            ("force zero", zero_words(report)),
        ]),
        remarks: vec![RELAXES],
        ..press_sections(&report.press)
    }
}

/// What every Young's modulus of a press has.
pub(super) fn press_sections(press: &PressModulus) -> PropertySections {
    let title = "Young's modulus";
    let mpa = UncertainNumber {
        value: press.modulus_mpa,
        standard_uncertainty: press.standard_uncertainty_mpa,
        total95: press.total95_mpa,
    };
    let row = |row: &MaterialBudgetRow| {
        let MaterialBudgetRow { source, mpa, percent } = *row;
        let kpa = format!("{} kPa", error_alone(kpa(mpa)));
        vec![source.to_owned(), kpa, format!("{percent:.0} % of the variance")]
    };
    PropertySections {
        title,
        numbers: vec![alone(title, in_kpa("", mpa))],
        warnings: Vec::new(),
        assumptions: Vec::new(),
        validity: press.validity.clone(),
        budget: press.budget.iter().map(row).collect(),
        not_included: press.not_included.clone(),
        remarks: Vec::new(),
    }
}

pub(super) fn named<const N: usize>(words: [(&str, String); N]) -> Vec<(String, String)> {
    words.map(|(name, words)| (name.to_owned(), words)).into()
}

/// A number that has the line to itself.
pub(super) fn alone(name: &str, number: NumberInPrint) -> NumberLine {
    NumberLine { name: name.to_owned(), numbers: vec![number] }
}

pub(super) fn in_kpa(name: &'static str, mpa: UncertainNumber) -> NumberInPrint {
    NumberInPrint { name, number: mpa.scaled(1e3), unit: "kPa" }
}

pub(super) fn kpa(mpa: f64) -> f64 {
    1e3 * mpa
}

/// How the law misses the loading.
fn lack_words(lack: LoadingLackOfFit) -> String {
    let LoadingLackOfFit { residual_over_noise, halves_mpa: [shallow, deep] } = lack;
    format!(
        "residuals are {} times the noise: the shallow half alone gives {} kPa, the deep half {} kPa; the interval counts the misfit as noise that lasts",
        significant(residual_over_noise, 3),
        significant(kpa(shallow), 4),
        significant(kpa(deep), 4),
    )
}

pub(super) fn law_words(law: ContactLaw) -> &'static str {
    match law {
        ContactLaw::Hertz => "Hertz (1882): a shallow sphere on a half-space",
        ContactLaw::Sneddon => "Sneddon (1965): on a half-space",
        ContactLaw::Layer => "Hayes et al. (1972): on a layer on a rigid base",
    }
}

fn quantity_words(quantity: Quantity) -> String {
    match quantity.standard_uncertainty > 0.0 {
        true => with_error(quantity.value, quantity.standard_uncertainty),
        false => format!("{}, taken as exact", quantity.value),
    }
}

pub(super) fn indenter_words(indenter: &Indenter) -> String {
    match indenter {
        Indenter::FlatPunch { radius_mm } => {
            format!("flat punch, radius in mm {}", quantity_words(*radius_mm))
        }
        Indenter::Sphere { radius_mm } => {
            format!("sphere, radius in mm {}", quantity_words(*radius_mm))
        }
        Indenter::Cone { half_angle_degrees } => {
            format!("cone, half angle in degrees {}", quantity_words(*half_angle_degrees))
        }
        Indenter::Pyramid { faces, half_angle_degrees } => {
            pyramid_words(*faces, *half_angle_degrees)
        }
        Indenter::ChamferedPunch { radius_mm, chamfer_mm } => format!(
            "flat punch, radius in mm {}, chamfer of 45 degrees in mm {}",
            quantity_words(*radius_mm),
            quantity_words(*chamfer_mm)
        ),
        Indenter::RoundedCone { half_angle_degrees, tip_radius_mm } => format!(
            "cone, half angle in degrees {}, {}",
            quantity_words(*half_angle_degrees),
            tip_words(*tip_radius_mm)
        ),
        Indenter::RoundedPyramid { faces, half_angle_degrees, tip_radius_mm } => {
            format!("{}, {}", pyramid_words(*faces, *half_angle_degrees), tip_words(*tip_radius_mm))
        }
    }
}

fn pyramid_words(faces: PyramidFaces, half_angle_degrees: Quantity) -> String {
    let count = match faces {
        PyramidFaces::Three => "three",
        PyramidFaces::Four => "four",
    };
    let angle = quantity_words(half_angle_degrees);
    format!("pyramid of {count} faces as the cone of its area, half angle in degrees {angle}")
}

fn tip_words(tip_radius_mm: Quantity) -> String {
    format!("radius of the tip in mm {}", quantity_words(tip_radius_mm))
}

pub(super) fn specimen_words(specimen: &Specimen) -> String {
    let basis = match specimen.poisson_basis {
        PoissonBasis::Assumed => "assumed",
        PoissonBasis::Measured => "measured",
    };
    let base = match specimen.base {
        Base::Bonded => "bonded to its base",
        Base::Frictionless => "slips on its base",
    };
    format!(
        "thickness in mm {}; {base}; Poisson's ratio {basis}: {}",
        quantity_words(specimen.thickness_mm),
        quantity_words(specimen.poisson_ratio),
    )
}

/// A length in mm, or in um where it is small.
pub(super) fn length(mm: f64) -> String {
    match mm.abs() < 0.1 {
        true => format!("{} µm", significant(1e3 * mm, 4)),
        false => format!("{} mm", significant(mm, 4)),
    }
}

/// A force in N, in mN or uN where it is small.
pub(super) fn force(newtons: f64) -> String {
    match newtons.abs() {
        n if n < 1e-4 => format!("{} µN", significant(1e6 * newtons, 3)),
        n if n < 0.1 => format!("{} mN", significant(1e3 * newtons, 3)),
        _ => format!("{} N", significant(newtons, 3)),
    }
}

fn loading_words(report: &MaterialReport) -> String {
    let noise = report.press.noise_n.map(|noise| format!(", noise {}", force(noise)));
    format!(
        "to {} in {} s, {} samples; residuals {}{}",
        length(report.press.depth_mm),
        significant(report.loading_s, 3),
        report.press.samples,
        force(report.press.residual_n),
        noise.unwrap_or_default(),
    )
}

fn contact_words(report: &MaterialReport) -> String {
    let shift = report.contact_shift_mm;
    let side = if shift < 0.0 { "above" } else { "below" };
    let moved = format!("{} {side} depth zero", length(shift.abs()));
    match report.contact_error_mm {
        Some(0.0) => "at depth zero, taken as exact".into(),
        Some(error) => format!(
            "{moved}, which is {} times the standard uncertainty of {} µm",
            significant(shift.abs() / error, 2),
            error_alone(1e3 * error),
        ),
        None => format!("{moved}, from the loading alone"),
    }
}

fn zero_words(report: &MaterialReport) -> String {
    let zero = report.force_zero_n;
    match report.force_zero_error_n {
        Some(0.0) => "0 N out of contact, taken as exact".into(),
        Some(error) => format!(
            "{} out of contact, which is {} times its standard uncertainty of {}",
            force(zero),
            significant(zero.abs() / error, 2),
            force(error),
        ),
        None => format!("{} out of contact, from the approach alone", force(zero)),
    }
}
