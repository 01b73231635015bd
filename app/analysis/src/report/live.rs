//! The plots of a run in progress (force over time and over depth, contact search, weight readings) and of daily checks.
//! A painter converts a plot's points once and again only when the trace has changed.

use super::figures::{interlock, phase_stretches};
use super::picture::band;
use crate::daily::DailyCheckDeviation;
use palpate_figures::figure::{Ink, Plot, PlotAxis, PlotLevel, PlotSeries};
use palpate_model::calibration::{CalibrationCurve, Direction, ForceUncertainty, newtons_of};
use palpate_model::control_chart::ControlLimits;
use palpate_model::rig::Phase;
use palpate_model::signal::{LiveTrace, TracePoint};
use palpate_model::units::Newtons;
use palpate_runner::RunView;

/// Most separate stretches of one line. A recording with more gaps than this is drawn as far as
/// that and says so.
const STRETCHES_MAX: usize = 64;
/// Loops drawn at once. More lie on each other and cost time in every frame.
const LOOPS_MAX: usize = 24;
/// Width of lines in px.
const WIDTH: f64 = 1.5;
/// Seconds shown before the ramp.
const LEAD_S: f64 = 2.0;
/// Air shown in front of the first touch, in mm.
const LEAD_MM: f64 = 3.0;

const DEPTH: &str = "depth from contact (mm)";
const FORCE: &str = "force above tare (N)";

#[derive(Clone, Copy, Debug)]
pub struct LiveCycle {
    /// Its number, from 1.
    pub cycle: u32,
    /// Its highest force and where it was; `None` before there is one.
    pub peak: Option<TracePoint>,
}

/// Plots of a trace, without marks that change while the trace stays the same.
#[derive(Debug, Default)]
pub struct RunPlots {
    /// Force over session time.
    pub force_time: Plot,
    /// Force over depth, from the moment contact is known; in a series every cycle is a loop, older ones faded.
    pub force_depth: Plot,
    /// The repeats so far, oldest first; empty where nothing is repeated.
    pub cycles: Vec<LiveCycle>,
    /// A remark if lines are thinned or cut.
    pub remark: Option<String>,
}

impl RunPlots {
    /// The plots of a run's trace, with the session times in s at which repeats began; around forces lies the band of
    /// twice their calibration's standard uncertainty, where that is stated.
    #[must_use]
    pub fn of(
        trace: &LiveTrace,
        starts: &[(f64, u32)],
        uncertainty: Option<&ForceUncertainty>,
    ) -> Self {
        let points = trace.points();
        let (over_time, is_time_cut) = known(&points, |point| [point.t, point.force]);
        let (over_depth, is_depth_cut) = known(&points, over_depth);
        let banded = |title: &str, x: &str, lines: Vec<Vec<[f64; 2]>>| Plot {
            bands: lines.iter().flat_map(|line| band(line, uncertainty)).collect(),
            ..Plot::new(title, PlotAxis::linear(x), PlotAxis::linear(FORCE)).with(
                lines.into_iter().map(|line| PlotSeries::line("force", Ink::Series, WIDTH, line)),
            )
        };
        let newest = over_depth.last().and_then(|line| line.last()).copied();
        let mut force_depth = banded("Force over depth", DEPTH, over_depth);
        let mut cycles = Vec::new();
        if !starts.is_empty() {
            // Bands of several loops over each other would hide the loops.
            force_depth.bands.clear();
            (force_depth.series, cycles) = loops(&points, starts);
        }
        let now = newest.map(|at| PlotSeries::dots("", Ink::Text, 4.0, vec![at]));
        force_depth.series.extend(now);
        let of_each = trace.samples_per_bucket();
        let remark = match () {
            () if is_time_cut || is_depth_cut => {
                Some("the trace has too many gaps to draw; the session has all samples".to_owned())
            }
            () if cycles.len() > LOOPS_MAX => {
                Some(format!("only the newest {LOOPS_MAX} cycles are drawn over depth"))
            }
            () => (of_each > 1).then(|| format!("thinned to min/max of every {of_each} samples")),
        };
        let force_time = banded("Force over time", "session time (s)", over_time);
        Self { force_time, force_depth, cycles, remark }
    }
}

