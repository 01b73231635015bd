//! The figures of a session: force over time and over depth, alone or several sessions over each other.

use super::picture::{LEFT, RIGHT, titled};
use palpate_figures::drawing::{Drawing, TextStyle as TextInk};
use palpate_figures::figure::{
    AxisNames, Ink, Plot, PlotAxis, PlotLevel, PlotSeries, PlotStretch, SeriesShape,
};
use palpate_figures::thin::thin;
use palpate_figures::tokens::LIGHT;
use palpate_model::rig::Phase;
use palpate_model::signal::polyline::PolylineReducer;
use palpate_model::units::Newtons;
use palpate_sessions::contacts::contacts;
use palpate_sessions::log::Session;

/// Time shown before the beginning at which several sessions are laid over each other, in s.
const LEAD_S: f64 = 2.0;
/// Dashes of a line: whole for the first round of inks, then in strokes.
const DASHES: [f64; 3] = [0.0, 8.0, 3.0];
/// Lines of the legend beneath a figure are so high, in px.
const LEGEND: f64 = 20.0;

/// A stretch of time in s since the first sample, as the column `t_s` of an export has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeWindow {
    pub from: f64,
    pub until: f64,
}

impl TimeWindow {
    pub const WHOLE: Self = Self { from: f64::NEG_INFINITY, until: f64::INFINITY };

    fn holds(self, at: f64) -> bool {
        (self.from..=self.until).contains(&at)
    }
}

/// Origin of time in an overlay of several sessions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TimeAlignment {
    /// The first sample of the first ramp.
    #[default]
    Ramp,
    /// Where contact was found.
    Contact,
}

impl TimeAlignment {
    /// In words, after "s since".
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Ramp => "the ramp began",
            Self::Contact => "contact was found",
        }
    }
}

/// Curves of a session: a few thousand points, whatever its length.
#[derive(Clone, Debug)]
pub struct Traces {
    pub name: String,
    /// Force in N over time in s, a line for every stretch in which it is known.
    force_time: Vec<Vec<[f64; 2]>>,
    /// Force in N over depth in mm.
    force_depth: Vec<Vec<[f64; 2]>>,
    /// Start of each phase in s.
    phases: Vec<(f64, Phase)>,
    /// Time from and to in s.
    ends: [f64; 2],
    /// The interlock's limit in N, if it was recorded with one.
    limit: Option<Newtons>,
    /// Samples within, and how many of them have a force.
    samples: [usize; 2],
    /// Time of the first ramp and of the last contact before it, in s.
    ramp: Option<f64>,
    contact: Option<f64>,
    /// Stretches whose forces do not count, in s.
    left_out_s: Vec<[f64; 2]>,
}

impl Traces {
    /// With intervals marked whose forces do not count.
    #[must_use]
    pub fn leaving_out(self, left_out_s: &[[f64; 2]]) -> Self {
        Self { left_out_s: left_out_s.to_vec(), ..self }
    }

