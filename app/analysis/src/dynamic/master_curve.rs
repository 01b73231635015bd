//! Sweeps of sessions at several temperatures as one curve.

use super::sine::{CALIBRATION, CONTACT, RESIDUALS, SHRINKING_CONTACT};
use super::{DynamicError, DynamicModuli, DynamicReport, DynamicRequest, measure};
use crate::relaxation::UncertainNumber;
use palpate_indentation::{
    ContactLaw, Indenter, LawRefusal, MasterCurve, ModulusError, ModulusTerm, Specimen,
    SuperpositionError, Sweep, SweepSine, WilliamsLandelFerry,
};
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::LN_10;
use std::path::PathBuf;
use thiserror::Error;

#[derive(Debug)]
pub struct MasterCurveRequest<'a> {
    /// One for each session.
    pub sweeps: Vec<DynamicRequest<'a>>,
    /// That of one of the sessions; `None` takes the middle one.
    pub reference_temperature_c: Option<f64>,
}

/// One curve at a reference temperature and all it rests on.
#[derive(Clone, Debug, Serialize)]
pub struct MasterCurveReport {
    pub property: &'static str,
    pub law: ContactLaw,
    pub indenter: Indenter,
    /// Of the session at the reference temperature.
    pub specimen: Specimen,
    pub reference_temperature_c: f64,
    /// From the coldest to the warmest.
    pub sweeps: Vec<SweepReport>,
    /// Of each sweep with the next.
    pub pairs: Vec<PairReport>,
    pub activation_energy_kj_per_mol: Option<UncertainNumber>,
    /// Why there is no activation energy.
    pub activation_energy_refused: Option<String>,
    pub williams_landel_ferry: Option<WilliamsLandelFerryReport>,
    /// Why there are no such constants.
    pub williams_landel_ferry_refused: Option<String>,
    /// From the lowest reduced frequency to the highest.
    pub curve: Vec<MasterPoint>,
    pub not_included: Vec<&'static str>,
    #[serde(skip)]
    pub notes: Vec<String>,
}

/// A sweep with the shift factor `a_T`, by which its frequencies are multiplied.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepReport {
    pub source: PathBuf,
    pub temperature_c: f64,
    pub shift_factor: f64,
    pub shift_factor_total95: [f64; 2],
    pub log10_shift_factor: UncertainNumber,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PairReport {
    pub lower_c: f64,
    pub upper_c: f64,
    /// Sines of the upper sweep that were compared with the lower one.
    pub sines: usize,
    /// Residuals over what the uncertainties give, where they are larger than by chance.
    pub lack_of_fit: Option<f64>,
}

/// Constants of `log10 a_T = -C1 (T - T_ref) / (C2 + T - T_ref)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WilliamsLandelFerryReport {
    pub c1: f64,
    pub c1_total95: [f64; 2],
    pub c2_kelvin: f64,
    pub c2_total95: [f64; 2],
}

/// Young's moduli at a frequency of the curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MasterPoint {
    /// Shift factor times the frequency that was run.
    pub reduced_frequency_hz: f64,
    pub frequency_hz: f64,
    pub temperature_c: f64,
    pub storage_mpa: UncertainNumber,
    pub loss_mpa: UncertainNumber,
    pub tan_delta: UncertainNumber,
}

#[derive(Debug, Error)]
pub enum MasterCurveError {
    #[error("{}: {reason}", path.display())]
    Sweep { path: PathBuf, reason: Box<DynamicError> },
    #[error("a master curve needs sessions at two or more temperatures, not one; give more")]
    OneSession,
    #[error("{} is given twice; give it once", .0.display())]
    Twice(PathBuf),
    #[error(
        "{} has no temperature of its specimen; give a session that was recorded with the metadata entry specimen.temperature_c",
        .0.display()
    )]
    NoTemperature(PathBuf),
    #[error("no session is at {reference_c} °C; choose the reference from {temperatures}")]
    Reference { reference_c: f64, temperatures: String },
    #[error(transparent)]
    Superposition(#[from] SuperpositionError),
}

