//! The live trace as the points a plot borrows. Converted when the trace changed, never per frame.

use egui_plot::{FilledArea, Line, PlotPoint, PlotPoints};
use palpate_model::calibration::{Calibration, ForceUncertainty};
use palpate_model::rig::Phase;
use palpate_model::signal::{LiveTrace, TracePoint};
use palpate_model::units::Newtons;
use palpate_runner::RunView;
use std::ops::Range;
use std::sync::Arc;

/// Most separate stretches of one line. A recording with more gaps than this is drawn as far as
/// that and says so.
const STRETCHES_MAX: usize = 64;

/// The band around a force reaches so many standard uncertainties of its calibration either way: about 95 %
/// (JCGM 100:2008, 6.3.3).
const BAND_SIGMAS: f64 = 2.0;

/// Points of one line, in stretches without gaps.
#[derive(Debug, Default)]
pub(super) struct Series {
    points: Vec<PlotPoint>,
    stretches: Vec<Range<usize>>,
    is_cut: bool,
    /// Abscissa, lower and upper edge of the band at each point; empty where no uncertainty is stated.
    band: [Vec<f64>; 3],
}

impl Series {
    /// Converts points; those with a number that is not finite break the line.
    fn set(&mut self, trace: &[TracePoint], coordinates: impl Fn(&TracePoint) -> [f64; 2]) {
        self.points.clear();
        self.stretches.clear();
        self.is_cut = false;
        let mut start = None;
        for point in trace {
            let [x, y] = coordinates(point);
            if x.is_finite() && y.is_finite() {
                start.get_or_insert(self.points.len());
                self.points.push(PlotPoint::new(x, y));
            } else if let Some(start) = start.take() {
                self.stretches.push(start..self.points.len());
                if self.stretches.len() == STRETCHES_MAX {
                    self.is_cut = true;
                    return;
                }
            }
        }
        if let Some(start) = start {
            self.stretches.push(start..self.points.len());
        }
    }

    /// One line per stretch, all of one name.
    pub fn lines(&self, name: &'static str) -> impl Iterator<Item = Line<'_>> {
        self.stretches.iter().enumerate().map(move |(i, range)| {
            Line::new(name, PlotPoints::Borrowed(&self.points[range.clone()]))
                .id((name, i))
                .width(1.5)
        })
    }

    /// Finds the band around the points, whose ordinates are forces.
    fn set_band(&mut self, uncertainty: Option<&ForceUncertainty>) {
        self.band.iter_mut().for_each(Vec::clear);
        for point in &self.points {
            let Some(sigma) = uncertainty.and_then(|own| own.sigma(Newtons(point.y))) else {
                return;
            };
            let half = BAND_SIGMAS * sigma.0;
            for (edge, value) in self.band.iter_mut().zip([point.x, point.y - half, point.y + half])
            {
                edge.push(value);
            }
        }
    }

    /// One band per stretch; none where no uncertainty is stated.
    pub fn bands(&self, name: &'static str) -> impl Iterator<Item = FilledArea> {
        let whole = self.stretches.iter().enumerate();
        let stretches = whole.filter(|(_, range)| range.end <= self.band[0].len());
        stretches.map(move |(i, range)| {
            let [x, low, high] = &self.band;
            let part = |edge: &Vec<f64>| edge[range.clone()].to_vec();
            FilledArea::new(name, &part(x), &part(low), &part(high))
                .id((name, i))
                .allow_hover(false)
        })
    }

    /// The newest point.
    pub fn last(&self) -> Option<PlotPoint> {
        self.points.last().copied()
    }

    #[cfg(test)]
    fn lengths(&self) -> Vec<usize> {
        self.stretches.iter().map(Range::len).collect()
    }
}

/// Loops drawn at once. More lie on each other and cost time in every frame.
const LOOPS_MAX: usize = 24;

/// One repeat of a series in the plot over depth.
#[derive(Debug, Default)]
pub struct CycleLoop {
    /// Its number, from 1.
    pub cycle: u32,
    pub(super) series: Series,
    /// Its highest force and where it was; `None` before there is one.
    pub peak: Option<TracePoint>,
}

/// What both plots draw from.
#[derive(Debug, Default)]
pub struct PlotCache {
    trace: Option<Arc<LiveTrace>>,
    pub(super) force_time: Series,
    pub(super) force_depth: Series,
    /// One for each repeat; empty where nothing is repeated.
    loops: Vec<CycleLoop>,
    pub(super) samples_per_bucket: u64,
    conversions: u64,
    /// Of the forces drawn; `None` where their calibration cannot tell.
    uncertainty: Option<ForceUncertainty>,
}

impl PlotCache {
    /// A cache for forces read with this calibration.
    #[must_use]
    pub fn for_calibration(calibration: &Calibration) -> Self {
        Self { uncertainty: ForceUncertainty::of(calibration).ok(), ..Self::default() }
    }

