//! The least squares of a loading: its modulus, the place of contact and the force out of contact.

use super::{LoadingFitError, LoadingSample};
use crate::load_curve::LoadCurve;

/// Places of the unknowns.
pub(super) const MODULUS: usize = 0;
pub(super) const SHIFT: usize = 1;
pub(super) const ZERO: usize = 2;
pub(super) const UNKNOWNS: usize = 3;

/// Steps until the modulus stays to 1e-12; the sum of squares is nearly a parabola, so ten are many.
const STEPS_MAX: usize = 60;
/// So many samples show which of the starts is the best.
const SAMPLES_OF_A_START: usize = 200;
/// A column of which less than this is left beside the others is their sum to rounding.
const DEPENDENT: f64 = 1e-12;

type Numbers = [f64; UNKNOWNS];
type Matrix = [Numbers; UNKNOWNS];

pub(super) struct Found {
    /// Modulus in MPa, shift in mm and force out of contact in N.
    pub at: Numbers,
    pub squares: f64,
    /// For forces of unit variance, what was known before included; zero where an unknown is certain.
    pub covariance: Matrix,
}

pub(super) struct LoadingProblem<'a> {
    pub samples: &'a [LoadingSample],
    pub curve: LoadCurve,
    /// What each unknown adds to the sum of squares for its square, from what was known before: the squared noise over its
    /// squared uncertainty.
    pub prior: Numbers,
    /// Unknowns that are not certain.
    pub is_free: [bool; UNKNOWNS],
}

/// Normal equations around a place.
struct Sums {
    normal: Matrix,
    gradient: Numbers,
    squares: f64,
}

impl LoadingProblem<'_> {
    /// How a force changes with each unknown, and the force without the modulus.
    pub fn row(&self, at: &Numbers, depth_mm: f64) -> (Numbers, f64) {
        let [force, slope] = self.curve.at(depth_mm - at[SHIFT]);
        ([force, -at[MODULUS] * slope, 1.0], at[MODULUS] * force + at[ZERO])
    }

    fn sums(&self, at: &Numbers, stride: usize) -> Sums {
        let mut sums =
            Sums { normal: Matrix::default(), gradient: Numbers::default(), squares: 0.0 };
        for sample in self.samples.iter().step_by(stride) {
            let (row, force) = self.row(at, sample.depth_mm);
            let residual = sample.force_newtons - force;
            for i in 0..UNKNOWNS {
                sums.gradient[i] += row[i] * residual;
                for j in 0..=i {
                    sums.normal[i][j] += row[i] * row[j];
                }
            }
            sums.squares += residual * residual;
        }
        for (i, (prior, at)) in self.prior.iter().zip(at).enumerate() {
            sums.normal[i][i] += prior;
            sums.gradient[i] -= prior * at;
            sums.squares += prior * at * at;
        }
        sums
    }

    /// The modulus and the force out of contact that fit some of the samples best where the contact is.
    fn beginning(&self, shift: f64, stride: usize) -> Numbers {
        let at = [0.0, shift, 0.0];
        let sums = self.sums(&at, stride);
        let is_free = [true, false, self.is_free[ZERO]];
        let step = inverse(&sums.normal, is_free).map(|inverse| times(&inverse, &sums.gradient));
        step.map_or(at, |step| [step[MODULUS], shift, step[ZERO]])
    }

    /// From the best of some contacts, in steps that lessen the sum of squares.
    pub fn solve(&self, starts: &[f64]) -> Result<Found, LoadingFitError> {
        let stride = (self.samples.len() / SAMPLES_OF_A_START).max(1);
        let begun = starts.iter().map(|shift| self.beginning(*shift, stride));
        let tried = begun.map(|at| (self.sums(&at, stride).squares, at));
        let best = tried.filter(|one| one.0.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0));
        let mut at = best.ok_or(LoadingFitError::NoContact)?.1;
        let mut sums = self.sums(&at, 1);
        for _ in 0..STEPS_MAX {
            let step = times(&self.inverse(&sums, &at)?, &sums.gradient);
            let better = (0..20).find_map(|halving| {
                let share = 0.5f64.powi(halving);
                let next = std::array::from_fn(|i| at[i] + share * step[i]);
                Some((self.sums(&next, 1), next)).filter(|(next, _)| next.squares <= sums.squares)
            });
            let Some((next_sums, next)) = better else { break };
            let change = (next[MODULUS] / at[MODULUS] - 1.0).abs();
            (sums, at) = (next_sums, next);
            if change < 1e-12 {
                break;
            }
        }
        let covariance = self.inverse(&sums, &at)?;
        Ok(Found { at, squares: sums.squares, covariance })
    }

    /// A body without stiffness has no contact, and a line has no more than two numbers.
    fn inverse(&self, sums: &Sums, at: &Numbers) -> Result<Matrix, LoadingFitError> {
        inverse(&sums.normal, self.is_free).ok_or(match at[MODULUS] > 0.0 && self.is_free[ZERO] {
            true => LoadingFitError::NoApproach,
            false => LoadingFitError::NoContact,
        })
    }

    /// By how much the modulus rises with each force, in MPa/N.
    pub fn influence(&self, found: &Found) -> Vec<f64> {
        let one = |sample: &LoadingSample| {
            let (row, _) = self.row(&found.at, sample.depth_mm);
            (0..UNKNOWNS).map(|i| found.covariance[MODULUS][i] * row[i]).sum()
        };
        self.samples.iter().map(one).collect()
    }

    /// How the forces change with each unknown that is free.
    pub fn columns(&self, found: &Found) -> Vec<Vec<f64>> {
        let column = |unknown: usize| {
            self.samples.iter().map(|one| self.row(&found.at, one.depth_mm).0[unknown]).collect()
        };
        (0..UNKNOWNS).filter(|unknown| self.is_free[*unknown]).map(column).collect()
    }

    /// Forces less those fitted, in N.
    pub fn residuals(&self, found: &Found) -> Vec<f64> {
        let residual =
            |one: &LoadingSample| one.force_newtons - self.row(&found.at, one.depth_mm).1;
        self.samples.iter().map(residual).collect()
    }
}

fn times(matrix: &Matrix, numbers: &Numbers) -> Numbers {
    std::array::from_fn(|i| (0..UNKNOWNS).map(|j| matrix[i][j] * numbers[j]).sum())
}

/// The inverse over the free unknowns of a matrix of which the lower half is given, zero elsewhere, by Gauss and Jordan;
/// `None` where one column is a sum of others.
fn inverse(lower: &Matrix, is_free: [bool; UNKNOWNS]) -> Option<Matrix> {
    let mut left: Matrix = std::array::from_fn(|i| {
        std::array::from_fn(|j| match is_free[i] && is_free[j] {
            true => lower[i.max(j)][i.min(j)],
            false => f64::from(u8::from(i == j)),
        })
    });
    let mut right: Matrix =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j && is_free[i]))));
    for pivot in 0..UNKNOWNS {
        let whole = if is_free[pivot] { lower[pivot][pivot] } else { 1.0 };
        let size = left[pivot][pivot];
        // A NaN is no pivot either.
        if size.is_nan() || size <= DEPENDENT * whole {
            return None;
        }
        for column in 0..UNKNOWNS {
            left[pivot][column] /= size;
            right[pivot][column] /= size;
        }
        for row in (0..UNKNOWNS).filter(|row| *row != pivot) {
            let share = left[row][pivot];
            for column in 0..UNKNOWNS {
                left[row][column] -= share * left[pivot][column];
                right[row][column] -= share * right[pivot][column];
            }
        }
    }
    Some(right)
}