/// The dynamic moduli of every session, and what their sweeps are at one temperature.
pub fn master_curve(request: &MasterCurveRequest) -> Result<MasterCurveReport, MasterCurveError> {
    if request.sweeps.len() < 2 {
        return Err(MasterCurveError::OneSession);
    }
    let mut measured: Vec<MeasuredSweep> = Vec::new();
    for sweep in &request.sweeps {
        let path = &sweep.press.source;
        if measured.iter().any(|one| one.report.source == *path) {
            return Err(MasterCurveError::Twice(path.clone()));
        }
        let report = measure(*sweep, false).map_err(|reason| MasterCurveError::Sweep {
            path: path.clone(),
            reason: Box::new(reason),
        })?;
        measured.push(MeasuredSweep::of(report, sweep.press.thickness_mm.is_some())?);
    }
    superpose(measured, request.reference_temperature_c)
}

/// The sines of a session that are those of its specimen.
struct MeasuredSweep {
    report: DynamicReport,
    temperature_c: f64,
    is_thickness_shared: bool,
}

impl MeasuredSweep {
    fn of(mut report: DynamicReport, is_thickness_shared: bool) -> Result<Self, MasterCurveError> {
        let Some(temperature_c) = report.temperature_c else {
            return Err(MasterCurveError::NoTemperature(report.source));
        };
        let (sines, left_out): (Vec<_>, Vec<_>) =
            report.sines.into_iter().partition(|sine| sine.remark.is_none());
        let note = |sine: &DynamicModuli| {
            let (frequency_hz, remark) = (sine.frequency_hz, sine.remark.as_deref());
            format!("the sine at {frequency_hz} Hz is left out: {}", remark.unwrap_or_default())
        };
        report.notes.extend(left_out.iter().map(note));
        report.sines = sines;
        report.sines.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
        Ok(Self { report, temperature_c, is_thickness_shared })
    }

    fn sweep(&self) -> Sweep {
        let sine = |sine: &DynamicModuli| SweepSine {
            frequency_hz: sine.frequency_hz,
            storage_mpa: sine.storage_mpa.value,
            loss_mpa: sine.loss_mpa.value,
        };
        let sines = self.report.sines.iter().map(sine).collect();
        Sweep { temperature_c: self.temperature_c, sines }
    }
}

fn superpose(
    mut measured: Vec<MeasuredSweep>,
    reference_temperature_c: Option<f64>,
) -> Result<MasterCurveReport, MasterCurveError> {
    measured.sort_by(|a, b| a.temperature_c.total_cmp(&b.temperature_c));
    let temperatures: Vec<f64> = measured.iter().map(|one| one.temperature_c).collect();
    let reference = match reference_temperature_c {
        None => measured.len() / 2,
        Some(wanted) => temperatures.iter().position(|one| *one == wanted).ok_or_else(|| {
            let temperatures: Vec<String> =
                temperatures.iter().map(|one| format!("{one} °C")).collect();
            let temperatures = temperatures.join(", ");
            MasterCurveError::Reference { reference_c: wanted, temperatures }
        })?,
    };
    let sweeps: Vec<Sweep> = measured.iter().map(MeasuredSweep::sweep).collect();
    let found = palpate_indentation::master_curve(&sweeps, &modulus_errors(&measured), reference)?;
    let mut curve: Vec<MasterPoint> = measured
        .iter()
        .zip(&found.ln_shifts)
        .flat_map(|(one, shift)| points(one, *shift))
        .collect();
    curve.sort_by(|a, b| a.reduced_frequency_hz.total_cmp(&b.reduced_frequency_hz));
    let first = &measured[reference].report;
    let mut not_included: Vec<&'static str> = Vec::new();
    for source in measured.iter().flat_map(|one| &one.report.not_included) {
        if !not_included.contains(source) {
            not_included.push(source);
        }
    }
    let (energy, energy_refused) = split(
        found
            .arrhenius
            .map(|law| UncertainNumber::normal(law.activation_energy, law.standard_uncertainty)),
    );
    let (constants, constants_refused) = split(found.williams_landel_ferry.map(constants));
    Ok(MasterCurveReport {
        property: "master-curve",
        law: first.law,
        indenter: first.indenter,
        specimen: first.specimen,
        reference_temperature_c: temperatures[reference],
        sweeps: sweep_reports(&measured, &found),
        pairs: pair_reports(&temperatures, &found),
        activation_energy_kj_per_mol: energy,
        activation_energy_refused: energy_refused,
        williams_landel_ferry: constants,
        williams_landel_ferry_refused: constants_refused,
        curve,
        not_included,
        notes: notes(measured),
    })
}

