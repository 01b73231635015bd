//! A plan as a picture before anything moves: depth and the force of an average specimen over time, or, of a
//! plan that presses on nothing, what it does when.

use super::picture::{LEFT, LINE, RIGHT, look, titled};
use palpate_figures::drawing::{Anchor, AxisColours, PlotPanel, TextStyle as TextInk};
use palpate_figures::figure::{AxisNames, Ink, Plot, PlotAxis, PlotBand, PlotLevel, PlotSeries};
use palpate_figures::tokens::LIGHT;
use palpate_model::units::{MmPerS, Newtons};
use palpate_protocols::preview::{OutlinePoint, StepPreview};

/// Longest time shown in seconds; more is shown in minutes.
const SECONDS_MAX: f64 = 600.0;

/// A limit is in the picture where the plan comes to half of it; a further one would flatten the curve.
const LIMIT_IN_SIGHT: f64 = 0.5;

#[derive(Clone, Copy, Debug)]
pub struct CourseLimits {
    /// Force above tare that ends a run, as tight as the plan has it.
    pub force: Newtons,
    /// Fastest speed of the rig.
    pub speed: MmPerS,
}

/// Depth, speed and force over time as a plan is expected to go, before anything moves, with the limits that hold.
/// Steps of unknown length are drawn as long as they are expected to be.
#[must_use]
pub fn course(outline: &[OutlinePoint], limits: Option<CourseLimits>) -> [Plot; 3] {
    let end = outline.last().map_or(1.0, |point| point.t.0.max(1e-3));
    let (unit, axis) = unit_of(end);
    let series = |value: &dyn Fn(&OutlinePoint) -> f64| -> Vec<[f64; 2]> {
        outline.iter().map(|point| [point.t.0 / unit, value(point)]).collect()
    };
    let speed: Vec<[f64; 2]> = speeds(outline).into_iter().map(|[t, v]| [t / unit, v]).collect();
    let edges = [0, 1].map(|edge: usize| series(&|point| point.force_band()[edge].0));
    let fastest = limits.and_then(|limits| in_sight(limits.speed.0, &speed));
    let strongest = limits.and_then(|limits| in_sight(limits.force.0, &edges[1]));
    let plot = |title: &str, y: &str, ink: Ink, points: Vec<[f64; 2]>, limit: Option<f64>| Plot {
        levels: limit.map(level).into_iter().collect(),
        ..Plot::new(
            title,
            PlotAxis::linear(axis).with_range([0.0, end / unit]),
            PlotAxis::linear(y).with_visible_values(&[0.0]),
        )
        .with([PlotSeries::line("", ink, 1.6, points)])
    };
    let depth = series(&|point| point.depth.0);
    let force = series(&|point| point.force.0);
    [
        plot("Depth as planned", "depth (mm)", Ink::Series, depth, None),
        plot("Speed as planned", "speed (mm/s)", Ink::Series, speed, fastest),
        Plot {
            bands: vec![PlotBand { name: String::new(), ink: Ink::Limit, edges }],
            ..plot("Force as expected", "force (N)", Ink::Limit, force, strongest)
        },
    ]
}

fn level(at: f64) -> PlotLevel {
    PlotLevel { name: "limit".to_owned(), at, ink: Ink::Alarm, is_dashed: false }
}

pub const PLAN_CAPTION: &str = "predicted for the pig stomach of the source thesis; the band spans the softest to the stiffest specimen; pressing on the base assumes a machine compliance of 30 µm/N";

#[must_use]
pub fn of_plan(name: &str, outline: &[OutlinePoint]) -> String {
    let mut svg = titled(name, PLAN_CAPTION);
    let [depth, speed, force] = course(outline, None);
    let place = |top: f64| [LEFT, top, RIGHT, top + 194.0];
    depth.draw(&mut svg, place(66.0), AxisNames::Upright);
    speed.draw(&mut svg, place(296.0), AxisNames::Upright);
    force.draw(&mut svg, place(526.0), AxisNames::Both);
    svg.finish(780.0, LIGHT.canvas, &format!("Plan of {name}"))
}

