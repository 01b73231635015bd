//! The document of a calibration: what lay on the load cell, what it read, and what else a reader of a
//! force must know. It is never edited, only superseded.

use super::curve::CalibrationCurve;
use super::error::CalibrationError;
use super::kind::CurveKind;
use super::weight_steps::{STANDARD_GRAVITY, WeightStep, newtons_of};
use crate::is_default;
use crate::units::{Newtons, Volts};
use serde::{Deserialize, Serialize};

/// Version of the document's form. The form without a number, of recorded sessions, has only `steps`.
pub const CALIBRATION_FORMAT: u32 = 1;
/// Days for which a calibration is taken as valid: load cells are commonly calibrated once a year.
pub const VALID_DAYS: u32 = 365;
/// Masses this near, in g, are the same: no weight set of a laboratory has a finer one.
const SAME_MASS: f64 = 1e-6;

/// A weight with a name, so that it is known to lie on the cell in several steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedWeight {
    /// As engraved on it.
    pub name: String,
    pub mass_g: f64,
    /// Half-width in g of the range in which the mass surely lies; `None` where it is not stated.
    #[serde(default)]
    pub tolerance_g: Option<f64>,
}

crate::named! {
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum Direction {
        /// Weight after weight is laid on.
        Loading = "loading",
        /// Weight after weight is taken off.
        Unloading = "unloading",
    }
}

/// One way up or down.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationSeries {
    pub direction: Direction,
    /// Which repeat, counted from 1.
    pub repeat: u32,
    /// The steps in the order they were taken.
    pub steps: Vec<SeriesStep>,
}

/// The signal under one load.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SeriesStep {
    /// Total mass on the cell in g.
    pub mass_g: f64,
    /// Names of the weights that lay on it; empty where only the sum is known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weights: Vec<String>,
    pub volts: Volts,
    /// Standard deviation of one sample.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<Volts>,
    /// Samples in the mean.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<u64>,
    /// Slope of the signal in V/s when it was taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slope_v_per_s: Option<f64>,
    /// Time in s waited for the signal to come to rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waited_s: Option<f64>,
}

/// A load-cell calibration as it is kept.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    pub name: String,
    /// Version of the form; 0 where there is none, in sessions recorded before there was one.
    #[serde(default, skip_serializing_if = "is_default")]
    pub format: u32,
    /// When it was taken, RFC 3339; `None` where that is not known.
    #[serde(default)]
    pub taken_at: Option<String>,
    /// The points in order of increasing mass, where only those are known. With `series` it is empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<WeightStep>,
    /// Operator and set-up, or the document that it is copied from.
    #[serde(default)]
    pub source: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub rig: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub cell: String,
    /// Excitation of the bridge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub excitation: Option<Volts>,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub operator: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weights: Vec<NamedWeight>,
    /// Every way up and down, in the order taken.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub series: Vec<CalibrationSeries>,
    /// Signal of the empty cell before the first series.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zero_before: Option<Volts>,
    /// Signal of the empty cell after the last series.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zero_after: Option<Volts>,
    /// Last digit of the readings, where they were written down with so few digits that it matters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Volts>,
    /// The curve through the points; the monotone one where nothing is said.
    #[serde(default, skip_serializing_if = "is_default")]
    pub curve: CurveKind,
    /// Days for which it is valid, [`VALID_DAYS`] where nothing is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_days: Option<u32>,
    /// Id of the calibration that this one takes the place of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supersedes: Option<String>,
}

/// One reading with the series it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationReading {
    pub direction: Direction,
    pub volts: Volts,
    /// Standard deviation of the mean that the noise of its samples explains, where that is known.
    pub noise_of_mean: Option<Volts>,
}

/// All readings under one mass.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationPoint {
    pub mass_g: f64,
    /// Its weight.
    pub newtons: Newtons,
    /// Mean of the means of both directions: a direction read more often counts no more.
    pub volts: Volts,
    pub readings: Vec<CalibrationReading>,
}

impl CalibrationPoint {
    /// Mean signal of one direction, if it was taken.
    pub fn mean(&self, direction: Direction) -> Option<Volts> {
        let volts = |reading: &&CalibrationReading| reading.direction == direction;
        let own: Vec<f64> = self.readings.iter().filter(volts).map(|r| r.volts.0).collect();
        (!own.is_empty()).then(|| Volts(own.iter().sum::<f64>() / own.len() as f64))
    }

    /// Loading minus unloading.
    pub fn hysteresis(&self) -> Option<Volts> {
        Some(self.mean(Direction::Loading)? - self.mean(Direction::Unloading)?)
    }

    fn averaged(mass_g: f64, readings: Vec<CalibrationReading>) -> Self {
        let mut point =
            Self { mass_g, newtons: newtons_of(mass_g), volts: Volts(f64::NAN), readings };
        let means = [Direction::Loading, Direction::Unloading].map(|way| point.mean(way));
        let known: Vec<f64> = means.into_iter().flatten().map(|volts| volts.0).collect();
        point.volts = Volts(known.iter().sum::<f64>() / known.len() as f64);
        point
    }
}

