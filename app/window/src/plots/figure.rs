//! A figure as data, painted on the screen: the same that pages and pictures show.

use super::strip;
use super::style::{quiet, round_marks};
use crate::theme::Tokens;
use eframe::egui::{Id, Ui, vec2};
use egui_plot::{
    FilledArea, GridInput, GridMark, HLine, HoverPosition, Line, LineStyle, PlotPoint, PlotPoints,
    PlotUi, Points, Span, Text,
};
use palpate_figures::drawing::BAND_OPACITY;
use palpate_figures::figure::{Labels, Plot, Scale, Series, Shape};

/// How a plot stands among others.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlotLook {
    /// Labelled steps across it, at most, where it is narrower than others.
    pub steps_across: Option<f64>,
    /// Plots of one name share what they show along x.
    pub link: Option<&'static str>,
}

/// Draws a plot in the space there is.
pub fn plot_ui(ui: &mut Ui, id: &str, plot: &Plot, look: PlotLook) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let told = readouts(plot);
    let mut drawn = quiet(ui, egui_plot::Plot::new(id.to_owned()), tokens)
        .x_axis_label(plot.x.name.as_str())
        .y_axis_label(plot.y.name.as_str())
        .label_formatter(move |hover| match hover {
            HoverPosition::NearDataPoint { position, .. } => {
                let is_it =
                    |(at, _): &&(PlotPoint, String)| at.x == position.x && at.y == position.y;
                let own = told.iter().find(is_it).map(|(_, words)| words.clone());
                Some(own.unwrap_or_else(|| format!("{:.3}\n{:.4}", position.x, position.y)))
            }
            HoverPosition::Elsewhere { .. } => None,
        });
    if plot.x.scale == Scale::Logarithmic {
        drawn = drawn.x_grid_spacer(decades).x_axis_formatter(|mark, _| decade_text(mark));
    } else if let Some(steps) = look.steps_across {
        drawn = drawn.x_grid_spacer(move |input| round_marks(input, steps));
    }
    if plot.y.scale == Scale::Logarithmic {
        drawn = drawn
            .y_grid_spacer(decades)
            .y_axis_formatter(|mark, _| decade_text(mark))
            // The ring around a recommended point needs room at every edge.
            .set_margin_fraction(vec2(0.04, 0.08));
    }
    for &y in &plot.y.seen {
        drawn = drawn.include_y(plot.y.scale.place(y));
    }
    if let Some(link) = look.link {
        drawn = drawn.link_axis(Id::unique(link), [true, false]);
    }
    drawn.show(ui, |plot_ui| paint(plot_ui, plot, tokens));
}

/// Draws names and inks of plots in one line.
pub fn legend_ui(ui: &mut Ui, plots: &[&Plot]) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let mut known: Vec<&str> = Vec::new();
    ui.horizontal_wrapped(|ui| {
        for (name, ink) in plots.iter().flat_map(|plot| plot.legend()) {
            if !known.contains(&name) {
                known.push(name);
                strip::legend_ui(ui, ink.of(tokens), name);
            }
        }
    });
}

/// What is told under the pointer of points that have something to tell.
fn readouts(plot: &Plot) -> Vec<(PlotPoint, String)> {
    let each = plot.series.iter().filter_map(|one| match &one.labels {
        Labels::Each(labels) => Some(one.points.iter().zip(labels)),
        _ => None,
    });
    let points = each.flatten();
    points.map(|(at, [_, words])| (plot.place(*at).into(), words.clone())).collect()
}

fn paint(plot_ui: &mut PlotUi<'_>, plot: &Plot, tokens: &Tokens) {
    for stretch in &plot.stretches {
        let [from, to] = stretch.ends.map(|x| plot.x.scale.place(x));
        let span = Span::new(stretch.name.as_str(), from..=to);
        plot_ui.span(span.fill(tokens.phase_band).border_color(tokens.line));
    }
    for band in &plot.bands {
        let edge = |edge: &Vec<[f64; 2]>| -> (Vec<f64>, Vec<f64>) {
            let placed = edge.iter().map(|point| plot.place(*point));
            placed.map(|[x, y]| (x, y)).unzip()
        };
        let [low, high] = band.edges.each_ref().map(edge);
        let area = FilledArea::new(band.name.as_str(), &low.0, &low.1, &high.1);
        let ink = band.ink.of(tokens).gamma_multiply(BAND_OPACITY as f32);
        plot_ui.add(area.fill_color(ink));
    }
    for level in &plot.levels {
        let at = plot.y.scale.place(level.at);
        let style = match level.is_dashed {
            true => LineStyle::dashed_dense(),
            false => LineStyle::Solid,
        };
        let line = HLine::new(level.name.as_str(), at).color(level.ink.of(tokens));
        plot_ui.hline(line.style(style).width(1.0).allow_hover(false));
    }
    for (number, one) in plot.series.iter().enumerate() {
        paint_series(plot_ui, plot, one, number, tokens);
    }
    if let Some(remark) = &plot.remark {
        let bounds = plot_ui.plot_bounds();
        let text = Text::new("remark", bounds.center(), remark.as_str());
        plot_ui.text(text.color(tokens.text_quiet).allow_hover(false));
    }
}

fn paint_series(
    plot_ui: &mut PlotUi<'_>,
    plot: &Plot,
    one: &Series,
    number: usize,
    tokens: &Tokens,
) {
    let ink = one.ink.of(tokens).gamma_multiply(one.opacity as f32);
    let id = (one.name.as_str(), number);
    let points: PlotPoints<'_> = one.points.iter().map(|point| plot.place(*point)).collect();
    match one.shape {
        Shape::Line { width, is_dashed } => {
            let style = match is_dashed {
                true => LineStyle::dashed_dense(),
                false => LineStyle::Solid,
            };
            // Bands of points that share a column would be drawn as wedges where there are few.
            let line = Line::new(one.name.as_str(), points).id(id).allow_band(false);
            plot_ui.line(line.color(ink).width(width as f32).style(style));
        }
        Shape::Dots { radius, is_filled } => {
            let dots = Points::new(one.name.as_str(), points).id(id);
            let is_told = one.labels != Labels::None || !one.name.is_empty();
            plot_ui.points(
                dots.radius(radius as f32).filled(is_filled).color(ink).allow_hover(is_told),
            );
        }
    }
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
    (first..=last).map(|i| GridMark { value: i as f64 * step, step_size: step }).collect()
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
            let input = GridInput { bounds: (low, high), base_step_size: 1.0 };
            decades(input).iter().map(|mark| mark.value).collect::<Vec<_>>()
        };
        assert_eq!(marks(-0.5, 2.2), [0.0, 1.0, 2.0]);
        assert_eq!(marks(-18.0, 0.0).len(), 10);
        assert!(marks(0.0, f64::INFINITY).is_empty());
    }

    #[test]
    fn powers_read_as_numbers_where_they_are_short() {
        let text = |value| decade_text(GridMark { value, step_size: 1.0 });
        assert_eq!([-9.0, -2.0, 0.0, 3.0, 7.0].map(text), ["1e-9", "0.01", "1", "1000", "1e7"]);
    }
}
