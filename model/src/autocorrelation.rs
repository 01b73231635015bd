//! Autocorrelation of the residuals, and its effect on the uncertainty.
//!
//! Textbook intervals assume that every sample errs independently. Forces measured on tissue do
//! not: the model is never quite right, and drift and breathing outlast many samples, so that such
//! intervals cover the truth far too rarely. Here the residuals, summed over some hundred blocks,
//! are described as white noise with an exponentially decaying part on top. In blocks that is an
//! ARMA(1,1) process, whatever the block length (Granger & Morris, J. R. Stat. Soc. A 139 (1976)
//! 246-257); the neighbouring-sample correlation alone would understate the memory as soon as some
//! of the noise is white. Its parameters maximise the restricted likelihood (Harville, J. Am. Stat.
//! Assoc. 72 (1977) 320-338), which allows for what the fit itself has taken out of the residuals.

/// Fewer blocks than this beyond the unknowns say nothing of memory.
const SPARE_MIN: usize = 12;
/// Twice the gain in log-likelihood that memory must bring: the 95 % point of chi-square with three
/// degrees of freedom (strength, duration, level).
const GAIN_MIN: f64 = 7.81;
/// Memories tried before refinement, evenly in their logarithm from [`SHORTEST`] to half the record.
const MEMORIES: usize = 9;
/// Shortest memory tried, in blocks: of a shorter one next to nothing reaches the next block (4 %).
const SHORTEST: f64 = 0.3;
/// Step in both coordinates over which the likelihood's curvature is taken: a third in the memory,
/// small beside what a record can tell of it.
const CURVATURE_STEP: f64 = 0.3;
/// Shares of the lasting part looked at: their logit, 0.1 % to 99.9 %.
const LOGIT_MAX: f64 = 7.0;
/// Shares of the lasting part tried at each.
const SHARES: [f64; 5] = [0.02, 0.1, 0.3, 0.65, 1.0];
/// Variance of the logarithm of the long-run variance when next to nothing is known of it.
const UNCERTAINTY_MAX: f64 = 0.5;
/// Columns at most, the residual included: a relaxation modulus of five terms has eleven numbers.
const COLUMNS_MAX: usize = 12;

/// Residuals of one record in blocks, each over the root of its count: `residuals[b]` and, for
/// every unknown, its column.
#[derive(Clone, Debug, Default)]
pub struct BlockedResiduals {
    pub residuals: Vec<f64>,
    /// For every unknown a value for every block.
    pub columns: Vec<Vec<f64>>,
    /// Position of each block in time; censored stretches leave gaps.
    pub places: Vec<usize>,
    /// Samples of a block.
    pub length: f64,
}

/// About the largest number of blocks in which autocorrelation is estimated.
pub const BLOCKS_MAX: usize = 400;

impl BlockedResiduals {
    /// Of residuals at even times, one for each sample, and how what is fitted rises there with each unknown.
    #[must_use]
    pub fn of(residuals: &[f64], columns: &[Vec<f64>]) -> Self {
        let length = block_length(residuals.len());
        let residuals = block_sums(residuals);
        Self {
            places: (0..residuals.len()).collect(),
            columns: columns.iter().map(|column| block_sums(column)).collect(),
            residuals,
            length: length as f64,
        }
    }
}

fn block_length(samples: usize) -> usize {
    samples.div_ceil(BLOCKS_MAX).max(1)
}

/// Sums over blocks, each over the root of its count.
#[must_use]
pub fn block_sums(values: &[f64]) -> Vec<f64> {
    let sum = |block: &[f64]| block.iter().sum::<f64>() / (block.len() as f64).sqrt();
    values.chunks(block_length(values.len())).map(sum).collect()
}

/// Second-order description of blocks of noise: variance `level`, covariance
/// `level * neighbour * forgetting^(lag - 1)` from lag one on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    pub level: f64,
    /// Correlation of neighbouring blocks.
    pub neighbour: f64,
    /// Correlation kept from lag to lag.
    pub forgetting: f64,
    /// Variance of the estimated logarithm of the long-run variance.
    pub uncertainty: f64,
}

impl Memory {
    #[must_use]
    pub fn none(level: f64) -> Self {
        Self { level, neighbour: 0.0, forgetting: 0.0, uncertainty: 0.0 }
    }

