//! Force at the rack per bias voltage: the source's torque-force calibration.
//!
//! The bias goes up and down in steps while a cell holds the rack; friction, drive and cell make of a straight line a
//! dead band, a line, and a ceiling, and the way down another line than the way up. Each branch is cut into those three
//! by least squares with a price for each cut (the Bayesian information criterion: Schwarz, Annals of Statistics 6
//! (1978) 461-464); the slope is that of both lines together. Between the ends of the line there is an answer, beyond
//! them a refusal.

use palpate_model::units::{Newtons, Volts};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// One step of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BiasPoint {
    pub bias: Volts,
    /// Force measured, after it has settled.
    pub force: Newtons,
    /// Whether the bias was raised to it, or lowered.
    pub is_rising: bool,
}

/// The straight part of one branch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BiasBranch {
    /// Force of its line at no bias, in N.
    pub offset: f64,
    /// Bias voltages between which it is a line.
    pub line: [Volts; 2],
    /// Mean force below that, where it does not follow; `None` where it follows from the first point on.
    pub dead: Option<Newtons>,
    /// Mean force above that; `None` where it follows to the last.
    pub ceiling: Option<Newtons>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BiasCalibration {
    /// Force per bias voltage, in N/V.
    pub slope: f64,
    /// Standard error of the slope, in N/V.
    pub slope_error: f64,
    pub rising: BiasBranch,
    /// On the way down, if it was measured.
    pub falling: Option<BiasBranch>,
    /// Standard deviation of what the lines leave, in N.
    pub residual: f64,
    pub points: usize,
}

/// The points make no calibration.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum BiasError {
    /// A point that is no number.
    #[error(
        "the bias or the force of calibration point {index} is not a number; measure this point again"
    )]
    NotANumber {
        /// Which, from 1.
        index: usize,
    },
    /// Too few points.
    #[error(
        "the rising branch has only {found} points; measure at least {LINE_MIN} points with a bias above the dead band"
    )]
    TooFew { found: usize },
    /// The force does not follow.
    #[error(
        "the force does not rise with the bias voltage (slope {slope:.3} N/V, standard error {error:.3} N/V); check the drive, the load cell and the sign of the force"
    )]
    Flat {
        /// Slope in N/V.
        slope: f64,
        /// Its standard error.
        error: f64,
    },
}

/// Least points of a line: two for it, and four to tell it from a curve.
const LINE_MIN: usize = 6;

/// Most means of points among whose pairs the ends of a line are looked for.
const PLACES: usize = 400;

/// Sums over points from the first on, so that any stretch costs nothing.
struct Sums {
    sums: Vec<[f64; 5]>,
}

impl Sums {
    fn new(points: &[(f64, f64)]) -> Self {
        let mut sums = vec![[0.0; 5]];
        let mut sum = [0.0; 5];
        for &(u, f) in points {
            let one = [u, f, u * u, u * f, f * f];
            sum.iter_mut().zip(one).for_each(|(sum, one)| *sum += one);
            sums.push(sum);
        }
        Self { sums }
    }

    /// Count, means and central sums `uu, uf, ff` of points `from..to`.
    fn stretch(&self, from: usize, to: usize) -> (f64, [f64; 2], [f64; 3]) {
        let n = (to - from) as f64;
        let (low, high) = (&self.sums[from], &self.sums[to]);
        let part: [f64; 5] = std::array::from_fn(|k| high[k] - low[k]);
        let (u, f) = (part[0] / n, part[1] / n);
        let central = [part[2] - n * u * u, part[3] - n * u * f, part[4] - n * f * f];
        (n, [u, f], central)
    }

    /// Sum of squares about the mean.
    fn flat(&self, from: usize, to: usize) -> f64 {
        if to > from { self.stretch(from, to).2[2].max(0.0) } else { 0.0 }
    }

    /// Sum of squares about the line.
    fn line(&self, from: usize, to: usize) -> f64 {
        let (_, _, [uu, uf, ff]) = self.stretch(from, to);
        let explained = if uu > 0.0 { uf * uf / uu } else { 0.0 };
        (ff - explained).max(0.0)
    }
}

