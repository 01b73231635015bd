//! Durations on a machine that has other work to do.
//!
//! All jobs take turns, round after round, so that a busy minute hits all of them; the least of a
//! job's rounds counts, since other work only adds. Even and odd rounds are two measurements of the
//! same, and their difference says how far a time can be repeated.

use super::TradeExtent;
use palpate_rheology::trade::MeasuredCost;
use palpate_runner::Stopwatch;
use std::ops::ControlFlow;

pub(super) struct Job<'a> {
    /// Evaluations in one call.
    pub per_call: f64,
    pub call: Box<dyn FnMut() + 'a>,
}

/// A batch of calls lasts at least this long, in s: a thousand times what reading the clock takes.
const BATCH: f64 = 5e-3;
const BATCH_QUICK: f64 = 1e-3;

/// Rounds, even in number.
pub(super) fn rounds(extent: TradeExtent) -> usize {
    extent.choose(24, 4)
}

/// The cost of an evaluation of each job; none if a step breaks it off.
pub(super) fn measure(
    jobs: &mut [Job],
    extent: TradeExtent,
    step: &mut dyn FnMut() -> ControlFlow<()>,
) -> Option<Vec<MeasuredCost>> {
    let batch = extent.choose(BATCH, BATCH_QUICK);
    let timed = |job: &mut Job, calls: usize| {
        let watch = Stopwatch::start();
        for _ in 0..calls {
            (job.call)();
        }
        watch.seconds()
    };
    let calls: Vec<usize> = jobs
        .iter_mut()
        .map(|job| {
            let mut calls = 1;
            while timed(job, calls) < batch {
                calls *= 2;
            }
            calls
        })
        .collect();
    let mut rounds_of: Vec<Vec<f64>> = vec![Vec::new(); jobs.len()];
    for _ in 0..rounds(extent) {
        for ((job, &calls), rounds) in jobs.iter_mut().zip(&calls).zip(&mut rounds_of) {
            let evaluations = calls as f64 * job.per_call;
            rounds.push(timed(job, calls) / evaluations * 1e9);
        }
        if step().is_break() {
            return None;
        }
    }
    Some(rounds_of.iter().map(|rounds| cost(rounds)).collect())
}

/// The cost that rounds of measured ns amount to.
fn cost(rounds: &[f64]) -> MeasuredCost {
    let least_of =
        |first: usize| rounds.iter().skip(first).step_by(2).copied().fold(f64::INFINITY, f64::min);
    let (even, odd) = (least_of(0), least_of(1));
    let ns = even.min(odd);
    let mut sorted = rounds.to_vec();
    sorted.sort_by(f64::total_cmp);
    MeasuredCost {
        ns,
        spread: sorted[sorted.len() / 2] / ns - 1.0,
        halves: even.max(odd) / ns - 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_counts_and_the_halves_are_compared() {
        let MeasuredCost { ns, spread, halves } = cost(&[20.0, 12.0, 10.0, 30.0]);
        assert_eq!(ns, 10.0);
        assert!((spread - 1.0).abs() < 1e-12);
        assert!((halves - 0.2).abs() < 1e-12);
    }

    #[test]
    fn every_job_is_called_in_every_round() {
        let counts = [std::cell::Cell::new(0u64), std::cell::Cell::new(0u64)];
        let mut jobs: Vec<Job> = counts
            .iter()
            .map(|count| Job {
                per_call: 2.0,
                call: Box::new(|| {
                    for _ in 0..1000 {
                        count.set(std::hint::black_box(count.get() + 1));
                    }
                }),
            })
            .collect();
        let mut steps = 0;
        let mut step = || {
            steps += 1;
            ControlFlow::Continue(())
        };
        let costs = measure(&mut jobs, TradeExtent::Quick, &mut step).unwrap();
        assert_eq!((costs.len(), steps), (2, rounds(TradeExtent::Quick)));
        drop(jobs);
        for (cost, count) in costs.iter().zip(&counts) {
            assert!(cost.ns > 0.0 && cost.ns.is_finite());
            assert!(count.get() >= 1000 * rounds(TradeExtent::Quick) as u64);
        }
    }
}