    /// Takes over a run's history, if it changed.
    pub fn update(&mut self, run: Option<&RunView>) {
        let Some(run) = run else {
            return;
        };
        if !self.trace.as_ref().is_some_and(|trace| Arc::ptr_eq(trace, &run.trace)) {
            let starts: &[_] = if run.cycles > 1 { &run.cycle_starts } else { &[] };
            self.convert(&run.trace, starts);
        }
    }

    fn convert(&mut self, trace: &Arc<LiveTrace>, starts: &[(f64, u32)]) {
        let points = trace.points();
        self.force_time.set(&points, |point| [point.t, point.force]);
        self.force_depth.set(&points, |point| [point.depth, point.force]);
        self.set_loops(&points, starts);
        self.force_time.set_band(self.uncertainty.as_ref());
        self.force_depth.set_band(self.uncertainty.as_ref());
        self.samples_per_bucket = trace.samples_per_bucket();
        self.conversions += 1;
        self.trace = Some(Arc::clone(trace));
    }

    /// Cuts the history at the times at which repeats began.
    fn set_loops(&mut self, points: &[TracePoint], starts: &[(f64, u32)]) {
        let place = |t: f64| points.partition_point(|point| point.t < t);
        self.loops.clear();
        for (i, (start, cycle)) in starts.iter().enumerate() {
            let end = starts.get(i + 1).map_or(points.len(), |(end, _)| place(*end));
            let own = &points[place(*start).min(end)..end];
            let mut series = Series::default();
            if starts.len() - i <= LOOPS_MAX {
                series.set(own, |point| [point.depth, point.force]);
            }
            let known = own.iter().filter(|point| point.force.is_finite());
            self.loops.push(CycleLoop {
                cycle: *cycle,
                series,
                peak: known.copied().max_by(|a, b| a.force.total_cmp(&b.force)),
            });
        }
    }

    /// The repeats so far, oldest first; empty where nothing is repeated.
    pub fn loops(&self) -> &[CycleLoop] {
        &self.loops
    }

    /// The loops that are drawn, oldest first.
    pub(super) fn drawn_loops(&self) -> &[CycleLoop] {
        &self.loops[self.loops.len().saturating_sub(LOOPS_MAX)..]
    }

    /// What a reader of the plots must know: that they are thinned or cut. `None` if they are whole.
    pub fn remark(&self) -> Option<String> {
        if self.force_time.is_cut || self.force_depth.is_cut {
            return Some("too many gaps to draw; the session holds everything".into());
        }
        if self.loops.len() > LOOPS_MAX {
            return Some(format!("over depth the newest {LOOPS_MAX} cycles are drawn"));
        }
        (self.samples_per_bucket > 1)
            .then(|| format!("thinned to min/max of {} samples", self.samples_per_bucket))
    }
}

/// A phase as a stretch of session time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PhaseSpan {
    pub phase: Phase,
    pub start: f64,
    pub end: f64,
}