    /// Variance of a sum over many blocks, for each block.
    #[must_use]
    pub fn long_run(&self) -> f64 {
        self.level * long_run(self.neighbour, self.forgetting)
    }

    /// `z' Gamma z` for a weight on each block.
    #[must_use]
    pub fn quadratic(&self, z: &[f64], places: &[usize]) -> f64 {
        let (mut diagonal, mut lagged, mut past) = (0.0, 0.0, 0.0);
        let mut next = 0;
        for (&z, &place) in z.iter().zip(places) {
            // The share of the past that is left after a gap of so many blocks.
            past *= self.forgetting.powi(place.saturating_sub(next) as i32);
            diagonal += z * z;
            lagged += z * past;
            past = self.forgetting * past + z;
            next = place + 1;
        }
        self.level * (diagonal + 2.0 * self.neighbour * lagged)
    }
}

fn long_run(neighbour: f64, forgetting: f64) -> f64 {
    1.0 + 2.0 * neighbour / (1.0 - forgetting)
}

/// The memory of a record's residuals; `white` is the variance the blocks would have without.
/// `None` when the record is too short for an estimate.
///
/// Only unknowns that act on this record `alone` have taken their share out of its residuals. One that several
/// records share is a compromise between them: a specimen twice as stiff leaves residuals of the very shape of the
/// shared column, which must count as memory and not as taken out.
#[must_use]
pub fn memory(blocks: &BlockedResiduals, alone: &[bool], white: f64) -> Option<Memory> {
    let whitened = WhitenedBlocks::new(blocks, alone)?;
    let spare = whitened.spare();
    if white <= 0.0 || !white.is_finite() {
        return Some(Memory::none(white.max(0.0)));
    }
    let alone = whitened.at(0.0, 0.0)?;
    let without = spare * white.ln() + alone.square / white + alone.logs;
    let count = whitened.rows.len() as f64;
    let longest = (count / 2.0).ln();
    let shortest = SHORTEST.ln();
    let memory = |i: f64| (shortest + (longest - shortest) * i / (MEMORIES - 1) as f64).exp();
    let deviance = |log_blocks: f64, share: f64| {
        let forgetting = (-(-log_blocks).exp()).exp();
        let neighbour = neighbour(forgetting, share);
        whitened
            .at(forgetting, neighbour)
            .map_or(f64::INFINITY, |one| spare * (one.square / spare).ln() + spare + one.logs)
    };
    let mut best = (f64::INFINITY, 0.0, 0.0);
    for i in 0..MEMORIES {
        let log_blocks = memory(i as f64).ln();
        for share in SHARES {
            let value = deviance(log_blocks, share);
            if value < best.0 {
                best = (value, log_blocks, logit(share));
            }
        }
    }
    let of = |[log_blocks, logit]: [f64; 2]| {
        if log_blocks > longest || log_blocks < shortest - 1.0 || logit.abs() > LOGIT_MAX {
            return f64::INFINITY;
        }
        deviance(log_blocks, expit(logit))
    };
    let (at, value) = descend([best.1, best.2], best.0, of);
    if without - value < GAIN_MIN {
        return Some(Memory::none(white));
    }
    let forgetting = (-(-at[0]).exp()).exp();
    let neighbour = neighbour(forgetting, expit(at[1]));
    let level = whitened.at(forgetting, neighbour)?.square / spare;
    let found = Memory { level, neighbour, forgetting, uncertainty: uncertainty(at, of, spare) };
    // Residuals that alternate add up to less than independent ones; that is no memory, and no
    // reason for narrower intervals.
    Some(if found.long_run() > white { found } else { Memory::none(white) })
}

/// Correlation of neighbours: the share that lasts, times the mean of an exponential over two
/// neighbouring blocks relative to one block.
fn neighbour(forgetting: f64, share: f64) -> f64 {
    let r = -forgetting.ln();
    // Lag-one correlation of block means of exp(-t): (1 - e^-r)^2 / (2 (r - 1 + e^-r)).
    let decayed = -(-r).exp_m1();
    let within = if r < 1e-3 { r * r * (1.0 - r / 3.0) } else { 2.0 * (r - decayed) };
    share * decayed * decayed / within
}

fn logit(share: f64) -> f64 {
    let share = share.clamp(1e-3, 0.995);
    (share / (1.0 - share)).ln()
}

fn expit(logit: f64) -> f64 {
    1.0 / (1.0 + (-logit).exp())
}

