//! The points that are drawn of one quantity of one session, found again when the part shown, the width or the samples
//! change.

use eframe::egui::Color32;
use egui_plot::{FilledArea, Line, PlotPoint, PlotPoints, PlotUi};
use palpate_model::signal::track::{DrawStatistics, SignalTrack};
use std::ops::Range;

/// What the points of a line depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineWindow {
    /// The part of the axis that is shown, in s.
    pub window: [f64; 2],
    /// Pixels across it.
    pub pixels: f64,
    /// Time of the track at the axis' zero, in s.
    pub shift: f64,
    /// Changes with the track.
    pub version: u64,
}

/// Width of a line, of the one in front of others, and of a fit over them, in points.
pub const WIDTH: f32 = 1.4;
pub const FRONT_WIDTH: f32 = 2.2;
pub const FIT_WIDTH: f32 = 0.9;
/// Share of the colour of a line in the area around it, so that ten of them over each other stay distinct.
pub const AREA: f32 = 0.22;

/// Columns of samples without a gap in between them: their lowest, highest and mean values.
#[derive(Debug, Default, PartialEq)]
pub struct ColumnBand {
    pub times: Vec<f64>,
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    pub mean: Vec<PlotPoint>,
}

/// Points of one line without gaps in between them, and which belong together.
#[derive(Debug, Default)]
pub struct Stretches {
    key: Option<LineWindow>,
    points: Vec<PlotPoint>,
    ranges: Vec<Range<usize>>,
    /// Where not every sample is drawn.
    bands: Vec<ColumnBand>,
    y: Option<[f64; 2]>,
    drawn: DrawStatistics,
    found: u64,
}

impl Stretches {
    /// Finds the points again where something changed.
    pub fn update(&mut self, track: &SignalTrack, column: usize, window: LineWindow) {
        if self.key.replace(window) == Some(window) {
            return;
        }
        self.found += 1;
        self.points.clear();
        self.ranges.clear();
        let (points, ranges) = (&mut self.points, &mut self.ranges);
        let mut start = 0;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let own = window.window.map(|end| end + window.shift);
        self.drawn = track.draw(column, own, window.pixels, |point| match point {
            Some([t, value]) => {
                (low, high) = (low.min(value), high.max(value));
                points.push(PlotPoint::new(t - window.shift, value));
            }
            None => {
                if points.len() > start {
                    ranges.push(start..points.len());
                }
                start = points.len();
            }
        });
        if points.len() > start {
            ranges.push(start..points.len());
        }
        self.y = (low <= high).then_some([low, high]);
        self.bands.clear();
        if self.drawn.samples_per_column > 1 {
            self.find_bands(track, column, own, window);
        }
    }

    fn find_bands(&mut self, track: &SignalTrack, column: usize, own: [f64; 2], of: LineWindow) {
        let bands = &mut self.bands;
        let mut is_broken = true;
        track.columns(column, own, of.pixels, |[from, to], found| {
            let Some(found) = found else {
                is_broken = true;
                return;
            };
            if std::mem::replace(&mut is_broken, found.has_gap) {
                bands.push(ColumnBand::default());
            }
            let Some(band) = bands.last_mut() else { return };
            let t = 0.5 * (from + to) - of.shift;
            band.times.push(t);
            band.low.push(f64::from(found.low));
            band.high.push(f64::from(found.high));
            band.mean.push(PlotPoint::new(t, f64::from(found.mean)));
        });
    }

    /// The areas between the lowest and the highest samples; none where every sample is drawn.
    pub fn bands(&self) -> &[ColumnBand] {
        &self.bands
    }

    /// The line of each stretch: every sample, or the means of columns.
    pub fn parts(&self) -> impl Iterator<Item = &[PlotPoint]> {
        let samples = self.ranges.iter().map(|range| &self.points[range.clone()]);
        let has_all = self.bands.is_empty();
        let means = self.bands.iter().map(|band| band.mean.as_slice());
        samples.filter(move |_| has_all).chain(means)
    }

    /// Draws the line, and the area of the samples behind it where it is the one of their means.
    pub fn paint<'a>(
        &'a self,
        plot_ui: &mut PlotUi<'a>,
        name: &'a str,
        id: usize,
        (color, width): (Color32, f32),
    ) {
        for (number, band) in self.bands.iter().enumerate() {
            let area = FilledArea::new(name, &band.times, &band.low, &band.high);
            let area = area.fill_color(color.gamma_multiply(AREA)).id((id, "area", number));
            plot_ui.add(area.allow_hover(false));
        }
        for (number, points) in self.parts().enumerate() {
            let line = Line::new(name, PlotPoints::Borrowed(points)).id((id, number));
            plot_ui.line(line.color(color).width(width).allow_hover(false));
        }
    }

    /// Lowest and highest of what is drawn.
    pub fn y(&self) -> Option<[f64; 2]> {
        self.y
    }

    /// How much was drawn, and how far it is thinned.
    pub fn drawn(&self) -> DrawStatistics {
        self.drawn
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::signal::track::TrackSegment;
    use std::sync::Arc;

    #[test]
    fn points_are_found_once_for_a_view_and_gaps_part_them() {
        let times: Vec<f64> = (0..5000).map(|i| f64::from(i) * 1e-3).collect();
        let values = (0..5000).map(|i| match i {
            2000..2600 => f32::NAN,
            3000 => 9.0,
            _ => 1.0,
        });
        let mut track = SignalTrack::default();
        track.push(Arc::new(TrackSegment::new(times, &[values.collect()])));
        let mut stretches = Stretches::default();
        let mut window = LineWindow { window: [-1.0, 4.0], pixels: 100.0, shift: 1.0, version: 1 };
        for _ in 0..3 {
            stretches.update(&track, 0, window);
        }
        assert_eq!((stretches.found, stretches.y()), (1, Some([1.0, 9.0])));
        assert!(stretches.drawn().points <= 202 && stretches.drawn().samples_per_column == 64);
        let ends: Vec<[f64; 2]> = stretches
            .ranges
            .iter()
            .map(|one| [one.start, one.end - 1])
            .map(|ends| ends.map(|at| stretches.points[at].x))
            .collect();
        assert_eq!(ends.len(), 2);
        // The first and the last sample, on the axis that begins where it was asked to.
        assert_eq!((ends[0][0], ends[1][1]), (-1.0, 4999.0 * 1e-3 - 1.0));
        assert!(ends[0][1] < 1.0 && ends[1][0] >= 1.6);
        // What is drawn is the mean with the area around it, whose highest is the one sample that stands out.
        let highest = |one: &ColumnBand| one.high.iter().copied().fold(0.0, f64::max);
        assert!(stretches.bands().iter().any(|one| highest(one) == 9.0));
        let drawn: Vec<&PlotPoint> = stretches.parts().flatten().collect();
        assert!(drawn.iter().all(|point| (1.0..1.2).contains(&point.y)));
        assert!(drawn.len() < 100, "one point of a column");
        window.version = 2;
        stretches.update(&track, 0, window);
        window.window = [2.0, 2.5];
        stretches.update(&track, 0, window);
        assert_eq!(stretches.found, 3);
    }
}
