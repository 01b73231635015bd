//! Depth, speed and force over time as a plan is expected to go, before anything moves, and the limits that hold.

use super::style::quiet;
use crate::theme::Tokens;
use eframe::egui::{Color32, Id, RichText, Ui, vec2};
use egui_plot::{FilledArea, HLine, HoverPosition, Line, Plot, PlotPoints};
use palpate_model::units::{MmPerS, Newtons};
use palpate_protocols::preview::OutlinePoint;

/// Longest time shown in seconds; more is shown in minutes.
const SECONDS_MAX: f64 = 600.0;

/// A limit is in the picture where the plan comes to half of it; a further one would flatten the curve.
const LIMIT_IN_SIGHT: f64 = 0.5;

/// What ends or bounds a run on this rig.
#[derive(Clone, Copy, Debug)]
pub struct CourseLimits {
    /// Force above tare that ends a run, as tight as the plan has it.
    pub force: Newtons,
    /// Fastest speed of the rig.
    pub speed: MmPerS,
}

/// One of the plots.
struct Course<'a> {
    title: &'a str,
    y_axis: &'a str,
    ink: Color32,
    points: Vec<[f64; 2]>,
    /// Lower and upper edge of what is expected.
    band: Option<[Vec<f64>; 2]>,
    limit: Option<f64>,
}

/// Draws the curves in the space there is. Steps of unknown length are drawn as long as expected.
pub fn course_ui(ui: &mut Ui, outline: &[OutlinePoint], limits: CourseLimits) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let end = outline.last().map_or(1.0, |point| point.t.0);
    let (unit, axis) = if end > SECONDS_MAX {
        (60.0, "expected time (min)")
    } else {
        (1.0, "expected time (s)")
    };
    let series = |value: fn(&OutlinePoint) -> f64| -> Vec<[f64; 2]> {
        let points = outline.iter();
        points
            .map(|point| [point.t.0 / unit, value(point)])
            .collect()
    };
    let speed: Vec<[f64; 2]> = speeds(outline)
        .into_iter()
        .map(|[t, v]| [t / unit, v])
        .collect();
    let edge = |i: usize| -> Vec<f64> {
        let points = outline.iter();
        points.map(|point| point.force_band()[i].0).collect()
    };
    let courses = [
        Course {
            title: "Depth as planned",
            y_axis: "depth (mm)",
            ink: tokens.series,
            points: series(|point| point.depth.0),
            band: None,
            limit: None,
        },
        Course {
            title: "Speed as planned",
            y_axis: "speed (mm/s)",
            ink: tokens.series,
            limit: in_sight(limits.speed.0, &speed),
            points: speed,
            band: None,
        },
        Course {
            title: "Force as expected",
            y_axis: "force (N)",
            ink: tokens.limit,
            points: series(|point| point.force.0),
            band: Some([edge(0), edge(1)]),
            limit: in_sight(limits.force.0, &series(|point| point.force_band()[1].0)),
        },
    ];
    let height = (ui.available_height() - 112.0) / 3.0;
    for course in courses {
        ui.label(RichText::new(course.title).heading().strong());
        ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
            plot_ui(ui, tokens, axis, course);
        });
    }
    let words = format!(
        "expected for the pig stomach of the source thesis, the band for specimens from the softest to the stiffest; on a base for a rig that gives 30 µm/N. A force of {} ends the run; the rig moves at up to {}.",
        limits.force, limits.speed
    );
    ui.label(RichText::new(words).color(tokens.text_quiet).small());
}

fn plot_ui(ui: &mut Ui, tokens: &Tokens, axis: &str, course: Course<'_>) {
    quiet(ui, Plot::new(course.title), tokens)
        .x_axis_label(axis)
        .y_axis_label(course.y_axis)
        .include_y(0.0)
        .link_axis(Id::unique("course"), [true, false])
        .label_formatter(|hover| match hover {
            HoverPosition::NearDataPoint { position, .. } => {
                Some(format!("{:.2}\n{:.3}", position.x, position.y))
            }
            HoverPosition::Elsewhere { .. } => None,
        })
        .show(ui, |plot_ui| {
            if let Some([low, high]) = &course.band {
                let t: Vec<f64> = course.points.iter().map(|point| point[0]).collect();
                let area = FilledArea::new("expected band", &t, low, high);
                plot_ui.add(area.fill_color(course.ink.gamma_multiply(0.18)));
            }
            if let Some(limit) = course.limit {
                plot_ui.hline(
                    HLine::new("limit", limit)
                        .color(tokens.alarm_text)
                        .width(1.0),
                );
            }
            // A plan has few points, and bands of those that share a column would be drawn as wedges.
            let points = course.points.into_iter().collect::<PlotPoints<'_>>();
            plot_ui.line(
                Line::new(course.title, points)
                    .allow_band(false)
                    .color(course.ink)
                    .width(1.6),
            );
        });
}

/// A limit that belongs into the picture of a curve.
fn in_sight(limit: f64, points: &[[f64; 2]]) -> Option<f64> {
    let most = points
        .iter()
        .map(|point| point[1].abs())
        .fold(0.0, f64::max);
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
        assert_eq!(
            speeds(&outline),
            [[0.0, 0.75], [40.0, 0.75], [40.0, 0.0], [90.0, 0.0]]
        );
    }

    #[test]
    fn a_limit_far_above_is_not_drawn() {
        assert_eq!(in_sight(20.0, &[[0.0, 0.75]]), None);
        assert_eq!(in_sight(9.0, &[[0.0, 6.4]]), Some(9.0));
    }
}
