//! From derivatives along a path to intervals.
//!
//! Every press has its own initial force and offset, so they are eliminated press by press: with
//! them as the first columns of an orthogonal triangularisation, the rows below theirs hold what the
//! press contributes to the body alone, and the rows of all presses are triangularised together.

use super::noise::{FreeOffsets, MeasurementNoise};
use super::protocol::{ProtocolPath, duration_of};
use super::response::{COLUMNS, DIRECT_MAX, NUISANCES, Press, STEPS_PER_TAU_MIN};
use super::triangle;
use palpate_model::linalg::Triangle;
use palpate_model::units::{Newtons, Seconds};
use palpate_model::viscoelastic::{BodyError, ModifiedKelvin};
use serde::Serialize;
use thiserror::Error;

pub(super) const BODY: usize = COLUMNS - NUISANCES;

/// Names of the parameters of a body, in the order of [`ExpectedPrecision::parameters`].
pub const PARAMETER_NAMES: [&str; BODY] = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig"];

/// Their units, in the same order.
pub const PARAMETER_UNITS: [&str; BODY] = ["s", "N/mm", "N/mm^2", "N/mm^3", "N*s/mm^2"];

/// The 97.5 % point of the normal distribution.
const Z975: f64 = 1.959_963_984_540_054;

/// Nothing could be expected; the text says what to change.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ExpectedError {
    #[error(transparent)]
    Body(#[from] BodyError),
    #[error("the {what} is {value}; give a finite number above zero")]
    BadNumber { what: &'static str, value: f64 },
    #[error(
        "{sample_rate_hz} samples per second over {duration_s:.0} s are too few for a relaxation time of {tau_s} s; take at least {wanted_hz:.0} samples per second"
    )]
    TooCoarse { tau_s: f64, sample_rate_hz: f64, duration_s: f64, wanted_hz: f64 },
    #[error("this protocol cannot separate {names}; add a hold of about 5 tau or a second speed")]
    Inseparable { names: String },
    #[error("the model has no parameter '{name}'; it has {}", PARAMETER_NAMES.join(", "))]
    UnknownParameter { name: String },
    #[error("{name} is zero in this model, so an interval in percent has no meaning")]
    ZeroParameter { name: &'static str },
    #[error(
        "pressing to {depth_mm} mm takes {force_n:.2} N even at {speed_mm_per_s} mm/s, but only {allowed_n} N are allowed; press less deep or allow more force"
    )]
    TooForceful { depth_mm: f64, force_n: f64, speed_mm_per_s: f64, allowed_n: f64 },
    #[error(
        "pressing to {depth_mm} mm at {speed_mm_per_s} mm/s takes more than half of the {allowed_s} s allowed; allow more time or press less deep"
    )]
    TooLittleTime { depth_mm: f64, speed_mm_per_s: f64, allowed_s: f64 },
    #[error(
        "no protocol of up to {longest_s} s determines {name} to {wanted} %; the best protocol found reaches {reached} %; allow more time or reduce the noise"
    )]
    Unreachable { name: &'static str, wanted: f64, reached: String, longest_s: f64 },
}

/// One parameter as a fit of the protocol's record is expected to find it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ExpectedParameter {
    /// One of [`PARAMETER_NAMES`].
    pub name: &'static str,
    /// Value in the assumed body.
    pub value: f64,
    pub unit: &'static str,
    /// Standard deviation of the fitted value.
    pub std_error: f64,
    /// Half-width of the 95 % interval in percent of the value; `None` where the value is zero.
    pub percent: Option<f64>,
}

/// Precision that a fit of the protocol's record is expected to have.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExpectedPrecision {
    /// In the order of [`PARAMETER_NAMES`].
    pub parameters: [ExpectedParameter; BODY],
    /// Lowest force on the path. Below zero the probe would have to pull: real tissue lets go of
    /// it, and the model no longer holds.
    pub force_min: Newtons,
    /// Highest force on the path.
    pub force_max: Newtons,
    /// Time of the protocol, [`ProtocolPath::duration`].
    pub duration: Seconds,
}

/// The intervals that a least-squares fit of every sample, all of equal weight, is expected to have.
pub fn intervals(
    body: &ModifiedKelvin,
    protocol: &ProtocolPath,
    noise: &MeasurementNoise,
    unknowns: FreeOffsets,
) -> Result<ExpectedPrecision, ExpectedError> {
    protocol.check()?;
    noise.check()?;
    body.checked()?;
    let mut shared = Triangle::<BODY>::default();
    let mut slow = [[0.0; BODY]; BODY];
    let mut lengths = [0.0; BODY];
    let mut forces = [f64::INFINITY, f64::NEG_INFINITY];
    for pieces in &protocol.presses {
        let secs = duration_of(pieces);
        check_resolved(body.tau_eps, protocol.sample_rate_hz, secs)?;
        let press =
            Press { body, pieces, sample_rate_hz: protocol.sample_rate_hz, noise, unknowns };
        let sums = PressSums::of(&press, unknowns);
        forces = [forces[0].min(sums.forces[0]), forces[1].max(sums.forces[1])];
        for row in sums.triangle.r.iter().skip(NUISANCES) {
            shared.push(std::array::from_fn(|k| row[NUISANCES + k]));
        }
        for (k, length) in lengths.iter_mut().enumerate() {
            *length += sums.triangle.length_squared(NUISANCES + k);
        }
        sums.add_slow(&mut slow);
    }
    let inverse = triangle::inverse(&shared, &lengths.map(f64::sqrt))
        .map_err(|names| ExpectedError::Inseparable { names })?;
    let mut errors = variances(&inverse, &slow, noise).map(f64::sqrt);
    // The first column is the derivative by log tau.
    errors[0] *= body.tau_eps;
    Ok(ExpectedPrecision::of(body, errors.map(|error| (error, Z975)), forces, protocol))
}

