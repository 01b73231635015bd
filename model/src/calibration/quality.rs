//! Quality of a calibration: hysteresis, repeatability, zero shift, sensitivity, flat stretches.

use super::CalibrationError;
use super::curve::CalibrationCurve;
use super::document::{Calibration, CalibrationPoint, Direction};
use super::uncertainty::ForceUncertainty;
use crate::units::{Newtons, Volts};
use serde::Serialize;

/// A stretch whose sensitivity is below this share of the median one is flat.
const FLAT_SHARE: f64 = 0.25;

/// A curve read after taring, as every force of a run is: the signal is shifted so that the empty cell
/// reads 0 N. A curve by least squares misses the empty cell's signal; taring takes that out.
pub(super) struct TaredCurve<'a> {
    curve: &'a CalibrationCurve,
    shift: f64,
}

impl<'a> TaredCurve<'a> {
    /// Tared on the empty cell if it is among the points, else not at all.
    pub fn of(curve: &'a CalibrationCurve, points: &[CalibrationPoint]) -> Self {
        let empty = points.first().filter(|point| point.newtons.0 == 0.0);
        let shift =
            empty.map_or(0.0, |point| point.volts.0 - curve.volts_from_newtons(Newtons(0.0)).0);
        Self { curve, shift }
    }

    pub fn force(&self, signal: Volts) -> Newtons {
        self.curve.newtons_from_volts(Volts(signal.0 - self.shift))
    }

    pub fn signal(&self, force: Newtons) -> Volts {
        Volts(self.curve.volts_from_newtons(force).0 + self.shift)
    }
}

/// One weight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PointQuality {
    pub mass_g: f64,
    /// Its weight in N.
    pub force_n: f64,
    /// Mean reading in V.
    pub signal_v: f64,
    /// Readings in that mean.
    pub readings: usize,
    /// Curve minus reading in V.
    pub residual_v: f64,
    /// Force read minus weight in N.
    pub residual_n: f64,
    /// Slope of the curve in V/N.
    pub sensitivity_v_per_n: f64,
    /// Loading minus unloading in V, where both were taken.
    pub hysteresis_v: Option<f64>,
    /// The same in N.
    pub hysteresis_n: Option<f64>,
    /// Standard uncertainty of a force read here in N; `None` where nothing is stated.
    pub uncertainty_n: Option<f64>,
}

/// A stretch in which the cell hardly moves.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlatStretch {
    /// Its ends in g.
    pub from_g: f64,
    /// Its ends in g.
    pub to_g: f64,
    /// Its ends in N.
    pub from_n: f64,
    /// Its ends in N.
    pub to_n: f64,
    /// Change of the signal over it in V.
    pub rise_v: f64,
    /// Mean sensitivity elsewhere over that within.
    pub ratio: f64,
    /// Largest force error in N per mV of signal within.
    pub worst_n_per_mv: f64,
    /// Largest standard uncertainty within in N; `None` where nothing is stated.
    pub worst_uncertainty_n: Option<f64>,
}

/// Largest and root mean square difference of loading and unloading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hysteresis {
    /// Largest in V.
    pub max_v: f64,
    /// Largest in N.
    pub max_n: f64,
    /// Root mean square in V.
    pub rms_v: f64,
    /// Root mean square in N.
    pub rms_n: f64,
}

/// Figures of merit of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CalibrationQuality {
    pub points: Vec<PointQuality>,
    /// Loading against unloading, where both were taken.
    pub hysteresis: Option<Hysteresis>,
    /// Standard deviation in V of one reading from its repeats, pooled over all weights.
    pub repeatability_v: Option<f64>,
    /// Change of the empty cell's signal in V.
    pub zero_shift_v: Option<f64>,
    /// The same in N, at the sensitivity of the empty cell.
    pub zero_shift_n: Option<f64>,
    pub flat: Vec<FlatStretch>,
    /// Forces beyond this in N are extrapolated.
    pub force_max_n: f64,
    /// Findings for a reader, one sentence each.
    pub findings: Vec<String>,
}

impl Calibration {
    pub fn quality(&self) -> Result<CalibrationQuality, CalibrationError> {
        let points = self.points()?;
        let curve = self.curve.through(&points)?;
        let uncertainty = ForceUncertainty::of(self)?;
        let zeroed = TaredCurve::of(&curve, &points);
        let sigma = |newtons: f64| uncertainty.sigma(Newtons(newtons)).map(|sigma| sigma.0);
        let qualities: Vec<PointQuality> = points
            .iter()
            .map(|point| {
                let sensitivity = curve.sensitivity_at(point.newtons);
                let hysteresis_v = point.hysteresis().map(|volts| volts.0);
                PointQuality {
                    mass_g: point.mass_g,
                    force_n: point.newtons.0,
                    signal_v: point.volts.0,
                    readings: point.readings.len(),
                    residual_v: zeroed.signal(point.newtons).0 - point.volts.0,
                    residual_n: zeroed.force(point.volts).0 - point.newtons.0,
                    sensitivity_v_per_n: sensitivity,
                    hysteresis_v,
                    hysteresis_n: hysteresis_v.map(|volts| volts / sensitivity),
                    uncertainty_n: sigma(point.newtons.0),
                }
            })
            .collect();
        let zero_shift_v = self.zero_shift().map(|volts| volts.0);
        let mut quality = CalibrationQuality {
            hysteresis: hysteresis(&qualities),
            repeatability_v: repeatability(&points).map(|volts| volts.0),
            zero_shift_v,
            zero_shift_n: zero_shift_v.map(|volts| volts / curve.sensitivity_at(Newtons(0.0))),
            flat: flat(&points, &curve, &uncertainty).into_iter().collect(),
            force_max_n: curve.force_range().1.0,
            points: qualities,
            findings: Vec::new(),
        };
        quality.findings = findings(&quality, &uncertainty);
        Ok(quality)
    }
}

