//! Standard errors that allow for the memory of the residuals.

use super::block_sums::NoiseBlock;
use super::noise::{self, Blocks, Memory};
use super::options::{CONTACT, PARAMETER_NAMES, TAU};
use super::system::{Mapped, System};
use super::triangle::Factor;
use super::{refine::Refined, solve::Fitted};

/// `ln tau` this close to an end of the searched range is at the end.
const EDGE: f64 = 1e-3;
/// A scaled contact this close to the shallowest depth was stopped there.
const CONTACT_EDGE: f64 = 1e-6;

/// Mean square of rounding errors, relative to that of the forces: 1e-12 of a force.
const ROUNDING: f64 = 1e-24;

/// What the residuals of all records say.
pub(super) struct Uncertainty {
    /// Standard deviation of weighted residuals; `None` without a spare sample.
    pub scatter: Option<f64>,
    /// Blocks, memory, and variance of the weighted residuals.
    records: Vec<(Blocks, Option<Memory>, f64)>,
    block_factor: Factor,
}

/// One parameter's uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Error {
    pub std_error: f64,
    /// Variance over that of independent noise.
    pub inflation: f64,
    /// Degrees of freedom of Student's t.
    pub freedom: f64,
}

impl Uncertainty {
    pub fn of(system: &System<'_>, refined: &Refined) -> Self {
        let unknowns = system.unknowns.len();
        let spare = system.measured() - unknowns;
        let scatter = (spare > 0).then(|| (refined.sum / spare as f64).sqrt());
        let change = refined.pass.joint.solve(unknowns);
        let blocks: Vec<Blocks> = refined
            .pass
            .records
            .iter()
            .enumerate()
            .map(|(record, factor)| {
                let map = system.map(record, true);
                blocks(system, &factor.blocks, &map, &change)
            })
            .collect();
        let white = scatter.unwrap_or(0.0).powi(2);
        let forces = system.force_square() / system.measured() as f64;
        // What is left of a record without noise is rounding, whose memory means nothing.
        let is_rounding = white <= ROUNDING * forces;
        let block_factor = noise::triangle(blocks.iter(), unknowns).finish();
        let records = blocks
            .into_iter()
            .enumerate()
            .map(|(record, blocks)| {
                // Records may scatter differently from what their sigmas say.
                let own = own_variance(system, refined, record, &change).unwrap_or(white);
                let memory = match is_rounding {
                    true => Some(Memory::none(white)),
                    false => noise::memory(&blocks, own),
                };
                (blocks, memory, own)
            })
            .collect();
        Self {
            scatter,
            records,
            block_factor,
        }
    }

    /// Samples in a block of a record.
    pub fn block_length(&self, record: usize) -> f64 {
        self.records[record].0.length
    }

    /// Variance of the weighted residuals of a record.
    pub fn variance(&self, record: usize) -> f64 {
        self.records[record].2
    }

    /// What the residuals of a record remember; `None` where it is too short to tell.
    pub fn memory(&self, record: usize) -> Option<Memory> {
        self.records[record].1
    }

    /// The uncertainty of a combination of unknowns; `None` where there is nothing to judge it by.
    pub fn error(&self, refined: &Refined, combination: &[f64], spare: f64) -> Option<Error> {
        let scatter = self.scatter?;
        let independent = scatter * refined.pass.joint.deviation(combination);
        let white = scatter * scatter;
        let (inflation, uncertainty) =
            noise::inflation(&self.records, &self.block_factor, combination, white);
        let std_error = independent * inflation.sqrt();
        let freedom = if uncertainty > 0.0 {
            spare.min(2.0 / uncertainty)
        } else {
            spare
        };
        std_error.is_finite().then_some(Error {
            std_error,
            inflation,
            freedom,
        })
    }
}

/// Variance of the weighted residuals of one of several records; `None` for the only one, where
/// it is the joint one, and for one without spare samples.
fn own_variance(
    system: &System<'_>,
    refined: &Refined,
    record: usize,
    change: &[f64],
) -> Option<f64> {
    if system.records.len() == 1 {
        return None;
    }
    let factor = &refined.pass.records[record].factor;
    let map = system.map(record, true);
    let square: f64 = (0..factor.width())
        .map(|i| {
            let row = factor.row(i);
            let explained = map.iter().zip(change);
            let explained: f64 = explained
                .map(|(column, value)| column.of(row) * value)
                .sum();
            (row[factor.width() - 1] - explained).powi(2)
        })
        .sum();
    // Its share of the unknowns, as if they were spread over the samples.
    let measured = system.records[record].measured as f64;
    let all = system.measured() as f64;
    let spare = measured * (1.0 - system.unknowns.len() as f64 / all);
    (spare > 0.0).then(|| square / spare)
}

fn blocks(system: &System<'_>, sums: &[NoiseBlock], map: &[Mapped], solution: &[f64]) -> Blocks {
    let last = sums.first().map_or(0, |_| width(system) - 1);
    let mut blocks = Blocks {
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

/// Columns of a record's triangle.
fn width(system: &System<'_>) -> usize {
    let slopes = [TAU, CONTACT]
        .iter()
        .filter(|&&k| system.fixed(k).is_none());
    7 + slopes.count()
}

impl Fitted<'_> {
    /// Which end of the searched relaxation times the one of a record lies at.
    pub(super) fn edge(&self, record: usize) -> Option<&'static str> {
        let (low, high) = self.ranges[record].log_tau;
        let log_tau = self.refined.points[record].outer.tau.ln();
        match self.system.fixed(TAU) {
            Some(_) => None,
            None if log_tau < low + EDGE => Some("short"),
            None if log_tau > high - EDGE => Some("long"),
            None => None,
        }
    }

    /// Whether the contact was stopped at the shallowest depth.
    pub(super) fn is_contact_at_start(&self, record: usize) -> bool {
        let contact = self.refined.points[record].outer.contact;
        self.system.fixed(CONTACT).is_none()
            && contact < self.ranges[record].contact.0 + CONTACT_EDGE
    }

    /// The uncertainty of every parameter of a record, `None` where fixed or not determined.
    pub(super) fn errors(&self, uncertainty: &Uncertainty, record: usize) -> [Option<Error>; 8] {
        let spare = (self.system.measured() - self.system.unknowns.len()) as f64;
        std::array::from_fn(|parameter| {
            debug_assert!(parameter < PARAMETER_NAMES.len());
            let is_stopped = match parameter {
                TAU => self.edge(record).is_some(),
                CONTACT => self.is_contact_at_start(record),
                _ => false,
            };
            if self.system.fixed(parameter).is_some() || is_stopped {
                return None;
            }
            let point = &self.refined.points[record];
            let combination = self.system.combination(record, parameter, point);
            uncertainty.error(&self.refined, &combination, spare)
        })
    }
}
