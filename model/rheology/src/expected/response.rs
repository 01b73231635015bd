//! The force and its derivatives by every unknown, exactly, at the points where they are summed.
//!
//! A sum over samples is taken as an integral times the sampling rate, plus half of the first and the
//! last sample. Behind every corner of the path the force is a polynomial plus exponentials, so the
//! stretch behind it is cut into blocks that double in length, the first as long as the shortest time
//! constant, and each block gets Gauss's eight points (exact to degree 15). What remains (Euler and
//! Maclaurin) is `(dt / tau)^2 / 6` of a sum, half of that in an interval: 0.13 % with
//! [`STEPS_PER_TAU`] samples to a relaxation time. With fewer of them, or in a press of fewer than
//! [`DIRECT_MIN`], all samples are visited; but not more than [`DIRECT_MAX`], beyond which the
//! integral has to do down to [`STEPS_PER_TAU_MIN`], with 2 %, and below that the press is refused.

use super::noise::{FreeOffsets, MeasurementNoise};
use super::protocol::{PathPiece, duration_of};
use palpate_model::viscoelastic::{ModifiedKelvin, StepWeights, forcing, psi_derivatives};

/// Initial force, offset, `log tau`, `mu1`, `mu2`, `mu3`, `tau_sig`.
pub(super) const COLUMNS: usize = 7;
/// How many of them are not the body's.
pub(super) const NUISANCES: usize = 2;

const DIRECT_MIN: f64 = 1000.0;
/// Half a microsecond each, a thousand presses to a plan: so many are some seconds.
pub(super) const DIRECT_MAX: f64 = 5000.0;
const STEPS_PER_TAU: f64 = 8.0;
pub(super) const STEPS_PER_TAU_MIN: f64 = 2.0;
/// The formulas for slow noise divide by the difference of the two times; closer than this (relative)
/// they are moved apart, which changes nothing that a plan could show.
const TIMES_APART: f64 = 1e-3;

/// Positive abscissae and weights of Gauss-Legendre quadrature with 8 points (Abramowitz & Stegun,
/// table 25.4).
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

#[derive(Clone, Copy, Debug)]
pub(super) struct PressPoint {
    /// How many samples it stands for; 0 at the ends of pieces, which are there for the force.
    pub weight: f64,
    /// Derivatives of the force in N by every unknown.
    pub row: [f64; COLUMNS],
    /// Such that `sum weight (row lagged' + lagged row')` is the double sum of rows over the
    /// correlation of slow noise; zero without any.
    pub lagged: [f64; COLUMNS],
    /// The force in N.
    pub force: f64,
}

/// Filtered powers and viscous drive, and their derivatives by `log tau`.
#[derive(Clone, Copy, Debug, Default)]
struct FilteredDrive {
    values: [f64; 4],
    slopes: [f64; 4],
}

impl FilteredDrive {
    /// After depth has moved straight from `x0` by `d` within `dt` seconds.
    fn after(&self, x0: f64, d: f64, dt: f64, tau: f64) -> Self {
        if dt <= 0.0 {
            return *self;
        }
        let StepWeights { r, psi, .. } = StepWeights::new(dt, tau);
        let psi_slopes = psi_derivatives(r, &psi);
        let drive = |[f1, f2, f3]: [f64; 3]| [f1, f2, f3, d / dt * f1];
        let forced = drive(forcing(x0, d, &psi));
        let sloped = drive(forcing(x0, d, &psi_slopes));
        let (mut values, mut slopes) = (self.values, self.slopes);
        for k in 0..4 {
            let old = self.values[k];
            values[k] += forced[k] - psi[0] * old;
            // d r / d log tau = -r.
            slopes[k] -= psi[0] * slopes[k] + r * (sloped[k] - psi_slopes[0] * old);
        }
        Self { values, slopes }
    }
}

/// Filter states of the body and of the slow noise at one time of a press.
#[derive(Clone, Copy, Debug, Default)]
struct PressState {
    elapsed: f64,
    body: FilteredDrive,
    /// The same with the noise's correlation time in the place of tau.
    slow: FilteredDrive,
}

pub(super) struct Press<'a> {
    pub body: &'a ModifiedKelvin,
    pub pieces: &'a [PathPiece],
    pub sample_rate_hz: f64,
    pub noise: &'a MeasurementNoise,
    pub unknowns: FreeOffsets,
}

