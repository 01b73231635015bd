//! A plan as a picture: depth and the force of an average specimen over time, before anything moves.

use super::picture::{LEFT, RIGHT, WIDTH, look, title};
use super::svg::{Look, Panel, Svg};
use crate::theme::tokens::LIGHT;
use palpate_protocols::preview::OutlinePoint;

/// Longest time shown in seconds; more is shown in minutes.
const SECONDS_MAX: f64 = 600.0;

/// The picture as SVG. Steps of unknown length are drawn as long as they are expected to be.
#[must_use]
pub fn of_plan(name: &str, points: &[OutlinePoint]) -> String {
    let end = points.last().map_or(1.0, |point| point.t.0.max(1e-3));
    let (unit, axis) = if end > SECONDS_MAX {
        (60.0, "time (min)")
    } else {
        (1.0, "time (s)")
    };
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
