//! Frequency sweeps at several temperatures as one curve: time-temperature superposition.
//!
//! Temperature moves a sweep along the logarithm of the frequency and changes nothing else, or the sweeps are refused. Shift factors
//! come from the overlap of neighbouring sweeps; laws of the temperature are fitted to them afterwards.

mod interpolation;
mod pair;
mod temperature;
#[cfg(test)]
mod tests;
mod whitening;

pub use temperature::{Arrhenius, LawRefusal, WilliamsLandelFerry};

use crate::invalid_value::{InvalidValue, positive};
use pair::{Pair, PairRefusal, PairShift};
use std::fmt;
use temperature::{ShiftFactors, kelvin_from_celsius};
use thiserror::Error;
use whitening::Whitening;

/// Fewer say nothing of the curve between them.
const SINES_MIN: usize = 3;

/// Sines at one temperature.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    pub temperature_c: f64,
    /// From the lowest frequency to the highest.
    pub sines: Vec<SweepSine>,
}

/// Moduli at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepSine {
    pub frequency_hz: f64,
    pub storage_mpa: f64,
    pub loss_mpa: f64,
}

/// One standard uncertainty of an independent source: the relative changes of storage and loss modulus, for each sweep and each of its sines.
pub type ModulusError = Vec<Vec<[f64; 2]>>;

/// Shift factors `a_T`: the moduli at a frequency and a temperature are those at `a_T` times the frequency and the reference temperature.
#[derive(Clone, Debug, PartialEq)]
pub struct MasterCurve {
    /// Natural logarithms, one for each sweep.
    pub ln_shifts: Vec<f64>,
    /// Their covariance; zero with the reference.
    pub covariance: Vec<Vec<f64>>,
    /// Of each sweep with the next.
    pub overlaps: Vec<SweepOverlap>,
    pub arrhenius: Result<Arrhenius, LawRefusal>,
    pub williams_landel_ferry: Result<WilliamsLandelFerry, LawRefusal>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepOverlap {
    /// Sines of the upper sweep that were compared with the lower one.
    pub sines: usize,
    /// Residuals over what the uncertainties give, where they are larger than by chance; the shift factor's uncertainty is as much wider.
    pub lack_of_fit: Option<f64>,
}

/// Where two sweeps are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plot {
    /// Loss factor over the magnitude of the complex modulus (van Gurp and Palmen, Rheol. Bull. 67 (1998) 5), in which no shift appears.
    Wicket,
    /// Both moduli over the shifted frequency.
    Overlap,
}

impl fmt::Display for Plot {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        to.write_str(match self {
            Self::Wicket => "the loss factors at equal magnitude of the complex modulus",
            Self::Overlap => "the moduli at equal shifted frequency",
        })
    }
}

#[derive(Clone, Debug, PartialEq, Error)]
pub enum SuperpositionError {
    #[error(transparent)]
    Value(#[from] InvalidValue),
    #[error("all sweeps are at {temperature_c} °C; take sweeps at two or more temperatures")]
    OneTemperature { temperature_c: f64 },
    #[error("the sweep at {temperature_c} °C has {count} sines; take {SINES_MIN} or more")]
    TooFewSines { temperature_c: f64, count: usize },
    #[error(
        "the sweep at {temperature_c} °C has the frequency {frequency_hz} Hz twice; take a sweep that has each once"
    )]
    RepeatedFrequency { temperature_c: f64, frequency_hz: f64 },
    #[error(
        "the sweeps at {lower_c} and {upper_c} °C do not overlap in two sines or more; widen their frequencies or add a temperature between them"
    )]
    NoOverlap { lower_c: f64, upper_c: f64 },
    #[error(
        "the shift between the sweeps at {lower_c} and {upper_c} °C is not identifiable, because their moduli change too little with the frequency; widen their frequencies"
    )]
    NotIdentifiable { lower_c: f64, upper_c: f64 },
    #[error(
        "the sweeps at {lower_c} and {upper_c} °C are not one curve, so time-temperature superposition does not hold: {plot} differ by {ratio:.1} times what their uncertainties give, as where tissue changes with the temperature; report each sweep by itself"
    )]
    NotOneCurve { lower_c: f64, upper_c: f64, plot: Plot, ratio: f64 },
}