fn over_depth(point: &TracePoint) -> [f64; 2] {
    [point.depth, point.force]
}

/// Points in stretches without gaps, and whether there were too many of them.
fn known(
    trace: &[TracePoint],
    place: impl Fn(&TracePoint) -> [f64; 2],
) -> (Vec<Vec<[f64; 2]>>, bool) {
    let is_known = |point: &TracePoint| place(point).iter().all(|value| value.is_finite());
    let stretches = trace.chunk_by(|a, b| is_known(a) == is_known(b));
    let mut stretches = stretches.filter(|stretch| is_known(&stretch[0]));
    let drawn = stretches.by_ref().take(STRETCHES_MAX);
    let drawn = drawn.map(|stretch| stretch.iter().map(&place).collect()).collect();
    (drawn, stretches.next().is_some())
}

/// The newest loops with their peaks, and every cycle.
fn loops(points: &[TracePoint], starts: &[(f64, u32)]) -> (Vec<PlotSeries>, Vec<LiveCycle>) {
    let place = |t: f64| points.partition_point(|point| point.t < t);
    let (mut series, mut cycles) = (Vec::new(), Vec::new());
    for (i, (start, cycle)) in starts.iter().enumerate() {
        let end = starts.get(i + 1).map_or(points.len(), |(end, _)| place(*end));
        let own = &points[place(*start).min(end)..end];
        let forces = own.iter().filter(|point| point.force.is_finite());
        let peak = forces.copied().max_by(|a, b| a.force.total_cmp(&b.force));
        cycles.push(LiveCycle { cycle: *cycle, peak });
        let age = starts.len() - 1 - i;
        if age >= LOOPS_MAX {
            continue;
        }
        let (ink, opacity) = match age {
            0 => (Ink::Series, 1.0),
            _ => (Ink::Text, faded(age)),
        };
        let lines = known(own, over_depth).0;
        let lines = lines.into_iter().map(|line| PlotSeries::line("force", ink, WIDTH, line));
        let peak = peak.map(|peak| PlotSeries::dots("peak", ink, 2.5, vec![over_depth(&peak)]));
        series.extend(lines.chain(peak).map(|one| PlotSeries { opacity, ..one }));
    }
    (series, cycles)
}

/// Opacity of a loop so many cycles old: half of the newest, and never so faint that it is lost.
fn faded(age: usize) -> f64 {
    (0.55 * 0.85f64.powi(age.min(20) as i32)).max(0.14)
}

/// Puts a run's phases and the force that ends it into its plot over time, from the start or from just before the ramp.
pub fn set_course(plot: &mut Plot, run: Option<&RunView>, force_max: Newtons, is_from_ramp: bool) {
    let now = run.map_or(60.0, |run| run.now.seconds().0.max(1.0));
    let phases = run.map_or(&[][..], |run| &run.phases);
    let ramp = phases.iter().find(|(_, phase)| *phase == Phase::Ramp);
    let from = ramp.filter(|_| is_from_ramp).map(|(start, _)| *start);
    plot.stretches = phase_stretches(phases, now);
    plot.x.range = from.map(|start| [start - LEAD_S, now.max(start + 1.0)]);
    plot.x.visible_values = vec![0.0, now];
    // Room above the limit for the names of the phases.
    plot.y.visible_values = vec![-0.5, 1.12 * force_max.0];
    plot.levels = vec![interlock(force_max)];
}

/// Force over position while the surface is searched.
#[must_use]
pub fn approach_plot(trace: &LiveTrace) -> Plot {
    let points: Vec<[f64; 2]> = known(&trace.points(), over_depth).0.concat();
    let position = PlotAxis::linear("position from home (mm)");
    Plot::new(
        "Force over position while the surface is searched",
        position,
        PlotAxis::linear(FORCE).with_visible_values(&[0.1]),
    )
    .with([PlotSeries::line("force", Ink::Series, WIDTH, points)])
}

