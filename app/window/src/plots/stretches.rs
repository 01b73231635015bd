//! The points that are drawn of one quantity of one session, found again when the part shown, the width or the samples
//! change.

use eframe::egui::Color32;
use egui_plot::{Line, PlotPoint, PlotPoints};
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

/// Points of one line without gaps in between them, and which belong together.
#[derive(Debug, Default)]
pub struct Stretches {
    key: Option<LineWindow>,
    points: Vec<PlotPoint>,
    ranges: Vec<Range<usize>>,
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
    }

    /// The points of each stretch.
    pub fn parts(&self) -> impl Iterator<Item = &[PlotPoint]> {
        self.ranges.iter().map(|range| &self.points[range.clone()])
    }

    /// A line for each stretch, all of one name.
    pub fn lines<'a>(
        &'a self,
        name: &'a str,
        id: usize,
        color: Color32,
    ) -> impl Iterator<Item = Line<'a>> {
        self.ranges.iter().enumerate().map(move |(number, range)| {
            Line::new(name, PlotPoints::Borrowed(&self.points[range.clone()]))
                .id((id, number))
                .color(color)
                .width(1.4)
                .allow_hover(false)
        })
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
        assert_eq!(stretches.lines("force", 0, Color32::TRANSPARENT).count(), 2);
        window.version = 2;
        stretches.update(&track, 0, window);
        window.window = [2.0, 2.5];
        stretches.update(&track, 0, window);
        assert_eq!(stretches.found, 3);
    }
}
