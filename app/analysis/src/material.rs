//! Young's modulus of a recorded press by a contact law, with what makes it uncertain.

use crate::compliance::{ComplianceCorrection, ComplianceCorrections};
use crate::press_modulus::{FittedPoint, ModulusBudget, PressModulus};
use crate::source::{self, FitSource, RecordStretch, SourceError, SourceSelection};
use palpate_indentation::{
    Base, Bounded, ContactLaw, Indenter, LoadingFit, LoadingFitError, LoadingKnowledge,
    LoadingSample, PoissonBasis, Quantity, Specimen, Validity, fit_loading,
};
use palpate_model::calibration::ForceUncertainty;
use palpate_model::units::{Newtons, Volts};
use palpate_rheology::fit::UnloadedMean;
use palpate_tables::import::ColumnNames;
use serde::Serialize;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A press and what is known of it.
#[derive(Debug)]
pub struct MaterialRequest {
    pub source: PathBuf,
    /// Names of the columns of a table without a header.
    pub columns: Option<ColumnNames>,
    /// The analysis that a session is read by.
    pub analysis: Option<String>,
    pub is_rejected_included: bool,
    pub corrections: ComplianceCorrections,
    pub law: ContactLaw,
    pub indenter: Indenter,
    /// `None` takes the thickness that the session measured by touching the base.
    pub thickness_mm: Option<Quantity>,
    pub base: Base,
    pub poisson_ratio: Quantity,
    pub poisson_basis: PoissonBasis,
    /// The loading is taken up to this depth in mm; `None` takes all of it.
    pub depth_max_mm: Option<f64>,
    pub contact: ErrorSource,
    pub force_zero: ErrorSource,
}

/// Where the standard uncertainty of the contact at depth zero, or of the force out of contact, comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ErrorSource {
    /// The session: the touches that found the contact, and the signal out of contact. Of a table the loading alone shows both.
    Recorded,
    /// In mm or N.
    Stated(f64),
    /// The loading alone shows where contact or zero is.
    Free,
}

impl ErrorSource {
    pub(crate) fn or_recorded(self, recorded: Option<f64>) -> Option<f64> {
        match self {
            Self::Recorded => recorded,
            Self::Stated(error) => Some(error),
            Self::Free => None,
        }
    }
}

/// A modulus of a loading and all it rests on.
#[derive(Clone, Debug, Serialize)]
pub struct MaterialReport {
    pub law: ContactLaw,
    /// Its depths count from the contact as fitted.
    #[serde(flatten)]
    pub press: PressModulus,
    /// By how much deeper than found the contact is, in mm.
    pub contact_shift_mm: f64,
    /// Standard uncertainty of the contact as found, in mm; `None` where the loading alone shows it.
    pub contact_error_mm: Option<f64>,
    /// The force out of contact as fitted, in N.
    pub force_zero_n: f64,
    /// Standard uncertainty of the force out of contact before the fit, in N; `None` where the loading alone shows it.
    pub force_zero_error_n: Option<f64>,
    /// From the contact to the deepest sample, in s.
    pub loading_s: f64,
    /// Where residuals are larger than the noise: the moduli of the shallow and the deep half.
    pub lack_of_fit: Option<LoadingLackOfFit>,
}

/// A ratio and up to where the law holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ValidityRow {
    pub ratio: &'static str,
    pub value: f64,
    pub max: f64,
}

/// How a law misses a loading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoadingLackOfFit {
    /// Root mean square of the residuals over the noise.
    pub residual_over_noise: f64,
    /// Moduli in MPa of the shallow and of the deep half alone, with the contact of the whole.
    pub halves_mpa: [f64; 2],
}

#[derive(Debug, Error)]
pub enum MaterialError {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Fit(#[from] LoadingFitError),
    #[error("{reason}; for this indenter and specimen the law holds down to {depth_max_mm} mm")]
    TooDeep { reason: LoadingFitError, depth_max_mm: f64 },
    #[error(
        "the thickness of the specimen is not known; state it, or find the base in the session with the step find-base"
    )]
    NoThickness,
    #[error("a greatest depth of {depth_mm} mm is not possible; give a depth above 0 mm")]
    DepthMax { depth_mm: f64 },
}

/// A mean square of residuals is no chance where it is above the noise's by so many of its standard deviations, `sqrt(2 / n)`
/// of it for `n` samples, and by more than a fifth, as the noise is known to a tenth.
const LACK_OF_FIT_DEVIATIONS: f64 = 5.0;
const LACK_OF_FIT_SHARE: f64 = 0.2;
/// The loading ends where this share of its greatest depth is reached: a slider at rest trembles by a pulse.
pub(crate) const END_SHARE: f64 = 0.998;

