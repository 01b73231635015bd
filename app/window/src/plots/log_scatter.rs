//! Points over two logarithmic axes: what accuracy costs.

use super::style::quiet;
use crate::theme::Tokens;
use eframe::egui::{Ui, vec2};
use egui_plot::{
    GridInput, GridMark, HLine, HoverPosition, Line, Plot, PlotPoint, PlotPoints, Points,
};
use palpate_rheology::trade::front;

/// One point.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Along both axes, above zero.
    pub at: [f64; 2],
    /// What it is, for the readout.
    pub name: String,
}

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Scatter<'a> {
    /// Names of both axes with their units.
    pub axes: [&'a str; 2],
    /// All points.
    pub marks: &'a [Mark],
    /// Whether those that no other undercuts in both are joined: only where all stand for the same.
    pub has_front: bool,
    /// The one recommended.
    pub chosen: Option<usize>,
    /// A level not to exceed.
    pub level: Option<f64>,
}

/// A value at or below zero is drawn here; nothing measured is so small.
const LEAST: f64 = 1e-18;

fn place(at: [f64; 2]) -> PlotPoint {
    let [x, y] = at.map(|value| value.max(LEAST).log10());
    PlotPoint::new(x, y)
}

/// Draws the points in the space there is.
pub fn log_scatter_ui(ui: &mut Ui, id: &str, scatter: &Scatter<'_>) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let of = |chosen: &mut dyn Iterator<Item = usize>| -> Vec<PlotPoint> {
        chosen
            .filter_map(|i| scatter.marks.get(i))
            .map(|mark| place(mark.at))
            .collect()
    };
    let best: Vec<usize> = match scatter.has_front {
        true => {
            let places: Vec<[f64; 2]> = scatter.marks.iter().map(|mark| mark.at).collect();
            front(&places)
        }
        false => Vec::new(),
    };
    let front = of(&mut best.iter().copied());
    // Where there is a front, a point beside it is hollow.
    let is_hollow = |i: &usize| scatter.has_front && !best.contains(i);
    let parts = [false, true].map(|hollow| {
        let count = scatter.marks.len();
        of(&mut (0..count).filter(|i| is_hollow(i) == hollow))
    });
    let chosen = of(&mut scatter.chosen.into_iter());
    let names: Vec<(PlotPoint, String)> = scatter
        .marks
        .iter()
        .map(|mark| (place(mark.at), mark.name.clone()))
        .collect();
    let plot = quiet(ui, Plot::new(id.to_owned()), tokens)
        .x_axis_label(scatter.axes[0])
        .y_axis_label(scatter.axes[1])
        .x_grid_spacer(decades)
        .y_grid_spacer(decades)
        .x_axis_formatter(|mark, _| decade_text(mark))
        .y_axis_formatter(|mark, _| decade_text(mark))
        // The ring around the recommended point needs room at every edge.
        .set_margin_fraction(vec2(0.04, 0.08))
        .label_formatter(move |hover| match hover {
            HoverPosition::NearDataPoint { position, .. } => names
                .iter()
                .find(|(at, _)| at.x == position.x && at.y == position.y)
                .map(|(_, name)| name.clone()),
            HoverPosition::Elsewhere { .. } => None,
        });
    plot.show(ui, |plot_ui| {
        if let Some(level) = scatter.level.filter(|level| *level > 0.0) {
            plot_ui.hline(HLine::new("tolerance", level.log10()).color(tokens.limit));
        }
        // Piece by piece: one line would draw the sharp turns of a front as wedges.
        for ends in front.windows(2) {
            let line = Line::new("best for its cost", PlotPoints::Owned(ends.to_vec()));
            plot_ui.line(line.color(tokens.text_quiet).allow_hover(false));
        }
        for (points, is_filled) in parts.into_iter().zip([true, false]) {
            plot_ui.points(
                Points::new("measured", PlotPoints::Owned(points))
                    .radius(3.5)
                    .filled(is_filled)
                    .color(tokens.series),
            );
        }
        plot_ui.points(
            Points::new("recommended", PlotPoints::Owned(chosen))
                .radius(7.0)
                .filled(false)
                .color(tokens.text)
                .allow_hover(false),
        );
    });
}

/// Marks at powers of ten, as many as there is room for.
fn decades(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    if !(low.is_finite() && high.is_finite() && high > low) {
        return Vec::new();
    }
    // Labels of more than nine powers would touch each other.
    let step = ((high - low) / 9.0).ceil().max(1.0);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last)
        .map(|i| GridMark {
            value: i as f64 * step,
            step_size: step,
        })
        .collect()
}

/// The power of ten as people write it, with its sign in words where it is small.
fn decade_text(mark: GridMark) -> String {
    let power = mark.value.round();
    if (-3.0..=4.0).contains(&power) {
        let decimals = (-power).max(0.0) as usize;
        format!("{:.decimals$}", 10f64.powf(power))
    } else {
        format!("1e{power:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_stand_at_powers_of_ten() {
        let marks = |low, high| {
            let input = GridInput {
                bounds: (low, high),
                base_step_size: 1.0,
            };
            decades(input)
                .iter()
                .map(|mark| mark.value)
                .collect::<Vec<_>>()
        };
        assert_eq!(marks(-0.5, 2.2), [0.0, 1.0, 2.0]);
        assert_eq!(marks(-18.0, 0.0).len(), 10);
        assert!(marks(0.0, f64::INFINITY).is_empty());
    }

    #[test]
    fn powers_read_as_numbers_where_they_are_short() {
        let text = |value| {
            decade_text(GridMark {
                value,
                step_size: 1.0,
            })
        };
        assert_eq!(
            [-9.0, -2.0, 0.0, 3.0, 7.0].map(text),
            ["1e-9", "0.01", "1", "1000", "1e7"]
        );
    }

    #[test]
    fn nothing_is_drawn_at_infinity() {
        assert!(place([0.0, -1.0]).x.is_finite() && place([0.0, -1.0]).y.is_finite());
    }
}