fn hysteresis(points: &[PointQuality]) -> Option<Hysteresis> {
    let pairs = points.iter().filter_map(|p| Some([p.hysteresis_v?, p.hysteresis_n?]));
    let pairs: Vec<[f64; 2]> = pairs.collect();
    let [volts, newtons] = [0, 1].map(|k| pairs.iter().map(move |pair| pair[k]));
    let max = |values: &mut dyn Iterator<Item = f64>| {
        values.fold(0.0f64, |most, value| most.max(value.abs()))
    };
    Some(Hysteresis {
        max_v: max(&mut volts.clone()),
        max_n: max(&mut newtons.clone()),
        rms_v: rms(volts)?,
        rms_n: rms(newtons)?,
    })
}

/// Standard deviation of one reading from repeats under the same weight in the same direction, pooled.
pub(super) fn repeatability(points: &[CalibrationPoint]) -> Option<Volts> {
    let (mut square, mut freedom) = (0.0, 0);
    for point in points {
        for direction in [Direction::Loading, Direction::Unloading] {
            let Some(mean) = point.mean(direction) else {
                continue;
            };
            let own = point.readings.iter().filter(|one| one.direction == direction);
            let misses: Vec<f64> = own.map(|one| one.volts.0 - mean.0).collect();
            square += misses.iter().map(|miss| miss * miss).sum::<f64>();
            freedom += misses.len() - 1;
        }
    }
    (freedom > 0).then(|| Volts((square / freedom as f64).sqrt()))
}

/// Root mean square; `None` of nothing.
pub(super) fn rms(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, square) = values.fold((0, 0.0), |(n, sum), value| (n + 1, sum + value * value));
    (count > 0).then(|| (square / f64::from(count)).sqrt())
}

/// The flat stretch, as it appears while weight after weight is laid on: it begins where the next weight
/// hardly moves the signal and goes on as long as the signal, seen from there, lags behind.
fn flat(
    points: &[CalibrationPoint],
    curve: &CalibrationCurve,
    uncertainty: &ForceUncertainty,
) -> Option<FlatStretch> {
    let chord = |i: usize, j: usize| {
        (points[j].volts.0 - points[i].volts.0) / (points[j].newtons.0 - points[i].newtons.0)
    };
    let last = points.len() - 1;
    let mut steps: Vec<f64> = (0..last).map(|i| chord(i, i + 1)).collect();
    steps.sort_by(f64::total_cmp);
    let limit = FLAT_SHARE * steps[steps.len() / 2];
    let begin = (0..last).find(|&i| chord(i, i + 1) < limit)?;
    let end = (begin + 1..=last).take_while(|&j| chord(begin, j) < limit).last()?;
    let (from, to) = (&points[begin], &points[end]);
    let (rise, width) = (to.volts.0 - from.volts.0, to.newtons.0 - from.newtons.0);
    let all =
        [points[last].volts.0 - points[0].volts.0, points[last].newtons.0 - points[0].newtons.0];
    let elsewhere = (all[0] - rise) / (all[1] - width);
    // Hundredths of the stretch: curve and uncertainty are smooth between weights.
    let places = (0..=100).map(|i| Newtons(from.newtons.0 + width * f64::from(i) / 100.0));
    let least = places.clone().map(|at| curve.sensitivity_at(at)).fold(f64::INFINITY, f64::min);
    let sigmas = places.filter_map(|at| uncertainty.sigma(at));
    Some(FlatStretch {
        from_g: from.mass_g,
        to_g: to.mass_g,
        from_n: from.newtons.0,
        to_n: to.newtons.0,
        rise_v: rise,
        ratio: elsewhere / (rise / width),
        worst_n_per_mv: 1e-3 / least,
        worst_uncertainty_n: sigmas.map(|sigma| sigma.0).max_by(f64::total_cmp),
    })
}

fn findings(quality: &CalibrationQuality, uncertainty: &ForceUncertainty) -> Vec<String> {
    let mut findings = Vec::new();
    for flat in &quality.flat {
        let own = flat.worst_uncertainty_n.map_or(String::new(), |sigma| {
            format!(", and the calibration alone has a standard uncertainty of up to {sigma:.2} N")
        });
        // A fall within its repeatability has no such ratio.
        let less = match flat.rise_v > 0.0 {
            true => format!("{:.1} times less than elsewhere", flat.ratio),
            false => "which is no rise".to_owned(),
        };
        findings.push(format!(
            "from {:.0} g to {:.0} g ({:.2} N to {:.2} N) the signal changes by only {} V, {less}: a signal error of 1 mV there means a force error of up to {:.3} N{own}",
            flat.from_g,
            flat.to_g,
            flat.from_n,
            flat.to_n,
            (flat.rise_v * 1e4).round() / 1e4,
            flat.worst_n_per_mv,
        ));
    }
    if let Some(last) = quality.points.last() {
        findings.push(format!(
            "forces above {:.2} N ({:.0} g) are extrapolated: no weight was heavier",
            quality.force_max_n, last.mass_g
        ));
    }
    let missing: Vec<&str> = uncertainty.not_stated().iter().map(|term| term.name()).collect();
    if !missing.is_empty() {
        findings.push(format!(
            "the uncertainty omits components that the calibration does not state: {}",
            missing.join(", ")
        ));
    }
    findings
}
