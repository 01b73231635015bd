//! Standard errors that allow for autocorrelated residuals.

use super::inflation::{freedom, inflation, triangle};
use super::passes::{RecordFactor, UnknownPlace};
use super::refine::RefinedFit;
use super::solve::FitSolution;
use super::system::{Rows, System};
use super::triangle::Factor;
use palpate_model::autocorrelation::{BlockedResiduals, Memory, memory};

/// A search coordinate this close to an end of the searched range is at the end.
const EDGE: f64 = 1e-3;
/// A scaled contact this close to the shallowest depth was stopped there.
const CONTACT_EDGE: f64 = 1e-6;

/// Mean square of rounding errors, relative to that of the forces: 1e-12 of a force.
const ROUNDING: f64 = 1e-24;

/// Share of a parameter over which what is derived from it is differenced.
pub(super) const DIFFERENCE: f64 = 1e-6;

/// Scatter and autocorrelation of the residuals of all records.
#[derive(Clone, Debug)]
pub(super) struct Uncertainty {
    /// Standard deviation of weighted residuals; `None` without a spare sample.
    pub scatter: Option<f64>,
    /// Blocks, memory, and variance of the weighted residuals.
    records: Vec<(BlockedResiduals, Option<Memory>, f64)>,
    block_factor: Factor,
    /// The joint triangle with drift of a larger variance, and how well that variance is known; where signals are fitted.
    drift: Option<(Factor, f64)>,
    /// Unknowns of which something was known before, and their weights.
    contacts: Vec<(usize, f64)>,
}

/// Factor on the variance of drift from whose effect its share is taken.
const DRIFT_STEP: f64 = 1.1;

/// The drift's share of a variance, from the standard error with the drift as it is and with more of it.
pub(super) fn drift_share(error: f64, with_more: f64) -> f64 {
    let more = (with_more / error).powi(2) - 1.0;
    (more / (DRIFT_STEP - 1.0)).clamp(0.0, 1.0)
}

impl System<'_> {
    /// The same with drift of a larger variance.
    pub(super) fn with_more_drift(&self) -> Self {
        let mut other = self.clone();
        for term in other.signals.iter_mut().flatten() {
            term.drift.walk *= DRIFT_STEP.sqrt();
        }
        other
    }
}

fn more_drift(system: &System<'_>, refined: &RefinedFit) -> Option<(Factor, f64)> {
    let terms = system.signals.iter().flatten();
    let known = terms.fold(0.0f64, |known, term| known.max(term.drift.spread));
    Some((system.with_more_drift().pass(&refined.points, Rows::All)?.joint, known))
}

/// One parameter's uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UncertaintyEstimate {
    pub std_error: f64,
    /// Variance over that of independent noise.
    pub inflation: f64,
    /// Degrees of freedom of Student's t.
    pub freedom: f64,
    /// Shares of the variance that the drift of the zero and the contact position have; `None` where no signal was fitted.
    pub shares: Option<[f64; 2]>,
}

impl Uncertainty {
    pub fn of(system: &System<'_>, refined: &RefinedFit) -> Self {
        let unknowns = system.unknowns.len();
        let spare = system.measured() - unknowns;
        let scatter = (spare > 0).then(|| (refined.sum / spare as f64).sqrt());
        let change = &refined.change;
        let blocks: Vec<BlockedResiduals> = refined
            .pass
            .records
            .iter()
            .enumerate()
            .map(|(record, factor)| {
                let map = system.map(record, unknowns);
                residual_blocks(factor, &map, change)
            })
            .collect();
        let white = scatter.unwrap_or(0.0).powi(2);
        let forces = system.force_square() / system.measured() as f64;
        // The residual of a record without noise is rounding, whose autocorrelation means nothing.
        let is_rounding = white <= ROUNDING * forces;
        let block_factor = triangle(blocks.iter(), unknowns).finish();
        let alone: Vec<bool> = (0..unknowns).map(|k| is_of_one(&blocks, k)).collect();
        let records = blocks
            .into_iter()
            .enumerate()
            .map(|(record, blocks)| {
                // Records may scatter differently from what their sigmas say.
                let own = own_variance(system, refined, record).unwrap_or(white);
                let memory = match is_rounding {
                    true => Some(Memory::none(white)),
                    false => memory(&blocks, &alone, own),
                };
                (blocks, memory, own)
            })
            .collect();
        let drift = system.has_signal().then(|| more_drift(system, refined)).flatten();
        let contacts = system.known_contacts();
        Self { scatter, records, block_factor, drift, contacts }
    }

