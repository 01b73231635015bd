//! Storage and loss modulus of the sines of a record: the dynamic stiffness less what machine and moving mass add, over the slope
//! of the contact law (Herbert, Oliver and Pharr, J. Phys. D 41 (2008) 074021).

mod master_curve;
mod sine;

pub use master_curve::{
    MasterCurveError, MasterCurveReport, MasterCurveRequest, MasterPoint, PairReport, SweepReport,
    WilliamsLandelFerryReport, master_curve,
};

use crate::analysed_session;
use crate::compliance::ComplianceCorrection;
use crate::cycles::{self, CycleSource};
use crate::material::{
    ErrorSource, MaterialError, MaterialRequest, PressRecord, ValidityRow, read_press,
    validity_rows,
};
use crate::recordings::is_session;
use crate::relaxation::{
    NoiseError, RelaxationReport, RelaxationRequest, RelaxationTerm, UncertainNumber, relaxation,
};
use crate::source::{RecordStretch, SourceError};
use palpate_indentation::{
    ContactError, ContactLaw, Indenter, Quantity, RelaxationMode, RelaxationModulus, Specimen,
};
use palpate_model::calibration::{Calibration, ForceUncertainty};
use palpate_rheology::cycles::{Sinusoid, SinusoidError, fit_sinusoid};
use serde::Serialize;
use sine::{Moduli, SineContact, SineUncertainty};
use std::path::PathBuf;
use thiserror::Error;

#[derive(Clone, Copy, Debug)]
pub struct DynamicRequest<'a> {
    pub press: &'a MaterialRequest,
    /// Takes all of the record as one sine of this frequency in Hz; `None` takes the sines of a session.
    pub frequency_hz: Option<f64>,
    /// What moves between load cell and specimen, in g.
    pub moving_mass_g: Option<Quantity>,
}

/// Dynamic moduli and all they rest on.
#[derive(Clone, Debug, Serialize)]
pub struct DynamicReport {
    pub source: PathBuf,
    pub property: &'static str,
    pub law: ContactLaw,
    pub indenter: Indenter,
    pub specimen: Specimen,
    pub moving_mass_g: Option<Quantity>,
    /// Of the specimen, in degrees Celsius; `None` where it was not stated.
    pub temperature_c: Option<f64>,
    /// In the order in which they were run.
    pub sines: Vec<DynamicModuli>,
    pub not_included: Vec<&'static str>,
    /// Standard uncertainty of the contact at depth zero, in mm; `None` where it is not known.
    pub contact_error_mm: Option<f64>,
    /// Of the deepest sine.
    pub validity: Vec<ValidityRow>,
    /// Why the relaxation of the same record predicts nothing; `None` where it does.
    pub prediction_refused: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compliance: Option<ComplianceCorrection>,
    #[serde(skip)]
    pub notes: Vec<String>,
    /// The calibration its forces were read with; `None` for a table.
    #[serde(skip)]
    calibration: Option<Calibration>,
}

/// Moduli at one frequency, in MPa.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DynamicModuli {
    pub frequency_hz: f64,
    /// Whole cycles evaluated.
    pub cycles: u32,
    /// Of the probe, from the contact.
    pub depth_mean_mm: f64,
    pub depth_amplitude_mm: f64,
    /// Young's modulus in phase with the depth.
    pub storage_mpa: UncertainNumber,
    /// Young's modulus a quarter of a cycle ahead.
    pub loss_mpa: UncertainNumber,
    pub shear_storage_mpa: UncertainNumber,
    pub shear_loss_mpa: UncertainNumber,
    pub tan_delta: UncertainNumber,
    /// The largest share in the storage modulus first.
    pub budget: Vec<DynamicBudgetRow>,
    /// Shear storage and loss that the relaxation of the same record predicts; `None` beyond what it has seen.
    pub predicted_shear_mpa: Option<[f64; 2]>,
    pub distortion_percent: f64,
    /// What makes the numbers not those of the specimen.
    pub remark: Option<String>,
    /// What one standard uncertainty of each independent error changes, in the order of the errors of its source.
    #[serde(skip)]
    effects: Vec<(&'static str, Moduli)>,
}

/// Standard uncertainties that a source adds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DynamicBudgetRow {
    pub source: &'static str,
    pub storage_mpa: f64,
    pub loss_mpa: f64,
    pub tan_delta: f64,
}