/// Phases as stretches; the last one reaches until now.
pub(super) fn phase_spans(run: &RunView) -> impl Iterator<Item = PhaseSpan> {
    let now = run.now.seconds().0;
    run.phases.iter().enumerate().map(move |(i, (start, phase))| PhaseSpan {
        phase: *phase,
        start: *start,
        end: run.phases.get(i + 1).map_or(now, |(end, _)| *end),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::{Depth, Seconds};

    fn point(t: f64, depth: f64, force: f64) -> TracePoint {
        TracePoint { t, depth, force }
    }

    #[test]
    fn gaps_break_lines_and_never_reach_the_plot() {
        let nan = f64::NAN;
        let trace = [
            point(0.0, nan, 0.1),
            point(1.0, 0.5, 0.2),
            point(2.0, 0.6, nan),
            point(3.0, 0.7, 0.4),
            point(4.0, 0.8, 0.5),
        ];
        let mut series = Series::default();
        series.set(&trace, |point| [point.t, point.force]);
        assert_eq!(series.lengths(), [2, 2]);
        series.set(&trace, |point| [point.depth, point.force]);
        assert_eq!(series.lengths(), [1, 2]);
        assert!(series.points.iter().all(|point| point.x.is_finite() && point.y.is_finite()));
        assert_eq!(series.lines("force").count(), 2);
    }

    #[test]
    fn a_shredded_recording_is_cut_and_says_so() {
        let trace: Vec<TracePoint> = (0..400)
            .map(|i| point(f64::from(i), 1.0, if i % 2 == 0 { 1.0 } else { f64::NAN }))
            .collect();
        let mut cache = PlotCache::default();
        cache.force_time.set(&trace, |point| [point.t, point.force]);
        assert_eq!(cache.force_time.lengths().len(), STRETCHES_MAX);
        assert!(cache.remark().unwrap().contains("too many gaps"));
    }

    #[test]
    fn the_band_is_as_wide_as_the_calibration_is_unsure() {
        let mut trace = LiveTrace::new(100);
        for i in 0..10 {
            let force = Newtons(f64::from(i));
            trace.push(Seconds(f64::from(i)), Depth(f64::from(i)), force);
        }
        let thesis = Calibration::thesis();
        let mut cache = PlotCache::for_calibration(&thesis);
        cache.convert(&Arc::new(trace.clone()), &[]);
        let sigma = ForceUncertainty::of(&thesis).unwrap().sigma(Newtons(4.0)).unwrap();
        let [x, low, high] = &cache.force_time.band;
        assert_eq!((x.len(), x[4]), (10, 4.0));
        assert!((high[4] - low[4] - 4.0 * sigma.0).abs() < 1e-12);
        assert_eq!(cache.force_depth.bands("band").count(), 1);
        // What states nothing has no band.
        let line = Calibration::linear("line", palpate_model::units::Volts(1.0), 0.1, Newtons(9.0));
        let mut cache = PlotCache::for_calibration(&line);
        cache.convert(&Arc::new(trace), &[]);
        assert_eq!(cache.force_time.bands("band").count(), 0);
    }

    #[test]
    fn every_cycle_is_a_loop_with_its_own_peak() {
        let mut trace = LiveTrace::new(1000);
        for i in 0..30 {
            let (cycle, step) = (i / 10, i % 10);
            let force = f64::from(step) - 0.1 * f64::from(cycle);
            let depth = Depth(f64::from(step));
            trace.push(Seconds(f64::from(i)), depth, Newtons(force));
        }
        let mut cache = PlotCache::default();
        cache.convert(&Arc::new(trace), &[(0.0, 1), (10.0, 2), (20.0, 3)]);
        let peaks: Vec<f64> = cache.loops().iter().map(|one| one.peak.unwrap().force).collect();
        assert_eq!(peaks, [9.0, 8.9, 8.8]);
        assert!(cache.loops().iter().all(|one| one.series.lengths() == [10]));
        let starts: Vec<(f64, u32)> = (0..30).map(|i| (f64::from(i), i + 1)).collect();
        let trace = cache.trace.clone().unwrap();
        cache.convert(&trace, &starts);
        assert_eq!((cache.loops().len(), cache.drawn_loops().len()), (30, LOOPS_MAX));
        assert!(cache.remark().unwrap().contains("newest 24"));
    }

    #[test]
    fn thinning_is_said() {
        let mut trace = LiveTrace::new(4);
        let mut cache = PlotCache::default();
        trace.push(Seconds(0.0), Depth(0.0), Newtons(1.0));
        cache.convert(&Arc::new(trace.clone()), &[]);
        assert_eq!(cache.remark(), None);
        for i in 1..40 {
            trace.push(Seconds(f64::from(i)), Depth(0.0), Newtons(1.0));
        }
        cache.convert(&Arc::new(trace), &[]);
        assert!(cache.remark().unwrap().starts_with("thinned to min/max of "));
        assert_eq!(cache.conversions, 2);
    }
}