    /// Samples in a block of a record.
    pub fn block_length(&self, record: usize) -> f64 {
        self.records[record].0.length
    }

    /// Variance of the weighted residuals of a record.
    pub fn variance(&self, record: usize) -> f64 {
        self.records[record].2
    }

    /// Autocorrelation of the residuals of a record; `None` where it is too short to show any.
    pub fn memory(&self, record: usize) -> Option<Memory> {
        self.records[record].1
    }

    /// Number of independent samples that carry the information of this record.
    pub fn effective_samples(&self, record: usize, samples: usize) -> f64 {
        let samples = samples as f64;
        match self.memory(record) {
            Some(memory) if memory.long_run() > 0.0 => {
                (samples * self.variance(record) / memory.long_run()).clamp(1.0, samples)
            }
            _ => samples,
        }
    }

    /// The uncertainty of a combination of unknowns; `None` where there is nothing to judge it by.
    pub fn error(
        &self,
        refined: &RefinedFit,
        combination: &[f64],
        spare: f64,
    ) -> Option<UncertaintyEstimate> {
        let scatter = self.scatter?;
        let independent = scatter * refined.pass.joint.deviation(combination);
        let white = scatter * scatter;
        let (inflation, uncertainty) =
            inflation(&self.records, &self.block_factor, combination, white);
        let std_error = independent * inflation.sqrt();
        // The drift's share of the variance is no better known than the drift (Welch and Satterthwaite, JCGM 100:2008,
        // G.4).
        let shares = self.drift.as_ref().map(|(factor, _)| {
            let drift = drift_share(independent, scatter * factor.deviation(combination));
            let influence = refined.pass.joint.influence(combination);
            let prior = self.contacts.iter().map(|(k, weight)| (weight * influence[*k]).powi(2));
            let contact = prior.sum::<f64>() * (scatter / independent).powi(2);
            [drift, contact.clamp(0.0, 1.0)]
        });
        let known = self.drift.as_ref().map_or(0.0, |(_, known)| *known);
        let uncertainty = uncertainty + shares.map_or(0.0, |[drift, _]| known * drift * drift);
        let freedom = freedom(spare, uncertainty);
        std_error.is_finite().then_some(UncertaintyEstimate {
            std_error,
            inflation,
            freedom,
            shares,
        })
    }
}

/// Whether an unknown acts on no more than one record.
fn is_of_one(blocks: &[BlockedResiduals], unknown: usize) -> bool {
    let acts =
        |blocks: &&BlockedResiduals| blocks.columns[unknown].iter().any(|&value| value != 0.0);
    blocks.iter().filter(acts).count() < 2
}

/// Variance of the weighted residuals of one of several records; `None` for the only one, where
/// it is the joint one, and for one without spare samples.
fn own_variance(system: &System<'_>, refined: &RefinedFit, record: usize) -> Option<f64> {
    if system.records.len() == 1 {
        return None;
    }
    // Its share of the unknowns, as if they were spread over the samples.
    let measured = system.records[record].measured as f64;
    let all = system.measured() as f64;
    let spare = measured * (1.0 - system.unknowns.len() as f64 / all);
    (spare > 0.0).then(|| residual_square(system, refined, record) / spare)
}

/// Sum of squared weighted residuals of a record.
fn residual_square(system: &System<'_>, refined: &RefinedFit, record: usize) -> f64 {
    let factor = &refined.pass.records[record].factor;
    let map = system.map(record, refined.change.len());
    let residual = |i: usize| {
        let row = factor.row(i);
        let pairs = map.iter().zip(&refined.change);
        let explained: f64 = pairs.map(|(column, value)| column.of(row) * value).sum();
        row[factor.width() - 1] - explained
    };
    (0..factor.width()).map(|i| residual(i).powi(2)).sum()
}

fn residual_blocks(
    record: &RecordFactor,
    map: &[UnknownPlace],
    solution: &[f64],
) -> BlockedResiduals {
    let (sums, last) = (&record.blocks, record.factor.width() - 1);
    let mut blocks = BlockedResiduals {
        residuals: Vec::with_capacity(sums.len()),
        columns: vec![Vec::with_capacity(sums.len()); map.len()],
        places: sums.iter().map(|block| block.place).collect(),
        length: sums.first().map_or(1.0, |block| block.count as f64),
    };
    for block in sums {
        let over_root = 1.0 / (block.count as f64).sqrt();
        let mut residual = block.sums[last];
        for ((column, mapped), value) in blocks.columns.iter_mut().zip(map).zip(solution) {
            let entry = mapped.of(&block.sums);
            column.push(entry * over_root);
            residual -= value * entry;
        }
        blocks.residuals.push(residual * over_root);
    }
    blocks
}

