//! Points over two logarithmic axes, such as error over cost.

use palpate_figures::figure::{Ink, Plot, PlotAxis, PlotLevel, PlotSeries, PointLabels};
use palpate_rheology::trade::find_pareto_front;

#[derive(Clone, Debug)]
pub struct ScatterPoint {
    /// Along both axes, above zero.
    pub at: [f64; 2],
    /// A short name beside it, and the text of its tooltip.
    pub label: [String; 2],
}

#[derive(Clone, Copy, Debug)]
pub struct ScatterPlot<'a> {
    /// Names of both axes with their units.
    pub axes: [&'a str; 2],
    pub marks: &'a [ScatterPoint],
    /// Whether those that no other undercuts in both are joined: only where all stand for the same.
    pub has_front: bool,
    pub chosen: Option<usize>,
    pub level: Option<f64>,
}

impl ScatterPlot<'_> {
    pub fn plot(&self) -> Plot {
        let best: Vec<usize> = match self.has_front {
            true => find_pareto_front(&self.marks.iter().map(|mark| mark.at).collect::<Vec<_>>()),
            false => Vec::new(),
        };
        // Where there is a front, a point beside it is hollow.
        let is_hollow = |index: &usize| self.has_front && !best.contains(index);
        let (hollow, full): (Vec<usize>, Vec<usize>) = (0..self.marks.len()).partition(is_hollow);
        let points = |of: &[usize]| of.iter().map(|&index| self.marks[index].at).collect();
        let labels = |of: &[usize]| {
            let labels = of.iter().map(|&index| self.marks[index].label.clone());
            PointLabels::Each(labels.collect())
        };
        let chosen: Vec<usize> = self.chosen.into_iter().collect();
        let level = self.level.filter(|level| *level > 0.0);
        let level = level.map(|at| PlotLevel {
            name: "tolerance".to_owned(),
            ..PlotLevel::plain(at, Ink::Limit)
        });
        Plot {
            levels: level.into_iter().collect(),
            ..Plot::new(
                "",
                PlotAxis::logarithmic(self.axes[0]),
                PlotAxis::logarithmic(self.axes[1]),
            )
            .with([
                PlotSeries::line("", Ink::Quiet, 1.0, points(&best)),
                PlotSeries::rings("", Ink::Text, 7.0, points(&chosen)),
                PlotSeries::dots("", Ink::Series, 3.5, points(&full)).labelled(labels(&full)),
                PlotSeries::rings("", Ink::Series, 3.5, points(&hollow)).labelled(labels(&hollow)),
            ])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_joined_and_what_lies_beside_it_is_hollow() {
        let mark = |cost: f64, error: f64| ScatterPoint {
            at: [cost, error],
            label: [format!("{cost}"), String::new()],
        };
        let marks = [mark(1.0, 0.5), mark(5.0, 0.4), mark(4.0, 0.2)];
        let scatter = ScatterPlot {
            axes: ["cost", "error"],
            marks: &marks,
            has_front: true,
            chosen: Some(2),
            level: Some(0.0),
        };
        let plot = scatter.plot();
        assert!(plot.levels.is_empty());
        let points: Vec<usize> = plot.series.iter().map(|one| one.points.len()).collect();
        assert_eq!(points, [2, 1, 2, 1]);
        assert_eq!(plot.series[3].points, [[5.0, 0.4]]);
        let all = ScatterPlot { has_front: false, ..scatter };
        assert_eq!(all.plot().series[2].points.len(), 3);
    }
}
