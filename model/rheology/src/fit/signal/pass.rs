//! One record's rows in volts, with the zero eliminated.

use super::super::block_sums::NoiseBlock;
use super::super::columns::{ParameterPoint, Slope};
use super::super::design::{LANES, Lane};
use super::super::passes::{Pass, RecordFactor, UnknownPlace, product};
use super::super::sample::FitSample;
use super::super::system::System;
use super::super::triangle::Triangle;
use super::lag::LaggingCell;
use super::zero::{ZeroFilter, ZeroSolution};
use super::{Drift, ErrorColumns, ErrorPlace, SignalTerm};
use palpate_model::calibration::CalibrationCurve;
use palpate_model::units::Newtons;
use std::ops::Range;
use std::sync::Arc;

/// Samples are averaged over at most this share of a record, and over at most this share of its depths: within a mean the
/// columns are as good as straight, so that it holds all that they know.
const MEANS: usize = 1024;
const DEPTHS: f64 = 512.0;
/// But over no fewer than a mean's samples divided by this: measured depths that tremble would else make a mean of every sample.
const MEAN_PARTS: usize = 16;
/// Blocks in which autocorrelation is estimated, as of records without a signal.
const NOISE_BLOCKS: usize = 400;

/// Columns of some neighbouring samples.
struct SampleMean {
    t: f64,
    count: usize,
    place: ErrorPlace,
    /// In V, the residual behind them.
    columns: Vec<f64>,
}

/// All means of a record.
struct SignalMeans {
    means: Vec<SampleMean>,
    /// Squares of the noise about its means, in V^2.
    within: f64,
}

/// Means of neighbouring samples.
struct ClosedMean {
    t: f64,
    volts: f64,
    /// Variance of the modelled force within it, in N^2.
    force_variance: f64,
    count: usize,
    columns: Vec<f64>,
}

/// What a curve makes of forces that scatter about their mean beyond what it makes of that mean, in V: half its second
/// derivative times their variance. Forces that rise evenly reach the root of three standard deviations to either side.
fn bent_volts(curve: &CalibrationCurve, mean: Newtons, variance: f64) -> f64 {
    let reach = (3.0 * variance).sqrt();
    if reach == 0.0 {
        return 0.0;
    }
    let slope = |side: f64| curve.sensitivity_at(Newtons(mean.0 + side * reach));
    0.5 * variance * (slope(1.0) - slope(-1.0)) / (2.0 * reach)
}

/// Sums of the samples so far of a mean.
#[derive(Default)]
struct OpenMean {
    /// Of the columns of the force.
    sums: Vec<f64>,
    taken: usize,
    count: usize,
    /// Time, signal, modelled force and slope of the curve at the first sample, from which the others count: their squares stay
    /// small.
    first: [f64; 4],
    time: f64,
    volts: f64,
    /// The modelled force and its square.
    force: f64,
    force_square: f64,
    /// The signal with what the modelled force makes of it subtracted.
    noise: f64,
    square: f64,
}

impl OpenMean {
    fn add(&mut self, t: f64, volts: f64, force: f64, curve: &CalibrationCurve) {
        if self.count == 0 {
            self.first = [t, volts, force, curve.sensitivity_at(Newtons(force))];
        }
        let [first_t, first_volts, first_force, slope] = self.first;
        self.count += 1;
        self.time += t - first_t;
        self.volts += volts - first_volts;
        let risen = force - first_force;
        self.force += risen;
        self.force_square += risen * risen;
        let noise = volts - first_volts - slope * risen;
        self.noise += noise;
        self.square += noise * noise;
    }

    /// Adds the columns of these samples, the first of which is in this lane.
    fn add_columns(&mut self, lanes: &[Lane], samples: &[FitSample], from: usize) {
        let is_whole = samples.iter().all(FitSample::is_measured);
        for (sum, lane) in self.sums.iter_mut().zip(lanes) {
            let values = &lane[from..from + samples.len()];
            *sum += match is_whole {
                true => values.iter().sum::<f64>(),
                false => {
                    let pairs = values.iter().zip(samples);
                    pairs.filter(|(_, one)| one.is_measured()).map(|(value, _)| value).sum()
                }
            };
        }
    }

    /// Squares of the noise about its mean.
    fn noise_square(&self) -> f64 {
        (self.square - self.noise * self.noise / self.count.max(1) as f64).max(0.0)
    }

