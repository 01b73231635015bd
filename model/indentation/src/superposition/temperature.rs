//! What shift factors say of the temperature.

use super::whitening::{Whitening, chi_square_ratio_max};
use std::f64::consts::LN_10;
use thiserror::Error;

/// Molar gas constant in kJ/(mol K), exact in the SI of 2019.
const GAS_CONSTANT: f64 = 8.314_462_618e-3;
const ZERO_CELSIUS_KELVIN: f64 = 273.15;
/// Standard uncertainties in half of a 95 % interval of a normal number.
const COVERAGE: f64 = 1.959_964;
const ROUNDS_MAX: usize = 100;

/// `ln a_T = E / R (1 / T - 1 / T_ref)` with kelvins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrhenius {
    /// `E`, in kJ/mol.
    pub activation_energy: f64,
    pub standard_uncertainty: f64,
}

/// `log10 a_T = -C1 (T - T_ref) / (C2 + T - T_ref)` (Williams, Landel and Ferry, J. Am. Chem. Soc. 77 (1955) 3701).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WilliamsLandelFerry {
    pub c1: f64,
    pub c1_total95: [f64; 2],
    /// In kelvins.
    pub c2: f64,
    pub c2_total95: [f64; 2],
}

/// Why shift factors do not give the numbers of a law.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum LawRefusal {
    #[error(
        "the shift factors depart from it by {ratio:.1} times their uncertainties; take them as they are"
    )]
    Departs { ratio: f64 },
    #[error(
        "not identifiable: two constants need sweeps at three temperatures; add one at another temperature"
    )]
    TooFewTemperatures,
    #[error(
        "not identifiable: the shift factors are straight over the temperature to within their uncertainties; widen the temperatures"
    )]
    Straight,
    #[error(
        "not identifiable: the shift factors change faster far above the reference temperature than near it; take them as they are"
    )]
    Inverse,
}

/// Shift factors of the sweeps apart from the reference.
pub(super) struct ShiftFactors {
    /// Temperatures in kelvins less that of the reference.
    pub differences: Vec<f64>,
    pub reference_kelvin: f64,
    pub ln_shifts: Vec<f64>,
    pub whitening: Whitening,
}

/// The temperature of water's triple point less 0.01 degrees is zero Celsius.
pub(super) fn kelvin_from_celsius(temperature_c: f64) -> f64 {
    temperature_c + ZERO_CELSIUS_KELVIN
}

impl ShiftFactors {
    pub fn arrhenius(&self) -> Result<Arrhenius, LawRefusal> {
        let column: Vec<f64> = self.differences.iter().map(|one| self.of_energy(*one)).collect();
        let triangle = self.whitening.triangle(&[&column, &self.ln_shifts]);
        let (Some(found), Some(covariance)) = (triangle.solve(), triangle.covariance()) else {
            return Err(LawRefusal::TooFewTemperatures);
        };
        self.check(triangle.left_over(), 1)?;
        let [activation_energy, standard_uncertainty] = [found[0], covariance[0][0].sqrt()];
        Ok(Arrhenius { activation_energy, standard_uncertainty })
    }

    /// `ln a_T` of one kJ/mol.
    fn of_energy(&self, difference: f64) -> f64 {
        let (kelvin, reference) = (self.reference_kelvin + difference, self.reference_kelvin);
        -difference / (GAS_CONSTANT * kelvin * reference)
    }

    /// As `ln a_T = -p D / (1 + q D)` with `p = ln(10) C1 / C2` and `q = 1 / C2`, whose `q` is zero where the curve is straight, from
    /// which it begins.
    pub fn williams_landel_ferry(&self) -> Result<WilliamsLandelFerry, LawRefusal> {
        let line: Vec<f64> = self.differences.iter().map(|one| -one).collect();
        let bend: Vec<f64> = line.iter().map(|one| one * one).collect();
        let start = self.whitening.triangle(&[&line, &bend, &self.ln_shifts]);
        // A third temperature bends the line.
        let (Some(_), Some(start)) = (start.solve(), start.combined(&[vec![(0, 1.0)]]).solve())
        else {
            return Err(LawRefusal::TooFewTemperatures);
        };
        let [mut p, mut q] = [start[0], 0.0];
        for _ in 0..ROUNDS_MAX {
            let below = |one: &f64| 1.0 + q * one;
            let by_p: Vec<f64> = self.differences.iter().map(|one| -one / below(one)).collect();
            let by_q: Vec<f64> =
                self.differences.iter().map(|one| p * (one / below(one)).powi(2)).collect();
            let left: Vec<f64> =
                self.ln_shifts.iter().zip(&by_p).map(|(shift, by_p)| shift - p * by_p).collect();
            let triangle = self.whitening.triangle(&[&by_p, &by_q, &left]);
            let (Some(step), Some(covariance)) = (triangle.solve(), triangle.covariance()) else {
                break;
            };
            if step[1].abs() < 1e-9 * covariance[1][1].sqrt() {
                self.check(triangle.left_over(), 2)?;
                return constants([p, q], &covariance);
            }
            // At most half of the way to where the law has no end.
            let room = |one: &f64| (-0.5 * below(one) / (step[1] * one)).max(0.0);
            let rooms = self.differences.iter().filter(|one| step[1] * **one < 0.0).map(room);
            let share = rooms.fold(1.0, f64::min);
            p += share * step[0];
            q += share * step[1];
        }
        Err(LawRefusal::Straight)
    }

    fn check(&self, chi_square: f64, parameters: usize) -> Result<(), LawRefusal> {
        let freedom = self.ln_shifts.len() - parameters;
        let ratio = chi_square / freedom as f64;
        match freedom > 0 && ratio > chi_square_ratio_max(freedom) {
            true => Err(LawRefusal::Departs { ratio: ratio.sqrt() }),
            false => Ok(()),
        }
    }
}

/// `C2` is one over `q`, and `C1` a ratio whose interval is Fieller's (J. R. Stat. Soc. B 16 (1954) 175), which has ends where `q` is not
/// zero.
fn constants([p, q]: [f64; 2], covariance: &[Vec<f64>]) -> Result<WilliamsLandelFerry, LawRefusal> {
    let half = COVERAGE * covariance[1][1].sqrt();
    if q + half < 0.0 {
        return Err(LawRefusal::Inverse);
    }
    if q - half <= 0.0 {
        return Err(LawRefusal::Straight);
    }
    let square = COVERAGE * COVERAGE;
    let below = q * q - square * covariance[1][1];
    let middle = p * q - square * covariance[0][1];
    let root = (middle * middle - below * (p * p - square * covariance[0][0])).max(0.0).sqrt();
    let ends = [middle - root, middle + root].map(|end| end / below / LN_10);
    Ok(WilliamsLandelFerry {
        c1: p / q / LN_10,
        c1_total95: ends,
        c2: 1.0 / q,
        c2_total95: [1.0 / (q + half), 1.0 / (q - half)],
    })
}