/// Which moduli one error changes: those of a sine of a session, of a session, or all.
type ErrorScope = (Option<usize>, Option<usize>);

/// The independent errors of all sessions. Residuals belong to a sine, the contact to a session, as does a thickness that a session
/// measured; the indenter, Poisson's ratio, machine and calibration are the same in all, so that they hardly move a shift factor.
fn modulus_errors(measured: &[MeasuredSweep]) -> Vec<ModulusError> {
    let is_one_calibration =
        measured.windows(2).all(|pair| pair[0].report.calibration == pair[1].report.calibration);
    let none: ModulusError =
        measured.iter().map(|one| vec![[0.0; 2]; one.report.sines.len()]).collect();
    let mut errors: BTreeMap<(&'static str, usize, ErrorScope), ModulusError> = BTreeMap::new();
    for (place, one) in measured.iter().enumerate() {
        for (number, sine) in one.report.sines.iter().enumerate() {
            let mut seen: BTreeMap<&'static str, usize> = BTreeMap::new();
            for (source, effect) in &sine.effects {
                let scope = match *source {
                    RESIDUALS => (Some(place), Some(number)),
                    CONTACT | SHRINKING_CONTACT => (Some(place), None),
                    CALIBRATION if !is_one_calibration => (Some(place), None),
                    of if of == ModulusTerm::Thickness.name() && !one.is_thickness_shared => {
                        (Some(place), None)
                    }
                    _ => (None, None),
                };
                let count = seen.entry(source).or_default();
                let error = errors.entry((source, *count, scope)).or_insert_with(|| none.clone());
                error[place][number] =
                    [effect[0] / sine.storage_mpa.value, effect[1] / sine.loss_mpa.value];
                *count += 1;
            }
        }
    }
    errors.into_values().collect()
}

fn sweep_reports(measured: &[MeasuredSweep], found: &MasterCurve) -> Vec<SweepReport> {
    let report = |(place, one): (usize, &MeasuredSweep)| {
        let (ln_shift, error) = (found.ln_shifts[place], found.covariance[place][place].sqrt());
        let log10_shift_factor = UncertainNumber::normal(ln_shift / LN_10, error / LN_10);
        SweepReport {
            source: one.report.source.clone(),
            temperature_c: one.temperature_c,
            shift_factor: ln_shift.exp(),
            shift_factor_total95: log10_shift_factor.total95.map(|end| 10f64.powf(end)),
            log10_shift_factor,
        }
    };
    measured.iter().enumerate().map(report).collect()
}

fn pair_reports(temperatures: &[f64], found: &MasterCurve) -> Vec<PairReport> {
    let report = |(pair, overlap): (&[f64], &palpate_indentation::SweepOverlap)| PairReport {
        lower_c: pair[0],
        upper_c: pair[1],
        sines: overlap.sines,
        lack_of_fit: overlap.lack_of_fit,
    };
    temperatures.windows(2).zip(&found.overlaps).map(report).collect()
}

fn points(one: &MeasuredSweep, ln_shift: f64) -> Vec<MasterPoint> {
    let point = |sine: &DynamicModuli| MasterPoint {
        reduced_frequency_hz: sine.frequency_hz * ln_shift.exp(),
        frequency_hz: sine.frequency_hz,
        temperature_c: one.temperature_c,
        storage_mpa: sine.storage_mpa,
        loss_mpa: sine.loss_mpa,
        tan_delta: sine.tan_delta,
    };
    one.report.sines.iter().map(point).collect()
}

fn constants(law: WilliamsLandelFerry) -> WilliamsLandelFerryReport {
    WilliamsLandelFerryReport {
        c1: law.c1,
        c1_total95: law.c1_total95,
        c2_kelvin: law.c2,
        c2_total95: law.c2_total95,
    }
}

fn split<Law>(law: Result<Law, LawRefusal>) -> (Option<Law>, Option<String>) {
    match law {
        Ok(law) => (Some(law), None),
        Err(reason) => (None, Some(reason.to_string())),
    }
}

/// Each with the name of its session.
fn notes(measured: Vec<MeasuredSweep>) -> Vec<String> {
    let of_session = |one: MeasuredSweep| {
        let source = one.report.source.display().to_string();
        one.report.notes.into_iter().map(move |note| format!("{source}: {note}"))
    };
    measured.into_iter().flat_map(of_session).collect()
}
