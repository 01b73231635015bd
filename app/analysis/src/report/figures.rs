//! The figures of a session: force over time and over depth, alone or several sessions over each other.

use super::picture::{LEFT, RIGHT, WIDTH, look, title};
use ecolor::Color32;
use palpate_figures::drawing::{Anchor, Drawing, Ink, Panel, Svg};
use palpate_figures::thin::thin;
use palpate_figures::tokens::LIGHT;
use palpate_model::rig::Phase;
use palpate_model::signal::polyline::Reducer;
use palpate_model::units::Newtons;
use palpate_sessions::contacts::contacts;
use palpate_sessions::log::Session;

/// Time shown before the beginning at which several sessions are laid over each other, in s.
const LEAD_S: f64 = 2.0;
/// A name of a phase is written where it has so much room a letter, in px.
const LETTER: f64 = 7.0;
/// Dashes of a line: whole for the first round of inks, then in strokes.
const DASHES: [f64; 3] = [0.0, 8.0, 3.0];
/// Lines of the legend beneath a figure are so high, in px.
const LEGEND: f64 = 20.0;

/// A stretch of time in s since the first sample, as the column `t_s` of an export has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// From here.
    pub from: f64,
    /// To here.
    pub until: f64,
}

impl Window {
    /// All of it.
    pub const WHOLE: Self = Self { from: f64::NEG_INFINITY, until: f64::INFINITY };

    fn holds(self, at: f64) -> bool {
        (self.from..=self.until).contains(&at)
    }
}

/// Where several sessions are laid over each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Align {
    /// The first sample of the first ramp.
    #[default]
    Ramp,
    /// Where contact was found.
    Contact,
}

impl Align {
    /// In words, after "s since".
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Ramp => "the ramp began",
            Self::Contact => "contact was found",
        }
    }
}

/// A stretch of one phase.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    phase: Phase,
    from: f64,
    until: f64,
}

/// What of a session is drawn: a few thousand points, whatever its length.
#[derive(Clone, Debug)]
pub struct Traces {
    /// What it is called.
    pub name: String,
    /// Force in N over time in s, a line for every stretch in which it is known.
    force_time: Vec<Vec<[f64; 2]>>,
    /// Force in N over depth in mm.
    force_depth: Vec<Vec<[f64; 2]>>,
    phases: Vec<Span>,
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
    /// The same, stretches marked whose forces do not count.
    #[must_use]
    pub fn leaving_out(self, left_out_s: &[[f64; 2]]) -> Self {
        Self { left_out_s: left_out_s.to_vec(), ..self }
    }

