//! One record with one choice of free parameters, as a linear problem for any given relaxation
//! time and contact position (variable projection: Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973)
//! 413-432).

use super::design::Columns;
use super::options::{CONTACT, FitOptions, LINEAR, LINEAR_COUNT, TAU};
use super::sample::{FitError, FitSample};
use super::triangle::{Factor, Triangle};

/// Coefficients of the scaled columns `[phi_1, phi_2, phi_3, gamma, decay, 1]`.
pub(super) type Scaled = [f64; LINEAR_COUNT];

/// The two parameters in which the model is not linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Outer {
    /// `ln(tau_eps / 1 s)`.
    pub log_tau: f64,
    /// Contact position over the depth scale.
    pub contact: f64,
}

impl Outer {
    pub fn tau(self) -> f64 {
        self.log_tau.exp()
    }
}

/// Samples, scales and what is free.
#[derive(Clone, Debug)]
pub(super) struct Problem<'a> {
    pub samples: &'a [FitSample],
    /// Depth in mm that counts as one.
    pub depth_scale: f64,
    sigma_scale: f64,
    /// Scaled fixed coefficients, zero where free.
    fixed: Scaled,
    /// Each free column as a combination of the scaled columns.
    pub basis: Vec<Scaled>,
    pub fixed_tau: Option<f64>,
    /// Scaled.
    pub fixed_contact: Option<f64>,
}

impl<'a> Problem<'a> {
    pub fn new(samples: &'a [FitSample], options: &FitOptions) -> Result<Self, FitError> {
        let fixed_values = options.fixed();
        let depths = || samples.iter().map(|sample| sample.depth.0);
        let deepest = depths().fold(f64::NEG_INFINITY, f64::max);
        let shallowest = depths().fold(f64::INFINITY, f64::min);
        let contact = fixed_values[CONTACT].unwrap_or(shallowest);
        let depth_scale = deepest - contact;
        if depth_scale <= 0.0 {
            return Err(FitError::NeverInTissue { deepest, contact });
        }
        let units = linear_units(depth_scale);
        let free: Vec<usize> = (0..LINEAR_COUNT)
            .filter(|&k| fixed_values[LINEAR + k].is_none())
            .collect();
        Ok(Self {
            samples,
            depth_scale,
            sigma_scale: samples[0].sigma.0,
            fixed: std::array::from_fn(|k| fixed_values[LINEAR + k].unwrap_or(0.0) * units[k]),
            basis: basis(&free),
            fixed_tau: fixed_values[TAU],
            fixed_contact: fixed_values[CONTACT].map(|mm| mm / depth_scale),
        })
    }