/// Positions and forces of the contact passes and the contact point, drawn over the search; its x axis has the range to show.
#[must_use]
pub fn contact_search_plot(run: &RunView, search: &Plot) -> Plot {
    let passes: Vec<[f64; 2]> =
        run.contact_triggers.iter().map(|touch| [touch.position.0, touch.force.0]).collect();
    let contact = run.contact.map(|contact| PlotLevel::plain(contact.position.0, Ink::Limit));
    let from = passes.iter().map(|touch| touch[0]).reduce(f64::min);
    let points = search.series.iter().flat_map(|one| &one.points);
    let end = points.map(|point| point[0]).fold(f64::NEG_INFINITY, f64::max);
    let range = from.map(|from| [from - LEAD_MM, end.max(from) + 0.5]);
    Plot {
        x_levels: contact.into_iter().collect(),
        ..Plot::new("", PlotAxis { range, ..PlotAxis::default() }, PlotAxis::default())
            .with([PlotSeries::dots("contact pass", Ink::Limit, 5.0, passes)])
    }
}

/// Force by the calibration in use minus the weight, in N, over each weight that was read.
#[must_use]
pub fn weighing_plot(run: &RunView, curve: &CalibrationCurve) -> Plot {
    let heaviest = run.planned_weights.iter().map(|one| one.mass_g).fold(0.0, f64::max);
    let deviations = |wanted: Direction| -> Vec<[f64; 2]> {
        let own = run.weight_readings.iter().filter(|one| one.direction == wanted);
        own.map(|one| {
            let weight = newtons_of(one.mass_g()).0;
            [weight, curve.newtons_from_volts(one.volts()).0 - weight]
        })
        .collect()
    };
    Plot {
        levels: vec![PlotLevel::plain(0.0, Ink::Line)],
        ..Plot::new(
            "",
            PlotAxis::linear("weight (N)").with_visible_values(&[0.0, newtons_of(heaviest).0]),
            PlotAxis::linear("deviation (N)"),
        )
        .with([
            PlotSeries::dots("loading", Ink::Series, 3.6, deviations(Direction::Loading)),
            // Hollow, so that colour is not needed to distinguish the two.
            PlotSeries::rings("unloading", Ink::Limit, 4.6, deviations(Direction::Unloading)),
        ])
    }
}