    /// The traces of a session within a window of time.
    #[must_use]
    pub fn of(name: &str, session: &Session, window: TimeWindow) -> Self {
        let first = session.rows.first().map_or(0, |row| row.tick);
        let time = |index: usize| {
            let ticks = session.rows[index].tick.saturating_sub(first);
            let ticks = i64::try_from(ticks).unwrap_or(i64::MAX);
            session.manifest.time_of(ticks).0
        };
        let within: Vec<usize> =
            (0..session.rows.len()).filter(|&index| window.holds(time(index))).collect();
        let ends = match within.as_slice() {
            [] => [0.0, 1.0],
            [only] => [time(*only), time(*only) + 1.0],
            [from, .., until] => [time(*from), time(*until)],
        };
        let phase = |index: usize| session.rows[index].phase;
        let phases = within.chunk_by(|a, b| phase(*a) == phase(*b));
        let phases = phases.map(|run| (time(run[0]), phase(run[0]))).collect();
        let force = |&index: &usize| session.rows[index].force.filter(|force| force.is_finite());
        let runs = within.chunk_by(|a, b| force(a).is_some() == force(b).is_some());
        let width = (ends[1] - ends[0]).max(f64::MIN_POSITIVE);
        let force_time = runs.filter(|run| force(&run[0]).is_some()).map(|run| {
            let extent = time(run[run.len() - 1]) - time(run[0]);
            let columns = ((RIGHT - LEFT) * extent / width).ceil().max(1.0) as usize;
            let points = run.iter().map(|index| [time(*index), force(index).unwrap_or(0.0)]);
            thin(points, columns)
        });
        let force_time: Vec<_> = force_time.collect();
        let known = within.iter().filter(|index| force(index).is_some()).count();
        let ramp = session.rows.iter().position(|row| row.phase == Phase::Ramp);
        let contact = contacts(&session.entries).into_iter().map(|one| one.after_sample as usize);
        let mut contact =
            contact.filter(|at| ramp.is_none_or(|ramp| *at <= ramp) && *at < session.rows.len());
        Self {
            name: name.to_owned(),
            force_depth: loops(session, &within),
            force_time,
            phases,
            ends,
            limit: session.manifest.limits.map(|limits| limits.force_max),
            samples: [within.len(), known],
            ramp: ramp.map(time),
            contact: contact.next_back().map(time),
            left_out_s: Vec::new(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.samples[1] == 0
    }

    /// How many samples are drawn, and how they are thinned.
    pub fn thinning(&self) -> String {
        let [samples, known] = self.samples;
        let force = match known == samples {
            true => String::new(),
            false => format!(", {known} of them with a force"),
        };
        format!(
            "{samples} samples{force}; the figure shows the lowest and the highest of each pixel column"
        )
    }

    /// A sentence on the interlock's limit if it is too far above the force to be drawn; else empty.
    pub fn limit_above(&self) -> String {
        match (self.limit, limit_in_reach(self)) {
            (Some(limit), None) => {
                format!(
                    " The interlock limit of {:.1} N lies above the range of the figure.",
                    limit.0
                )
            }
            _ => String::new(),
        }
    }

    /// Time that counts as 0 in an overlay, if the session has it.
    pub fn origin(&self, align: TimeAlignment) -> Option<f64> {
        match align {
            TimeAlignment::Ramp => self.ramp,
            TimeAlignment::Contact => self.contact,
        }
    }
}

/// Force over depth, to half a pixel of the panel that it fills.
fn loops(session: &Session, within: &[usize]) -> Vec<Vec<[f64; 2]>> {
    let point = |index: &usize| {
        let row = &session.rows[*index];
        // Before contact there is no depth, and what is not known breaks the line.
        [row.depth.unwrap_or(f64::NAN), row.force.unwrap_or(f64::NAN)]
    };
    let points = || within.iter().map(point);
    let finite = || points().filter(|point| point.iter().all(|number| number.is_finite()));
    let ends = |axis: usize| {
        let start = [f64::INFINITY, f64::NEG_INFINITY];
        finite().fold(start, |[low, high], point| [low.min(point[axis]), high.max(point[axis])])
    };
    let (x, y) = (ends(0), ends(1));
    let scale = |[low, high]: [f64; 2], px: f64| px / (high - low).max(1e-9);
    let (across, up) = (scale(x, RIGHT - LEFT), scale(y, BOTTOM - TOP));
    let mut reducer = PolylineReducer::new(RIGHT - LEFT, BOTTOM - TOP);
    for [depth, force] in points() {
        reducer.push((depth - x[0]) * across, (force - y[0]) * up);
    }
    let (lines, _) = reducer.finish();
    let back = |line: Vec<[f64; 2]>| {
        let place = |[right, high]: [f64; 2]| [x[0] + right / across, y[0] + high / up];
        line.into_iter().map(place).collect()
    };
    lines.into_iter().map(back).collect()
}

/// Upper and lower edge of the panel of a figure, in px.
const TOP: f64 = 66.0;
const BOTTOM: f64 = 380.0;

/// The interlock's limit in N, unless it is so far above that the force would be flat beneath it.
fn limit_in_reach(traces: &Traces) -> Option<f64> {
    let forces = || traces.force_time.iter().flatten().map(|point| point[1]);
    let (low, high) = (forces().fold(f64::INFINITY, f64::min), forces().fold(0.0, f64::max));
    traces.limit.map(|limit| limit.0).filter(|limit| *limit <= high + 1.5 * (high - low.min(high)))
}

/// Phases from their starts in s, every other one shaded; the last one ends at `end`.
pub(super) fn phase_stretches(starts: &[(f64, Phase)], end: f64) -> Vec<PlotStretch> {
    let until = |i: usize| starts.get(i + 1).map_or(end, |(next, _)| *next);
    let stretch = |(i, (start, phase)): (usize, &(f64, Phase))| PlotStretch {
        name: phase.name().to_owned(),
        ends: [*start, until(i)],
        ink: (i % 2 == 1).then_some(Ink::Line),
    };
    starts.iter().enumerate().map(stretch).collect()
}

/// The interlock's limit as a dashed level.
pub(super) fn interlock(limit: Newtons) -> PlotLevel {
    let name = format!("interlock at {limit:.1}");
    PlotLevel { name, is_dashed: true, ..PlotLevel::plain(limit.0, Ink::Limit) }
}

/// Force over time, phases shaded, the interlock's limit drawn where it is in reach.
#[must_use]
pub fn force_time(traces: &Traces) -> Drawing {
    let [first, last] = traces.ends;
    let phases = phase_stretches(&traces.phases, last).into_iter();
    let left_out = traces.left_out_s.iter().map(|[from, until]| PlotStretch {
        name: "left out".to_owned(),
        ends: [from.max(first), until.min(last)],
        ink: Some(Ink::Notice),
    });
    let limit = limit_in_reach(traces).map(|at| interlock(Newtons(at)));
    let time = PlotAxis::linear("time since the first sample (s)").with_range(traces.ends);
    let mut plot = Plot {
        stretches: phases.chain(left_out.filter(|one| one.ends[0] < one.ends[1])).collect(),
        levels: limit.into_iter().collect(),
        ..force_plot(time, lines(&traces.force_time, Ink::Series, 0.0).collect())
    };
    // Room above the limit for the names of the phases.
    plot.y.visible_values = plot.levels.iter().map(|level| 1.06 * level.at).collect();
    drawing([&traces.name, "force over time"], &plot, &[])
}

#[must_use]
pub fn force_depth(traces: &Traces) -> Drawing {
    let lines = lines(&traces.force_depth, Ink::Series, 0.0).collect();
    drawing([&traces.name, "force over depth"], &force_plot(depth_axis(&[traces]), lines), &[])
}

fn lines(of: &[Vec<[f64; 2]>], ink: Ink, dash: f64) -> impl Iterator<Item = PlotSeries> {
    let shape = SeriesShape::Line { width: 1.4, dash };
    of.iter().map(move |line| PlotSeries { shape, ..PlotSeries::line("", ink, 1.4, line.clone()) })
}

fn force_plot(x: PlotAxis, series: Vec<PlotSeries>) -> Plot {
    let remark = series.is_empty().then(|| "no force is known in this part".to_owned());
    Plot { remark, ..Plot::new("", x, PlotAxis::linear("force (N)")).with(series) }
}

fn depth_axis(all: &[&Traces]) -> PlotAxis {
    let depths = all.iter().flat_map(|one| one.force_depth.iter().flatten()).map(|point| point[0]);
    let low = depths.clone().fold(0.0f64, f64::min);
    let high = depths.fold(low, f64::max);
    PlotAxis::linear("depth (mm)").with_range(if high > low { [low, high] } else { [0.0, 1.0] })
}

/// Ink and dashes of one of several.
fn look_of(index: usize) -> (Ink, f64) {
    (Ink::Session(index), DASHES[index / LIGHT.sessions.len() % DASHES.len()])
}

/// Several sessions over each other: force over time from where they are aligned, then force over depth. Those without
/// that beginning are left out of the first, and named.
#[must_use]
pub fn overlays(all: &[&Traces], align: TimeAlignment) -> ([Drawing; 2], Vec<String>) {
    let without_origin: Vec<String> =
        all.iter().filter(|one| one.origin(align).is_none()).map(|one| one.name.clone()).collect();
    let (mut over_time, mut over_depth) = (Vec::new(), Vec::new());
    for (index, one) in all.iter().enumerate() {
        let (ink, dash) = look_of(index);
        over_depth.extend(lines(&one.force_depth, ink, dash));
        let Some(origin) = one.origin(align) else { continue };
        over_time.extend(lines(&one.force_time, ink, dash).map(|mut line| {
            line.points.iter_mut().for_each(|point| point[0] -= origin);
            line.points.retain(|point| point[0] >= -LEAD_S);
            line
        }));
    }
    let times = over_time.iter().flat_map(|line| &line.points).map(|point| point[0]);
    let last = times.fold(1.0, f64::max);
    let time =
        PlotAxis::linear(&format!("time since {} (s)", align.word())).with_range([-LEAD_S, last]);
    let since = format!("from when {}", align.word());
    let over_depth = force_plot(depth_axis(all), over_depth);
    let drawings = [
        drawing(["Force over time", &since], &force_plot(time, over_time), all),
        drawing(["Force over depth", "of the sessions compared"], &over_depth, all),
    ];
    (drawings, without_origin)
}

/// A plot under its heads; beneath, names and inks of sessions compared.
fn drawing([head, words]: [&str; 2], plot: &Plot, all: &[&Traces]) -> Drawing {
    let mut svg = titled(head, words);
    plot.draw(&mut svg, [LEFT, TOP, RIGHT, BOTTOM], AxisNames::Both);
    let mut y = BOTTOM + 46.0;
    for (index, one) in all.iter().enumerate() {
        y += LEGEND;
        let (ink, dash) = look_of(index);
        svg.dashed_line(&[[LEFT, y - 10.0], [LEFT + 40.0, y - 10.0]], ink.of(&LIGHT), 2.0, dash);
        svg.text([LEFT + 50.0, y - 6.0], TextInk::plain(LIGHT.text), &one.name);
    }
    svg.drawing(y, LIGHT.canvas, &format!("{head}, {words}"))
}

#[cfg(test)]
#[path = "figures_tests.rs"]
mod tests;