    /// The means, of which the next begin; `None` where no force was known.
    fn take_mean(&mut self) -> Option<ClosedMean> {
        let count = self.count;
        let over = 1.0 / count as f64;
        let next = Self { sums: vec![0.0; self.sums.len()], ..Self::default() };
        let Self { sums, first, time, volts, force, force_square, .. } =
            std::mem::replace(self, next);
        (count > 0).then(|| ClosedMean {
            t: first[0] + over * time,
            volts: first[1] + over * volts,
            force_variance: (over * force_square - (over * force).powi(2)).max(0.0),
            count,
            columns: sums.into_iter().map(|sum| over * sum).collect(),
        })
    }
}

impl System<'_> {
    /// One record triangularised at a point, the residual last; see the module above.
    pub(in super::super) fn signal_factor(
        &self,
        record: usize,
        term: &SignalTerm<'_>,
        point: &ParameterPoint,
        slopes: &[Slope],
    ) -> Option<RecordFactor> {
        let SignalMeans { means, within } = self.signal_means(record, term, point, slopes)?;
        let width = self.layout().linear_count() + slopes.len() + self.errors.count + 1;
        let weight = self.sigma_scale / term.drift.noise;
        let solution = self.without_zero(term, &means);
        let mut triangle = Triangle::new(width);
        (0..width).for_each(|i| triangle.push(solution.factor.row(i), 1.0));
        let mut row = vec![0.0; width];
        row[width - 1] = weight * within.sqrt();
        triangle.push(&row, 1.0);
        let explained: Vec<SampleMean> = means
            .into_iter()
            .map(|mut mean| {
                for (k, value) in mean.columns.iter_mut().enumerate() {
                    *value -= solution.explained(mean.t, k);
                }
                mean
            })
            .collect();
        let factor = triangle.finish();
        factor
            .is_finite()
            .then(|| RecordFactor { factor, blocks: noise_blocks(&explained, weight) })
    }

    /// The means and the signal out of contact, with the zero eliminated.
    fn without_zero(&self, term: &SignalTerm<'_>, means: &[SampleMean]) -> ZeroSolution {
        let width = means[0].columns.len();
        let weight = self.sigma_scale / term.drift.noise;
        let mut filter = ZeroFilter::new(term.drift.nodes(self.sigma_scale), width);
        let mut unloaded = term.signal.unloaded.iter().peekable();
        let mut empty = vec![0.0; width];
        let zero = self.unloaded_volts(term);
        let mut push_unloaded = |filter: &mut ZeroFilter, until: f64| {
            while let Some(one) = unloaded.next_if(|one| one.t.0 < until) {
                empty[width - 1] = one.volts.0 - zero;
                filter.push(one.t.0, &empty, weight * (one.count as f64).sqrt());
            }
        };
        for mean in means {
            push_unloaded(&mut filter, mean.t);
            filter.push(mean.t, &mean.columns, weight * (mean.count as f64).sqrt());
        }
        push_unloaded(&mut filter, f64::INFINITY);
        filter.finish()
    }

    /// The same with errors as further unknowns of variance one: `errors` gives the changes of the force read in N that they
    /// make at a place.
    pub(in super::super) fn with_errors(
        &self,
        points: &[ParameterPoint],
        count: usize,
        errors: impl Fn(&ErrorPlace) -> Vec<f64>,
    ) -> Option<Self> {
        let columns = points.iter().enumerate().map(|(record, point)| {
            let term = self.signals[record].as_ref()?;
            let means = self.signal_means(record, term, point, &[])?.means;
            Some(means.iter().map(|mean| errors(&mean.place)).collect::<Vec<_>>())
        });
        let columns: Option<Vec<_>> = columns.collect();
        let columns = Arc::new(columns?);
        let errors = ErrorColumns { count, columns, found: vec![0.0; count] };
        Some(Self { errors, ..self.clone() })
    }

    /// The same around the errors that a pass finds.
    pub(in super::super) fn with_errors_found(mut self, pass: &Pass) -> Option<Self> {
        let whole = pass.with_errors.as_ref()?;
        let change = whole.solve(self.errors.count + self.unknowns.len());
        let pairs = self.errors.found.iter_mut().zip(&change);
        pairs.for_each(|(found, change)| *found += change);
        Some(self)
    }

    /// The same with the sizes of noise and wandering that the records' own rows make likely, too.
    pub(in super::super) fn with_drift_of_records(&self, points: &[ParameterPoint]) -> Self {
        let mut system = self.clone();
        for (record, point) in points.iter().enumerate() {
            let Some(term) = &mut system.signals[record] else { continue };
            if let Some(drift) = self.drift_of_record(record, term, point) {
                term.take(drift, self.records[record].samples);
            }
        }
        system
    }

    fn drift_of_record(
        &self,
        record: usize,
        term: &SignalTerm<'_>,
        point: &ParameterPoint,
    ) -> Option<Drift> {
        let slopes = self.slopes(record);
        let means = self.signal_means(record, term, point, &slopes)?.means;
        let map = self.map(record, self.unknowns.len());
        let own: Vec<_> =
            map.iter().filter(|place| !matches!(place, UnknownPlace::Nowhere)).collect();
        let errors = self.errors.count;
        let width = own.len() + errors + 1;
        let mut rows: Vec<(f64, Vec<f64>, f64)> = Vec::with_capacity(means.len());
        for one in &term.signal.unloaded {
            let mut row = vec![0.0; width];
            row[width - 1] = one.volts.0 - self.unloaded_volts(term);
            rows.push((one.t.0, row, (one.count as f64).sqrt()));
        }
        for mean in &means {
            let mut row: Vec<f64> = own.iter().map(|place| place.of(&mean.columns)).collect();
            row.extend_from_slice(&mean.columns[mean.columns.len() - 1 - errors..]);
            rows.push((mean.t, row, (mean.count as f64).sqrt()));
        }
        rows.sort_by(|one, other| one.0.total_cmp(&other.0));
        let count = rows.len() - own.len();
        let contact = self.unknowns.iter().zip(&map);
        let contact = contact.filter(|(_, place)| !matches!(place, UnknownPlace::Nowhere));
        let mut contact = contact.map(|(unknown, _)| unknown.parameter);
        let contact = contact.position(|parameter| parameter == self.layout().contact());
        let judged = term.sizes.judged_by(|nodes| {
            let mut filter = ZeroFilter::new(nodes, width);
            rows.iter().for_each(|(t, row, weight)| filter.push(*t, row, *weight));
            let solution = filter.finish();
            let mut triangle = Triangle::new(width);
            (0..width).for_each(|i| triangle.push(solution.factor.row(i), 1.0));
            if let (Some(k), Some(error)) = (contact, term.contact_error_mm) {
                let mut row = vec![0.0; width];
                row[k] = self.depth_mm;
                row[width - 1] = term.contact_mm - point.outer.contact * self.depth_mm;
                triangle.push(&row, term.drift.noise / error);
            }
            for (k, found) in (own.len()..width - 1).zip(&self.errors.found) {
                let mut row = vec![0.0; width];
                (row[k], row[width - 1]) = (1.0, -found);
                triangle.push(&row, term.drift.noise);
            }
            let factor = triangle.finish();
            let logs = (0..width - 1).map(|k| factor.row(k)[k].abs().ln()).sum();
            let square = factor.residual_sum(width - 1);
            (solution, square, logs, count)
        });
        judged.mean()
    }

    /// Signal in V without load, as the curve has it.
    fn unloaded_volts(&self, term: &SignalTerm<'_>) -> f64 {
        term.signal.curve.volts_from_newtons(Newtons(0.0)).0
    }

    fn signal_means(
        &self,
        record: usize,
        term: &SignalTerm<'_>,
        point: &ParameterPoint,
        slopes: &[Slope],
    ) -> Option<SignalMeans> {
        let samples = self.records[record].samples;
        let columns = self.layout().linear_count() + slopes.len();
        let length = samples.len().div_ceil(MEANS).max(1);
        let (shallowest, deepest) = self.records[record].depths;
        let (reach, mut depth) = ((deepest - shallowest) / DEPTHS, shallowest);
        let mut found = SignalMeans { means: Vec::with_capacity(MEANS + 1), within: 0.0 };
        let mut lanes = vec![[0.0; LANES]; columns + 1];
        let mut open = OpenMean { sums: vec![0.0; columns], ..OpenMean::default() };
        let mut close = self.mean_maker(record, term, point);
        let curve = &term.signal.curve;
        let mut place = 0;
        self.source.walk(samples, self.scale(&point.outer), point, slopes, |block, filled| {
            filled.write(&mut lanes, point, slopes);
            let mut forces = [0.0; LANES];
            for (lane, share) in lanes.iter().zip(&point.at) {
                forces.iter_mut().zip(lane).for_each(|(force, value)| *force += share * value);
            }
            let mut from = 0;
            for (i, sample) in block.iter().enumerate() {
                open.taken += 1;
                if sample.is_measured() {
                    open.add(sample.t.0, term.signal.volts[place + i], forces[i], curve);
                }
                let is_far =
                    open.taken * MEAN_PARTS >= length && (sample.depth.0 - depth).abs() >= reach;
                let is_full = open.taken == length || place + i + 1 == samples.len() || is_far;
                if is_full || i + 1 == block.len() {
                    open.add_columns(&lanes, &block[from..=i], from);
                    from = i + 1;
                }
                if is_full {
                    depth = sample.depth.0;
                    found.within += open.noise_square();
                    let samples = place + i + 1 - open.taken..place + i + 1;
                    found.means.extend(open.take_mean().map(|mean| close(mean, samples)));
                }
            }
            place += block.len();
        })?;
        (!found.means.is_empty()).then_some(found)
    }

    /// Makes rows of the means of a record, in the order of time.
    fn mean_maker<'b>(
        &'b self,
        record: usize,
        term: &'b SignalTerm<'_>,
        point: &'b ParameterPoint,
    ) -> impl FnMut(ClosedMean, Range<usize>) -> SampleMean + 'b {
        let curve = &term.signal.curve;
        let mut cell = LaggingCell::new(term.signal.hysteresis.as_ref());
        let mut errors = self.errors.columns.get(record).map(|all| all.iter());
        move |mean, samples| {
            let force = product(&point.at, &mean.columns);
            let lag = cell.lag(force);
            let changes = errors.as_mut().and_then(Iterator::next);
            let moved = changes.map_or(0.0, |changes| product(changes, &self.errors.found));
            let felt = Newtons(force - cell.half() * lag + moved);
            let slope = curve.sensitivity_at(felt);
            let all = mean.columns.iter().chain(changes.into_iter().flatten());
            let mut columns: Vec<f64> = all.map(|column| slope * column).collect();
            let bent = bent_volts(curve, felt, mean.force_variance);
            columns.push(mean.volts - curve.volts_from_newtons(felt).0 - bent);
            let place = ErrorPlace { record, samples, force, lag };
            SampleMean { t: mean.t, count: mean.count, place, columns }
        }
    }

    /// The rows that say where the contact positions were before the records were looked at, for small changes of
    /// the unknowns, which stand behind the errors.
    pub(in super::super) fn push_contacts(&self, points: &[ParameterPoint], joint: &mut Triangle) {
        let errors = self.errors.count;
        let last = errors + self.unknowns.len();
        let mut row = vec![0.0; last + 1];
        for (k, record, error) in self.contact_errors() {
            let Some(term) = &self.signals[record] else { continue };
            row.fill(0.0);
            row[errors + k] = self.depth_mm;
            row[last] = term.contact_mm - points[record].outer.contact * self.depth_mm;
            joint.push(&row, self.sigma_scale / error);
        }
    }

    /// Unknown contact positions of which something is known: which unknown, of which record, with which uncertainty in mm.
    fn contact_errors(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let contact = self.layout().contact();
        self.unknowns.iter().enumerate().filter_map(move |(k, unknown)| {
            let record = unknown.record.or((self.records.len() == 1).then_some(0))?;
            let term = self.signals[record].as_ref().filter(|_| unknown.parameter == contact)?;
            Some((k, record, term.contact_error_mm?))
        })
    }

    /// These unknowns, and the weights of what is known of them.
    pub(in super::super) fn known_contacts(&self) -> Vec<(usize, f64)> {
        let weight = |error: f64| self.depth_mm * self.sigma_scale / error;
        self.contact_errors().map(|(k, _, error)| (k, weight(error))).collect()
    }
}

fn noise_blocks(means: &[SampleMean], weight: f64) -> Vec<NoiseBlock> {
    let length = means.len().div_ceil(NOISE_BLOCKS).max(1);
    let full = means.iter().map(|mean| mean.count).max().unwrap_or(1) * length;
    let blocks = means.chunks(length).enumerate().map(|(place, chunk)| {
        let count = chunk.iter().map(|mean| mean.count).sum();
        let sums = (0..chunk[0].columns.len()).map(|k| {
            let sum: f64 = chunk.iter().map(|mean| mean.count as f64 * mean.columns[k]).sum();
            weight * sum
        });
        NoiseBlock { sums: sums.collect(), count, place }
    });
    blocks.filter(|block| 2 * block.count >= full).collect()
}
