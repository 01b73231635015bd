//! Two neighbouring sweeps: whether they are one curve, and by how much the frequency is shifted.

use super::interpolation::Stencil;
use super::whitening::{Whitening, chi_square_ratio_max};
use super::{LogSine, ModulusError, Plot};
use crate::triangle::Triangle;

/// Sines of one sweep that lie within the other.
const SINES_MIN: usize = 2;
/// Moduli that differ by less are one curve in practice: where they rise with the power 0.1 of the frequency, as those of tissue, a shift
/// factor moves by less than a tenth of a decade.
const MODULUS_TOLERANCE: f64 = 0.02;
/// A sine counts as within a sweep up to this share of the mean distance of its sines beyond its ends.
const MARGIN: f64 = 0.1;
const ROUNDS_MAX: usize = 50;
/// From this round on the sines that are compared stay the same, so that one on the edge does not come and go.
const ROUNDS_FREE: usize = 10;

/// By how much the natural logarithm of the frequency of the upper sweep grows to lie on the lower one.
pub(super) struct PairShift {
    pub ln_shift: f64,
    /// What each error changes in it, and as the last what the interpolation does.
    pub effects: Vec<f64>,
    /// Sines that were compared.
    pub sines: usize,
    /// Root mean square of residuals over what the uncertainties give, where it is larger than by chance.
    pub lack_of_fit: Option<f64>,
}

pub(super) enum PairRefusal {
    NoOverlap,
    NotIdentifiable,
    NotOneCurve { plot: Plot, ratio: f64 },
}

/// Two sweeps with what each error changes in them.
pub(super) struct Pair<'a> {
    pub sweeps: [&'a [LogSine]; 2],
    /// The places of the two in an error.
    pub places: [usize; 2],
    pub errors: &'a [ModulusError],
}

impl Pair<'_> {
    pub fn shift(&self) -> Result<PairShift, PairRefusal> {
        let start =
            closed_form_shift(self.sweeps[0], self.sweeps[1]).ok_or(PairRefusal::NoOverlap)?;
        self.shift_from(start).or_else(|reason| {
            // What is not one curve may well be without a shift.
            let (comparison, slopes) = self.overlap(&self.sines_within(start), start);
            comparison.in_wicket(&slopes.smooth).judge(0, Plot::Wicket)?;
            Err(reason)
        })
    }

    fn shift_from(&self, start: f64) -> Result<PairShift, PairRefusal> {
        let (mut ln_shift, mut sines) = (start, Vec::new());
        for round in 0..ROUNDS_MAX {
            if round < ROUNDS_FREE {
                sines = self.sines_within(ln_shift);
            }
            if sines.len() < SINES_MIN {
                return Err(PairRefusal::NoOverlap);
            }
            let (comparison, slopes) = self.overlap(&sines, ln_shift);
            let found = comparison.solve(&slopes).ok_or(PairRefusal::NotIdentifiable)?;
            ln_shift += found.step;
            if found.step.abs() < 1e-6 * norm(&found.effects) {
                comparison.in_wicket(&slopes.smooth).judge(0, Plot::Wicket)?;
                let lack_of_fit = comparison.judge(1, Plot::Overlap)?;
                let wider = lack_of_fit.unwrap_or(1.0);
                let effects = found.effects.into_iter().map(|effect| wider * effect).collect();
                return Ok(PairShift { ln_shift, effects, sines: sines.len(), lack_of_fit });
            }
        }
        Err(PairRefusal::NotIdentifiable)
    }

    /// The sines of the upper sweep that lie within the lower one once shifted.
    fn sines_within(&self, ln_shift: f64) -> Vec<usize> {
        let [lower, upper] = self.sweeps;
        let [first, last] = [0, lower.len() - 1].map(|end| lower[end].ln_frequency);
        let margin = MARGIN * mean_distance(lower);
        let range = first - margin..=last + margin;
        let is_within = |at: &usize| range.contains(&(upper[*at].ln_frequency + ln_shift));
        (0..upper.len()).filter(is_within).collect()
    }

    /// Storage and loss modulus of the upper sweep less those of the lower one, and the slopes of the latter.
    fn overlap(&self, sines: &[usize], ln_shift: f64) -> (Comparison, Slopes) {
        let [lower, upper] = self.sweeps;
        let places: Vec<f64> = lower.iter().map(|sine| sine.ln_frequency).collect();
        let bends = [0, 1].map(|modulus| Bend::of(lower, modulus));
        let step = mean_distance(lower);
        let (mut comparison, mut slopes) = (Comparison::new(self.errors.len()), Slopes::default());
        for at in sines {
            let place = upper[*at].ln_frequency + ln_shift;
            let stencil = Stencil::at(&places, place);
            comparison.loss_shares.push(upper[*at].loss_share());
            for modulus in 0..2 {
                let of = |node: usize| lower[node].ln_moduli[modulus];
                comparison.residuals.push(upper[*at].ln_moduli[modulus] - stencil.value(of));
                comparison.interpolation.push(stencil.error(of));
                slopes.smooth.push(bends[modulus].slope(place));
                slopes.local.push(slope(&places, place, step, of));
                for (changes, error) in comparison.changes.iter_mut().zip(self.errors) {
                    let [below, above] = self.places.map(|place| &error[place]);
                    let of = |node: usize| below[node][modulus];
                    changes.push(above[*at][modulus] - stencil.value(of));
                }
            }
        }
        (comparison, slopes)
    }
}