/// A sine in natural logarithms of Hz and MPa.
#[derive(Clone, Copy, Debug)]
struct LogSine {
    ln_frequency: f64,
    /// Storage and loss.
    ln_moduli: [f64; 2],
}

impl LogSine {
    fn ln_magnitude(&self) -> f64 {
        self.ln_moduli[0] + 0.5 * (2.0 * self.ln_loss_factor()).exp().ln_1p()
    }

    /// The square of the loss modulus in that of the complex modulus.
    fn loss_share(&self) -> f64 {
        let square = (2.0 * self.ln_loss_factor()).exp();
        square / (1.0 + square)
    }

    fn ln_loss_factor(&self) -> f64 {
        self.ln_moduli[1] - self.ln_moduli[0]
    }
}

/// The shift factors of sweeps in the order of their temperatures to that of number `reference`.
pub fn master_curve(
    sweeps: &[Sweep],
    errors: &[ModulusError],
    reference: usize,
) -> Result<MasterCurve, SuperpositionError> {
    let curves: Result<Vec<_>, _> = sweeps.iter().map(in_logarithms).collect();
    let curves = curves?;
    let temperatures: Vec<f64> = sweeps.iter().map(|sweep| sweep.temperature_c).collect();
    if let Some(&temperature_c) = temperatures.first()
        && temperatures.iter().all(|one| *one == temperature_c)
    {
        return Err(SuperpositionError::OneTemperature { temperature_c });
    }
    check_errors(&curves, errors)?;
    let shift = |lower: usize| {
        let (places, sweeps) = ([lower, lower + 1], [&curves[lower][..], &curves[lower + 1]]);
        Pair { sweeps, places, errors }
            .shift()
            .map_err(|reason| refusal(reason, [temperatures[lower], temperatures[lower + 1]]))
    };
    let pairs: Result<Vec<PairShift>, _> = (0..curves.len().saturating_sub(1)).map(shift).collect();
    let pairs = pairs?;
    let chains: Vec<Chain> = (0..curves.len()).map(|to| Chain::of(&pairs, reference, to)).collect();
    let covariance: Vec<Vec<f64>> = chains
        .iter()
        .map(|one| chains.iter().map(|other| one.covariance(other)).collect())
        .collect();
    let ln_shifts: Vec<f64> = chains.iter().map(|chain| chain.ln_shift).collect();
    let factors = shift_factors(&temperatures, reference, &ln_shifts, &covariance);
    let unknown = LawRefusal::TooFewTemperatures;
    let overlap =
        |pair: &PairShift| SweepOverlap { sines: pair.sines, lack_of_fit: pair.lack_of_fit };
    Ok(MasterCurve {
        overlaps: pairs.iter().map(overlap).collect(),
        arrhenius: factors.as_ref().ok_or(unknown).and_then(ShiftFactors::arrhenius),
        williams_landel_ferry: factors
            .as_ref()
            .ok_or(unknown)
            .and_then(ShiftFactors::williams_landel_ferry),
        ln_shifts,
        covariance,
    })
}

/// The shifts from one sweep to another, one after the other.
struct Chain {
    ln_shift: f64,
    /// Of every error, then of the interpolation of every pair.
    effects: Vec<f64>,
}