/// An end of a searched range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RangeEnd {
    Low,
    High,
}

impl FitSolution<'_> {
    /// Scatter and autocorrelation, found once.
    pub(super) fn uncertainty(&self) -> &Uncertainty {
        self.uncertainty.get_or_init(|| Uncertainty::of(&self.system, &self.refined))
    }

    /// Which end of its searched range an outer parameter of a record lies at.
    pub(super) fn range_end(&self, record: usize, outer: usize) -> Option<RangeEnd> {
        let (low, high) = self.system.ranges[record].outers[outer];
        let value = self.refined.points[record].outer.values[outer];
        let z = self.system.coordinate(outer, value);
        match self.system.fixed(record, outer) {
            Some(_) => None,
            None if z < low + EDGE => Some(RangeEnd::Low),
            None if z > high - EDGE => Some(RangeEnd::High),
            None => None,
        }
    }

    /// Whether the contact was stopped at the shallowest depth.
    pub(super) fn is_contact_at_start(&self, record: usize) -> bool {
        let contact = self.refined.points[record].outer.contact;
        let (shallowest, _) = self.system.ranges[record].contact;
        self.system.is_contact_free(record) && contact < shallowest + CONTACT_EDGE
    }

    /// The uncertainty of every parameter of a record, `None` where fixed or not determined; then that of what is
    /// derived from them, to first order.
    pub(super) fn estimates(&self, record: usize) -> Vec<Option<UncertaintyEstimate>> {
        let uncertainty = self.uncertainty();
        let spare = (self.system.measured() - self.system.unknowns.len()) as f64;
        let combinations = self.combinations(record).into_iter();
        combinations.map(|one| uncertainty.error(&self.refined, &one?, spare)).collect()
    }

    /// Every parameter of a record as a combination of small changes of the unknowns, `None` where fixed or not determined;
    /// then what is derived from them.
    pub(super) fn combinations(&self, record: usize) -> Vec<Option<Vec<f64>>> {
        let layout = self.system.layout();
        let point = &self.refined.points[record];
        let is_stopped = |parameter: usize| match parameter {
            k if k < layout.outers => self.range_end(record, k).is_some(),
            k => k == layout.contact() && self.is_contact_at_start(record),
        };
        let of = |parameter: usize| self.system.combination(record, parameter, point);
        let own = (0..layout.count()).map(|parameter| {
            let is_free = self.system.fixed(record, parameter).is_none();
            (is_free && !is_stopped(parameter)).then(|| of(parameter))
        });
        let derived = self.gradients(record).into_iter().map(|gradient| {
            let mut combination = vec![0.0; self.system.unknowns.len()];
            for (parameter, share) in gradient.into_iter().enumerate() {
                if share != 0.0 && is_stopped(parameter) {
                    return None;
                }
                for (sum, one) in combination.iter_mut().zip(of(parameter)) {
                    *sum += share * one;
                }
            }
            Some(combination)
        });
        own.chain(derived).collect()
    }

    /// Derivatives of what is derived from a record's body by its parameters, those that are free.
    fn gradients(&self, record: usize) -> Vec<Vec<f64>> {
        let layout = self.system.layout();
        let values = self.system.physical_values(record, &self.refined.points[record]);
        let body = &values[..layout.outers + layout.coefficients];
        let derived = |body: &[f64]| {
            let (outer, linear) = body.split_at(layout.outers);
            self.system.source.family.derived(outer, linear)
        };
        let columns = (0..body.len()).map(|k| {
            let step = DIFFERENCE * body[k].abs().max(f64::MIN_POSITIVE);
            let [up, down] = [step, -step].map(|step| {
                let mut moved = body.to_vec();
                moved[k] += step;
                derived(&moved)
            });
            let is_free = self.system.fixed(record, k).is_none();
            let pairs = up.into_iter().zip(down);
            let slopes = pairs.map(|(up, down)| (up.value - down.value) / (2.0 * step));
            slopes.map(|slope| if is_free { slope } else { 0.0 }).collect()
        });
        let columns: Vec<Vec<f64>> = columns.collect();
        let count = columns.first().map_or(0, Vec::len);
        (0..count).map(|k| columns.iter().map(|column| column[k]).collect()).collect()
    }
}