/// Compass search: steps along both axes, halved when none helps. The surface is smooth, and its
/// minimum is wanted to a hundredth.
fn descend(from: [f64; 2], value: f64, of: impl Fn([f64; 2]) -> f64) -> ([f64; 2], f64) {
    let (mut at, mut value) = (from, value);
    let mut step = [0.5, 0.7];
    for _ in 0..6 {
        for _ in 0..6 {
            let before = value;
            for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
                let mut trial = at;
                trial[axis] += sign * step[axis];
                let there = of(trial);
                if there < value {
                    (at, value) = (trial, there);
                }
            }
            if value >= before {
                break;
            }
        }
        step = step.map(|step| 0.5 * step);
    }
    (at, value)
}

/// Variance of the logarithm of the long-run variance, from the curvature of the deviance (twice
/// the negative log-likelihood) along both coordinates and the scatter of the level itself.
fn uncertainty(at: [f64; 2], of: impl Fn([f64; 2]) -> f64, spare: f64) -> f64 {
    let h = CURVATURE_STEP;
    let shifted = |a: f64, b: f64| of([at[0] + a * h, at[1] + b * h]);
    let (here, right, left) = (of(at), shifted(1.0, 0.0), shifted(-1.0, 0.0));
    let (up, down) = (shifted(0.0, 1.0), shifted(0.0, -1.0));
    let (xx, yy) = (right + left - 2.0 * here, up + down - 2.0 * here);
    let xy =
        0.25 * (shifted(1.0, 1.0) + shifted(-1.0, -1.0) - shifted(1.0, -1.0) - shifted(-1.0, 1.0));
    // Half the second derivative of the deviance is the information.
    let information = [xx, xy, yy].map(|second| 0.5 * second / (h * h));
    let [a, b, c] = information;
    let determinant = a * c - b * b;
    let log_long_run = |a: f64, b: f64| {
        let forgetting = (-(-(at[0] + a * h)).exp()).exp();
        let neighbour = neighbour(forgetting, expit(at[1] + b * h));
        long_run(neighbour, forgetting).ln()
    };
    let gradient = [
        (log_long_run(1.0, 0.0) - log_long_run(-1.0, 0.0)) / (2.0 * h),
        (log_long_run(0.0, 1.0) - log_long_run(0.0, -1.0)) / (2.0 * h),
    ];
    let [u, v] = gradient;
    let both = (c * u * u - 2.0 * b * u * v + a * v * v) / determinant;
    // On a ridge of the likelihood one coordinate says nothing; memory shorter than a block then
    // still shows in the correlation of neighbours, whose variance is one over the count.
    let either = [u * u / a, v * v / c]
        .into_iter()
        .filter(|through| through.is_finite() && *through > 0.0)
        .fold(4.0 / spare, f64::max);
    let is_peak = determinant > 0.0 && a > 0.0 && both.is_finite();
    (2.0 / spare + if is_peak { both } else { either }).min(UNCERTAINTY_MAX)
}

/// Residual and orthonormal columns by block, ready to be whitened for any memory.
struct WhitenedBlocks {
    rows: Vec<[f64; COLUMNS_MAX]>,
    /// Whether a row has no neighbour before it.
    is_first: Vec<bool>,
    /// Columns, the residual not counted.
    columns: usize,
}

struct Whitening {
    /// Generalised residual sum of squares for a level of one.
    square: f64,
    /// Logarithms of the determinants in the restricted likelihood.
    logs: f64,
}

impl WhitenedBlocks {
    fn new(blocks: &BlockedResiduals, alone: &[bool]) -> Option<Self> {
        let own = blocks.columns.iter().zip(alone);
        let own: Vec<&[f64]> =
            own.filter(|(_, alone)| **alone).map(|(column, _)| column.as_slice()).collect();
        let columns = orthonormal(&own);
        let columns = &columns[..columns.len().min(COLUMNS_MAX - 1)];
        let count = blocks.residuals.len();
        if count < columns.len() + SPARE_MIN {
            return None;
        }
        let rows = (0..count).map(|b| {
            let mut row = [0.0; COLUMNS_MAX];
            for (slot, column) in row.iter_mut().zip(columns) {
                *slot = column[b];
            }
            row[columns.len()] = blocks.residuals[b];
            row
        });
        let places = &blocks.places;
        let is_first = (0..count).map(|b| b == 0 || places[b] != places[b - 1] + 1);
        Some(Self { is_first: is_first.collect(), rows: rows.collect(), columns: columns.len() })
    }

