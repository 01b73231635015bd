//! Young's modulus of a recorded unloading by the method of Oliver and Pharr, with what makes it uncertain.

use crate::material::{
    END_SHARE, MaterialError, MaterialRequest, PressRecord, fitted_points, read_press,
    validity_rows, zero_scatter,
};
use crate::press_modulus::{ModulusBudget, PressModulus};
use crate::source::{FitSource, RecordStretch};
use palpate_indentation::{
    LoadingKnowledge, LoadingSample, UnloadingFit, UnloadingFitError, fit_unloading,
};
use palpate_model::calibration::ForceUncertainty;
use palpate_model::units::Newtons;
use serde::Serialize;
use thiserror::Error;

/// A modulus of an unloading and all it rests on.
#[derive(Clone, Debug, Serialize)]
pub struct UnloadingReport {
    pub property: &'static str,
    /// Its depth is where the unloading begins, its samples are those of the part that was fitted.
    #[serde(flatten)]
    pub press: PressModulus,
    /// Slope of the unloading where it begins, in N/mm.
    pub stiffness_n_per_mm: f64,
    pub exponent: f64,
    /// How deep the contact reaches, in mm.
    pub contact_depth_mm: f64,
    pub contact_area_mm2: f64,
    /// All of the unloading as depths in mm and forces in N, for a plot.
    #[serde(skip)]
    pub unloading: Vec<[f64; 2]>,
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
    let mut budget = ModulusBudget::of(&fit.terms);
    if knowledge.zero_error_newtons.is_none() {
        budget.add("force zero", None);
    }
    budget.add("calibration", calibration_mpa(&read, &fit, &samples, fit_of)?);
    let applied = compliance.as_ref().filter(|one| one.is_applied);
    let bent = applied.map(|applied| {
        let moved = |one: &LoadingSample| LoadingSample {
            depth_mm: one.depth_mm - applied.std_error_mm_per_n * one.force_newtons,
            ..*one
        };
        let other = fit_of(&samples.iter().map(moved).collect::<Vec<_>>())?;
        Ok::<_, UnloadingFitError>((other.modulus_mpa - fit.modulus_mpa).abs())
    });
    budget.add("machine compliance", bent.transpose()?);
    let variance = budget.variance();
    let half = fit.coverage_factor(variance) * variance.sqrt();
    let press = PressModulus {
        source: request.source.clone(),
        indenter: *indenter,
        specimen,
        modulus_mpa: fit.modulus_mpa,
        standard_uncertainty_mpa: variance.sqrt(),
        total95_mpa: [fit.modulus_mpa - half, fit.modulus_mpa + half],
        budget: budget.rows(),
        not_included: budget.not_included,
        samples: fit.fitted.len(),
        depth_mm: samples.first().map_or(0.0, |one| one.depth_mm),
        residual_n: fit.residual_newtons,
        noise_n,
        validity: validity_rows(&fit.validity),
        compliance,
        notes: read.notes,
        curve: fitted_points(&fit.fitted, &fit.residuals_newtons, 0.0),
    };
    Ok(UnloadingReport {
        property: "unloading",
        press,
        stiffness_n_per_mm: fit.stiffness_n_per_mm,
        exponent: fit.exponent,
        contact_depth_mm: fit.contact_depth_mm,
        contact_area_mm2: fit.contact_area_mm2,
        unloading: samples.iter().map(|one| [one.depth_mm, one.force_newtons]).collect(),
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
