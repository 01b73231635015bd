//! The points that are drawn of one quantity of one session, found again when the part shown, the width or the samples
//! change.

use eframe::egui::Color32;
use egui_plot::{FilledArea, Line, PlotPoint, PlotPoints, PlotUi};
use palpate_model::signal::track::SignalTrack;

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

/// The points of one line, parted at gaps.
#[derive(Debug, Default)]
pub struct Stretches {
    key: Option<LineWindow>,
    bands: Vec<ColumnBand>,
    y: Option<[f64; 2]>,
    samples_per_column: usize,
    found: u64,
}

impl Stretches {
    /// Finds the points again where something changed.
    pub fn update(&mut self, track: &SignalTrack, column: usize, window: LineWindow) {
        if self.key.replace(window) == Some(window) {
            return;
        }
        self.found += 1;
        self.bands.clear();
        let own = window.window.map(|end| end + window.shift);
        self.samples_per_column = track.samples_per_column(column, own, window.pixels);
        let bands = &mut self.bands;
        let [mut lowest, mut highest] = [f64::INFINITY, f64::NEG_INFINITY];
        let mut is_broken = true;
        track.columns(column, own, window.pixels, |[from, to], found| {
            let Some(found) = found else {
                is_broken = true;
                return;
            };
            if std::mem::replace(&mut is_broken, found.has_gap) {
                bands.push(ColumnBand::default());
            }
            let Some(band) = bands.last_mut() else { return };
            let t = 0.5 * (from + to) - window.shift;
            let [low, high] = [found.low, found.high].map(f64::from);
            (lowest, highest) = (lowest.min(low), highest.max(high));
            band.times.push(t);
            band.low.push(low);
            band.high.push(high);
            band.mean.push(PlotPoint::new(t, f64::from(found.mean)));
        });
        self.y = (lowest <= highest).then_some([lowest, highest]);
    }

    /// The areas between the lowest and the highest samples; none where every sample is drawn.
    pub fn bands(&self) -> &[ColumnBand] {
        if self.samples_per_column > 1 { &self.bands } else { &[] }
    }

    /// The line of each stretch: every sample, or the means of columns.
    pub fn parts(&self) -> impl Iterator<Item = &[PlotPoint]> {
        self.bands.iter().map(|band| band.mean.as_slice())
    }

    /// Draws the line, and the area of the samples behind it where it is the one of their means.
    pub fn paint<'a>(
        &'a self,
        plot_ui: &mut PlotUi<'a>,
        name: &'a str,
        id: usize,
        (color, width): (Color32, f32),
    ) {
        for (number, band) in self.bands().iter().enumerate() {
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

    /// Samples of whose mean a point is; 1 where every sample is drawn.
    pub fn samples_per_column(&self) -> usize {
        self.samples_per_column
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
        assert_eq!(stretches.samples_per_column(), 64);
        let ends: Vec<[f64; 2]> = stretches
            .bands()
            .iter()
            .map(|one| [one.times[0], *one.times.last().unwrap()])
            .collect();
        // Behind every column with a gap a stretch ends, so one that begins within the gap is alone.
        assert_eq!(ends.len(), 3);
        assert!(ends[0][0] < -1.0 + 0.064 && ends[2][1] > 4.0 - 0.064);
        assert!(ends[0][1] < 1.064 && ends[1][0] == ends[1][1] && ends[2][0] >= 1.6);
        // What is drawn is the mean with the area around it, whose highest is the one sample that stands out.
        let highest = |one: &ColumnBand| one.high.iter().copied().fold(0.0, f64::max);
        assert!(stretches.bands().iter().any(|one| highest(one) == 9.0));
        let drawn: Vec<&PlotPoint> = stretches.parts().flatten().collect();
        assert!(drawn.iter().all(|point| (1.0..1.2).contains(&point.y)));
        assert!(drawn.len() < 100, "one point of a column");
        window.version = 2;
        stretches.update(&track, 0, window);
        // So few that every sample is drawn, without an area around it.
        window.window = [1.9995, 2.0995];
        stretches.update(&track, 0, window);
        assert_eq!((stretches.found, stretches.bands().len()), (3, 0));
        let times: Vec<f64> = stretches.parts().flatten().map(|point| point.x).collect();
        assert_eq!((times.len(), times[1]), (102, 2.0));
    }
}