impl Calibration {
    /// The eleven points published for an Entran ELFM-B1-50N in the thesis this project implements
    /// (Nanyang Technological University, force feedback for endoscopic surgery, chapter 3), printed
    /// with two decimals of a volt.
    #[must_use]
    pub fn thesis() -> Self {
        const GRAMS_VOLTS: [(f64, f64); 11] = [
            (0.0, 1.28),
            (140.0, 1.60),
            (240.0, 1.73),
            (340.0, 1.78),
            (440.0, 1.79),
            (540.0, 1.80),
            (640.0, 1.87),
            (740.0, 2.04),
            (840.0, 2.55),
            (940.0, 2.69),
            (1040.0, 2.84),
        ];
        let step = |&(mass_g, volts): &(f64, f64)| WeightStep { mass_g, volts: Volts(volts) };
        Self {
            name: "Thesis load cell".to_owned(),
            steps: GRAMS_VOLTS.iter().map(step).collect(),
            source: "Entran ELFM-B1-50N, 140 g platform and 100 g weights, thesis chapter 3"
                .to_owned(),
            resolution: Some(THESIS_RESOLUTION),
            ..Self::default()
        }
    }

    /// A straight line from `volts_at_zero` with a slope in V/N up to `newtons_max`, as two steps.
    ///
    /// The numbers are not judged here; [`Calibration::curve`] does.
    #[must_use]
    pub fn linear(
        name: &str,
        volts_at_zero: Volts,
        volts_per_newton: f64,
        newtons_max: Newtons,
    ) -> Self {
        let full = WeightStep {
            mass_g: newtons_max.0 / STANDARD_GRAVITY * 1e3,
            volts: Volts(volts_at_zero.0 + volts_per_newton * newtons_max.0),
        };
        let empty = WeightStep { mass_g: 0.0, volts: volts_at_zero };
        Self {
            name: name.to_owned(),
            steps: vec![empty, full],
            source: format!(
                "straight line, {volts_at_zero} at rest, {volts_per_newton} V/N up to {newtons_max}"
            ),
            ..Self::default()
        }
    }

    /// The curve through the points, or what prevents one.
    pub fn curve(&self) -> Result<CalibrationCurve, CalibrationError> {
        self.curve.through(&self.points()?)
    }

    /// All readings by mass, in order of increasing mass; at least two masses, all numbers finite.
    pub fn points(&self) -> Result<Vec<CalibrationPoint>, CalibrationError> {
        if self.format > CALIBRATION_FORMAT {
            return Err(CalibrationError::NewerFormat { format: self.format });
        }
        self.check_facts()?;
        let points =
            if self.series.is_empty() { self.points_of_steps()? } else { self.points_of_series()? };
        match points.len() {
            0 | 1 => Err(CalibrationError::TooFewSteps { count: points.len() }),
            _ => Ok(points),
        }
    }

    /// Numbers other than the readings must be finite, and uncertainties not negative.
    fn check_facts(&self) -> Result<(), CalibrationError> {
        let signed = [
            ("signal of the empty load cell before the weights", self.zero_before),
            ("signal of the empty load cell after the weights", self.zero_after),
            ("excitation", self.excitation),
        ];
        let signed = signed.map(|(what, volts)| (what, volts.map(Volts::get), f64::NEG_INFINITY));
        let resolution = ("resolution", self.resolution.map(Volts::get), 0.0);
        let weights = self.weights.iter().flat_map(|weight| {
            [
                ("mass of a weight", Some(weight.mass_g), 0.0),
                ("tolerance of a weight", weight.tolerance_g, 0.0),
            ]
        });
        let noises =
            self.series_steps().map(|(_, step)| ("noise", step.noise.map(Volts::get), 0.0));
        let mut facts = signed.into_iter().chain([resolution]).chain(weights).chain(noises);
        let wrong = facts.find_map(|(what, value, least)| {
            let value = value.filter(|value| !(value.is_finite() && *value >= least))?;
            Some(CalibrationError::Fact { what, value })
        });
        wrong.map_or(Ok(()), Err)
    }

    fn points_of_steps(&self) -> Result<Vec<CalibrationPoint>, CalibrationError> {
        let mut points: Vec<CalibrationPoint> = Vec::with_capacity(self.steps.len());
        for (index, here) in self.steps.iter().enumerate() {
            check_numbers(index + 1, here.mass_g, here.volts)?;
            if let Some(before) = points.last().filter(|last| here.mass_g <= last.mass_g) {
                return Err(CalibrationError::MassNotIncreasing {
                    step: index + 1,
                    mass_g: here.mass_g,
                    before_g: before.mass_g,
                });
            }
            let reading = CalibrationReading {
                direction: Direction::Loading,
                volts: here.volts,
                noise_of_mean: None,
            };
            points.push(CalibrationPoint::averaged(here.mass_g, vec![reading]));
        }
        Ok(points)
    }