/// Seconds or minutes for a time of so many seconds, and the name of the axis.
fn unit_of(end: f64) -> (f64, &'static str) {
    if end > SECONDS_MAX { (60.0, "expected time (min)") } else { (1.0, "expected time (s)") }
}

/// Left edge of the bars, behind the names of the phases.
const BARS_LEFT: f64 = 200.0;
/// Room from one row of bars to the next, and within a row above and below its bars, in px.
const ROW: f64 = 1.3 * LINE;
const ROW_EDGE: f64 = 4.0;

/// The picture of steps that press on nothing, as SVG: a row for each phase, a bar for each time it comes.
#[must_use]
pub fn of_steps(name: &str, steps: &[StepPreview]) -> String {
    let mut bars = Vec::with_capacity(steps.len());
    let mut end = 0.0;
    for step in steps {
        bars.push((step.phase, [end, end + step.expected.0]));
        end += step.expected.0;
    }
    let (unit, axis) = unit_of(end);
    let mut phases = Vec::new();
    for (phase, _) in &bars {
        if !phases.contains(phase) {
            phases.push(*phase);
        }
    }
    let mut svg = titled(
        name,
        "predicted durations: moves and waits are exact, searches and operator actions are estimates",
    );
    let (top, look): (f64, AxisColours) = (66.0, look());
    let bottom = top + ROW * phases.len() as f64;
    // The rows are drawn here; the panel has the time.
    let panel =
        PlotPanel::around([BARS_LEFT, top, RIGHT, bottom], [0.0, end.max(1e-3) / unit], &[]);
    panel.time_axis(&mut svg, axis, look);
    for (row, phase) in phases.iter().enumerate() {
        let above = top + ROW * row as f64;
        let name = TextInk::plain(LIGHT.text).anchored(Anchor::End);
        svg.text([BARS_LEFT - 10.0, above + 0.7 * ROW], name, phase.name());
        for (_, [from, to]) in bars.iter().filter(|(one, _)| one == phase) {
            let [left, right] = [from, to].map(|t| panel.at([t / unit, 0.0])[0]);
            // A step without duration stays visible.
            let right = right.max(left + 1.5);
            let (above, below) = (above + ROW_EDGE, above + ROW - ROW_EDGE);
            svg.rectangle([left, above], [right, below], LIGHT.series);
        }
    }
    svg.finish(bottom + 60.0, LIGHT.canvas, &format!("Steps of {name}"))
}

/// The limit, if the curve comes near enough to it.
fn in_sight(limit: f64, points: &[[f64; 2]]) -> Option<f64> {
    let most = points.iter().map(|point| point[1].abs()).fold(0.0, f64::max);
    (most > LIMIT_IN_SIGHT * limit).then_some(limit)
}

/// Time and speed into the tissue in mm/s, two points for each piece of the way; what happens at once has no speed.
fn speeds(outline: &[OutlinePoint]) -> Vec<[f64; 2]> {
    let mut points = Vec::with_capacity(2 * outline.len());
    for pair in outline.windows(2) {
        let [t, until] = [pair[0].t.0, pair[1].t.0];
        if until > t {
            let speed = (pair[1].depth.0 - pair[0].depth.0) / (until - t);
            points.extend([[t, speed], [until, speed]]);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::{in_sight, speeds};
    use palpate_model::rig::Phase;
    use palpate_model::units::{Depth, Newtons, Seconds};
    use palpate_protocols::preview::OutlinePoint;

    #[test]
    fn a_ramp_has_its_speed_and_a_hold_has_none() {
        let at = |t: f64, depth: f64| OutlinePoint {
            t: Seconds(t),
            depth: Depth(depth),
            force: Newtons(0.0),
            is_force_set: false,
            phase: Phase::Ramp,
        };
        let outline = [at(0.0, 0.0), at(40.0, 30.0), at(40.0, 30.0), at(90.0, 30.0)];
        assert_eq!(speeds(&outline), [[0.0, 0.75], [40.0, 0.75], [40.0, 0.0], [90.0, 0.0]]);
    }

    #[test]
    fn a_limit_far_above_is_not_drawn() {
        assert_eq!(in_sight(20.0, &[[0.0, 0.75]]), None);
        assert_eq!(in_sight(9.0, &[[0.0, 6.4]]), Some(9.0));
    }
}
