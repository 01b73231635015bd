//! The live trace as the points a plot borrows. Converted when the trace changed, never per frame.

use egui_plot::{Line, PlotPoint, PlotPoints};
use palpate_model::rig::Phase;
use palpate_model::signal::{LiveTrace, TracePoint};
use palpate_protocols::runner::RunView;
use std::ops::Range;
use std::sync::Arc;

/// Most separate stretches of one line. A recording with more gaps than this is drawn as far as
/// that and says so.
const STRETCHES_MAX: usize = 64;

/// Points of one line, in stretches without gaps.
#[derive(Debug, Default)]
pub(super) struct Series {
    points: Vec<PlotPoint>,
    stretches: Vec<Range<usize>>,
    is_cut: bool,
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

    /// The newest point.
    pub fn last(&self) -> Option<PlotPoint> {
        self.points.last().copied()
    }

    #[cfg(test)]
    fn lengths(&self) -> Vec<usize> {
        self.stretches.iter().map(Range::len).collect()
    }
}

/// What both plots draw from.
#[derive(Debug, Default)]
pub struct PlotCache {
    trace: Option<Arc<LiveTrace>>,
    pub(super) force_time: Series,
    pub(super) force_depth: Series,
    pub(super) samples_per_bucket: u64,
    conversions: u64,
}

impl PlotCache {
    /// Takes over a run's history, if it changed.
    pub fn update(&mut self, run: Option<&RunView>) {
        let Some(run) = run else {
            return;
        };
        if !self
            .trace
            .as_ref()
            .is_some_and(|trace| Arc::ptr_eq(trace, &run.trace))
        {
            self.convert(&run.trace);
        }
    }

    fn convert(&mut self, trace: &Arc<LiveTrace>) {
        let points = trace.points();
        self.force_time.set(&points, |point| [point.t, point.force]);
        self.force_depth
            .set(&points, |point| [point.depth, point.force]);
        self.samples_per_bucket = trace.samples_per_bucket();
        self.conversions += 1;
        self.trace = Some(Arc::clone(trace));
    }

    /// What a reader of the plots must know: that they are thinned or cut. `None` if they are whole.
    #[must_use]
    pub fn remark(&self) -> Option<String> {
        if self.force_time.is_cut || self.force_depth.is_cut {
            return Some("too many gaps to draw; the session holds everything".into());
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
    run.phases
        .iter()
        .enumerate()
        .map(move |(i, (start, phase))| PhaseSpan {
            phase: *phase,
            start: *start,
            end: run.phases.get(i + 1).map_or(now, |(end, _)| *end),
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::{Depth, Newtons, Seconds};

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
        assert!(
            series
                .points
                .iter()
                .all(|point| point.x.is_finite() && point.y.is_finite())
        );
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
    fn thinning_is_said() {
        let mut trace = LiveTrace::new(4);
        let mut cache = PlotCache::default();
        trace.push(Seconds(0.0), Depth(0.0), Newtons(1.0));
        cache.convert(&Arc::new(trace.clone()));
        assert_eq!(cache.remark(), None);
        for i in 1..40 {
            trace.push(Seconds(f64::from(i)), Depth(0.0), Newtons(1.0));
        }
        cache.convert(&Arc::new(trace));
        assert!(
            cache
                .remark()
                .unwrap()
                .starts_with("thinned to min/max of ")
        );
        assert_eq!(cache.conversions, 2);
    }
}