    /// The traces of a session within a window of time.
    #[must_use]
    pub fn of(name: &str, session: &Session, window: Window) -> Self {
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
        let mut phases: Vec<Span> = Vec::new();
        for &index in &within {
            let (at, phase) = (time(index), session.rows[index].phase);
            match phases.last_mut() {
                Some(last) if last.phase == phase => last.until = at,
                last => {
                    if let Some(last) = last {
                        last.until = at;
                    }
                    phases.push(Span { phase, from: at, until: at });
                }
            }
        }
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
        let found = contacts(&session.entries);
        let contact = found.iter().map(|one| one.after_sample as usize);
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

    /// Whether nothing is drawn.
    pub fn is_empty(&self) -> bool {
        self.samples[1] == 0
    }

    /// What a reader must know of how points were left out.
    pub fn thinning(&self) -> String {
        let [samples, known] = self.samples;
        let force = match known == samples {
            true => String::new(),
            false => format!(", {known} of them with a force"),
        };
        format!(
            "{samples} samples{force}; drawn are the lowest and the highest of each column of pixels"
        )
    }

    /// Where the interlock's limit is, if it is too far above the force to be drawn; else empty.
    pub fn limit_above(&self) -> String {
        match (self.limit, limit_in_reach(self, &time_panel(self))) {
            (Some(limit), None) => format!(" The interlock is above, at {:.1} N.", limit.0),
            _ => String::new(),
        }
    }

    /// Time that counts as 0 in an overlay, if the session has it.
    pub fn origin(&self, align: Align) -> Option<f64> {
        match align {
            Align::Ramp => self.ramp,
            Align::Contact => self.contact,
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
    let mut reducer = Reducer::new(RIGHT - LEFT, BOTTOM - TOP);
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

fn time_panel(traces: &Traces) -> Panel {
    let series: Vec<&[[f64; 2]]> = traces.force_time.iter().map(Vec::as_slice).collect();
    Panel::around([LEFT, TOP, RIGHT, BOTTOM], traces.ends, &series)
}

/// The interlock's limit in N, unless it is so far above that the force would be flat beneath it.
fn limit_in_reach(traces: &Traces, panel: &Panel) -> Option<f64> {
    let limit = traces.limit?.0;
    (limit <= panel.y[1] + 1.5 * (panel.y[1] - panel.y[0])).then_some(limit)
}

/// Force over time, phases shaded, the interlock's limit drawn where it is in reach.
#[must_use]
pub fn force_time(traces: &Traces) -> Drawing {
    let mut svg = Svg::new(WIDTH);
    title(&mut svg, &traces.name, "force over time");
    let mut panel = time_panel(traces);
    let limit = limit_in_reach(traces, &panel);
    if let Some(limit) = limit {
        panel.y[1] = panel.y[1].max(1.06 * limit);
    }
    for (index, span) in traces.phases.iter().enumerate() {
        if index % 2 == 1 {
            panel.shade(&mut svg, [span.from, span.until], LIGHT.control);
        }
        let [left, _] = panel.at([span.from, 0.0]);
        let [right, _] = panel.at([span.until, 0.0]);
        let name = span.phase.name();
        if right - left > LETTER * name.chars().count() as f64 {
            let ink = Ink::plain(LIGHT.text_quiet).anchored(Anchor::Middle);
            svg.text([0.5 * (left + right), TOP + 14.0], ink, name);
        }
    }
    for [from, until] in &traces.left_out_s {
        let [first, last] = traces.ends;
        let [from, until] = [from.max(first), until.min(last)];
        if from < until {
            panel.shade(&mut svg, [from, until], LIGHT.notice_fill);
            let place = [panel.at([from, 0.0])[0] + 3.0, BOTTOM - 6.0];
            svg.text(place, Ink::plain(LIGHT.text), "left out");
        }
    }
    panel.axes(&mut svg, ["time since the first sample (s)", "force (N)"], look());
    if let Some(limit) = limit {
        let line = traces.ends.map(|x| panel.at([x, limit]));
        svg.dashed_line(&line, LIGHT.limit, 1.2, 5.0);
        // Beneath, for the names of the phases stand above.
        let ink = Ink::plain(LIGHT.text).anchored(Anchor::End);
        let place = [RIGHT - 6.0, line[0][1] + 16.0];
        svg.text(place, ink, &format!("interlock at {limit:.1} N"));
    }
    for line in &traces.force_time {
        panel.line(&mut svg, line, LIGHT.series, 1.4);
    }
    nothing(&mut svg, traces.is_empty());
    svg.drawing(BOTTOM + 46.0, LIGHT.canvas, &format!("Force over time of {}", traces.name))
}

/// Force over depth.
#[must_use]
pub fn force_depth(traces: &Traces) -> Drawing {
    let mut svg = Svg::new(WIDTH);
    title(&mut svg, &traces.name, "force over depth");
    let panel = depth_panel(&[traces]);
    panel.axes(&mut svg, ["depth (mm)", "force (N)"], look());
    for line in &traces.force_depth {
        panel.line(&mut svg, line, LIGHT.series, 1.4);
    }
    nothing(&mut svg, traces.force_depth.is_empty());
    svg.drawing(BOTTOM + 46.0, LIGHT.canvas, &format!("Force over depth of {}", traces.name))
}

fn nothing(svg: &mut Svg, is_empty: bool) {
    if is_empty {
        let ink = Ink::plain(LIGHT.text_quiet);
        svg.text([LEFT + 12.0, BOTTOM - 12.0], ink, "nothing is known here");
    }
}

fn depth_panel(all: &[&Traces]) -> Panel {
    let lines = || all.iter().flat_map(|one| &one.force_depth);
    let series: Vec<&[[f64; 2]]> = lines().map(Vec::as_slice).collect();
    let depths = lines().flatten().map(|point| point[0]);
    let low = depths.clone().fold(0.0f64, f64::min);
    let high = depths.fold(low, f64::max);
    let x = if high > low { [low, high] } else { [0.0, 1.0] };
    Panel::around([LEFT, TOP, RIGHT, BOTTOM], x, &series)
}

/// Ink and dashes of one of several.
fn look_of(index: usize) -> (Color32, f64) {
    let round = index / LIGHT.sessions.len();
    (LIGHT.sessions[index % LIGHT.sessions.len()], DASHES[round % DASHES.len()])
}

/// Several sessions over each other: force over time from where they are aligned, then force over depth. Those without
/// that beginning are left out of the first, and named.
#[must_use]
pub fn overlays(all: &[&Traces], align: Align) -> ([Drawing; 2], Vec<String>) {
    let lost: Vec<String> =
        all.iter().filter(|one| one.origin(align).is_none()).map(|one| one.name.clone()).collect();
    let shifted: Vec<(usize, Vec<Vec<[f64; 2]>>)> = all
        .iter()
        .enumerate()
        .filter_map(|(index, one)| {
            let origin = one.origin(align)?;
            let shift = |line: &Vec<[f64; 2]>| {
                let moved = line.iter().map(|[t, force]| [t - origin, *force]);
                moved.filter(|point| point[0] >= -LEAD_S).collect()
            };
            Some((index, one.force_time.iter().map(shift).collect()))
        })
        .collect();
    let lines = || shifted.iter().flat_map(|(_, lines)| lines);
    let last = lines().flatten().map(|point| point[0]).fold(1.0, f64::max);
    let series: Vec<&[[f64; 2]]> = lines().map(Vec::as_slice).collect();
    let over_time = Panel::around([LEFT, TOP, RIGHT, BOTTOM], [-LEAD_S, last], &series);
    let mut svg = Svg::new(WIDTH);
    title(&mut svg, "Force over time", &format!("from when {}", align.word()));
    let name = format!("time since {} (s)", align.word());
    over_time.axes(&mut svg, [&name, "force (N)"], look());
    for (index, lines) in &shifted {
        let (ink, dash) = look_of(*index);
        for line in lines {
            let placed: Vec<[f64; 2]> = line.iter().map(|point| over_time.at(*point)).collect();
            svg.dashed_line(&placed, ink, 1.4, dash);
        }
    }
    nothing(&mut svg, shifted.is_empty());
    let time = legend(svg, all, "Force over time of the sessions compared");

    let mut svg = Svg::new(WIDTH);
    title(&mut svg, "Force over depth", "of the sessions compared");
    let panel = depth_panel(all);
    panel.axes(&mut svg, ["depth (mm)", "force (N)"], look());
    for (index, one) in all.iter().enumerate() {
        let (ink, dash) = look_of(index);
        for line in &one.force_depth {
            let placed: Vec<[f64; 2]> = line.iter().map(|point| panel.at(*point)).collect();
            svg.dashed_line(&placed, ink, 1.4, dash);
        }
    }
    let depth = legend(svg, all, "Force over depth of the sessions compared");
    ([time, depth], lost)
}

/// Names and inks beneath a panel; finishes the figure.
fn legend(mut svg: Svg, all: &[&Traces], name: &str) -> Drawing {
    let mut y = BOTTOM + 60.0;
    for (index, one) in all.iter().enumerate() {
        let (ink, dash) = look_of(index);
        svg.dashed_line(&[[LEFT, y - 4.0], [LEFT + 40.0, y - 4.0]], ink, 2.0, dash);
        svg.text([LEFT + 50.0, y], Ink::plain(LIGHT.text), &one.name);
        y += LEGEND;
    }
    svg.drawing(y, LIGHT.canvas, name)
}

#[cfg(test)]
#[path = "figures_tests.rs"]
mod tests;
