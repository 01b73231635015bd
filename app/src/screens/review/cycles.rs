//! Every cycle of every session shown: its peak, where it was, and how it compares with the first.

use super::ReviewScreen;
use super::left::quiet_ui;
use super::middle::head_ui;
use super::subject::Subject;
use crate::widgets::table::{Column, Row, table_ui};
use crate::workers::review::Quantity;
use eframe::egui::Ui;

/// A cycle of a session.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cycle {
    /// Its number, from 1.
    pub number: u32,
    /// Highest force in N.
    pub peak_n: f64,
    /// When, in s since the first sample.
    pub peak_t: f64,
    /// Depth there in mm.
    pub depth_mm: Option<f64>,
    /// When it began and ended.
    pub t: [f64; 2],
}

/// The cycles of a session, as far as it was read.
pub(super) fn cycles(subject: &Subject) -> Vec<Cycle> {
    let recording = &subject.recording;
    let track = &recording.track;
    let mut found = Vec::new();
    for (index, stretch) in recording.cycles.iter().enumerate() {
        let next = recording.cycles.get(index + 1);
        let end = next.map_or(track.len(), |next| next.first);
        if stretch.what == 0 {
            continue;
        }
        let Some([_, (peak_t, peak_n)]) =
            track.extremes(Quantity::Force as usize, stretch.first, end)
        else {
            continue;
        };
        let place = track.place(peak_t);
        found.push(Cycle {
            number: stretch.what,
            peak_n,
            peak_t,
            depth_mm: place.and_then(|place| track.value(Quantity::Depth as usize, place)),
            t: [
                stretch.t,
                track.time_of(end.saturating_sub(1)).unwrap_or(stretch.t),
            ],
        });
    }
    found
}

impl ReviewScreen {
    pub(super) fn cycles_ui(&self, ui: &mut Ui) {
        let words = "the highest force of every cycle; 'palpate cycles' tells hysteresis, relaxation and shift";
        head_ui(ui, "Cycles", words);
        let columns = [
            Column::words("session", 200.0),
            Column::numbers("cycle", 50.0),
            Column::numbers("begins (s)", 84.0),
            Column::numbers("lasts (s)", 84.0),
            Column::numbers("peak force (N)", 104.0),
            Column::numbers("depth there (mm)", 120.0),
            Column::numbers("of the first (%)", 110.0),
        ];
        let mut rows = Vec::new();
        for subject in &self.subjects {
            let own = cycles(subject);
            let first = own.first().map(|cycle| cycle.peak_n);
            rows.extend(own.iter().map(|cycle| {
                let share = first
                    .filter(|first| *first != 0.0)
                    .map(|first| cycle.peak_n / first);
                let cells = vec![
                    subject.name.clone(),
                    cycle.number.to_string(),
                    format!("{:.2}", cycle.t[0]),
                    format!("{:.2}", cycle.t[1] - cycle.t[0]),
                    format!("{:.4}", cycle.peak_n),
                    cycle.depth_mm.map_or("-".into(), |mm| format!("{mm:.4}")),
                    share.map_or("-".into(), |share| format!("{:.2}", 100.0 * share)),
                ];
                Row {
                    cells,
                    ..Row::default()
                }
            }));
        }
        if rows.is_empty() {
            quiet_ui(ui, "no session shown has cycles");
            return;
        }
        table_ui(ui, "review_cycles", &columns, &rows);
    }
}
