//! A figure of several plots in a grid, under one title, with the names and inks of what is compared beneath.

use super::picture::{LEFT, RIGHT, titled};
use palpate_figures::drawing::{Drawing, TextStyle};
use palpate_figures::figure::{AxisNames, Ink, Plot};
use palpate_figures::tokens::LIGHT;

/// Upper edge of the first row, and what stands between two rows and two columns, in px.
const TOP: f64 = 66.0;
const BETWEEN: [f64; 2] = [58.0, 46.0];
/// Height of a plot as a share of its width, and bounds of it in px.
const SHARE: f64 = 0.62;
const HEIGHTS: [f64; 2] = [120.0, 300.0];
/// Lines of the legend are so high, in px.
const LEGEND: f64 = 20.0;

/// Plots that are shown together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FigurePanels {
    pub title: String,
    /// A line beneath the title.
    pub words: String,
    /// Row by row, each with its own title.
    pub plots: Vec<Plot>,
    pub columns: usize,
    pub legend: Vec<(String, Ink)>,
}

impl FigurePanels {
    /// Draws them; names of axes stand at the outer edges alone.
    #[must_use]
    pub fn drawing(&self) -> Drawing {
        let mut svg = titled(&self.title, &self.words);
        let columns = self.columns.max(1);
        let width = (RIGHT - LEFT + BETWEEN[0]) / columns as f64 - BETWEEN[0];
        let rows = self.plots.len().div_ceil(columns);
        let height = match columns {
            1 => (620.0 / rows.max(1) as f64).clamp(HEIGHTS[0], HEIGHTS[1]),
            _ => (SHARE * width).clamp(HEIGHTS[0], HEIGHTS[1]),
        };
        let heading = if self.plots.iter().all(|plot| plot.title.is_empty()) { 0.0 } else { 18.0 };
        let step = heading + height + BETWEEN[1];
        for (number, plot) in self.plots.iter().enumerate() {
            let (row, column) = (number / columns, number % columns);
            let left = LEFT + column as f64 * (width + BETWEEN[0]);
            let top = TOP + heading + row as f64 * step;
            let mut plot = plot.clone();
            if column > 0 {
                plot.y.name.clear();
            }
            let names = match number + columns < self.plots.len() {
                true => AxisNames::Upright,
                false => AxisNames::Both,
            };
            svg.text([left, top - 6.0], TextStyle::plain(LIGHT.text), &plot.title);
            plot.draw(&mut svg, [left, top, left + width, top + height], names);
        }
        let mut y = TOP + rows as f64 * step;
        for (name, ink) in &self.legend {
            y += LEGEND;
            svg.line(&[[LEFT, y - 10.0], [LEFT + 40.0, y - 10.0]], ink.of(&LIGHT), 2.0);
            svg.text([LEFT + 50.0, y - 6.0], TextStyle::plain(LIGHT.text), name);
        }
        svg.drawing(y + 10.0, LIGHT.canvas, &format!("{}, {}", self.title, self.words))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_figures::figure::{PlotAxis, PlotSeries};

    #[test]
    fn names_of_axes_stand_at_the_outer_edges_and_every_session_in_the_legend() {
        let plot = |title: &str| {
            let line = PlotSeries::line("", Ink::Series, 1.0, vec![[0.0, 0.0], [1.0, 2.0]]);
            let axes = [PlotAxis::linear("time (s)"), PlotAxis::linear("force (N)")];
            let [x, y] = axes;
            Plot::new(title, x, y).with([line])
        };
        let figure = FigurePanels {
            title: "Side by side".into(),
            words: "three sessions".into(),
            plots: vec![plot("one"), plot("two"), plot("three")],
            columns: 2,
            legend: vec![("measured".into(), Ink::Series)],
        };
        let svg = figure.drawing().svg();
        // The second column has no plot in the second row.
        for (words, count) in [("time (s)", 2), ("force (N)", 2), (">two<", 1), (">measured<", 1)] {
            assert_eq!(svg.matches(words).count(), count, "{words}");
        }
    }
}
