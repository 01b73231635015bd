//! A figure as data, painted on the screen: the same that pages and pictures show.

use super::style::{name_up, quiet, round_marks};
use crate::theme::Tokens;
use crate::widgets::tokens_of;
use eframe::egui::{Align2, Color32, Id, Role, Sense, TextStyle, Ui, WidgetInfo, vec2};
use egui_plot::{
    FilledArea, GridInput, GridMark, HLine, HoverPosition, Line, LineStyle, PlotPoint, PlotPoints,
    PlotUi, Points, Span, Text, VLine,
};
use palpate_figures::drawing::BAND_OPACITY;
use palpate_figures::figure::{
    AxisScale, Ink, Plot, PlotAxis, PlotSeries, PointLabels, SeriesShape,
};

/// Opacity of a shaded stretch that has an ink of its own.
const SHADE: f32 = 0.16;

/// Options of a plot among others.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlotLook<'a> {
    /// Labelled steps across it and up it, at most, where it is smaller than others.
    pub steps: [Option<f64>; 2],
    /// Plots of one name share what they show along x.
    pub link: Option<&'static str>,
    /// What is always shown along x; its axis is not drawn if it has no name.
    pub shown: Option<[f64; 2]>,
    /// How places along x are written, where not as numbers.
    pub x_text: Option<fn(f64) -> String>,
    /// What is drawn over it on the same axes.
    pub over: Option<&'a PlacedPlot>,
}

/// A plot whose points are placed on their axes once and not in every frame. Of the plot, everything but its series may
/// change from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct PlacedPlot {
    pub plot: Plot,
    points: Vec<Vec<PlotPoint>>,
}

impl From<Plot> for PlacedPlot {
    fn from(plot: Plot) -> Self {
        Self { points: placed(&plot), plot }
    }
}

impl PlacedPlot {
    /// Draws it in the space there is; returns what is shown along x.
    pub fn ui(&self, ui: &mut Ui, id: &str, look: PlotLook<'_>) -> [f64; 2] {
        show(ui, id, &self.plot, &self.points, look)
    }
}

/// Draws a plot in the space there is.
pub fn plot_ui(ui: &mut Ui, id: &str, plot: &Plot, look: PlotLook<'_>) {
    show(ui, id, plot, &placed(plot), look);
}

/// The points of each series on the plot's axes.
fn placed(plot: &Plot) -> Vec<Vec<PlotPoint>> {
    let place = |one: &PlotSeries| one.points.iter().map(|at| plot.place(*at).into()).collect();
    plot.series.iter().map(place).collect()
}

fn show(
    ui: &mut Ui,
    id: &str,
    plot: &Plot,
    points: &[Vec<PlotPoint>],
    look: PlotLook<'_>,
) -> [f64; 2] {
    let tokens = tokens_of(ui);
    let (x_text, y_unit) = (look.x_text, unit(&plot.y));
    let has_axis_below = look.shown.is_none() || !plot.x.name.is_empty();
    let mut drawn = quiet(ui, egui_plot::Plot::new(id.to_owned()), tokens)
        .x_axis_label(plot.x.name.as_str())
        .y_axis_label(name_up(ui, &plot.y.name, has_axis_below))
        .show_axes([has_axis_below, true])
        .auto_bounds([look.shown.is_none(), true])
        .allow_drag([look.shown.is_none(), true])
        .label_formatter(move |hover| match hover {
            HoverPosition::NearDataPoint { position, .. } => {
                let own = label_at(plot, points, position).map(str::to_owned);
                let x =
                    x_text.map_or_else(|| format!("{:.3}", position.x), |text| text(position.x));
                Some(own.unwrap_or_else(|| format!("{x}\n{:.4}{y_unit}", position.y)))
            }
            HoverPosition::Elsewhere { .. } => None,
        });
    if plot.x.scale == AxisScale::Logarithmic {
        drawn = drawn.x_grid_spacer(decades).x_axis_formatter(|mark, _| decade_text(mark));
    } else if let Some(steps) = look.steps[0] {
        drawn = drawn.x_grid_spacer(move |input| round_marks(input, steps));
    }
    if let Some(text) = look.x_text {
        drawn = drawn.x_axis_formatter(move |mark, _| text(mark.value));
    }
    if plot.y.scale == AxisScale::Rows {
        drawn = drawn.y_axis_formatter(|_, _| String::new()).y_grid_spacer(|_| Vec::new());
    }
    if plot.y.scale == AxisScale::Logarithmic {
        drawn = drawn
            .y_grid_spacer(decades)
            .y_axis_formatter(|mark, _| decade_text(mark))
            // The ring around a recommended point needs room at every edge.
            .set_margin_fraction(vec2(0.04, 0.08));
    } else if let Some(steps) = look.steps[1] {
        drawn = drawn.y_grid_spacer(move |input| round_marks(input, steps));
    }
    for &x in &plot.x.visible_values {
        drawn = drawn.include_x(plot.x.scale.place(x));
    }
    for &y in &plot.y.visible_values {
        drawn = drawn.include_y(plot.y.scale.place(y));
    }
    if let Some(link) = look.link {
        drawn = drawn.link_axis(Id::unique(link), [true, false]);
    }
    let response = drawn.show(ui, |plot_ui| {
        if let Some([from, to]) = look.shown {
            plot_ui.set_plot_bounds_x(from..=to);
        }
        paint(plot_ui, plot, points, tokens);
        if let Some(over) = look.over {
            paint(plot_ui, &over.plot, &over.points, tokens);
        }
    });
    let bounds = response.transform.bounds();
    [bounds.min()[0], bounds.max()[0]]
}