/// The modulus of the loading of a session or a table.
pub fn material(request: &MaterialRequest) -> Result<MaterialReport, MaterialError> {
    material_of(read_source(request, RecordStretch::RampHold)?, request)
}

/// The same of a press that is read already.
pub fn material_of(
    read: FitSource,
    request: &MaterialRequest,
) -> Result<MaterialReport, MaterialError> {
    if let Some(depth_mm) = request.depth_max_mm
        && !(depth_mm > 0.0 && depth_mm.is_finite())
    {
        return Err(MaterialError::DepthMax { depth_mm });
    }
    let PressRecord { read, compliance, specimen } = PressRecord::of(read, request)?;
    let loading = Loading::of(&read, request.depth_max_mm);
    let signal = read.signal.as_ref();
    let contact_error_mm =
        request.contact.or_recorded(signal.map(|signal| signal.contact_error_mm));
    let force_zero_error_n = request.force_zero.or_recorded(zero_scatter(&read));
    let knowledge = LoadingKnowledge {
        noise_newtons: loading.noise,
        contact_error_mm,
        zero_error_newtons: force_zero_error_n,
    };
    let (law, indenter) = (request.law, &request.indenter);
    let fit = fit_loading(law, indenter, &specimen, &loading.samples, knowledge)
        .map_err(|reason| too_deep(reason, request, &specimen))?;
    let lack_of_fit = lack_of_fit(&fit, law, (indenter, &specimen), &loading);
    let mut budget = ModulusBudget::of(&fit.terms);
    budget.add("calibration", calibration_mpa(&read, &fit, &loading));
    let applied = compliance.as_ref().filter(|one| one.is_applied);
    let bent = applied.map(|one| compliance_mpa(one, &fit, law, (indenter, &specimen), &loading));
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
        samples: loading.samples.len(),
        depth_mm: loading.deepest() - fit.contact_shift_mm,
        residual_n: fit.residual_newtons,
        noise_n: loading.noise,
        validity: validity_rows(&fit.validity),
        compliance,
        notes: read.notes,
        curve: fitted_points(&loading.samples, &fit.residuals_newtons, fit.contact_shift_mm),
    };
    Ok(MaterialReport {
        law,
        press,
        contact_shift_mm: fit.contact_shift_mm,
        contact_error_mm,
        force_zero_n: fit.force_zero_newtons,
        force_zero_error_n,
        loading_s: loading.secs,
        lack_of_fit,
    })
}

/// A record, corrected as the request wants it, and what was pressed.
pub(crate) struct PressRecord {
    pub read: FitSource,
    pub compliance: Option<ComplianceCorrection>,
    pub specimen: Specimen,
}

pub(crate) fn read_press(
    request: &MaterialRequest,
    stretch: RecordStretch,
) -> Result<PressRecord, MaterialError> {
    PressRecord::of(read_source(request, stretch)?, request)
}

fn read_source(
    request: &MaterialRequest,
    stretch: RecordStretch,
) -> Result<FitSource, SourceError> {
    let wanted = SourceSelection { stretch, is_rejected_included: request.is_rejected_included };
    let (path, analysis) = (request.source.as_path(), request.analysis.as_deref());
    source::read_analysed(path, request.columns.as_ref(), wanted, analysis)
}

impl PressRecord {
    fn of(mut read: FitSource, request: &MaterialRequest) -> Result<Self, MaterialError> {
        let compliance = request.corrections.apply(&mut read).map_err(SourceError::from)?;
        let measured = read.thickness_mm;
        let measured =
            measured.map(|[value, standard_uncertainty]| Quantity { value, standard_uncertainty });
        let thickness_mm = request.thickness_mm.or(measured).ok_or(MaterialError::NoThickness)?;
        let specimen = Specimen {
            thickness_mm,
            base: request.base,
            poisson_ratio: request.poisson_ratio,
            poisson_basis: request.poisson_basis,
        };
        Ok(Self { read, compliance, specimen })
    }
}

/// Samples with their residuals in N, depths from a contact in mm.
pub(crate) fn fitted_points(
    samples: &[LoadingSample],
    residuals: &[f64],
    contact_mm: f64,
) -> Vec<FittedPoint> {
    let point = |(one, residual): (&LoadingSample, &f64)| FittedPoint {
        depth_mm: one.depth_mm - contact_mm,
        force_n: one.force_newtons,
        law_n: one.force_newtons - residual,
    };
    samples.iter().zip(residuals).map(point).collect()
}

