//! Whether a calibration may be relied on today: its age and its rig, and a check with one known weight.

use super::quality::repeatability;
use super::uncertainty::ForceUncertainty;
use super::{Calibration, CalibrationError, Direction, newtons_of};
use crate::units::{Newtons, Volts};
use serde::Serialize;
use thiserror::Error;

/// A warning comes so many days before the end of a calibration's validity.
pub const WARNING_DAYS: i64 = 30;
/// Voltages of the excitation this near, as a share, are the same: bridge amplifiers keep to 0.1 %.
const EXCITATION_SHARE: f64 = 1e-3;
/// Largest error of a known weight in percent. ASTM E4 asks testing machines for 1 % of the force.
pub const CHECK_LIMIT_PERCENT: f64 = 1.0;

/// The rig and cell that a calibration is used with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CalibrationUse<'a> {
    pub rig: &'a str,
    /// Serial number of its cell, where it is known.
    pub cell: Option<&'a str>,
    /// Excitation of the bridge, where it is known.
    pub excitation: Option<Volts>,
    /// Days since the calibration was taken; `None` if it does not say when.
    pub age_days: Option<i64>,
}

/// One known weight on the cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownWeight {
    pub mass_g: f64,
    /// Its tolerance in g, where it is stated.
    pub tolerance_g: Option<f64>,
    pub volts: Volts,
    /// The signal of the empty cell just before.
    pub tare: Volts,
    /// Largest error in percent of the weight; [`CHECK_LIMIT_PERCENT`] if none is given.
    pub limit_percent: Option<f64>,
}

/// Result of a check with a known weight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WeightCheck {
    /// Whether the error is within the limit.
    pub is_passed: bool,
    /// Weight in N.
    pub weight_n: f64,
    /// Force read in N.
    pub force_n: f64,
    /// Force minus weight in N.
    pub error_n: f64,
    /// The same in percent of the weight.
    pub error_percent: f64,
    /// Largest error allowed in N.
    pub limit_n: f64,
    /// Largest error allowed in percent.
    pub limit_percent: f64,
    /// Standard uncertainty in N of the error from calibration and weight, where it is stated.
    pub uncertainty_n: Option<f64>,
    /// One sentence for the operator.
    pub sentence: String,
    /// Reasons to doubt the result, one sentence each.
    pub doubts: Vec<String>,
}

/// A check could not be judged.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WeightCheckError {
    /// The calibration is none.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// A number that cannot be.
    #[error("the {what} of the weight check is {value}; {advice}")]
    Number { what: &'static str, value: f64, advice: &'static str },
}

impl KnownWeight {
    /// Its limit in percent, if its numbers can be.
    fn checked_limit(&self) -> Result<f64, WeightCheckError> {
        let limit_percent = self.limit_percent.unwrap_or(CHECK_LIMIT_PERCENT);
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        for (what, value, is_right, advice) in [
            ("mass", self.mass_g, is_positive(self.mass_g), "give a mass above 0 g"),
            ("limit", limit_percent, is_positive(limit_percent), "give a percentage above 0"),
            ("signal", self.volts.0, self.volts.is_finite(), "read the signal again"),
            (
                "tolerance",
                self.tolerance_g.unwrap_or(0.0),
                self.tolerance_g.is_none_or(|g| g >= 0.0 && g.is_finite()),
                "give 0 g or more",
            ),
            ("tare", self.tare.0, self.tare.is_finite(), "read the empty load cell again"),
        ] {
            if !is_right {
                return Err(WeightCheckError::Number { what, value, advice });
            }
        }
        Ok(limit_percent)
    }
}

impl Calibration {
    /// Why this calibration may not be right for that use, one sentence each; none if nothing speaks
    /// against it.
    pub fn validity_warnings(&self, bench: &CalibrationUse<'_>) -> Vec<String> {
        let mut doubts = Vec::new();
        let mut doubt = |text: String| {
            doubts.push(format!("the calibration \"{}\" {text}", self.name));
        };
        let valid = i64::from(self.valid_days());
        match bench.age_days {
            None => doubt("does not state when it was taken, so its age is unknown; check the calibration with one known weight".into()),
            Some(age) if age < 0 => {
                doubt(format!("is dated {} days in the future; check the clock of this computer", -age));
            }
            Some(age) if age > valid => {
                doubt(format!("is {age} days old but was valid for {valid} days; take a new calibration"));
            }
            Some(age) if age > valid - WARNING_DAYS => {
                doubt(format!("is valid for {} more day(s); plan a new calibration", valid - age));
            }
            Some(_) => {}
        }
        if !self.rig.is_empty() && self.rig != bench.rig {
            doubt(format!(
                "was taken on rig {}, but this is rig {}; take a calibration on this rig",
                self.rig, bench.rig
            ));
        }
        if let Some(cell) = bench.cell.filter(|cell| !self.cell.is_empty() && *cell != self.cell) {
            doubt(format!(
                "is for load cell {}, but load cell {cell} is mounted; take a calibration of the mounted cell",
                self.cell
            ));
        }
        if let (Some(then), Some(now)) = (self.excitation, bench.excitation)
            && (then.0 - now.0).abs() > EXCITATION_SHARE * then.0.abs()
        {
            doubt(format!(
                "was taken at an excitation of {then}, but the excitation is {now} now; restore the excitation or take a new calibration"
            ));
        }
        doubts
    }

