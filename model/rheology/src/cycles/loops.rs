//! One cycle after the other: peak, energy, where on the depth axis the loop lies.

use super::creep::{Creep, creep};
use super::local::{bins, last_rise, mean, parabola};
use super::relaxation::{StressRelaxation, relaxation};
use super::{CycleSample, Estimate};
use palpate_model::rig::Phase;
use palpate_model::signal::work;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};

/// Forces at which the position of a loop is measured, as shares of the first cycle's peak above its start: where the force
/// begins to rise, at the foot of the loop, and halfway up.
pub const LEVELS: [f64; 3] = [0.02, 0.1, 0.5];
/// Which of [`LEVELS`] is halfway.
const HALF: usize = 2;

/// Last part of loading from which the force at the turning point is read, and half the window of a stiffness:
/// a twentieth is short beside the curvature of tissue and long beside noise.
const NEAR: f64 = 0.05;
/// First part of loading over which the force at the start is averaged.
const START: f64 = 0.01;

/// The depth at which loading last rose through a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelDepth {
    pub force: Newtons,
    pub depth: Estimate<Depth>,
}

/// Slope of force over depth on loading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness {
    pub depth: Depth,
    /// Tangent of a parabola through a tenth of the way around, in N/mm.
    pub slope: Estimate<f64>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct CycleAnalysis {
    /// Its number in the record.
    pub cycle: u32,
    /// Time at its first sample.
    pub start: Seconds,
    pub duration: Seconds,
    /// Mean speed of loading.
    pub speed: MmPerS,
    /// Greatest depth of loading.
    pub depth_peak: Depth,
    /// Force over the first hundredth of loading: what is left of the cycle before, or drift.
    pub force_start: Option<Estimate<Newtons>>,
    /// Force at the turning point, read from the last twentieth of loading.
    pub force_peak: Estimate<Newtons>,
    /// Energy that loading took, in N*mm.
    pub work_loading: f64,
    /// Energy that the whole loop dissipates, in N*mm; `None` where unloading was not recorded, or where the probe did more
    /// between loading and unloading than hold its depth.
    pub work_loop: Option<f64>,
    /// Depths at [`LEVELS`]; `None` where the force never rises through one.
    pub levels: [Option<LevelDepth>; 3],
    /// Stiffness at the depth asked for.
    pub stiffness: Option<Stiffness>,
    /// The hold of the depth that follows loading, if there was one of twenty samples.
    pub relaxation: Option<StressRelaxation>,
    /// The holds of a force of twenty samples or more, one for each step of the plan.
    pub creep: Vec<Creep>,
}

impl CycleAnalysis {
    /// Energy kept over energy taken, 0 to 1 for tissue that makes none.
    pub fn loss_share(&self) -> Option<f64> {
        let share = self.work_loop? / self.work_loading;
        share.is_finite().then_some(share)
    }

    /// Depth at half the first peak.
    pub fn depth_at_half_peak(&self) -> Option<Depth> {
        self.levels[HALF].map(|level| level.depth.value)
    }
}

/// Analyses every cycle of a record in order of time. Cycles without loading are left out; `at` is the depth of the
/// stiffness, 80 % of the first cycle's depth if none is given; `pulse` is the least step of the depth, where it is
/// known.
#[must_use]
pub fn analyse_cycles(
    samples: &[CycleSample],
    at: Option<Depth>,
    pulse: Option<Depth>,
) -> Vec<CycleAnalysis> {
    let mut cycles: Vec<CycleAnalysis> = Vec::new();
    let mut levels = None;
    let of_cycles: Vec<CycleSample> =
        samples.iter().filter(|one| is_of_cycle(one.phase)).copied().collect();
    // Steps of one cycle, as in a relaxation in several steps, each have loading.
    let is_same = |one: &CycleSample, next: &CycleSample| {
        one.cycle == next.cycle && (next.phase != Phase::Ramp || one.phase == Phase::Ramp)
    };
    for cycle in of_cycles.chunk_by(is_same) {
        let Some(way) = LoadingPath::of(cycle) else {
            continue;
        };
        let force_start = way.force_start();
        let levels = *levels.get_or_insert_with(|| {
            let start = force_start.map_or(0.0, |start| start.value.0);
            LEVELS.map(|share| start + share * (way.force_peak.value.0 - start))
        });
        let at = at.or(cycles.first().and_then(|first| Some(first.stiffness?.depth)));
        let at = at.unwrap_or(Depth(0.8 * way.depth_peak));
        cycles.push(way.analysis(cycle, force_start, (levels, at), pulse));
    }
    cycles
}

/// Slope of force over depth on loading around a depth; `None` outside loading or with too few samples.
#[must_use]
pub fn stiffness_at(way_in: &[[f64; 2]], at: Depth) -> Option<Stiffness> {
    let (low, high) = reach(way_in);
    if !(low..=high).contains(&at.0) {
        return None;
    }
    let half = NEAR * (high - low);
    let near: Vec<[f64; 2]> =
        way_in.iter().filter(|point| (point[0] - at.0).abs() <= half).copied().collect();
    Some(Stiffness { depth: at, slope: Estimate::of(|slope| slope, parabola(&near, at.0)?.slope) })
}