    fn points_of_series(&self) -> Result<Vec<CalibrationPoint>, CalibrationError> {
        let mut readings: Vec<(f64, CalibrationReading)> = Vec::new();
        for (series, step) in self.series_steps() {
            let number = readings.len() + 1;
            check_numbers(number, step.mass_g, step.volts)?;
            self.check_weights(number, step)?;
            let noise = step.noise.zip(step.samples.filter(|samples| *samples > 0));
            let reading = CalibrationReading {
                direction: series.direction,
                volts: step.volts,
                noise_of_mean: noise.map(|(noise, n)| Volts(noise.0 / (n as f64).sqrt())),
            };
            readings.push((step.mass_g, reading));
        }
        readings.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let groups = readings.chunk_by(|(a, _), (b, _)| b - a <= SAME_MASS);
        let point = |group: &[(f64, CalibrationReading)]| {
            CalibrationPoint::averaged(
                group[0].0,
                group.iter().map(|(_, reading)| *reading).collect(),
            )
        };
        Ok(groups.map(point).collect())
    }

    /// Every step of every series, in the order taken.
    pub fn series_steps(&self) -> impl Iterator<Item = (&CalibrationSeries, &SeriesStep)> {
        self.series.iter().flat_map(|series| series.steps.iter().map(move |step| (series, step)))
    }

    /// Weights named in a step must be known and have its mass.
    fn check_weights(&self, step: usize, here: &SeriesStep) -> Result<(), CalibrationError> {
        let mut sum_g = 0.0;
        for name in &here.weights {
            let weight = self.weights.iter().find(|weight| weight.name == *name);
            sum_g += weight
                .ok_or_else(|| CalibrationError::UnknownWeight { step, name: name.clone() })?
                .mass_g;
        }
        if !here.weights.is_empty() && (sum_g - here.mass_g).abs() > SAME_MASS * (1.0 + sum_g) {
            return Err(CalibrationError::WeightsDisagree { step, mass_g: here.mass_g, sum_g });
        }
        Ok(())
    }

    /// This calibration with weights that are named by what they add: each mass more than the one before
    /// counts as one weight laid on it, with the tolerance in g.
    pub fn with_stacked_weights(mut self, tolerance_g: f64) -> Result<Self, CalibrationError> {
        if !(tolerance_g.is_finite() && tolerance_g >= 0.0) {
            return Err(CalibrationError::Tolerance { tolerance_g });
        }
        let mut masses: Vec<f64> = self.points()?.iter().map(|point| point.mass_g).collect();
        if masses[0] > 0.0 {
            masses.insert(0, 0.0);
        }
        let name = |pair: &[f64]| format!("{} to {} g", pair[0], pair[1]);
        let weight = |pair: &[f64]| NamedWeight {
            name: name(pair),
            mass_g: pair[1] - pair[0],
            tolerance_g: Some(tolerance_g),
        };
        self.weights = masses.windows(2).map(weight).collect();
        for step in self.series.iter_mut().flat_map(|one| &mut one.steps) {
            let on = masses.windows(2).filter(|pair| pair[1] <= step.mass_g + SAME_MASS);
            step.weights = on.map(name).collect();
        }
        Ok(self)
    }

    /// The kind of curve that predicts weights left out best.
    pub fn best_curve(&self) -> Result<CurveKind, CalibrationError> {
        let found = super::curve_candidates(&self.points()?);
        let best = found.into_iter().find(|one| one.refused.is_none());
        Ok(best.map_or(CurveKind::Monotone, |one| one.curve))
    }

    /// The last digit of the readings, where it is known: stated, or for the thesis's table as recorded
    /// sessions carry it, read from its print.
    pub fn reading_resolution(&self) -> Option<Volts> {
        let is_thesis = || self.steps == Self::thesis().steps;
        self.resolution.or_else(|| is_thesis().then_some(THESIS_RESOLUTION))
    }

    /// How far the empty cell's signal moved from the beginning to the end: from the zeros taken for
    /// this, else from the empty steps of the first and the last series.
    pub fn zero_shift(&self) -> Option<Volts> {
        if let (Some(before), Some(after)) = (self.zero_before, self.zero_after) {
            return Some(after - before);
        }
        let mut empty = self.series_steps().filter(|(_, step)| step.mass_g == 0.0);
        let first = empty.next()?.1.volts;
        Some(empty.last()?.1.volts - first)
    }

    /// Days for which it is valid.
    pub fn valid_days(&self) -> u32 {
        self.valid_days.unwrap_or(VALID_DAYS)
    }
}

/// The last digit printed in the thesis's table.
const THESIS_RESOLUTION: Volts = Volts(0.01);

fn check_numbers(step: usize, mass_g: f64, volts: Volts) -> Result<(), CalibrationError> {
    if mass_g.is_finite() && volts.is_finite() && mass_g >= 0.0 {
        return Ok(());
    }
    Err(CalibrationError::NotANumber { step, mass_g, volts: volts.0 })
}
