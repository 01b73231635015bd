//! A plot drawn into a rectangle of a picture for a file.

use super::labels::{label_position, spread_heights};
use super::{AxisScale, Ink, Plot, PlotSeries, PlotStretch, PointLabels, SeriesShape};
use crate::drawing::{Anchor, AxisColours, FONT, PlotPanel, Svg, TextStyle as TextInk};
use crate::panel::range;
use crate::tokens::LIGHT;

/// Letters are about so wide, in px.
const LETTER: f64 = 7.0;

/// Which names of axes are written: of plots above each other only the lowest needs both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisNames {
    /// Both.
    Both,
    /// The upright one's.
    Upright,
}

impl Plot {
    /// Draws it with its axes; the legend is drawn by itself, where there is room for it.
    pub fn draw(&self, svg: &mut Svg, place: [f64; 4], names: AxisNames) {
        let panel = self.panel(place);
        for stretch in &self.stretches {
            self.draw_stretch(svg, &panel, stretch);
        }
        let x_name = match names {
            AxisNames::Both => self.x.name.as_str(),
            AxisNames::Upright => "",
        };
        let look = AxisColours { text: LIGHT.text_quiet, grid: LIGHT.line };
        panel.scaled_axes(svg, [x_name, &self.y.name], [self.x.scale, self.y.scale], look);
        for band in &self.bands {
            let [lower, upper] = band.edges.each_ref().map(|edge| self.placed(&panel, edge));
            if !upper.is_empty() {
                svg.band(&upper, &lower, band.ink.of(&LIGHT));
            }
        }
        self.draw_levels(svg, &panel);
        for one in &self.series {
            self.draw_series(svg, &panel, one);
        }
        self.draw_names(svg, &panel);
        if let Some(remark) = &self.remark {
            let at = [place[0] + 12.0, place[1] + 24.0];
            svg.text(at, TextInk::plain(LIGHT.text_quiet), remark);
        }
    }

    fn panel(&self, place: [f64; 4]) -> PlotPanel {
        let points = self.series.iter().flat_map(|one| &one.points);
        let edges = self.bands.iter().flat_map(|band| band.edges.iter().flatten());
        let placed = points.chain(edges).map(|point| self.place(*point));
        let placed: Vec<[f64; 2]> =
            placed.filter(|point| point.iter().all(|value| value.is_finite())).collect();
        let [left, right] = match (self.x.range, self.x.scale) {
            (Some(range), scale) => range.map(|x| scale.place(x)),
            (None, AxisScale::Logarithmic) => PlotPanel::around_logarithms(place, &placed).x,
            (None, AxisScale::Linear | AxisScale::Rows) => {
                let ends = range(placed.iter().map(|point| point[0]));
                ends.filter(|[low, high]| low < high).unwrap_or([0.0, 1.0])
            }
        };
        let levels = self.levels.iter().map(|level| level.at);
        let seen = self.y.visible_values.iter().copied().chain(levels);
        let seen = seen.map(|y| [left, self.y.scale.place(y)]);
        let all: Vec<[f64; 2]> = placed.iter().copied().chain(seen).collect();
        let y = match (self.y.range, self.y.scale) {
            (Some(range), scale) => range.map(|y| scale.place(y)),
            (None, AxisScale::Linear | AxisScale::Rows) => {
                PlotPanel::around(place, [left, right], &[&all]).y
            }
            (None, AxisScale::Logarithmic) => PlotPanel::around_logarithms(place, &all).y,
        };
        PlotPanel { place, x: [left, right], y }
    }

    fn placed(&self, panel: &PlotPanel, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let places = points.iter().map(|point| panel.at(self.place(*point)));
        places.collect()
    }

    fn draw_stretch(&self, svg: &mut Svg, panel: &PlotPanel, stretch: &PlotStretch) {
        let [_, top, _, bottom] = panel.place;
        let ends = stretch.ends.map(|x| self.x.scale.place(x));
        if let Some(ink) = stretch.ink {
            panel.shade(svg, ends, ink.of(&LIGHT));
        }
        let [left, right] = ends.map(|x| panel.at([x, 0.0])[0]);
        let room = LETTER * stretch.name.chars().count() as f64;
        match stretch.ink {
            None | Some(Ink::Line) if right - left > room => {
                let ink = TextInk::plain(LIGHT.text_quiet).anchored(Anchor::Middle);
                svg.text([0.5 * (left + right), top + 14.0], ink, &stretch.name);
            }
            None | Some(Ink::Line) => {}
            // What stands out is named in any case.
            Some(_) => {
                svg.text([left + 3.0, bottom - 6.0], TextInk::plain(LIGHT.text), &stretch.name);
            }
        }
    }

    fn draw_levels(&self, svg: &mut Svg, panel: &PlotPanel) {
        let [left, top, right, bottom] = panel.place;
        for level in &self.levels {
            let [_, y] = panel.at([panel.x[0], self.y.scale.place(level.at)]);
            let ink = level.ink.of(&LIGHT);
            let width = if !level.is_dashed && level.name.is_empty() { 0.8 } else { 1.6 };
            svg.dashed_line(&[[left, y], [right, y]], ink, width, level.dash());
            // Beneath where names of stretches stand above.
            let (at, anchor) = match self.stretches.is_empty() {
                true => ([left + 6.0, y - 5.0], Anchor::Start),
                false => ([right - 6.0, y + 16.0], Anchor::End),
            };
            svg.text(at, TextInk::plain(ink).anchored(anchor), &level.name);
        }
        for moment in &self.x_levels {
            let [x, _] = panel.at([self.x.scale.place(moment.at), 0.0]);
            let ink = moment.ink.of(&LIGHT);
            svg.dashed_line(&[[x, top], [x, bottom]], ink, 1.2, moment.dash());
        }
    }