impl Chain {
    fn of(pairs: &[PairShift], from: usize, to: usize) -> Self {
        let errors = pairs.first().map_or(0, |pair| pair.effects.len() - 1);
        let mut chain = Self { ln_shift: 0.0, effects: vec![0.0; errors + pairs.len()] };
        let sign = if to < from { -1.0 } else { 1.0 };
        let between = pairs.iter().enumerate().take(from.max(to)).skip(from.min(to));
        for (number, pair) in between {
            chain.ln_shift += sign * pair.ln_shift;
            let (of_errors, of_interpolation) = pair.effects.split_at(errors);
            for (sum, effect) in chain.effects.iter_mut().zip(of_errors) {
                *sum += sign * effect;
            }
            chain.effects[errors + number] = sign * of_interpolation[0];
        }
        chain
    }

    fn covariance(&self, other: &Self) -> f64 {
        self.effects.iter().zip(&other.effects).map(|(one, other)| one * other).sum()
    }
}

fn shift_factors(
    temperatures_c: &[f64],
    reference: usize,
    ln_shifts: &[f64],
    covariance: &[Vec<f64>],
) -> Option<ShiftFactors> {
    let reference_c = temperatures_c[reference];
    let others: Vec<usize> = (0..temperatures_c.len()).filter(|one| *one != reference).collect();
    let row = |one: &usize| others.iter().map(|other| covariance[*one][*other]).collect();
    Some(ShiftFactors {
        differences: others.iter().map(|one| temperatures_c[*one] - reference_c).collect(),
        reference_kelvin: kelvin_from_celsius(reference_c),
        ln_shifts: others.iter().map(|one| ln_shifts[*one]).collect(),
        whitening: Whitening::of(&others.iter().map(row).collect::<Vec<_>>())?,
    })
}

fn in_logarithms(sweep: &Sweep) -> Result<Vec<LogSine>, SuperpositionError> {
    let (temperature_c, sines) = (sweep.temperature_c, &sweep.sines);
    if sines.len() < SINES_MIN {
        return Err(SuperpositionError::TooFewSines { temperature_c, count: sines.len() });
    }
    if let Some(pair) = sines.windows(2).find(|pair| pair[0].frequency_hz >= pair[1].frequency_hz) {
        let frequency_hz = pair[1].frequency_hz;
        return Err(SuperpositionError::RepeatedFrequency { temperature_c, frequency_hz });
    }
    let sine = |sine: &SweepSine| {
        positive("a frequency", sine.frequency_hz, "a number of Hz above 0")?;
        let wanted = "a sine with a modulus above 0 MPa";
        positive("a storage modulus", sine.storage_mpa, wanted)?;
        positive("a loss modulus", sine.loss_mpa, wanted)?;
        let ln_moduli = [sine.storage_mpa.ln(), sine.loss_mpa.ln()];
        Ok(LogSine { ln_frequency: sine.frequency_hz.ln(), ln_moduli })
    };
    sines.iter().map(sine).collect()
}

/// Every modulus needs an uncertainty, which says how much it counts.
fn check_errors(
    curves: &[Vec<LogSine>],
    errors: &[ModulusError],
) -> Result<(), SuperpositionError> {
    for (sweep, curve) in curves.iter().enumerate() {
        for sine in 0..curve.len() {
            for modulus in 0..2 {
                let squares = errors.iter().map(|error| error[sweep][sine][modulus].powi(2));
                let error = squares.sum::<f64>().sqrt();
                let name = "the relative standard uncertainty of a modulus";
                positive(name, error, "a sine that was measured with a number above 0")?;
            }
        }
    }
    Ok(())
}

fn refusal(reason: PairRefusal, [lower_c, upper_c]: [f64; 2]) -> SuperpositionError {
    match reason {
        PairRefusal::NoOverlap => SuperpositionError::NoOverlap { lower_c, upper_c },
        PairRefusal::NotIdentifiable => SuperpositionError::NotIdentifiable { lower_c, upper_c },
        PairRefusal::NotOneCurve { plot, ratio } => {
            SuperpositionError::NotOneCurve { lower_c, upper_c, plot, ratio }
        }
    }
}
