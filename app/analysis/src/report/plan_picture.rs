//! A plan as a picture before anything moves: depth and the force of an average specimen over time, or, of a
//! plan that presses on nothing, what it does when.

use super::picture::{LEFT, LINE, RIGHT, WIDTH, look, title};
use palpate_figures::drawing::{Anchor, Ink, Look, Panel, Svg};
use palpate_figures::tokens::LIGHT;
use palpate_protocols::preview::{OutlinePoint, StepPreview};

/// Longest time shown in seconds; more is shown in minutes.
const SECONDS_MAX: f64 = 600.0;

/// The picture as SVG. Steps of unknown length are drawn as long as they are expected to be.
#[must_use]
pub fn of_plan(name: &str, points: &[OutlinePoint]) -> String {
    let end = points.last().map_or(1.0, |point| point.t.0.max(1e-3));
    let (unit, axis) = unit_of(end);
    let series = |value: fn(&OutlinePoint) -> f64| -> Vec<[f64; 2]> {
        points
            .iter()
            .map(|point| [point.t.0 / unit, value(point)])
            .collect()
    };
    let (depth, force) = (series(|point| point.depth.0), series(|point| point.force.0));
    let mut svg = Svg::new(WIDTH);
    title(
        &mut svg,
        name,
        "expected for the pig stomach of the source thesis, others differ by tens of percent; on a base for a rig that gives 30 µm/N",
    );
    let span = [0.0, end / unit];
    let look: Look = look();
    let upper = Panel::around([LEFT, 66.0, RIGHT, 260.0], span, &[&depth]);
    upper.axes(&mut svg, ["", "depth (mm)"], look);
    upper.line(&mut svg, &depth, LIGHT.series, 1.6);
    let lower = Panel::around([LEFT, 296.0, RIGHT, 490.0], span, &[&force]);
    lower.axes(&mut svg, [axis, "force (N)"], look);
    lower.line(&mut svg, &force, LIGHT.limit, 1.6);
    svg.finish(550.0, LIGHT.canvas, &format!("Plan of {name}"))
}

/// Seconds or minutes for a time of so many seconds, and the name of the axis.
fn unit_of(end: f64) -> (f64, &'static str) {
    if end > SECONDS_MAX {
        (60.0, "time (min)")
    } else {
        (1.0, "time (s)")
    }
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
    let mut svg = Svg::new(WIDTH);
    title(
        &mut svg,
        name,
        "expected: moves and waits are known, searches and people take their time",
    );
    let (top, look): (f64, Look) = (66.0, look());
    let bottom = top + ROW * phases.len() as f64;
    // The rows are drawn here; the panel has the time.
    let panel = Panel::around(
        [BARS_LEFT, top, RIGHT, bottom],
        [0.0, end.max(1e-3) / unit],
        &[],
    );
    panel.time_axis(&mut svg, axis, look);
    for (row, phase) in phases.iter().enumerate() {
        let above = top + ROW * row as f64;
        let name = Ink::plain(LIGHT.text).anchored(Anchor::End);
        svg.text([BARS_LEFT - 10.0, above + 0.7 * ROW], name, phase.name());
        for (_, [from, to]) in bars.iter().filter(|(one, _)| one == phase) {
            let [left, right] = [from, to].map(|t| panel.at([t / unit, 0.0])[0]);
            // What takes no time is seen all the same.
            let right = right.max(left + 1.5);
            let (above, below) = (above + ROW_EDGE, above + ROW - ROW_EDGE);
            svg.rectangle([left, above], [right, below], LIGHT.series);
        }
    }
    svg.finish(bottom + 60.0, LIGHT.canvas, &format!("Steps of {name}"))
}