    /// The same problem on fewer samples.
    pub fn on<'b>(&self, samples: &'b [FitSample]) -> Problem<'b> {
        Problem {
            samples,
            depth_scale: self.depth_scale,
            sigma_scale: self.sigma_scale,
            fixed: self.fixed,
            basis: self.basis.clone(),
            fixed_tau: self.fixed_tau,
            fixed_contact: self.fixed_contact,
        }
    }

    /// How many outer parameters are free.
    pub fn outer_free(&self) -> usize {
        usize::from(self.fixed_tau.is_none()) + usize::from(self.fixed_contact.is_none())
    }

    /// All scaled coefficients, from those of the free columns.
    pub fn scaled(&self, solution: &[f64]) -> Scaled {
        let mut all = self.fixed;
        for (coefficient, column) in solution.iter().zip(&self.basis) {
            for (value, share) in all.iter_mut().zip(column) {
                *value += coefficient * share;
            }
        }
        all
    }

    /// Visits every sample with the columns at it, exactly.
    pub fn visit(&self, outer: Outer, visit: impl FnMut(&FitSample, &Columns<true>)) {
        self.walk(outer, visit);
    }

    /// The linear problem on means over `block` samples, without derivatives: for the search.
    pub fn scan_factor(&self, outer: Outer, block: usize) -> Factor {
        let free = self.basis.len();
        let mut triangle = Triangle::new(free + 1);
        let (mut sums, mut sum_force, mut sum_weight) = ([0.0; LINEAR_COUNT], 0.0, 0.0);
        let mut row = [0.0; LINEAR_COUNT + 1];
        let mut count = 0;
        let last = self.samples.len();
        let mut seen = 0;
        self.walk(outer, |sample, columns: &Columns<false>| {
            let weight = (self.sigma_scale / sample.sigma.0).powi(2);
            for (sum, value) in sums.iter_mut().zip(columns.row()) {
                *sum += weight * value;
            }
            sum_force += weight * sample.force.0;
            sum_weight += weight;
            count += 1;
            seen += 1;
            if count == block || seen == last {
                self.project(&sums, &mut row);
                row[free] = sum_force - product(&sums, &self.fixed);
                triangle.push(&row[..=free], sum_weight.sqrt().recip());
                (sums, sum_force, sum_weight, count) = ([0.0; LINEAR_COUNT], 0.0, 0.0, 0);
            }
        });
        triangle.finish()
    }

    /// The linear problem on all samples, with the derivative columns at coefficients `at`:
    /// free columns, then `log tau` and contact where free, then the force.
    pub fn exact_factor(&self, outer: Outer, at: &Scaled) -> Factor {
        let free = self.basis.len();
        let width = free + self.outer_free() + 1;
        let mut triangle = Triangle::new(width);
        let mut row = [0.0; LINEAR_COUNT + 3];
        self.visit(outer, |sample, columns| {
            let values = columns.row();
            self.project(&values, &mut row);
            let mut next = free;
            if self.fixed_tau.is_none() {
                row[next] = product(&columns.tau_row(), at);
                next += 1;
            }
            if self.fixed_contact.is_none() {
                row[next] = product(&columns.contact_row(), at);
                next += 1;
            }
            row[next] = sample.force.0 - product(&values, &self.fixed);
            triangle.push(&row[..width], self.sigma_scale / sample.sigma.0);
        });
        triangle.finish()
    }

    /// Weight of a sample relative to the first.
    pub fn weight(&self, sample: &FitSample) -> f64 {
        self.sigma_scale / sample.sigma.0
    }

    #[inline]
    fn project(&self, values: &Scaled, row: &mut [f64]) {
        for (slot, column) in row.iter_mut().zip(&self.basis) {
            *slot = product(values, column);
        }
    }

    #[inline]
    fn walk<const EXACT: bool>(
        &self,
        outer: Outer,
        visit: impl FnMut(&FitSample, &Columns<EXACT>),
    ) {
        walk(self.samples, self.depth_scale, outer, visit);
    }
}

/// Visits every sample with the columns at it; depth counts in `depth_scale` mm.
#[inline]
pub(super) fn walk<const EXACT: bool>(
    samples: &[FitSample],
    depth_scale: f64,
    outer: Outer,
    mut visit: impl FnMut(&FitSample, &Columns<EXACT>),
) {
    let Some(first) = samples.first() else { return };
    let scaled = |sample: &FitSample| sample.depth.0 / depth_scale - outer.contact;
    let mut columns = Columns::new(outer.tau(), scaled(first));
    let mut before = first.t.0;
    for (index, sample) in samples.iter().enumerate() {
        if index > 0 {
            columns.advance(scaled(sample), sample.t.0 - before);
            before = sample.t.0;
        }
        visit(sample, &columns);
    }
}

/// What to divide scaled coefficients by for N/mm, N/mm^2, N/mm^3, N*s/mm^2, N, N.
pub(super) fn linear_units(depth_scale: f64) -> Scaled {
    let x = depth_scale;
    [x, x * x, x * x * x, x * x, 1.0, 1.0]
}

#[inline]
pub(super) fn product(a: &Scaled, b: &Scaled) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        sum += a * b;
    }
    sum
}

/// Columns for the free coefficients. Powers become `u` times the Legendre polynomials of `2u - 1`
/// where the first two or three are free: nearly orthogonal over the depths passed, where the bare
/// powers are nearly parallel.
fn basis(free: &[usize]) -> Vec<Scaled> {
    let has = |k: usize| free.contains(&k);
    let mut columns: Vec<Scaled> = free
        .iter()
        .map(|&k| std::array::from_fn(|i| f64::from(u8::from(i == k))))
        .collect();
    if has(0) && has(1) {
        columns[1] = [-1.0, 2.0, 0.0, 0.0, 0.0, 0.0];
        if has(2) {
            columns[2] = [1.0, -6.0, 6.0, 0.0, 0.0, 0.0];
        }
    }
    columns
}
