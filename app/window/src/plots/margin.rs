//! Damping that a body needs over depth, what asks for it, and what the device has.

use super::strip::legend_ui;
use super::style::quiet;
use crate::theme::Tokens;
use eframe::egui::{Color32, Ui, vec2};
use egui_plot::{FilledArea, HLine, HoverPosition, Line, Plot, PlotPoints, Span, VLine};
use palpate_analysis::margin::MarginPoint;
use palpate_haptics::margin::DepthBand;
use std::ops::RangeInclusive;

/// Opacity of a part: the grid shows through, and its edge is drawn in full.
const PART: f32 = 0.35;

/// The device's damping is in the picture up to so many times the most that is needed; more would flatten the parts.
const IN_SIGHT: f64 = 3.0;

/// The cut is so many times further than the end of the spike.
const CUT_PAST: f64 = 2.0;

/// What is drawn.
pub struct MarginPicture<'a> {
    /// Damping needed.
    pub curve: &'a [MarginPoint],
    /// Damping that the device has, in N s/m.
    pub has: f64,
    /// Depths around which small slow cycles of the body return energy.
    pub cycles: &'a [DepthBand],
    /// Where the slave is, in mm, while the loop runs.
    pub now: Option<f64>,
}

/// Whether the device's damping belongs into a picture of what is needed.
fn is_in_sight(has: f64, needed_max: f64) -> bool {
    needed_max <= 0.0 || has <= IN_SIGHT * needed_max
}

/// Where the picture is cut in two, in mm: a spike near the surface would leave the rest flat.
fn cut_at(cycles: &[DepthBand], deepest: f64) -> Option<f64> {
    let shallow = cycles.first().filter(|band| band.from.0 <= 0.0)?;
    let at = CUT_PAST * shallow.to.0;
    (at < 0.25 * deepest).then_some(at)
}

/// Draws it in the space there is: the shallow depths on the left where they are another matter than the rest.
pub fn margin_ui(ui: &mut Ui, picture: &MarginPicture<'_>) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    ui.horizontal_wrapped(|ui| {
        let names = ["the body's lag", "the tick", "the delay"];
        for (ink, name) in inks(tokens).into_iter().zip(names) {
            legend_ui(ui, ink, name);
        }
        legend_ui(ui, tokens.text, &format!("the device has {:.2} N s/m", picture.has));
        if !picture.cycles.is_empty() {
            legend_ui(ui, tokens.line, "the model itself returns energy");
        }
    });
    let deepest = picture.curve.last().map_or(0.0, |one| one.depth);
    match cut_at(picture.cycles, deepest) {
        None => part_ui(ui, "margin", picture, 0.0..=deepest),
        Some(at) => {
            let size = vec2(0.4 * ui.available_width(), ui.available_height());
            ui.horizontal_top(|ui| {
                ui.allocate_ui(size, |ui| part_ui(ui, "margin_shallow", picture, 0.0..=at));
                part_ui(ui, "margin_deep", picture, at..=deepest);
            });
        }
    }
}

/// Colours of the parts: lag, tick, delay.
fn inks(tokens: &Tokens) -> [Color32; 3] {
    [tokens.sessions[3], tokens.sessions[1], tokens.sessions[0]]
}

fn part_ui(ui: &mut Ui, id: &str, picture: &MarginPicture<'_>, shown: RangeInclusive<f64>) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let points: Vec<&MarginPoint> =
        picture.curve.iter().filter(|one| shown.contains(&one.depth)).collect();
    let most = points.iter().map(|one| one.delay).fold(0.0, f64::max);
    let plot = quiet(ui, Plot::new(id.to_owned()), tokens)
        .x_axis_label("depth (mm)")
        .y_axis_label("damping needed (N s/m)")
        .include_y(0.0)
        // A body that needs none has a picture all the same.
        .include_y(if most > 0.0 { most } else { 1.0 })
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .label_formatter(|hover| match hover {
            HoverPosition::NearDataPoint { position, .. } => {
                Some(format!("{:.3} mm\n{:.3} N s/m", position.x, position.y))
            }
            HoverPosition::Elsewhere { .. } => None,
        });
    let parts: [fn(&MarginPoint) -> f64; 4] =
        [|_| 0.0, |one| one.lag, |one| one.tick, |one| one.delay];
    let depths: Vec<f64> = points.iter().map(|one| one.depth).collect();
    let edges = parts.map(|part| points.iter().map(|one| part(one)).collect::<Vec<f64>>());
    plot.show(ui, |plot_ui| {
        plot_ui.set_plot_bounds_x(shown.clone());
        for band in picture.cycles {
            let shade = Span::new("", band.from.0..=band.to.0).fill(tokens.phase_band);
            plot_ui.span(shade.border_color(tokens.line));
        }
        for (edge, ink) in edges.windows(2).zip(inks(tokens)) {
            let area = FilledArea::new("needed", &depths, &edge[0], &edge[1]);
            plot_ui.add(area.fill_color(ink.gamma_multiply(PART)));
            let points = depths.iter().zip(&edge[1]).map(|(x, y)| [*x, *y]);
            let points: PlotPoints<'_> = points.collect();
            plot_ui.line(Line::new("needed", points).allow_band(false).color(ink));
        }
        if is_in_sight(picture.has, most) {
            let line = HLine::new("the device has", picture.has);
            plot_ui.hline(line.color(tokens.text).width(1.6));
        }
        if let Some(depth) = picture.now.filter(|depth| shown.contains(depth)) {
            let line = VLine::new("now", depth).color(tokens.text_quiet);
            plot_ui.vline(line.allow_hover(false));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::Depth;

    #[test]
    fn a_device_far_above_does_not_flatten_the_parts() {
        assert!(is_in_sight(17.6, 8.0) && is_in_sight(0.5, 3.5));
        assert!(!is_in_sight(17.6, 3.5));
        // A body that needs nothing leaves the whole picture to the device.
        assert!(is_in_sight(17.6, 0.0));
    }

    #[test]
    fn the_picture_is_cut_past_a_spike_at_the_surface_and_nowhere_else() {
        let band = |from, to| DepthBand { from: Depth(from), to: Depth(to) };
        assert_eq!(cut_at(&[band(0.0, 0.7)], 30.0), Some(1.4));
        assert_eq!(cut_at(&[band(0.0, 0.7)], 2.0), None);
        assert_eq!(cut_at(&[band(0.0, 30.0)], 30.0), None);
        assert_eq!(cut_at(&[band(5.0, 6.0)], 30.0), None);
        assert_eq!(cut_at(&[], 30.0), None);
    }
}