fn is_of_cycle(phase: Phase) -> bool {
    matches!(phase, Phase::Ramp | Phase::Hold | Phase::Creep | Phase::Sine | Phase::Unload)
}

fn reach(points: &[[f64; 2]]) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| {
        (low.min(point[0]), high.max(point[0]))
    })
}

/// The ramp of a cycle as depth and force.
struct LoadingPath {
    points: Vec<[f64; 2]>,
    duration: f64,
    depth_start: f64,
    depth_peak: f64,
    force_peak: Estimate<Newtons>,
}

impl LoadingPath {
    fn of(cycle: &[CycleSample]) -> Option<Self> {
        let ramp: Vec<&CycleSample> = cycle.iter().filter(|one| one.phase == Phase::Ramp).collect();
        let (first, last) = (*ramp.first()?, *ramp.last()?);
        let points: Vec<[f64; 2]> = ramp.iter().map(|one| [one.depth.0, one.force.0]).collect();
        let (depth_start, depth_peak) = reach(&points);
        let way = depth_peak - depth_start;
        if points.len() < 20 || way <= 0.0 {
            return None;
        }
        let end: Vec<[f64; 2]> =
            points.iter().filter(|point| point[0] >= depth_peak - NEAR * way).copied().collect();
        let force_peak = match parabola(&end, depth_peak) {
            Some(local) => local.value,
            // A sparse record: the last sample, as uncertain as its noise.
            None => [last.force.0, bins(&points).last()?[2]],
        };
        Some(Self {
            duration: last.t.0 - first.t.0,
            depth_start,
            depth_peak,
            force_peak: Estimate::of(Newtons, force_peak),
            points,
        })
    }

    fn force_start(&self) -> Option<Estimate<Newtons>> {
        let end = self.depth_start + START * (self.depth_peak - self.depth_start);
        let first = self.points.iter().filter(|point| point[0] <= end);
        let found = mean(first.map(|point| point[1]))?;
        Some(Estimate::of(Newtons, found))
    }

    /// The depth at which the force last rose through a level, and its standard error: found between bins, then
    /// read from a parabola around, which averages more noise.
    fn depth_of(&self, level: f64, bins: &[[f64; 3]]) -> Option<[f64; 2]> {
        let coarse = last_rise(bins, level)?;
        let half = 0.5 * NEAR * (self.depth_peak - self.depth_start);
        let near: Vec<[f64; 2]> = self
            .points
            .iter()
            .filter(|point| (point[0] - coarse[0]).abs() <= half)
            .copied()
            .collect();
        let Some(local) = parabola(&near, coarse[0]) else {
            return Some(coarse);
        };
        let ([value, error], [slope, _]) = (local.value, local.slope);
        let step = (level - value) / slope;
        // Where the force hardly rises a tangent leads astray.
        let is_near = slope > 0.0 && step.abs() <= half;
        Some(if is_near { [coarse[0] + step, error / slope] } else { coarse })
    }

    fn analysis(
        &self,
        cycle: &[CycleSample],
        force_start: Option<Estimate<Newtons>>,
        (levels, at): ([f64; 3], Depth),
        pulse: Option<Depth>,
    ) -> CycleAnalysis {
        let start = cycle.first().map_or(0.0, |one| one.t.0);
        // A sine has its own table.
        let last = cycle.iter().rfind(|one| one.phase != Phase::Sine);
        let end = last.map_or(0.0, |one| one.t.0);
        let bins = bins(&self.points);
        let has = |phase: Phase| cycle.iter().any(|one| one.phase == phase);
        let is_loop = has(Phase::Unload) && !has(Phase::Creep) && !has(Phase::Sine);
        let of = |phase: Phase| cycle.iter().filter(move |one| one.phase == phase);
        // A hold after a creep or a sine does not begin at the peak.
        let held: Vec<[f64; 2]> = cycle
            .iter()
            .skip_while(|one| one.phase == Phase::Ramp)
            .take_while(|one| one.phase == Phase::Hold)
            .map(|one| [one.t.0, one.force.0])
            .collect();
        let is_one_step = |one: &CycleSample, next: &CycleSample| {
            (one.phase, one.step) == (next.phase, next.step)
        };
        let creeping = cycle.chunk_by(is_one_step).filter(|part| part[0].phase == Phase::Creep);
        CycleAnalysis {
            cycle: cycle.first().map_or(0, |one| one.cycle),
            start: Seconds(start),
            duration: Seconds(end - start),
            speed: MmPerS((self.depth_peak - self.depth_start) / self.duration),
            depth_peak: Depth(self.depth_peak),
            force_start,
            force_peak: self.force_peak,
            work_loading: work(of(Phase::Ramp).map(|one| (one.depth, one.force))),
            work_loop: is_loop.then(|| work(cycle.iter().map(|one| (one.depth, one.force)))),
            levels: levels.map(|level| {
                Some(LevelDepth {
                    force: Newtons(level),
                    depth: Estimate::of(Depth, self.depth_of(level, &bins)?),
                })
            }),
            stiffness: stiffness_at(&self.points, at),
            relaxation: relaxation(&held, self.force_peak),
            creep: creeping.filter_map(|part| creep(part, pulse)).collect(),
        }
    }
}