#[derive(Debug, Error)]
pub enum DynamicError {
    #[error(transparent)]
    Press(#[from] MaterialError),
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Contact(#[from] ContactError),
    #[error(transparent)]
    Sine(#[from] SinusoidError),
    #[error(
        "the session has no sine; run a protocol with one, or state the frequency of a record that is one sine"
    )]
    NoSine,
    #[error("the table does not state the frequency of its sine; state it")]
    NoFrequency,
    #[error(
        "a sine does not show where the contact is; state the standard uncertainty of the contact, 0 for exact"
    )]
    ContactFree,
    #[error("{name} is {value}; give {wanted}")]
    Value { name: &'static str, value: f64, wanted: &'static str },
    #[error(
        "at {frequency_hz} Hz the amplitude is {share:.3} of the mean depth from the contact, above {max}, up to which the shrinking of the contact may be left out; press deeper or reduce the amplitude",
        max = sine::AMPLITUDE_OVER_DEPTH_MAX
    )]
    Amplitude { frequency_hz: f64, share: f64 },
    #[error(
        "at {frequency_hz} Hz no specimen is left once machine compliance and moving mass are taken away; check both, and that the compliance is that of the rig that recorded it"
    )]
    TooCompliant { frequency_hz: f64 },
}

/// The dynamic moduli of the sines of a session, or of a record that is one sine.
pub fn dynamic(request: DynamicRequest) -> Result<DynamicReport, DynamicError> {
    measure(request, true)
}

/// The same, beside what the relaxation of the record predicts or without it.
fn measure(request: DynamicRequest, is_predicted: bool) -> Result<DynamicReport, DynamicError> {
    let press = request.press;
    check(request)?;
    let PressRecord { read, compliance, specimen } = read_press(press, RecordStretch::RampHold)?;
    let contact_error_mm = match press.contact {
        ErrorSource::Recorded => read.signal.as_ref().map(|signal| signal.contact_error_mm),
        ErrorSource::Stated(error_mm) => Some(error_mm),
        ErrorSource::Free => return Err(DynamicError::ContactFree),
    };
    let source = read_sines(request)?;
    let calibration = read.calibration.as_ref().and_then(|one| ForceUncertainty::of(one).ok());
    let applied = compliance.as_ref().filter(|one| one.is_applied);
    let uncertainty = SineUncertainty {
        contact_error_mm,
        calibration: calibration.filter(ForceUncertainty::is_stated),
        compliance_error_mm_per_n: applied.map(|one| one.std_error_mm_per_n),
        moving_mass_error_g: request.moving_mass_g.map(|mass| mass.standard_uncertainty),
    };
    let predicted = is_predicted.then(|| relaxation(RelaxationRequest { press, family: None }));
    let (predicted, refused) = match predicted {
        Some(Ok(report)) => (Some(report), None),
        Some(Err(reason)) => (None, Some(reason.to_string())),
        None => (None, None),
    };
    let mut notes = read.notes;
    let mut sines = Vec::new();
    let mut deepest = 0.0f64;
    for (frequency_hz, range) in &source.sines {
        let found = match fit_sinusoid(&source.samples[range.clone()], *frequency_hz) {
            Ok(found) => found,
            Err(err) if source.sines.len() == 1 => return Err(err.into()),
            Err(err) => {
                notes.push(format!("the sine at {frequency_hz} Hz is left out: {err}"));
                continue;
            }
        };
        let offset = source.contact_offsets.get(range.start).map_or(0.0, |offset| offset.0);
        let shift = read.signal.as_ref().map_or(0.0, |signal| signal.contact_shift_mm);
        let sine = SineContact {
            law: press.law,
            indenter: press.indenter,
            specimen,
            stiffness_n_per_mm: [found.storage.value, found.loss.value],
            frequency_hz: *frequency_hz,
            depth_mm: found.depth_mean.0 - offset - shift,
            force_n: found.force_mean.0,
            compliance_mm_per_n: applied.map_or(0.0, |one| one.mm_per_n),
            moving_mass_g: request.moving_mass_g.map_or(0.0, |mass| mass.value),
        };
        let row = row(&sine, &found, &uncertainty, predicted.as_ref())?;
        deepest = deepest.max(row.depth_mean_mm + row.depth_amplitude_mm);
        sines.push(row);
    }
    if sines.is_empty() {
        return Err(DynamicError::NoSine);
    }
    let validity = press.law.validity(&press.indenter, &specimen, deepest)?;
    Ok(DynamicReport {
        source: press.source.clone(),
        property: "dynamic",
        law: press.law,
        indenter: press.indenter,
        specimen,
        moving_mass_g: request.moving_mass_g,
        sines,
        not_included: uncertainty.not_included(),
        contact_error_mm,
        validity: validity_rows(&validity),
        prediction_refused: refused,
        compliance,
        notes,
        calibration: read.calibration,
        temperature_c: source.temperature_c,
    })
}