/// The thickness in mm that a session measured by touching the base; `None` where it did not, and for a table.
pub fn measured_thickness(source: &Path) -> Result<Option<Quantity>, SourceError> {
    let wanted = SourceSelection { is_rejected_included: true, ..SourceSelection::default() };
    let measured = source::read_analysed(source, None, wanted, None)?.thickness_mm;
    Ok(measured.map(|[value, standard_uncertainty]| Quantity { value, standard_uncertainty }))
}

/// The samples of a press down to its deepest place.
struct Loading {
    samples: Vec<LoadingSample>,
    /// Standard deviation of a force in N, where it is known.
    noise: Option<f64>,
    secs: f64,
}

impl Loading {
    fn of(read: &FitSource, depth_max_mm: Option<f64>) -> Self {
        let shift = read.signal.as_ref().map_or(0.0, |signal| signal.contact_shift_mm);
        let depths = read.samples.iter().map(|one| one.depth.0 - shift);
        let deepest = depths.fold(f64::NEG_INFINITY, f64::max);
        // Depths of a table may begin far above the contact, of which a share says nothing: there the peak alone ends the loading.
        let share = if read.signal.is_some() { END_SHARE } else { 1.0 };
        let end = depth_max_mm.map_or(share * deepest, |max| max.min(share * deepest));
        let count = read.samples.iter().position(|one| one.depth.0 - shift > end);
        let taken = &read.samples[..count.unwrap_or(read.samples.len())];
        // Where a soft cantilever holds the probe, the tissue relaxes and the depth still grows: the ramp ended at the peak.
        let peak = (0..taken.len())
            .filter(|&at| taken[at].is_measured())
            .max_by(|&a, &b| taken[a].force.0.total_cmp(&taken[b].force.0));
        let taken = &taken[..peak.map_or(0, |peak| peak + 1)];
        let known = || taken.iter().filter(|one| one.is_measured());
        let sample = |one: &palpate_rheology::fit::FitSample| LoadingSample {
            depth_mm: one.depth.0 - shift,
            force_newtons: one.force.0,
        };
        let first = taken.iter().find(|one| one.depth.0 > shift);
        let secs = first.zip(taken.last()).map_or(0.0, |(first, last)| last.t.0 - first.t.0);
        Self { samples: known().map(sample).collect(), noise: read.noise_of(taken), secs }
    }

    /// Standard deviation in N of what changes from sample to sample, from second differences: a curve has nearly none.
    fn white_noise(&self) -> f64 {
        let forces = self.samples.windows(3);
        let squares = forces.map(|three| {
            let [a, b, c] = [three[0], three[1], three[2]].map(|one| one.force_newtons);
            (a - 2.0 * b + c).powi(2)
        });
        // The variance of a - 2 b + c is 6 times that of each.
        (squares.sum::<f64>() / (6.0 * self.samples.len() as f64)).sqrt()
    }

    /// Depths and forces from contact and zero as fitted, with so much more compliance of the machine taken out.
    fn behind_contact(&self, fit: &LoadingFit, more_mm_per_n: f64) -> Vec<LoadingSample> {
        let moved = |one: &LoadingSample| LoadingSample {
            depth_mm: one.depth_mm - fit.contact_shift_mm - more_mm_per_n * one.force_newtons,
            force_newtons: one.force_newtons - fit.force_zero_newtons,
        };
        self.samples.iter().map(moved).collect()
    }

    /// What is known once contact and zero are taken as fitted.
    fn all_known(&self) -> LoadingKnowledge {
        LoadingKnowledge {
            noise_newtons: self.noise,
            contact_error_mm: Some(0.0),
            zero_error_newtons: Some(0.0),
        }
    }