/// Deviation of one reading of each daily check in N over days, between its limits and those of its control chart.
#[must_use]
pub fn deviation_plot(
    title: &str,
    known: &[(f64, DailyCheckDeviation)],
    control: Option<ControlLimits>,
) -> Plot {
    let line = |of: fn(&DailyCheckDeviation) -> f64| {
        known.iter().map(|(at, one)| [*at, of(one)]).collect()
    };
    let dots = |is_within: bool| {
        let own = known.iter().filter(|(_, one)| (one.newtons.abs() <= one.limit) == is_within);
        own.map(|(at, one)| [*at, one.newtons]).collect()
    };
    let level = |height: Option<f64>| {
        let points = |height: f64| known.iter().map(|(at, _)| [*at, height]).collect();
        height.map_or_else(Vec::new, points)
    };
    // One check alone has no span of time; a day on either side gives it one.
    let seen = match known {
        [(at, _)] => vec![at - 1.0, at + 1.0],
        _ => Vec::new(),
    };
    Plot::new(
        title,
        PlotAxis::default().with_visible_values(&seen),
        PlotAxis::linear("deviation (N)").with_visible_values(&[0.0]),
    )
    .with([
        PlotSeries::dashed("limit", Ink::Limit, 1.5, line(|one| one.limit)),
        PlotSeries::dashed("limit", Ink::Limit, 1.5, line(|one| -one.limit)),
        PlotSeries::dashed("control limit", Ink::Line, 1.0, level(control.map(|it| it.low))),
        PlotSeries::dashed("control limit", Ink::Line, 1.0, level(control.map(|it| it.high))),
        PlotSeries::line("deviation", Ink::Line, 1.0, line(|one| one.newtons)),
        PlotSeries::dots("within the limit", Ink::Series, 4.0, dots(true)),
        PlotSeries::rings("beyond the limit", Ink::Alarm, 4.0, dots(false)),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::calibration::Calibration;
    use palpate_model::units::{Depth, Seconds, Volts};

    fn point(t: f64, depth: f64, force: f64) -> TracePoint {
        TracePoint { t, depth, force }
    }

    /// Forces over times and depths of 0, 1, 2, …
    fn trace(places: usize, forces: impl IntoIterator<Item = f64>) -> LiveTrace {
        let mut trace = LiveTrace::new(places);
        for (i, force) in forces.into_iter().enumerate() {
            trace.push(Seconds(i as f64), Depth(i as f64), Newtons(force));
        }
        trace
    }

    fn lengths(plot: &Plot) -> Vec<usize> {
        plot.series.iter().map(|one| one.points.len()).collect()
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
        let lengths = |lines: &[Vec<[f64; 2]>]| lines.iter().map(Vec::len).collect::<Vec<_>>();
        assert_eq!(lengths(&known(&trace, |point| [point.t, point.force]).0), [2, 2]);
        let (lines, is_cut) = known(&trace, over_depth);
        assert_eq!((lengths(&lines), is_cut), (vec![1, 2], false));
        assert!(lines.concat().concat().iter().all(|value| value.is_finite()));
    }

    #[test]
    fn a_shredded_recording_is_cut_and_says_so() {
        let forces = (0..400).map(|i| if i % 2 == 0 { 1.0 } else { f64::NAN });
        let plots = RunPlots::of(&trace(1000, forces), &[], None);
        assert_eq!(plots.force_time.series.len(), STRETCHES_MAX);
        assert!(plots.remark.unwrap().contains("too many gaps"));
    }

    #[test]
    fn the_band_is_as_wide_as_the_calibration_is_unsure() {
        let trace = trace(100, (0..10).map(f64::from));
        let thesis = ForceUncertainty::of(&Calibration::thesis()).unwrap();
        let plots = RunPlots::of(&trace, &[], Some(&thesis));
        let sigma = thesis.sigma(Newtons(4.0)).unwrap();
        let [low, high] = &plots.force_time.bands[0].edges;
        assert_eq!((low.len(), low[4][0]), (10, 4.0));
        assert!((high[4][1] - low[4][1] - 4.0 * sigma.0).abs() < 1e-12);
        assert_eq!(plots.force_depth.bands.len(), 1);
        // What states nothing has no band.
        let line = Calibration::linear("line", Volts(1.0), 0.1, Newtons(9.0));
        let plots = RunPlots::of(&trace, &[], ForceUncertainty::of(&line).ok().as_ref());
        assert!(plots.force_time.bands.is_empty());
    }

    #[test]
    fn every_cycle_is_a_loop_with_its_own_peak() {
        let forces = (0..30).map(|i| f64::from(i % 10) - 0.1 * f64::from(i / 10));
        let trace = trace(1000, forces);
        let plots = RunPlots::of(&trace, &[(0.0, 1), (10.0, 2), (20.0, 3)], None);
        let peaks: Vec<f64> = plots.cycles.iter().map(|one| one.peak.unwrap().force).collect();
        assert_eq!(peaks, [9.0, 8.9, 8.8]);
        // Each loop and its peak, then where the probe is.
        assert_eq!(lengths(&plots.force_depth), [10, 1, 10, 1, 10, 1, 1]);
        let starts: Vec<(f64, u32)> = (0..30).map(|i| (f64::from(i), i + 1)).collect();
        let plots = RunPlots::of(&trace, &starts, None);
        assert_eq!(
            (plots.cycles.len(), lengths(&plots.force_depth).len()),
            (30, 2 * LOOPS_MAX + 1)
        );
        assert!(plots.remark.unwrap().contains("newest 24"));
    }

    #[test]
    fn thinning_is_said() {
        assert_eq!(RunPlots::of(&trace(4, [1.0]), &[], None).remark, None);
        let plots = RunPlots::of(&trace(4, [1.0; 40]), &[], None);
        assert!(plots.remark.unwrap().starts_with("thinned to min/max of "));
    }
}
