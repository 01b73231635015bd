//! Young's modulus of a recorded unloading by the method of Oliver and Pharr, with what makes it uncertain.

use crate::compliance::ComplianceCorrection;
use crate::material::{
    END_SHARE, MaterialBudgetRow, MaterialError, MaterialRequest, PressRecord, ValidityRow,
    budget_rows, read_press, validity_rows, zero_scatter,
};
use crate::source::{FitSource, RecordStretch};
use palpate_indentation::{
    Indenter, LoadingKnowledge, LoadingSample, Specimen, UnloadingFit, UnloadingFitError,
    fit_unloading,
};
use palpate_model::calibration::ForceUncertainty;
use palpate_model::units::Newtons;
use serde::Serialize;
use std::path::PathBuf;
use thiserror::Error;

/// A modulus of an unloading and all it rests on.
#[derive(Clone, Debug, Serialize)]
pub struct UnloadingReport {
    pub property: &'static str,
    pub source: PathBuf,
    pub indenter: Indenter,
    pub specimen: Specimen,
    /// Young's modulus in MPa, which is N/mm².
    pub modulus_mpa: f64,
    pub standard_uncertainty_mpa: f64,
    pub total95_mpa: [f64; 2],
    /// The largest first.
    pub budget: Vec<MaterialBudgetRow>,
    /// What the budget does not have, in words.
    pub not_included: Vec<&'static str>,
    /// Slope of the unloading where it begins, in N/mm.
    pub stiffness_n_per_mm: f64,
    pub exponent: f64,
    /// Of the deepest sample, in mm.
    pub depth_mm: f64,
    /// How deep the contact reaches, in mm.
    pub contact_depth_mm: f64,
    pub contact_area_mm2: f64,
    /// Samples of the part of the unloading that was fitted.
    pub samples: usize,
    pub residual_n: f64,
    /// Standard deviation of a force in N, where it is known.
    pub noise_n: Option<f64>,
    pub validity: Vec<ValidityRow>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compliance: Option<ComplianceCorrection>,
    #[serde(skip)]
    pub notes: Vec<String>,
}

#[derive(Debug, Error)]
pub enum UnloadingError {
    #[error(transparent)]
    Press(#[from] MaterialError),
    #[error(transparent)]
    Fit(#[from] UnloadingFitError),
    #[error(
        "the area of the contact follows from the depth, and an unloading does not show where depth zero is; give the standard uncertainty of depth zero as contact, 0 for exact"
    )]
    ContactFree,
}

/// The modulus of the unloading of a session or a table. The law of the request is not used: the method stands on a half-space.
pub fn unloading(request: &MaterialRequest) -> Result<UnloadingReport, UnloadingError> {
    let PressRecord { read, compliance, specimen } =
        read_press(request, RecordStretch::WithUnload)?;
    let indenter = &request.indenter;
    let signal = read.signal.as_ref();
    let shift = signal.map_or(0.0, |signal| signal.contact_shift_mm);
    let samples = samples(&read, shift);
    let noise_n = read.noise_of(&read.samples);
    let contact_error_mm = request.contact.or_recorded(signal.map(|one| one.contact_error_mm));
    let knowledge = LoadingKnowledge {
        noise_newtons: noise_n,
        contact_error_mm: Some(contact_error_mm.ok_or(UnloadingError::ContactFree)?),
        zero_error_newtons: request.force_zero.or_recorded(zero_scatter(&read)),
    };
    let fit_of = |samples: &[LoadingSample]| fit_unloading(indenter, &specimen, samples, knowledge);
    let fit = fit_of(&samples)?;
    let mut terms: Vec<(&'static str, f64)> =
        fit.terms.iter().map(|(term, mpa)| (term.name(), *mpa)).collect();
    let mut not_included = Vec::new();
    if knowledge.zero_error_newtons.is_none() {
        not_included.push("force zero");
    }
    match calibration_mpa(&read, &fit, &samples, fit_of)? {
        Some(mpa) => terms.push(("calibration", mpa)),
        None => not_included.push("calibration"),
    }
    match &compliance {
        Some(applied) if applied.is_applied => {
            let moved = |one: &LoadingSample| LoadingSample {
                depth_mm: one.depth_mm - applied.std_error_mm_per_n * one.force_newtons,
                ..*one
            };
            let other = fit_of(&samples.iter().map(moved).collect::<Vec<_>>())?;
            terms.push(("machine compliance", (other.modulus_mpa - fit.modulus_mpa).abs()));
        }
        _ => not_included.push("machine compliance"),
    }
    let variance: f64 = terms.iter().map(|(_, mpa)| mpa * mpa).sum();
    let standard_uncertainty_mpa = variance.sqrt();
    let half = fit.coverage_factor(variance) * standard_uncertainty_mpa;
    Ok(UnloadingReport {
        property: "unloading",
        source: request.source.clone(),
        indenter: *indenter,
        specimen,
        modulus_mpa: fit.modulus_mpa,
        standard_uncertainty_mpa,
        total95_mpa: [fit.modulus_mpa - half, fit.modulus_mpa + half],
        budget: budget_rows(terms, variance),
        not_included,
        stiffness_n_per_mm: fit.stiffness_n_per_mm,
        exponent: fit.exponent,
        depth_mm: samples.first().map_or(0.0, |one| one.depth_mm),
        contact_depth_mm: fit.contact_depth_mm,
        contact_area_mm2: fit.contact_area_mm2,
        samples: fit.samples,
        residual_n: fit.residual_newtons,
        noise_n,
        validity: validity_rows(&fit.validity),
        compliance,
        notes: read.notes,
    })
}

/// From the last place at which the press was at its deepest.
fn samples(read: &FitSource, shift: f64) -> Vec<LoadingSample> {
    let known = read.samples.iter().filter(|one| one.is_measured());
    let all: Vec<LoadingSample> = known
        .map(|one| LoadingSample { depth_mm: one.depth.0 - shift, force_newtons: one.force.0 })
        .collect();
    let deepest = all.iter().map(|one| one.depth_mm).fold(f64::NEG_INFINITY, f64::max);
    let near = all.iter().rposition(|one| one.depth_mm >= END_SHARE * deepest).unwrap_or(0);
    // Up from there to where the way back began.
    let is_higher = |at: &usize| all[at - 1].depth_mm > all[*at].depth_mm;
    let top = (1..=near).rev().take_while(is_higher).last().map_or(near, |at| at - 1);
    all[top..].to_vec()
}

/// What errors of the calibration do to the modulus; `None` where nothing is stated of them.
fn calibration_mpa(
    read: &FitSource,
    fit: &UnloadingFit,
    samples: &[LoadingSample],
    fit_of: impl Fn(&[LoadingSample]) -> Result<UnloadingFit, UnloadingFitError>,
) -> Result<Option<f64>, UnloadingFitError> {
    let known = read.calibration.as_ref().and_then(|one| ForceUncertainty::of(one).ok());
    let Some(known) = known.filter(ForceUncertainty::is_stated) else { return Ok(None) };
    let mut squares = 0.0;
    for error in 0..known.errors().count() {
        let moved = |one: &LoadingSample| LoadingSample {
            force_newtons: one.force_newtons + known.shift(error, Newtons(one.force_newtons)).0,
            ..*one
        };
        let other = fit_of(&samples.iter().map(moved).collect::<Vec<_>>())?;
        squares += (other.modulus_mpa - fit.modulus_mpa).powi(2);
    }
    Ok(Some(squares.sqrt()))
}