/// The unit of an even axis, as it stands behind a number.
fn unit(axis: &PlotAxis) -> String {
    let unit = axis.name.rsplit_once(" (").and_then(|(_, rest)| rest.strip_suffix(')'));
    match (unit, axis.scale) {
        (Some(unit), AxisScale::Linear) => format!(" {unit}"),
        _ => String::new(),
    }
}

/// Draws names and inks of plots in one line, each name once.
pub fn legend_ui(ui: &mut Ui, plots: &[&Plot]) {
    let mut known: Vec<&str> = Vec::new();
    ui.horizontal_wrapped(|ui| {
        for (name, ink) in plots.iter().flat_map(|plot| plot.legend()) {
            if !known.contains(&name) {
                known.push(name);
                patch_ui(ui, ink, name);
            }
        }
    });
}

/// Draws a patch of an ink and the words that it stands for, both in the same line.
pub fn patch_ui(ui: &mut Ui, ink: Ink, words: &str) {
    let tokens = tokens_of(ui);
    let font = TextStyle::Small.resolve(ui.style());
    let text = ui.painter().layout_no_wrap(words.to_owned(), font, tokens.text);
    let patch = vec2(12.0, 12.0);
    let indent = patch.x + ui.spacing().item_spacing.x;
    let size = vec2(indent + text.size().x, text.size().y.max(patch.y));
    let (rect, response) = ui.allocate_exact_size(size, Sense::empty());
    let middle = Align2::LEFT_CENTER.align_size_within_rect(patch, rect);
    ui.painter().rect_filled(middle, 2.0, ink.of(tokens));
    ui.painter().galley(rect.min + vec2(indent, 0.0), text, tokens.text);
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, words));
}

/// Draws what a loop did over time so high in points, live or computed, its names above: nothing along x has a name
/// where another strip stands below.
pub fn strip_ui(
    ui: &mut Ui,
    [x, y]: [&str; 2],
    curves: Vec<PlotSeries>,
    shown: [f64; 2],
    height: f32,
) {
    // What is at rest is a line at zero and no noise.
    let plot =
        Plot::new("", PlotAxis::linear(x), PlotAxis::linear(y).with_visible_values(&[0.0, 0.5]))
            .with(curves);
    legend_ui(ui, &[&plot]);
    ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
        plot_ui(ui, y, &plot, PlotLook { shown: Some(shown), ..PlotLook::default() });
    });
}

/// The label of a point, shown under the pointer.
fn label_at<'a>(plot: &'a Plot, points: &[Vec<PlotPoint>], at: &PlotPoint) -> Option<&'a str> {
    plot.series.iter().zip(points).find_map(|(one, points)| {
        let PointLabels::Each(labels) = &one.labels else { return None };
        let is_it = |point: &PlotPoint| point.x == at.x && point.y == at.y;
        points.iter().position(is_it).map(|index| labels[index][1].as_str())
    })
}

