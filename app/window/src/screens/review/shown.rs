//! What is on the screen, for exports of exactly that.

use super::{Looked, ReviewScreen, View};
use crate::plots::stretches::{LineWindow, Stretches};
use crate::workers::review::{Quantity, TimeOrigin};

/// A session as it is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownSession {
    /// Which, and how it is read.
    pub looked: Looked,
    /// What it is called.
    pub name: String,
    /// Its place among the colours of sessions.
    pub color: usize,
    /// Time since its first sample that stands at zero, in s.
    pub shift_s: f64,
    /// Whether all of it was read.
    pub is_whole: bool,
}

/// One line of a plot over time.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownSeries {
    /// Which of the sessions.
    pub session: usize,
    /// What is drawn.
    pub quantity: Quantity,
    /// Time on the axis in s and value in the quantity's unit, in stretches without gaps.
    pub stretches: Vec<Vec<[f64; 2]>>,
    /// Samples that share a lowest and a highest one; 1 where every sample is there.
    pub samples_per_column: usize,
}

/// What is on the screen.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Which view.
    pub view: View,
    /// What stands at time zero.
    pub time_origin: TimeOrigin,
    /// The sessions, the one in front first.
    pub sessions: Vec<ShownSession>,
    /// Quantities over time, from above.
    pub quantities: Vec<Quantity>,
    /// Times shown, in s from time zero.
    pub time_s: [f64; 2],
    /// Depths shown, in mm.
    pub depth_mm: [f64; 2],
    /// Forces shown over depth, in N.
    pub force_n: [f64; 2],
    /// The cursors, in s from time zero.
    pub cursors_s: [Option<f64>; 2],
}

impl ReviewScreen {
    /// What is on the screen.
    pub fn shown(&self) -> Shown {
        let colors = palpate_figures::tokens::LIGHT.sessions.len() as u64;
        let session = |subject: &super::ReviewSubject| ShownSession {
            looked: subject.looked.clone(),
            name: subject.name.clone(),
            color: (subject.id % colors) as usize,
            shift_s: subject.shift(self.time_origin),
            is_whole: subject.recording.share() >= 1.0,
        };
        Shown {
            view: self.view,
            time_origin: self.time_origin,
            sessions: self.subjects.iter().map(session).collect(),
            quantities: self.quantities.clone(),
            time_s: self.time.shown(),
            depth_mm: self.depth.shown(),
            force_n: self.force.shown(),
            cursors_s: self.cursors,
        }
    }

    /// The lines of the plots over time as they are shown, for a picture of so many columns.
    pub fn series(&self, columns: usize) -> Vec<ShownSeries> {
        let mut series = Vec::new();
        for quantity in &self.quantities {
            for (session, subject) in self.subjects.iter().enumerate() {
                let mut lines = Stretches::default();
                let wanted = LineWindow {
                    window: self.time.shown(),
                    pixels: columns as f64,
                    shift: subject.shift(self.time_origin),
                    version: 0,
                };
                lines.update(&subject.recording.track, *quantity as usize, wanted);
                let places = |piece: &[egui_plot::PlotPoint]| {
                    piece.iter().map(|point| [point.x, point.y]).collect()
                };
                series.push(ShownSeries {
                    session,
                    quantity: *quantity,
                    stretches: lines.pieces().map(places).collect(),
                    samples_per_column: lines.drawn().samples_per_column,
                });
            }
        }
        series
    }
}