    fn deepest(&self) -> f64 {
        self.samples.iter().map(|one| one.depth_mm).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// How far the signal out of contact has been from the zero of the tare, as a root mean square in N: noise of these means is far
/// smaller, so this is what the zero has wandered. `None` where no signal out of contact is known.
pub(crate) fn zero_scatter(read: &FitSource) -> Option<f64> {
    let signal = read.signal.as_ref()?;
    let (curve, first) = (&signal.curve, read.samples.first()?);
    let offset = signal.volts.first()? - curve.volts_from_newtons(first.force).0;
    let force = |one: &UnloadedMean| curve.newtons_from_volts(Volts(one.volts.0 - offset)).0;
    let squares: f64 = signal.unloaded.iter().map(|one| force(one).powi(2)).sum();
    let count = signal.unloaded.len();
    (count > 0).then(|| (squares / count as f64).sqrt())
}

/// A refusal of a loading that reaches beyond the law says how far the law holds.
fn too_deep(
    reason: LoadingFitError,
    request: &MaterialRequest,
    specimen: &Specimen,
) -> MaterialError {
    let LoadingFitError::TooDeep { depth_mm, contact_shift_mm, .. } = reason else {
        return reason.into();
    };
    let is_valid = |depth: f64| request.law.contact(&request.indenter, specimen, depth).is_ok();
    let (mut low, mut high) = (0.0, depth_mm);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if is_valid(middle) { low = middle } else { high = middle }
    }
    let deepest = Some(low + contact_shift_mm).filter(|depth| low > 0.0 && *depth > 0.0);
    match deepest.map(in_four_digits) {
        Some(depth_max_mm) if depth_max_mm > contact_shift_mm => {
            MaterialError::TooDeep { reason, depth_max_mm }
        }
        _ => reason.into(),
    }
}

/// The next depth in mm that is no deeper and has four digits: presses reach from centimetres to nanometres. Above 0.
fn in_four_digits(depth_mm: f64) -> f64 {
    let decimals = 3 - depth_mm.log10().floor() as i32;
    // Division by a power of ten leaves the number that is printed.
    (depth_mm * 10f64.powi(decimals)).floor() / 10f64.powi(decimals)
}

/// Residuals over the noise, where they are larger than by chance.
pub(crate) fn above_noise(residual: f64, noise: f64, samples: usize) -> Option<f64> {
    let over_noise = residual / noise;
    let chance = LACK_OF_FIT_DEVIATIONS * (2.0 / samples as f64).sqrt();
    let is_chance = over_noise.powi(2) <= 1.0 + chance.max(LACK_OF_FIT_SHARE);
    (over_noise.is_finite() && !is_chance).then_some(over_noise)
}

fn lack_of_fit(
    fit: &LoadingFit,
    law: ContactLaw,
    (indenter, specimen): (&Indenter, &Specimen),
    loading: &Loading,
) -> Option<LoadingLackOfFit> {
    let noise = loading.noise.unwrap_or_else(|| loading.white_noise());
    let residual_over_noise = above_noise(fit.residual_newtons, noise, loading.samples.len())?;
    let samples = loading.behind_contact(fit, 0.0);
    let middle = 0.5 * (loading.deepest() - fit.contact_shift_mm);
    let (deep, shallow): (Vec<_>, Vec<_>) =
        samples.into_iter().partition(|one| one.depth_mm > middle);
    let knowledge = loading.all_known();
    let half = |samples: &[LoadingSample]| {
        fit_loading(law, indenter, specimen, samples, knowledge).ok().map(|fit| fit.modulus_mpa)
    };
    Some(LoadingLackOfFit { residual_over_noise, halves_mpa: [half(&shallow)?, half(&deep)?] })
}

/// What errors of the calibration do to the modulus; `None` where nothing is stated of them.
fn calibration_mpa(read: &FitSource, fit: &LoadingFit, loading: &Loading) -> Option<f64> {
    let known = ForceUncertainty::of(read.calibration.as_ref()?).ok()?;
    let shift = |error: usize| {
        let forces = loading.samples.iter();
        fit.shift_by(forces.map(|one| known.shift(error, Newtons(one.force_newtons)).0))
    };
    let squares: f64 = (0..known.errors().count()).map(|error| shift(error).powi(2)).sum();
    known.is_stated().then(|| squares.sqrt())
}

/// What the standard uncertainty of the machine compliance does: it takes a depth from every sample in proportion to its force,
/// which the law turns into a force.
fn compliance_mpa(
    applied: &ComplianceCorrection,
    fit: &LoadingFit,
    law: ContactLaw,
    (indenter, specimen): (&Indenter, &Specimen),
    loading: &Loading,
) -> Result<f64, LoadingFitError> {
    let moved = loading.behind_contact(fit, applied.std_error_mm_per_n);
    let other = fit_loading(law, indenter, specimen, &moved, loading.all_known())?;
    Ok((other.modulus_mpa - fit.modulus_mpa).abs())
}

pub(crate) fn validity_rows(validity: &Validity) -> Vec<ValidityRow> {
    let row = |ratio, Bounded { value, max }: Bounded| ValidityRow { ratio, value, max };
    let rows = [
        validity.depth_over_radius.map(|one| row("depth over tip radius", one)),
        Some(row("contact radius over thickness", validity.radius_over_thickness)),
        Some(row("strain", validity.strain)),
    ];
    rows.into_iter().flatten().collect()
}