fn mean_distance(sweep: &[LogSine]) -> f64 {
    let last = sweep.len() - 1;
    (sweep[last].ln_frequency - sweep[0].ln_frequency) / last as f64
}

/// Over a step to either side, as far as the sweep goes.
fn slope(places: &[f64], place: f64, step: f64, of: impl Fn(usize) -> f64) -> f64 {
    let (first, last) = (places[0], places[places.len() - 1]);
    let [low, high] = [place - step, place + step].map(|end| end.clamp(first, last));
    let [below, above] = [low, high].map(|end| Stencil::at(places, end).value(&of));
    (above - below) / (high - low)
}

/// A parabola through a sweep.
struct Bend {
    middle: f64,
    /// Of the first and the second power of the distance from the middle.
    coefficients: [f64; 2],
}

impl Bend {
    fn of(sweep: &[LogSine], modulus: usize) -> Self {
        let middle = 0.5 * (sweep[0].ln_frequency + sweep[sweep.len() - 1].ln_frequency);
        let column = |of: &dyn Fn(&LogSine) -> f64| sweep.iter().map(of).collect::<Vec<_>>();
        let columns = vec![
            column(&|_| 1.0),
            column(&|sine| sine.ln_frequency - middle),
            column(&|sine| (sine.ln_frequency - middle).powi(2)),
            column(&|sine| sine.ln_moduli[modulus]),
        ];
        // Three frequencies that differ always have one.
        let found = Triangle::new(columns).solve().unwrap_or(vec![0.0; 3]);
        Self { middle, coefficients: [found[1], found[2]] }
    }

    fn slope(&self, ln_frequency: f64) -> f64 {
        self.coefficients[0] + 2.0 * self.coefficients[1] * (ln_frequency - self.middle)
    }
}

/// The mean distance along the frequency between two curves of the magnitude of the complex modulus, over the magnitudes that both have:
/// the shift for which the area between them is zero (Gergesova, Zupancic, Saprunov and Emri, J. Rheol. 55 (2011) 1-16). The
/// magnitude grows with the frequency where storage or loss alone may not. `None` where they have no magnitude in common.
fn closed_form_shift(lower: &[LogSine], upper: &[LogSine]) -> Option<f64> {
    let lowest =
        |sweep: &[LogSine]| sweep.iter().map(LogSine::ln_magnitude).fold(f64::INFINITY, f64::min);
    let highest = |sweep: &[LogSine]| {
        sweep.iter().map(LogSine::ln_magnitude).fold(f64::NEG_INFINITY, f64::max)
    };
    let (low, high) = (lowest(lower).max(lowest(upper)), highest(lower).min(highest(upper)));
    if low >= high {
        return None;
    }
    // Straight between two sines: the mean over so many magnitudes is the area to a hundredth of a distance of sines.
    let levels = 100;
    let level = |step: usize| low + (high - low) * (step as f64 + 0.5) / levels as f64;
    let distance =
        |step: usize| Some(crossing(lower, level(step))? - crossing(upper, level(step))?);
    let distances: Option<Vec<f64>> = (0..levels).map(distance).collect();
    Some(distances?.iter().sum::<f64>() / levels as f64)
}

/// Where the magnitude first passes a level.
fn crossing(sweep: &[LogSine], level: f64) -> Option<f64> {
    let passes =
        |pair: &&[LogSine]| (pair[0].ln_magnitude() <= level) != (pair[1].ln_magnitude() <= level);
    let pair = sweep.windows(2).find(passes)?;
    let [from, to] = [0, 1].map(|one| pair[one].ln_magnitude());
    let width = pair[1].ln_frequency - pair[0].ln_frequency;
    Some(pair[0].ln_frequency + width * (level - from) / (to - from))
}

