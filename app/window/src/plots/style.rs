//! What all plots have in common: a quiet grid at round numbers and a readout under the pointer.

use crate::theme::Tokens;
use eframe::egui::layers::ShapeIdx;
use eframe::egui::{Rangef, Shape, Stroke, TextStyle, Ui, Vec2, vec2};
use egui_plot::{GridInput, GridMark, Plot, PlotTransform};
use palpate_figures::drawing::round_up;
use std::ops::RangeInclusive;

/// Labelled steps across the width and up the height of a plot, at most.
const STEPS_ACROSS: f64 = 9.0;
const STEPS_UP: f64 = 6.0;

/// Between two labelled steps, at least, across and up: the labels of closer ones fade and go.
const POINTS_PER_STEP: [f32; 2] = [75.0, 34.0];

/// Unlabelled lines between two labelled ones.
const MINOR_PER_MAJOR: f64 = 5.0;

/// Gives a plot that fills the space there is the common look.
pub(super) fn quiet<'a>(ui: &Ui, plot: Plot<'a>, tokens: &Tokens) -> Plot<'a> {
    // It would be filled a second time; see `shell::panels::frame`.
    with_marks(plot, steps(ui.available_size()))
        .show_background(false)
        .allow_scroll(false)
        .set_margin_fraction(vec2(0.01, 0.03))
        .grid_color(tokens.line)
        // Points between two lines at which they begin to show and are drawn in full.
        .grid_spacing(Rangef::new(10.0, 70.0))
        .y_axis_min_width(AXIS_WIDTH)
}

/// Marks at round numbers, so many across and up at most that have their number.
pub(super) fn with_marks(plot: Plot<'_>, [across, up]: [f64; 2]) -> Plot<'_> {
    plot.x_grid_spacer(move |input| round_marks(input, across))
        .y_grid_spacer(move |input| round_marks(input, up))
        .x_axis_formatter(move |mark, range| mark_text(mark, major_step(range, across)))
        .y_axis_formatter(move |mark, range| mark_text(mark, major_step(range, up)))
}

/// Width in points of the numbers and the name beside a plot: one for all, so that plots above each other share their time
/// axis. Numbers of seven letters have room.
pub const AXIS_WIDTH: f32 = 70.0;

/// A picture of a plot is painted before its grid, which would lie over it: this paints the grid at a place in the list of
/// shapes that was taken before, with so many labelled steps across and up at most.
pub(super) fn paint_grid(
    ui: &Ui,
    at: ShapeIdx,
    transform: &PlotTransform,
    steps: [f64; 2],
    tokens: &Tokens,
) {
    let frame = *transform.frame();
    let [low, high] = [transform.bounds().min(), transform.bounds().max()];
    let mut lines = Vec::new();
    for axis in [0, 1] {
        let bounds = (low[axis], high[axis]);
        let range = bounds.0..=bounds.1;
        for mark in round_marks(GridInput { bounds, base_step_size: 0.0 }, steps[axis]) {
            let is_major = mark.step_size >= 0.9 * major_step(&range, steps[axis]);
            let ink = if is_major { tokens.line } else { tokens.line.gamma_multiply(0.5) };
            let mut place = [low[0], low[1]];
            place[axis] = mark.value;
            let place = transform.position_from_point(&place.into());
            let stroke = Stroke::new(1.0, ink);
            lines.push(match axis {
                0 => Shape::vline(place.x, frame.y_range(), stroke),
                _ => Shape::hline(frame.x_range(), place.y, stroke),
            });
        }
    }
    ui.painter().set(at, Shape::Vec(lines));
}

/// The same for a plot whose bounds are ours: [`super::navigate`] moves and zooms it, and its readouts are drawn by us.
pub(super) fn still<'a>(ui: &Ui, plot: Plot<'a>, tokens: &Tokens) -> Plot<'a> {
    quiet(ui, plot, tokens)
        .set_margin_fraction(vec2(0.0, 0.0))
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .show_x(false)
        .show_y(false)
        .label_formatter(|_| None)
}