impl ExpectedPrecision {
    /// From standard errors in the order of [`PARAMETER_NAMES`], each with how many of them an interval reaches, and the lowest and
    /// highest force in N.
    pub(super) fn of(
        body: &ModifiedKelvin,
        errors: [(f64, f64); BODY],
        forces: [f64; 2],
        protocol: &ProtocolPath,
    ) -> Self {
        let values = [body.tau_eps, body.mu[0], body.mu[1], body.mu[2], body.tau_sig];
        let parameters = std::array::from_fn(|k| {
            let (std_error, reach) = errors[k];
            let share = reach * std_error / values[k].abs();
            ExpectedParameter {
                name: PARAMETER_NAMES[k],
                value: values[k],
                unit: PARAMETER_UNITS[k],
                std_error,
                percent: share.is_finite().then_some(100.0 * share),
            }
        });
        Self {
            parameters,
            force_min: Newtons(forces[0]),
            force_max: Newtons(forces[1]),
            duration: protocol.duration(),
        }
    }
}

/// Whether sums over a press of this length can be had.
pub(super) fn check_resolved(
    tau_s: f64,
    sample_rate_hz: f64,
    duration_s: f64,
) -> Result<(), ExpectedError> {
    if duration_s * sample_rate_hz <= DIRECT_MAX || tau_s * sample_rate_hz >= STEPS_PER_TAU_MIN {
        return Ok(());
    }
    Err(ExpectedError::TooCoarse {
        tau_s,
        sample_rate_hz,
        duration_s,
        wanted_hz: (STEPS_PER_TAU_MIN / tau_s).ceil(),
    })
}

/// `sigma^2 V V' + sd^2 V V' M V V'` on the diagonal, with `V` the inverse of the triangle and `M`
/// the columns' double sum over the correlation of slow noise.
fn variances(
    inverse: &[[f64; BODY]; BODY],
    slow: &[[f64; BODY]; BODY],
    noise: &MeasurementNoise,
) -> [f64; BODY] {
    let sd = noise.memory.map_or(0.0, |memory| memory.sd.0);
    let bread: [[f64; BODY]; BODY] = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..BODY).map(|k| inverse[i][k] * inverse[j][k]).sum())
    });
    std::array::from_fn(|i| {
        let mut filling = 0.0;
        for j in 0..BODY {
            for k in 0..BODY {
                filling += bread[i][j] * slow[j][k] * bread[i][k];
            }
        }
        noise.white.0.powi(2) * bread[i][i] + sd * sd * filling
    })
}

struct PressSums {
    triangle: Triangle<COLUMNS>,
    /// Double sum of all columns over the correlation of slow noise.
    slow: [[f64; COLUMNS]; COLUMNS],
    /// Lowest and highest force in N.
    forces: [f64; 2],
}

impl PressSums {
    fn of(press: &Press<'_>, unknowns: FreeOffsets) -> Self {
        let mut sums = Self {
            triangle: Triangle::default(),
            slow: [[0.0; COLUMNS]; COLUMNS],
            forces: [0.0; 2],
        };
        let is_slow = press.noise.memory.is_some();
        press.visit(|point| {
            let [low, high] = sums.forces;
            sums.forces = [low.min(point.force), high.max(point.force)];
            let root = point.weight.sqrt();
            if root > 0.0 {
                sums.triangle.push(point.row.map(|value| root * value));
            }
            if is_slow {
                for (i, sums) in sums.slow.iter_mut().enumerate() {
                    for (j, sum) in sums.iter_mut().enumerate() {
                        let pair = point.row[i] * point.lagged[j] + point.lagged[i] * point.row[j];
                        *sum += point.weight * pair;
                    }
                }
            }
        });
        // A known nuisance has a column of zeros; any pivot will do for it.
        for (k, is_unknown) in [unknowns.f0, unknowns.f_offset].into_iter().enumerate() {
            if !is_unknown {
                sums.triangle.r[k][k] = 1.0;
            }
        }
        sums
    }

    /// Adds the double sum of the body's columns with the nuisances projected out of them.
    fn add_slow(&self, total: &mut [[f64; BODY]; BODY]) {
        let r = &self.triangle.r;
        // Body column k less its best combination of nuisances.
        let projected: [[f64; COLUMNS]; BODY] = std::array::from_fn(|k| {
            let column = NUISANCES + k;
            let mut combination = [0.0; COLUMNS];
            combination[column] = 1.0;
            for i in (0..NUISANCES).rev() {
                let known: f64 = (i + 1..NUISANCES).map(|j| r[i][j] * combination[j]).sum();
                combination[i] = (-r[i][column] - known) / r[i][i];
            }
            combination
        });
        for (row, left) in total.iter_mut().zip(&projected) {
            for (sum, right) in row.iter_mut().zip(&projected) {
                for (i, a) in left.iter().enumerate() {
                    for (j, b) in right.iter().enumerate() {
                        *sum += a * self.slow[i][j] * b;
                    }
                }
            }
        }
    }
}