    fn spare(&self) -> f64 {
        (self.rows.len() - self.columns) as f64
    }

    /// Innovations of every column under an ARMA(1,1) process of unit variance (Brockwell & Davis,
    /// "Time Series: Theory and Methods", 2nd ed., section 5.3), then the projection.
    fn at(&self, forgetting: f64, neighbour: f64) -> Option<Whitening> {
        let theta = moving_average(forgetting, neighbour)?;
        let phi = forgetting;
        // Variance of the process for innovations of variance one.
        let gamma = (1.0 + 2.0 * phi * theta + theta * theta) / (1.0 - phi * phi);
        let width = self.columns + 1;
        let mut gram = [[0.0; COLUMNS_MAX]; COLUMNS_MAX];
        let mut past = [0.0; COLUMNS_MAX];
        let mut innovation = [0.0; COLUMNS_MAX];
        let (mut variance, mut logs) = (gamma, 0.0);
        for (row, is_first) in self.rows.iter().zip(&self.is_first) {
            // After a gap the process starts again.
            if !is_first {
                let share = theta / variance;
                for k in 0..COLUMNS_MAX {
                    innovation[k] = row[k] - phi * past[k] - share * innovation[k];
                }
                variance = 1.0 + theta * (theta - share);
            } else {
                innovation = *row;
                variance = gamma;
            }
            past = *row;
            let weight = 1.0 / variance;
            logs += if variance == 1.0 { 0.0 } else { variance.ln() };
            for i in 0..width {
                let scaled = weight * innovation[i];
                for j in 0..=i {
                    gram[i][j] += scaled * innovation[j];
                }
            }
        }
        // In units of the process's own variance.
        let count = self.rows.len() as f64;
        logs -= count * gamma.ln();
        let mut scale = 0.0;
        for i in 0..width {
            for j in 0..i {
                let known: f64 = (0..j).map(|k| gram[i][k] * gram[j][k]).sum();
                gram[i][j] = (gram[i][j] - known) / gram[j][j];
            }
            let known: f64 = (0..i).map(|k| gram[i][k] * gram[i][k]).sum();
            let pivot = gram[i][i] - known;
            if i == self.columns {
                let square = pivot * gamma;
                // The columns' determinant scales with the process, once for each of them.
                logs += scale + self.columns as f64 * gamma.ln();
                return (square > 0.0 && logs.is_finite()).then_some(Whitening { square, logs });
            }
            if pivot <= 0.0 {
                return None;
            }
            scale += pivot.ln();
            gram[i][i] = pivot.sqrt();
        }
        None
    }
}

/// The moving-average coefficient of the invertible ARMA(1,1) process whose correlation is
/// `neighbour` at lag one and forgets by `forgetting` from there.
fn moving_average(forgetting: f64, neighbour: f64) -> Option<f64> {
    let difference = forgetting - neighbour;
    if difference.abs() < 1e-12 {
        return Some(0.0);
    }
    let half = (1.0 + forgetting * forgetting - 2.0 * neighbour * forgetting) / (2.0 * difference);
    let root = half * half - 1.0;
    (root >= 0.0).then(|| {
        // The smaller root of theta^2 + 2 half theta + 1, without cancellation.
        -1.0 / (half + half.signum() * root.sqrt())
    })
}

/// An orthonormal basis of the columns (Gram-Schmidt, twice); columns that depend on the others, or
/// touch other records only, are left out.
fn orthonormal(columns: &[&[f64]]) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
    for column in columns {
        let mut column = column.to_vec();
        let length = norm(&column);
        // Twice is enough (Kahan; Parlett, "The Symmetric Eigenvalue Problem", section 6.9).
        for _ in 0..2 {
            for other in &basis {
                let share: f64 = column.iter().zip(other).map(|(a, b)| a * b).sum();
                for (value, other) in column.iter_mut().zip(other) {
                    *value -= share * other;
                }
            }
        }
        let remainder = norm(&column);
        if remainder > 1e-9 * length {
            column.iter_mut().for_each(|value| *value /= remainder);
            basis.push(column);
        }
    }
    basis
}

fn norm(column: &[f64]) -> f64 {
    column.iter().map(|value| value * value).sum::<f64>().sqrt()
}
