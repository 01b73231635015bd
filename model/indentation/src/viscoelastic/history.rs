//! The depth over time, and what a relaxing specimen remembers of it.

use crate::quadrature::gauss_legendre;
use thiserror::Error;

/// Depths in mm at times in s, straight between the samples and zero before the first: a first depth above zero is a step, and so
/// are two depths at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthHistory {
    /// The samples, behind a knot of depth zero at the time of the first.
    knots: Vec<Knot>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Knot {
    pub time: f64,
    pub depth: f64,
}

/// A history or a modulus without a force.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum HistoryError {
    #[error(
        "there are {times} times and {depths} depths; give one depth for each time, and at least one"
    )]
    Lengths { times: usize, depths: usize },
    #[error("{name} of sample {index} is {value}; give {wanted}")]
    Sample { name: &'static str, index: usize, value: f64, wanted: &'static str },
    #[error(transparent)]
    Value(#[from] crate::InvalidValue),
    #[error(
        "the contact grows again at {time_secs} s after it shrank; end the history before, or take the force of a repeated contact"
    )]
    GrowsAgain { time_secs: f64 },
}

impl DepthHistory {
    /// Refuses what is not finite, times that fall and depths below zero.
    pub fn new(times_secs: &[f64], depths_mm: &[f64]) -> Result<Self, HistoryError> {
        let (times, depths) = (times_secs.len(), depths_mm.len());
        if times != depths || times == 0 {
            return Err(HistoryError::Lengths { times, depths });
        }
        let refused =
            |name, index, value, wanted| Err(HistoryError::Sample { name, index, value, wanted });
        let mut knots = vec![Knot { time: times_secs[0], depth: 0.0 }];
        for (index, (&time, &depth)) in times_secs.iter().zip(depths_mm).enumerate() {
            if !time.is_finite() || time < knots[index].time {
                let wanted = "a number of seconds not before the sample before it";
                return refused("the time", index, time, wanted);
            }
            if !(depth >= 0.0 && depth.is_finite()) {
                return refused("the depth", index, depth, "mm from the contact on, not below 0");
            }
            knots.push(Knot { time, depth });
        }
        Ok(Self { knots })
    }

    pub(crate) fn knots(&self) -> &[Knot] {
        &self.knots
    }
}

/// What a mode remembers: the integral of `exp(-(t - s) / tau) d(depth^exponent)`, and its slope over the logarithm of `tau`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Memory {
    pub value: f64,
    pub slope: f64,
}

/// One relaxation time and one power of the depth.
pub(crate) struct Mode {
    time_secs: f64,
    exponent: f64,
    rule: Vec<(f64, f64)>,
}

/// Nodes of a piece.
const NODES: usize = 8;
/// Ages in relaxation times at which an interval is cut into pieces that the nodes integrate to rounding: the more is forgotten
/// there the longer they are. `exp(-40)` is nothing.
const PIECE_ENDS: [f64; 8] = [2.0, 4.5, 7.5, 11.0, 15.5, 21.5, 30.0, 40.0];

impl Mode {
    pub fn new(time_secs: f64, exponent: f64) -> Self {
        Self { time_secs, exponent, rule: gauss_legendre(NODES, 1.0) }
    }

    /// The memories at the knots.
    pub fn memories(&self, knots: &[Knot]) -> Vec<Memory> {
        let mut memory = Memory::default();
        let rest = knots.windows(2).map(|pair| {
            memory = self.advance(memory, pair[0], pair[1]);
            memory
        });
        [Memory::default()].into_iter().chain(rest).collect()
    }

    /// The memory at `to` of one who remembers `memory` at `from`.
    pub fn advance(&self, memory: Memory, from: Knot, to: Knot) -> Memory {
        // So many times forget all the same; more would be infinite.
        let times = ((to.time - from.time) / self.time_secs).min(1e12);
        let decay = (-times).exp();
        let fresh = match self.exponent == 1.0 {
            true => fresh_of_depth(times, to.depth - from.depth),
            false => self.fresh(times, from.depth, to.depth),
        };
        Memory {
            value: decay * memory.value + fresh.value,
            slope: decay * (memory.slope + times * memory.value) + fresh.slope,
        }
    }

    /// What an interval of so many relaxation times adds.
    fn fresh(&self, times: f64, first: f64, last: f64) -> Memory {
        let depth = |before_end: f64| last - before_end * (last - first);
        let mut sum = Memory::default();
        let mut late = 0.0;
        for end in PIECE_ENDS {
            let early = (end / times).min(1.0);
            for (passed, part) in self.parts(depth(late), depth(early)) {
                let age = times * (late + passed * (early - late));
                let part = part * (-age).exp();
                sum.value += part;
                sum.slope += age * part;
            }
            if early == 1.0 {
                break;
            }
            late = early;
        }
        sum
    }

    /// Where between a later depth and an earlier one, as a share of the time back to the earlier, and how much of
    /// `d(depth^exponent)` is taken there. Over the root of the depth every power of interest is smooth, at zero too.
    pub fn parts(&self, later: f64, earlier: f64) -> impl Iterator<Item = (f64, f64)> {
        let (later_root, earlier_root) = (later.max(0.0).sqrt(), earlier.max(0.0).sqrt());
        let both = later_root + earlier_root;
        let width = if both > 0.0 { (later - earlier) / both } else { 0.0 };
        self.rule.iter().filter(move |_| width != 0.0).map(move |(share, weight)| {
            let root = later_root - share * width;
            let passed = share * (later_root + root) / both;
            let power = 2.0 * self.exponent * root.powf(2.0 * self.exponent - 1.0);
            (passed, weight * width * power)
        })
    }
}

/// What an interval of so many relaxation times adds where the power is one.
fn fresh_of_depth(times: f64, change: f64) -> Memory {
    if times == 0.0 {
        return Memory { value: change, slope: 0.0 };
    }
    let gone = -(-times).exp_m1();
    Memory { value: change * gone / times, slope: change * (gone - times * (-times).exp()) / times }
}