/// Height in points of the numbers and the name below a plot.
const AXIS_BELOW: f32 = 40.0;

/// The name of an axis that goes up a plot filling the space there is, or only its unit where the name is longer than
/// the axis.
pub(super) fn name_up(ui: &Ui, name: &str, has_axis_below: bool) -> String {
    let axis = ui.available_height() - if has_axis_below { AXIS_BELOW } else { 0.0 };
    let font = TextStyle::Body.resolve(ui.style());
    let ink = ui.visuals().text_color();
    let length = ui.painter().layout_no_wrap(name.to_owned(), font, ink).size().x;
    let unit = name.rfind('(').filter(|_| length > axis && name.ends_with(')'));
    unit.map_or(name, |at| &name[at + 1..name.len() - 1]).to_owned()
}

/// Labelled steps that a plot of a size in points has room for, across and up.
pub(super) fn steps(size: Vec2) -> [f64; 2] {
    let [across, up] = POINTS_PER_STEP;
    [
        f64::from(size.x / across).clamp(2.0, STEPS_ACROSS),
        f64::from(size.y / up).clamp(2.0, STEPS_UP),
    ]
}

/// Marks at round numbers: labelled ones a step of 1, 2 or 5 times a power of ten apart.
pub(super) fn round_marks(input: GridInput, steps_max: f64) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    if !((high - low).is_finite() && high > low) {
        return Vec::new();
    }
    let major = major_step(&(low..=high), steps_max);
    let minor = major / MINOR_PER_MAJOR;
    // The bounds hold at most ten majors, so at most fifty minors and two at the edges.
    let (first, last) = ((low / minor).ceil() as i64, (high / minor).floor() as i64);
    (first..=last)
        .map(|i| GridMark {
            value: i as f64 * minor,
            step_size: if i % MINOR_PER_MAJOR as i64 == 0 { major } else { minor },
        })
        .collect()
}

/// From one labelled mark to the next.
fn major_step(range: &RangeInclusive<f64>, steps_max: f64) -> f64 {
    round_up((range.end() - range.start()) / steps_max)
}

/// The value of a labelled mark with the decimals its step needs: egui's own rounding shows 0.5 as 0.
fn mark_text(mark: GridMark, major: f64) -> String {
    if mark.step_size < 0.9 * major {
        return String::new();
    }
    let decimals = (-mark.step_size.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{:.decimals$}", mark.value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_never_too_small() {
        for (least, step) in [(17.8, 20.0), (0.1, 0.1), (3.4, 5.0), (6.0, 10.0), (1e-5, 1e-5)] {
            assert!((round_up(least) / step - 1.0).abs() < 1e-9, "{least}");
        }
    }

    #[test]
    fn labels_show_the_decimals_of_their_step() {
        for (value, step_size, text) in
            [(-0.5, 0.5, "-0.5"), (20.0, 10.0, "20"), (0.04, 0.02, "0.04"), (1e4, 5e3, "10000")]
        {
            assert_eq!(mark_text(GridMark { value, step_size }, step_size), text);
            assert_eq!(mark_text(GridMark { value, step_size }, 5.0 * step_size), "");
        }
    }

    #[test]
    fn a_run_is_labelled_at_round_seconds() {
        let marks = |low: f64, high: f64| {
            let input = GridInput { bounds: (low, high), base_step_size: 1.0 };
            round_marks(input, STEPS_ACROSS)
        };
        let labelled: Vec<f64> = marks(-1.6, 158.0)
            .iter()
            .filter(|mark| mark.step_size > 10.0)
            .map(|mark| mark.value)
            .collect();
        assert_eq!(labelled.len(), 8);
        for (i, value) in labelled.iter().enumerate() {
            assert!((value - 20.0 * i as f64).abs() < 1e-9);
        }
        assert!(marks(0.0, f64::INFINITY).is_empty());
        assert!(marks(1.0, 1.0).is_empty());
        assert!(marks(-1e-300, 1e-300).len() < 70);
    }
}