    /// Whether the cell can be trusted with a curve at all: within each direction the mean signal must not fall
    /// from a mass to the next by more than one reading repeats itself, nor by more than its last digit. Curves
    /// that do not go through every point would hide such a fall.
    pub fn check_rise(&self) -> Result<(), CalibrationError> {
        let points = self.points()?;
        let spread = repeatability(&points).unwrap_or(Volts(0.0)).0;
        let digit = self.reading_resolution().unwrap_or(Volts(0.0)).0;
        let allowed = spread.max(digit);
        for direction in [Direction::Loading, Direction::Unloading] {
            let mean =
                |point: &super::CalibrationPoint| Some((point.mass_g, point.mean(direction)?.0));
            let taken: Vec<(f64, f64)> = points.iter().filter_map(mean).collect();
            let fall = taken.windows(2).find(|pair| pair[0].1 - pair[1].1 > allowed);
            if let Some(&[(before_g, before_volts), (mass_g, volts)]) = fall {
                return Err(CalibrationError::SignalFalls {
                    mass_g,
                    volts,
                    before_g,
                    before_volts,
                    way: direction.name(),
                });
            }
        }
        Ok(())
    }

    /// Why a check with a weight of that mass in g would tell nothing: the calibration itself knows the force
    /// less well than [`CHECK_LIMIT_PERCENT`]. `None` where the check is possible, or where no uncertainty is stated.
    pub fn check_refusal(&self, mass_g: f64) -> Result<Option<String>, CalibrationError> {
        let uncertainty = ForceUncertainty::of(self)?;
        let limit = |mass_g: f64| CHECK_LIMIT_PERCENT / 100.0 * newtons_of(mass_g).0;
        let sigma = |mass_g: f64| uncertainty.sigma(newtons_of(mass_g)).map(|sigma| sigma.0);
        let Some(own) = sigma(mass_g).filter(|sigma| *sigma > limit(mass_g)) else {
            return Ok(None);
        };
        let heaviest = self.points()?.last().map_or(0.0, |point| point.mass_g);
        // Round masses, which weight sets have: of a cell up to 1 kg every 50 g.
        let step = 10f64.powf(heaviest.log10().floor()) / 20.0;
        let share =
            |mass_g: &f64| sigma(*mass_g).map_or(f64::INFINITY, |sigma| sigma / limit(*mass_g));
        let best = (1..=200)
            .map(|i| f64::from(i) * step)
            .take_while(|mass_g| *mass_g <= heaviest)
            .filter(|mass_g| share(mass_g) <= 1.0)
            .min_by(|a, b| share(a).total_cmp(&share(b)));
        let advice = best.map_or_else(
            || {
                "no weight in the range of this calibration allows a check; take a new calibration"
                    .to_owned()
            },
            |best| {
                format!("use a weight at which the load cell is more sensitive, such as {best} g")
            },
        );
        Ok(Some(format!(
            "the calibration gives the force of {mass_g} g with a standard uncertainty of {own:.3} N, more than the limit of {:.3} N, so a check with this weight proves nothing; {advice}",
            limit(mass_g)
        )))
    }

    /// Whether a known weight reads what it weighs.
    pub fn check(&self, weight: &KnownWeight) -> Result<WeightCheck, WeightCheckError> {
        let limit_percent = weight.checked_limit()?;
        let curve = self.curve()?;
        let uncertainty = ForceUncertainty::of(self)?;
        let true_force = newtons_of(weight.mass_g);
        let zero = curve.volts_from_newtons(Newtons(0.0));
        let force = curve.newtons_from_volts(weight.volts - weight.tare + zero);
        let error = force.0 - true_force.0;
        let limit = limit_percent / 100.0 * true_force.0;
        let own = uncertainty.sigma(true_force).map(|sigma| sigma.0);
        // A rectangular distribution (JCGM 100:2008, 4.3.7).
        let of_weight = weight.tolerance_g.map(|g| newtons_of(g).0 / 3f64.sqrt());
        let sigma = own.map(|own| own.hypot(of_weight.unwrap_or(0.0)));
        let mut doubts = Vec::new();
        if curve.is_extrapolated(true_force) {
            doubts.push(format!(
                "{:.0} g is beyond the weights of the calibration, so the force is extrapolated",
                weight.mass_g
            ));
        }
        if let Some(sigma) = sigma.filter(|sigma| 2.0 * sigma > limit) {
            doubts.push(format!(
                "the standard uncertainty of this force is {sigma:.3} N, too large for a check against a limit of {limit:.3} N; use a weight at which the load cell is more sensitive"
            ));
        }
        let is_passed = error.abs() <= limit;
        let percent = 100.0 * error / true_force.0;
        let sentence = format!(
            "{:.0} g reads {:.3} N instead of {:.3} N; the error of {error:+.3} N ({percent:+.2} %) is {} the limit of {limit_percent} %{}",
            weight.mass_g,
            force.0,
            true_force.0,
            if is_passed { "within" } else { "beyond" },
            if is_passed { "" } else { "; take a new calibration before the next run" },
        );
        Ok(WeightCheck {
            is_passed,
            weight_n: true_force.0,
            force_n: force.0,
            error_n: error,
            error_percent: percent,
            limit_n: limit,
            limit_percent,
            uncertainty_n: sigma,
            sentence,
            doubts,
        })
    }
}