impl Press<'_> {
    /// Correlation time of slow noise in s, never quite tau.
    fn memory_secs(&self) -> Option<f64> {
        let tau = self.body.tau_eps;
        self.noise.memory.map(|memory| {
            let time = memory.time.0;
            if (time / tau - 1.0).abs() < TIMES_APART { tau * (1.0 + TIMES_APART) } else { time }
        })
    }

    /// Calls `take` at every point.
    pub fn visit(&self, take: impl FnMut(PressPoint)) {
        let samples = duration_of(self.pieces) * self.sample_rate_hz;
        let is_coarse = self.body.tau_eps * self.sample_rate_hz < STEPS_PER_TAU;
        if samples <= DIRECT_MIN || (is_coarse && samples <= DIRECT_MAX) {
            self.visit_samples(take);
        } else {
            self.visit_quadrature(take);
        }
    }

    /// Every sample, the first at the start of the press.
    pub fn visit_samples(&self, mut take: impl FnMut(PressPoint)) {
        let dt = self.sample_rate_hz.recip();
        let decay = self.memory_secs().map_or(0.0, |time| (-dt / time).exp());
        // sum over earlier samples of decay^lag row
        let mut history = [0.0; COLUMNS];
        let mut index = 0.0;
        let mut before = [0.0; COLUMNS];
        self.walk(|start, x0, speed, duration| {
            // Rounding of times must not drop the sample at a corner.
            let last = (start.elapsed + duration) * (1.0 + 1e-12);
            while index * dt <= last {
                let since = index * dt - start.elapsed;
                let mut point = self.point(&self.after(start, x0, speed, since));
                for k in 0..COLUMNS {
                    history[k] = decay * (history[k] + before[k]);
                    point.lagged[k] = history[k] + 0.5 * point.row[k];
                }
                before = point.row;
                point.weight = 1.0;
                take(point);
                index += 1.0;
            }
            take(self.point(&self.after(start, x0, speed, duration)));
        });
    }

    fn visit_quadrature(&self, mut take: impl FnMut(PressPoint)) {
        let rate = self.sample_rate_hz;
        let memory = self.memory_secs();
        let shortest = memory.map_or(self.body.tau_eps, |time| time.min(self.body.tau_eps));
        // A double sum over exp(-lag / T) is larger than its integral by coth(dt / 2T) dt / 2T:
        // at lag 0 the samples stand alone.
        let lag_scale = memory.map_or(0.0, |time| {
            let half = 0.5 / (rate * time);
            rate * time * half / half.tanh()
        });
        let first = self.row(1.0, 1.0, [0.0; 4], [0.0; 4]);
        // Slow noise at a sample and all before it: the integral, and half of the first sample.
        let at = |state: &PressState| {
            let mut point = self.point(state);
            let decay = memory.map_or(0.0, |time| (-state.elapsed / time).exp());
            for (lagged, first) in point.lagged.iter_mut().zip(first) {
                *lagged = lag_scale * *lagged + 0.5 * decay * first;
            }
            point
        };
        let end = duration_of(self.pieces) * (1.0 - 1e-12);
        take(PressPoint { weight: 0.5, ..at(&PressState::default()) });
        self.walk(|start, x0, speed, duration| {
            let mut from = 0.0;
            while from < duration {
                let wanted = if from > 0.0 { 2.0 * from } else { shortest };
                // No sliver at the end.
                let to = if wanted > 0.9 * duration { duration } else { wanted };
                let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
                for (abscissa, weight) in GAUSS {
                    for since in [middle - half * abscissa, middle + half * abscissa] {
                        take(PressPoint {
                            weight: weight * half * rate,
                            ..at(&self.after(start, x0, speed, since))
                        });
                    }
                }
                from = to;
            }
            let corner = self.after(start, x0, speed, duration);
            let weight = if corner.elapsed < end { 0.0 } else { 0.5 };
            take(PressPoint { weight, ..at(&corner) });
        });
    }

    /// Calls `piece(state, depth, speed, duration)` at the start of every piece.
    fn walk(&self, mut piece: impl FnMut(&PressState, f64, f64, f64)) {
        let mut state = PressState::default();
        let mut depth = 0.0;
        for next in self.pieces {
            let speed = (next.to.0 - depth) / next.duration.0;
            piece(&state, depth, speed, next.duration.0);
            state = self.after(&state, depth, speed, next.duration.0);
            depth = next.to.0;
        }
    }

    fn after(&self, from: &PressState, x0: f64, speed: f64, dt: f64) -> PressState {
        let d = speed * dt;
        PressState {
            elapsed: from.elapsed + dt,
            body: from.body.after(x0, d, dt, self.body.tau_eps),
            slow: self.memory_secs().map_or(from.slow, |time| from.slow.after(x0, d, dt, time)),
        }
    }

    /// Weight 0; `lagged` is the row passed through the noise's own filter, of gain 1.
    fn point(&self, state: &PressState) -> PressPoint {
        let tau = self.body.tau_eps;
        let FilteredDrive { values, slopes } = state.body;
        let decay = (-state.elapsed / tau).exp();
        let row = self.row(decay, 1.0, values, slopes);
        // Two filters in series are the difference of the two, 1 / ((1 + T s)(1 + tau s)) =
        // (T / (1 + T s) - tau / (1 + tau s)) / (T - tau); and its derivative by log tau.
        let lagged = self.memory_secs().map_or([0.0; COLUMNS], |time| {
            let apart = time - tau;
            let slow_decay = (-state.elapsed / time).exp();
            let both: [f64; 4] =
                std::array::from_fn(|k| (time * state.slow.values[k] - tau * values[k]) / apart);
            let both_slopes =
                std::array::from_fn(|k| tau / apart * (both[k] - values[k] - slopes[k]));
            let both_decay = tau / apart * (slow_decay - decay);
            self.row(both_decay, 1.0 - slow_decay, both, both_slopes)
        });
        let [mu1, mu2, mu3] = self.body.mu;
        PressPoint {
            weight: 0.0,
            row,
            lagged,
            force: mu1 * values[0]
                + mu2 * values[1]
                + mu3 * values[2]
                + self.body.tau_sig * values[3],
        }
    }

    fn row(&self, decay: f64, one: f64, values: [f64; 4], slopes: [f64; 4]) -> [f64; COLUMNS] {
        let [mu1, mu2, mu3] = self.body.mu;
        let coefficients = [mu1, mu2, mu3, self.body.tau_sig];
        let by_tau = coefficients.iter().zip(slopes).map(|(c, q)| c * q).sum();
        let known = |is_unknown: bool, value: f64| if is_unknown { value } else { 0.0 };
        let [f1, f2, f3, viscous] = values;
        [
            known(self.unknowns.f0, decay),
            known(self.unknowns.f_offset, one),
            by_tau,
            f1,
            f2,
            f3,
            viscous,
        ]
    }
}