fn check(request: DynamicRequest) -> Result<(), DynamicError> {
    let given = |name, value: f64, is_valid: bool, wanted| match is_valid {
        true => Ok(()),
        false => Err(DynamicError::Value { name, value, wanted }),
    };
    if let Some(mass) = request.moving_mass_g {
        let [value, error] = [mass.value, mass.standard_uncertainty];
        given("the moving mass", value, value >= 0.0, "grams, not below 0")?;
        let name = "the standard uncertainty of the moving mass";
        given(name, error, error >= 0.0, "grams, not below 0")?;
    }
    if let ErrorSource::Stated(error) = request.press.contact {
        let name = "the standard uncertainty of the contact";
        given(name, error, error >= 0.0, "mm, not below 0")?;
    }
    Ok(())
}

/// Every sine with its samples; without forces that do not count.
fn read_sines(request: DynamicRequest) -> Result<CycleSource, DynamicError> {
    let press = request.press;
    let (path, analysis) = (press.source.as_path(), press.analysis.as_deref());
    if !is_session(path) {
        let mut source = cycles::read(path, press.columns.as_ref())?;
        let frequency = request.frequency_hz.ok_or(DynamicError::NoFrequency)?;
        source.sines = vec![(frequency, 0..source.samples.len())];
        return Ok(source);
    }
    let mut session = analysed_session::open(path, analysis)?;
    session.blank();
    let mut source = cycles::of_session(&session.edited.session)?;
    if let Some(frequency) = request.frequency_hz {
        source.sines = vec![(frequency, 0..source.samples.len())];
    }
    match source.sines.is_empty() {
        true => Err(DynamicError::NoSine),
        false => Ok(source),
    }
}

fn row(
    sine: &SineContact,
    found: &Sinusoid,
    uncertainty: &SineUncertainty,
    relaxation: Option<&RelaxationReport>,
) -> Result<DynamicModuli, DynamicError> {
    let amplitude = found.depth_amplitude.0;
    sine.check_amplitude(amplitude)?;
    let values = sine.moduli()?;
    let errors = uncertainty.effects(sine, found)?;
    // The first source are the residuals.
    let noise =
        |number: usize| NoiseError { standard_error: errors[0].1[number], freedom: found.freedom };
    let combined = |number: usize| {
        let variance: f64 = errors.iter().map(|(_, effect)| effect[number].powi(2)).sum();
        UncertainNumber::new(values[number], variance.sqrt(), noise(number))
    };
    // The errors of a source stand together.
    let budget_row = |errors: &[(&'static str, Moduli)]| {
        let effect = sine::root_of_squares(errors);
        DynamicBudgetRow {
            source: errors[0].0,
            storage_mpa: effect[0],
            loss_mpa: effect[1],
            tan_delta: effect[4],
        }
    };
    let of_sources = errors.chunk_by(|(one, _), (other, _)| one == other);
    let mut budget: Vec<DynamicBudgetRow> = of_sources.map(budget_row).collect();
    budget.sort_by(|a, b| b.storage_mpa.total_cmp(&a.storage_mpa));
    Ok(DynamicModuli {
        frequency_hz: sine.frequency_hz,
        cycles: found.cycles,
        depth_mean_mm: sine.probe_depth(),
        depth_amplitude_mm: amplitude,
        storage_mpa: combined(0),
        loss_mpa: combined(1),
        shear_storage_mpa: combined(2),
        shear_loss_mpa: combined(3),
        tan_delta: combined(4),
        budget,
        predicted_shear_mpa: relaxation.and_then(|report| predict(report, sine.frequency_hz)),
        distortion_percent: found.distortion_percent,
        remark: found.remark(),
        effects: errors,
    })
}

/// A sine at `f` asks for the times about `1 / (2 pi f)`.
fn predict(report: &RelaxationReport, frequency_hz: f64) -> Option<[f64; 2]> {
    let time = 1.0 / (std::f64::consts::TAU * frequency_hz);
    let is_seen = (report.seen_from_s..=report.record_s).contains(&time);
    let term = |term: &RelaxationTerm| RelaxationMode {
        modulus_mpa: term.modulus_mpa.value,
        time_secs: term.time_s.value,
    };
    let modulus = RelaxationModulus {
        equilibrium_mpa: report.equilibrium_mpa.value,
        terms: report.terms.iter().map(term).collect(),
        exponent: report.exponent.map_or(1.0, |exponent| exponent.value),
    };
    is_seen.then(|| modulus.dynamic_moduli(frequency_hz))
}