    fn draw_series(&self, svg: &mut Svg, panel: &PlotPanel, one: &PlotSeries) {
        let ink = match one.opacity {
            1.0.. => one.ink.of(&LIGHT),
            faint => LIGHT.canvas.lerp_to_gamma(one.ink.of(&LIGHT), faint as f32),
        };
        let places = self.placed(panel, &one.points);
        match one.shape {
            SeriesShape::Line { width, dash } => {
                svg.dashed_line(&places, ink, width, dash);
            }
            SeriesShape::Dots { radius, is_filled } => {
                for at in places {
                    svg.dot(at, ink, radius);
                    if !is_filled {
                        svg.dot(at, LIGHT.canvas, radius - 1.6);
                    }
                }
            }
        }
    }

    fn draw_names(&self, svg: &mut Svg, panel: &PlotPanel) {
        let [_, top, right, bottom] = panel.place;
        let text = TextInk::plain(LIGHT.text);
        let named = self.series.iter().filter(|one| one.labels == PointLabels::AtEnd);
        let ends: Vec<(&str, [f64; 2])> = named
            .filter_map(|one| {
                let last = one.points.last()?;
                Some((one.name.as_str(), panel.at(self.place(*last))))
            })
            .collect();
        let heights: Vec<f64> = ends.iter().map(|(_, [_, y])| *y).collect();
        for ((name, end), y) in ends.iter().zip(spread_heights(&heights, [top, bottom])) {
            svg.line(&[*end, [right + 14.0, y]], LIGHT.line, 0.6);
            let at = [right + 18.0, y + 0.35 * FONT];
            svg.text(at, text.anchored(Anchor::Start), name);
        }
        let all = self.series.iter().flat_map(|one| &one.points).copied();
        let points = self.placed(panel, &all.collect::<Vec<_>>());
        let mut labels: Vec<[f64; 2]> = Vec::new();
        for one in &self.series {
            let PointLabels::Each(names) = &one.labels else {
                continue;
            };
            for (place, [name, _]) in self.placed(panel, &one.points).into_iter().zip(names) {
                let at = label_position(place, [top, bottom], &points, &labels);
                labels.push(at);
                svg.text(at, text, name);
            }
        }
    }
}

/// Names and their inks in one line that ends at the right.
pub fn legend(svg: &mut Svg, [right, y]: [f64; 2], plot: &Plot) {
    let mut x = right;
    for (name, ink) in plot.legend().into_iter().rev() {
        x -= LETTER * name.chars().count() as f64 + 12.0;
        svg.text([x, y + 4.0], TextInk::plain(LIGHT.text), name);
        svg.line(&[[x - 26.0, y], [x - 6.0, y]], ink.of(&LIGHT), 2.5);
        x -= 34.0;
    }
}

#[cfg(test)]
mod tests {
    use super::super::{PlotAxis, PlotLevel};
    use super::*;

    fn drawn(plot: &Plot) -> String {
        let mut svg = Svg::new(400.0);
        plot.draw(&mut svg, [50.0, 10.0, 350.0, 210.0], AxisNames::Both);
        svg.finish(260.0, LIGHT.canvas, "a plot")
    }

    #[test]
    fn points_levels_and_names_stand_where_the_axes_say() {
        let x = PlotAxis::linear("x (mm)").with_range([0.0, 10.0]);
        let y = PlotAxis::linear("y (N)");
        let line = PlotSeries::line("rises", Ink::Series, 1.0, vec![[0.0, 0.0], [10.0, 1.0]]);
        let plot = Plot {
            levels: vec![PlotLevel {
                name: "most".into(),
                at: 1.0,
                ink: Ink::Limit,
                is_dashed: true,
            }],
            ..Plot::new("", x, y).with([line.labelled(PointLabels::AtEnd)])
        };
        let text = drawn(&plot);
        // A margin of a twentieth of the height lies above and below.
        let low = 210.0 - 200.0 * 0.05 / 1.1;
        let high = 10.0 + 200.0 * 0.05 / 1.1;
        assert!(text.contains(&format!("points=\"50.0,{low:.1} 350.0,{high:.1}\"")), "{text}");
        assert!(text.contains("stroke-dasharray") && text.contains(">most<"), "{text}");
        assert!(text.contains(">rises<") && text.contains(">x (mm)<"), "{text}");
    }

    #[test]
    fn a_logarithmic_axis_has_its_marks_at_powers_or_between_them() {
        let axes = |range| {
            let x = PlotAxis::logarithmic("x").with_range(range);
            let line =
                PlotSeries::line("", Ink::Series, 1.0, vec![[range[0], 1.0], [range[1], 2.0]]);
            drawn(&Plot::new("", x, PlotAxis::linear("y")).with([line]))
        };
        let wide = axes([0.01, 1000.0]);
        assert!(
            wide.contains(">0.01<") && wide.contains(">100<") && !wide.contains(">20<"),
            "{wide}"
        );
        let narrow = axes([15.0, 60.0]);
        assert!(narrow.contains(">20<") && narrow.contains(">50<"), "{narrow}");
    }
}
