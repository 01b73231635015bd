//! A modulus as people read it: the number first, and every assumption under it.

use crate::material::{LoadingLackOfFit, MaterialBudgetRow, MaterialReport, ValidityRow};
use palpate_figures::uncertain::{error_alone, significant, with_error};
use palpate_indentation::{
    Base, ContactLaw, Indenter, PoissonBasis, PyramidFaces, Quantity, Specimen,
};

/// What no budget has.
pub const RELAXES: &str = "elastic: tissue that relaxes is stiffer the faster it is pressed, so state the loading time with the modulus";

#[must_use]
pub fn material_text(report: &MaterialReport) -> String {
    let line = |name: &str, words: &str| format!("{name:<17}{words}");
    let mut lines = vec![line(
        "Young's modulus",
        &format!("{}, {}", modulus_words(report), interval_words(report)),
    )];
    lines.extend(report.lack_of_fit.map(|lack| line("lack of fit", &lack_words(lack))));
    lines.extend(assumptions(report).iter().map(|(name, words)| line(name, words)));
    lines.extend(report.validity.iter().map(validity_line));
    lines.extend(report.budget.iter().map(budget_line));
    lines.extend(not_included_line(&report.not_included));
    lines.push(RELAXES.into());
    lines.join("\n")
}

pub(super) fn validity_line(row: &ValidityRow) -> String {
    format!("valid            {} {}, at most {}", row.ratio, significant(row.value, 3), row.max)
}

pub(super) fn budget_line(row: &MaterialBudgetRow) -> String {
    let MaterialBudgetRow { source, percent, .. } = row;
    format!("uncertainty      {source:<18} {:>8} kPa  {percent:>3.0} %", budget_kpa(row))
}

/// Nothing where the budget has everything.
pub(super) fn not_included_line(names: &[&str]) -> Option<String> {
    (!names.is_empty()).then(|| format!("not included     {}", names.join(", ")))
}

/// The modulus with its standard uncertainty.
#[must_use]
pub fn modulus_words(report: &MaterialReport) -> String {
    let modulus = with_error(kpa(report.modulus_mpa), kpa(report.standard_uncertainty_mpa));
    format!("{modulus} kPa")
}

#[must_use]
pub fn interval_words(report: &MaterialReport) -> String {
    let [low, high] = report.total95_mpa.map(|end| significant(kpa(end), 4));
    format!("95 % interval {low} to {high} kPa")
}

/// What the modulus rests on: a name and its words each.
#[must_use]
pub fn assumptions(report: &MaterialReport) -> Vec<(&'static str, String)> {
    vec![
        ("law", law_words(report.law).to_owned()),
        ("indenter", indenter_words(&report.indenter)),
        ("specimen", specimen_words(&report.specimen)),
        ("loading", loading_words(report)),
        ("contact", contact_words(report)),
        ("force zero", zero_words(report)),
    ]
}

/// Standard uncertainty in kPa that a source adds.
#[must_use]
pub fn budget_kpa(row: &MaterialBudgetRow) -> String {
    error_alone(kpa(row.mpa))
}

pub(super) fn kpa(mpa: f64) -> f64 {
    1e3 * mpa
}

/// How the law misses the loading.
#[must_use]
pub fn lack_words(lack: LoadingLackOfFit) -> String {
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
    let noise = report.noise_n.map(|noise| format!(", noise {}", force(noise)));
    format!(
        "to {} in {} s, {} samples; residuals {}{}",
        length(report.depth_mm),
        significant(report.loading_s, 3),
        report.samples,
        force(report.residual_n),
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
