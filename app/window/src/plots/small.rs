//! Small plots beside each other with the same axes; only those at the outer edges have their numbers and names.

use super::navigate::{Gesture, gesture};
use super::style::{name_up, still, with_marks};
use crate::widgets::tokens_of;
use eframe::egui::{Id, Rangef, Rect, Ui, UiBuilder, Vec2, vec2};
use egui_plot::{Plot, PlotUi};

/// Least width of a plot in points, and its height for a width.
const WIDTH_MIN: f32 = 138.0;
const HEIGHT_MIN: f32 = 84.0;
const HEIGHT_SHARE: f32 = 0.75;
/// Between two plots, and the line above each, in points.
const GAP: f32 = 8.0;
pub const HEAD: f32 = 24.0;

/// Where plots stand: as many columns as have room, and as high as the space they are to fill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmallGrid {
    pub columns: usize,
    /// Of a plot without its axes.
    pub plot: Vec2,
    /// What the axes at the outer edges take.
    pub axes: Vec2,
}

impl SmallGrid {
    /// For groups of so many plots, each beginning a row, with a heading of some height.
    #[must_use]
    pub fn new(space: Vec2, groups: &[usize], heading: f32, axes: Vec2) -> Self {
        let most = groups.iter().copied().max().unwrap_or(1).max(1);
        let room = space.x - axes.x + GAP;
        let columns = ((room / (WIDTH_MIN + GAP)) as usize).clamp(1, most);
        let width = room / columns as f32 - GAP;
        let rows: usize = groups.iter().map(|count| count.div_ceil(columns)).sum();
        let taken = groups.len() as f32 * heading + axes.y + rows as f32 * (HEAD + GAP);
        let height = (space.y - taken) / rows.max(1) as f32;
        let height = height.clamp(HEIGHT_MIN, (HEIGHT_SHARE * width).max(HEIGHT_MIN));
        Self { columns, plot: vec2(width.max(60.0), height), axes }
    }

    /// Height of a row of plots.
    #[must_use]
    pub fn row(&self) -> f32 {
        HEAD + self.plot.y + GAP
    }

    /// Place of a plot in its row, with the line above it, as seen from the left upper corner of the row.
    #[must_use]
    pub fn cell(&self, column: usize) -> Rect {
        let left = self.axes.x + column as f32 * (self.plot.x + GAP);
        Rect::from_min_size((left, 0.0).into(), vec2(self.plot.x, HEAD + self.plot.y))
    }
}

/// A plot and which of its axes are written.
#[derive(Clone, Copy, Debug)]
pub struct SmallPlot<'a> {
    pub id: Id,
    /// Shown across and up.
    pub shown: [[f64; 2]; 2],
    /// Names of the axes written: across and up.
    pub names: [Option<&'a str>; 2],
}

/// What was done in a small plot.
#[derive(Clone, Copy, Debug)]
pub struct SmallResponse {
    /// Its place without the axes.
    pub rect: Rect,
    pub gesture: Gesture,
    pub is_hovered: bool,
}

/// Draws a plot whose inner part has a place; its axes reach over the left and the lower edge of that. The wheel is
/// left to whatever scrolls the plots; with Ctrl it zooms.
pub fn small_plot_ui<'a>(
    ui: &mut Ui,
    plot: SmallPlot<'a>,
    place: Rect,
    axes: Vec2,
    draw: impl FnOnce(&mut PlotUi<'a>) + 'a,
) -> SmallResponse {
    let tokens = tokens_of(ui);
    let mut whole = place;
    if plot.names[1].is_some() {
        whole.min.x -= axes.x;
    }
    if plot.names[0].is_some() {
        whole.max.y += axes.y;
    }
    let steps = [place.width() / 60.0, place.height() / 26.0];
    let steps = steps.map(|count| f64::from(count).clamp(2.0, 6.0));
    let drawn = move |ui: &mut Ui| {
        with_marks(still(ui, Plot::new(plot.id), tokens), steps)
            .x_axis_label(plot.names[0].unwrap_or_default())
            .y_axis_label(name_up(ui, plot.names[1].unwrap_or_default(), plot.names[0].is_some()))
            // Quiet, and the same in all of them whether they have their numbers or not.
            .grid_spacing(Rangef::new(20.0, 90.0))
            .show_axes(plot.names.map(|name| name.is_some()))
            .show(ui, move |plot_ui| {
                let [x, y] = plot.shown;
                plot_ui.set_plot_bounds_x(x[0]..=x[1]);
                plot_ui.set_plot_bounds_y(y[0]..=y[1]);
                draw(plot_ui);
            })
    };
    let response = ui.scope_builder(UiBuilder::new().max_rect(whole), drawn).inner.response;
    let mut found = gesture(ui, &response);
    if response.hovered() {
        let (wheel, zoom) = ui.input(|input| (input.smooth_scroll_delta(), input.zoom_delta()));
        found.pan[0] += f64::from(wheel.x / response.rect.width().max(1.0));
        found.zoom = f64::from(zoom);
    }
    SmallResponse { rect: response.rect, gesture: found, is_hovered: response.hovered() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_follow_the_width_and_plots_fill_the_height_as_far_as_they_have_a_good_shape() {
        let grid = |width, height, groups: &[usize]| {
            SmallGrid::new(vec2(width, height), groups, 24.0, vec2(60.0, 36.0))
        };
        let wide = grid(1100.0, 600.0, &[5, 5]);
        assert_eq!(wide.columns, 5);
        assert!((wide.cell(4).right() - 1100.0).abs() < 0.01);
        assert!((wide.plot.y - HEIGHT_SHARE * wide.plot.x).abs() < 0.01);
        let narrow = grid(300.0, 600.0, &[5, 5]);
        assert_eq!((narrow.columns, narrow.plot.y), (1, HEIGHT_MIN));
        // Two plots do not have a third of the width each.
        assert_eq!(grid(1100.0, 600.0, &[1, 2]).columns, 2);
        assert_eq!(grid(100.0, 50.0, &[]).columns, 1);
    }
}