/// Residuals with all that is uncertain in them.
#[derive(Default)]
struct Comparison {
    /// Of storage and loss of each sine in turn.
    residuals: Vec<f64>,
    /// Standard uncertainty of each that comes from interpolation.
    interpolation: Vec<f64>,
    /// What each error changes in each residual.
    changes: Vec<Vec<f64>>,
    /// Of each sine, the square of the loss modulus in that of the complex modulus.
    loss_shares: Vec<f64>,
}

/// Of the moduli over the frequency, in logarithms. Least squares with the local slopes alone would take their noise for knowledge of
/// the shift; with the smooth ones as instruments it averages out (Fuller, Measurement Error Models, 1987, section 1.4).
#[derive(Default)]
struct Slopes {
    smooth: Vec<f64>,
    local: Vec<f64>,
}

struct ShiftStep {
    step: f64,
    effects: Vec<f64>,
}

impl Comparison {
    fn new(errors: usize) -> Self {
        Self { changes: vec![Vec::new(); errors], ..Self::default() }
    }

    fn whitening(&self, tolerance: f64) -> Option<Whitening> {
        let count = self.residuals.len();
        let entry = |i: usize, j: usize| {
            let common = self.changes.iter().map(|change| change[i] * change[j]).sum::<f64>();
            let own = self.interpolation[i].powi(2) + tolerance.powi(2);
            if i == j { common + own } else { common }
        };
        let row = |i: usize| (0..count).map(|j| entry(i, j)).collect();
        Whitening::of(&(0..count).map(row).collect::<Vec<_>>())
    }

    /// Loss factors less those at the same magnitude of the complex modulus, of the sines whose magnitude grows with the frequency: with
    /// the slopes `s` and `l` of storage and loss over the frequency, storage and loss that are off by `a` and `b` lie `s b - l a` over
    /// the slope of the magnitude off the curve of loss factor over magnitude, whatever the shift.
    fn in_wicket(&self, slopes: &[f64]) -> Self {
        let mut wicket = Self::new(self.changes.len());
        for (sine, loss_share) in self.loss_shares.iter().enumerate() {
            let [storage, loss] = [slopes[2 * sine], slopes[2 * sine + 1]];
            let magnitude = (1.0 - loss_share) * storage + loss_share * loss;
            if magnitude <= 0.0 {
                continue;
            }
            let [of_storage, of_loss] = [-loss / magnitude, storage / magnitude];
            let off = |of: &[f64]| of_storage * of[2 * sine] + of_loss * of[2 * sine + 1];
            wicket.residuals.push(off(&self.residuals));
            let interpolation = &self.interpolation[2 * sine..];
            wicket
                .interpolation
                .push((of_storage * interpolation[0]).hypot(of_loss * interpolation[1]));
            for (to, changes) in wicket.changes.iter_mut().zip(&self.changes) {
                to.push(off(changes));
            }
        }
        wicket
    }

    /// The step of the shift that leaves the least, and what each error changes in it; `None` where no modulus tells.
    fn solve(&self, slopes: &Slopes) -> Option<ShiftStep> {
        let whitening = self.whitening(0.0)?;
        let smooth = whitening.whiten(&slopes.smooth);
        let square = dot(&smooth, &whitening.whiten(&slopes.local));
        if square <= 0.0 {
            return None;
        }
        let shift = |residuals: &[f64]| dot(&smooth, &whitening.whiten(residuals)) / square;
        let mut effects: Vec<f64> = self.changes.iter().map(|change| shift(change)).collect();
        let of_interpolation = |row: usize| {
            let mut error = vec![0.0; self.residuals.len()];
            error[row] = self.interpolation[row];
            shift(&error).powi(2)
        };
        effects.push((0..self.residuals.len()).map(of_interpolation).sum::<f64>().sqrt());
        Some(ShiftStep { step: shift(&self.residuals), effects })
    }

    /// Root mean square of residuals over what the uncertainties give, where it is larger than by chance; refused where that is so even
    /// with the tolerance.
    fn judge(&self, parameters: usize, plot: Plot) -> Result<Option<f64>, PairRefusal> {
        // None is left where no magnitude grows.
        let Some(freedom) = self.residuals.len().checked_sub(parameters).filter(|one| *one > 0)
        else {
            return Ok(None);
        };
        let ratio = |tolerance: f64| {
            let whitening = self.whitening(tolerance)?;
            let ratio = whitening.chi_square(&self.residuals) / freedom as f64;
            (ratio > chi_square_ratio_max(freedom)).then_some(ratio.sqrt())
        };
        match (ratio(0.0), ratio(MODULUS_TOLERANCE)) {
            (Some(ratio), Some(_)) => Err(PairRefusal::NotOneCurve { plot, ratio }),
            (lack_of_fit, _) => Ok(lack_of_fit),
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(values: &[f64]) -> f64 {
    dot(values, values).sqrt()
}