/// Where the line of a branch begins and ends among its points, which are in order of bias and centred.
fn cut(points: &[(f64, f64)]) -> Option<[usize; 2]> {
    let n = points.len();
    if n < LINE_MIN {
        return None;
    }
    let sums = Sums::new(points);
    // Rounding is no misfit: a part in 1e9 of the whole.
    let floor = 1e-18 * sums.flat(0, n).max(f64::MIN_POSITIVE);
    let score = |from: usize, to: usize| {
        let residual = sums.flat(0, from) + sums.line(from, to) + sums.flat(to, n);
        // A cut has a level and a place, and a place is chosen among many: twice what a number costs, as for change
        // points (Zhang & Siegmund, Biometrics 63 (2007) 22-32), and once more for the level's own scatter.
        let cuts = usize::from(from > 0) + usize::from(to < n);
        let numbers = (2 + 4 * cuts) as f64;
        n as f64 * ((residual + floor) / n as f64).ln() + numbers * (n as f64).ln()
    };
    let all = (0..=n - LINE_MIN).flat_map(|from| (from + LINE_MIN..=n).map(move |to| [from, to]));
    // A flat of one point is that point's error.
    let fair = all.filter(|[from, to]| *from != 1 && *to + 1 != n);
    fair.map(|[from, to]| (score(from, to), [from, to]))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, ends)| ends)
}

/// The points of a branch in order, and its cut.
struct Branch {
    points: Vec<(f64, f64)>,
    ends: [usize; 2],
}

impl Branch {
    fn of(points: &[BiasPoint], is_rising: bool) -> Option<Self> {
        let of_branch = points.iter().filter(|one| one.is_rising == is_rising);
        let mut points: Vec<_> = of_branch.map(|one| (one.bias.0, one.force.0)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Sums of squares of centred numbers keep their digits.
        let n = points.len().max(1) as f64;
        let middle = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
        let centred: Vec<_> = points.iter().map(|p| (p.0 - middle.0, p.1 - middle.1)).collect();
        // Places to cut are looked for among so many means at most: their pairs are what takes time.
        let each = centred.len().div_ceil(PLACES).max(1);
        let means: Vec<_> = centred.chunks(each).map(mean).collect();
        let ends = cut(&means)?.map(|end| (end * each).min(points.len()));
        Some(Self { points, ends })
    }

    fn line(&self) -> &[(f64, f64)] {
        &self.points[self.ends[0]..self.ends[1]]
    }

    fn means(&self) -> (f64, f64) {
        mean(self.line())
    }

    fn summary(&self, slope: f64) -> BiasBranch {
        let (u, f) = self.means();
        let [from, to] = self.ends;
        let level = |points: &[(f64, f64)]| (!points.is_empty()).then(|| Newtons(mean(points).1));
        BiasBranch {
            offset: f - slope * u,
            line: [Volts(self.points[from].0), Volts(self.points[to - 1].0)],
            dead: level(&self.points[..from]),
            ceiling: level(&self.points[to..]),
        }
    }
}

fn mean(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let sum = points.iter().fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    (sum.0 / n, sum.1 / n)
}

impl BiasCalibration {
    /// From measured points, the way up and, if there is one, the way down.
    pub fn fit(points: &[BiasPoint]) -> Result<Self, BiasError> {
        let is_bad = |one: &BiasPoint| !(one.bias.is_finite() && one.force.is_finite());
        if let Some(index) = points.iter().position(is_bad) {
            return Err(BiasError::NotANumber { index: index + 1 });
        }
        let found = points.iter().filter(|one| one.is_rising).count();
        let rising = Branch::of(points, true).ok_or(BiasError::TooFew { found })?;
        let falling = Branch::of(points, false);
        let branches = || [Some(&rising), falling.as_ref()].into_iter().flatten();
        // One slope for both, each about its own mean.
        let (mut uu, mut uf, mut ff, mut count, mut free) = (0.0, 0.0, 0.0, 0, -1.0);
        for branch in branches() {
            let (u, f) = branch.means();
            for (du, df) in branch.line().iter().map(|one| (one.0 - u, one.1 - f)) {
                uu += du * du;
                uf += du * df;
                ff += df * df;
            }
            count += branch.line().len();
            free += branch.line().len() as f64 - 1.0;
        }
        let slope = if uu > 0.0 { uf / uu } else { 0.0 };
        let residual = ((ff - slope * uf).max(0.0) / free).sqrt();
        let slope_error = if uu > 0.0 { residual / uu.sqrt() } else { f64::INFINITY };
        // Four standard errors: by chance once in 30 000 calibrations.
        if slope <= 4.0 * slope_error {
            return Err(BiasError::Flat { slope, error: slope_error });
        }
        Ok(Self {
            slope,
            slope_error,
            rising: rising.summary(slope),
            falling: falling.as_ref().map(|branch| branch.summary(slope)),
            residual,
            points: count,
        })
    }
}