fn paint<'a>(
    plot_ui: &mut PlotUi<'a>,
    plot: &'a Plot,
    points: &'a [Vec<PlotPoint>],
    tokens: &Tokens,
) {
    for stretch in &plot.stretches {
        let [from, to] = stretch.ends.map(|x| plot.x.scale.place(x));
        let span = Span::new(stretch.name.as_str(), from..=to);
        let (fill, border) = match stretch.ink {
            None => (Color32::TRANSPARENT, tokens.line),
            Some(Ink::Line) => (tokens.phase_band, tokens.line),
            Some(ink) => (ink.of(tokens).gamma_multiply(SHADE), ink.of(tokens)),
        };
        plot_ui.span(span.fill(fill).border_color(border));
    }
    for (number, band) in plot.bands.iter().enumerate() {
        let edge = |edge: &Vec<[f64; 2]>| -> (Vec<f64>, Vec<f64>) {
            let placed = edge.iter().map(|point| plot.place(*point));
            placed.map(|[x, y]| (x, y)).unzip()
        };
        let [low, high] = band.edges.each_ref().map(edge);
        let area = FilledArea::new(band.name.as_str(), &low.0, &low.1, &high.1);
        let ink = band.ink.of(tokens).gamma_multiply(BAND_OPACITY as f32);
        plot_ui.add(area.id((band.name.as_str(), number)).fill_color(ink).allow_hover(false));
    }
    for level in &plot.levels {
        let at = plot.y.scale.place(level.at);
        let line = HLine::new(level.name.as_str(), at).color(level.ink.of(tokens));
        let width = if level.name.is_empty() { 1.0 } else { 1.5 };
        plot_ui.hline(line.style(style_of(level.dash())).width(width).allow_hover(false));
        // At the left edge as it will be: the text's own place counts in the automatic bounds.
        let left = plot.x.range.map(|[from, _]| from).or(plot.x.visible_values.first().copied());
        if let Some(left) = left.filter(|_| !level.name.is_empty()) {
            let text = Text::new(
                "level",
                PlotPoint::new(plot.x.scale.place(left), at),
                format!(" {}", level.name),
            );
            let text = text.anchor(Align2::LEFT_TOP).color(tokens.text_quiet);
            plot_ui.text(text.allow_hover(false));
        }
    }
    for moment in &plot.x_levels {
        let at = plot.x.scale.place(moment.at);
        let line = VLine::new(moment.name.as_str(), at).color(moment.ink.of(tokens));
        plot_ui.vline(line.style(style_of(moment.dash())).width(1.5).allow_hover(false));
    }
    for (number, (one, points)) in plot.series.iter().zip(points).enumerate() {
        paint_series(plot_ui, one, points, number, tokens);
    }
    if plot.y.scale == AxisScale::Rows {
        paint_row_names(plot_ui, plot, points, tokens);
    }
    if let Some(remark) = &plot.remark {
        let bounds = plot_ui.plot_bounds();
        let text = Text::new("remark", bounds.center(), remark.as_str());
        plot_ui.text(text.color(tokens.text_quiet).allow_hover(false));
    }
}

/// Writes the short names of points behind them.
fn paint_row_names<'a>(
    plot_ui: &mut PlotUi<'a>,
    plot: &'a Plot,
    points: &'a [Vec<PlotPoint>],
    tokens: &Tokens,
) {
    for (one, points) in plot.series.iter().zip(points) {
        let PointLabels::Each(names) = &one.labels else { continue };
        for (at, [name, _]) in points.iter().zip(names) {
            let text = Text::new(name.as_str(), *at, format!("  {name}"));
            let text = text.anchor(Align2::LEFT_CENTER).color(tokens.text);
            plot_ui.text(text.allow_hover(false));
        }
    }
}

/// Dashes of this length in px, 0 for a whole line.
fn style_of(dash: f64) -> LineStyle {
    if dash > 0.0 { LineStyle::Dashed { length: dash as f32 } } else { LineStyle::Solid }
}

fn paint_series<'a>(
    plot_ui: &mut PlotUi<'a>,
    one: &'a PlotSeries,
    points: &'a [PlotPoint],
    number: usize,
    tokens: &Tokens,
) {
    let ink = one.ink.of(tokens).gamma_multiply(one.opacity as f32);
    let id = (one.name.as_str(), number);
    let points = PlotPoints::Borrowed(points);
    match one.shape {
        SeriesShape::Line { width, dash } => {
            // Bands of points that share a column would be drawn as wedges where there are few.
            let line = Line::new(one.name.as_str(), points).id(id).allow_band(false);
            plot_ui.line(line.color(ink).width(width as f32).style(style_of(dash)));
        }
        SeriesShape::Dots { radius, is_filled } => {
            let dots = Points::new(one.name.as_str(), points).id(id);
            let is_hovered = one.labels != PointLabels::None || !one.name.is_empty();
            plot_ui.points(
                dots.radius(radius as f32).filled(is_filled).color(ink).allow_hover(is_hovered),
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
